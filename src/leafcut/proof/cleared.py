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
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.stock.straight_moves import straight_moves

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
#: Most cuts that are examined for one rapid, and most rapids: others count as not cleared.
_MOST_CUTS, _MOST_RAPIDS = 200, 1000
#: More shifts of the origin than a program has.
_SHIFTS = 1_000_000_000


class _Cuts(NamedTuple):
    """Straight cuts: ends, float64[n, 4], mm; height at or below which each is, its row, tool and origin, each [n]."""

    ends: NDArray[np.float64]
    z: NDArray[np.float64]
    row: NDArray[np.int64]
    tool: NDArray[np.int64]
    origin: NDArray[np.int64]


def cleared_before(program: Program, rows: NDArray[np.int32], path: Toolpath, down: NDArray[np.int64]) -> Mask:
    """Return which rapids straight down end where earlier cuts have removed the material: bool[len(down)].

    A cut of the same tool clears its own middle, whatever the shape of the tool. Flat mills clear what they sweep: if
    the diameters are known from the comments, the tool must fit into the union of these areas.

    Parameters
    ----------
    rows
        The row of the program's path that each row of `path`, with its cycles written out, comes from.
    down
        Rows of these rapids in `path`, ascending.
    """
    result = np.zeros(len(down), dtype=bool)
    # Places under two work offsets, or before and after a shift, have nothing in common.
    origin = path.latest(Kind.FRAME, path.ref, 540) * _SHIFTS + path.latest(Kind.SHIFT, path.ref)
    cuts = _cuts(path, origin)
    if not len(cuts.row):
        return result
    tools = _tools(program, rows, path)
    radius = {number: 0.5 * tool.diameter for number, tool in tools.items()}
    swept = {number: radius[number] if _is_flat(tool) else 0.0 for number, tool in tools.items()}
    width = np.array([swept.get(number, 0.0) for number in cuts.tool.tolist()])
    lines: NDArray[Any] = np.asarray(shapely.linestrings(cuts.ends.reshape(-1, 2, 2)))
    tree = shapely.STRtree(lines)
    reach = max(float(width.max()), _ON)
    for at, row in enumerate(down[:_MOST_RAPIDS].tolist()):
        place = shapely.Point(path.end[row, :2])
        near = np.asarray(tree.query(place, predicate="dwithin", distance=reach + radius.get(int(path.tool[row]), 0.0)))
        near = near[(cuts.row[near] < row) & (cuts.origin[near] == origin[row])]
        near = near[cuts.z[near] <= path.end[row, 2] + _ROOM]
        away = np.asarray(shapely.distance(tree.geometries[near], place))
        tool = int(path.tool[row])
        result[at] = bool(((cuts.tool[near] == tool) & (away <= _ON)).any()) or (
            tool in radius and _covered(place, radius[tool], tree, near, away, width)
        )
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
    near = near[np.argsort(away, kind="stable")]
    near = near[width[near] > 0.0][:_MOST_CUTS]
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


def _cuts(path: Toolpath, origin: NDArray[np.int64]) -> _Cuts:
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
    row = moves.row[fed][which]
    return _Cuts(ends, z, row, moves.tool[fed][which], origin[row])


def _tools(program: Program, rows: NDArray[np.int32], path: Toolpath) -> dict[int, Tool]:
    """Return the tools that cut and whose shape the comments describe, by number."""
    cuts = np.flatnonzero((path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW))
    numbers, first = np.unique(path.tool[cuts], return_index=True)
    blocks = np.searchsorted(program.first, rows[cuts[first]], side="right") - 1
    found = {}
    for number, block in zip(numbers.tolist(), blocks.tolist(), strict=True):
        tool = tool_in_comments(program, block)
        if tool is not None:
            found[number] = tool
    return found
