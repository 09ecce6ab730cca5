"""Model the cutting of a sheet as a routing problem.

Each cut is a task, and its possible starts are the choices. Inner contours must be cut before outer contours. The
choice of a start affects the travel to and from a cut, but has almost no effect on the cutting time.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.message import Message
from leafcut.model.cutting import Cut, CutChoice
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import CutMethod
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.common_edges import doubled_edge_issues, precedence_for_pierces
from leafcut.processes.sheet.plan.contours import (
    CORNER,
    ROUNDING,
    CutContour,
    assign_closed_notches,
    chord_line,
    corner_turns,
    corners_along,
    name_list,
    prepare_contours,
)
from leafcut.processes.sheet.plan.cut_rules import LOOP_ANGLE, CutRules
from leafcut.processes.sheet.plan.leads import FLATNESS
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import FEWEST_PLACES, CutStart, find_contour_starts, find_starts
from leafcut.timing.travel import travel_cost

#: Tolerance for the radius of an arc around a corner, relative to half a kerf.
SAME_RADIUS = 0.02
#: A corner loop: whether it replaces a segment of the path (an arc), and its vertices (x, y, bulge).
_Loop = tuple[bool, Points]
#: Maximum distance between coincident points, mm.
SAME_PLACE = 1e-6
#: Minimum length of the segments at a concave corner, in kerf widths. With shorter segments, the offset path would
#: cross itself.
SHORTEST_KERFS = 2.0
#: Minimum radius of concave arcs, in half kerf widths. A controller cannot compensate the kerf along tighter arcs.
TIGHTEST = 1.05
#: A section of a path, given by the distances of its ends from the start of the path, mm.
Span = tuple[float, float]
#: Names of the choices that a plan file fixes, keyed by the index of the contour.
Fixed = Mapping[int, tuple[str, ...]]


@dataclass(frozen=True)
class HeadTravel:
    """How the head travels between cuts.

    This includes the cost of rapids, the time to lower and raise the head at each cut, s, and the first and last
    position of the head.
    """

    metric: Metric
    overhead: float = 0.0
    start: Point | None = None
    end: Point | None = None

    def cost(self, a: Point, b: Point) -> float:
        """Return the cost of a rapid, in s or mm."""
        return travel_cost(self.metric, a, b)

    def adjacent_positions(self, order: Sequence[CutStart], k: int) -> tuple[Point | None, Point | None]:
        """Return the positions of the head just before and just after cut number `k`."""
        return order[k - 1].exit if k else self.start, order[k + 1].entry if k + 1 < len(order) else self.end

    def cost_to_and_from(self, around: tuple[Point | None, Point | None], start: CutStart) -> float:
        """Return the cost of the travel to and from a cut.

        `around` contains the positions of the head before and after the cut.
        """
        before, after = around
        come = 0.0 if before is None else self.cost(before, start.entry)
        return come + (0.0 if after is None else self.cost(start.exit, after))


@dataclass(frozen=True, eq=False)
class Cutting:
    """The contours of a sheet, all possible starts of their cuts, and the precedence between them.

    Attributes
    ----------
    starts
        The possible starts, grouped by contour. The starts of a chain belong to the first contour of the chain.
    order
        Additional precedence pairs (before, after) of contours.
    fixed
        Names of the choices that a plan file fixes, by contour.
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
    def first_contours(self) -> list[int]:
        """Indices of the contours at which a cut starts. Only the later contours of chains are missing."""
        return [k for k, own in enumerate(self.starts_by_contour) if own]

    @cached_property
    def cut_precedence(self) -> list[tuple[int, int]]:
        """Precedence pairs (before, after) of cuts. Each cut is identified by the index of its first contour."""
        head = {k: s.contour for s in self.starts for k in s.contours}
        return sorted({(head[a], head[b]) for a, b in self.contour_precedence if head[a] != head[b]})

    @cached_property
    def contour_precedence(self) -> list[tuple[int, int]]:
        """Precedence pairs (before, after) of contours, as indices into `contours`."""
        return sorted({*precedence_pairs(self.sheet, self.contours), *self.order})

    @cached_property
    def starts_by_contour(self) -> list[list[int]]:
        """Indices in `starts`, grouped by contour."""
        found: list[list[int]] = [[] for _ in self.contours]
        for number, start in enumerate(self.starts):
            found[start.contour].append(number)
        return found

    def starts_on(self, members: Iterable[int]) -> list[CutStart]:
        """Return the starts of the contours with the indices `members`."""
        return [self.starts[number] for k in members for number in self.starts_by_contour[k]]

    def cut(self, start: CutStart) -> Cut:
        """Return the cut that belongs to a start. Cuts are cached."""
        if start not in self._cut_cache:
            make = make_chain if start.then else make_cut
            self._cut_cache[start] = make(self.contours, start, self.fixed)
        return self._cut_cache[start]

    def cutting_time(self, start: CutStart) -> float:
        """Return the duration of a cut without travel, s.

        It is the pierce time plus the time to follow the path at its feed.
        """
        contour, data = self.contours[start.contour], self.rules.data
        if start.then:
            length = chain_length(self.contours, start)
            return length / data.feed + (data.pierce_delay if start.pierce else 0.0)
        length = contour.path.length + start.lead_in.length + start.lead_out.length + contour.overcut
        return length / contour.feed + (data.pierce_delay if start.pierce and contour.kind == "cut" else 0.0)

    def lead_lines(self, start: CutStart) -> list[Any]:
        """Return the leads of a start as shapely lines. For a chain, these are the leads at its first contour."""
        contour = self.contours[start.contour]
        leads = [(start.lead_in, start.at, False)] if contour.path.closed or start.lead_in.length else []
        if contour.path.closed:
            leads.append((start.lead_out, contour.end_position(start.at, start.clockwise), True))
        points = [contour.lead_points(lead, at, start.clockwise, out=out) for lead, at, out in leads]
        return [shapely.LineString(own) for own in points if len(own) > 1] if contour.kind == "cut" else []


