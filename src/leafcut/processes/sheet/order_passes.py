"""Passes that adjust the order of the cuts after the search.

The search ignores effects between cuts, such as heat, so these passes deal with them afterwards. `PASSES` lists the
passes in sequence. Each pass does a bounded amount of work, stops when the job runs out of time, and returns a valid
order (`CutSequence`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from leafcut.message import Message
from leafcut.model.cutting import CutPlan, PlanFile
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.obstacles import Obstacles
from leafcut.model.plan import Candidate, Order, Stage
from leafcut.model.sheet import Sheet
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import QuoteOptions, SpeedOptions
from leafcut.processes.job import Job
from leafcut.processes.ordering import find_order
from leafcut.processes.plan import Pass, Plan
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.costs import measure_cuts
from leafcut.processes.sheet.plan.cutting import CutSequence, Cutting, HeadTravel, build_problem, sweep_bands
from leafcut.processes.sheet.plan.detached_parts import DetachableParts
from leafcut.processes.sheet.plan.heat import heat_issue, spread_starts
from leafcut.processes.sheet.plan.moved_starts import (
    clear_pierces_of_kerfs,
    slide_starts,
    with_leads_apart,
    without_conflicting_starts,
)
from leafcut.processes.sheet.plan.starts import CutStart
from leafcut.processes.sheet.plan.toolpath import TorchSetup, generate_cuts
from leafcut.timing.toolpath import measure_toolpath, seconds_by_row

#: Limits for the search that keeps leads apart: maximum number of searches, and maximum number of cuts on the sheet.
MAX_SEARCHES, MAX_CUTS_OF_SEARCH = 2, 1000

#: Share of the remaining time that a search to keep leads apart may use. The rest is left for moving starts.
SEARCH_SHARE = 0.9

#: Maximum number of orders whose motion is cached.
MAX_CACHED_MOTIONS = 4


@dataclass(frozen=True, eq=False)
class SheetWork:
    """Data of a sheet that do not depend on the order of its cuts.

    Attributes
    ----------
    drawn
        The sheet before narrow holes and notches were divided. The verification needs it.
    cutting
        All cuts, including chains.
    given
        The cuts in the order of the drawing or of the plan file. It contains no chains except the ones in the plan
        file.
    nearest
        The nearest-neighbour order, without chains.
    planned
        The plan file, if the cuts can follow all its choices.
    order_fixed
        Whether the order from the search must be kept. This is the case if heat matters, or if a plan file is used
        together with bands.
    parts
        The parts that the head may hit because it stays down between cuts; None if the head retracts.
    motions
        Cached motion of recent orders.
    detached
        Cached result of `nearest_order_with_postponed_cuts`.
    """

    drawn: Sheet
    cutting: Cutting
    given: CutSequence
    nearest: CutSequence
    torch: TorchSetup
    head: HeadTravel
    planned: PlanFile | None
    order_fixed: bool
    parts: DetachableParts | None
    obstacles: Obstacles | None
    motions: dict[CutSequence, Candidate] = field(default_factory=dict, init=False, repr=False)
    detached: list[Order] = field(default_factory=list, init=False, repr=False)


# -- changes of an order ---------------------------------------------------------------------------------------------


def slide_all_starts(plan: Plan, order: Order) -> Order:
    """Move the start points along their contours, so that travel gets shorter."""
    cuts = cuts_in_order(plan, order)
    plan.job.report(Message("refining the starts"))
    share = 0.5 if plan.job.settings.of(CutOptions).heat_distance > 0.0 else 1.0
    with plan.job.deadline.for_share(share).running(plan.job.cancelled) as late:
        return _with_cuts(order, slide_starts(cuts, plan.work.head, late))


def avoid_hot_starts(plan: Plan, order: Order) -> Order:
    """Keep starts away from metal that the previous cut has just heated.

    If a cut would start in hot metal, this pass chooses another start point or moves the cut to another position in the
    order.
    """
    cuts, options = cuts_in_order(plan, order), plan.job.settings.of(CutOptions)
    if options.heat_distance <= 0.0:
        return order

    with plan.job.deadline.for_share(1.0).running(plan.job.cancelled) as late:
        groups = sweep_bands(cuts.cutting, options)
        return _with_cuts(order, spread_starts(cuts, options.heat_distance, plan.work.head, groups, late))


def move_pierces_out_of_kerfs(plan: Plan, order: Order) -> Order:
    """Move a start point if its pierce would fall into the kerf of an earlier cut."""
    return _with_cuts(order, clear_pierces_of_kerfs(cuts_in_order(plan, order), plan.work.head))


def keep_leads_apart(plan: Plan, order: Order) -> Order:
    """Resolve conflicts between the leads of different cuts.

    The pass tries two remedies: it moves the start points, and it repeats the search without the start points that
    conflict. It returns the faster of the two orders.
    """
    before, best = cuts_in_order(plan, order).starts, _move_leads_apart(plan, order)
    met = any(a is not b for a, b in zip(before, best.choices[0].starts, strict=True))
    best = prefer_nearest_order(plan, best)
    if not met or len(before) > MAX_CUTS_OF_SEARCH or plan.job.settings.solve.algorithm != "auto":
        return best
    objective, spent = plan.job.settings.solve.objective, sum(s.seconds for s in order.solutions)
    for _ in range(MAX_SEARCHES):
        if plan.job.deadline.left <= 0.0:
            break
        cutting, known = without_conflicting_starts(plan.work.cutting, best.choices[0].starts), best.choices[0].starts
        again = replace(plan, stages=build_stages(plan.job, cutting, plan.work.head, known))
        found = find_order(plan.job, again.stages, deadline=plan.job.deadline.for_share(SEARCH_SHARE))
        spent += sum(s.seconds for s in found.solutions)
        other = Order((sequence_from_choices(plan.job, cutting, found.choices),), found.solutions)
        for improve in (slide_all_starts, avoid_hot_starts, move_pierces_out_of_kerfs, _move_leads_apart):
            other = improve(plan, other)
        if cached_motion(plan, other).cost(objective) >= cached_motion(plan, best).cost(objective):
            break
        best = other
    each = (spent - sum(s.seconds for s in best.solutions)) / max(len(best.solutions), 1)
    return replace(best, solutions=tuple(replace(s, seconds=s.seconds + each) for s in best.solutions))


def _move_leads_apart(plan: Plan, order: Order) -> Order:
    return _with_cuts(order, with_leads_apart(cuts_in_order(plan, order), plan.work.head))


def postpone_detaching_cuts(plan: Plan, order: Order) -> Order:
    """Postpone outlines until the head no longer has to travel over their parts.

    This only matters for a head that stays down between cuts.
    """
    work, cuts = plan.work, cuts_in_order(plan, order)
    if work.parts is None or work.order_fixed or work.planned is not None:
        return order
    cut_plan, routes = cached_motion(plan, order).detail
    if not (routes.crossing or routes.close or routes.corners):
        return order
    from leafcut.processes.sheet.plan.detached_parts import cut_outlines_later

    place_of = {k: at for at, start in enumerate(cuts.starts) for k in start.contours}
    pairs = [(place_of[a], place_of[b]) for a, b in cuts.cutting.contour_precedence if place_of[a] != place_of[b]]
    with plan.job.deadline.for_share(1.0).running(plan.job.cancelled) as late:
        place = cut_outlines_later(work.parts, cut_plan.cuts, pairs, work.head.cost, late)
    # Use all starts of the sheet, even if a second search used fewer.
    moved = CutSequence(work.cutting, tuple(cuts.starts[k] for k in place))
    other = _move_leads_apart(plan, move_pierces_out_of_kerfs(plan, _with_cuts(order, moved)))
    return min(order, other, key=lambda either: _comparison_key(plan, either))


def nearest_order_with_postponed_cuts(plan: Plan) -> Order:
    """Return the nearest-neighbour order after the pass `postpone_detaching_cuts`. The result is cached."""
    known: list[Order] = plan.work.detached
    if not known:
        known.append(postpone_detaching_cuts(plan, Order((plan.work.nearest,))))
    return known[0]


def prefer_nearest_order(plan: Plan, order: Order) -> Order:
    """Return the nearest-neighbour order if it is faster than the given order, otherwise the given order.

    The comparison uses a more detailed time model than the search.
    """
    objective, known = plan.job.settings.solve.objective, Order((plan.work.nearest,))
    if plan.work.order_fixed or not _can_compare_with_nearest(plan):
        return order
    return min(order, known, key=lambda either: cached_motion(plan, either).cost(objective))


def _can_compare_with_nearest(plan: Plan) -> bool:
    work, searches = plan.work, plan.job.settings.solve.algorithm == "auto"
    return searches and work.planned is None and work.nearest.cutting is work.cutting


def choose_fastest_order(plan: Plan, order: Order) -> Order:
    """Return the fastest of several orders, without adding moves across or near detached parts.

    The pass compares the given order with the order of the drawing or of the plan file, and with the nearest-neighbour
    order after `postpone_detaching_cuts`.
    """
    work = plan.work
    if work.order_fixed:
        return order
    known = [Order((work.given,))]
    if work.parts is not None and _can_compare_with_nearest(plan):
        known.append(nearest_order_with_postponed_cuts(plan))
    for other in known:
        (*risks, cost), (*other_risks, other_cost) = _comparison_key(plan, order), _comparison_key(plan, other)
        if other_risks <= risks and other_cost < cost:
            order = other
    return order


def _comparison_key(plan: Plan, order: Order) -> tuple[int, int, float]:
    """Return the key by which orders are compared.

    The key contains the number of moves across detached parts, the number of moves close to detached parts, and the
    cost.
    """
    candidate = cached_motion(plan, order)
    cuts = candidate.detail[0]
    return cuts.crossings or 0, cuts.close, candidate.cost(plan.job.settings.solve.objective)


PASSES: tuple[Pass, ...] = (
    slide_all_starts,
    avoid_hot_starts,
    move_pierces_out_of_kerfs,
    keep_leads_apart,
    postpone_detaching_cuts,
    choose_fastest_order,
)


# -- orders and their motion -----------------------------------------------------------------------------------------


def build_stages(job: Job, cutting: Cutting, head: HeadTravel, known: Sequence[CutStart]) -> tuple[Stage, ...]:
    """Create one stage for each band of the sweep. Each stage starts where the previous band ends.

    `known` is an order of all cuts. Each stage uses its part of this order as the given order.
    """
    groups = sweep_bands(cutting, job.settings.of(CutOptions))
    stages = []
    for number, members in enumerate(groups):
        node_of = {id(s): node for node, s in enumerate(cutting.starts_on(members))}
        given = np.array([node_of[id(s)] for s in known if id(s) in node_of], dtype=np.int32)
        name = Message("ordering the cuts") if len(groups) == 1 else Message("ordering band {}", number + 1)
        problem = build_problem(cutting, members, head, first=number == 0, last=number == len(groups) - 1)
        parts = len({cutting.contours[k].source.part for k in members})
        stages.append(Stage(problem, number > 0, given, name, parts=parts))
    return tuple(stages)


def cuts_in_order(plan: Plan, order: Order) -> CutSequence:
    """Convert an order to a sequence of cuts. The order may come from the search or from a pass."""
    if len(order.choices) == 1 and isinstance(order.choices[0], CutSequence):
        return order.choices[0]
    return sequence_from_choices(plan.job, plan.work.cutting, order.choices)


def sequence_from_choices(job: Job, cutting: Cutting, choices: Sequence[Sequence[int]]) -> CutSequence:
    """Return the cuts of a search result. For each band, `choices` lists the chosen starts in order."""
    groups = sweep_bands(cutting, job.settings.of(CutOptions))
    starts = [
        own[int(node)]
        for members, nodes in zip(groups, choices, strict=True)
        for own in [cutting.starts_on(members)]
        for node in nodes
    ]
    return CutSequence(cutting, tuple(starts))


def _with_cuts(order: Order, cuts: CutSequence) -> Order:
    return replace(order, choices=(cuts,))


def cached_motion(plan: Plan, order: Order) -> Candidate:
    """Return the motion of an order. Recent results are cached.

    The `detail` of the result is a pair of `CutPlan` and `HeadRoutes`. If the head retracts, the routes are None.
    """
    cuts, known = cuts_in_order(plan, order), plan.work.motions
    made: Candidate = known.pop(cuts, None) or _generate_motion(plan, cuts)
    known[cuts] = made
    while len(known) > MAX_CACHED_MOTIONS:
        del known[next(iter(known))]
    return replace(made, order=order)


def _generate_motion(plan: Plan, order: CutSequence) -> Candidate:
    work, machine, settings = plan.work, plan.job.machine, plan.job.settings
    cuts, end = tuple(order.cutting.cut(s) for s in order.starts), work.head.end
    routes = None if work.parts is None else work.parts.routes(cuts, work.head.start, end)
    corners = {} if routes is None else routes.corners
    path, rows = generate_cuts(cuts, work.torch, end=end, corners=corners, obstacles=work.obstacles)
    whole, seconds = measure_toolpath(path, machine), _cut_seconds(path, rows, machine)
    crossings, close = (None, 0) if routes is None else (len(routes.crossing), len(routes.close))
    cut_plan = CutPlan(order.cutting.sheet, work.torch.data, cuts, crossings=crossings, close=close)
    rate, sheets = settings.of(SpeedOptions).shop_rate or 0.0, settings.of(QuoteOptions).quantity
    norm = measure_cuts(cut_plan, seconds, whole.time_s, settings.of(CutOptions), corners, rate, sheets)
    return Candidate(Order((order,)), path, whole, (replace(cut_plan, measures=norm), routes))


def _cut_seconds(path: Toolpath, rows: Sequence[slice], machine: Machine) -> list[tuple[float, float, float]]:
    moving = seconds_by_row(path, machine)
    rapid = path.kind == Kind.RAPID
    finding = path.kind == Kind.PROBE
    waiting = np.where(path.kind == Kind.DWELL, path.value, np.where(finding, moving, 0.0))
    columns = (np.where(rapid | finding, 0.0, moving), waiting, np.where(rapid, moving, 0.0))
    return [(float(columns[0][r].sum()), float(columns[1][r].sum()), float(columns[2][r].sum())) for r in rows]


def order_issues(plan: Plan, best: Candidate) -> list[Issue]:
    """Report starts in hot metal, starts beyond the edge of the sheet, and parts that the head may hit."""
    (cut_plan, routes), apart, issues = best.detail, plan.job.settings.of(CutOptions).heat_distance, list[Issue]()
    if apart > 0.0:
        issues.append(heat_issue(cuts_in_order(plan, best.order).starts, apart))
    # If the torch probed beyond the sheet, it would touch a slat, or nothing.
    torch, beyond = plan.dialect.torch, [c.path.start for c in cut_plan.cuts if c.kind == "cut" and not c.pierce]
    if torch is not None and torch.heights == "controller" and beyond:
        many = Message("1 cut starts") if len(beyond) == 1 else Message("{} cuts start", len(beyond))
        words = Message(
            "{} beyond the sheet's edge, where the controller probes beside the sheet; lay a piece of the same "
            "thickness there, or use --dialect plasma with a profile without [probe]",
            many,
        )
        issues.append(Issue("L619", words, Message("the first at ({:.4g}, {:.4g})", beyond[0][0], beyond[0][1])))
    detached = None if routes is None else routes.crossing_issue(cut_plan.cuts)
    return issues if detached is None else [*issues, detached]
