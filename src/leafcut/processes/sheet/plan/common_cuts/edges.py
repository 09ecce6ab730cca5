"""Edges of two parts that face each other one kerf apart, or coincide where nothing is compensated."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

from leafcut.geometry.arrays import Point
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules

#: Edges are a kerf apart when their distance differs from it by no more, mm: half of it is what either part is off.
GAP = 0.02
#: Edges that face each other over less are not worth a cut of their own: so many kerfs, and so many mm.
LEAST_KERFS, LEAST = 4.0, 2.0
#: Edges coincide within this, mm: chords of the same arc differ by less.
SAME_EDGE = 0.01
#: Points of a bent edge nearer to its ends are rounding, mm.
LEAST_STEP = 0.02


@dataclass(frozen=True)
class EdgeGap:
    """The room between two edges.

    Attributes
    ----------
    parts
        Positions of the two contours, the lesser first.
    begin, end
        Of its middle, mm: along as much as the edges face each other.
    width
        mm, and `normal` is the unit vector across.
    between
        Points of its middle between `begin` and `end`: chords of a bent edge, whose `width` is 0; it has no `normal`.
    """

    parts: tuple[int, int]
    begin: Point
    end: Point
    width: float
    normal: Point
    between: tuple[Point, ...] = ()

    @property
    def points(self) -> tuple[Point, ...]:
        """From begin to end."""
        return self.begin, *self.between, self.end

    @property
    def length(self) -> float:
        """mm."""
        return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(self.points))


def facing_edges(contours: Sequence[CutContour], rules: CutRules) -> list[EdgeGap]:
    """Return the rooms between straight edges of outlines that are as far apart as the kerf is compensated.

    Only between outlines that border on the same scrap: on the sheet, or in the same hole. Without compensation also
    bent edges that coincide: arcs of the same circle, and polylines with the same corners.
    """
    owner, ends = [], []
    for k, c in enumerate(contours):
        if not c.has_leads or c.hole:
            continue
        path = c.source.contour.path
        path = path if path.area >= 0.0 else path.reversed()
        own = [s for s in path.segments() if not s.is_arc]
        ends += [(s.start, s.end) for s in own]
        owner += [k] * len(own)
    if not ends:
        return [] if rules.half > 0.0 else sorted(_with_bent([], contours), key=lambda s: (s.parts, s.begin))
    table = np.array(ends, dtype=np.float64)
    lines: Any = shapely.linestrings(table)
    gap = 2.0 * rules.half
    first, second = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=gap + GAP)
    found = []
    for i, j in zip(first.tolist(), second.tolist(), strict=True):
        a, b = owner[i], owner[j]
        if a < b and contours[a].source.parent == contours[b].source.parent:
            slot = _slot((a, b), table[i], table[j], gap, least_length(rules))
            if slot is not None:
                found.append(slot)
    found = found if rules.half > 0.0 else _with_bent(found, contours)
    return sorted(found, key=lambda s: (s.parts, s.begin))


def _with_bent(straight: list[EdgeGap], contours: Sequence[CutContour]) -> list[EdgeGap]:
    """Return rooms between edges that coincide; where straight rooms do not cover such an edge, one room does."""
    own = [k for k, c in enumerate(contours) if c.has_leads and not c.hole]
    lines: Any = np.array([contours[k].line for k in own], dtype=object)
    found = list(straight)
    for i, j in shapely.STRtree(lines).query(lines, predicate="dwithin", distance=SAME_EDGE).T.tolist():
        one, other = contours[own[i]], contours[own[j]]
        if i >= j or one.source.parent != other.source.parent:
            continue
        parts = (own[i], own[j])
        shared = lines[i].intersection(lines[j].buffer(SAME_EDGE, cap_style="flat"))
        rooms = [s for s in found if s.parts == parts]
        known = shapely.union_all([shapely.LineString(s.points) for s in rooms]).buffer(2.0 * SAME_EDGE)
        corners = shapely.points(np.concatenate([one.path.vertices, other.path.vertices])[:, :2])
        pieces = [p for p in shapely.get_parts(shared) if p.geom_type == "LineString"]
        for piece in shapely.get_parts(shapely.line_merge(shapely.multilinestrings(pieces))) if pieces else ():
            points = _between_corners(piece, corners)
            if len(points) < 3 or shapely.LineString(points).difference(known).length < LEAST:
                continue
            near = piece.buffer(2.0 * SAME_EDGE)
            found = [s for s in found if s.parts != parts or not near.covers(shapely.LineString(s.points))]
            found.append(EdgeGap(parts, points[0], points[-1], 0.0, (0.0, 0.0), points[1:-1]))
    return found


def _between_corners(piece: Any, corners: Any) -> tuple[Point, ...]:
    """Return the points of an edge that two outlines share, from its first to its last drawn corner.

    Beyond these the outlines part, but may be as near as `SAME_EDGE` for a while.
    """
    on = corners[shapely.dwithin(corners, piece, 2.0 * SAME_EDGE)]
    if len(on) < 2:
        return ()
    at = shapely.line_locate_point(piece, on)
    first, last = int(np.argmin(at)), int(np.argmax(at))
    points = shapely.get_coordinates(substring(piece, float(at[first]), float(at[last]))).tolist()
    ends = shapely.get_coordinates(on[[first, last]]).tolist()
    inner = [p for p in points[1:-1] if min(math.dist(p, end) for end in ends) > LEAST_STEP]
    return tuple((float(x), float(y)) for x, y in (ends[0], *inner, ends[1]))


def least_length(rules: CutRules) -> float:
    """Return the least length over which edges of a common line face each other, mm."""
    return LEAST if rules.half <= 0.0 else max(LEAST_KERFS * rules.kerf, LEAST)


def _slot(parts: tuple[int, int], one: np.ndarray, other: np.ndarray, gap: float, least: float) -> EdgeGap | None:
    """Return the room between two edges, float64[2, 2] each; None where they do not face each other so far apart.

    Outlines run counter-clockwise, so that the scrap is to the right of an edge and a facing one runs against it.
    """
    length = float(np.hypot(*(one[1] - one[0])))
    along = (one[1] - one[0]) / length
    across = np.array([along[1], -along[0]])
    at, away = (other - one[0]) @ along, (other - one[0]) @ across
    if at[0] <= at[1] or np.abs(away - gap).max() > GAP:
        return None
    low, high = max(0.0, float(at[1])), min(length, float(at[0]))
    if high - low < least:
        return None
    width = float(away.mean())
    begin, end = (one[0] + t * along + 0.5 * width * across for t in (low, high))
    return EdgeGap(
        parts,
        (float(begin[0]), float(begin[1])),
        (float(end[0]), float(end[1])),
        width,
        (float(across[0]), float(across[1])),
    )