@dataclass(frozen=True, eq=False)
class CutSequence:
    """The cuts of a sheet in order. Each cut has a chosen start.

    Raises PlanError if a contour is cut twice or not at all. Also raises PlanError if a part is detached before all
    contours inside it are cut.
    """

    cutting: Cutting
    starts: tuple[CutStart, ...]

    def with_starts(self, starts: Sequence[CutStart]) -> CutSequence:
        """Return a sequence that uses the given starts in their order."""
        return CutSequence(self.cutting, tuple(starts))

    def __post_init__(self) -> None:
        """Reject invalid orders with a PlanError, because no later check would detect them."""
        contours, cut = self.cutting.contours, [k for s in self.starts for k in s.contours]
        at = {k: place for place, k in enumerate(cut)}
        if len(at) != len(contours) or len(cut) != len(at):
            raise PlanError(
                "the order does not cut every contour once; this is a defect of the algorithm; choose another "
                "--algorithm"
            )
        for a, b in self.cutting.contour_precedence:
            if at[a] > at[b]:
                raise PlanError(
                    "{} would be cut before {}; remove 'order' from the plan file, or leave out --sweep",
                    contours[b].name(),
                    contours[a].name(),
                )


# -- preparation -----------------------------------------------------------------------------------------------------


def prepare_cutting(sheet: Sheet, rules: CutRules) -> Cutting:
    """Find all possible starts for the cuts of a sheet. Raises PlanError if a kerf or a lead does not fit."""
    contours, issues = prepare_contours(sheet, rules)
    scrap = Scrap(sheet, contours, rules)
    check_kerf_clearance(contours, scrap)
    if rules.compensation == "controller":
        contours, found = compensate_in_program_where_needed(contours, scrap)
        issues = [*issues, *found]
    if rules.loops:
        contours = with_corner_loops(contours, scrap)
        scrap = Scrap(sheet, contours, rules)
    order: list[tuple[int, int]] = []
    if rules.common_lines or rules.once:
        from leafcut.processes.sheet.plan.common_lines import scrap_with_lead_ins, with_common_lines

        contours, order, found = with_common_lines(contours, scrap)
        scrap, issues = scrap_with_lead_ins(Scrap(sheet, contours, rules), contours), [*issues, *found]
    contours = assign_closed_notches(contours, rules)
    starts = find_starts(contours, scrap)
    issues = [*issues, *doubled_edge_issues(contours, rules), *_lead_issues(contours, starts, rules)]
    order += precedence_for_pierces(contours, starts, [*precedence_pairs(sheet, contours), *order], rules)
    return Cutting(sheet, rules, contours, scrap, starts, tuple(issues), tuple(order))


