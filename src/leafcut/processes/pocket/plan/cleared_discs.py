"""The cleared area as a union of discs of tool centres, and the engagement of the tool on the edge of a new disc."""

from __future__ import annotations

import math

import numpy as np

from leafcut.geometry.arrays import Floats

#: Number of nearest discs from which an engagement is computed; other discs could only reduce it.
_NEAREST = 96
#: Samples of the engagement along an arc: spacing, in tool radii, and maximum number.
_APART, _MOST = 0.1, 160
#: Finer sampling for a safe result, because cusps of earlier arcs cause short peaks of the engagement.
_APART_SURE, _MOST_SURE = 0.025, 1000
_HALF = 0.5 * math.pi
#: Rounding tolerance for points on the edge of a disc, mm.
_SLACK = 1e-6


class ClearedDiscs:
    """The discs cleared so far, in order.

    `turn` is 1 for counter-clockwise arcs, and -1 for clockwise arcs. Some material is not worth cutting: films up to
    a thickness of `fine` mm, and chips no thicker than in a straight cut of `thin` mm width.
    """

    def __init__(self, tool_radius: float, turn: int, fine: float, thin: float) -> None:
        self.tool = tool_radius
        self.turn = turn
        self.fine, self.thin = fine, thin
        self.count = 0
        self._discs = np.zeros((64, 3))

    @property
    def discs(self) -> Floats:
        """Centres and radii of all discs, float64[n, 3], mm."""
        return self._discs[: self.count]

    def add(self, x: float, y: float, radius: float) -> int:
        """Add a disc and return its index."""
        if self.count == len(self._discs):
            self._discs = np.concatenate([self._discs, np.zeros_like(self._discs)])
        self._discs[self.count] = x, y, radius
        self.count += 1
        return self.count - 1

    def arcs(self, x: float, y: float, radius: float) -> list[tuple[float, float]]:
        """Return the arcs of a circle outside all discs, as start angle and sweep, rad, in the direction of `turn`.

        Arcs within `fine` mm of the discs, and arcs with thinner chips than a straight cut of width `thin` mm, are
        omitted.
        """
        return self._arcs(x, y, radius, self.discs)

    def contains_disc(self, x: float, y: float, radius: float, but: float) -> bool:
        """Return whether a cleared disc contains the given disc, except for a film of `but` mm."""
        discs = self.discs
        return bool((np.hypot(discs[:, 0] - x, discs[:, 1] - y) + radius <= discs[:, 2] + but).any())

    def _arcs(self, x: float, y: float, radius: float, discs: Floats) -> list[tuple[float, float]]:
        dx, dy = discs[:, 0] - x, discs[:, 1] - y
        distance = np.hypot(dx, dy)
        reach, film = discs[:, 2], min(self.fine, self.thin * radius / (self.tool + radius))
        if len(discs) and (distance + radius <= reach + film).any():
            return []
        touching = (distance < radius + reach) & (distance > np.abs(radius - reach))
        if not touching.any():
            return [(0.0, math.tau)]
        d, r = distance[touching], reach[touching]
        half = np.arccos(np.clip((d * d + radius * radius - r * r) / (2.0 * d * radius), -1.0, 1.0))
        middle = self.turn * np.arctan2(dy[touching], dx[touching])
        start = (middle - half) % math.tau
        order = np.argsort(start)
        start, end = start[order], (start + 2.0 * half)[order]
        gaps, reached = [], float(end.max()) - math.tau
        for a, b in zip(start.tolist(), end.tolist(), strict=True):
            if a > reached:
                gaps.append((reached, a))
            reached = max(reached, b)
        arcs = [(self.turn * a, b - a) for a, b in gaps]
        return [arc for arc in arcs if self._arc_depth(x, y, radius, arc, discs) > film]

    def _arc_depth(self, x: float, y: float, radius: float, arc: tuple[float, float], discs: Floats) -> float:
        angle = arc[0] + self.turn * arc[1] * np.linspace(0.0, 1.0, 9)[1:-1]
        px, py = x + radius * np.cos(angle), y + radius * np.sin(angle)
        gaps = np.hypot(px[:, None] - discs[:, 0], py[:, None] - discs[:, 1]) - discs[:, 2]
        return float(gaps.min(axis=1).max())

    def engagement(self, x: float, y: float, radius: float, sure: bool = False) -> float:
        """Return the maximum engagement of the tool along the uncut arcs of a circle, rad; 0 in air.

        If `sure`, the engagement is sampled at more points.
        """
        discs = self.discs
        gap = np.hypot(discs[:, 0] - x, discs[:, 1] - y) - discs[:, 2]
        if len(discs) > _NEAREST:
            discs = discs[np.argpartition(gap, _NEAREST)[:_NEAREST]]
        arcs = self._arcs(x, y, radius, discs)
        if not arcs:
            return 0.0
        apart, most = (_APART_SURE, _MOST_SURE) if sure else (_APART, _MOST)
        step = apart * min(self.tool, radius + 0.01)
        angles = []
        for start, sweep in arcs:
            samples = min(max(math.ceil(sweep * radius / step), 8), most)
            angles.append(start + self.turn * sweep * np.linspace(0.0, 1.0, samples + 1))
        angle = np.concatenate(angles)
        return float(self._engagement_at(x, y, radius, angle, discs).max())

    def _engagement_at(self, x: float, y: float, radius: float, angle: Floats, discs: Floats) -> Floats:
        """Return the engagement at points of a circle, float64[k], rad.

        The engagement is the angle of the tool's front half that is in uncut material.
        """
        px, py = x + radius * np.cos(angle), y + radius * np.sin(angle)
        dx, dy = discs[:, 0] - px[:, None], discs[:, 1] - py[:, None]
        distance = np.hypot(dx, dy)
        tool, cleared = self.tool, discs[:, 2] + self.tool
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = (tool * tool + distance * distance - cleared * cleared) / (2.0 * tool * distance)
        half = np.arccos(np.clip(np.where(distance > 0.0, cosine, -1.0), -1.0, 1.0))
        ahead = angle + self.turn * _HALF
        # Angles are relative to the direction of travel; intervals that cross ±π are copied.
        middle = (np.arctan2(dy, dx) - ahead[:, None] + math.pi) % math.tau - math.pi
        low = np.concatenate([middle - half, middle - half + math.tau, middle - half - math.tau], axis=1)
        high = np.concatenate([middle + half, middle + half + math.tau, middle + half - math.tau], axis=1)
        low, high = np.clip(low, -_HALF, _HALF), np.clip(high, -_HALF, _HALF)
        order = np.argsort(low, axis=1)
        low, high = np.take_along_axis(low, order, axis=1), np.take_along_axis(high, order, axis=1)
        reach = np.maximum.accumulate(high, axis=1)
        before = np.concatenate([np.full((len(angle), 1), -_HALF), reach[:, :-1]], axis=1)
        covered: Floats = np.maximum(high - np.maximum(low, before), 0.0).sum(axis=1)
        return math.pi - np.minimum(covered, math.pi)

    def nearest(self, x: float, y: float) -> int:
        """Return the index of the disc in which a point is deepest, or of the nearest disc if it is outside all
        discs.
        """
        discs = self.discs
        return int(np.argmin(np.hypot(discs[:, 0] - x, discs[:, 1] - y) - discs[:, 2]))

    def distances_outside(self, places: Floats) -> Floats:
        """Return the distances of points from the union of all discs, float64[k], mm; negative inside."""
        discs, gaps = self.discs, np.full(len(places), np.inf)
        for first in range(0, len(discs), 256):
            some = discs[first : first + 256]
            away = np.hypot(places[:, :1] - some[:, 0], places[:, 1:2] - some[:, 1]) - some[:, 2]
            gaps = np.minimum(gaps, away.min(axis=1))
        return gaps

    def contains_move(self, a: tuple[float, float], b: tuple[float, float], which: list[int]) -> bool:
        """Return whether the straight move from `a` to `b` is inside the union of the discs with indices `which`."""
        discs = self._discs[which]
        move = np.array(b) - a
        length = float(np.hypot(*move))
        if length == 0.0:
            return True
        from_a = discs[:, :2] - a
        along = from_a @ move / length
        off = (from_a[:, 0] * move[1] - from_a[:, 1] * move[0]) / length
        rest = (discs[:, 2] + _SLACK) ** 2 - off * off
        half = np.sqrt(np.maximum(rest, 0.0))
        there = rest > 0.0
        low, high = (along - half)[there], (along + half)[there]
        order = np.argsort(low)
        reach = 0.0
        for start, end in zip(low[order].tolist(), high[order].tolist(), strict=True):
            if start > reach:
                break
            reach = max(reach, end)
        return reach >= length - _SLACK
