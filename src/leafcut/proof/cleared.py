"""Positions that earlier cuts of a program have cleared, so that a rapid may descend there."""

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

#: Tolerance for rounded heights, mm.
_ROOM = 0.002
#: Maximum distance of a tool from the centre line of a cut that it is on, mm.
_ON = 0.01
#: Minimum overlap with a wall that counts as a cut, mm: chords, rounding, and polygons for circles.
_GRAZE = 0.02
#: Segments per quarter circle.
_SEGMENTS = 16
#: Number of swept areas joined at a time.
_AT_ONCE = 6
#: Maximum number of cuts whose areas are joined for one rapid; others clear nothing.
_MOST_CUTS = 200
#: Maximum number of rapids that are compared with the areas of cuts; others are unchecked.
_MOST_RAPIDS = 1000
#: Number of rapids compared with centre lines of cuts at a time.
_RAPIDS_AT_ONCE = 256


class _Cuts(NamedTuple):
    """Straight cuts: ends, float64[n, 4], mm; upper limit of the height of each, and its row, each [n]."""

    ends: NDArray[np.float64]
    z: NDArray[np.float64]
    row: NDArray[np.int64]


class _Stages(NamedTuple):
    """Rows of a path that share a set-up or a tool.

    Attributes
    ----------
    setup
        int64[n, 3]: work offset, shifts, stops. Rows with different values share no positions. At a stop (M0, M1, M60,
        or a block that is not understood), the part may be turned over and the tool changed.
    stage
        int64[n]: increases at each stop and tool change; the tool stays the same within a stage.
    offset
        int64[n]: length offset; a different value within a stage means different heights.
    """

    setup: NDArray[np.int64]
    stage: NDArray[np.int64]
    offset: NDArray[np.int64]

    @classmethod
    def of(cls, path: Toolpath) -> _Stages:
        """Return the stages of a path."""
        stop = (path.kind == Kind.PAUSE) | (path.kind == Kind.FOREIGN)
        frame, shift = path.latest(Kind.FRAME, path.ref, 540), path.latest(Kind.SHIFT, path.ref)
        stage = np.cumsum(stop | (path.kind == Kind.TOOL))
        return cls(np.column_stack([frame, shift, np.cumsum(stop)]), stage, path.offset)

    def comparable(self, earlier: NDArray[np.int64], row: NDArray[np.int64]) -> Mask:
        """Return which earlier rows share positions and heights with `row`."""
        other_height = (self.stage[earlier] == self.stage[row]) & (self.offset[earlier] != self.offset[row])
        same: Mask = (self.setup[earlier] == self.setup[row]).all(axis=1) & ~other_height
        return same


def cleared_before(
    program: Program, rows: NDArray[np.int32], path: Toolpath, down: NDArray[np.int64]
) -> tuple[Mask, Mask]:
    """Return which straight-down rapids end where earlier cuts removed the material, and which are unchecked.

    Both are bool[len(down)]. A cut clears its own centre line for the same tool of any shape, until the next stop or
    tool change. Flat mills clear the area that they sweep: if the diameters are known from the comments, the tool must
    fit into the union of these areas.

    Parameters
    ----------
    rows
        Source row in the program's path of each row of `path`, which has expanded cycles.
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
    """Return whether a tool at a position is inside the areas swept by cuts with their own radius `width`."""
    # This polygon contains its circle, and those of the cuts lie inside theirs.
    left: BaseGeometry = place.buffer((radius - _GRAZE) / np.cos(0.25 * np.pi / _SEGMENTS), quad_segs=_SEGMENTS)
    # Nearest first: these cover most of it.
    near = near[np.argsort(away, kind="stable")][:_MOST_CUTS]
    # Most uncovered positions are detected at their edge.
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
    """Return the cuts of a path; the ends of a slanting cut are points with their own heights.

    If the start of a cut is unknown, only its end counts. The swept area beside a path that the controller compensates
    (G41, G42) is unknown.
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
    """Return the tools described by comments, by stage, for the rapids `down` and the cuts to compare with them."""
    stops = stages.setup[:, 2]
    fed = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW))
    used = np.union1d(fed[np.isin(stops[fed], stops[down])], down)
    numbers, first = np.unique(stages.stage[used], return_index=True)
    blocks = np.searchsorted(program.first, rows, side="right") - 1
    # A comment before the last cut of an earlier stage describes that stage's tool.
    earlier = np.searchsorted(stages.stage[fed], numbers) - 1
    since = np.where(earlier >= 0, program.text_line[blocks[fed[earlier]]], 0)
    found = {}
    for stage, block, line in zip(numbers.tolist(), blocks[used[first]].tolist(), since.tolist(), strict=True):
        tool = tool_in_comments(program, block, line)
        if tool is not None:
            found[stage] = tool
    return found