def check_kerf_clearance(contours: list[CutContour], scrap: Scrap) -> None:
    """Raise PlanError if a kerf touches another part or a clamp, or if the centreline of a kerf leaves the sheet."""
    cut = [c for c in contours if c.kind == "cut"]
    lines = np.array([c.line for c in cut], dtype=object)
    found = []
    if scrap.rules.half > 0.0:
        for k, part in scrap.parts_near(lines).T.tolist():
            owner, other = cut[k].source.part, scrap.part_numbers[part]
            if other != owner and (cut[k].path.closed or owner):
                found.append(
                    Message(
                        "{} is nearer to part {} than the kerf of {:.4g} mm, so cutting one would cut into the "
                        "other; nest them farther apart, with that kerf (leafcut nest --kerf {:g})",
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
        if contour.requested_lead_out.style != "none" and all(s.lead_out.style == "none" for s in own):
            without.append(contour)
    for group, message in (
        (
            lesser,
            Message(
                "contours without room for a lead-in of full length: {}; their lead-in of {:g} mm ({}) was "
                "shortened or replaced",
                len(lesser),
                wanted.length,
                wanted.style,
            ),
        ),
        (
            without,
            Message(
                "contours without room for a lead-out: {}; their lead-out of {:g} mm was left out",
                len(without),
                rules.lead_out.length,
            ),
        ),
    ):
        if group:
            yield Issue("L613", message, name_list(group), Severity.NOTE)


def precedence_pairs(sheet: Sheet, contours: Sequence[CutContour]) -> Iterable[tuple[int, int]]:
    """Yield the precedence pairs (before, after) of a sheet.

    Inner contours come before outer contours, and the marks of a part come before its cuts.
    """
    position = {i: k for k, c in enumerate(contours) if not c.common for i in c.contour_indices}
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
    """Return the innermost contour that encloses another contour, or None.

    Holes that are too narrow to cut are skipped. An outline also encloses the parts that lie in its closed notches.
    `position` maps the index of a contour in the sheet to its index in `Cutting.contours`.
    """
    parent = contour.notch_of if contour.notch_of >= 0 else contour.source.parent
    while parent >= 0 and parent not in position:
        parent = sheet.contours[parent].parent
    return position.get(parent)


# -- orders ----------------------------------------------------------------------------------------------------------


def build_problem(
    cutting: Cutting, members: Sequence[int], head: HeadTravel, *, first: bool = True, last: bool = True
) -> RoutingProblem:
    """Build the routing problem for some contours of a sheet. Its nodes are the starts of these contours.

    Parameters
    ----------
    members
        Indices of the contours in `Cutting.contours`. They become the clusters of the problem, in this order.
    first
        Whether the route starts at the start point of the head.
    last
        Whether the route ends at the end point of the head.

    Raises
    ------
    PlanError
        If the precedence has a cycle.
    """
    check_precedence(cutting)
    nodes = cutting.starts_on(members)
    cluster_of = {k: c for c, k in enumerate(members)}
    timed = head.metric.unit == "s"
    pairs = [(cluster_of[a], cluster_of[b]) for a, b in cutting.cut_precedence if a in cluster_of and b in cluster_of]
    return RoutingProblem(
        entry=np.array([n.entry for n in nodes], dtype=np.float64).reshape(-1, 2),
        exit=np.array([n.exit for n in nodes], dtype=np.float64).reshape(-1, 2),
        cluster=np.array([cluster_of[n.contour] for n in nodes], dtype=np.int32),
        service=np.array([head.overhead + cutting.cutting_time(n) if timed else 0.0 for n in nodes], dtype=np.float64),
        metric=head.metric,
        precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2),
        start=head.start if first else None,
        end=head.end if last else None,
        name=cutting.sheet.name,
    )


def check_precedence(cutting: Cutting) -> None:
    """Raise PlanError if the precedence has a cycle. Only a plan file with a fixed order can cause this."""
    if len(_first_contours_in_drawing_order(cutting)) < len(cutting.first_contours):
        raise PlanError("the fixed order of the plan file contradicts inner before outer; remove 'order' from a cut")


def _first_contours_in_drawing_order(cutting: Cutting) -> list[int]:
    """List the first contour of each cut in drawing order. The order only changes where the precedence requires it."""
    after: dict[int, list[int]] = {}
    missing = [0] * len(cutting.contours)
    for a, b in cutting.cut_precedence:
        after.setdefault(a, []).append(b)
        missing[b] += 1
    ready = [k for k in cutting.first_contours if not missing[k]]
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
    """Return one start for each cut, in drawing order. The order only changes where the precedence requires it."""
    check_precedence(cutting)
    return [cutting.starts[cutting.starts_by_contour[k][0]] for k in _first_contours_in_drawing_order(cutting)]


def total_travel(start: Point | None, order: Sequence[CutStart], travel: Any = math.dist) -> float:
    """Add up the cost of the travel moves between cuts. `travel` computes the cost of a move between two points."""
    total, here = 0.0, start
    for s in order:
        total += travel(here, s.entry) if here is not None else 0.0
        here = s.exit
    return total


def sweep_bands(cutting: Cutting, options: CutOptions, width: float = 0.0) -> list[list[int]]:
    """Group the cuts into bands that follow each other in the direction of the sweep.

    Without a sweep, there is one band.

    Each cut is represented by its first contour. All contours of a part belong to the band that contains the centre of
    the outline.

    Parameters
    ----------
    width
        Width of a band, mm. If it is 0, the bands are a fifth as wide as the sheet, or as wide as the largest part if
        that part is wider.
    """
    if options.sweep == "free":
        return [cutting.first_contours]
    axis, backward = "xy".index(options.sweep[-1]), options.sweep.startswith("-")
    position = {i: k for k, c in enumerate(cutting.contours) if not c.common for i in c.contour_indices}
    outlines = {c.source.part: k for k, c in enumerate(cutting.contours) if c.has_leads and not c.hole}
    roots = [_outermost_contour(cutting, k, position, outlines) for k in range(len(cutting.contours))]
    spans = {k: cutting.contours[k].path.extents for k in set(roots)}
    low, high = min(s[axis] for s in spans.values()), max(s[axis + 2] for s in spans.values())
    width = width or max((high - low) / 5.0, *(s[axis + 2] - s[axis] for s in spans.values()), 1.0)
    found: dict[int, list[int]] = {}
    for k, root in enumerate(roots):
        middle = 0.5 * (spans[root][axis] + spans[root][axis + 2])
        place = int((high - middle if backward else middle - low) / width)
        if cutting.starts_by_contour[k]:
            found.setdefault(place, []).append(k)
    return [found[place] for place in sorted(found)]


def sorted_by_band(cutting: Cutting, order: Sequence[CutStart], options: CutOptions) -> list[CutStart]:
    """Sort the cuts by the bands of the sweep. Within each band, the order stays the same."""
    band = {k: number for number, members in enumerate(sweep_bands(cutting, options)) for k in members}
    return sorted(order, key=lambda s: band[s.contour])


def _outermost_contour(cutting: Cutting, k: int, position: dict[int, int], outlines: dict[int, int]) -> int:
    """Return the outermost contour that surrounds a contour. If there is none, return the contour itself."""
    contour = cutting.contours[k]
    if contour.kind == "mark" and contour.source.part in outlines:
        k = outlines[contour.source.part]
    while (around := _enclosing_contour(cutting.sheet, position, cutting.contours[k])) is not None:
        k = around
    return k


# -- loops at sharp outer corners ------------------------------------------------------------------------------------


def with_corner_loops(contours: list[CutContour], scrap: Scrap) -> list[CutContour]:
    """Add a loop at each sharp corner of an outline, provided that the loop fits into the scrap.

    Without a loop, the torch would slow down at the corner. With a loop, it cuts straight past the corner, turns around
    in the scrap, and crosses its own kerf onto the next edge.
    """
    rules = scrap.rules
    outlines = [(k, c) for k, c in enumerate(contours) if c.has_leads and not c.hole]
    loops = [(k, at, loop) for k, c in outlines for at, loop in _possible_loops(c)]
    if not loops:
        return contours
    lines = [chord_line(Polyline(rows)) for _, _, (_, rows) in loops]
    fits = np.zeros(len(loops), dtype=bool)
    apart = min(0.9 * rules.loop_length, rules.kerf)
    for number, (k, _, (_, rows)) in enumerate(loops):
        turn = chord_line(Polyline(np.array([rows[1], [*rows[2, :2], 0.0]])))
        free = scrap.allowed_mask([lines[number]], contours[k])[0]
        fits[number] = free and not shapely.dwithin(turn, contours[k].line, apart)
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=rules.kerf)
    for a, b in sorted(zip(*pairs.tolist(), strict=True)):
        if a < b and fits[a]:
            fits[b] = False
    chosen: dict[int, dict[int, _Loop]] = {}
    for (k, at, loop), fit in zip(loops, fits.tolist(), strict=True):
        if fit:
            chosen.setdefault(k, {})[at] = loop
    return [_insert_corner_loops(c, chosen[k]) if k in chosen else c for k, c in enumerate(contours)]


