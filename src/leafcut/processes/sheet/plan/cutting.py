"""A sheet as a routing problem: each contour is a cluster, each place to start it a node, inner before outer.

A cluster of a generalised travelling salesman problem is here all that may be chosen of one cut: where along its
contour it begins, and which way round. What it costs to come there and to leave from there depends on that choice, what
the cut itself costs hardly does.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Cut
from leafcut.model.issue import Issue, Severity
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.chains.chain_path import chain_length, make_chain
from leafcut.processes.sheet.plan.common_cuts.doubled import doubled_edges, pierced_first
from leafcut.processes.sheet.plan.cut_contours import ROUNDING, CutContour, prepare_contours, with_notches
from leafcut.processes.sheet.plan.cut_path import make_cut
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.cutter_compensation import by_path_where_needed
from leafcut.processes.sheet.plan.leads.cut_starts import CutStart, lead_out_of, overcut_of
from leafcut.processes.sheet.plan.leads.find_starts import find_starts
from leafcut.processes.sheet.plan.leads.leads import Scrap


@dataclass(frozen=True, eq=False)
class Cutting:
    """A sheet made ready for the search: its contours, where each may start, and what must come first.

    Attributes
    ----------
    starts
        Contour by contour. Those of a chain are its first contour's; its others have none.
    order
        Pairs (before, after) of contours that a plan file holds in their order, besides those of the process.
    """

    sheet: Sheet
    rules: CutRules
    contours: list[CutContour]
    scrap: Scrap
    starts: list[CutStart]
    issues: tuple[Issue, ...] = ()
    order: tuple[tuple[int, int], ...] = ()
    fixed: dict[int, tuple[str, ...]] = field(default_factory=dict)
    _made: dict[CutStart, Cut] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def heads(self) -> list[int]:
        """Positions of the contours with which a cut can begin: all but the others of chains."""
        return [k for k, own in enumerate(self.by_contour) if own]

    @cached_property
    def head_pairs(self) -> list[tuple[int, int]]:
        """Pairs (before, after) of cuts, as positions of their first contours."""
        head = {k: s.contour for s in self.starts for k in s.contours}
        return sorted({(head[a], head[b]) for a, b in self.pairs if head[a] != head[b]})

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Pairs (before, after) of positions in `contours`."""
        return sorted({*process_pairs(self.sheet, self.contours), *self.order})

    @cached_property
    def by_contour(self) -> list[list[int]]:
        """The starts of every contour, as positions in `starts`."""
        found: list[list[int]] = [[] for _ in self.contours]
        for number, start in enumerate(self.starts):
            found[start.contour].append(number)
        return found

    def starts_of(self, members: Sequence[int]) -> list[CutStart]:
        """Return the starts of some contours."""
        return [self.starts[number] for k in members for number in self.by_contour[k]]

    def cut(self, start: CutStart) -> Cut:
        """Return the run of the torch that begins at a start; the same ones are asked for again and again."""
        if start not in self._made:
            contour, fixed = self.contours[start.contour], self.fixed
            self._made[start] = (
                make_chain(self.contours, start, self.rules, fixed)
                if start.then
                else make_cut(contour, start, self.rules, fixed=fixed.get(start.contour, ()))
            )
        return self._made[start]

    def seconds(self, start: CutStart) -> float:
        """Return what a cut takes without the ways to it and from it: the pierce, and its path at its speed, s."""
        contour, rules = self.contours[start.contour], self.rules
        if start.then:
            length = chain_length(self.contours, start, rules)
            return length / rules.data.feed + (rules.data.pierce_delay if start.pierce else 0.0)
        length = contour.path.length + start.lead_in.length + start.lead_out.length + overcut_of(contour, rules)
        feed = rules.feed_of(contour.kind, small=contour.is_small(rules))
        return length / feed + (rules.data.pierce_delay if start.pierce and contour.kind == "cut" else 0.0)


@dataclass(frozen=True, eq=False)
class CutSequence:
    """Cuts of a sheet in order, each by its start.

    Raises
    ------
    PlanError
        A contour is cut twice or not at all, or a part is detached before a contour inside it is cut.
    """

    cutting: Cutting
    starts: tuple[CutStart, ...]

    def __post_init__(self) -> None:
        """Refuse an order that no later check would see."""
        contours, cut = self.cutting.contours, [k for s in self.starts for k in s.contours]
        at = {k: place for place, k in enumerate(cut)}
        if len(at) != len(contours) or len(cut) != len(at):
            raise PlanError(
                "the order does not cut every contour once; this is a fault of the algorithm, choose another"
            )
        for a, b in self.cutting.pairs:
            if at[a] > at[b]:
                raise PlanError(
                    f"{contours[b].name()} would be cut before {contours[a].name()}; remove 'order' from the plan "
                    "file, or leave out --sweep"
                )


