"""Common lines: one cut that separates two parts.

Two parts can share a cut if their straight edges are one kerf apart, or if their edges coincide. The common lines of a
group of parts are cut first. They are open cuts that start in the scrap next to the group and end in another kerf of
the group. The cut around the whole group comes last and detaches all its parts.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

from leafcut.errors import PlanError, count_of
from leafcut.geometry.arrays import Point
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.offset import offset_closed_path
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.cutting import Lead
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import CutMethod
from leafcut.processes.sheet.plan.common_edges import (
    CROSSING,
    GAP,
    EdgeGap,
    facing_edges,
    is_acyclic,
    min_common_length,
)
from leafcut.processes.sheet.plan.contours import (
    OFFSET_TOLERANCE,
    ROUNDING,
    CutContour,
    chord_line,
    corner_turns,
    corners_along,
)
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads import FLATNESS, LEAST_KERFS, LEAST_LEAD, lead_shape, place_leads
from leafcut.processes.sheet.plan.scrap import PART_SHRINKAGE, Scrap

#: Maximum distance between ends or paths that meet, mm.
MEET = 0.01
#: Maximum distance between coincident lines, mm: slightly above the tolerance of verification.
BESIDE = 0.04
#: How far a common line may be extended to reach another kerf, in half kerf widths. This is enough for a corner of 20
#: degrees.
REACH = 6.0
#: Methods whose cuts may cross a kerf. A laser beam or a water jet does not need metal to stay on.
CROSSABLE = (CutMethod.LASER, CutMethod.WATERJET)
#: Uncut sections shorter than this are rounding errors, mm; and minimum turn at a corner of the drawing, rad.
SHORT, SHARP = 0.1, math.radians(3.0)
#: If there is metal within this distance beyond the end of an edge, the edge bends there. In half kerf widths (1.41 for
#: a right angle).
BEND = 1.3
#: Maximum angle between collinear lines, rad.
STRAIGHT = 1e-3
#: Maximum radius of fitted arcs, mm. An arc with a larger radius is replaced by a line.
ROUNDEST = 1e5
#: Lead-ins to try: lengths relative to the requested length, and angles to the line, rad.
SHARES = (1.0, 0.7, 0.45, 0.3)
ANGLES = tuple(math.radians(a) for a in (0.0, 45.0, -45.0, 30.0, -30.0, 60.0, -60.0))


def with_common_lines(
    contours: list[CutContour], scrap: Scrap
) -> tuple[list[CutContour], list[tuple[int, int]], list[Issue]]:
    """Replace the outlines of each group of parts with common lines and one contour around the group.

    If a common line cannot start in the scrap, its two edges are still cut separately. In plasma cutting, this happens
    in grids of three or more rows.

    Returns
    -------
    list of CutContour
        The contours, with common lines where possible.
    list of tuple of int
        Additional precedence pairs (before, after).
    list of Issue
        Notes for the user.
    """
    rules = scrap.rules
    slots = facing_edges(contours, rules)
    groups = _common_cut_groups(contours, slots, scrap)
    if not groups:
        return contours, [], _no_line_issues(slots, rules)
    gone = {k for group in groups for k in group.members}
    made = [c for k, c in enumerate(contours) if k not in gone]
    last = max(c.index for c in contours) + 1
    pairs: list[tuple[int, int]] = []
    for number, group in enumerate(groups, 1):
        around = _outer_contour(contours, group, number)
        lines = [_line_contour(contours, group, number, n, last + n) for n in range(len(group.lines))]
        last += len(lines)
        pairs += _group_precedence(made, around, group, len(made))
        made += [*lines, around]
    return made, pairs, _line_issues(slots, groups, rules)


def scrap_with_lead_ins(scrap: Scrap, contours: Sequence[CutContour]) -> Scrap:
    """Mark the lead-ins of common lines as obstacles, so that other leads avoid them."""
    leads = []
    for c in contours:
        for at, backward, lead in ((0.0, False, c.inlets[0]), (c.path.length, True, c.inlets[1])):
            if c.common and lead is not None and lead.length:
                leads.append(shapely.LineString(c.lead_points(lead, at, backward)))
    return scrap.with_bridges(leads, np.full((len(leads), 2), -1, dtype=np.int64)) if leads else scrap


def _common_cut_groups(contours: list[CutContour], slots: Sequence[EdgeGap], scrap: Scrap) -> list[CommonCutGroup]:
    """Group the parts that share common lines, in the order of their first outlines.

    If all lines between connected parts can be cut, these parts form one group. Otherwise, parts are joined pair by
    pair, starting with the pair that has the longest common edges, as long as all lines of the group can be cut.
    """
    grouper = Grouper(contours, slots, scrap)
    shared: dict[tuple[int, int], float] = {}
    for slot in slots:
        shared[slot.parts] = shared.get(slot.parts, 0.0) + slot.length
    of: dict[int, frozenset[int]] = {k: frozenset([k]) for pair in shared for k in pair}
    found: dict[frozenset[int], CommonCutGroup] = {}
    for members in _connected_components(shared):
        group = grouper.group(members)
        if group is not None:
            found[members] = group
            of.update(dict.fromkeys(members, members))
    tried: set[frozenset[int]] = set()
    joined = True
    while joined:
        joined = False
        for a, b in sorted(shared, key=lambda pair: (-round(shared[pair], 3), pair)):
            members = of[a] | of[b]
            if of[a] == of[b] or members in tried:
                continue
            tried.add(members)
            group = grouper.group(members)
            if group is not None:
                found.pop(of[a], None)
                found.pop(of[b], None)
                found[members] = group
                of.update(dict.fromkeys(members, members))
                joined = True
    return sorted(found.values(), key=lambda g: min(g.members))


def _connected_components(pairs: Iterable[tuple[int, int]]) -> list[frozenset[int]]:
    of: dict[int, set[int]] = {}
    for a, b in pairs:
        both = of.get(a, {a}) | of.get(b, {b})
        of.update(dict.fromkeys(both, both))
    return list(dict.fromkeys(frozenset(x) for x in of.values()))


def _outer_contour(contours: list[CutContour], group: CommonCutGroup, number: int) -> CutContour:
    first = contours[min(group.members)]
    source = replace(first.source, path=group.shape)
    line = chord_line(group.path)
    return CutContour(
        index=first.index,
        source=source,
        path=group.path,
        line=line,
        hole=False,
        diameter=2.0 * math.sqrt(abs(group.shape.area) / math.pi),
        rules=first.rules,
        corners=corners_along(group.shape, group.path, line),
        covers=tuple(sorted(contours[k].index for k in group.members)),
        group=number,
    )


def _line_contour(contours: list[CutContour], group: CommonCutGroup, number: int, n: int, index: int) -> CutContour:
    line = group.lines[n]
    owner = contours[min(line.parts)]
    first, path = owner.source, fit_arcs(np.array(line.points), 0.5 * MEET)
    outline = contours[min(group.members)].index
    return CutContour(
        index=index,
        source=replace(first, path=path, kind="cut", depth=first.depth + 1, parent=outline, chamber=False),
        path=path,
        line=chord_line(path),
        hole=False,
        diameter=0.0,
        rules=owner.rules,
        covers=tuple(sorted(contours[k].index for k in line.parts)),
        group=number,
        common=line.shared,
        inlets=line.inlets,
    )


def _group_precedence(
    others: Sequence[CutContour], around: CutContour, group: CommonCutGroup, at: int
) -> Iterable[tuple[int, int]]:
    """Yield the precedence pairs (before, after) of a group.

    Inner contours and marks come first, then the lines in their order, and the outer cut comes last.
    """
    count = len(group.lines)
    inside, numbers = set(around.covers), group.parts
    for k, c in enumerate(others):
        if c.source.parent in inside or (c.kind == "mark" and c.source.part in numbers):
            yield from ((k, at + n) for n in range(count + 1))
    yield from ((at + n, at + count) for n in range(count))
    yield from ((at + a, at + b) for a, b in group.order)


def _no_line_issues(slots: Sequence[EdgeGap], rules: CutRules) -> list[Issue]:
    if not rules.common_lines:
        return []
    if slots:
        return _separate_edge_issues(slots, rules)
    return [Issue("L616", _no_common_lines_message(min_common_length(rules), rules), "", Severity.NOTE)]


def _no_common_lines_message(least: float, rules: CutRules) -> Message:
    if rules.half <= 0.0:
        return Message(
            "there are no common lines: without compensation, parts share only edges that coincide over {:.3g} "
            "mm or more",
            least,
        )
    return Message(
        "there are no common lines, because no two parts have straight edges that are one kerf apart ({:.4g} "
        "mm, ± {:g} mm) and face each other over at least {:.3g} mm",
        rules.kerf,
        GAP,
        least,
    )


def _separate_edge_issues(slots: Sequence[EdgeGap], rules: CutRules) -> list[Issue]:
    if not slots or rules.half <= 0.0:  # `doubled_edge_issues` reports coincident edges
        return []
    (x, y), (u, v) = slots[0].begin, slots[0].end
    words = Message(
        "{:.6g} mm of edges one kerf apart are cut separately, because no common line between them can start "
        "in the scrap without crossing another line",
        math.fsum(s.length for s in slots),
    )
    return [Issue("L617", words, Message("at ({:.5g}, {:.5g})", (x + u) / 2, (y + v) / 2), Severity.NOTE)]


def _line_issues(slots: Sequence[EdgeGap], groups: Sequence[CommonCutGroup], rules: CutRules) -> list[Issue]:
    lines = [line for g in groups for line in g.lines]
    length = math.fsum(line.shared for line in lines)
    parts = sum(len(g.members) for g in groups)
    words = Message(
        "{:.6g} mm of edges shared by {} parts are cut only once, in {}", length, parts, count_of(len(lines), "line")
    )
    found = [Issue("L616", words, "", Severity.NOTE)]
    of = {k: n for n, g in enumerate(groups) for k in g.members}
    left = [s for s in slots if of.get(s.parts[0], -1) != of.get(s.parts[1], -2)]
    return [*found, *_separate_edge_issues(left, rules)]


# -- groups ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CommonLine:
    """A cut along `points`, mm, that two parts share. Both ends lie on the centrelines of other kerfs.

    Attributes
    ----------
    shared
        Length of the line that lies between two parts, mm.
    inlets
        The lead-in at each end, or None if the line cannot start at that end.
    parts
        Indices of the contours that the line separates.
    """

    points: tuple[Point, ...]
    shared: float
    parts: tuple[int, ...]
    inlets: tuple[Lead | None, Lead | None]

    @property
    def ends(self) -> tuple[Point, Point]:
        """The first and the last point of the line."""
        return self.points[0], self.points[-1]


@dataclass(frozen=True, eq=False)
class CommonCutGroup:
    """A group of parts with common lines.

    Attributes
    ----------
    members
        Indices of the outlines.
    parts
        Numbers of the parts.
    shape
        Outline of the whole group, including the gaps between its parts.
    path
        Torch path around this outline.
    order
        Precedence pairs (before, after) of `lines`.
    """

    members: frozenset[int]
    parts: frozenset[int]
    shape: Polyline
    path: Polyline
    lines: tuple[CommonLine, ...]
    order: tuple[tuple[int, int], ...]


class Grouper:
    """Builds groups of parts with common lines."""

    def __init__(self, contours: list[CutContour], slots: Sequence[EdgeGap], scrap: Scrap) -> None:
        self.contours, self.slots, self.scrap, self.rules = contours, slots, scrap, scrap.rules
        owners = {k for s in slots for k in s.parts}
        self.metal = {k: shapely.Polygon(contours[k].source.path.flattened(FLATNESS)) for k in owners}
        self.round = {k: any(s.is_arc for s in contours[k].source.path.segments()) for k in owners}
        self.gap_areas = [_gap_area(self._shortened_at_bends(s)) for s in slots]
        self.middles = np.array([shapely.LineString(s.points) for s in slots], dtype=object)
        self.follows = list(self._collinear_gaps())

    def group(self, members: frozenset[int]) -> CommonCutGroup | None:
        """Return the group of the outlines `members`, or None if some of its lines cannot be cut."""
        inside = [n for n, s in enumerate(self.slots) if set(s.parts) <= members]
        shape = self._outer_shape(members, inside)
        if shape is None:
            return None
        path = self._outer_path(shape)
        if path is None:
            return None
        around = chord_line(path)
        whole = self._extended_to_kerfs([self._merged_line(own) for own in self._continuous_gaps(inside)], around)
        if whole is None:
            return None
        pieces = whole if self.rules.kind in CROSSABLE else _split_at_crossings(whole, self.rules.half)
        lines = self._with_joined_lines(
            [self._common_line(piece, inside, members, around) for piece in pieces], members, around
        )
        if any(line.inlets == (None, None) for line in lines):
            return None
        if _have_common_stretch(
            [around, *(shapely.LineString(line.points) for line in lines)], max(self.rules.kerf, CROSSING)
        ):
            return None
        order = _line_precedence(lines, 0.5 * self.rules.kerf)
        if order is None:
            return None
        every = shapely.multilinestrings([around, *(shapely.LineString(x.points) for x in lines)])
        if not self._follows_torch_paths(every, members):
            return None
        numbers = frozenset(self.contours[k].source.part for k in members)
        return CommonCutGroup(members, numbers, shape, path, tuple(lines), order)

    # -- the path around ---------------------------------------------------------------------------------------------

    def _outer_shape(self, members: frozenset[int], inside: Sequence[int]) -> Polyline | None:
        """Return the outline of the parts and the gaps between them, or None if the parts enclose scrap."""
        whole: Any = shapely.union_all(
            [*(self.metal[k] for k in sorted(members)), *(self.gap_areas[n] for n in inside)]
        )
        if whole.geom_type != "Polygon":
            return None
        for hole in whole.interiors:
            # Where four corners meet, a square as wide as the kerf remains. The lines cut it away.
            if not shapely.Polygon(hole).buffer(-(self.rules.half + ROUNDING)).is_empty:
                return None
        ring: Any = shapely.Polygon(whole.exterior).simplify(0.1 * MEET)
        points = np.asarray(ring.exterior.coords)[:-1, :2]
        bent = any(self.round[k] for k in members)
        found = fit_arcs(points, 0.5 * MEET, closed=True) if bent else Polyline.of_points(points, closed=True)
        return found if found.area > 0.0 else found.reversed()

    def _outer_path(self, shape: Polyline) -> Polyline | None:
        try:
            rings = offset_closed_path(shape, self.rules.half, OFFSET_TOLERANCE)
        except PlanError:
            return None
        if len(rings) != 1:
            return None
        return _without_flat_arcs(rings[0] if rings[0].area > 0.0 else rings[0].reversed())

    def _follows_torch_paths(self, lines: Any, members: frozenset[int]) -> bool:
        """Return whether the lines follow the torch path of each part without cutting into a part.

        Sharp corners may deviate from the torch path.
        """
        half = self.rules.half
        near = lines.buffer(ROUNDING)
        for k in members:
            if shapely.distance(lines, self.metal[k]) < half - GAP:
                return False
            left = self.contours[k].line.difference(near)
            pieces = [piece for piece in shapely.get_parts(left) if piece.length > SHORT]
            if any(not _is_corner_arc(piece, self.contours[k], half) for piece in pieces):
                return False
        return True

    def _shortened_at_bends(self, slot: EdgeGap) -> EdgeGap:
        """Shorten a gap by half a kerf at each end where both edges bend.

        This makes the path around the group meet the torch paths of both parts.
        """
        half = self.rules.half
        along = (np.array(slot.end) - np.array(slot.begin)) / slot.length
        ends = []
        for end, way in ((slot.begin, -along), (slot.end, along)):
            beyond = shapely.Point(np.array(end) + half * way)
            bends = all(shapely.distance(beyond, self.metal[k]) < BEND * half for k in slot.parts)
            x, y = np.array(end) - (half * way if bends and slot.length > 4.0 * half else 0.0)
            ends.append((float(x), float(y)))
        return replace(slot, begin=ends[0], end=ends[1])

    # -- the lines between -------------------------------------------------------------------------------------------

    def _collinear_gaps(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of gaps that lie on the same straight line and are at most one kerf apart."""
        if not len(self.middles):
            return
        reach = 2.0 * self.rules.half + 2.0 * GAP
        for i, j in zip(*shapely.STRtree(self.middles).query(self.middles, "dwithin", distance=reach), strict=True):
            a, b = self.slots[int(i)], self.slots[int(j)]
            straight = not (a.between or b.between)
            if i < j and straight and abs(a.normal[0] * b.normal[1] - a.normal[1] * b.normal[0]) < STRAIGHT:
                off = [(p[0] - a.begin[0]) * a.normal[0] + (p[1] - a.begin[1]) * a.normal[1] for p in (b.begin, b.end)]
                if max(map(abs, off)) <= GAP:
                    yield int(i), int(j)

    def _continuous_gaps(self, inside: Sequence[int]) -> list[list[int]]:
        own = set(inside)
        lists = {n: [n] for n in inside}
        for i, j in self.follows:
            if i in own and j in own and lists[i] is not lists[j]:
                both = lists[i] + lists[j]
                for n in both:
                    lists[n] = both
        return list({id(x): x for x in lists.values()}.values())

    def _merged_line(self, own: Sequence[int]) -> tuple[Point, ...]:
        if self.slots[own[0]].between:
            return self.slots[own[0]].points
        ends = [p for n in own for p in (self.slots[n].begin, self.slots[n].end)]
        return (
            max(itertools.combinations(ends, 2), key=lambda pair: math.dist(*pair))
            if len(ends) < 40
            else (min(ends), max(ends))
        )

    def _extended_to_kerfs(self, lines: list[tuple[Point, ...]], around: Any) -> list[tuple[Point, ...]] | None:
        """Extend each line at both ends until it reaches the centreline of a kerf.

        Return None if the extension of a line does not reach a kerf.
        """
        drawn = [shapely.LineString(line) for line in lines]
        found = []
        for number, line in enumerate(lines):
            others = [other for k, other in enumerate(drawn) if k != number]
            kerfs = shapely.union_all([around, *others]).buffer(MEET)
            rest = [other for k, other in enumerate(lines) if k != number]
            outward = ((line[1], line[0]), (line[-2], line[-1]))
            ends = [self._kerf_on_extension(a, b, kerfs) or self._inner_corner(a, b, rest) for a, b in outward]
            if ends[0] is None or ends[1] is None:
                return None
            found.append((ends[0], *line[1:-1], ends[1]))
        return found

    def _kerf_on_extension(self, origin: Point, end: Point, kerfs: Any) -> Point | None:
        """Extend a line beyond `end` and return the first point on the centreline of a kerf, or None."""
        along = (np.array(end) - np.array(origin)) / math.dist(origin, end)
        ray = shapely.LineString([end, np.array(end) + (REACH * self.rules.half + MEET) * along])
        hits = ray.intersection(kerfs)
        if hits.is_empty:
            return None
        x, y = shapely.get_coordinates(shapely.shortest_line(shapely.Point(end), hits))[1].tolist()
        return x, y

    def _inner_corner(self, origin: Point, end: Point, others: Sequence[tuple[Point, ...]]) -> Point | None:
        """Return the point where the extensions of two lines meet at an inner corner of a part, or None."""
        reach = REACH * self.rules.half + MEET
        u, v = end[0] - origin[0], end[1] - origin[1]
        for line in others:
            for far, near in ((line[-2], line[-1]), (line[1], line[0])):
                w, z = near[0] - far[0], near[1] - far[1]
                cross = u * z - v * w
                if abs(cross) < STRAIGHT * math.hypot(u, v) * math.hypot(w, z):
                    continue
                share = ((near[0] - end[0]) * z - (near[1] - end[1]) * w) / cross
                met = end[0] + share * u, end[1] + share * v
                beyond = share >= 0.0 and (met[0] - near[0]) * w + (met[1] - near[1]) * z >= 0.0
                if beyond and math.dist(met, end) <= reach and math.dist(met, near) <= reach:
                    return met
        return None

    def _with_joined_lines(self, lines: list[CommonLine], members: frozenset[int], around: Any) -> list[CommonLine]:
        """Join each line that has no lead-in with another line that ends at the same point.

        Lines are only joined if no third line ends at this point. Otherwise, the joined line would cross the kerf of
        the third line.
        """
        left = list(lines)
        while True:
            inner = [a for a in left if a.inlets == (None, None)]
            pairs = ((a, b) for a in inner for b in left if a is not b and _share_free_end(a, b, left))
            pair = next(pairs, None)
            if pair is None:
                return left
            at = left.index(pair[1])
            left[at] = self._join_lines(pair[1], pair[0], members, around)
            left.remove(pair[0])

    def _join_lines(self, one: CommonLine, other: CommonLine, members: frozenset[int], around: Any) -> CommonLine:
        first = one.points if _is_at_end(one.points[-1], other.ends) else one.points[::-1]
        then = other.points if _is_at_end(first[-1], other.ends[:1]) else other.points[::-1]
        points = (*first, *then[1:])
        parts = tuple(sorted({*one.parts, *other.parts}))
        return CommonLine(points, one.shared + other.shared, parts, self._lead_ins(points, members, around))

    def _common_line(
        self, points: tuple[Point, ...], inside: Sequence[int], members: frozenset[int], around: Any
    ) -> CommonLine:
        line = shapely.LineString(points)
        near = [n for n in inside if shapely.dwithin(line, self.middles[n], GAP)]
        along = {n: self.middles[n].intersection(line.buffer(2.0 * GAP, cap_style="flat")).length for n in near}
        # A gap that crosses the line overlaps it only by the width of a kerf.
        shared = {n: length for n, length in along.items() if length > 0.1 * self.rules.kerf + 8.0 * GAP}
        parts = tuple(sorted({k for n in shared for k in self.slots[n].parts}))
        return CommonLine(points, math.fsum(shared.values()), parts, self._lead_ins(points, members, around))

    def _lead_ins(
        self, points: tuple[Point, ...], members: frozenset[int], around: Any
    ) -> tuple[Lead | None, Lead | None]:
        first = self._lead_in(points[0], points[1], members, around, False)
        return first, self._lead_in(points[-1], points[-2], members, around, True)

    def _lead_in(self, here: Point, to: Point, members: frozenset[int], around: Any, backward: bool) -> Lead | None:
        """Return a lead-in for the end `here` of a line, or None if the line cannot start at this end."""
        if shapely.distance(around, shapely.Point(here)) > 2.0 * MEET:
            return None
        wanted = self.rules.lead_in
        if wanted.style == "none":
            # If a part next to the group is cut earlier, its kerf leaves no metal for the pierce.
            owners = [self.contours[k] for k in members]
            return Lead() if self.scrap.allowed_mask([shapely.Point(here)], *owners, leaves_sheet=True)[0] else None
        travel = (np.array([to]) - np.array([here])) / math.dist(here, to)
        least = max(LEAST_KERFS * self.rules.kerf, LEAST_LEAD)
        lengths = list(dict.fromkeys(max(share * wanted.length, least) for share in SHARES))
        for splash, angle, length in itertools.product((self.rules.kerf, 0.0), ANGLES, lengths):
            lead = Lead("line", length, angle)
            points = place_leads(lead_shape(lead), np.array([here]), travel, backward)[0]
            if self._has_room_for_lead(points, members, around, splash):
                return lead
        return None

    def _has_room_for_lead(self, lead: np.ndarray, members: frozenset[int], around: Any, splash: float) -> bool:
        """Return whether a straight lead-in, float64[2, 2], stays inside the scrap around the group.

        `splash` is the radius around the pierce that must be free of parts, mm.
        """
        kerf = self.rules.kerf
        owners = [self.contours[k] for k in members]
        if not self.scrap.allowed_mask([shapely.LineString(lead)], *owners)[0]:
            return False
        count = max(math.ceil(math.dist(*lead) / (0.25 * kerf)), 2)
        shares = np.linspace(0.0, 1.0, count + 1)[:, None]
        places = lead[1] + shares * (lead[0] - lead[1])
        # `Scrap` shrinks the parts slightly, so a lead along a part could be too close to it.
        if not self.scrap.clear_mask(places, self.rules.half + ROUNDING + PART_SHRINKAGE - 1.5 * MEET).all():
            return False
        apart = shapely.distance(shapely.points(places), around)
        # From the path around the group outwards, the distance increases until the kerfs are separate.
        leaves = np.all((np.diff(apart) > 0.0) | (apart[1:] >= kerf)) and apart[-1] >= 0.5 * kerf
        return bool(leaves) and bool(self.scrap.clear_mask(lead[:1], splash)[0])