def _possible_loops(contour: CutContour) -> Iterator[tuple[int, _Loop]]:
    """Yield a pair (segment, loop) for each corner of an outline, and for each arc around a corner of the drawing."""
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
    """Return the vertices of a loop, float64[4, 3].

    The loop runs straight past the corner, turns around, and returns to the next edge.

    Parameters
    ----------
    ends
        Points of the path where the loop starts and ends.
    before, after
        Directions of travel at these points.
    half
        Half a kerf, mm.
    length
        How far the loop runs beyond the intersection of both edges, mm.
    """
    start, end = ends
    turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
    run = half * math.tan(0.5 * turn) + length
    a = (start[0] + run * before[0], start[1] + run * before[1])
    b = (end[0] - run * after[0], end[1] - run * after[1])
    bulge = -math.tan(0.25 * (2.0 * math.pi - turn))
    return np.array([[*start, 0.0], [*a, bulge], [*b, 0.0], [*end, 0.0]])


def _insert_corner_loops(contour: CutContour, loops: dict[int, _Loop]) -> CutContour:
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
    line = chord_line(whole)
    corners = corners_along(contour.source.path, whole, line)
    return replace(contour, path=whole, line=line, loops=tuple(spans), corners=corners)


# -- paths of the cuts -----------------------------------------------------------------------------------------------


