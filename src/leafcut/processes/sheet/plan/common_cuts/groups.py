"""Groups of parts a kerf apart: the path around all of them, and the lines between them as cuts from kerf to kerf."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.offset import offset
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Lead
from leafcut.model.kinds import CutMethod
from leafcut.processes.sheet.plan.common_cuts.doubled import CROSSING, has_order
from leafcut.processes.sheet.plan.common_cuts.edges import GAP, EdgeGap
from leafcut.processes.sheet.plan.cut_contours import (
    FLATNESS,
    OFFSET_TOLERANCE,
    ROUNDING,
    CutContour,
    corner_turns,
    flat_line,
)
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.leads import LEAST_KERFS, LEAST_LEAD, SMALLER, Scrap, lead_shape, placed

#: Ends and paths this near to each other meet, mm.
MEET = 0.01
#: Lines run along each other within this, mm: a little more than the proof takes for one place.
BESIDE = 0.04
#: A common line is made longer by so many half kerfs at most to come to another kerf: about a corner of 20 degrees.
REACH = 6.0
#: A cut whose kerf others cross keeps its arc: light and water need no metal to burn on.
CROSSABLE = (CutMethod.LASER, CutMethod.WATERJET)
#: A shorter stretch of a path that is not cut is rounding, mm; a drawn corner turns by more than this, rad.
SHORT, SHARP = 0.1, math.radians(3.0)
#: Half a kerf beyond the end of an edge, metal within this many half kerfs is a bend; at a right angle it is 1.41.
BEND = 1.3
#: Lines are on one line when they turn by less than this, rad.
STRAIGHT = 1e-3
#: A fitted arc of a larger radius is a line, mm.
ROUNDEST = 1e5
#: Lead-ins are tried with these parts of their length, and at these angles to the line, rad.
SHARES = (1.0, 0.7, 0.45, 0.3)
ANGLES = tuple(math.radians(a) for a in (0.0, 45.0, -45.0, 30.0, -30.0, 60.0, -60.0))


@dataclass(frozen=True)
class CommonLine:
    """A common line through `points`; both its ends lie in the middle of other kerfs.

    `shared` mm of it lie between two parts. `inlets` are the lead-ins with which it can begin at either end; None: it
    cannot begin there. `parts` are positions of contours.
    """

    points: tuple[Point, ...]
    shared: float
    parts: tuple[int, ...]
    inlets: tuple[Lead | None, Lead | None]

    @property
    def ends(self) -> tuple[Point, Point]:
        """First and last point."""
        return self.points[0], self.points[-1]


@dataclass(frozen=True, eq=False)
class CommonCutGroup:
    """Parts with common lines.

    Attributes
    ----------
    members
        Positions of their outlines.
    parts
        Their numbers.
    shape, path
        The edge of the parts with the rooms between them, and the path of the torch around it.
    lines
        In an order in which they can be cut; `order` has the pairs (before, after) that matter.
    """

    members: frozenset[int]
    parts: frozenset[int]
    shape: Polyline
    path: Polyline
    lines: tuple[CommonLine, ...]
    order: tuple[tuple[int, int], ...]


class Grouper:
    """Makes groups, or says that parts make none."""

    def __init__(self, contours: list[CutContour], slots: Sequence[EdgeGap], scrap: Scrap, rules: CutRules) -> None:
        self.contours, self.slots, self.scrap, self.rules = contours, slots, scrap, rules
        owners = {k for s in slots for k in s.parts}
        self.metal = {k: shapely.Polygon(contours[k].source.contour.path.flattened(FLATNESS)) for k in owners}
        self.round = {k: any(s.is_arc for s in contours[k].source.contour.path.segments()) for k in owners}
        self.rooms = [_room(self._up_to_bends(s)) for s in slots]
        self.middles = np.array([shapely.LineString(s.points) for s in slots], dtype=object)
        self.follows = list(self._in_line())

    def group(self, members: frozenset[int]) -> CommonCutGroup | None:
        """Return the group of some parts; None where not all of it could be cut."""
        inside = [n for n, s in enumerate(self.slots) if set(s.parts) <= members]
        shape = self._shape(members, inside)
        if shape is None:
            return None
        path = self._path(shape)
        if path is None:
            return None
        around = flat_line(path)
        whole = self._to_kerfs([self._merged(own) for own in self._in_one(inside)], around)
        if whole is None:
            return None
        pieces = whole if self.rules.kind in CROSSABLE else _uncrossed(whole, self.rules.half)
        lines = self._bent([self._line(piece, inside, members, around) for piece in pieces], members, around)
        if any(line.inlets == (None, None) for line in lines):
            return None
        if _doubled([around, *(shapely.LineString(line.points) for line in lines)], max(self.rules.kerf, CROSSING)):
            return None
        order = _order(lines, 0.5 * self.rules.kerf)
        if order is None:
            return None
        every = shapely.multilinestrings([around, *(shapely.LineString(x.points) for x in lines)])
        if not self._covers(every, members):
            return None
        numbers = frozenset(self.contours[k].source.part for k in members)
        return CommonCutGroup(members, numbers, shape, path, tuple(lines), order)

    # -- the path around ---------------------------------------------------------------------------------------------

    def _shape(self, members: frozenset[int], inside: Sequence[int]) -> Polyline | None:
        """Return the edge of the parts with the rooms between them; None where scrap is locked in."""
        whole: Any = shapely.union_all([*(self.metal[k] for k in sorted(members)), *(self.rooms[n] for n in inside)])
        if whole.geom_type != "Polygon":
            return None
        for hole in whole.interiors:
            # Where four corners meet, a square of a kerf's width is left, which the lines cut away.
            if not shapely.Polygon(hole).buffer(-(self.rules.half + ROUNDING)).is_empty:
                return None
        ring: Any = shapely.Polygon(whole.exterior).simplify(0.1 * MEET)
        points = np.asarray(ring.exterior.coords)[:-1, :2]
        bent = any(self.round[k] for k in members)
        found = fit_arcs(points, 0.5 * MEET, closed=True) if bent else Polyline.of_points(points, closed=True)
        return found if found.area > 0.0 else found.reversed()

    def _path(self, shape: Polyline) -> Polyline | None:
        try:
            rings = offset(shape, self.rules.half, OFFSET_TOLERANCE)
        except PlanError:
            return None
        if len(rings) != 1:
            return None
        return _straightened(rings[0] if rings[0].area > 0.0 else rings[0].reversed())

    def _covers(self, lines: Any, members: frozenset[int]) -> bool:
        """Return whether all of every part's path is cut but arcs round sharp corners, and nothing nearer to a part."""
        half = self.rules.half
        near = lines.buffer(ROUNDING)
        for k in members:
            if shapely.distance(lines, self.metal[k]) < half - GAP:
                return False
            left = self.contours[k].line.difference(near)
            pieces = [piece for piece in shapely.get_parts(left) if piece.length > SHORT]
            if any(not _about_corner(piece, self.contours[k], half) for piece in pieces):
                return False
        return True

    def _up_to_bends(self, slot: EdgeGap) -> EdgeGap:
        """Return a room without half a kerf at each end from which both edges go on in bends.

        The path around a group, half a kerf beside it, then comes to where the paths of the two parts meet.
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

    def _in_line(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of rooms that follow each other on one line, no more than a kerf between them."""
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

    def _in_one(self, inside: Sequence[int]) -> list[list[int]]:
        """Return the rooms in lists, each on one line without a break."""
        own = set(inside)
        lists = {n: [n] for n in inside}
        for i, j in self.follows:
            if i in own and j in own and lists[i] is not lists[j]:
                both = lists[i] + lists[j]
                for n in both:
                    lists[n] = both
        return list({id(x): x for x in lists.values()}.values())

    def _merged(self, own: Sequence[int]) -> tuple[Point, ...]:
        """Return the points of the line along rooms that follow each other."""
        if self.slots[own[0]].between:
            return self.slots[own[0]].points
        ends = [p for n in own for p in (self.slots[n].begin, self.slots[n].end)]
        return max(itertools.combinations(ends, 2), key=lambda pair: math.dist(*pair)) if len(ends) < 40 else _far(ends)

    def _to_kerfs(self, lines: list[tuple[Point, ...]], around: Any) -> list[tuple[Point, ...]] | None:
        """Return lines made longer to the middle of the next kerf at both ends; None where there is none."""
        drawn = [shapely.LineString(line) for line in lines]
        found = []
        for number, line in enumerate(lines):
            others = [other for k, other in enumerate(drawn) if k != number]
            kerfs = shapely.union_all([around, *others]).buffer(MEET)
            rest = [other for k, other in enumerate(lines) if k != number]
            outward = ((line[1], line[0]), (line[-2], line[-1]))
            ends = [self._met(a, b, kerfs) or self._corner(a, b, rest) for a, b in outward]
            if ends[0] is None or ends[1] is None:
                return None
            found.append((ends[0], *line[1:-1], ends[1]))
        return found

    def _met(self, origin: Point, end: Point, kerfs: Any) -> Point | None:
        """Return where a line, going on beyond its end, comes into the middle of a kerf."""
        along = (np.array(end) - np.array(origin)) / math.dist(origin, end)
        ray = shapely.LineString([end, np.array(end) + (REACH * self.rules.half + MEET) * along])
        hits = ray.intersection(kerfs)
        if hits.is_empty:
            return None
        x, y = shapely.get_coordinates(shapely.shortest_line(shapely.Point(end), hits))[1].tolist()
        return x, y

    def _corner(self, origin: Point, end: Point, others: Sequence[tuple[Point, ...]]) -> Point | None:
        """Return where a line and another one meet if both go on beyond their ends: in an inner corner of a part."""
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

    def _bent(self, lines: list[CommonLine], members: frozenset[int], around: Any) -> list[CommonLine]:
        """Return the lines; one that can begin at neither end goes on from another that ends where it ends.

        No third line may meet them there: its kerf would be crossed.
        """
        left = list(lines)
        while True:
            inner = [a for a in left if a.inlets == (None, None)]
            pairs = ((a, b) for a in inner for b in left if a is not b and _goes_on(a, b, left))
            pair = next(pairs, None)
            if pair is None:
                return left
            at = left.index(pair[1])
            left[at] = self._joined(pair[1], pair[0], members, around)
            left.remove(pair[0])

    def _joined(self, one: CommonLine, other: CommonLine, members: frozenset[int], around: Any) -> CommonLine:
        """Return two lines as one, through the end that they share."""
        first = one.points if _meet(one.points[-1], other.ends) else one.points[::-1]
        then = other.points if _meet(first[-1], other.ends[:1]) else other.points[::-1]
        points = (*first, *then[1:])
        inlets = (
            self._inlet(points[0], points[1], members, around, False),
            self._inlet(points[-1], points[-2], members, around, True),
        )
        parts = tuple(sorted({*one.parts, *other.parts}))
        return CommonLine(points, one.shared + other.shared, parts, inlets)

    def _line(
        self, points: tuple[Point, ...], inside: Sequence[int], members: frozenset[int], around: Any
    ) -> CommonLine:
        line = shapely.LineString(points)
        near = [n for n in inside if shapely.dwithin(line, self.middles[n], GAP)]
        along = {n: self.middles[n].intersection(line.buffer(2.0 * GAP, cap_style="flat")).length for n in near}
        # Of a room across only a kerf's width lies along the line.
        shared = {n: length for n, length in along.items() if length > 0.1 * self.rules.kerf + 8.0 * GAP}
        inlets = (
            self._inlet(points[0], points[1], members, around, False),
            self._inlet(points[-1], points[-2], members, around, True),
        )
        parts = tuple(sorted({k for n in shared for k in self.slots[n].parts}))
        return CommonLine(points, math.fsum(shared.values()), parts, inlets)

    def _inlet(self, here: Point, to: Point, members: frozenset[int], around: Any, backward: bool) -> Lead | None:
        """Return the lead-in with which a line can begin at one end; None where it cannot begin there."""
        if shapely.distance(around, shapely.Point(here)) > 2.0 * MEET:
            return None
        wanted = self.rules.lead_in
        if wanted.style == "none":
            # The kerf of a part beside the group, cut before, would leave no metal to pierce.
            owners = [self.contours[k] for k in members]
            return Lead() if self.scrap.free([shapely.Point(here)], *owners, leaves_sheet=True)[0] else None
        travel = (np.array([to]) - np.array([here])) / math.dist(here, to)
        least = max(LEAST_KERFS * self.rules.kerf, LEAST_LEAD)
        lengths = list(dict.fromkeys(max(share * wanted.length, least) for share in SHARES))
        for splash, angle, length in itertools.product((self.rules.kerf, 0.0), ANGLES, lengths):
            lead = Lead("line", length, angle)
            points = placed(lead_shape(lead), np.array([here]), travel, backward)[0]
            if self._has_room(points, members, around, splash):
                return lead
        return None

    def _has_room(self, lead: np.ndarray, members: frozenset[int], around: Any, splash: float) -> bool:
        """Return whether a lead-in, float64[2, 2], comes straight from outside the group through scrap that is free."""
        kerf = self.rules.kerf
        owners = [self.contours[k] for k in members]
        if not self.scrap.free([shapely.LineString(lead)], *owners)[0]:
            return False
        count = max(math.ceil(math.dist(*lead) / (0.25 * kerf)), 2)
        shares = np.linspace(0.0, 1.0, count + 1)[:, None]
        places = lead[1] + shares * (lead[0] - lead[1])
        # Room is found for parts a little smaller than they are; along a part that would be too near.
        if not self.scrap.clear(places, self.rules.half + ROUNDING + SMALLER - 1.5 * MEET).all():
            return False
        apart = shapely.distance(shapely.points(places), around)
        # From the path around the group on it only comes farther away, until the kerfs are apart.
        leaves = np.all((np.diff(apart) > 0.0) | (apart[1:] >= kerf)) and apart[-1] >= 0.5 * kerf
        return bool(leaves) and bool(self.scrap.clear(lead[:1], splash)[0])