def _is_corner_arc(piece: Any, contour: CutContour, half: float) -> bool:
    drawn = contour.source.path
    corners: Any = shapely.points(drawn.vertices[np.abs(corner_turns(drawn)) > SHARP, :2])
    points: Any = shapely.points(shapely.get_coordinates(piece))
    return any(bool(np.all(np.abs(shapely.distance(corner, points) - half) < ROUNDING)) for corner in corners)


def _without_flat_arcs(path: Polyline) -> Polyline:
    """Replace nearly straight arcs with lines. No controller accepts arcs with such a large radius."""
    rows = path.vertices.copy()
    chords = np.hypot(*(np.roll(rows, -1, axis=0) - rows)[:, :2].T)
    bulge = np.abs(rows[:, 2])
    rows[(0.5 * bulge * chords < OFFSET_TOLERANCE) & (chords > 4.0 * ROUNDEST * bulge), 2] = 0.0
    return Polyline(rows, closed=True)


def _gap_area(slot: EdgeGap) -> Any:
    """Return the gap between two edges as a shapely polygon. The polygon slightly overlaps both parts."""
    reach = 0.5 * slot.width + 0.5 * GAP
    if slot.between:
        return shapely.LineString(slot.points).buffer(reach, cap_style="flat")
    side = np.array(slot.normal) * reach
    begin, end = np.array(slot.begin), np.array(slot.end)
    return shapely.Polygon([begin - side, end - side, end + side, begin + side])