def make_cut(contours: Sequence[CutContour], start: CutStart, fixed: Fixed) -> Cut:
    """Create the cut of a single contour with the chosen start.

    If the controller compensates the kerf (G41, G42), the program contains the contour as drawn, and the radius of the
    lead arcs is larger by half a kerf. Compensation starts on the straight run-in. There, LinuxCNC moves along a
    tangent to the circle around the end of the run-in whose radius is half a kerf. The torch must start on this
    tangent.
    """
    contour = contours[start.contour]
    rules, choice = contour.rules, plan_file_entry(contour, start, fixed.get(start.contour, ()))
    if rules.compensation == "controller" and contour.has_leads:
        path, begin = programmed_path(contour, start)
        return Cut(
            contours=(contour.index,),
            path=path,
            lead_in=begin,
            lead_out=path.length - contour.overcut,
            torch_off_at=path.length,
            speeds=((0.0, contour.feed),),
            choice=choice,
            pierce=start.pierce,
            part=contour.source.part,
            compensation=41 if contour.is_scrap_left(start.clockwise) else 42,
            small_hole=contour.is_small,
        )
    body, past = path_from_start(contour, start)
    closed = contour.path.closed
    lead_in = contour.lead_path_at(start.lead_in, start.at, start.clockwise) if closed or start.lead_in.length else None
    end = start.at - past if start.clockwise else start.at + past
    out = contour.lead_path_at(start.lead_out, end, start.clockwise, out=True) if closed else None
    whole = concatenate(*(without_tiny_segments(p) for p in (lead_in, body, out) if p is not None))
    begin = lead_in.length if lead_in is not None else 0.0
    leave, overcut = begin + body.length, max(past, 0.0)
    return Cut(
        contours=contour.contour_indices,
        path=whole,
        lead_in=begin,
        lead_out=leave - overcut,
        torch_off_at=leave - overcut if rules.torch_off_in_overcut and overcut > 0.0 else whole.length,
        speeds=((0.0, contour.feed),),
        choice=choice,
        joints=joint_spans(contour, start, begin),
        loops=loop_spans(contour, start, begin),
        pierce=start.pierce and contour.kind == "cut",
        kind=contour.kind,
        part=contour.source.part,
        small_hole=contour.is_small,
        group=contour.group,
        common=contour.common,
    )


