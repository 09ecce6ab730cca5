"""Check every rapid against the triangles of an uneven surface, using GEOS geometry.

These checks share no geometry with the code that plans travel heights (`leafcut.material.surface`, which uses tiles).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.proof.clearance import LEAST_CLEARANCE
from leafcut.proof.difference import limit_differences, start_and_end_texts

#: Tolerance for rounded positions and heights, mm (0.0001 inch is 0.00254 mm).
_TOLERANCE = 0.003
_MOVES = [int(kind) for kind in (Kind.RAPID, Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)]
#: Number of moves per batch. Batches limit memory use.
_BATCH = 500


def check_surface(
    path: Toolpath,
    triangles: NDArray[np.float64],
    tool_radii: Mapping[int, float],
    bodies: Mapping[int, Sequence[tuple[float, float]]] | None = None,
    *,
    dogleg: bool = False,
) -> list[Difference]:
    """Return every rapid that enters a surface, or is less than `LEAST_CLEARANCE` above it.

    The list also contains every move, at feed or rapid, in which a part of the tool above the flutes hits the surface.
    Moves straight up are not checked.

    Parameters
    ----------
    path
        The motion of a program. Drilling cycles are expanded into moves. A vertical rapid is checked only against the
        surface within the tool radius of the hole. It may descend as deep as a tool of at least the same width has
        already cut there.
    triangles
        Triangles of the surface, float64[n, 3, 3], mm.
    tool_radii
        Radius of each tool, mm, by tool number.
    bodies
        The parts above the flutes that are wider than the tool, by tool number: height above the tip, and radius, mm.
    dogleg
        Whether a rapid may go anywhere in the rectangle between its ends.
    """
    path = expand_cycles(path)
    has_position = np.isfinite(path.before).all(axis=1) & np.isfinite(path.end).all(axis=1)
    upright = (path.end[:, :2] == path.before[:, :2]).all(axis=1)
    rises = upright & (path.end[:, 2] >= path.before[:, 2])
    allowed = rises | _returns_into_holes(path, upright & ~rises, tool_radii)
    rapids = np.flatnonzero((path.kind == Kind.RAPID) & has_position & ~allowed)
    radius = np.array([tool_radii.get(int(tool), 0.0) for tool in path.tool[rapids]])
    text = Message("the tool touches the surface, or comes closer than {:g} mm to it", LEAST_CLEARANCE)
    wrong = [
        Difference(
            Message("rapid into the part"), 0, int(path.line[row]), Message("{}; {}", text, _motion_text(path, row))
        )
        for row in _rows_hitting_surface(path, rapids, triangles, -LEAST_CLEARANCE, radius, dogleg)
    ]
    moves = np.flatnonzero(np.isin(path.kind, _MOVES) & has_position & ~rises)
    meeting_rows = set[int]()
    for number, discs in (bodies or {}).items():
        tool_moves = moves[path.tool[moves] == number]
        for above, disc_radius in discs:
            rows = _rows_hitting_surface(
                path, tool_moves, triangles, above, np.full(len(tool_moves), disc_radius), dogleg
            )
            meeting_rows.update(rows)
    body = Message("the tool hits the surface above its flutes")
    wrong += [
        Difference(
            Message("shank or holder in the part"),
            0,
            int(path.line[row]),
            Message("{}; {}", body, _motion_text(path, row)),
        )
        for row in sorted(meeting_rows)
    ]
    return limit_differences(wrong)


def surface_reaches_into_area(triangles: NDArray[np.float64], area: Any, radius: float, height: float) -> bool:
    """Return whether a part of a surface above `height` (mm) is within `radius` (mm) of an area of the plane."""
    high = triangles[triangles[:, :, 2].max(axis=1) > height]
    close_triangles = high[shapely.dwithin(shapely.convex_hull(shapely.multipoints(high[:, :, :2])), area, radius)]
    return any(
        bool(
            shapely.dwithin(
                shapely.convex_hull(shapely.MultiPoint(_triangle_part_above(triangle, height))), area, radius
            )
        )
        for triangle in close_triangles
    )


def _returns_into_holes(
    path: Toolpath, descending: NDArray[np.bool_], tool_radii: Mapping[int, float]
) -> NDArray[np.bool_]:
    """Return a mask of straight-down rapids into holes that a tool of at least the same width has already cut."""
    result = np.zeros(len(path.end), dtype=bool)
    holes: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for row in np.flatnonzero(descending & np.isin(path.kind, [int(Kind.RAPID), int(Kind.FEED)])).tolist():
        x, y, z = path.end[row].tolist()
        feeds = holes.setdefault((round(x, 3), round(y, 3)), [])
        radius = tool_radii.get(int(path.tool[row]), 0.0)
        if path.kind[row] == Kind.FEED:
            feeds.append((radius, z))
        else:
            result[row] = any(feed_radius >= radius and depth <= z + _TOLERANCE for feed_radius, depth in feeds)
    return result


def _motion_text(path: Toolpath, row: int) -> Message:
    return Message("this move goes from {} to {}", *start_and_end_texts(path, row))


def _rows_hitting_surface(
    path: Toolpath,
    rows: NDArray[np.int64],
    triangles: NDArray[np.float64],
    above: float,
    radius: NDArray[np.float64],
    dogleg: bool,
) -> list[int]:
    """Return the moves that hit the surface.

    A move hits the surface if a point within the tool radius is more than `above` mm higher than the tip.
    """
    if not len(rows):
        return []
    lowest = np.minimum(path.before[rows, 2], path.end[rows, 2]) + above
    high = triangles[triangles[:, :, 2].max(axis=1) > lowest.min()]
    if not len(high):
        return []
    # Vertical walls are lines when seen from above.
    tree = shapely.STRtree(shapely.convex_hull(shapely.multipoints(high[:, :, :2])))
    result: list[int] = []
    for first in range(0, len(rows), _BATCH):
        batch = slice(first, first + _BATCH)
        meeting = _moves_hitting_triangles(
            tree,
            high,
            path.before[rows[batch]],
            path.end[rows[batch]],
            lowest[batch] + _TOLERANCE,
            np.maximum(radius[batch] - _TOLERANCE, 0.0),
            dogleg,
        )
        result += rows[batch][meeting].tolist()
    return result


def _moves_hitting_triangles(
    tree: shapely.STRtree,
    triangles: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    height: NDArray[np.float64],
    radius: NDArray[np.float64],
    dogleg: bool,
) -> NDArray[np.int64]:
    shapes: Any
    if dogleg:
        low, high = np.minimum(start, end), np.maximum(start, end)
        shapes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    else:
        shapes = shapely.linestrings(np.stack([start[:, :2], end[:, :2]], axis=1))
    # GEOS finds nothing near a line of length 0, so points replace such lines.
    is_vertical = (start[:, :2] == end[:, :2]).all(axis=1)
    shapes[is_vertical] = shapely.points(end[is_vertical, :2])
    move, triangle_index = tree.query(shapes, predicate="dwithin", distance=radius)
    tops, bottoms = triangles[triangle_index, :, 2].max(axis=1), triangles[triangle_index, :, 2].min(axis=1)
    above = tops > height[move]
    whole = above & (bottoms > height[move])
    meeting = set(move[whole].tolist())
    for index, triangle in zip(move[above & ~whole].tolist(), triangle_index[above & ~whole].tolist(), strict=True):
        if index in meeting:
            continue
        part = _triangle_part_above(triangles[triangle], float(height[index]))
        if shapely.dwithin(shapes[index], shapely.convex_hull(shapely.MultiPoint(part)), float(radius[index])):
            meeting.add(index)
    return np.array(sorted(meeting), dtype=np.int64)


def _triangle_part_above(triangle: NDArray[np.float64], height: float) -> list[tuple[float, float]]:
    corners = []
    for k in range(3):
        (x0, y0, z0), (x1, y1, z1) = triangle[k].tolist(), triangle[(k + 1) % 3].tolist()
        if z0 >= height:
            corners.append((x0, y0))
        if (z0 >= height) != (z1 >= height):
            share = (height - z0) / (z1 - z0)
            corners.append((x0 + share * (x1 - x0), y0 + share * (y1 - y0)))
    return corners
