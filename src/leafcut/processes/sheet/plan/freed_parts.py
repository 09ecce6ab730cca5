"""Ways of a head that stays down: round the parts that are cut free, which may stand up and be hit.

    found = lead_round(FreedShapes(cutting.sheet, radius), cuts, start, end)

A part is free once its outline is cut without micro-joints. A way between two cuts that would cross one, or come nearer
to it than the radius of the head, goes round it by its corners. Within that radius of the cuts that it leads from and
to it may be nearer: there is no other place for it. Where no such way is found, its middle at least keeps off; where
none is found for that either, it crosses. Both are counted. `cut_free_later` moves the outline of a part behind the
ways that cross it, where that costs less than to go round.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.polygon import orient

from leafcut.geometry.arrays import Point
from leafcut.model.cutting import Cut
from leafcut.model.sheet import Sheet
from leafcut.quick_dataclass import dataclass

#: A way that comes no deeper over a part crosses nothing, mm: what begins a kerf beside one leaves along it.
DEPTH = 0.1
#: Ways go round corners at this distance, mm (an estimate: more would not fit between nested parts), or at the radius
#: of the head and a little more.
MARGIN, BESIDE = 1.0, 0.02
#: Ways are taken to keep the radius of the head when they are nearer by no more than this, mm.
SLACK = 0.01
#: Corners looked at for one way, and rounds in which parts are added that are in the way of the first ones.
MOST_CORNERS, MOST_ROUNDS = 120, 3
#: What a way that cannot go round is taken to cost when orders are compared, in seconds or mm.
HIT = 60.0
#: The same for a way of which the head, but not its middle, comes over a free part.
CLOSE = 15.0
#: So many moves of an outline are tried.
MOST_MOVES = 400

#: Of places on a way: a part by its number, or one place, and whether the whole way begins or ends there.
_Key: TypeAlias = int | tuple[Point, bool]


@dataclass(frozen=True)
class Round:
    """How the head goes.

    Attributes
    ----------
    corners
        Places on the way to a cut, by its number; to the end, by the number of cuts.
    crossing
        Numbers of the cuts to which ways lead that cross a free part all the same.
    close
        The same of ways that cross none, but come nearer to one than the radius of the head.
    ways
        How many there are.
    radius
        Of the head, mm.
    """

    corners: dict[int, list[Point]] = field(default_factory=dict)
    crossing: tuple[int, ...] = ()
    close: tuple[int, ...] = ()
    ways: int = 0
    radius: float = 0.0


def freed_by(sheet: Sheet, cut: Cut) -> list[int]:
    """Return the contours of parts that a cut frees: closed outlines without micro-joints, by no common line."""
    if cut.kind != "cut" or cut.joints or cut.common:
        return []
    outlines = ((k, sheet.contours[k]) for k in cut.contours)
    return [k for k, c in outlines if c.depth % 2 == 0 and c.contour.path.closed and c.contour.kind == "cut"]


def lead_round(shapes: FreedShapes, cuts: Sequence[Cut], start: Point | None, end: Point | None) -> Round:
    """Return how the head goes from cut to cut; `start` and `end` are where it comes from and goes to, or None."""
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
    """Return an order of the cuts in which outlines are cut behind ways that cross their parts, where that costs less.

    Parameters
    ----------
    pairs
        Positions in `cuts`: the first must be cut before the second.
    cost
        Of a straight way, in seconds or mm.
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
        """Return what the ways cost that lead to some cuts of an order, with what is free before them."""
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
            # Before and behind these everything stays as it is.
            free = {one for one, cut in free_at.items() if cut < at}
            if stretch(other, at, place + 1, free) < stretch(order, at, place + 1, free) - 1e-9:
                order, place = other, max(at - 1, 0)
                break
        place += 1
    return order


@dataclass(frozen=True)
class Led:
    """A way: its corners, and what the worst of it is taken to cost: 0, `CLOSE` to a free part or a `HIT`."""

    corners: tuple[Point, ...] = ()
    worst: float = 0.0


@dataclass(frozen=True)
class _Known:
    """What was found for a way: its corners, the parts that mattered to it, and which of them were free."""

    seen: frozenset[int]
    free: frozenset[int]
    corners: list[Point] | None