def make_chain(contours: Sequence[CutContour], start: CutStart, fixed: Fixed) -> Cut:
    """Create the cut of a chain, which has one pierce and connects its contours by bridges through the scrap.

    Only the last contour has an overcut. Every other contour ends where it closes, or earlier if it needs a
    micro-joint.
    """
    steps = [start, *start.then]
    first, last = contours[start.contour], contours[steps[-1].contour]
    rules = first.rules
    pieces: list[Polyline] = []
    bridges: list[Span] = []
    joints: list[Span] = []
    loops: list[Span] = []
    lead_in = first.lead_path_at(start.lead_in, start.at, start.clockwise)
    at = lead = 0.0
    if lead_in is not None:
        pieces.append(lead_in)
        at = lead = lead_in.length
    past = 0.0
    for number, step in enumerate(steps):
        contour = contours[step.contour]
        body, past = path_from_start(contour, step, overcut=step is steps[-1])
        if number:
            bridge = Polyline.of_points([pieces[-1].end, body.start])
            pieces.append(bridge)
            bridges.append((at, at + bridge.length))
            at += bridge.length
        joints += joint_spans(contour, step, at)
        loops += loop_spans(contour, step, at)
        pieces.append(body)
        at += body.length
    overcut, end = max(past, 0.0), steps[-1]
    out = last.lead_path_at(end.lead_out, end.at + (-past if end.clockwise else past), end.clockwise, out=True)
    whole = concatenate(*(without_tiny_segments(p) for p in (*pieces, *([out] if out is not None else []))))
    choices = [plan_file_entry(contours[s.contour], s, fixed.get(s.contour, ())) for s in steps]
    return Cut(
        contours=tuple(contours[s.contour].index for s in steps),
        path=whole,
        lead_in=lead,
        lead_out=at - overcut,
        torch_off_at=at - overcut if rules.torch_off_in_overcut and overcut > 0.0 else whole.length,
        speeds=((0.0, rules.data.feed),),
        choice=choices[0],
        joints=tuple(joints),
        loops=tuple(loops),
        pierce=start.pierce,
        part=first.source.part,
        bridges=tuple(bridges),
        chained=tuple(replace(choice, lead_in=None, lead_out=None, bridge=True) for choice in choices[1:]),
    )


def chain_length(contours: Sequence[CutContour], start: CutStart) -> float:
    """Return the length of the path of a chain, mm. Micro-joints are included."""
    steps = [start, *start.then]
    places = [contours[s.contour].path.point_at(s.at) for s in steps]
    bridges = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
    bodies = sum(contours[s.contour].path.length for s in steps)
    overcut = contours[steps[-1].contour].overcut
    return bridges + bodies + start.lead_in.length + steps[-1].lead_out.length + overcut


