"""Finishing passes. Roughing leaves an allowance on the walls, and the mill then follows the exact path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from leafcut.errors import OptionError, PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.offset import offset_closed_path
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.processes.part.model import Edge

#: Tolerance of the tool path, mm.
TOLERANCE = 0.01
#: Minimum radius of a passage that is reported because roughing does not reach it, in mill radii. Remainders in corners
#: are smaller.
_PASSAGE = 0.5
#: Minimum distance between the wall and the outer end of a lead, as a share of the allowance.
_CLEAR = 0.5


@dataclass(frozen=True, eq=False)
class FinishingPass:
    """A pass along the exact path, which starts at the end of roughing.

    Each piece of the path has a flag that is true if the piece crosses a tab.
    """

    pieces: tuple[tuple[Polyline, bool], ...]
    has_leads: bool

    @property
    def end(self) -> Point:
        """Position at the end of the pass."""
        return self.pieces[-1][0].end


def ring_of(path: Polyline) -> shapely.LinearRing:
    """Return a closed path as a ring of chords."""
    return shapely.LinearRing(path.flattened(0.5 * TOLERANCE))


def index_of_areas(edges: Sequence[Edge]) -> shapely.STRtree:
    """Return a spatial index of the areas that the edges enclose."""
    return shapely.STRtree([shapely.Polygon(ring_of(edge.path)) for edge in edges])


def roughing_path(edge: Edge, path: Polyline, lines: shapely.STRtree, radius: float, finish: float) -> Polyline:
    """Return the path for roughing, which leaves the allowance on the edge. It starts near the start of the exact path.

    Parameters
    ----------
    edge, path
        The edge, and the exact tool path along it.
    lines
        All edges of the part.
    radius, finish
        Radius of the mill and finishing allowance, mm.

    Raises
    ------
    PlanError
        The path does not fit between the walls.
    """
    wide = radius + finish
    shape = shapely.Polygon(ring_of(edge.path))
    free = shape if edge.inside else shape.envelope.buffer(4.0 * wide) - shape
    tight = tight_place(free, radius, finish)
    if tight is None:
        own = shapely.Polygon(ring_of(path)).buffer(2.0 * TOLERANCE)
        rings = [
            ring for ring in offset_closed_path(edge.path, -wide if edge.inside else wide, TOLERANCE) if ring.area > 0.0
        ]
        rings = [ring for ring in rings if not edge.inside or own.covers(ring_of(ring))]
        tight = edge.path.start if len(rings) != 1 else crowded_place(ring_of(rings[0]), edge, lines, wide)
    if tight is not None:
        raise no_room(edge.name, tight, radius, finish)
    rough = rings[0] if (rings[0].area > 0.0) == (path.area > 0.0) else rings[0].reversed()
    nearest = int(np.hypot(*(rough.vertices[:, :2] - path.start).T).argmin())
    return Polyline(np.roll(rough.vertices, -nearest, axis=0), closed=True)


def tight_place(free: Any, radius: float, finish: float) -> Point | None:
    """Return a point that the mill can reach only without the full allowance, or None if no such point exists.

    `free` is the area to clear. `radius` is the radius of the mill and `finish` is the allowance, mm.
    """
    wide = radius + finish
    reached = free.buffer(-radius, quad_segs=32).buffer(radius, quad_segs=32)
    rest = reached.difference(free.buffer(-wide, quad_segs=32).buffer(wide, quad_segs=32)).buffer(-_PASSAGE * radius)
    if rest.is_empty:
        return None
    at = rest.representative_point()
    return at.x, at.y


def check_allowance(finish: float, radius: float) -> None:
    """Raise OptionError unless the allowance is smaller than the radius of the mill, mm."""
    if finish >= radius:
        raise OptionError(
            "--finish {:g} mm: the allowance must be less than the radius of the mill, {:g} mm", finish, radius
        )


def no_room(name: str, place: Point, radius: float, finish: float) -> PlanError:
    """Create the error for a place where the allowance does not fit."""
    return PlanError(
        "{}: there is no room for --finish {:g} mm at ({:.4g}, {:.4g}), because the mill needs {:g} mm between "
        "the walls; give a smaller --finish, or use a smaller mill",
        name,
        finish,
        *place,
        2.0 * (radius + finish),
    )


def crowded_place(ring: shapely.LinearRing, edge: Edge, lines: shapely.STRtree, wide: float) -> Point | None:
    """Return a point where a neighbouring edge is too close to the ring, or None if there is enough room."""
    near = lines.query(ring, predicate="dwithin", distance=wide - 2.0 * TOLERANCE)
    if not len(near):
        return None
    link = shapely.shortest_line(ring_of(edge.path), lines.geometries[near[0]])
    at = link.interpolate(0.5, normalized=True)
    return at.x, at.y


def interval_beside(path: Polyline, area: Any, radius: float) -> tuple[float, float] | None:
    """Return the interval of a path in which the mill would cut into an area.

    Return None if the mill would not cut into the area, or if there are several such intervals.
    """
    line = ring_of(path)
    near = shapely.line_merge(line.intersection(area.buffer(radius, quad_segs=32)))
    if near.geom_type != "LineString" or near.is_empty:
        return None
    low, middle, high = (_distance_along(path, near.interpolate(k, normalized=True).coords[0]) for k in (0.0, 0.5, 1.0))
    low, high = min(low, high), max(low, high)
    return (low, high) if low < middle < high else None


def pieces_from(path: Polyline, tabs: Sequence[tuple[float, float]], start: float) -> list[tuple[Polyline, bool]]:
    """Divide a path at its tabs, starting from the distance `start`.

    The flag of each piece is true if it crosses a tab.
    """
    length, pieces, position = path.length, [], start
    ahead = sorted(
        (low + (length if low < start else 0.0), high + (length if low < start else 0.0)) for low, high in tabs
    )
    for low, high in ahead:
        pieces += [(path.piece(position, low), False), (path.piece(low, high), True)]
        position = high
    return [*pieces, (path.piece(position, start + length), False)]


def finishing_pass(
    path: Polyline, tabs: Sequence[tuple[float, float]], place: Point, finish: float, *, waste_left: bool
) -> FinishingPass:
    """Return the pass along the exact path, starting from `place` on the roughing path.

    The pass starts and ends with a quarter circle inside the allowance. If the circles do not fit, it starts and ends
    next to `place`.
    """
    near = _distance_along(path, place)
    start = (near + finish) % path.length
    leads = _leads(path, start, finish, waste_left=waste_left)
    come, leave = leads or (None, None)
    pieces = pieces_from(path, tabs, start if leads else near)
    first = pieces[0][0] if come is None else concatenate(come, pieces[0][0])
    pieces[0] = concatenate(Polyline.of_points([place, first.start]), first), False
    if leave is not None:
        pieces[-1] = concatenate(pieces[-1][0], leave), False
    return FinishingPass(tuple(pieces), leads is not None)


def _leads(path: Polyline, start: float, finish: float, *, waste_left: bool) -> tuple[Polyline, Polyline] | None:
    """Return the quarter circles that lead to the path and away from it.

    Return None if the allowance is too small for them.
    """
    touch, along = np.array(path.point_at(start)), np.array(path.direction_at(start))
    side = 1.0 if waste_left else -1.0
    across = side * np.array([-along[1], along[0]])
    bulge = side * math.tan(math.pi / 8.0)
    come = Polyline(np.array([[*(touch + finish * (across - along)), bulge], [*touch, 0.0]]))
    leave = Polyline(np.array([[*touch, bulge], [*(touch + finish * (across + along)), 0.0]]))
    ring = ring_of(path)
    inside = waste_left == (path.area > 0.0)
    part = shapely.Polygon(ring)
    for lead, end in ((come, come.start), (leave, leave.end)):
        line, distance = shapely.LineString(lead.flattened(0.1 * TOLERANCE)), ring.distance(shapely.Point(end))
        gouges = not part.buffer(TOLERANCE).covers(line) if inside else part.buffer(-TOLERANCE).intersects(line)
        if gouges or not _CLEAR * finish <= distance <= finish + TOLERANCE:
            return None
    return come, leave


def _distance_along(path: Polyline, place: Point) -> float:
    """Return the distance along a closed path at which it passes closest to a point, mm."""
    line = ring_of(path)
    return float(line.project(shapely.Point(place)) * path.length / line.length)
