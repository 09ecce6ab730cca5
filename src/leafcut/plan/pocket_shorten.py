"""A way over a pocket made shorter where the ground it clears is cleared by its other passes too."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.polyline import Points

#: Points of the ground are so many tool radii apart.
GROUND_PITCH = 0.11
#: Pieces of the way are no longer than this, in tool radii.
PIECE = 0.2
#: Stretches that may be replaced, in tool radii to either side of a bend.
REACHES = (5.0, 4.0, 3.2, 2.4, 1.8, 1.4, 1.0, 0.7, 0.5, 0.3, 0.2)
#: A turn by less than this over a tool radius is no bend, rad.
BEND = 0.2
#: A stretch is replaced where that spares so much, in tool radii.
WORTH = 0.01
#: Chords of a curve that replaces a stretch.
CURVE = 8


class Ground:
    """Points of the ground and how far from each the way may pass at most."""

    def __init__(self, points: Points, limits: Points) -> None:
        import shapely

        self.points, self.limits = points, limits
        self.geoms = shapely.points(points)
        order = np.unique(limits)
        self.classes = []
        for limit in order:
            rows = np.flatnonzero(limits == limit)
            self.classes.append((float(limit), rows, shapely.STRtree(self.geoms[rows])))

    def near(self, lines: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the pairs (line, point) where the line is near enough to the point, sorted by line."""
        first, second = [], []
        for limit, rows, tree in self.classes:
            a, b = tree.query(lines, predicate="dwithin", distance=limit)
            first.append(a)
            second.append(rows[b])
        a, b = np.concatenate(first), np.concatenate(second)
        order = np.argsort(a, kind="stable")
        return a[order], b[order]


def fine(way: Points, longest: float) -> Points:
    """Return the way with points on its chords so that none is longer than `longest`, float64[n, 2]."""
    step = np.hypot(*np.diff(way, axis=0).T)
    way = way[np.concatenate([[True], step > 1e-9])]
    step = np.hypot(*np.diff(way, axis=0).T)
    counts = np.maximum(np.ceil(step / longest).astype(int), 1)
    station = np.concatenate([[0.0], np.cumsum(step)])
    at = np.concatenate([station[i] + step[i] * np.arange(n) / n for i, n in enumerate(counts)] + [station[-1:]])
    return np.column_stack([np.interp(at, station, way[:, 0]), np.interp(at, station, way[:, 1])])


def shorten(way: Points, ground: Ground, allowed: Any, radius: float, passes: int = 6) -> Points:
    """Return a way that is as near to all points of the ground as they ask, and no longer."""
    for _ in range(passes):
        shorter = _Pass(fine(way, PIECE * radius), ground, allowed, radius).run()
        spared = _length(way) - _length(shorter)
        way = shorter
        if spared < WORTH * radius:
            break
    return way


def _length(way: Points) -> float:
    return float(np.hypot(*np.diff(way, axis=0).T).sum())


