"""Contour-parallel clearing: rings at constant distances from all walls, cut from the inside out."""

from __future__ import annotations

from typing import Any

import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.regions import as_polyline, polygons, shrink_region
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.spurs import add_spurs
from leafcut.processes.pocket.plan.stationed_path import Ring

#: Maximum distance between neighbouring rings, in step-overs.
NEAR = 1.01
#: Maximum length of a link at depth, in step-overs.
LINK_STEPS = 2.0


def offset_rings(region: CentreRegion) -> list[Ring]:
    """Return the rings that clear a region, from the walls inwards.

    With a clockwise spindle, the walls are on the right of the tool for climb milling and on its left for conventional
    milling.
    """
    cut: list[Ring] = []
    rules, level, inner = region.rules, 0, region.polygon
    while not inner.is_empty:
        for polygon in polygons(inner):
            cut.extend(Ring.from_open_points(points, level) for points in CentreRegion(polygon, rules).boundary_rings)
        level += 1
        inner = shrink_region(region.polygon, level * rules.step_over, rules.tolerance)
    return cut if rules.climb else [Ring.from_open_points(ring.points[-2::-1], ring.level) for ring in cut]


def neighbouring_rings(cut: list[Ring], step_over: float) -> list[tuple[int, int]]:
    """Return the pairs of neighbouring rings (outer, inner)."""
    lines = [ring.line for ring in cut]
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=NEAR * step_over).T
    return [(int(a), int(b)) for a, b in pairs if cut[b].level > cut[a].level]


def contour_parallel_path(region: CentreRegion) -> PocketPath:
    """Return closed rings from the inside out, in nearest-neighbour order.

    If a link between two rings is short and fits, the tool stays down.
    """
    rules = region.rules
    cut = offset_rings(region)
    around = [ring.points_between(0.0, ring.length) for ring in cut]
    loops = add_spurs(around, region.polygon, rules)
    cut = [Ring.from_open_points(path[:-1], ring.level) for path, ring in zip(loops, cut, strict=True)]
    inner: dict[int, set[int]] = {a: set() for a in range(len(cut))}
    for a, b in neighbouring_rings(cut, rules.step_over):
        inner[a].add(b)
    path = LinkedPath(region, _innermost_start(cut))
    left = set(range(len(cut)))
    while left:
        ready = sorted(a for a in left if not inner[a] & left)
        here = shapely.Point(path.end)
        a = min(ready, key=lambda r: (round(cut[r].line.distance(here), 6), -cut[r].level))
        start = cut[a].nearest_station(path.end)
        path.append_section(cut[a].points_between(start, start + cut[a].length), ring_section_kind(cut[a], rules))
        left.remove(a)
    return PocketPath("contour", tuple(path.pieces))


class LinkedPath:
    """A path that grows section by section. Its current end point is `end`, float64[2], mm.

    If a straight link to the next section is short and stays in the region, the tool stays down.
    """

    def __init__(self, region: CentreRegion, start: Points) -> None:
        self.region, self.end = region, start
        self.pieces: list[PocketPiece] = []

    def append_section(self, path: Points, kind: str) -> None:
        """Append a path section. The tool stays down if the link is short and stays in the region."""
        link = shapely.LineString([self.end, path[0]])
        if (
            self.pieces
            and 0.0 < link.length <= LINK_STEPS * self.region.rules.step_over
            and stays_in_region(self.region, link)
        ):
            self.pieces.append(PocketPiece(as_polyline(link.coords), "link"))
        self.pieces.append(PocketPiece(as_polyline(path), kind))
        self.end = path[-1]


def never_stopped() -> bool:
    """Return False. A search that uses this function never stops early."""
    return False


def ring_section_kind(ring: Ring, rules: PocketRules) -> str:
    """Return ``finish`` if the ring follows a wall and leaves no stock there, otherwise ``rough``."""
    return "finish" if ring.level == 0 and rules.stock == 0.0 else "rough"


def _innermost_start(cut: list[Ring]) -> Points:
    first: Points = max(cut, key=lambda ring: ring.level).points[0]
    return first


def stays_in_region(region: CentreRegion, line: Any) -> bool:
    """Return whether a line stays in the region of tool centres, within rounding errors."""
    return bool(shapely.difference(line, region.polygon).length < 1e-6)
