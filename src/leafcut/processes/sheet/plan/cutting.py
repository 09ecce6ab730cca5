"""A sheet as a routing problem: each cut is a task, its possible starts are choices, and inner contours precede outer
contours.

A choice affects the travel to and from a cut, but hardly the cutting time.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.cutting import Cut
from leafcut.model.issue import Issue, Severity
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.common_edges import doubled_edges, precedence_for_pierces
from leafcut.processes.sheet.plan.contours import (
    ROUNDING,
    CutContour,
    corner_turns,
    corners_along,
    flat_line,
    names_of,
    prepare_contours,
    with_notches,
)
from leafcut.processes.sheet.plan.cut_path import chain_length, compensate_where_needed, make_chain, make_cut
from leafcut.processes.sheet.plan.cut_rules import LOOP_ANGLE, CutRules
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import CutStart, find_starts
from leafcut.timing.travel import travel_cost

#: Tolerance for the radius of an arc around a corner, relative to half a kerf.
SAME_RADIUS = 0.02
#: A loop at a segment of a path: whether the loop replaces this segment (an arc), and its vertices (x, y, bulge).
_Loop = tuple[bool, Points]


@dataclass(frozen=True)
class HeadTravel:
    """Travel of the head: the cost of rapids, the time to lower and raise the head at each cut, s, and the start and
    end points.
    """

    metric: Metric
    overhead: float = 0.0
    start: Point | None = None
    end: Point | None = None

    def cost(self, a: Point, b: Point) -> float:
        """Return the cost of a rapid, in s or mm."""
        return travel_cost(self.metric, a, b)

    def neighbours(self, order: Sequence[CutStart], k: int) -> tuple[Point | None, Point | None]:
        """Return the positions of the head before and after cut number `k` in an order of cuts."""
        return order[k - 1].exit if k else self.start, order[k + 1].entry if k + 1 < len(order) else self.end

    def detour(self, around: tuple[Point | None, Point | None], start: CutStart) -> float:
        """Return the cost of the travel to and from a cut, between the head positions `around` before and after it."""
        before, after = around
        come = 0.0 if before is None else self.cost(before, start.entry)
        return come + (0.0 if after is None else self.cost(start.exit, after))


@dataclass(frozen=True, eq=False)
class Cutting:
    """The contours of a sheet, all possible starts of their cuts, and their precedence.

    `starts` are grouped by contour. The starts of a chain belong to its first contour. `order` contains additional
    precedence pairs (before, after) of contours. `fixed` contains the names of the choices that a plan file fixes, by
    contour.
    """

    sheet: Sheet
    rules: CutRules
    contours: list[CutContour]
    scrap: Scrap
    starts: list[CutStart]
    issues: tuple[Issue, ...] = ()
    order: tuple[tuple[int, int], ...] = ()
    fixed: dict[int, tuple[str, ...]] = field(default_factory=dict)
    _cut_cache: dict[CutStart, Cut] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def heads(self) -> list[int]:
        """Indices of the contours with which a cut starts: all contours except the later contours of chains."""
        return [k for k, own in enumerate(self.by_contour) if own]

    @cached_property
    def head_pairs(self) -> list[tuple[int, int]]:
        """Precedence pairs (before, after) of cuts. A cut is given by the index of its first contour."""
        head = {k: s.contour for s in self.starts for k in s.contours}
        return sorted({(head[a], head[b]) for a, b in self.pairs if head[a] != head[b]})

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Precedence pairs (before, after) of contours, as indices into `contours`."""
        return sorted({*precedence_pairs(self.sheet, self.contours), *self.order})

    @cached_property
    def by_contour(self) -> list[list[int]]:
        """Indices in `starts`, grouped by contour."""
        found: list[list[int]] = [[] for _ in self.contours]
        for number, start in enumerate(self.starts):
            found[start.contour].append(number)
        return found

    def starts_of(self, members: Iterable[int]) -> list[CutStart]:
        """Return the starts of the contours with the indices `members`."""
        return [self.starts[number] for k in members for number in self.by_contour[k]]

    def cut(self, start: CutStart) -> Cut:
        """Return the cut with the given start, from the cache if possible."""
        if start not in self._cut_cache:
            make = make_chain if start.then else make_cut
            self._cut_cache[start] = make(self.contours, start, self.fixed)
        return self._cut_cache[start]

    def seconds(self, start: CutStart) -> float:
        """Return the time of a cut without travel, s: the time of the pierce, and the time of the path at its feed
        rate.
        """
        contour, data = self.contours[start.contour], self.rules.data
        if start.then:
            length = chain_length(self.contours, start)
            return length / data.feed + (data.pierce_delay if start.pierce else 0.0)
        length = contour.path.length + start.lead_in.length + start.lead_out.length + contour.overcut
        return length / contour.feed + (data.pierce_delay if start.pierce and contour.kind == "cut" else 0.0)

    def lead_lines(self, start: CutStart) -> list[Any]:
        """Return the leads of a start at its first contour, as shapely lines."""
        contour = self.contours[start.contour]
        leads = [(start.lead_in, start.at, False)] if contour.path.closed or start.lead_in.length else []
        if contour.path.closed:
            leads.append((start.lead_out, contour.end_of(start.at, start.clockwise), True))
        points = [contour.lead_points(lead, at, start.clockwise, out=out) for lead, at, out in leads]
        return [shapely.LineString(own) for own in points if len(own) > 1] if contour.kind == "cut" else []