def path_from_start(contour: CutContour, start: CutStart, *, overcut: bool = True) -> tuple[Polyline, float]:
    """Return the path of a contour from its start, and how far it continues past the start, mm.

    This length is negative if a micro-joint remains.
    """
    path = contour.path
    if not path.closed:
        return (path.reversed() if start.clockwise else path), 0.0
    past = (contour.overcut if overcut else 0.0) - contour.closing_joint_length
    return _path_from(path, start.at, path.length + past, start.clockwise), past


def _path_from(path: Polyline, at: float, length: float, clockwise: bool) -> Polyline:
    if clockwise:
        return path.reversed().piece(path.length - at, path.length - at + length)
    return path.piece(at, at + length)


def without_tiny_segments(piece: Polyline) -> Polyline:
    """Remove tiny segments from an open path. They result from rounding errors."""
    rows = piece.vertices
    step = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    keep = np.append(step > SAME_PLACE, True)
    return piece if keep.all() or keep.sum() < 2 else Polyline(rows[keep])


def plan_file_entry(contour: CutContour, start: CutStart, fixed: tuple[str, ...] = ()) -> CutChoice:
    """Return the entry for a start in a plan file."""
    x, y = contour.path.point_at(start.at)
    words = ("clockwise", "counter-clockwise") if contour.path.closed else ("backward", "forward")
    return CutChoice(
        contours=contour.contour_indices,
        start=(round(x, 4), round(y, 4)),
        direction=words[0] if start.clockwise else words[1],
        lead_in=start.lead_in,
        lead_out=start.lead_out,
        fixed=fixed,
    )


def _distance_along_cut(contour: CutContour, start: CutStart, at: float) -> float:
    return (start.at - at if start.clockwise else at - start.at) % contour.path.length


def loop_spans(contour: CutContour, start: CutStart, begin: float) -> tuple[Span, ...]:
    """Return the corner loops of a cut as sections of its path.

    The contour itself starts `begin` mm along this path.
    """
    spans = []
    for low, high in contour.loops:
        first = _distance_along_cut(contour, start, high if start.clockwise else low)
        spans.append((begin + first, begin + first + high - low))
    return tuple(sorted(spans))


def joint_spans(contour: CutContour, start: CutStart, begin: float) -> tuple[Span, ...]:
    """Return the micro-joints of a laser cut as evenly spaced sections of its path.

    The beam is off for the length of a joint plus a kerf. No joint lies near a corner, where it would be hard to break
    and grind off. No joint lies near the start or end of the cut either, because the kerf there would sever it.
    """
    rules = contour.rules
    wanted = contour.joint_count if rules.kind == CutMethod.LASER else 0
    length, off = contour.path.length, rules.joint_width + rules.kerf
    count = min(wanted, int(length / (4.0 * off)))
    room = 0.5 * off + rules.kerf
    taken = [
        (at - room, at + room)
        for at in (0.0, length, *(_distance_along_cut(contour, start, c) for c in contour.corners))
    ]
    taken += [(low - room, high + room) for low, high in loop_spans(contour, start, 0.0)]
    spans = []
    for k in range(count):
        middle, reach = length * (k + 0.5) / count, 0.5 * (length / count - off)
        places = (middle, *(edge for span in taken for edge in span))
        free = [abs(at - middle) for at in places if not any(low < at < high for low, high in taken)]
        nearest = min(free, default=length)
        if nearest <= reach:
            at = next(at for at in places if abs(at - middle) == nearest) + begin
            spans.append((at - 0.5 * off, at + 0.5 * off))
    return tuple(spans)


# -- compensation by the controller ----------------------------------------------------------------------------------