def _about_corner(piece: Any, contour: CutContour, half: float) -> bool:
    """Return whether a piece of a path is the arc about a sharp corner of what is drawn."""
    drawn = contour.source.contour.path
    corners: Any = shapely.points(drawn.vertices[np.abs(corner_turns(drawn)) > SHARP, :2])
    points: Any = shapely.points(shapely.get_coordinates(piece))
    return any(bool(np.all(np.abs(shapely.distance(corner, points) - half) < ROUNDING)) for corner in corners)


def _straightened(path: Polyline) -> Polyline:
    """Return a path whose arcs that are straight but for rounding are lines: no controller takes their radius."""
    rows = path.vertices.copy()
    chords = np.hypot(*(np.roll(rows, -1, axis=0) - rows)[:, :2].T)
    bulge = np.abs(rows[:, 2])
    rows[(0.5 * bulge * chords < OFFSET_TOLERANCE) & (chords > 4.0 * ROUNDEST * bulge), 2] = 0.0
    return Polyline(rows, closed=True)


def _room(slot: EdgeGap) -> Any:
    """Return the room between two edges as a shapely polygon that reaches a little into both parts."""
    reach = 0.5 * slot.width + 0.5 * GAP
    if slot.between:
        return shapely.LineString(slot.points).buffer(reach, cap_style="flat")
    side = np.array(slot.normal) * reach
    begin, end = np.array(slot.begin), np.array(slot.end)
    return shapely.Polygon([begin - side, end - side, end + side, begin + side])


