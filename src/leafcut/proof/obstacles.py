"""Check every motion against every named obstacle on the table, using GEOS geometry.

These checks share no geometry with the code that plans moves around or over obstacles (`leafcut.geometry.zones`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from leafcut.message import Message
from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath, arc_radius_start_sweep, plane_axes
from leafcut.proof.clearance import rows_at_machine_height
from leafcut.proof.difference import limit_differences, position_text, start_and_end_texts

#: Tolerance for rounded positions and heights, mm (0.0001 inch is 0.00254 mm).
_TOLERANCE = 0.003
#: Angle per chord of an arc, rad. The chord error is less than a ten-thousandth of the radius.
_STEP = math.radians(1.5)

#: Kinds of differences in the order of the list. Cuts come first, because rerouting a move cannot avoid a cut in an
#: obstacle.
CUTS, MAY_CROSS, CROSSES = (
    Message("cuts in an obstacle"),
    Message("may cross an obstacle"),
    Message("crosses an obstacle"),
)


def check_obstacles(
    path: Toolpath,
    zones: ArrayLike,
    height: ArrayLike,
    *,
    tool_radii: Mapping[int, float] = MappingProxyType({}),
    bodies: Mapping[int, Sequence[tuple[float, float]]] = MappingProxyType({}),
    safe_z: float = 0.0,
    dogleg: bool = False,
) -> list[Difference]:
    """Return every motion that comes closer to an obstacle than the tool radius.

    The list also contains motions in which a part of the tool above the flutes hits an obstacle. It starts with cuts,
    followed by moves on unknown paths, and ends with rapids.

    Parameters
    ----------
    path
        The motion of a program. Drilling cycles are expanded into moves.
    zones
        Corners x0, y0, x1, y1 of the obstacles, float64[k, 4], mm.
    height
        Minimum crossing height, mm: a single value for all zones, or float64[k]. It is infinite if a zone must not be
        crossed. A rapid from an unknown position is assumed to cross every zone. The same holds for a move in machine
        coordinates and for a block that is not understood.
    tool_radii
        Radius of each tool, mm, by tool number; 0 for a missing tool. Arcs are checked as arcs.
    bodies
        The parts above the flutes that are wider than the tool, by tool number: height above the tip, and radius, mm.
    safe_z
        After a move to this machine height or above, a tool of unknown height counts as raised.
    dogleg
        Whether a rapid covers the whole rectangle between its ends.
    """
    sides = np.asarray(zones, dtype=np.float64).reshape(-1, 4).tolist()
    boxes = [shapely.box(left, low, right, high) for left, low, right, high in sides]
    if not boxes:
        return []
    heights = np.broadcast_to(np.asarray(height, dtype=np.float64), len(boxes))
    highest = float(heights.max())
    path = expand_cycles(path)
    lowest = np.minimum(path.before[:, 2], path.end[:, 2])
    moves = (path.kind >= Kind.RAPID) & (path.kind <= Kind.ARC_CCW)
    rapid = path.kind == Kind.RAPID
    at_machine = np.isfinite(highest) & rows_at_machine_height(path, safe_z)
    is_high = (lowest >= highest - _TOLERANCE) | (rapid & at_machine)
    untracked = np.flatnonzero(_has_unknown_path(path) & ~is_high & ~at_machine)
    unseen = [_unknown_path_difference(path, row) for row in untracked.tolist()]
    rows = np.flatnonzero(moves & ~is_high & np.isfinite(path.end[:, :2]).all(axis=1))
    if not len(rows):
        return limit_differences(unseen)
    shapes = _areas_of_motions(path, rows, dogleg)
    radius = np.array([tool_radii.get(tool, 0.0) for tool in path.tool[rows].tolist()])
    needed, with_body = np.full(len(rows), -math.inf), np.zeros(len(rows), dtype=bool)
    for box, top in zip(boxes, heights.tolist(), strict=True):
        distance = shapely.distance(shapes, box)
        touching = (distance <= np.maximum(radius - _TOLERANCE, 0.0)) & ~(lowest[rows] >= top - _TOLERANCE)
        for number, discs in bodies.items():
            for above, disc_radius in discs:
                body = (
                    (path.tool[rows] == number)
                    & (distance <= disc_radius - _TOLERANCE)
                    & ~(lowest[rows] + above >= top - _TOLERANCE)
                )
                with_body |= body & ~touching
                touching |= body
        needed[touching] = np.maximum(needed[touching], top)
    from_anywhere = rapid[rows] & np.isnan(path.before[rows, :2]).any(axis=1) & np.isfinite(lowest[rows] + highest)
    needed[from_anywhere] = highest
    cuts, rapids = (
        [
            _obstacle_difference(path, int(rows[k]), float(needed[k]), bool(with_body[k]))
            for k in np.flatnonzero((needed > -math.inf) & (rapid[rows] == is_rapid)).tolist()
        ]
        for is_rapid in (False, True)
    )
    return limit_differences([*cuts, *unseen, *rapids])


def _has_unknown_path(path: Toolpath) -> NDArray[np.bool_]:
    end, start = path.end[:, :2], path.before[:, :2]
    moves = (path.kind >= Kind.RAPID) & (path.kind <= Kind.ARC_CCW)
    sideways = ((end != start) & ~(np.isnan(end) & np.isnan(start))).any(axis=1)
    unknown_end = moves & np.isnan(end).any(axis=1) & sideways
    machine = (path.kind == Kind.MACHINE) & np.isfinite(end).any(axis=1)
    result: NDArray[np.bool_] = unknown_end | machine | ((path.kind == Kind.FOREIGN) & sideways)
    return result


def _areas_of_motions(path: Toolpath, rows: NDArray[np.intp], dogleg: bool) -> NDArray[Any]:
    """Return the area of each motion, seen from above. If its start is unknown, the area only covers its end."""
    end = path.end[rows, :2]
    start = np.where(np.isnan(path.before[rows, :2]).any(axis=1, keepdims=True), end, path.before[rows, :2])
    shapes: NDArray[Any] = np.asarray(shapely.linestrings(np.stack([start, end], axis=1)))
    kind = path.kind[rows]
    for k in np.flatnonzero((kind == Kind.ARC_CW) | (kind == Kind.ARC_CCW)).tolist():
        shapes[k] = shapely.linestrings(_points_along_arc(path, int(rows[k])))
    if dogleg:
        for k in np.flatnonzero(kind == Kind.RAPID).tolist():
            low, high = np.minimum(start[k], end[k]), np.maximum(start[k], end[k])
            if (high > low).all():
                shapes[k] = shapely.box(*low.tolist(), *high.tolist())
    return shapes


def _points_along_arc(path: Toolpath, row: int) -> NDArray[np.float64]:
    radius, start, sweep = arc_radius_start_sweep(path, row)
    arc = path.arcs[int(path.ref[row])]
    first, second, normal = plane_axes(arc.plane)
    count = max(2, math.ceil(abs(sweep) / _STEP) + 1)
    angle = start + np.linspace(0.0, sweep, count)
    points = np.empty((count, 3))
    points[:, first] = arc.center[first] + radius * np.cos(angle)
    points[:, second] = arc.center[second] + radius * np.sin(angle)
    points[:, normal] = np.linspace(path.before[row, normal], path.end[row, normal], count)
    return points[:, :2]


def _unknown_path_difference(path: Toolpath, row: int) -> Difference:
    start = position_text(*path.before[row].tolist())
    text = Message("the tool leaves {} on an unknown path, too low to cross a --keep-out zone", start)
    return Difference(MAY_CROSS, 0, int(path.line[row]), text)


def _obstacle_difference(path: Toolpath, row: int, height: float, body: bool) -> Difference:
    start, end = start_and_end_texts(path, row)
    rapid = path.kind[row] == Kind.RAPID
    allowed: str = Message("a rapid may cross a --keep-out zone only at Z{:.3f} or above", height)
    allowed = allowed if math.isfinite(height) else Message("no rapid may cross a --keep-out zone")
    rule = allowed if rapid else Message("cutting is forbidden in a --keep-out zone")
    if body:
        rule = Message("the shank or holder of the tool hits a --keep-out zone")
    return Difference(
        CROSSES if rapid else CUTS,
        0,
        int(path.line[row]),
        Message("{}; this move goes from {} to {}", rule, start, end),
    )
