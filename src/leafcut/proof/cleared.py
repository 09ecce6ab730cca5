"""Places that earlier cuts of a program have cleared, so that a rapid may go down there."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import tool_in_comments
from leafcut.geometry.arrays import Mask
from leafcut.material.straight_moves import straight_moves
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath

#: Room for the rounding of written heights, mm.
_ROOM = 0.002
#: A tool that is nearer than this to the middle of a cut is on it, mm.
_ON = 0.01
#: A wall is not cut by less than this, mm: chords, rounding, and the polygons that stand for circles.
_GRAZE = 0.02
#: Segments of a quarter of a circle.
_SEGMENTS = 16
#: Swept areas that are joined at once.
_AT_ONCE = 6
#: Most cuts whose areas are joined for one rapid: others clear nothing.
_MOST_CUTS = 200
#: Most rapids that are compared with the areas of cuts: others are unchecked.
_MOST_RAPIDS = 1000
#: Rapids that are compared with the middles of cuts at once.
_RAPIDS_AT_ONCE = 256


class _Cuts(NamedTuple):
    """Straight cuts: ends, float64[n, 4], mm; height at or below which each is, and its row, each [n]."""

    ends: NDArray[np.float64]
    z: NDArray[np.float64]
    row: NDArray[np.int64]


class _Stages(NamedTuple):
    """Which rows of a path have something in common.

    Attributes
    ----------
    setup
        int64[n, 3]: rows that differ have no places in common: work offset, shifts, stops. At a stop (M0, M1, M60, or
        a block that is not understood) the part may be turned over, and the tool changed.
    stage
        int64[n]: rises at each stop and each change of tool: the tool stays the same within a stage.
    offset
        int64[n]: length offset; within a stage, another one means other heights.
    """

    setup: NDArray[np.int64]
    stage: NDArray[np.int64]
    offset: NDArray[np.int64]

    @classmethod
    def of(cls, path: Toolpath) -> _Stages:
        """Return those of a path."""
        stop = (path.kind == Kind.PAUSE) | (path.kind == Kind.FOREIGN)
        frame, shift = path.latest(Kind.FRAME, path.ref, 540), path.latest(Kind.SHIFT, path.ref)
        stage = np.cumsum(stop | (path.kind == Kind.TOOL))
        return cls(np.column_stack([frame, shift, np.cumsum(stop)]), stage, path.offset)

    def comparable(self, earlier: NDArray[np.int64], row: NDArray[np.int64]) -> Mask:
        """Return which earlier rows have places and heights in common with `row`."""
        other_height = (self.stage[earlier] == self.stage[row]) & (self.offset[earlier] != self.offset[row])
        same: Mask = (self.setup[earlier] == self.setup[row]).all(axis=1) & ~other_height
        return same


def cleared_before(
    program: Program, rows: NDArray[np.int32], path: Toolpath, down: NDArray[np.int64]
) -> tuple[Mask, Mask]:
    """Return which rapids straight down end where earlier cuts have removed the material, and which are unchecked.

    Both are bool[len(down)]. A cut clears its own middle for the same tool, whatever its shape, until the next stop or
    change of tool. Flat mills clear what they sweep: if the diameters are known from the comments, the tool must fit
    into the union of these areas.

    Parameters
    ----------
    rows
        The row of the program's path that each row of `path`, with its cycles written out, comes from.
    down
        Rows of these rapids in `path`, ascending.
    """
    unchecked = np.zeros(len(down), dtype=bool)
    stages = _Stages.of(path)
    cuts = _cuts(path)
    if not len(cuts.row):
        return unchecked.copy(), unchecked
    lines: NDArray[Any] = np.asarray(shapely.linestrings(cuts.ends.reshape(-1, 2, 2)))
    tree = shapely.STRtree(lines)
    cleared = _on_own_path(path, stages, cuts, tree, down)
    rest = np.flatnonzero(~cleared)
    tools = _tools(program, rows, path, stages, down[rest])
    radius = {stage: 0.5 * tool.diameter for stage, tool in tools.items()}
    swept = {stage: radius[stage] if _is_flat(tool) else 0.0 for stage, tool in tools.items()}
    width = np.array([swept.get(stage, 0.0) for stage in stages.stage[cuts.row].tolist()])
    reach, checked = float(width.max()), 0
    for at in rest.tolist():
        row = int(down[at])
        if (own := radius.get(int(stages.stage[row]))) is None:
            continue
        place = shapely.Point(path.end[row, :2])
        near = np.asarray(tree.query(place, predicate="dwithin", distance=reach + own))
        near = near[(width[near] > 0.0) & (cuts.row[near] < row) & (cuts.z[near] <= path.end[row, 2] + _ROOM)]
        near = near[stages.comparable(cuts.row[near], np.full(len(near), row))]
        if not len(near):
            continue
        if checked >= _MOST_RAPIDS:
            unchecked[at] = True
            continue
        checked += 1
        cleared[at] = _covered(
            place, own, tree, near, np.asarray(shapely.distance(tree.geometries[near], place)), width
        )
    return cleared, unchecked


def _on_own_path(path: Toolpath, stages: _Stages, cuts: _Cuts, tree: shapely.STRtree, down: NDArray[np.int64]) -> Mask:
    """Return which rapids end on earlier cuts of the same stage that are at least as deep."""
    result = np.zeros(len(down), dtype=bool)
    for begin in range(0, len(down), _RAPIDS_AT_ONCE):
        some = down[begin : begin + _RAPIDS_AT_ONCE]
        at, near = tree.query(shapely.points(path.end[some, :2]), predicate="dwithin", distance=_ON)
        row, cut = some[at], cuts.row[near]
        own = (cut < row) & (cuts.z[near] <= path.end[row, 2] + _ROOM) & (stages.stage[cut] == stages.stage[row])
        at, row, cut = at[own], row[own], cut[own]
        result[begin + at[stages.comparable(cut, row)]] = True
    return result


def _is_flat(tool: Tool) -> bool:
    return tool.kind is ToolKind.END_MILL and not tool.corner_radius


def _covered(
    place: shapely.Point,
    radius: float,
    tree: shapely.STRtree,
    near: NDArray[np.int64],
    away: NDArray[np.float64],
    width: NDArray[np.float64],
) -> bool:
    """Return whether a tool at a place is inside the areas that cuts sweep with their own radius `width`."""
    # The polygon contains its circle, and those of the cuts lie inside theirs.
    left: BaseGeometry = place.buffer((radius - _GRAZE) / np.cos(0.25 * np.pi / _SEGMENTS), quad_segs=_SEGMENTS)
    # Nearest first: those that cover most of it, then the rest.
    near = near[np.argsort(away, kind="stable")][:_MOST_CUTS]
    # Most places that are not cleared show it at their edge.
    edge: NDArray[Any] = np.asarray(shapely.points(shapely.get_coordinates(left)[:: _SEGMENTS // 4]))
    if not (shapely.distance(edge[:, None], tree.geometries[near]) <= width[near]).any(axis=1).all():
        return False
    for begin in range(0, len(near), _AT_ONCE):
        some = near[begin : begin + _AT_ONCE]
        swept = shapely.buffer(tree.geometries[some], width[some], quad_segs=_SEGMENTS)
        left = left.difference(shapely.union_all(swept))
        if left.is_empty:
            return True
    return False


def _cuts(path: Toolpath) -> _Cuts:
    """Return the cuts of a path; the ends of a slanting one are places with a height of their own.

    Where a cut begins at an unknown place, its end alone counts. What the tool sweeps beside a path that the controller
    compensates (G41, G42) is unknown.
    """
    moves = straight_moves(path, 0.25 * _GRAZE, np.inf)
    aside = path.latest(Kind.RADIUS, path.ref, 40)[moves.row] != 40
    aside &= (moves.ends[:, :2] != moves.ends[:, 3:5]).any(axis=1)
    fed = np.flatnonzero(~moves.rapid & ~aside)
    end = moves.ends[fed, 3:]
    begin = np.where(np.isin(moves.row[fed], moves.unknown)[:, None], end, moves.ends[fed, :3])
    slants = np.flatnonzero(np.abs(begin[:, 2] - end[:, 2]) > 0.0)
    which = np.concatenate([np.arange(len(fed)), slants, slants])
    ends = np.concatenate(
        [np.hstack([begin[:, :2], end[:, :2]]), *(np.tile(place[slants, :2], 2) for place in (begin, end))]
    )
    z = np.concatenate([np.maximum(begin[:, 2], end[:, 2]), begin[slants, 2], end[slants, 2]])
    return _Cuts(ends, z, moves.row[fed][which])


def _tools(
    program: Program,
    rows: NDArray[np.int32],
    path: Toolpath,
    stages: _Stages,
    down: NDArray[np.int64],
) -> dict[int, Tool]:
    """Return the tools that the comments describe, by stage, of rapids `down` and of the cuts to compare with them."""
    stops = stages.setup[:, 2]
    fed = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW))
    used = np.union1d(fed[np.isin(stops[fed], stops[down])], down)
    numbers, first = np.unique(stages.stage[used], return_index=True)
    blocks = np.searchsorted(program.first, rows, side="right") - 1
    # A comment before the last cut of an earlier stage describes the tool of that.
    earlier = np.searchsorted(stages.stage[fed], numbers) - 1
    since = np.where(earlier >= 0, program.text_line[blocks[fed[earlier]]], 0)
    found = {}
    for stage, block, line in zip(numbers.tolist(), blocks[used[first]].tolist(), since.tolist(), strict=True):
        tool = tool_in_comments(program, block, line)
        if tool is not None:
            found[stage] = tool
    return found
