"""The medial axis of an area: the centres of the largest circles that fit between its walls."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Floats

#: Distance between points on the boundary, mm. The axis between two walls is exact to about a hundredth of it.
_SPACING = 0.1
#: Grid on which the ends of the branches meet, mm.
_GRID = 1e-4
#: Minimum length for the slope of a branch, mm.
_SHORT = 1e-9


def medial_axis(region: Any, leftover: float, thinned: float) -> list[Floats]:
    """Return the branches of the medial axis as float64[n, 3]: x, y, and the distance to the boundary, mm.

    The axis is taken from the Voronoi diagram of points on the boundary. A disc has a single point.

    Parameters
    ----------
    leftover
        A branch into a corner ends where the circle leaves less than this of the corner, mm. The same rule removes the
        branches into the chords of an arc.
    thinned
        Points closer than this to the line between their neighbours are left out, mm.
    """
    points = shapely.multipoints(np.unique(shapely.get_coordinates(shapely.segmentize(region, _SPACING)), axis=0))
    edges = shapely.get_parts(shapely.voronoi_polygons(points, only_edges=True))
    shapely.prepare(region)
    ends = shapely.get_coordinates(edges[shapely.contains_properly(region, edges)]).reshape(-1, 2, 2)
    ends = np.round(ends / _GRID) * _GRID
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    ends, length = ends[length > _SHORT], length[length > _SHORT]
    walls = region.boundary
    shapely.prepare(walls)
    radii = shapely.distance(walls, shapely.points(ends))
    # The radius falls with the sine of half the angle of the corner.
    sine = np.abs(radii[:, 1] - radii[:, 0]) / length
    kept = ends[radii.max(axis=1) * (1.0 / np.maximum(sine, _SHORT) - 1.0) > leftover]
    if not len(kept):
        centre = shapely.get_coordinates(shapely.maximum_inscribed_circle(region, _GRID))[:1]
        return [np.column_stack([centre, shapely.distance(walls, shapely.points(centre))])]
    lines = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(shapely.linestrings(kept))))
    # Between two corners that point into the area, the axis is a single line, but the radius changes along it.
    axis = [shapely.get_coordinates(shapely.segmentize(line, _SPACING)) for line in lines]
    return [_thin(np.column_stack([xy, shapely.distance(walls, shapely.points(xy))]), thinned) for xy in axis]


def _thin(points: Floats, tolerance: float) -> Floats:
    """Leave out points that are at most `tolerance` mm from the line between the points that are kept."""
    kept = np.zeros(len(points), dtype=np.bool_)
    kept[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        between, chord = points[first + 1 : last] - points[first], points[last] - points[first]
        share = np.clip(between @ chord / max(chord @ chord, _SHORT), 0.0, 1.0)
        away = np.linalg.norm(between - share[:, None] * chord, axis=1)
        if away.max() > tolerance:
            middle = first + 1 + int(away.argmax())
            kept[middle] = True
            spans += [(first, middle), (middle, last)]
    return np.asarray(points[kept])