class _Pass:
    """One look at every bend of a way."""

    def __init__(self, way: Points, ground: Ground, allowed: Any, radius: float) -> None:
        import shapely

        self.way, self.ground, self.allowed, self.radius = way, ground, allowed, radius
        self.station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
        lines = shapely.linestrings(np.stack([way[:-1], way[1:]], axis=1))
        piece, point = ground.near(lines)
        self.first = np.searchsorted(piece, np.arange(len(way)))
        self.point = point
        self.count = np.bincount(point, minlength=len(ground.points))
        # Along walls nothing is left out.
        middle = shapely.points(0.5 * (way[:-1] + way[1:]))
        self.fixed = shapely.distance(allowed.boundary, middle) < 1e-5
        self.walls = np.concatenate([[0], np.cumsum(self.fixed)])
        self.done = np.zeros(len(way) - 1, dtype=bool)
        self.edits: list[tuple[int, int, Points]] = []

    def run(self) -> Points:
        self._trim()
        for i in self._bends():
            self._try(i)
        return self._rebuilt()

    def _trim(self) -> None:
        """Leave out what is not needed at both ends."""
        n = len(self.way) - 1
        j = 0
        while j < n - 1 and not self.fixed[j] and self._covered(j, j + 1, None):
            self._remove(j, j + 1)
            j += 1
        if j:
            self.edits.append((0, j, self.way[j : j + 1]))
            self.done[:j] = True
        k = n
        while k > j + 1 and not self.fixed[k - 1] and self._covered(k - 1, k, None):
            self._remove(k - 1, k)
            k -= 1
        if k < n:
            self.edits.append((k, n, self.way[k : k + 1]))
            self.done[k:] = True

    def _bends(self) -> list[int]:
        """Return the points where the way turns, the sharpest first."""
        step = np.diff(self.way, axis=0)
        angle = np.arctan2(step[:, 1], step[:, 0])
        turn = np.zeros(len(self.way))
        turn[1:-1] = np.abs((np.diff(angle) + math.pi) % (2.0 * math.pi) - math.pi)
        found = np.flatnonzero(turn > BEND)
        return [int(i) for i in found[np.argsort(-turn[found], kind="stable")]]

    def _try(self, i: int) -> None:
        """Replace the longest stretch around a bend that can be spared."""
        for before, after in _spans():
            a = int(np.searchsorted(self.station, self.station[i] - before * self.radius))
            b = int(np.searchsorted(self.station, self.station[i] + after * self.radius, side="right")) - 1
            a, b = max(a, 0), min(b, len(self.way) - 1)
            if not a < i < b or self.walls[b] - self.walls[a] or self.done[a:b].any():
                continue
            for curve in self._curves(a, i, b):
                spared = self.station[b] - self.station[a] - _length(curve)
                if spared < WORTH * self.radius:
                    continue
                if self._covered(a, b, curve) and self._inside(curve):
                    self._remove(a, b)
                    self._add(curve)
                    self.done[a:b] = True
                    self.edits.append((a, b, curve))
                    return

    def _curves(self, a: int, i: int, b: int) -> list[Points]:
        """Return what may replace a stretch: the chord, a curve through it."""
        t = np.linspace(0.0, 1.0, CURVE + 1)[:, None]
        p, q, r = self.way[a], self.way[i], self.way[b]
        return [(1 - t) ** 2 * p + 2 * t * (1 - t) * q + t * t * r]

    def _inside(self, curve: Points) -> bool:
        import shapely

        return bool(self.allowed.covers(shapely.LineString(curve)))

    def _points_of(self, a: int, b: int) -> NDArray[np.int64]:
        return self.point[self.first[a] : self.first[b]]

    def _covered(self, a: int, b: int, curve: Points | None) -> bool:
        """Return whether all ground is still near the way when a stretch is replaced by a curve."""
        import shapely

        who, times = np.unique(self._points_of(a, b), return_counts=True)
        lost = who[self.count[who] <= times]
        if not len(lost):
            return True
        if curve is None:
            return False
        away = shapely.distance(shapely.LineString(curve), self.ground.geoms[lost])
        return bool((away <= self.ground.limits[lost]).all())

    def _remove(self, a: int, b: int) -> None:
        np.subtract.at(self.count, self._points_of(a, b), 1)

    def _add(self, curve: Points) -> None:
        import shapely

        _, who = self.ground.near(np.array([shapely.LineString(curve)]))
        self.count[who] += 1

    def _rebuilt(self) -> Points:
        parts, at = [], 0
        for a, b, curve in sorted(self.edits, key=lambda e: e[0]):
            parts += [self.way[at : a + 1], curve]
            at = b
        if not parts:
            return self.way
        if self.edits and min(e[0] for e in self.edits) == 0:
            pass
        return np.vstack([*parts, self.way[at:]])


def _spans() -> list[tuple[float, float]]:
    """Return the stretches tried, before and behind a bend: the longest first."""
    return [(r, r) for r in REACHES]
