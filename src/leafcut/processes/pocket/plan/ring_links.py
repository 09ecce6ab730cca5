"""Connect all rings to a single path without retracts, using joints between neighbouring rings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from leafcut.geometry.arrays import Indices, Points
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.rings import NEAR, never_stopped
from leafcut.processes.pocket.plan.stationed_path import Ring

#: Spacing of candidate joints along a ring, in step-overs.
STATION_STEP = 0.25
#: Minimum share of the smaller ring that must be near the larger ring if both rings run side by side.
LONG = 0.3
#: Maximum number of spines (chains of nested rings) to try.
MOST_SPINES = 12
#: Maximum number of joints between two rings that are tried after the first possible joint.
MOST_LOOKS = 60
#: Share of the usual gap that is used if only one of the two rings has a gap.
ONE_SIDED = 1.0
#: Maximum distance between rings to join, in step-overs. This limit is ignored if it leaves rings unconnected.
FAR = 2.5
#: Minimum length of a ring that may have a gap, in step-overs.
TINY = 3.0
#: Cost of turns inside the gap of a joint, in step-overs per radian. It keeps gaps out of corners.
TURN_PENALTY = 0.3
#: Distance from avoided positions within which a joint gets a penalty, and this penalty, both in step-overs.
AVOIDED, AVOIDED_PENALTY = 2.0, 4.0


@dataclass(frozen=True)
class Joint:
    """A detour from a ring (`parent`) along another ring (`child`). All lengths are in mm.

    The path leaves the parent half a gap before the station, and returns half a gap after the station. The child ring
    is not closed either, because it has its own gap.
    """

    parent: int
    child: int
    parent_station: float
    child_station: float
    parent_gap: float
    child_gap: float


class _JointOptions(NamedTuple):
    """The candidate joints between two rings, cheapest first.

    Attributes
    ----------
    costs
        Extra path length, float64[n], mm.
    stations, gaps
        Station and gap on the parent and on the child, float64[n, 2], mm.
    """

    costs: Points
    stations: Points
    gaps: Points


def _run_side_by_side(a: Ring, b: Ring, step_over: float) -> bool:
    small, large = (a, b) if a.length <= b.length else (b, a)
    if a.level == b.level:
        return False
    n = max(math.ceil(small.length / (STATION_STEP * step_over)), 8)
    away, _ = large.nearest_stations(small.positions_at(np.arange(n) * small.length / n))
    return bool((away <= 1.05 * step_over).mean() >= LONG)


def ring_chains(cut: list[Ring], edges: list[tuple[int, int]], step_over: float) -> list[list[int]]:
    """Return chains of adjacent nested rings, most promising chain first. Each chain runs from the inside out.

    `edges` contains the pairs of rings that can be joined.
    """
    inner: dict[int, list[int]] = {}
    for a, b in edges:
        if _run_side_by_side(cut[a], cut[b], step_over):
            low, high = (a, b) if cut[a].level < cut[b].level else (b, a)
            inner.setdefault(low, []).append(high)
    candidates: list[list[int]] = []

    def deeper(spine: list[int]) -> None:
        candidates.append(spine[::-1])
        for ring in inner.get(spine[-1], ()):
            deeper([*spine, ring])

    for ring in range(len(cut)):
        deeper([ring])
    candidates.sort(key=lambda spine: (-len(spine), spine[-1]))
    return [spine for spine in candidates if len(spine) >= len(candidates[0]) - 2][:MOST_SPINES]


def tree_children(spine: list[int], edges: list[tuple[int, int]], n: int) -> dict[int, list[int]]:
    """Return the children of each of the `n` rings in a tree that grows from the rings of the spine."""
    beside: list[list[int]] = [[] for _ in range(n)]
    for i, j in edges:
        beside[i].append(j)
        beside[j].append(i)
    children: dict[int, list[int]] = {i: [] for i in range(n)}
    seen, queue = set(spine), list(spine)
    for i in queue:
        for j in beside[i]:
            if j not in seen:
                seen.add(j)
                children[i].append(j)
                queue.append(j)
    return children


def joint_spanning_tree(cut: list[Ring], step_over: float) -> list[tuple[int, int]]:
    """Return the pairs of rings to join. They form a minimum spanning tree of joints (Kruskal 1956).

    The line between the nearest points of two joined groups never crosses a wall. Otherwise, a ring along this wall
    would be closer.
    """
    lines = np.array([ring.line for ring in cut])
    a, b = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=FAR * step_over)
    tree = _kruskal(cut, a[a < b], b[a < b], step_over)
    return tree if len(tree) == len(cut) - 1 else _kruskal(cut, *np.triu_indices(len(cut), 1), step_over)


def _kruskal(cut: list[Ring], a: Indices, b: Indices, step_over: float) -> list[tuple[int, int]]:
    lines = np.array([ring.line for ring in cut])
    levels = np.array([ring.level for ring in cut])
    # Neighbouring offsets are one step-over apart, so they are not measured; measuring long rings is slow.
    near = np.full(len(a), step_over)
    rest = ~((np.abs(levels[a] - levels[b]) == 1) & shapely.dwithin(lines[a], lines[b], NEAR * step_over))
    near[rest] = shapely.distance(lines[a[rest]], lines[b[rest]])
    both_walls = (levels[a] == 0) & (levels[b] == 0)
    weight = near + np.where(levels[a] == levels[b], 0.5 * step_over, 0.0) + np.where(both_walls, step_over, 0.0)
    group = list(range(len(cut)))

    def top(i: int) -> int:
        while group[i] != i:
            group[i] = group[group[i]]
            i = group[i]
        return i

    tree = []
    for k in np.lexsort((near, weight)):
        i, j = top(int(a[k])), top(int(b[k]))
        if i != j:
            group[i] = j
            tree.append((int(a[k]), int(b[k])))
    return tree


class RingLinks:
    """Finds the joints between all rings, and the path along the joined rings.

    As soon as `stopped` returns True, the search stops and the first possible joints are used.
    """

    def __init__(self, region: CentreRegion, cut: list[Ring], stopped: Callable[[], bool] = never_stopped) -> None:
        self.region, self.cut, self.stopped = region, cut, stopped
        self.edges = joint_spanning_tree(cut, region.rules.step_over)
        self.step = region.rules.step_over
        self.allowed = region.polygon.buffer(1e-6)
        shapely.prepare(self.allowed)
        self.spine, self.spans = self._best_spine()
        self.children = tree_children(self.spine, self.edges, len(cut))
        self.options: dict[tuple[int, int], _JointOptions] = {}
        self._remove_joints()

    def _remove_joints(self) -> None:
        self.taken: list[list[tuple[float, float]]] = [[] for _ in self.cut]
        self.joints: dict[int, list[Joint]] = {i: [] for i in range(len(self.cut))}
        self.apart: list[int] = []
        self.links: list[Points] = []

    def joint_gap(self, ring: int) -> float:
        """Return the length of a ring that a joint may leave out, mm. It is 0 for walls and tiny rings."""
        here = self.cut[ring]
        return 0.0 if here.level == 0 or here.length < TINY * self.step else self.step

    def joined_paths(self, avoided: Points) -> list[Points]:
        """Return the joined path, float64[n, 2], mm, followed by all rings that have no joint.

        Joints keep away from the positions `avoided`.
        """
        self._remove_joints()
        self.avoided = shapely.multipoints(avoided)
        for ring, (start, end) in zip(self.spine, self.spans, strict=True):
            self.taken[ring].append((end, start + self.cut[ring].length))
        self._join_children()
        paths = [np.vstack([self._path_around(ring, *span) for ring, span in zip(self.spine, self.spans, strict=True)])]
        for one, after, (_, end), (start, _) in zip(
            self.spine, self.spine[1:], self.spans, self.spans[1:], strict=False
        ):
            self.links += [self.cut[one].position_at(end), self.cut[after].position_at(start)]
        return paths + [self._path_around(ring, 0.0, self.cut[ring].length) for ring in self.apart]

    def _best_spine(self) -> tuple[list[int], list[tuple[float, float]]]:
        best: tuple[float, list[int], list[tuple[float, float]]] | None = None
        for spine in ring_chains(self.cut, self.edges, self.step):
            first = self.cut[spine[0]]
            n = max(min(math.ceil(first.length / self.step), 24), 4)
            # Approximate saving, because the joints of a spine are crossed once instead of twice.
            spared = self.step * (len(spine) + (self.cut[spine[-1]].level == 0))
            for start in np.arange(n) * first.length / n:
                if best is not None and math.isfinite(best[0]) and self.stopped():
                    return best[1:]
                cost, spans = self._spine_from(spine, float(start))
                if best is None or cost - spared < best[0] - 1e-9:
                    best = (cost - spared, spine, spans)
        assert best is not None
        return best[1:]

    def _spine_from(self, spine: list[int], start: float) -> tuple[float, list[tuple[float, float]]]:
        cost, spans = 0.0, []
        for k, ring in enumerate(spine):
            here, last = self.cut[ring], k + 1 == len(spine)
            end = start + here.length - (0.0 if last else self.joint_gap(ring))
            spans.append((start, end))
            if not last:
                more, start = self._cheapest_link(ring, end, spine[k + 1])
                cost += more
        return cost, spans

    def _cheapest_link(self, ring: int, end: float, after: int) -> tuple[float, float]:
        """Find the cheapest link from station `end` of a ring to the next ring of the spine, `after`.

        Return the cost of the link, mm, and its station on the ring `after`, mm.
        """
        place, to = self.cut[ring].position_at(end), self.cut[after]
        nearest = to.nearest_station(place)
        options = [nearest + share * self.step for share in (0.0, 0.5, 1.0, 1.5)]
        costs = [
            self._link_length(place, to.position_at(s))
            + TURN_PENALTY * self.step * _total_turn(to, s - self.joint_gap(after), self.joint_gap(after))
            for s in options
        ]
        best = int(np.argmin(costs))
        return costs[best] - self.joint_gap(ring), options[best]

    def _link_length(self, a: Points, b: Points) -> float:
        """Return the length of a straight link, mm, or infinity if the link leaves the region."""
        line = shapely.LineString([a, b])
        return float(line.length) if self.allowed.covers(line) else math.inf

    def _join_children(self) -> None:
        left = [(ring, child) for ring in reversed(self.spine) for child in reversed(self.children[ring])]
        while left:
            ring, child = left.pop()
            joint = self._best_joint(ring, child)
            if joint is None:
                self.apart.append(child)
            else:
                self.joints[ring].append(joint)
                self.links.append(self.cut[child].position_at(joint.child_station))
                self._reserve_gap(ring, joint.parent_station, joint.parent_gap)
                self._reserve_gap(child, joint.child_station, joint.child_gap)
            left += [(child, further) for further in reversed(self.children[child])]

    def _reserve_gap(self, ring: int, station: float, gap: float) -> None:
        self.taken[ring].append((station - 0.5 * gap, station + 0.5 * gap))

    def _best_joint(self, parent: int, child: int) -> Joint | None:
        if (parent, child) not in self.options:
            self.options[parent, child] = self._joint_options(parent, child)
        options = self.options[parent, child]
        best: tuple[float, Joint | None] = (math.inf, None)
        tried, limit = 0, 0 if self.stopped() else MOST_LOOKS
        for k, cost in enumerate(options.costs):
            if cost >= best[0] or tried > limit:
                break
            tried += best[1] is not None
            joint = Joint(parent, child, *options.stations[k], *options.gaps[k])
            more = self._joint_penalty(joint)
            if cost + more < best[0] - 1e-9:
                best = (cost + more, joint)
        return best[1]

    def _joint_options(self, parent: int, child: int) -> _JointOptions:
        a, b = self.cut[parent], self.cut[child]
        stations = self._near_stations(parent, child)
        costs, all_gaps = [], []
        for share in (1.0, 0.5, 0.0):
            gaps = share * self.joint_gap(parent), share * self.joint_gap(child)
            if not all(gaps):  # at most one ring has a gap
                gaps = ONE_SIDED * gaps[0], ONE_SIDED * gaps[1]
            leave, back = (a.positions_at(stations[:, 0] + side * gaps[0]) for side in (-0.5, 0.5))
            enter, out = (b.positions_at(stations[:, 1] + side * gaps[1]) for side in (0.5, -0.5))
            costs.append(np.hypot(*(leave - enter).T) + np.hypot(*(out - back).T) - sum(gaps))
            all_gaps.append(np.tile(gaps, (len(stations), 1)))
            if not sum(gaps):
                break
        cost = np.concatenate(costs)
        order = np.argsort(cost, kind="stable")
        return _JointOptions(cost[order], np.tile(stations, (len(costs), 1))[order], np.vstack(all_gaps)[order])

    def _near_stations(self, parent: int, child: int) -> Points:
        """Return pairs of stations (parent, child) at which two rings are close to each other, float64[n, 2], mm."""
        a, b = self.cut[parent], self.cut[child]
        pairs = []
        for ring, other, order in ((b, a, [1, 0]), (a, b, [0, 1])):
            n = max(math.ceil(ring.length / (STATION_STEP * self.step)), 8)
            stations = np.concatenate([np.arange(n) * ring.length / n, ring.stations[:-1]])
            away, located = other.nearest_stations(ring.positions_at(stations))
            keep = away <= away.min() + self.step
            pairs.append(np.column_stack([stations, located])[keep][:, order])
        both: Points = np.vstack(pairs)
        return both

    def _joint_penalty(self, joint: Joint) -> float:
        """Return the penalty for turns in the gaps of a joint and for avoided positions, mm.

        An impossible joint has an infinite penalty.
        """
        a, b = self.cut[joint.parent], self.cut[joint.child]
        ha, hb = 0.5 * joint.parent_gap, 0.5 * joint.child_gap
        if not self._has_room_for_joint(joint.parent, joint.parent_station, ha):
            return math.inf
        if not self._has_room_for_joint(joint.child, joint.child_station, hb):
            return math.inf
        links = (
            (a.position_at(joint.parent_station - ha), b.position_at(joint.child_station + hb)),
            (
                b.position_at(joint.child_station - hb),
                a.position_at(joint.parent_station + ha),
            ),
        )
        if any(math.isinf(self._link_length(*link)) for link in links):
            return math.inf
        turn = _total_turn(a, joint.parent_station - ha, 2 * ha) + _total_turn(b, joint.child_station - hb, 2 * hb)
        near = self._is_avoided(b.position_at(joint.child_station)) or self._is_avoided(
            a.position_at(joint.parent_station)
        )
        return (TURN_PENALTY * turn + AVOIDED_PENALTY * near) * self.step

    def _is_avoided(self, place: Points) -> bool:
        return bool(shapely.dwithin(shapely.Point(place), self.avoided, AVOIDED * self.step))

    def _has_room_for_joint(self, ring: int, station: float, half: float) -> bool:
        """Return whether a ring has no other joint within `half` mm of a station on either side."""
        length = self.cut[ring].length
        for start, end in self.taken[ring]:
            middle, reach = 0.5 * (start + end), 0.5 * (end - start) + half - 1e-9
            if abs((station - middle + 0.5 * length) % length - 0.5 * length) < reach:
                return False
        return True

    def _path_around(self, ring: int, start: float, end: float) -> Points:
        here = self.cut[ring]
        stops = [((joint.parent_station - 1e-9 - start) % here.length + start, joint) for joint in self.joints[ring]]
        parts, at = [], start
        for station, joint in sorted(stops, key=lambda stop: stop[0]):
            parts.append(here.points_between(at, max(station - 0.5 * joint.parent_gap, at)))
            first = joint.child_station + 0.5 * joint.child_gap
            parts.append(self._path_around(joint.child, first, first + self.cut[joint.child].length - joint.child_gap))
            at = station + 0.5 * joint.parent_gap
        parts.append(here.points_between(at, max(end, at)))
        return np.vstack(parts)


def _total_turn(ring: Ring, start: float, length: float) -> float:
    """Return the total angle by which a ring turns over the given length, rad."""
    if length <= 0.0:
        return 0.0
    points = ring.points_between(start, start + length)
    steps = np.diff(points, axis=0)
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    return float(np.abs((np.diff(angles) + math.pi) % (2.0 * math.pi) - math.pi).sum())
