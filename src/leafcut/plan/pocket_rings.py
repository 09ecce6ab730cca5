"""Contour-parallel clearing: rings at equal distances from all walls, cut from the inside out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import FINE, as_polyline, polygons, quarter, shrunk
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.plan.pocket_region import CentreRegion

#: Rings as near as this share of the step-over to each other are neighbours.
NEAR = 1.01
#: The tool goes on at depth where the next ring begins within so many step-overs and the straight way is free.
LINK_STEPS = 2.0
#: Uncut places smaller than this share of the tool's area are left: what the chords of rings leave between them.
SPECK = 1e-5
#: Points along the middle of an uncut place.
CORE_POINTS = 9


@dataclass(frozen=True, eq=False)
class Ring:
    """A closed way of the tool's centre, or the way there and back along a line.

    Attributes
    ----------
    points
        float64[n, 2], mm, the first not repeated; in the direction of travel.
    level
        How many step-overs away from the wall; 0 runs along a wall.
    """

    points: Points
    level: int

    @cached_property
    def line(self) -> Any:
        """The ring as a closed shapely LineString."""
        import shapely

        return shapely.LineString(np.vstack([self.points, self.points[:1]]))

    @cached_property
    def stations(self) -> Points:
        """Length from the first point to each and back to the first, float64[n + 1], mm."""
        closed = np.vstack([self.points, self.points[:1]])
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])

    @property
    def length(self) -> float:
        """Once around, mm."""
        return float(self.stations[-1])

    def at(self, station: float) -> Points:
        """Return the place at a length from the first point, taken around as often as needed, float64[2]."""
        closed = np.vstack([self.points, self.points[:1]])
        s = station % self.length
        return np.array([np.interp(s, self.stations, closed[:, 0]), np.interp(s, self.stations, closed[:, 1])])

    def stretch(self, start: float, end: float) -> Points:
        """Return the points of the way from one station on to another (end ≥ start), float64[m, 2]."""
        laps = range(math.floor(start / self.length), math.floor(end / self.length) + 1)
        stations = np.concatenate([self.stations[:-1] + lap * self.length for lap in laps])
        inside = (stations > start + 1e-9) & (stations < end - 1e-9)
        between = np.tile(self.points, (len(laps), 1))[inside]
        return np.vstack([self.at(start)[None], between, self.at(end)[None]])

    def station_of(self, place: Points) -> float:
        """Return the station of the point of the ring that is nearest to a place."""
        import shapely

        return float(shapely.line_locate_point(self.line, shapely.Point(place)))


def rings(region: CentreRegion) -> list[Ring]:
    """Return the rings that clear a region, the walls first, then inwards, then lines through what they leave uncut.

    Walls and islands are passed so that the material is on the right of the tool's way (climb milling with a spindle
    that turns clockwise), or on its left.
    """
    found: list[Ring] = []
    rules, level, inner = region.rules, 0, region.polygon
    while not inner.is_empty:
        for polygon in polygons(inner):
            found.extend(Ring(points, level) for points in CentreRegion(polygon, rules).rings)
        level += 1
        inner = shrunk(region.polygon, level * rules.step_over, rules.tolerance)
    found.extend(Ring(np.vstack([core, core[-2:0:-1]]), level) for core in cores(region, found))
    return found if rules.climb else [Ring(ring.points[::-1], ring.level) for ring in found]


def cores(region: CentreRegion, cut: list[Ring]) -> list[Points]:
    """Return lines along the middle of what rings leave uncut of the region of tool centres, float64[m, 2] each."""
    import shapely

    rules = region.rules
    fine = FINE * rules.tolerance
    covered = shapely.union_all([ring.line.buffer(rules.radius, quad_segs=quarter(rules.radius, fine)) for ring in cut])
    rest = region.polygon.difference(covered)
    return [_core(piece) for piece in polygons(rest) if piece.area > SPECK * math.pi * rules.radius**2]


def _core(place: Any) -> Points:
    """Return a line through a slender polygon: the mean of the two ways along its edge between its farthest points."""
    import shapely

    edge = np.asarray(place.exterior.coords)[:-1]
    reach = np.hypot(*(edge[:, None] - edge[None]).transpose(2, 0, 1))
    i, j = sorted(int(k) for k in np.unravel_index(np.argmax(reach), reach.shape))
    share = np.linspace(0.0, 1.0, CORE_POINTS)
    there, back = shapely.LineString(edge[i : j + 1]), shapely.LineString(np.vstack([edge[j:], edge[: i + 1]])[::-1])
    middle = [
        shapely.get_coordinates(shapely.line_interpolate_point(way, share, normalized=True)) for way in (there, back)
    ]
    return np.asarray(0.5 * (middle[0] + middle[1]), dtype=np.float64)


def neighbours(cut: list[Ring], step_over: float) -> list[tuple[int, int]]:
    """Return the pairs of rings (outer, inner) of which one is the next offset of the other."""
    import shapely

    lines = [ring.line for ring in cut]
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=NEAR * step_over).T
    return [(int(a), int(b)) for a, b in pairs if cut[b].level > cut[a].level]


def contour(region: CentreRegion) -> PocketPath:
    """Return contour-parallel clearing: every ring closed, from the inside out, linked at depth where the way is free.

    A ring is cut when all rings inside it are; of those the one that is nearest to the tool.
    """
    import shapely

    cut, rules = rings(region), region.rules
    inner: dict[int, set[int]] = {a: set() for a in range(len(cut))}
    for a, b in neighbours(cut, rules.step_over):
        inner[a].add(b)
    tool = _first_place(cut)
    pieces: list[PocketPiece] = []
    left = set(range(len(cut)))
    while left:
        ready = sorted(a for a in left if not inner[a] & left)
        here = shapely.Point(tool)
        a = min(ready, key=lambda r: (round(cut[r].line.distance(here), 6), -cut[r].level))
        start = cut[a].station_of(tool)
        way = cut[a].stretch(start, start + cut[a].length)
        link = shapely.LineString([tool, way[0]])
        if pieces and 0.0 < link.length <= LINK_STEPS * rules.step_over and _free(region, link):
            pieces.append(PocketPiece(as_polyline(link.coords), "link"))
        pieces.append(PocketPiece(as_polyline(way), kind_of(cut[a], rules)))
        tool = way[-1]
        left.remove(a)
    return PocketPath("contour", tuple(pieces))


def kind_of(ring: Ring, rules: PocketRules) -> str:
    """Return what a ring is for: along a wall without stock it finishes."""
    return "finish" if ring.level == 0 and rules.stock == 0.0 else "rough"


def _first_place(cut: list[Ring]) -> Points:
    """Return where clearing begins: on the innermost ring."""
    return max(cut, key=lambda ring: ring.level).points[0]


def _free(region: CentreRegion, line: Any) -> bool:
    """Return whether a line stays in the region of tool centres; its ends lie on rings but for rounding."""
    import shapely

    return bool(shapely.difference(line, region.polygon).length < 1e-6)
