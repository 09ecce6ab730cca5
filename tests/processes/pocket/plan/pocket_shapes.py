"""Pockets of the tests, and the measures of a path by shapely."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketPath, PocketRules
from leafcut.processes.pocket.plan.region import CentreRegion, centre_regions

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)


def box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    """Return a rectangle, counter-clockwise."""
    return Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def plate() -> Pocket:
    """Return a square with a round and a rectangular island."""
    islands = (Polyline.circle(21, 22, 8, clockwise=True), box(41, 35, 55, 52).reversed())
    return Pocket(box(0, 0, 70, 70), islands)


def l_shape() -> Pocket:
    """Return a pocket of two arms, one of them narrow."""
    return Pocket(Polyline.of_points([(0, 0), (80, 0), (80, 22), (36, 22), (36, 60), (0, 60)], closed=True))


def only_region(pocket: Pocket, rules: PocketRules = RULES) -> CentreRegion:
    """Return the only region of tool centres of a pocket."""
    regions, _ = centre_regions(pocket, rules)
    assert len(regions) == 1
    return regions[0]


def lines(path: PocketPath) -> list[Any]:
    """Return the pieces of a path as shapely lines."""
    return [shapely.LineString(piece.path.vertices[:, :2]) for piece in path.pieces]


def uncovered_share(region: CentreRegion, path: PocketPath) -> float:
    """Return the uncut share of the area within reach of the tool."""
    radius = region.rules.radius
    ground = region.polygon.buffer(radius, quad_segs=32)
    # Buffer single moves: the buffer of a whole line loses dead ends.
    steps = [xy for line in lines(path) for xy in np.stack([line.coords[:-1], line.coords[1:]], axis=1)]
    swept = shapely.union_all(shapely.buffer(shapely.linestrings(np.array(steps)), radius, quad_segs=32))
    return float(ground.difference(swept).area / ground.area)


def leaves(region: CentreRegion, path: PocketPath) -> float:
    """Return the maximum distance of a path outside the region of tool centres, mm."""
    outside = [line.difference(region.polygon) for line in lines(path)]
    places = [shapely.Point(xy) for shape in outside for xy in shapely.get_coordinates(shape)]
    return max((region.polygon.distance(place) for place in places), default=0.0)


def floor_mm(region: CentreRegion) -> float:
    """Return the area of the region divided by the step-over: the ideal length at constant pitch."""
    return float(region.polygon.area) / region.rules.step_over
