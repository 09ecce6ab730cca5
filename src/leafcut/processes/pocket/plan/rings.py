"""Contour-parallel clearing: rings at equal distances from all walls, cut from the inside out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.regions import as_polyline, polygons, shrunk
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.spurs import with_spurs
from leafcut.processes.pocket.plan.track import Track

#: Maximum distance of neighbouring rings, step-overs.
NEAR = 1.01
#: Maximum length of a link at depth, step-overs.
LINK_STEPS = 2.0


@dataclass(frozen=True, eq=False)
class Ring:
    """A closed path of the tool's centre.

    Attributes
    ----------
    points
        float64[n, 2], mm, in the direction of travel, without a closing point.
    level
        Distance from the wall in step-overs; 0 is along a wall.
    """

    points: Points
    level: int

    @cached_property
    def line(self) -> Any:
        """The ring as a closed shapely LineString."""
        return shapely.LineString(self.track.points)

    @cached_property
    def track(self) -> Track:
        """The ring as an open track that ends at its start."""
        return Track(np.vstack([self.points, self.points[:1]]))

    @property
    def stations(self) -> Points:
        """Stations of all points and of the end, float64[n + 1], mm."""
        return self.track.stations

    @property
    def length(self) -> float:
        """Length of the ring, mm."""
        return float(self.stations[-1])

    def at(self, station: float) -> Points:
        """Return the position at a station, which may exceed the length, float64[2]."""
        place: Points = self.places(np.array([station]))[0]
        return place

    def places(self, stations: Points) -> Points:
        """Return the positions at stations, float64[n, 2]."""
        return self.track.places(stations % self.length)

    def stretch(self, start: float, end: float) -> Points:
        """Return the points from one station to another (end ≥ start), float64[m, 2]."""
        points, own = self.points, self.stations[:-1]
        lap, last = math.floor(start / self.length), math.floor(end / self.length)
        parts = [self.at(start)[None]]
        while lap <= last:
            a, b = np.searchsorted(own, (start + 1e-9 - lap * self.length, end - 1e-9 - lap * self.length))
            parts.append(points[a:b])
            lap += 1
        return np.vstack([*parts, self.at(end)[None]])

    def nearest(self, places: Points) -> tuple[Points, Points]:
        """Return the distances of positions, float64[n, 2], from the ring, and the stations of its nearest points."""
        return self.track.nearest(places)

    def station_of(self, place: Points) -> float:
        """Return the station of the point nearest to a position."""
        return float(self.nearest(np.asarray(place)[None, :2])[1][0])


def rings(region: CentreRegion) -> list[Ring]:
    """Return the rings that clear a region, from the walls inwards.

    The material along walls and islands is on the right of the tool for climb milling (with a clockwise spindle), on
    its left for conventional milling.
    """
    cut: list[Ring] = []
    rules, level, inner = region.rules, 0, region.polygon
    while not inner.is_empty:
        for polygon in polygons(inner):
            cut.extend(Ring(points, level) for points in CentreRegion(polygon, rules).rings)
        level += 1
        inner = shrunk(region.polygon, level * rules.step_over, rules.tolerance)
    return cut if rules.climb else [Ring(ring.points[::-1], ring.level) for ring in cut]


def neighbours(cut: list[Ring], step_over: float) -> list[tuple[int, int]]:
    """Return the pairs of neighbouring rings (outer, inner)."""
    lines = [ring.line for ring in cut]
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=NEAR * step_over).T
    return [(int(a), int(b)) for a, b in pairs if cut[b].level > cut[a].level]


def contour(region: CentreRegion) -> PocketPath:
    """Return contour-parallel clearing: closed rings from the inside out, linked at depth if the link is free.

    A ring is cut after all rings inside it; the next ring is the nearest to the tool.
    """
    rules = region.rules
    cut = rings(region)
    around = [ring.stretch(0.0, ring.length) for ring in cut]
    loops = with_spurs(around, region.polygon, rules)
    cut = [Ring(way[:-1], ring.level) for way, ring in zip(loops, cut, strict=True)]
    inner: dict[int, set[int]] = {a: set() for a in range(len(cut))}
    for a, b in neighbours(cut, rules.step_over):
        inner[a].add(b)
    path = LinkedPath(region, _first_place(cut))
    left = set(range(len(cut)))
    while left:
        ready = sorted(a for a in left if not inner[a] & left)
        here = shapely.Point(path.end)
        a = min(ready, key=lambda r: (round(cut[r].line.distance(here), 6), -cut[r].level))
        start = cut[a].station_of(path.end)
        path.go(cut[a].stretch(start, start + cut[a].length), kind_of(cut[a], rules))
        left.remove(a)
    return PocketPath("contour", tuple(path.pieces))


class LinkedPath:
    """A path of successive pieces, linked at depth if the straight link is short and free.

    `end` is the place of the tool, float64[2]: the start of the search, then the end of the last piece.
    """

    def __init__(self, region: CentreRegion, start: Points) -> None:
        self.region, self.end = region, start
        self.pieces: list[PocketPiece] = []

    def go(self, path: Points, kind: str) -> None:
        """Append a path, with a link to it if possible."""
        link = shapely.LineString([self.end, path[0]])
        if self.pieces and 0.0 < link.length <= LINK_STEPS * self.region.rules.step_over and free(self.region, link):
            self.pieces.append(PocketPiece(as_polyline(link.coords), "link"))
        self.pieces.append(PocketPiece(as_polyline(path), kind))
        self.end = path[-1]


def never() -> bool:
    """Return False: the search is not stopped."""
    return False


def kind_of(ring: Ring, rules: PocketRules) -> str:
    """Return the kind of a ring: along a wall without stock, it finishes."""
    return "finish" if ring.level == 0 and rules.stock == 0.0 else "rough"


def _first_place(cut: list[Ring]) -> Points:
    """Return the start of clearing, on the innermost ring."""
    first: Points = max(cut, key=lambda ring: ring.level).points[0]
    return first


def free(region: CentreRegion, line: Any) -> bool:
    """Return whether a line stays in the region of tool centres, except for rounding at its ends."""
    return bool(shapely.difference(line, region.polygon).length < 1e-6)