@dataclass(frozen=True)
class _Nodes:
    """Places that a way may go by, float64[n, 2]: the corners of a part, by its number, or one that stands alone.

    `key` tells them from all others: of a single place, where it is, and whether the whole way begins or ends there.
    """

    key: _Key
    places: NDArray[np.float64]

    @property
    def ends(self) -> bool:
        """Whether the whole way begins or ends here."""
        return not isinstance(self.key, int) and self.key[1]


class FreedShapes:
    """The parts of a sheet as the head may meet them, and its clamps, which are always there.

    What is named as a clamp is kept off by the middle of the head, as everywhere. What was found out about a way is
    known again when another order of the cuts has it, too.
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
        """Return the parts that a straight way crosses, free or not."""
        key = (a, b)
        if key not in self._crossed:
            hit = self._tree.query(shapely.LineString([a, b]), predicate="intersects")
            self._crossed[key] = frozenset(n for n in (self.numbers[k] for k in hit.tolist()) if n >= 0)
        return self._crossed[key]

    def met(self, a: Point, b: Point) -> frozenset[int]:
        """Return the parts, free or not, that a straight way crosses, or comes nearer to than the head is wide."""
        key = (a, b)
        if key not in self._met:
            _, near = self._neared(np.array([[a, b]]), np.array([[True, True]]), self.radius)
            self._met[key] = self.crossed(a, b) | {self.numbers[k] for k in near.tolist()}
        return self._met[key]

    def led(self, a: Point, b: Point, free: set[int]) -> Led:
        """Return the best way that is found: one that keeps off all free parts, or else its middle, or neither."""
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
        """Return the corners of a short way on which a head of this radius keeps off free parts and its middle off
        clamps, or None where none was found."""
        for known in self._known.setdefault((a, b, radius), []):
            if known.seen & free == known.free:
                return known.corners
        seen = set[int]()
        corners = self._sought(a, b, free, radius, seen)
        self._known[a, b, radius].append(_Known(frozenset(seen), frozenset(seen & free), corners))
        return corners

    def _sought(self, a: Point, b: Point, free: set[int], radius: float, seen: set[int]) -> list[Point] | None:
        """Seek what `way_round` returns; add to `seen` the parts of which it mattered whether they are free."""
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
        """Return where the head keeps off each free part that it is beside at a place, straight away from it."""
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
        """Return which lines float64[n, 2, 2] come nearer to which parts than a radius.

        Where a line begins or ends the whole way (bool[n, 2]), it may be nearer within that radius of there.
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
        """Return the outward corners of a part, float64[k, 2], a little beside it, or so far that the head is."""
        beside = max(MARGIN, radius + BESIDE)
        if (number, beside) not in self._corners:
            shape = self._whole[self._place[number]].simplify(0.25 * MARGIN)
            grown = shape.buffer(beside, join_style="mitre", mitre_limit=2.0)
            ring = shapely.get_coordinates(orient(grown).exterior)[:-1]
            one, other = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
            self._corners[number, beside] = ring[one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] > 0.0]
        return self._corners[number, beside]

    def _met_between(self, nodes: Sequence[_Nodes], radius: float) -> NDArray[np.int64]:
        """Return what straight lines between some nodes meet, free or not, as rows (one place, other place, part).

        A line meets a part that it crosses or comes nearer to than the head is wide. That does not depend on what is
        free, and most of it not on where a way begins: it is found out once.
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
        """Return which lines, in order, cross which parts or come nearer to them than a radius, as `_neared` has it."""
        at, what = self._tree.query(shapely.linestrings(lines), predicate="intersects")
        near, by = self._neared(lines, ends, radius)
        which, parts = np.concatenate([at, near]), np.concatenate([what, by])
        order = np.argsort(which, kind="stable")
        return which[order], parts[order]

    def _shortest(
        self, nodes: Sequence[_Nodes], stand: set[int], radius: float, seen: set[int]
    ) -> tuple[list[Point] | None, set[int]]:
        """Return the shortest way from the first of some nodes to the second along straight lines that keep off all
        that stands, and what stands in the way of the lines that do not."""
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
    """Return all pairs of n places and m others, or all two of the same: int64[2, k]."""
    return np.array(np.triu_indices(n, 1) if same else np.indices((n, m)).reshape(2, -1))


def _dijkstra(length: NDArray[np.float64]) -> list[int] | None:
    """Return the shortest way from the first of some places to the second, None where there is none.

    `length` has what each way between two takes: float64[n, n].
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