@dataclass(frozen=True, eq=False)
class CutSequence:
    """The cuts of a sheet in order, each with its start.

    Raises PlanError if a contour is cut twice or not at all, or if a part is detached before a contour inside it is
    cut.
    """

    cutting: Cutting
    starts: tuple[CutStart, ...]

    def with_starts(self, starts: Sequence[CutStart]) -> CutSequence:
        """Return a sequence with the given starts, in their order."""
        return CutSequence(self.cutting, tuple(starts))

    def __post_init__(self) -> None:
        """Raise PlanError for invalid orders, which no later check would detect."""
        contours, cut = self.cutting.contours, [k for s in self.starts for k in s.contours]
        at = {k: place for place, k in enumerate(cut)}
        if len(at) != len(contours) or len(cut) != len(at):
            raise PlanError(
                "the order does not cut every contour once; this is a defect of the algorithm; choose another "
                "--algorithm"
            )
        for a, b in self.cutting.pairs:
            if at[a] > at[b]:
                raise PlanError(
                    "{} would be cut before {}; remove 'order' from the plan file, or leave out --sweep",
                    contours[b].name(),
                    contours[a].name(),
                )


# -- preparation -----------------------------------------------------------------------------------------------------


def prepare_cutting(sheet: Sheet, rules: CutRules) -> Cutting:
    """Return the cuts of a sheet with all their starts. Raises PlanError if a kerf or a lead does not fit."""
    contours, issues = prepare_contours(sheet, rules)
    scrap = Scrap(sheet, contours, rules)
    check_kerfs(contours, scrap)
    if rules.compensation == "controller":
        contours, found = compensate_where_needed(contours, scrap)
        issues = [*issues, *found]
    if rules.loops:
        contours = with_loops(contours, scrap)
        scrap = Scrap(sheet, contours, rules)
    order: list[tuple[int, int]] = []
    if rules.common_lines or rules.once:
        from leafcut.processes.sheet.plan.common_lines import scrap_with_lead_ins, with_common_lines

        contours, order, found = with_common_lines(contours, scrap)
        scrap, issues = scrap_with_lead_ins(Scrap(sheet, contours, rules), contours), [*issues, *found]
    contours = with_notches(contours, rules)
    starts = find_starts(contours, scrap)
    issues = [*issues, *doubled_edges(contours, rules), *_lead_issues(contours, starts, rules)]
    order += precedence_for_pierces(contours, starts, [*precedence_pairs(sheet, contours), *order], rules)
    return Cutting(sheet, rules, contours, scrap, starts, tuple(issues), tuple(order))