def _split_at_crossings(lines: Sequence[tuple[Point, ...]], half: float) -> list[tuple[Point, ...]]:
    """Split lines so that no two of them cross. At each crossing, the shorter line is split."""
    placed: list[tuple[Point, ...]] = []
    for line in sorted(lines, key=lambda line: (-round(shapely.LineString(line).length, 3), line)):
        whole = shapely.LineString(line)
        stops = [0.0, whole.length]
        for other in placed:
            for met in shapely.get_parts(whole.intersection(shapely.LineString(other))):
                at = whole.project(met) if met.geom_type == "Point" else 0.0
                if 0.5 * half + MEET < at < whole.length - 0.5 * half - MEET:
                    stops.append(at)
        pieces = (substring(whole, a, b) for a, b in itertools.pairwise(sorted(stops)))
        placed += [tuple((float(x), float(y)) for x, y in shapely.get_coordinates(piece).tolist()) for piece in pieces]
    return placed


def _line_precedence(lines: Sequence[CommonLine], half: float) -> tuple[tuple[int, int], ...] | None:
    """Return the precedence pairs (before, after) of the lines, or None if they contradict each other.

    A line that ends at another line is cut after it. A line whose only possible pierce lies in the kerf of other lines
    is cut before them. An example is a line without a lead-in that meets another line in a corner.
    """
    needed = set[tuple[int, int]]()
    drawn = [shapely.LineString(x.points) for x in lines]
    for n, line in enumerate(lines):
        others = [k for k in range(len(lines)) if k != n]
        hit = [
            {k for k in others if shapely.dwithin(drawn[k], pierce, half)}
            for pierce in (_pierce_point(line, at) for at in (0, 1))
            if pierce is not None
        ]
        if all(hit):
            needed |= {(n, k) for k in min(hit, key=len)}
    corners = {(k, n) for n, k in needed if any(_is_at_end(end, lines[k].ends) for end in lines[n].ends)}
    pairs = (set(_end_precedence(lines)) - corners) | needed
    return tuple(sorted(pairs)) if is_acyclic(pairs) else None


