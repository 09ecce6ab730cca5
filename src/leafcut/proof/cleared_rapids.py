"""Find positions that earlier cuts of a program have cleared, so that a rapid may descend there."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from leafcut.gcode.program import Program
from leafcut.gcode.tool_comments import tool_in_comments
from leafcut.geometry.arrays import Mask
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath

#: Tolerance for rounded heights, mm.
_TOLERANCE = 0.002
#: A tool is on a cut if it is within this distance of the centre line of the cut, mm.
_ON_CUT = 0.01
#: An overlap with a wall counts as a cut from this depth on, mm. The value allows for chords, rounding, and polygons
#: for circles.
_GRAZE = 0.02
#: Number of segments per quarter circle.
_SEGMENTS = 16
#: Number of swept areas that are merged at a time.
_BATCH = 6
#: At most this many cuts are merged into an area for a rapid. Other cuts are ignored.
_MOST_CUTS = 200
#: At most this many rapids are compared with the areas of cuts. Other rapids remain unchecked.
_MOST_RAPIDS = 1000
#: Number of rapids that are compared with centre lines of cuts at a time.
_RAPID_BATCH = 256


class _Cuts(NamedTuple):
    """Straight cuts, stored in columns.

    The columns are the coordinates of both ends (float64[n, 4], mm), the height of the higher end (mm), and the row in
    the toolpath.
    """

    ends: NDArray[np.float64]
    z: NDArray[np.float64]
    row: NDArray[np.int64]


class _Stages(NamedTuple):
    """The set-up and the tool stage of each row of a path.

    Attributes
    ----------
    setup
        Work offset, shifts and stops, int64[n, 3]. Positions with different values cannot be compared. At a stop (M0,
        M1, M60, or a block that is not understood), the operator may turn the part over and change the tool.
    stage
        Number that increases at each stop and tool change, int64[n]. The tool stays the same within a stage.
    offset
        Length offset, int64[n]. Within a stage, a different value means different heights.
    """

    setup: NDArray[np.int64]
    stage: NDArray[np.int64]
    offset: NDArray[np.int64]

    @classmethod
    def from_path(cls, path: Toolpath) -> _Stages:
        stop = (path.kind == Kind.PAUSE) | (path.kind == Kind.FOREIGN)
        frame, shift = path.latest(Kind.FRAME, path.ref, 540), path.latest(Kind.SHIFT, path.ref)
        stage = np.cumsum(stop | (path.kind == Kind.TOOL))
        return cls(np.column_stack([frame, shift, np.cumsum(stop)]), stage, path.length_offset)

    def comparable_mask(self, earlier: NDArray[np.int64], row: NDArray[np.int64]) -> Mask:
        other_height = (self.stage[earlier] == self.stage[row]) & (self.offset[earlier] != self.offset[row])
        result: Mask = (self.setup[earlier] == self.setup[row]).all(axis=1) & ~other_height
        return result


def find_cleared_descents(
    program: Program, rows: NDArray[np.int32], path: Toolpath, descents: NDArray[np.int64]
) -> tuple[Mask, Mask]:
    """Check straight-down rapids against the material that earlier cuts removed.

    A rapid is cleared if it ends in the removed material. Until the next stop or tool change, a cut clears its own
    centre line for its tool, whatever the shape of the tool. A flat mill also clears the area that it sweeps. If
    comments state the diameters, the tool of the rapid must fit into the union of these areas.

    Parameters
    ----------
    rows
        Row in the program's path for each row of `path`.
    path
        Toolpath with expanded cycles.
    descents
        Rows of the straight-down rapids in `path`, in ascending order.

    Returns
    -------
    tuple
        Masks of the cleared rapids and of the unchecked rapids, bool[len(descents)].
    """
    unchecked = np.zeros(len(descents), dtype=bool)
    stages = _Stages.from_path(path)
    cuts = _collect_cuts(path)
    if not len(cuts.row):
        return unchecked.copy(), unchecked
    lines: NDArray[Any] = np.asarray(shapely.linestrings(cuts.ends.reshape(-1, 2, 2)))
    tree = shapely.STRtree(lines)
    cleared = _ends_on_earlier_cut(path, stages, cuts, tree, descents)
    unresolved = np.flatnonzero(~cleared)
    tools = _tools_by_stage(program, rows, path, stages, descents[unresolved])
    radius = {stage: 0.5 * tool.diameter for stage, tool in tools.items()}
    swept = {stage: radius[stage] if _is_flat(tool) else 0.0 for stage, tool in tools.items()}
    width = np.array([swept.get(stage, 0.0) for stage in stages.stage[cuts.row].tolist()])
    max_width, n_checked = float(width.max()), 0
    for index in unresolved.tolist():
        row = int(descents[index])
        if (tool_radius := radius.get(int(stages.stage[row]))) is None:
            continue
        point = shapely.Point(path.end[row, :2])
        cuts_near = np.asarray(tree.query(point, predicate="dwithin", distance=max_width + tool_radius))
        cuts_near = cuts_near[
            (width[cuts_near] > 0.0)
            & (cuts.row[cuts_near] < row)
            & (cuts.z[cuts_near] <= path.end[row, 2] + _TOLERANCE)
        ]
        cuts_near = cuts_near[stages.comparable_mask(cuts.row[cuts_near], np.full(len(cuts_near), row))]
        if not len(cuts_near):
            continue
        if n_checked >= _MOST_RAPIDS:
            unchecked[index] = True
            continue
        n_checked += 1
        cleared[index] = _is_covered(
            point, tool_radius, tree, cuts_near, np.asarray(shapely.distance(tree.geometries[cuts_near], point)), width
        )
    return cleared, unchecked


def _ends_on_earlier_cut(
    path: Toolpath, stages: _Stages, cuts: _Cuts, tree: shapely.STRtree, descents: NDArray[np.int64]
) -> Mask:
    """Return a mask of the rapids that end on an earlier cut of the same stage, and no deeper than that cut."""
    result = np.zeros(len(descents), dtype=bool)
    for start in range(0, len(descents), _RAPID_BATCH):
        batch = descents[start : start + _RAPID_BATCH]
        batch_index, cut_index = tree.query(shapely.points(path.end[batch, :2]), predicate="dwithin", distance=_ON_CUT)
        row, cut = batch[batch_index], cuts.row[cut_index]
        valid = (
            (cut < row)
            & (cuts.z[cut_index] <= path.end[row, 2] + _TOLERANCE)
            & (stages.stage[cut] == stages.stage[row])
        )
        batch_index, row, cut = batch_index[valid], row[valid], cut[valid]
        result[start + batch_index[stages.comparable_mask(cut, row)]] = True
    return result


def _is_flat(tool: Tool) -> bool:
    return tool.kind is ToolKind.END_MILL and not tool.corner_radius


def _is_covered(
    point: shapely.Point,
    radius: float,
    tree: shapely.STRtree,
    nearby: NDArray[np.int64],
    distances: NDArray[np.float64],
    width: NDArray[np.float64],
) -> bool:
    """Return whether a tool at a point fits into the area swept by nearby cuts.

    `width` contains the radii of the cuts.
    """
    # This polygon contains its circle, whereas the polygons of the cuts lie inside their circles.
    remaining: BaseGeometry = point.buffer((radius - _GRAZE) / np.cos(0.25 * np.pi / _SEGMENTS), quad_segs=_SEGMENTS)
    # Start with the nearest cuts, because they cover most of the circle.
    nearby = nearby[np.argsort(distances, kind="stable")][:_MOST_CUTS]
    # Most uncovered positions are detected at the edge of the circle.
    edge: NDArray[Any] = np.asarray(shapely.points(shapely.get_coordinates(remaining)[:: _SEGMENTS // 4]))
    if not (shapely.distance(edge[:, None], tree.geometries[nearby]) <= width[nearby]).any(axis=1).all():
        return False
    for start in range(0, len(nearby), _BATCH):
        batch = nearby[start : start + _BATCH]
        swept = shapely.buffer(tree.geometries[batch], width[batch], quad_segs=_SEGMENTS)
        remaining = remaining.difference(shapely.union_all(swept))
        if remaining.is_empty:
            return True
    return False


def _collect_cuts(path: Toolpath) -> _Cuts:
    """Return the cuts of a path. The ends of a slanting cut are added as points with their own heights.

    If the start of a cut is unknown, only its end counts. If the controller applies cutter compensation (G41, G42), the
    cut is skipped, because the area that it sweeps is unknown.
    """
    moves = convert_to_straight_moves(path, 0.25 * _GRAZE, np.inf)
    is_compensated = path.latest(Kind.RADIUS, path.ref, 40)[moves.row] != 40
    is_compensated &= (moves.ends[:, :2] != moves.ends[:, 3:5]).any(axis=1)
    feed_rows = np.flatnonzero(~moves.rapid & ~is_compensated)
    end = moves.ends[feed_rows, 3:]
    start = np.where(np.isin(moves.row[feed_rows], moves.unknown)[:, None], end, moves.ends[feed_rows, :3])
    slanting = np.flatnonzero(np.abs(start[:, 2] - end[:, 2]) > 0.0)
    source = np.concatenate([np.arange(len(feed_rows)), slanting, slanting])
    ends = np.concatenate(
        [np.hstack([start[:, :2], end[:, :2]]), *(np.tile(corner[slanting, :2], 2) for corner in (start, end))]
    )
    z = np.concatenate([np.maximum(start[:, 2], end[:, 2]), start[slanting, 2], end[slanting, 2]])
    return _Cuts(ends, z, moves.row[feed_rows][source])


def _tools_by_stage(
    program: Program,
    rows: NDArray[np.int32],
    path: Toolpath,
    stages: _Stages,
    descents: NDArray[np.int64],
) -> dict[int, Tool]:
    stops = stages.setup[:, 2]
    fed = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW))
    used = np.union1d(fed[np.isin(stops[fed], stops[descents])], descents)
    numbers, first = np.unique(stages.stage[used], return_index=True)
    blocks = program.row_block[rows]
    # A comment before the last cut of an earlier stage describes the tool of that stage.
    earlier = np.searchsorted(stages.stage[fed], numbers) - 1
    since = np.where(earlier >= 0, program.text_line[blocks[fed[earlier]]], 0)
    tools = {}
    for stage, block, line in zip(numbers.tolist(), blocks[used[first]].tolist(), since.tolist(), strict=True):
        tool = tool_in_comments(program, block, line)
        if tool is not None:
            tools[stage] = tool
    return tools
