"""Travel moves with the head down, routed around detached parts, which may tip up and be hit.

    found = lead_round(FreedShapes(cutting.sheet, radius), cuts, start, end)

A part is detached once its outline is cut without micro-joints. A move that would cross such a part, or come nearer to
it than the radius of the head, is routed around its corners. Within that radius of its two ends the move may come
nearer, since both ends are fixed. If no such route is found, at least the middle of the head keeps clear; if that fails
too, the move crosses the part. Both cases are counted. `cut_free_later` cuts the outline of a part after the moves that
cross it, if that costs less than the detours.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.polygon import orient

from leafcut.errors import count_of
from leafcut.geometry.arrays import Point
from leafcut.model.cutting import Cut
from leafcut.model.issue import Issue, Severity
from leafcut.model.sheet import Sheet

#: A move that reaches no deeper over a part does not cross it, mm: moves that start in its kerf leave along it.
DEPTH = 0.1
#: Distance of routes from corners, mm (an estimate: more would not fit between nested parts), and what is added to the
#: radius of the head.
MARGIN, BESIDE = 1.0, 0.02
#: Tolerance of the distance of routes from parts, mm.
SLACK = 0.01
#: Maximum number of corners for a route, and of rounds that add obstacles of the routes so far.
MOST_CORNERS, MOST_ROUNDS = 120, 3
#: Cost of a move that crosses a part, for comparing orders, in seconds or mm.
HIT = 60.0
#: The same for a move whose head, but not its middle, comes over a detached part.
CLOSE = 15.0
#: Maximum number of trials that cut an outline later.
MOST_MOVES = 400

#: Key of places on a route: the number of a part, or a place and whether the route starts or ends there.
_Key: TypeAlias = int | tuple[Point, bool]


@dataclass(frozen=True)
class Round:
    """Routes of the head.

    Attributes
    ----------
    corners
        Corners of the route to a cut, by its number; of the route to the end, by the number of cuts.
    crossing
        Numbers of the cuts whose travel move crosses a detached part nevertheless.
    close
        The same for moves that cross no part, but come nearer to one than the radius of the head.
    ways
        Number of travel moves.
    radius
        Of the head, mm.
    """

    corners: dict[int, list[Point]] = field(default_factory=dict)
    crossing: tuple[int, ...] = ()
    close: tuple[int, ...] = ()
    ways: int = 0
    radius: float = 0.0


def freed_issue(led: Round, cuts: Sequence[Cut]) -> Issue | None:
    """Return the note or warning on moves of a head that stays down: the number that cross detached parts, and that of
    detours around them; None without either."""
    if not (led.crossing or led.close or led.corners):
        return None
    round_ = f"{len(led.corners)} of {led.ways} travel moves go around parts that are cut free"
    unknown = "; the diameter of its nozzle is unknown (nozzle_diameter in the machine's profile), so only its middle "
    unknown = "" if led.radius > 0.0 else f"{unknown}is counted"
    if not (led.crossing or led.close):
        words = f"the head stays down between cuts: {round_}, none crosses one{unknown}"
        return Issue("L623", words, "", Severity.NOTE)
    first = min((*led.crossing, *led.close))
    x, y = cuts[min(first, len(cuts) - 1)].path.start
    over = [f"{len(led.crossing)} of {led.ways} travel moves cross parts that are cut free"] if led.crossing else []
    wide = f"a nozzle of {2.0 * led.radius:g} mm comes over parts that are cut free on "
    more = count_of(len(led.close), "more travel move")
    over += [f"{wide}{more if led.crossing else f'{len(led.close)} of {led.ways} travel moves'}"] if led.close else []
    words = (
        f"the head stays down between cuts, and {' and '.join(over)}; free parts may tip up ({round_}){unknown}: hold "
        "them with --micro-joints, or watch them"
    )
    return Issue("L623", words, f"the first on the way to ({x:.4g}, {y:.4g})")


def freed_by(sheet: Sheet, cut: Cut) -> list[int]:
    """Return the outlines that a cut detaches: closed, without micro-joints, and not cut by a common line."""
    if cut.kind != "cut" or cut.joints or cut.common:
        return []
    outlines = ((k, sheet.contours[k]) for k in cut.contours)
    return [k for k, c in outlines if c.depth % 2 == 0 and c.contour.path.closed and c.contour.kind == "cut"]


def lead_round(shapes: FreedShapes, cuts: Sequence[Cut], start: Point | None, end: Point | None) -> Round:
    """Return the routes of the head from cut to cut; `start` and `end` are its first and last place, or None."""
    places = [
        *((start, cut.path.start) if k == 0 else (cuts[k - 1].path.end, cut.path.start) for k, cut in enumerate(cuts))
    ]
    if end is not None and cuts:
        places.append((cuts[-1].path.end, end))
    free: set[int] = set()
    corners: dict[int, list[Point]] = {}
    crossing, close = [], []
    for k, (a, b) in enumerate(places):
        if a is not None:
            led = shapes.led(a, b, free)
            if led.corners:
                corners[k] = list(led.corners)
            if led.worst == HIT:
                crossing.append(k)
            elif led.worst == CLOSE:
                close.append(k)
        if k < len(cuts):
            free |= set(freed_by(shapes.sheet, cuts[k]))
    return Round(corners, tuple(crossing), tuple(close), sum(a is not None for a, _ in places), shapes.radius)


def cut_free_later(
    shapes: FreedShapes, cuts: Sequence[Cut], pairs: Iterable[tuple[int, int]], cost: Callable[[Point, Point], float],
    look: Callable[[], bool],
) -> list[int]:  # fmt: skip
    """Return an order of the cuts with outlines cut after the moves that cross their parts, if that costs less.

    Parameters
    ----------
    pairs
        Positions in `cuts`: the first must be cut before the second.
    cost
        Cost of a straight move, in seconds or mm.
    look
        Called between trials; False ends them.
    """
    frees = [frozenset(freed_by(shapes.sheet, cut)) for cut in cuts]
    before: dict[int, set[int]] = {}
    for a, b in pairs:
        before.setdefault(a, set()).add(b)
    known: dict[tuple[int, int, frozenset[int]], float] = {}

    def way(a: int, b: int, free: set[int]) -> float:
        begin, goal = cuts[a].path.end, cuts[b].path.start
        key = (a, b, shapes.met(begin, goal) & free)
        if key not in known:
            led = shapes.led(begin, goal, free)
            known[key] = sum(cost(p, q) for p, q in pairwise([begin, *led.corners, goal])) + led.worst
        return known[key]

    def stretch(order: Sequence[int], first: int, last: int, free: set[int]) -> float:
        """Return the cost of the moves to some cuts of an order, with the parts detached before them."""
        total = 0.0
        for place in range(first, min(last + 1, len(order))):
            total += way(order[place - 1], order[place], free) if place else 0.0
            free = free | frees[order[place]]
        return total

    order = list(range(len(cuts)))
    tried, place = 0, 1
    while place < len(order) and tried < MOST_MOVES and look():
        met = shapes.met(cuts[order[place - 1]].path.end, cuts[order[place]].path.start)
        free_at = {part: at for at, k in enumerate(order[:place]) for part in frees[k]} if met else {}
        for at in sorted({free_at[part] for part in met & free_at.keys()}):
            moved = order[at]
            between = order[at + 1 : place + 1]
            if not before.get(moved, set()).isdisjoint(between):
                continue
            other = [*order[:at], *between, moved, *order[place + 1 :]]
            tried += 1
            # All other moves stay unchanged.
            free = {one for one, cut in free_at.items() if cut < at}
            if stretch(other, at, place + 1, free) < stretch(order, at, place + 1, free) - 1e-9:
                order, place = other, max(at - 1, 0)
                break
        place += 1
    return order


@dataclass(frozen=True)
class Led:
    """A route: its corners, and its penalty: 0, `CLOSE` to a detached part, or a `HIT`."""

    corners: tuple[Point, ...] = ()
    worst: float = 0.0


@dataclass(frozen=True)
class _Known:
    """A known route: its corners, the parts that influenced it, and the detached parts among them."""

    seen: frozenset[int]
    free: frozenset[int]
    corners: list[Point] | None


@dataclass(frozen=True)
class _Nodes:
    """Places for corners of routes, float64[n, 2]: the corners of a part, or a single place.

    `key` identifies them: the number of the part, or the place and whether the route starts or ends there.
    """

    key: _Key
    places: NDArray[np.float64]

    @property
    def ends(self) -> bool:
        """Whether the route starts or ends here."""
        return not isinstance(self.key, int) and self.key[1]


class FreedShapes:
    """The parts of a sheet as obstacles of the head, and its clamps, which are always obstacles.

    The middle of the head keeps clear of clamps, as everywhere. Results for a move are kept for other orders of the
    cuts.
    """

    def __init__(self, sheet: Sheet, radius: float = 0.0) -> None:
        self.sheet = sheet
        outlines = [
            (k, c.contour.path)
            for k, c in enumerate(sheet.contours)
            if c.depth % 2 == 0 and c.contour.path.closed and c.contour.kind == "cut"
        ]
        whole = [shapely.Polygon(path.flattened(0.05)) for _, path in outlines] + [shapely.box(*z) for z in sheet.zones]
        self.numbers = [k for k, _ in outlines] + [-1 - z for z in range(len(sheet.zones))]
        self.always = {n for n in self.numbers if n < 0}
        self._place = {n: at for at, n in enumerate(self.numbers)}
        self._whole = whole
        self._tree: Any = shapely.STRtree(np.array([shape.buffer(-DEPTH) for shape in whole], dtype=object))
        self._parts: Any = shapely.STRtree(np.array(whole[: len(outlines)], dtype=object))
        self.radius = radius
        self._corners: dict[tuple[int, float], NDArray[np.float64]] = {}
        self._crossed: dict[tuple[Point, Point], frozenset[int]] = {}
        self._met: dict[tuple[Point, Point], frozenset[int]] = {}
        self._known: dict[tuple[Point, Point, float], list[_Known]] = {}
        self._between: dict[tuple[_Key, _Key, float], NDArray[np.int64]] = {}

    def crossed(self, a: Point, b: Point) -> frozenset[int]:
        """Return the parts that a straight move crosses, detached or not."""
        key = (a, b)
        if key not in self._crossed:
            hit = self._tree.query(shapely.LineString([a, b]), predicate="intersects")
            self._crossed[key] = frozenset(n for n in (self.numbers[k] for k in hit.tolist()) if n >= 0)
        return self._crossed[key]

    def met(self, a: Point, b: Point) -> frozenset[int]:
        """Return the parts, detached or not, that a straight move crosses or approaches within the head radius."""
        key = (a, b)
        if key not in self._met:
            _, near = self._neared(np.array([[a, b]]), np.array([[True, True]]), self.radius)
            self._met[key] = self.crossed(a, b) | {self.numbers[k] for k in near.tolist()}
        return self._met[key]

    def led(self, a: Point, b: Point, free: set[int]) -> Led:
        """Return the best route: clear of detached parts for the head, else for its middle, else crossing them."""
        if not self.met(a, b) & free:
            return Led()
        if self.radius > 0.0:
            wide = self.way_round(a, b, free, self.radius)
            if wide is not None:
                return Led(tuple(wide))
        if not self.crossed(a, b) & free:
            return Led((), CLOSE)
        narrow = self.way_round(a, b, free, 0.0)
        if narrow is None:
            return Led((), HIT)
        return Led(tuple(narrow), CLOSE if self.radius > 0.0 else 0.0)

    def way_round(self, a: Point, b: Point, free: set[int], radius: float) -> list[Point] | None:
        """Return the corners of a short route, or None: a head of this radius keeps clear of detached parts, and its
        middle of clamps."""
        for known in self._known.setdefault((a, b, radius), []):
            if known.seen & free == known.free:
                return known.corners
        seen = set[int]()
        corners = self._sought(a, b, free, radius, seen)
        self._known[a, b, radius].append(_Known(frozenset(seen), frozenset(seen & free), corners))
        return corners

    def _sought(self, a: Point, b: Point, free: set[int], radius: float, seen: set[int]) -> list[Point] | None:
        """Find the result of `way_round`; add to `seen` the parts whose state influences it."""
        stand = free | self.always
        met = self.met(a, b) if radius > 0.0 else self.crossed(a, b)
        seen |= met
        blocking = set(met & free)
        away = [*self._steps_away(a, free, radius, seen), *self._steps_away(b, free, radius, seen)]
        ends = [_Nodes((point, k < 2), np.array([point])) for k, point in enumerate([a, b, *away])]
        for _ in range(MOST_ROUNDS):
            nodes = [*ends, *(_Nodes(n, self._around(n, radius)) for n in sorted(blocking))]
            if sum(len(of.places) for of in nodes) > MOST_CORNERS:
                return None
            path, hit = self._shortest(nodes, stand, radius, seen)
            if path is not None:
                return path[1:-1]
            if hit <= blocking:
                return None
            blocking |= hit
        return None

    def _steps_away(self, place: Point, free: set[int], radius: float, seen: set[int]) -> list[Point]:
        """Return places straight away from each detached part near a place, where the head is clear of it."""
        point, away = shapely.Point(place), list[Point]()
        for k in self._parts.query(point, predicate="dwithin", distance=radius).tolist() if radius > 0.0 else ():
            x, y = shapely.get_coordinates(shapely.shortest_line(self._whole[k], point))[0]
            far = math.hypot(place[0] - x, place[1] - y)
            seen.add(self.numbers[k])
            if self.numbers[k] in free and far > 0.0:
                out = (radius + BESIDE) / far
                away.append((float(x + out * (place[0] - x)), float(y + out * (place[1] - y))))
        return away

    def _neared(
        self, lines: NDArray[np.float64], ends: NDArray[np.bool_], radius: float
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return pairs of a line, of float64[n, 2, 2], and a part that it approaches within a radius.

        Within that radius of the start or end of the whole route (bool[n, 2]) a line may come nearer.
        """
        step = lines[:, 1] - lines[:, 0]
        length = np.maximum(np.hypot(*step.T), 1e-12)
        low, high = np.where(ends[:, 0], radius / length, 0.0), np.where(ends[:, 1], 1.0 - radius / length, 1.0)
        some = np.flatnonzero((low < high) & (radius > 0.0))
        begin, end = lines[:, 0] + low[:, None] * step, lines[:, 0] + high[:, None] * step
        cut = shapely.linestrings(np.stack([begin, end], axis=1)[some])
        at, what = self._parts.query(cut, predicate="dwithin", distance=max(radius - SLACK, 0.0))
        return some[at], what

    def _around(self, number: int, radius: float) -> NDArray[np.float64]:
        """Return the outward corners of a part, float64[k, 2], at `MARGIN` or at the radius of the head."""
        beside = max(MARGIN, radius + BESIDE)
        if (number, beside) not in self._corners:
            shape = self._whole[self._place[number]].simplify(0.25 * MARGIN)
            grown = shape.buffer(beside, join_style="mitre", mitre_limit=2.0)
            ring = shapely.get_coordinates(orient(grown).exterior)[:-1]
            one, other = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
            self._corners[number, beside] = ring[one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] > 0.0]
        return self._corners[number, beside]

    def _met_between(self, nodes: Sequence[_Nodes], radius: float) -> NDArray[np.int64]:
        """Return the parts, detached or not, that straight lines between nodes meet, as rows (place, place, part).

        A line meets a part that it crosses or approaches within the radius of the head. The result does not depend on
        the detached parts, and hardly on the ends of the route: it is computed once.
        """
        pairs = [(i, j) for i in range(len(nodes)) for j in range(i, len(nodes))]
        keys = [(nodes[i].key, nodes[j].key, radius) for i, j in pairs]
        new = [pair for pair, key in zip(pairs, keys, strict=True) if key not in self._between]
        if new:
            of = [_pairs(len(nodes[i].places), len(nodes[j].places), i == j) for i, j in new]
            lines = [
                np.stack([nodes[i].places[one], nodes[j].places[other]], axis=1)
                for (i, j), (one, other) in zip(new, of, strict=True)
            ]
            counts = [len(some) for some in lines]
            ends = np.repeat([(nodes[i].ends, nodes[j].ends) for i, j in new], counts, axis=0)
            which, what = self._in_the_way(np.concatenate(lines), ends, radius)
            rows = np.vstack([np.concatenate(of, axis=1)[:, which], what]).T
            splits = np.searchsorted(which, np.cumsum(counts)[:-1])
            for (i, j), some in zip(new, np.split(rows, splits), strict=True):
                self._between[nodes[i].key, nodes[j].key, radius] = some
        first = np.cumsum([0, *(len(of.places) for of in nodes)])
        found = [self._between[key] for key in keys]
        shift = np.zeros((len(pairs), 3), dtype=np.int64)
        shift[:, :2] = first[np.array(pairs)]
        return np.concatenate(found) + np.repeat(shift, [len(some) for some in found], axis=0)

    def _in_the_way(
        self, lines: NDArray[np.float64], ends: NDArray[np.bool_], radius: float
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return pairs, in the order of the lines, of a line and a part that it crosses or approaches (`_neared`)."""
        at, what = self._tree.query(shapely.linestrings(lines), predicate="intersects")
        near, by = self._neared(lines, ends, radius)
        which, parts = np.concatenate([at, near]), np.concatenate([what, by])
        order = np.argsort(which, kind="stable")
        return which[order], parts[order]

    def _shortest(
        self, nodes: Sequence[_Nodes], stand: set[int], radius: float, seen: set[int]
    ) -> tuple[list[Point] | None, set[int]]:
        """Return the shortest route from the first node to the second along lines clear of all obstacles, and the
        obstacles of the other lines."""
        places = np.concatenate([of.places for of in nodes])
        length = np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))
        one, other, what = self._met_between(nodes, radius).T
        parts = {k: self.numbers[k] for k in np.flatnonzero(np.bincount(what)).tolist()}
        seen.update(parts.values())
        stands = np.zeros(len(self.numbers), dtype=bool)
        stands[[k for k, part in parts.items() if part in stand]] = True
        at = stands[what]
        length[one[at], other[at]] = length[other[at], one[at]] = math.inf
        path = _dijkstra(length)
        if path is None:
            return None, stand.intersection(parts.values())
        return [(float(x), float(y)) for x, y in places[path].tolist()], set()


def _pairs(n: int, m: int, same: bool) -> NDArray[np.int64]:
    """Return all pairs of n places and m others, or of two different places of the same n: int64[2, k]."""
    return np.array(np.triu_indices(n, 1) if same else np.indices((n, m)).reshape(2, -1))


def _dijkstra(length: NDArray[np.float64]) -> list[int] | None:
    """Return the shortest path from the first place to the second, or None.

    `length` is the distance between two places, infinite if blocked: float64[n, n].
    """
    n = len(length)
    best, last, queue = [math.inf] * n, [-1] * n, [(0.0, 0)]
    best[0] = 0.0
    while queue:
        so_far, here = heapq.heappop(queue)
        if here == 1:
            path = [1]
            while path[-1] != 0:
                path.append(last[path[-1]])
            return path[::-1]
        if so_far > best[here]:
            continue
        totals = so_far + length[here]
        for there in np.flatnonzero(totals < best).tolist():
            best[there], last[there] = float(totals[there]), here
            heapq.heappush(queue, (best[there], there))
    return None