def _have_common_stretch(lines: Sequence[Any], least: float) -> bool:
    """Return whether two lines overlap by more than `least` mm. This happens where one edge curves into another."""
    beside = [line.buffer(BESIDE) for line in lines]
    return any(lines[a].intersection(beside[b]).length > least for a, b in itertools.permutations(range(len(lines)), 2))


def _pierce_point(line: CommonLine, at: int) -> Any:
    """Return the point at which a line is pierced if it starts at its first end (0) or its last end (1), or None."""
    lead, points = line.inlets[at], line.points if not at else line.points[::-1]
    if lead is None:
        return None
    travel = (np.array([points[1]]) - np.array([points[0]])) / math.dist(points[0], points[1])
    return shapely.Point(place_leads(lead_shape(lead), np.array([points[0]]), travel, bool(at))[0, 0])


def _end_precedence(lines: Sequence[CommonLine]) -> Iterator[tuple[int, int]]:
    """For each line that ends at an earlier line of the list, yield a precedence pair (before, after)."""
    drawn = [shapely.LineString(x.points) for x in lines]
    for a, b in itertools.combinations(range(len(lines)), 2):
        if any(shapely.dwithin(drawn[a], shapely.Point(p), 2.0 * MEET) for p in lines[b].ends):
            yield a, b


def _is_at_end(point: Point, ends: Sequence[Point]) -> bool:
    return any(math.dist(point, end) <= 2.0 * MEET for end in ends)


def _share_free_end(a: CommonLine, b: CommonLine, lines: Sequence[CommonLine]) -> bool:
    end = next((end for end in a.ends if _is_at_end(end, b.ends)), None)
    others = (shapely.LineString(c.points) for c in lines if c is not a and c is not b)
    return end is not None and not any(shapely.dwithin(other, shapely.Point(end), 2.0 * MEET) for other in others)