def check_kerfs(contours: list[CutContour], scrap: Scrap) -> None:
    """Raise PlanError if a kerf touches another part or a clamp, or if its centreline leaves the sheet."""
    cut = [c for c in contours if c.kind == "cut"]
    lines = np.array([c.line for c in cut], dtype=object)
    found = []
    if scrap.rules.half > 0.0:
        for k, part in scrap.parts_near(lines).T.tolist():
            owner, other = cut[k].source.part, scrap.part_numbers[part]
            if other != owner and (cut[k].path.closed or owner):
                found.append(
                    Message(
                        "{} is nearer to part {} than the kerf of {:.4g} mm: cutting one would cut into the other; "
                        "nest them farther apart, with that kerf (leafcut nest --kerf {:g})",
                        cut[k].name(),
                        other,
                        scrap.rules.kerf,
                        scrap.rules.kerf,
                    )
                )
    for k, zone in scrap.zones_near(lines).T.tolist():
        low_x, low_y, high_x, high_y = scrap.zones[zone].bounds
        found.append(
            Message(
                "{} runs into the keep-out zone {:g} {:g} {:g} {:g}; move the clamp or the part",
                cut[k].name(),
                low_x,
                low_y,
                high_x,
                high_y,
            )
        )
    if scrap.sheet is not None:
        beyond = np.flatnonzero(~shapely.contains(scrap.sheet.buffer(ROUNDING), lines))
        found += [
            Message(
                "{} lies so near the edge of the sheet that the kerf of {:.4g} mm runs off it; "
                "move the part in, or take a larger sheet",
                cut[k].name(),
                scrap.rules.kerf,
            )
            for k in beyond.tolist()
        ]
    if found:
        more = Message(" (and {} more such places)", len(found) - 1) if len(found) > 1 else ""
        raise PlanError("{}{}", found[0], more)


def _lead_issues(contours: list[CutContour], starts: list[CutStart], rules: CutRules) -> Iterable[Issue]:
    """Yield notes about contours where the requested lead-in does not fit anywhere, and contours without a lead-out."""
    wanted, lesser, without = rules.lead_in, [], []
    by_contour: dict[int, list[CutStart]] = {}
    for start in starts:
        by_contour.setdefault(start.contour, []).append(start)
    for number, own in by_contour.items():
        contour = contours[number]
        if not contour.has_leads or not own[0].pierce:
            continue
        if wanted.style != "none" and not contour.is_small and all(s.lead_in != wanted for s in own):
            lesser.append(contour)
        if contour.lead_out.style != "none" and all(s.lead_out.style == "none" for s in own):
            without.append(contour)
    for group, message in (
        (
            lesser,
            Message(
                "{} × no room for a lead-in of {:g} mm ({}): shortened or replaced",
                len(lesser),
                wanted.length,
                wanted.style,
            ),
        ),
        (without, Message("{} × no room for a lead-out of {:g} mm: left out", len(without), rules.lead_out.length)),
    ):
        if group:
            yield Issue("L613", message, names_of(group), Severity.NOTE)


def precedence_pairs(sheet: Sheet, contours: Sequence[CutContour]) -> Iterable[tuple[int, int]]:
    """Yield precedence pairs (before, after): inner contours before outer contours, and the marks of a part before its
    cuts.
    """
    position = {i: k for k, c in enumerate(contours) if not c.common for i in c.indices}
    marks: dict[int, list[int]] = {}
    for k, contour in enumerate(contours):
        around = _enclosing_contour(sheet, position, contour)
        if around is not None:
            yield k, around
        if contour.kind == "mark" and contour.source.part:
            marks.setdefault(contour.source.part, []).append(k)
    for k, contour in enumerate(contours):
        if contour.kind != "mark":
            for mark in marks.get(contour.source.part, ()) if contour.source.part else ():
                yield mark, k


def _enclosing_contour(sheet: Sheet, position: Mapping[int, int], contour: CutContour) -> int | None:
    """Return the innermost contour around another contour, or None.

    `position` maps indices of contours in the sheet to indices in `Cutting.contours`. Holes that are too narrow to cut
    are skipped. An outline also encloses the parts in its notches that the kerf closes.
    """
    parent = contour.notch_of if contour.notch_of >= 0 else contour.source.parent
    while parent >= 0 and parent not in position:
        parent = sheet.contours[parent].parent
    return position.get(parent)


# -- orders ----------------------------------------------------------------------------------------------------------


def build_problem(
    cutting: Cutting, members: Sequence[int], head: HeadTravel, *, first: bool = True, last: bool = True
) -> RoutingProblem:
    """Return the routing problem of the contours `members`, whose nodes are their starts (`Cutting.starts_of`).

    The members are indices of `Cutting.contours`, and become the clusters in this order. If `first`, the route starts
    at the start point of the head; if `last`, it ends at the end point. Raises PlanError if the precedence has a cycle.
    """
    check_order(cutting)
    nodes = cutting.starts_of(members)
    cluster_of = {k: c for c, k in enumerate(members)}
    timed = head.metric.unit == "s"
    pairs = [(cluster_of[a], cluster_of[b]) for a, b in cutting.head_pairs if a in cluster_of and b in cluster_of]
    return RoutingProblem(
        entry=np.array([n.entry for n in nodes], dtype=np.float64).reshape(-1, 2),
        exit=np.array([n.exit for n in nodes], dtype=np.float64).reshape(-1, 2),
        cluster=np.array([cluster_of[n.contour] for n in nodes], dtype=np.int32),
        service=np.array([head.overhead + cutting.seconds(n) if timed else 0.0 for n in nodes], dtype=np.float64),
        metric=head.metric,
        precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2),
        start=head.start if first else None,
        end=head.end if last else None,
        name=cutting.sheet.name,
    )


