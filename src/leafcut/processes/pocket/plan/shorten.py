"""Shorten a path in places where other passes already clear the area."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices, Points
from leafcut.model.pocket import PocketRules
from leafcut.processes.pocket.plan.coverage_points import CoverageGrid
from leafcut.processes.pocket.plan.region import CentreRegion

#: A section that is replaced: indices of its first and last point, and the points of the new curve.
Edit = tuple[int, int, Points]

#: Spacing of the sample points of the area, in tool radii.
SAMPLE_SPACING = 0.11
#: Maximum length of a segment of the sampled path, in tool radii.
PIECE = 0.2
#: Candidate lengths of a replaced section on each side of a bend, in tool radii.
REACHES = (5.0, 4.0, 3.2, 2.4, 1.8, 1.4, 1.0, 0.7, 0.5, 0.3, 0.2)
#: Candidate lengths of a chamfer on each side of a corner, in tool radii.
CHAMFERS = (0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2)
#: Distance from a chamfer within which other passes are considered, in step-overs.
PASS_SEARCH_RADIUS = 3.0
#: Maximum angle between passes that run side by side, rad. Passes at larger angles meet in a corner.
SIDE_BY_SIDE = math.radians(30.0)
#: Tolerance for chords and rounding, relative to the step-over.
SLACK = 0.004
#: Maximum number of rounds over the bends of a path.
PASSES = 6
#: Minimum change of direction at a bend, rad.
BEND = 0.6
#: Minimum length that a replacement must save, in tool radii.
MIN_SAVING = 0.01
#: Number of chords of a replacement curve.
CURVE = 8


def subdivide_path(path: Points, longest: float) -> Points:
    """Add points to a path, float64[n, 2], so that no segment is longer than `longest` mm."""
    step = np.hypot(*np.diff(path, axis=0).T)
    path = path[np.concatenate([[True], step > 1e-9])]
    step = np.hypot(*np.diff(path, axis=0).T)
    counts = np.maximum(np.ceil(step / longest).astype(int), 1)
    station = np.concatenate([[0.0], np.cumsum(step)])
    row = np.repeat(np.arange(len(step)), counts)
    share = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    at = np.append(station[row] + step[row] * share / counts[row], station[-1])
    return np.column_stack([np.interp(at, station, path[:, 0]), np.interp(at, station, path[:, 1])])


def shorten_path(
    path: Points, coverage: CoverageGrid, region: CentreRegion, allowed: Any, kept: Points, stopped: Callable[[], bool]
) -> Points:
    """Shorten a path while every sample point stays within its maximum distance from the path.

    The path stays unchanged within a tool radius of the points `kept`, float64[n, 2]. When `stopped` returns True, the
    function returns the current path.
    """
    radius, changed = region.rules.radius, None
    for _ in range(PASSES):
        if stopped():
            break
        bends = _BendShortener(subdivide_path(path, PIECE * radius), coverage, region.rules, allowed, changed)
        near = _near_any(bends.path, kept, radius)
        bends.done |= near[:-1] | near[1:]
        bends.trim_ends()
        bends.shorten_all(stopped)
        shorter = bends.path_with_edits(bends.edits)
        spared = _length(path) - _length(shorter)
        path, changed = shorter, bends.changed_points()
        if spared < MIN_SAVING * radius:
            break
    return path


def chamfer_corners(
    path: Points, coverage: CoverageGrid, region: CentreRegion, allowed: Any, links: Points, stopped: Callable[[], bool]
) -> Points:
    """Chamfer the sharp corners of a path, except near the points `links`, float64[n, 2]."""
    if stopped():
        return path
    corners = _CornerChamferer(subdivide_path(path, PIECE * region.rules.radius), coverage, region.rules, allowed)
    corners.done |= _near_any(corners.path, links, region.rules.radius)[:-1]
    corners.shorten_all(stopped)
    return corners.path_with_edits(corners.edits)


def _near_any(path: Points, places: Points, distance: float) -> NDArray[np.bool_]:
    near = np.zeros(len(path), dtype=bool)
    spots: Any = shapely.points(places)
    near[shapely.STRtree(spots).query(shapely.points(path), predicate="dwithin", distance=distance)[0]] = True
    return near


def _length(path: Points) -> float:
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


class _BendShortener:
    """Shortens a path at its bends in a single round.

    If `changed`, float64[n, 2], is given, only bends close to these positions are tried.
    """

    reaches: tuple[float, ...] = REACHES
    least = BEND

    def __init__(
        self, path: Points, coverage: CoverageGrid, rules: PocketRules, allowed: Any, changed: Points | None = None
    ) -> None:
        self.path, self.allowed = path, allowed
        self.radius, self.step = rules.radius, rules.step_over
        self.station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        self.bends = self._sharp_bends(self.least)
        if changed is not None:
            # The reach covers the section at a bend, its sample points, and the passes that may clear these points.
            reach = self.reaches[0] * self.radius + 2.0 * coverage.longest
            near = _near_any(path[self.bends], changed, reach)
            self.bends = [i for i, there in zip(self.bends, near, strict=True) if there]
        selected = self._mask_near_bends()
        self.places = coverage.points_near(path, selected)
        self.geoms = self.places.point_geometries
        self.tree = shapely.STRtree(self.geoms)
        piece, self.point = self.places.pairs_within_limit(path)
        self.first = np.searchsorted(piece, np.arange(len(path)))
        self.count = np.bincount(self.point, minlength=len(self.geoms))
        # Segments along walls and segments without sample points do not change.
        self.fixed = ~selected
        rows = np.flatnonzero(selected)
        edge = allowed.boundary
        shapely.prepare(edge)
        self.fixed[rows] = shapely.dwithin(edge, shapely.points(0.5 * (path[rows] + path[rows + 1])), 1e-5)
        self.walls = np.concatenate([[0], np.cumsum(self.fixed)])
        self.done = np.zeros(len(path) - 1, dtype=bool)
        self.edits: list[Edit] = []

    def _mask_near_bends(self) -> NDArray[np.bool_]:
        """Return a mask of the segments near a bend or near an end of the path, bool[n − 1]."""
        reach = self.reaches[0] * self.radius
        at = self.station[[0, *self.bends, len(self.path) - 1]]
        change = np.zeros(len(self.path) + 1, np.int64)
        np.add.at(change, np.searchsorted(self.station, at - reach), 1)
        np.add.at(change, np.searchsorted(self.station, at + reach, side="right"), -1)
        selected: NDArray[np.bool_] = np.cumsum(change)[: len(self.path) - 1] > 0
        return selected

    def shorten_all(self, stopped: Callable[[], bool]) -> None:
        for i in self.bends:
            if stopped():
                break
            self._shorten_bend(i)

    def trim_ends(self) -> None:
        n = len(self.path) - 1
        j = 0
        while j < n - 1 and not self.fixed[j] and not self.done[j] and self._stays_covered(j, j + 1, None):
            self._remove_stretch(j, j + 1)
            j += 1
        if j:
            self.edits.append((0, j, self.path[j : j + 1]))
            self.done[:j] = True
        k = n
        while k > j + 1 and not self.fixed[k - 1] and not self.done[k - 1] and self._stays_covered(k - 1, k, None):
            self._remove_stretch(k - 1, k)
            k -= 1
        if k < n:
            self.edits.append((k, n, self.path[k : k + 1]))
            self.done[k:] = True

    def _sharp_bends(self, least: float) -> list[int]:
        """Return the points where the path turns by more than `least`, sharpest bend first."""
        step = np.diff(self.path, axis=0)
        angle = np.arctan2(step[:, 1], step[:, 0])
        turn = np.zeros(len(self.path))
        turn[1:-1] = np.abs((np.diff(angle) + math.pi) % (2.0 * math.pi) - math.pi)
        bends = np.flatnonzero(turn > least)
        return [int(i) for i in bends[np.argsort(-turn[bends], kind="stable")]]

    def _shorten_bend(self, i: int) -> None:
        """Replace the section around a bend. The longest section that can be replaced is used."""
        for reach in self.reaches:
            a = int(np.searchsorted(self.station, self.station[i] - reach * self.radius))
            b = int(np.searchsorted(self.station, self.station[i] + reach * self.radius, side="right")) - 1
            a, b = max(a, 0), min(b, len(self.path) - 1)
            if not a < i < b or self.walls[b] - self.walls[a] or self.done[a:b].any():
                continue
            curve = self._replacement_curve(a, i, b)
            if curve is None or self.station[b] - self.station[a] - _length(curve) < MIN_SAVING * self.radius:
                continue
            if self._stays_covered(a, b, curve) and self._is_inside(curve):
                self._remove_stretch(a, b)
                self._add_curve(a, curve)
                self.done[a:b] = True
                self.edits.append((a, b, curve))
                return

    def _replacement_curve(self, a: int, i: int, b: int) -> Points | None:
        """Return a parabola that replaces a section.

        It is tangent to the lines from the bend to both ends of the section.
        """
        t = np.linspace(0.0, 1.0, CURVE + 1)[:, None]
        p, q, r = self.path[a], self.path[i], self.path[b]
        curve: Points = (1.0 - t) ** 2 * p + 2.0 * t * (1.0 - t) * q + t * t * r
        return curve

    def _is_inside(self, curve: Points) -> bool:
        return bool(self.allowed.covers(shapely.LineString(curve)))

    def _points_near_segments(self, a: int, b: int) -> Indices:
        return self.point[self.first[a] : self.first[b]]

    def _stays_covered(self, a: int, b: int, curve: Points | None) -> bool:
        who, times = np.unique(self._points_near_segments(a, b), return_counts=True)
        lost = who[self.count[who] <= times]
        if not len(lost):
            return True
        if curve is None:
            return False
        away = shapely.distance(shapely.LineString(curve), self.geoms[lost])
        return bool((away <= self.places.limits[lost]).all())

    def _remove_stretch(self, a: int, b: int) -> None:
        np.subtract.at(self.count, self._points_near_segments(a, b), 1)

    def _add_curve(self, a: int, curve: Points) -> None:
        line = shapely.LineString(curve)
        who = self.tree.query(line, predicate="dwithin", distance=float(self.places.limits.max(initial=0.0)))
        self.count[who[shapely.distance(line, self.geoms[who]) <= self.places.limits[who]]] += 1

    def changed_points(self) -> Points:
        """Return the points of all sections that were replaced, and of their replacements, float64[n, 2]."""
        places = [part for a, b, curve in self.edits for part in (self.path[a : b + 1], curve)]
        return np.vstack([np.zeros((0, 2)), *places])

    def path_with_edits(self, edits: list[Edit]) -> Points:
        parts, at = [], 0
        for a, b, curve in sorted(edits, key=lambda e: e[0]):
            parts += [self.path[at : a + 1], curve]
            at = b
        if not parts:
            return self.path
        return np.vstack([*parts, self.path[at:]])


def _angle(a: Points, b: Points) -> float:
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], a @ b))


class _CornerChamferer(_BendShortener):
    """Chamfers the sharp corners of a path in a single round.

    Passes that run side by side must stay within the step-over. Other passes may be further apart.
    """

    reaches, least = CHAMFERS, 2.0 * SIDE_BY_SIDE

    def __init__(self, path: Points, coverage: CoverageGrid, rules: PocketRules, allowed: Any) -> None:
        super().__init__(path, coverage, rules, allowed)
        points: Any = shapely.points(path)
        self.points = shapely.STRtree(points)
        #: Points of each chamfer, by the index of the path point where the chamfer starts.
        self.chamfers: dict[int, Points] = {}
        self.gone = np.zeros(len(path), dtype=bool)

    def _replacement_curve(self, a: int, i: int, b: int) -> Points | None:
        p, q, r = self.path[a], self.path[i], self.path[b]
        before, after = q - p, r - q
        # `half` is half the interior angle of the corner. Chamfers of neighbouring corners are 1 / sin(half) times as
        # far apart as the passes. Up to the size `longest`, this is allowed: the point midway between two chamfers is
        # closer to the passes than to the chamfers.
        half = max(0.5 * (math.pi - _angle(before, after)), 0.05)
        longest = 0.5 * self.step * (1.0 / math.sin(half) - 1.0) / (math.sin(half) * math.cos(half))
        chord = r - p
        if max(math.hypot(*before), math.hypot(*after)) > longest:
            return None
        for side in (self.path[a + 1] - p, q - p, r - q, r - self.path[b - 1]):
            if side @ chord > math.cos(SIDE_BY_SIDE) * math.hypot(*side) * math.hypot(*chord):
                return None
        return np.array([p, r]) if self._next_passes_close(a, i, b) else None

    def _next_passes_close(self, a: int, i: int, b: int) -> bool:
        """Return whether the passes next to a chamfer stay within the step-over.

        The neighbouring pass is the first pass that touches a growing disc which stays tangent to the chamfer. Passes
        that diverge from the chamfer are ignored.
        """
        p, q, r = self.path[a], self.path[i], self.path[b]
        normal = np.array([p[1] - r[1], r[0] - p[0]]) / max(math.dist(p, r), 1e-9)
        normal *= math.copysign(1.0, (q - p) @ normal)
        reach = PASS_SEARCH_RADIUS * self.step
        rows = np.sort(self.points.query(shapely.box(*(q - reach), *(q + reach))))
        rows = rows[np.abs(self.path[rows] - q).max(axis=1, initial=0.0) < reach]
        chamfers = [self.chamfers[row] for row in rows.tolist() if row in self.chamfers]
        rows = rows[((rows < a) | (rows > b)) & ~self.gone[rows]]
        others = np.vstack([self.path[rows], *chamfers])
        if not len(others):
            return True
        for share, side in ((0.1, 1.0), (0.5, 1.0), (0.9, 1.0), (0.1, -1.0), (0.5, -1.0), (0.9, -1.0)):
            gap = others - ((1.0 - share) * p + share * r)
            height, away = side * (gap @ normal), np.hypot(*gap.T)
            with np.errstate(divide="ignore", invalid="ignore"):
                radius = np.where(height > 1e-6, away**2 / (2.0 * height), np.inf)
            k = int(np.argmin(radius))
            parallel = height[k] >= radius[k] * (1.0 + math.cos(SIDE_BY_SIDE))
            if parallel and height[k] > (1.0 + SLACK) * self.step:
                return False
        return True

    def _remove_stretch(self, a: int, b: int) -> None:
        super()._remove_stretch(a, b)
        self.gone[a + 1 : b] = True

    def _add_curve(self, a: int, curve: Points) -> None:
        super()._add_curve(a, curve)
        share = np.linspace(0.0, 1.0, CURVE + 1)[:, None]
        self.chamfers[a] = (1.0 - share) * curve[0] + share * curve[-1]