def compensate_in_program_where_needed(
    contours: list[CutContour], scrap: Scrap
) -> tuple[list[CutContour], list[Issue]]:
    """Switch contours to compensation by the program where the controller cannot compensate the kerf.

    This happens in three cases: run-in and arc do not fit, as in small holes; the radius of a concave arc is too small;
    or a notch is narrower than the kerf. The function returns all contours and a note about the changed contours.
    """
    made = [
        replace(c, rules=c.rules.with_program_compensation())
        if c.has_leads and not _controller_can_compensate(k, c, scrap)
        else c
        for k, c in enumerate(contours)
    ]
    own = [c for c in made if c.rules.compensation != "controller"]
    if not own:
        return made, []
    words = Message(
        "{} contours are compensated by the program for a kerf of {:g} mm, because they have no room for a "
        "controller's lead-in, or a concave arc that is too tight for it",
        len(own),
        scrap.rules.kerf,
    )
    if len(own) == 1:
        words = Message(
            "1 contour is compensated by the program for a kerf of {:g} mm, because it has no room for a "
            "controller's lead-in, or a concave arc that is too tight for it",
            scrap.rules.kerf,
        )
    return made, [Issue("L626", words, name_list(own), Severity.NOTE)]


def _controller_can_compensate(number: int, contour: CutContour, scrap: Scrap) -> bool:
    side, drawn, rules = 1.0 if contour.hole else -1.0, _drawn_path(contour), contour.rules
    arcs = [s for s in drawn.segments() if s.is_arc and s.bulge * side > 0.0]
    if contour.pinched or any(s.radius < rules.half * TIGHTEST for s in arcs):
        return False
    concave, lengths = side * np.asarray(corner_turns(drawn)) > CORNER, drawn.lengths
    if (concave & (np.minimum(lengths, np.roll(lengths, 1)) < SHORTEST_KERFS * rules.kerf)).any():
        return False
    return bool(find_contour_starts(number, contour, scrap, FEWEST_PLACES))


def _drawn_path(contour: CutContour) -> Polyline:
    """Return the drawn path of a contour, counter-clockwise."""
    path = contour.source.path
    return path if path.area >= 0.0 else path.reversed()


def programmed_path(contour: CutContour, start: CutStart) -> tuple[Polyline, float]:
    """Return the path to program if the controller compensates the kerf, and the length of its lead-in, mm.

    Raises PlanError if compensation cannot start at this position.
    """
    half, here, travel = (
        contour.rules.half,
        contour.path.point_at(start.at),
        contour.travel_direction(start.at, start.clockwise),
    )
    side = 1.0 if contour.is_scrap_left(start.clockwise) else -1.0
    on = (here[0] + side * travel[1] * half, here[1] - side * travel[0] * half)
    drawn = _drawn_path(contour)
    line, point = chord_line(drawn), shapely.Point(*on)
    if shapely.distance(point, line) > ROUNDING + FLATNESS:
        raise PlanError(
            "{}: the controller's compensation cannot start at ({:.5g}, {:.5g})", contour.name(), on[0], on[1]
        )
    at = float(shapely.line_locate_point(line, point, normalized=True)) * drawn.length
    body = _path_from(drawn, at, drawn.length + contour.overcut, start.clockwise)
    wanted = contour.lead_path_at(start.lead_in, start.at, start.clockwise)
    if wanted is None:
        return body, 0.0
    radius = start.lead_in.length / start.lead_in.angle
    center = (here[0] - side * travel[1] * radius, here[1] + side * travel[0] * radius)
    lead = _with_lead_radius(wanted, center, radius + half, body.start)
    return concatenate(lead, body), lead.length


def _with_lead_radius(lead: Polyline, center: Point, radius: float, on: Point) -> Polyline:
    """Change the radius of the arc in a lead. Its first point and the centre of the arc stay the same."""
    x, y = lead.vertices[1, :2].tolist()
    scale = radius / math.hypot(x - center[0], y - center[1])
    corner = (center[0] + scale * (x - center[0]), center[1] + scale * (y - center[1]))
    rows = [[*lead.start, 0.0], [*corner, float(lead.vertices[1, 2])], [*on, 0.0]]
    return Polyline(np.array(rows))