def check_order(cutting: Cutting) -> None:
    """Raise PlanError if the precedence has a cycle, which only the fixed order of a plan file can cause."""
    if len(_drawing_order(cutting)) < len(cutting.heads):
        raise PlanError("the fixed order of the plan file contradicts inner before outer; remove 'order' from a cut")


def _drawing_order(cutting: Cutting) -> list[int]:
    """Return the first contour of each cut, in drawing order as far as the precedence allows."""
    after: dict[int, list[int]] = {}
    missing = [0] * len(cutting.contours)
    for a, b in cutting.head_pairs:
        after.setdefault(a, []).append(b)
        missing[b] += 1
    ready = [k for k in cutting.heads if not missing[k]]
    heapq.heapify(ready)
    order = []
    while ready:
        k = heapq.heappop(ready)
        order.append(k)
        for b in after.get(k, ()):
            missing[b] -= 1
            if not missing[b]:
                heapq.heappush(ready, b)
    return order


def drawing_order(cutting: Cutting) -> list[CutStart]:
    """Return the first start of each cut, in drawing order as far as the precedence allows."""
    check_order(cutting)
    return [cutting.starts[cutting.by_contour[k][0]] for k in _drawing_order(cutting)]


def route_length(start: Point | None, order: Sequence[CutStart], travel: Any = math.dist) -> float:
    """Return the total cost of the travel moves between cuts; `travel` computes the cost between two points."""
    total, here = 0.0, start
    for s in order:
        total += travel(here, s.entry) if here is not None else 0.0
        here = s.exit
    return total


def bands(cutting: Cutting, options: CutOptions, width: float = 0.0) -> list[list[int]]:
    """Group the first contours of all cuts into bands, in the direction of the sweep. Without a sweep, use one band.

    All contours of a part are in the band that contains the centre of its outline. `width` is the width of a band, mm;
    0 means a fifth of the width of the sheet, or the width of its largest part if that is larger.
    """
    if options.sweep == "free":
        return [cutting.heads]
    axis, backward = "xy".index(options.sweep[-1]), options.sweep.startswith("-")
    position = {i: k for k, c in enumerate(cutting.contours) if not c.common for i in c.indices}
    outlines = {c.source.part: k for k, c in enumerate(cutting.contours) if c.has_leads and not c.hole}
    roots = [_outermost_contour(cutting, k, position, outlines) for k in range(len(cutting.contours))]
    spans = {k: cutting.contours[k].path.extents for k in set(roots)}
    low, high = min(s[axis] for s in spans.values()), max(s[axis + 2] for s in spans.values())
    width = width or max((high - low) / 5.0, *(s[axis + 2] - s[axis] for s in spans.values()), 1.0)
    found: dict[int, list[int]] = {}
    for k, root in enumerate(roots):
        middle = 0.5 * (spans[root][axis] + spans[root][axis + 2])
        place = int((high - middle if backward else middle - low) / width)
        if cutting.by_contour[k]:
            found.setdefault(place, []).append(k)
    return [found[place] for place in sorted(found)]


def sorted_by_band(cutting: Cutting, order: Sequence[CutStart], options: CutOptions) -> list[CutStart]:
    """Sort the cuts by the bands of the sweep. The order within each band does not change."""
    band = {k: number for number, members in enumerate(bands(cutting, options)) for k in members}
    return sorted(order, key=lambda s: band[s.contour])


def _outermost_contour(cutting: Cutting, k: int, position: dict[int, int], outlines: dict[int, int]) -> int:
    """Return the outermost contour around a contour, or the contour itself if no other contour surrounds it."""
    contour = cutting.contours[k]
    if contour.kind == "mark" and contour.source.part in outlines:
        k = outlines[contour.source.part]
    while (around := _enclosing_contour(cutting.sheet, position, cutting.contours[k])) is not None:
        k = around
    return k


