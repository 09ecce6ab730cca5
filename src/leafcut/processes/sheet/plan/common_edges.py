"""Find edges that two parts can share in a single cut.

With kerf compensation, such edges are one kerf apart. Without it, they coincide.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.processes.sheet.plan.contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.starts import CutStart

#: Tolerance for the distance between two edges that are one kerf apart, mm. Each of the two parts gets half of it.
GAP = 0.02
#: Minimum overlap of facing edges for a common line, in kerf widths and in mm.
LEAST_KERFS, LEAST = 4.0, 2.0
#: Maximum distance between coincident edges, mm. Different chords of the same arc are closer than this.
SAME_EDGE = 0.01
#: Near the ends of a curved edge, points within this distance are treated as rounding errors, mm.
LEAST_STEP = 0.02
#: Edges coincide if they overlap over at least this length, mm. Over a shorter length, they only cross or touch.
CROSSING = 0.2
#: A contour counts as cut twice if another cut follows more than this share of its length.
MOST = 0.5


@dataclass(frozen=True)
class EdgeGap:
    """The gap between two edges that face each other.

    Attributes
    ----------
    parts
        Indices of the two contours, in ascending order.
    begin, end
        Ends of the centreline of the gap, mm.
    width
        Width of the gap, mm. It is 0 for coincident curved edges.
    normal
        Unit vector across the gap. It is (0, 0) for coincident curved edges.
    between
        For coincident curved edges, the points of the centreline between its ends, mm.
    """

    parts: tuple[int, int]
    begin: Point
    end: Point
    width: float
    normal: Point
    between: tuple[Point, ...] = ()

    @property
    def points(self) -> tuple[Point, ...]:
        """All points of the centreline."""
        return self.begin, *self.between, self.end

    @property
    def length(self) -> float:
        """Length of the centreline, mm."""
        return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(self.points))


def facing_edges(contours: Sequence[CutContour], rules: CutRules) -> list[EdgeGap]:
    """Find pairs of straight edges on different outlines that are exactly one compensated kerf apart.

    Both outlines must lie directly on the sheet or in the same hole. Without kerf compensation, the result also
    includes curved edges that coincide: arcs of the same circle, and polylines with the same corners.
    """
    owner, ends = [], []
    for k, c in enumerate(contours):
        if not c.has_leads or c.hole:
            continue
        path = c.source.path
        path = path if path.area >= 0.0 else path.reversed()
        own = [s for s in path.segments() if not s.is_arc]
        ends += [(s.start, s.end) for s in own]
        owner += [k] * len(own)
    if not ends:
        return [] if rules.half > 0.0 else sorted(_with_curved_edges([], contours), key=lambda s: (s.parts, s.begin))
    table = np.array(ends, dtype=np.float64)
    lines: Any = shapely.linestrings(table)
    gap = 2.0 * rules.half
    first, second = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=gap + GAP)
    found = []
    for i, j in zip(first.tolist(), second.tolist(), strict=True):
        a, b = owner[i], owner[j]
        if a < b and contours[a].source.parent == contours[b].source.parent:
            slot = _edge_gap((a, b), table[i], table[j], gap, min_common_length(rules))
            if slot is not None:
                found.append(slot)
    found = found if rules.half > 0.0 else _with_curved_edges(found, contours)
    return sorted(found, key=lambda s: (s.parts, s.begin))


def _with_curved_edges(straight: list[EdgeGap], contours: Sequence[CutContour]) -> list[EdgeGap]:
    """Add a gap for each pair of coincident curved edges.

    If straight gaps lie inside such an edge, they are removed.
    """
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
    """Return the points of a shared edge from its first to its last corner in the drawing.

    Beyond these corners the outlines separate, even if they stay within `SAME_EDGE` for a short distance.
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


def min_common_length(rules: CutRules) -> float:
    """Return how far two facing edges must overlap to be cut as a common line, mm."""
    return LEAST if rules.half <= 0.0 else max(LEAST_KERFS * rules.kerf, LEAST)


