"""Pockets of the tests, and what shapely says of a path over one."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.pocket import Pocket, PocketPath, PocketRules
from leafcut.processes.pocket.plan.region import CentreRegion, centre_regions

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)


def box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    """A rectangle, counter-clockwise."""
    return Polyline.of_points([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def plate() -> Pocket:
    """A square with a round and a square island."""
    islands = (Polyline.circle(30, 32, 11, clockwise=True), box(58, 50, 78, 74).reversed())
    return Pocket(box(0, 0, 100, 100), islands)


def l_shape() -> Pocket:
    """Two arms, one of them narrow."""
    return Pocket(Polyline.of_points([(0, 0), (120, 0), (120, 26), (44, 26), (44, 90), (0, 90)], closed=True))


def only_region(pocket: Pocket, rules: PocketRules = RULES) -> CentreRegion:
    """The one region of tool centres of a pocket."""
    regions, _ = centre_regions(pocket, rules)
    assert len(regions) == 1
    return regions[0]


def lines(path: PocketPath) -> list[Any]:
    """The pieces of a path as shapely lines."""
    return [shapely.LineString(piece.path.vertices[:, :2]) for piece in path.pieces]


def uncovered_share(region: CentreRegion, path: PocketPath) -> float:
    """Share of the ground that discs of the tool's radius round the region reach and those round the path do not."""
    radius = region.rules.radius
    ground = region.polygon.buffer(radius, quad_segs=32)
    # Step by step: a buffer of the whole line rounds its hollows and loses what only goes there and back.
    steps = [xy for line in lines(path) for xy in np.stack([line.coords[:-1], line.coords[1:]], axis=1)]
    swept = shapely.union_all(shapely.buffer(shapely.linestrings(np.array(steps)), radius, quad_segs=32))
    return float(ground.difference(swept).area / ground.area)


def leaves(region: CentreRegion, path: PocketPath) -> float:
    """How far a path leaves the region of tool centres at most, mm."""
    outside = [line.difference(region.polygon) for line in lines(path)]
    places = [shapely.Point(xy) for shape in outside for xy in shapely.get_coordinates(shape)]
    return max((region.polygon.distance(place) for place in places), default=0.0)


def floor_mm(region: CentreRegion) -> float:
    """Area of the region divided by the step-over: the ideal of constant pitch."""
    return float(region.polygon.area) / region.rules.step_over