def _far(ends: Sequence[Point]) -> tuple[Point, Point]:
    """Return the two that are farthest apart of points on one line."""
    low, high = min(ends), max(ends)
    return low, high


def _uncrossed(lines: Sequence[tuple[Point, ...]], half: float) -> list[tuple[Point, ...]]:
    """Return lines of which none crosses another: a shorter one ends at a longer one, and goes on beyond it."""
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


def _order(lines: Sequence[CommonLine], half: float) -> tuple[tuple[int, int], ...] | None:
    """Return pairs (before, after) of lines; None if a line can be pierced only in the kerf of an earlier one.

    A line that ends at another comes after it. A line whose only pierces lie in the kerf of others, as without a
    lead-in where two lines meet in a corner, comes before them.
    """
    needed = set[tuple[int, int]]()
    drawn = [shapely.LineString(x.points) for x in lines]
    for n, line in enumerate(lines):
        others = [k for k in range(len(lines)) if k != n]
        hit = [
            {k for k in others if shapely.dwithin(drawn[k], pierce, half)}
            for pierce in (_pierce(line, at) for at in (0, 1))
            if pierce is not None
        ]
        if all(hit):
            needed |= {(n, k) for k in min(hit, key=len)}
    corners = {(k, n) for n, k in needed if any(_meet(end, lines[k].ends) for end in lines[n].ends)}
    pairs = (set(_ends_at(lines)) - corners) | needed
    return tuple(sorted(pairs)) if has_order(pairs) else None