def _edge_gap(parts: tuple[int, int], one: np.ndarray, other: np.ndarray, gap: float, least: float) -> EdgeGap | None:
    """Return the gap between two edges, or None if they do not face each other at the distance `gap`.

    Outlines run counter-clockwise, so the scrap lies to the right of each edge, and facing edges have opposite
    directions.

    Parameters
    ----------
    one, other
        The two edges, float64[2, 2] each, mm.
    gap
        Required distance between the edges, mm.
    least
        Minimum overlap of the edges, mm.
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


# -- edges that are cut twice -----------------------------------------------------------------------------------------


def doubled_edge_issues(contours: Sequence[CutContour], rules: CutRules) -> list[Issue]:
    """Warn about coincident edges that are cut twice because the kerf is not compensated.

    Raises PlanError if a contour shares more than half of its path with another contour.
    """
    cut = [c for c in contours if c.has_leads]
    lines: Any = np.array([c.line for c in cut], dtype=object)
    lengths, places = [], []
    for a, b in shapely.STRtree(lines).query(lines, predicate="dwithin", distance=SAME_EDGE).T.tolist():
        if a >= b or (cut[a].group and cut[a].group == cut[b].group):
            continue
        shared = lines[a].intersection(lines[b].buffer(SAME_EDGE, cap_style="flat"))
        if shared.length <= CROSSING:
            continue
        x, y = shapely.get_coordinates(shared)[0].tolist()
        short = min((a, b), key=lambda k: lines[k].length)
        if not (cut[a].group or cut[b].group) and shared.length > MOST * lines[short].length:
            raise PlanError(_shared_path_message(cut[short].name(), cut[a + b - short].name(), shared.length, rules))
        lengths.append(shared.length)
        places.append(f"({x:.5g}, {y:.5g})")
    if not lengths or rules.half > 0.0:
        return []
    words = Message(
        "{:.6g} mm of coincident edges are cut twice: a shared edge is cut once only if its line can start in the "
        "scrap and no option rules out common lines",
        math.fsum(lengths),
    )
    return [Issue("L617", words, Message("at {}", ", ".join(places[:3])) + (" …" if len(places) > 3 else ""))]


def precedence_for_pierces(
    contours: Sequence[CutContour], starts: Sequence[CutStart], pairs: Iterable[tuple[int, int]], rules: CutRules
) -> list[tuple[int, int]]:
    """Return additional precedence for contours that can only be pierced on the path of another contour.

    Such a contour must be cut before the other contours, while there is still metal to pierce.

    Parameters
    ----------
    pairs
        The existing precedence pairs (before, after).

    Returns
    -------
    list of tuple of int
        The additional precedence pairs.
    """
    burnt: Any = np.array([c.line if c.kind == "cut" else shapely.LineString() for c in contours], dtype=object)
    pierced = [s for s in starts if s.pierce and contours[s.contour].kind == "cut"]
    points: Any = shapely.points(np.array([s.entry for s in pierced]).reshape(-1, 2))
    covered: list[set[int]] = [set() for _ in pierced]
    for n, k in shapely.STRtree(burnt).query(points, predicate="dwithin", distance=0.5 * rules.kerf).T.tolist():
        if k != pierced[n].contour:
            covered[n].add(k)
    choices: dict[int, list[tuple[int, ...]]] = {}
    for start, others in zip(pierced, covered, strict=True):
        choices.setdefault(start.contour, []).append(tuple(sorted(others)))
    kept, found = set(pairs), list[tuple[int, int]]()
    for k, sets in choices.items():
        if () in sets:
            continue
        for first in sorted(set(sets), key=lambda ks: (len(ks), ks)):
            added = [(k, other) for other in first]
            if is_acyclic({*kept, *added}):
                kept.update(added)
                found += added
                break
    return found


def is_acyclic(pairs: Iterable[tuple[int, int]]) -> bool:
    """Return whether the precedence pairs (before, after) contain no cycle."""
    sorter: TopologicalSorter[int] = TopologicalSorter()
    for before, after in pairs:
        sorter.add(after, before)
    try:
        sorter.prepare()
    except CycleError:
        return False
    return True


def _shared_path_message(one: str, other: str, length: float, rules: CutRules) -> Message:
    if rules.half > 0.0:
        return Message(
            "{} is one kerf away from {} over {:.4g} mm, more than half of its length, and would be cut "
            "twice: move the parts apart; --common-lines cuts such edges once if their line can start in the scrap",
            one,
            other,
            length,
        )
    return Message(
        "{} coincides with {} over {:.4g} mm, more than half of its length, and would be cut twice: move the parts "
        "apart. A shared edge is cut once only if its line can start in the scrap and no option rules out common "
        "lines",
        one,
        other,
        length,
    )
