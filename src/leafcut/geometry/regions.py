"""Create regions of the plane from paths, as shapely polygons, and offset them.

The offsets take the chord error of arcs into account.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message

#: Chord error of walls and offsets, and of the checks, as a share of the tolerance.
FINE = 0.125
#: Minimum length of a slot as wide as the tool, in tool radii. A shorter area is the tip of a corner.
LONG = 0.05


def region_with_islands(
    outline: Polyline, islands: Sequence[Polyline] = (), tolerance: float = 0.01, name: str = "region"
) -> Any:
    """Return the area inside an outline and outside its islands as a valid, counter-clockwise shapely Polygon.

    The chord error of arcs is at most an eighth of the tolerance.

    Raises
    ------
    PlanError
        A path crosses itself, or an island touches the outline or another island. The message names the region
        (`name`).
    """
    fine = FINE * tolerance
    shape = shapely.Polygon(outline.flattened(fine), [island.flattened(fine) for island in islands])
    if not shape.is_valid:
        problem, _, position = shapely.is_valid_reason(shape).partition("[")
        location = Message(" at ({})", position.rstrip("]").replace(" ", ", ")) if position else ""
        raise PlanError("{}: {}{}; outlines must not cross or touch", name, problem.strip().lower(), location)
    return shapely.geometry.polygon.orient(shape)


def shrink_region(shape: Any, distance: float, tolerance: float = 0.01) -> Any:
    """Shrink a polygon so that each remaining point is at least `distance` mm away from the original edge."""
    fine = FINE * tolerance
    # The arcs of a buffer consist of chords, which are closer to the edge by the chord error.
    return shape.buffer(-(distance + fine), quad_segs=chords_per_quarter(distance, fine))


def tool_centres(shape: Any, distance: float, tolerance: float = 0.01) -> Any:
    """Return the area in which the centre of a tool is at least a distance, mm, away from the edge of a polygon.

    If a passage is exactly as wide as the tool, within the tolerance, the tool touches both walls. The area there is a
    strip along the centre line that extends half a tolerance to each side.
    """
    centres = shrink_region(shape, distance, tolerance)
    slack = 0.5 * tolerance
    slim = shrink_region(shape, distance - slack, tolerance)
    slots = [
        part
        for part in polygons(slim.difference(centres.buffer(2.0 * tolerance)))
        if _box_diagonal(part) > LONG * distance
    ]
    if not slots:
        return centres

    return shapely.union_all([centres, *(slim.intersection(slot.buffer(3.0 * tolerance)) for slot in slots)])


def _box_diagonal(shape: Any) -> float:
    x0, y0, x1, y1 = shape.bounds
    return math.hypot(x1 - x0, y1 - y0)


def swept_region(shape: Any, radius: float, tolerance: float = 0.01) -> Any:
    """Return the area that a disc sweeps when its centre moves over a shape (lines or polygons).

    The result is accurate to within the chord error.
    """
    return shape.buffer(radius, quad_segs=chords_per_quarter(radius, FINE * tolerance))


def chords_per_quarter(radius: float, fine: float) -> int:
    """Return the number of chords per quarter circle that keeps the chord error within `fine` mm."""
    step = 2.0 * math.acos(max(1.0 - fine / max(radius, fine), 0.0))
    return min(max(math.ceil(0.5 * math.pi / step), 4), 256)


def polygons(shape: Any) -> list[Any]:
    """Return the polygons of a shapely geometry."""
    return [p for p in getattr(shape, "geoms", [shape]) if p.geom_type == "Polygon" and not p.is_empty]


def as_polyline(points: Any, closed: bool = False) -> Polyline:
    """Create a polyline of straight lines through points (float64[n, 2], or shapely coordinates)."""
    return Polyline.of_points(np.asarray(points, dtype=np.float64)[:, :2], closed)