def prepare_cutting(sheet: Sheet, rules: CutRules) -> Cutting:
    """Return a sheet made ready: what can be cut, and every place where a cut can begin.

    Raises
    ------
    PlanError
        A kerf would touch another part or a clamp, or there is no room for a lead: says which part, and where.
    """
    contours, issues = prepare_contours(sheet, rules)
    scrap = Scrap(sheet, contours, rules)
    check_room(contours, scrap)
    if rules.compensation == "controller":
        contours, found = by_path_where_needed(contours, scrap, rules)
        issues = [*issues, *found]
    if rules.loops:
        from leafcut.processes.sheet.plan.leads.corner_loops import with_loops

        contours = with_loops(contours, scrap, rules)
        scrap = Scrap(sheet, contours, rules)
    order: list[tuple[int, int]] = []
    if rules.common_lines or rules.once:
        from leafcut.processes.sheet.plan.common_cuts.lines import beside_leads, with_common_lines

        contours, order, found = with_common_lines(contours, scrap, rules)
        scrap, issues = beside_leads(Scrap(sheet, contours, rules), contours), [*issues, *found]
    contours = with_notches(contours, rules)
    starts = find_starts(contours, scrap, rules)
    issues = [*issues, *doubled_edges(contours, rules), *_lead_issues(contours, starts, rules)]
    order += pierced_first(contours, starts, [*process_pairs(sheet, contours), *order], rules)
    return Cutting(sheet, rules, contours, scrap, starts, tuple(issues), tuple(order))


def check_room(contours: list[CutContour], scrap: Scrap) -> None:
    """Refuse a kerf that touches another part, or a clamp, or whose middle is beyond the edge of the sheet.

    Raises
    ------
    PlanError
        The first that does, and how many more.
    """
    cut = [c for c in contours if c.kind == "cut"]
    lines = np.array([c.line for c in cut], dtype=object)
    found = []
    if scrap.rules.half > 0.0:
        for k, part in scrap.parts_near(lines).T.tolist():
            owner = cut[k].source.part
            if scrap.part_numbers[part] != owner and (cut[k].path.closed or owner):
                other = scrap.part_numbers[part]
                found.append(
                    f"{cut[k].name()} is nearer to part {other} than the kerf of {scrap.rules.kerf:.4g} mm: cutting "
                    "one would cut into the other; nest them farther apart, with that kerf "
                    f"(leafcut nest --kerf {scrap.rules.kerf:g})"
                )
    for k, zone in scrap.zones_near(lines).T.tolist():
        low_x, low_y, high_x, high_y = scrap.zones[zone].bounds
        found.append(
            f"{cut[k].name()} runs into the keep-out zone {low_x:g} {low_y:g} {high_x:g} {high_y:g}; move the clamp "
            "or the part"
        )
    if scrap.sheet is not None:
        beyond = np.flatnonzero(~shapely.contains(scrap.sheet.buffer(ROUNDING), lines))
        found += [
            f"{cut[k].name()} lies so near the edge of the sheet that the kerf of {scrap.rules.kerf:.4g} mm runs off "
            "it; move the part in, or take a larger sheet"
            for k in beyond.tolist()
        ]
    if found:
        more = f" (and {len(found) - 1} more such places)" if len(found) > 1 else ""
        raise PlanError(f"{found[0]}{more}")


def _lead_issues(contours: list[CutContour], starts: list[CutStart], rules: CutRules) -> Iterable[Issue]:
    """Yield a note on the contours none of whose starts has the lead that was asked for."""
    wanted, lesser, without = rules.lead_in, [], []
    by_contour: dict[int, list[CutStart]] = {}
    for start in starts:
        by_contour.setdefault(start.contour, []).append(start)
    for number, own in by_contour.items():
        contour = contours[number]
        if not contour.has_leads or not own[0].pierce:
            continue
        if wanted.style != "none" and not contour.is_small(rules) and all(s.lead_in != wanted for s in own):
            lesser.append(contour)
        out = lead_out_of(contour, rules)
        if out.style != "none" and all(s.lead_out.style == "none" for s in own):
            without.append(contour)
    for group, what in (
        (lesser, f"no room for a lead-in of {wanted.length:g} mm ({wanted.style}): reduced"),
        (without, f"no room for a lead-out of {rules.lead_out.length:g} mm: left out"),
    ):
        if group:
            names = ", ".join(c.name() for c in group[:3]) + (" …" if len(group) > 3 else "")
            yield Issue("L613", f"{len(group)} × {what}", names, Severity.NOTE)