def _doubled(lines: Sequence[Any], least: float) -> bool:
    """Return whether two lines run along each other over `least` mm, as where a bent edge ends along another edge."""
    beside = [line.buffer(BESIDE) for line in lines]
    return any(lines[a].intersection(beside[b]).length > least for a, b in itertools.permutations(range(len(lines)), 2))


def _pierce(line: CommonLine, at: int) -> Any:
    """Return the pierce at the first end of a line (0) or at its last (1); None if it cannot begin there."""
    lead, points = line.inlets[at], line.points if not at else line.points[::-1]
    if lead is None:
        return None
    travel = (np.array([points[1]]) - np.array([points[0]])) / math.dist(points[0], points[1])
    return shapely.Point(placed(lead_shape(lead), np.array([points[0]]), travel, bool(at))[0, 0])


def _ends_at(lines: Sequence[CommonLine]) -> Iterator[tuple[int, int]]:
    """Yield pairs (before, after): a line, and a later one that ends at it."""
    drawn = [shapely.LineString(x.points) for x in lines]
    for a, b in itertools.combinations(range(len(lines)), 2):
        if any(shapely.dwithin(drawn[a], shapely.Point(p), 2.0 * MEET) for p in lines[b].ends):
            yield a, b


def _meet(point: Point, ends: Sequence[Point]) -> bool:
    return any(math.dist(point, end) <= 2.0 * MEET for end in ends)


def _goes_on(a: CommonLine, b: CommonLine, lines: Sequence[CommonLine]) -> bool:
    """Return whether two lines share an end at which no other line is."""
    end = next((end for end in a.ends if _meet(end, b.ends)), None)
    others = (shapely.LineString(c.points) for c in lines if c is not a and c is not b)
    return end is not None and not any(shapely.dwithin(other, shapely.Point(end), 2.0 * MEET) for other in others)