# -- loops at sharp outer corners ------------------------------------------------------------------------------------


def with_loops(contours: list[CutContour], scrap: Scrap) -> list[CutContour]:
    """Return the contours, with loops added at the sharp corners of outlines where a loop fits.

    The torch cuts straight past the corner, turns through the scrap, and crosses its own kerf onto the next edge.
    Without a loop, it would slow down at the corner.
    """
    rules = scrap.rules
    outlines = [(k, c) for k, c in enumerate(contours) if c.has_leads and not c.hole]
    loops = [(k, at, loop) for k, c in outlines for at, loop in _possible_loops(c)]
    if not loops:
        return contours
    lines = [flat_line(Polyline(rows)) for _, _, (_, rows) in loops]
    fits = np.zeros(len(loops), dtype=bool)
    apart = min(0.9 * rules.loop_length, rules.kerf)
    for number, (k, _, (_, rows)) in enumerate(loops):
        turn = flat_line(Polyline(np.array([rows[1], [*rows[2, :2], 0.0]])))
        free = scrap.allows([lines[number]], contours[k])[0]
        fits[number] = free and not shapely.dwithin(turn, contours[k].line, apart)
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=rules.kerf)
    for a, b in sorted(zip(*pairs.tolist(), strict=True)):
        if a < b and fits[a]:
            fits[b] = False
    chosen: dict[int, dict[int, _Loop]] = {}
    for (k, at, loop), fit in zip(loops, fits.tolist(), strict=True):
        if fit:
            chosen.setdefault(k, {})[at] = loop
    return [_with_own_loops(c, chosen[k]) if k in chosen else c for k, c in enumerate(contours)]


def _possible_loops(contour: CutContour) -> Iterator[tuple[int, _Loop]]:
    """Yield pairs (segment, loop) for the corners of an outline, and for the arcs around corners of the drawing."""
    path, half, length = contour.path, contour.rules.half, contour.rules.loop_length
    for at, turn in enumerate(corner_turns(path).tolist()):
        if half == 0.0 and math.pi - LOOP_ANGLE < turn < math.pi - 0.01:
            corner, along = path.segment(at).start, float(path.lengths[:at].sum())
            before, after = path.direction_at(along - 1e-6), path.direction_at(along + 1e-6)
            yield at, (False, _loop_vertices((corner, corner), before, after, 0.0, length))
    for at in range(path.n_segments):
        s = path.segment(at)
        turn = 4.0 * math.atan(s.bulge)
        around = s.is_arc and abs(s.radius - half) < SAME_RADIUS * half
        if around and math.pi - LOOP_ANGLE < turn < math.pi - 0.01:
            before, after = (
                (-(p[1] - s.center[1]) / s.radius, (p[0] - s.center[0]) / s.radius) for p in (s.start, s.end)
            )
            yield at, (True, _loop_vertices((s.start, s.end), before, after, half, length))


def _loop_vertices(ends: tuple[Point, Point], before: Point, after: Point, half: float, length: float) -> Points:
    """Return the vertices of a loop, float64[4, 3]: straight past the corner, around, and back to the next edge.

    `ends` are the points of the path where the loop starts and ends; `before` and `after` are the directions there. The
    loop turns `length` mm past the intersection of both lines. `half` is half a kerf, mm.
    """
    start, end = ends
    turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
    run = half * math.tan(0.5 * turn) + length
    a = (start[0] + run * before[0], start[1] + run * before[1])
    b = (end[0] - run * after[0], end[1] - run * after[1])
    bulge = -math.tan(0.25 * (2.0 * math.pi - turn))
    return np.array([[*start, 0.0], [*a, bulge], [*b, 0.0], [*end, 0.0]])


def _with_own_loops(contour: CutContour, loops: dict[int, _Loop]) -> CutContour:
    path = contour.path
    rows: list[Points] = []
    spans: list[tuple[float, float]] = []
    length = 0.0
    for at in range(path.n_segments):
        if at in loops:
            arc, loop = loops[at]
            own = Polyline(loop).length
            rows.append(loop[:-1])
            spans.append((length, length + own))
            length += own
            if arc:
                continue
        rows.append(path.vertices[at : at + 1])
        length += float(path.lengths[at])
    whole = Polyline(np.vstack(rows), closed=True)
    line = flat_line(whole)
    corners = corners_along(contour.source.path, whole, line)
    return replace(contour, path=whole, line=line, loops=tuple(spans), corners=corners)