def process_pairs(sheet: Sheet, contours: Sequence[CutContour]) -> Iterable[tuple[int, int]]:
    """Yield (before, after): what lies inside before what is around it, marks of a part before its cuts."""
    position = {i: k for k, c in enumerate(contours) if not c.common for i in c.indices}
    marks: dict[int, list[int]] = {}
    for k, contour in enumerate(contours):
        around = _around(sheet, position, contour)
        if around is not None:
            yield k, around
        if contour.kind == "mark" and contour.source.part:
            marks.setdefault(contour.source.part, []).append(k)
    for k, contour in enumerate(contours):
        if contour.kind != "mark":
            for mark in marks.get(contour.source.part, ()) if contour.source.part else ():
                yield mark, k


def _around(sheet: Sheet, position: Mapping[int, int], contour: CutContour) -> int | None:
    """Return the next contour around one that is cut, by `position` of its index; a hole too narrow to be cut is not.

    An outline is around the parts in its notches that the kerf closes. None: there is none.
    """
    parent = contour.notch_of if contour.notch_of >= 0 else contour.source.parent
    while parent >= 0 and parent not in position:
        parent = sheet.contours[parent].parent
    return position.get(parent)


def build_problem(
    cutting: Cutting, members: Sequence[int], metric: Metric, overhead: float, start: Point | None, end: Point | None
) -> RoutingProblem:
    """Return the routing problem of some contours; its nodes are their starts (`Cutting.starts_of`).

    Parameters
    ----------
    members
        Positions in `Cutting.contours`; they become the clusters, in this order.
    overhead
        What each cut takes to come down and to rise, s.
    start, end
        Where the torch comes from and goes to, or None.

    Raises
    ------
    PlanError
        What must come first goes round in a circle.
    """
    check_order(cutting)
    nodes = cutting.starts_of(members)
    cluster_of = {k: c for c, k in enumerate(members)}
    timed = metric.unit == "s"
    pairs = [(cluster_of[a], cluster_of[b]) for a, b in cutting.head_pairs if a in cluster_of and b in cluster_of]
    return RoutingProblem(
        entry=np.array([n.entry for n in nodes], dtype=np.float64).reshape(-1, 2),
        exit=np.array([n.exit for n in nodes], dtype=np.float64).reshape(-1, 2),
        cluster=np.array([cluster_of[n.contour] for n in nodes], dtype=np.int32),
        service=np.array([overhead + cutting.seconds(n) if timed else 0.0 for n in nodes], dtype=np.float64),
        metric=metric,
        precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2),
        start=start,
        end=end,
        name=cutting.sheet.name,
    )


def check_order(cutting: Cutting) -> None:
    """Refuse a precedence that cannot be kept; only the fixed order of a plan file can make one."""
    if len(_sorted(cutting)) < len(cutting.heads):
        raise PlanError("the fixed order of the plan file contradicts inner before outer; remove 'order' from a cut")


def _sorted(cutting: Cutting) -> list[int]:
    """Return the contours in the order of the drawing, but each after those that must come before it."""
    after: dict[int, list[int]] = {}
    missing = [0] * len(cutting.contours)
    for a, b in cutting.head_pairs:
        after.setdefault(a, []).append(b)
        missing[b] += 1
    free = [k for k in cutting.heads if not missing[k]]
    heapq.heapify(free)
    order = []
    while free:
        k = heapq.heappop(free)
        order.append(k)
        for b in after.get(k, ()):
            missing[b] -= 1
            if not missing[b]:
                heapq.heappush(free, b)
    return order


def drawing_order(cutting: Cutting) -> list[CutStart]:
    """Return the first start of every contour in the order of the drawing, as far as inner before outer lets it."""
    check_order(cutting)
    return [cutting.starts[cutting.by_contour[k][0]] for k in _sorted(cutting)]


def bands(cutting: Cutting, options: CutOptions, width: float = 0.0) -> list[list[int]]:
    """Return the contours in bands along the axis of the sweep, each cut before the next; one band when it is free.

    Of a chain its first contour. A part is in the band of its outline's middle, with all that lies in it. The first
    band is the one at the start corner. `width` of a band, mm; 0: a fifth of the sheet, or its largest part.
    """
    if options.sweep == "free":
        return [cutting.heads]
    everything = list(range(len(cutting.contours)))
    axis = 0 if options.sweep == "x" else 1
    position = {i: k for k, c in enumerate(cutting.contours) if not c.common for i in c.indices}
    outlines = {c.source.part: k for k, c in enumerate(cutting.contours) if c.has_leads and not c.hole}
    roots = [_root(cutting, k, position, outlines) for k in everything]
    spans = {k: cutting.contours[k].path.extents for k in set(roots)}
    low, high = min(s[axis] for s in spans.values()), max(s[axis + 2] for s in spans.values())
    width = width or max((high - low) / 5.0, *(s[axis + 2] - s[axis] for s in spans.values()), 1.0)
    backward = ("right", "upper")[axis] in options.start_corner
    found: dict[int, list[int]] = {}
    for k, root in enumerate(roots):
        middle = 0.5 * (spans[root][axis] + spans[root][axis + 2])
        place = int((high - middle if backward else middle - low) / width)
        if cutting.by_contour[k]:
            found.setdefault(place, []).append(k)
    return [found[place] for place in sorted(found)]


def in_bands(cutting: Cutting, order: Sequence[CutStart], options: CutOptions) -> list[CutStart]:
    """Return cuts in the order of the sweep's bands, and within a band as they were."""
    band = {k: number for number, members in enumerate(bands(cutting, options)) for k in members}
    return sorted(order, key=lambda s: band[s.contour])


def _root(cutting: Cutting, k: int, position: dict[int, int], outlines: dict[int, int]) -> int:
    """Return the outermost contour around one; what is in no part is its own."""
    contour = cutting.contours[k]
    if contour.kind == "mark" and contour.source.part in outlines:
        k = outlines[contour.source.part]
    while (around := _around(cutting.sheet, position, cutting.contours[k])) is not None:
        k = around
    return k


def corner_point(sheet: Sheet, corner: str) -> Point | None:
    """Return the corner of the sheet, or of all that is on it, at which cutting begins; None when that is free."""
    if corner == "free":
        return None
    low_x, low_y, high_x, high_y = _extents(sheet)
    return (high_x if "right" in corner else low_x, high_y if "upper" in corner else low_y)


def _extents(sheet: Sheet) -> tuple[float, float, float, float]:
    if sheet.outline is not None:
        return sheet.outline.extents
    spans = np.array([c.contour.path.extents for c in sheet.contours])
    low_x, low_y = spans[:, :2].min(axis=0).tolist()
    high_x, high_y = spans[:, 2:].max(axis=0).tolist()
    return low_x, low_y, high_x, high_y


def with_options(sheet: Sheet, options: CutOptions, zones: NDArray[np.float64]) -> Sheet:
    """Return the sheet with the size and the forbidden zones (float64[k, 4], mm) that the options give it.

    Raises
    ------
    OptionError
        The size is not one.
    PlanError
        Something does not lie on the sheet of that size.
    """
    outline = sheet.outline
    if options.sheet_size:
        width, height = parse_size(options.sheet_size)
        outline = Polyline.of_points([(0, 0), (width, 0), (width, height), (0, height)], closed=True)
        for number, c in enumerate(sheet.contours, 1):
            low_x, low_y, high_x, high_y = c.contour.path.extents
            if min(low_x, low_y) < -1e-6 or high_x > width + 1e-6 or high_y > height + 1e-6:
                raise PlanError(
                    f"contour {number} (part {c.part}) reaches from ({low_x:.6g}, {low_y:.6g}) to "
                    f"({high_x:.6g}, {high_y:.6g}), outside the sheet of {width:g} × {height:g} mm; "
                    "give a larger --sheet-size, or move the drawing with --origin"
                )
    added = tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in zones)
    return replace(sheet, outline=outline, zones=(*sheet.zones, *added))


def parse_size(text: str) -> Point:
    """Return width and height, mm, of a text such as ``3000x1500``.

    Raises
    ------
    OptionError
        It is not two positive numbers.
    """
    try:
        width, height = (float(word) for word in text.lower().replace("×", "x").removesuffix("mm").split("x"))
    except ValueError:
        raise OptionError(f"--sheet-size: '{text}' is not a size such as 3000x1500") from None
    if not (0.0 < width < 1e6 and 0.0 < height < 1e6):
        raise OptionError(f"--sheet-size: '{text}' is out of range")
    return width, height


def route_length(start: Point | None, order: Sequence[CutStart], travel: Any = math.dist) -> float:
    """Return what all the ways from cut to cut cost, by `travel` from point to point."""
    total, here = 0.0, start
    for s in order:
        total += travel(here, s.entry) if here is not None else 0.0
        here = s.exit
    return total
