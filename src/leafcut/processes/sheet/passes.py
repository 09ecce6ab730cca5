"""Changes of an order of cuts for what depends on its neighbours, and the motion of an order.

A search orders cuts as if each were alone. Whether leads meet, a pierce lies in a kerf, metal is hot or a part is
detached depends on the cuts before. `PASSES` lists the changes in their sequence. Each does a bounded
amount of work and ends with the time of the job; the order that it returns cuts every contour once, in precedence
(`CutSequence`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from leafcut.model.cutting import CutPlan
from leafcut.model.issue import Issue
from leafcut.model.plan import Candidate, Order, Stage
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import SpeedOptions
from leafcut.processes.ordering import find_order
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cutting import CutSequence, Cutting, bands, build_problem
from leafcut.processes.sheet.plan.heat import heat_issue, spread_starts
from leafcut.processes.sheet.plan.leads.clear_pierces import clear_pierces
from leafcut.processes.sheet.plan.leads.leads_apart import leads_apart, starts_apart
from leafcut.processes.sheet.plan.leads.refine_starts import slide_starts
from leafcut.timing.travel import travel_cost

if TYPE_CHECKING:
    from leafcut.geometry.arrays import Point
    from leafcut.model.cutting import CutData, PlanFile
    from leafcut.model.machine import Machine, Probe
    from leafcut.model.obstacles import Obstacles
    from leafcut.model.problem import Metric
    from leafcut.model.sheet import Sheet
    from leafcut.processes.job import Job
    from leafcut.processes.plan import Pass, Plan
    from leafcut.processes.sheet.plan.freed_parts import FreedShapes
    from leafcut.processes.sheet.plan.leads.cut_starts import CutStart

#: Maximum number of searches for an order whose leads do not meet, and of cuts for such a search.
ROUNDS, MOST_AGAIN = 2, 1000

#: Share of the time left for the search; sliding and moving the starts have the rest.
SEARCH_SHARE = 0.9

#: Maximum number of orders whose motion is kept for comparisons.
MOST_KEPT = 4

#: Tolerance of corners that the torch rounds to keep speed, mm (G64 P).
PATH_TOLERANCE = 0.1


@dataclass(frozen=True)
class HeadTravel:
    """Moves of the head: cost of rapids, time for each cut to come down and rise, s, first and last place."""

    metric: Metric
    overhead: float
    start: Point | None
    end: Point | None

    def cost(self, a: Point, b: Point) -> float:
        """Return the cost of a rapid."""
        return travel_cost(self.metric, a, b)


@dataclass(frozen=True, eq=False)
class SheetWork:
    """Data of a sheet that all orders of its cuts share.

    Attributes
    ----------
    drawn, sheet
        The sheet before and after holes and notches were divided, for the judge.
    cutting
        The cuts to be ordered, chains included.
    given
        The order of the drawing, without chains, or that of the plan file.
    nearest
        The nearest-neighbour order, without chains.
    data
        Cutting data.
    head
        Cost of its moves.
    planned
        The plan file, if all its choices fit.
    order_fixed
        Whether heat, or bands beside a plan file, forbid to compare with the given order.
    probe
        Finds the sheet before every pierce.
    freed
        Parts that a head may hit that stays down between cuts; None if it rises.
    obstacles
        Keep-out zones: crossed at the clearance height, or avoided by a head that does not rise.
    motions
        The orders whose motion was used last, with it: passes compare them.
    """

    drawn: Sheet
    sheet: Sheet
    cutting: Cutting
    given: CutSequence
    nearest: CutSequence
    data: CutData
    head: HeadTravel
    planned: PlanFile | None
    order_fixed: bool
    probe: Probe | None
    freed: FreedShapes | None
    obstacles: Obstacles | None
    motions: dict[CutSequence, Candidate] = field(default_factory=dict, init=False, repr=False)


# -- changes of an order ---------------------------------------------------------------------------------------------


def slide(plan: Plan, order: Order) -> Order:
    """Slide the starts along their contours to where travel is shortest."""
    work, cuts = plan.work, cuts_of(plan, order)
    if plan.job.settings.solve.algorithm == "none":
        return order
    plan.job.report("refining the starts")
    share = 0.5 if plan.job.settings.of(CutOptions).heat_distance > 0.0 else 1.0
    with plan.job.deadline.part(share).running(plan.job.cancelled) as late:
        starts = slide_starts(cuts.cutting, list(cuts.starts), work.head.cost, work.head.start, work.head.end, late)
    return _changed(order, cuts, starts)


def keep_off_heat(plan: Plan, order: Order) -> Order:
    """Move cuts that start in hot metal to other places, or to other positions in the order."""
    work, cuts, options = plan.work, cuts_of(plan, order), plan.job.settings.of(CutOptions)
    if options.heat_distance <= 0.0 or plan.job.settings.solve.algorithm == "none":
        return order
    with plan.job.deadline.part(1.0).running(plan.job.cancelled) as late:
        groups = bands(cuts.cutting, options)
        starts = spread_starts(
            cuts.cutting, cuts.starts, options.heat_distance, work.head.cost, work.head.start, groups, late
        )
    return _changed(order, cuts, starts)


def pierce_in_metal(plan: Plan, order: Order) -> Order:
    """Move pierces out of the kerfs of earlier cuts."""
    return replace(order, choices=(with_clear_pierces(cuts_of(plan, order), plan.work.head),))


def keep_leads_apart(plan: Plan, order: Order) -> Order:
    """Move starts whose leads meet, or search again without such starts, if that takes less time.

    The nearest-neighbour order is compared before: a search that is no better than it ends the trials.
    """
    before, best = cuts_of(plan, order).starts, _apart(plan, order)
    met = any(a is not b for a, b in zip(before, best.choices[0].starts, strict=True))
    best = keep_nearest(plan, best)
    if not met or len(before) > MOST_AGAIN or plan.job.settings.solve.algorithm != "auto":
        return best
    objective, spent = plan.job.settings.solve.objective, sum(s.seconds for s in order.solutions)
    for _ in range(ROUNDS):
        if plan.job.deadline.left <= 0.0:
            break
        cutting, known = starts_apart(plan.work.cutting, best.choices[0].starts), best.choices[0].starts
        again = replace(plan, stages=stages_of(plan.job, cutting, plan.work.head, known))
        found = find_order(plan.job, again.stages, deadline=plan.job.deadline.part(SEARCH_SHARE))
        spent += sum(s.seconds for s in found.solutions)
        other = Order((sequence_of(plan.job, cutting, found.choices),), found.solutions)
        for improve in (slide, keep_off_heat, pierce_in_metal, _apart):
            other = improve(plan, other)
        if motion(plan, other).cost(objective) >= motion(plan, best).cost(objective):
            break
        best = other
    each = (spent - sum(s.seconds for s in best.solutions)) / max(len(best.solutions), 1)
    return replace(best, solutions=tuple(replace(s, seconds=s.seconds + each) for s in best.solutions))


def _apart(plan: Plan, order: Order) -> Order:
    return replace(order, choices=(with_leads_apart(cuts_of(plan, order), plan.work.head),))


def detach_later(plan: Plan, order: Order) -> Order:
    """Cut outlines after the moves of a head that stays down over their parts.

    The order is changed if fewer moves cross detached parts, then if fewer come close to one, then if it takes less
    time.
    """
    from leafcut.processes.sheet.plan.freed_parts import cut_free_later

    work, cuts, objective = plan.work, cuts_of(plan, order), plan.job.settings.solve.objective
    if work.freed is None or work.order_fixed or work.planned is not None:
        return order
    before = motion(plan, order)
    cut_plan, led = before.detail
    if not (led.crossing or led.close or led.corners):
        return order
    place_of = {k: at for at, start in enumerate(cuts.starts) for k in start.contours}
    pairs = [(place_of[a], place_of[b]) for a, b in cuts.cutting.pairs if place_of[a] != place_of[b]]
    with plan.job.deadline.part(1.0).running(plan.job.cancelled) as late:
        place = cut_free_later(work.freed, cut_plan.cuts, pairs, work.head.cost, lambda: not late())
    # All starts of the sheet may be taken, not those of a second search alone.
    moved = CutSequence(work.cutting, tuple(cuts.starts[k] for k in place))
    other = _apart(plan, pierce_in_metal(plan, replace(order, choices=(moved,))))
    ranks = [(c.detail[0].crossings or 0, c.detail[0].close, c.cost(objective)) for c in (motion(plan, other), before)]
    return other if ranks[0] < ranks[1] else order


def keep_nearest(plan: Plan, order: Order) -> Order:
    """Keep the nearest-neighbour order, if that takes less time: the search does not see all that the clock sees."""
    work, searches = plan.work, plan.job.settings.solve.algorithm == "auto"
    same = searches and work.planned is None and work.nearest.cutting is work.cutting
    return _less(plan, work.nearest, order) if same else order


def keep_given(plan: Plan, order: Order) -> Order:
    """Keep the order of the drawing or of the plan file, if that takes less time."""
    return _less(plan, plan.work.given, order)


def _less(plan: Plan, known: CutSequence, order: Order) -> Order:
    other, objective = Order((known,)), plan.job.settings.solve.objective
    if plan.work.order_fixed or motion(plan, other).cost(objective) >= motion(plan, order).cost(objective):
        return order
    return other


#: The changes of an order, in their sequence.
PASSES: tuple[Pass, ...] = (
    slide,
    keep_off_heat,
    pierce_in_metal,
    keep_leads_apart,
    detach_later,
    keep_given,
)


# -- orders and their motion -----------------------------------------------------------------------------------------


def stages_of(job: Job, cutting: Cutting, head: HeadTravel, known: Sequence[CutStart]) -> tuple[Stage, ...]:
    """Return a stage for each band of the sweep, each from where the last one ends; `known` is an order of the cuts."""
    groups = bands(cutting, job.settings.of(CutOptions))
    stages = []
    for number, members in enumerate(groups):
        end = head.end if number == len(groups) - 1 else None
        node_of = {id(s): node for node, s in enumerate(cutting.starts_of(members))}
        given = np.array([node_of[id(s)] for s in known if id(s) in node_of], dtype=np.int32)
        name = "ordering the cuts" if len(groups) == 1 else f"ordering band {number + 1}"
        problem = build_problem(cutting, members, head.metric, head.overhead, None if number else head.start, end)
        parts = len({cutting.contours[k].source.part for k in members})
        stages.append(Stage(problem, number > 0, given, name, parts=parts))
    return tuple(stages)


def cuts_of(plan: Plan, order: Order) -> CutSequence:
    """Return the cuts of an order of the search, or of one that a pass has changed."""
    if len(order.choices) == 1 and isinstance(order.choices[0], CutSequence):
        return order.choices[0]
    return sequence_of(plan.job, plan.work.cutting, order.choices)


def sequence_of(job: Job, cutting: Cutting, choices: Sequence[Sequence[int]]) -> CutSequence:
    """Return the cuts that a search has chosen, as choices of each band."""
    groups = bands(cutting, job.settings.of(CutOptions))
    starts = [
        own[int(node)]
        for members, nodes in zip(groups, choices, strict=True)
        for own in [cutting.starts_of(members)]
        for node in nodes
    ]
    return CutSequence(cutting, tuple(starts))


def with_clear_pierces(cuts: CutSequence, head: HeadTravel) -> CutSequence:
    """Return the cuts with pierces out of the kerfs of earlier cuts."""
    starts = clear_pierces(cuts.cutting, cuts.starts, head.cost, head.start, head.end)
    return CutSequence(cuts.cutting, tuple(starts))


def with_leads_apart(cuts: CutSequence, head: HeadTravel) -> CutSequence:
    """Return the cuts with leads that do not meet."""
    starts = leads_apart(cuts.cutting, cuts.starts, head.cost, head.start, head.end)
    return CutSequence(cuts.cutting, tuple(starts))


def _changed(order: Order, cuts: CutSequence, starts: Sequence[CutStart]) -> Order:
    return replace(order, choices=(CutSequence(cuts.cutting, tuple(starts)),))


def motion(plan: Plan, order: Order) -> Candidate:
    """Return the motion of an order that a pass has changed, with (`CutPlan`, routes of a head that stays down)."""
    cuts, known = cuts_of(plan, order), plan.work.motions
    made: Candidate = known.pop(cuts, None) or _generated(plan, cuts)
    known[cuts] = made
    while len(known) > MOST_KEPT:
        del known[next(iter(known))]
    return replace(made, order=order)


def _generated(plan: Plan, order: CutSequence) -> Candidate:
    from leafcut.processes.sheet.plan.cost_estimate import cut_norm
    from leafcut.processes.sheet.plan.cut_toolpath import TORCH_ON, lay_cuts
    from leafcut.processes.sheet.plan.freed_parts import lead_round
    from leafcut.timing.toolpath import measure

    work, machine, settings, torch = plan.work, plan.job.machine, plan.job.settings, plan.dialect.torch
    cuts = tuple(order.cutting.cut(s) for s in order.starts)
    led = None if work.freed is None else lead_round(work.freed, cuts, work.head.start, work.head.end)
    corners = {} if led is None else led.corners
    path, rows = lay_cuts(
        cuts,
        work.data,
        machine,
        clearance=settings.job.clearance_height,
        end=work.head.end,
        switches=torch is not None and torch.darkens,
        power=settings.post.beam_power if torch is not None and torch.power else TORCH_ON,
        mark_power=settings.post.mark_power if torch is not None and torch.power else TORCH_ON,
        tolerance=PATH_TOLERANCE if torch is not None else 0.0,
        probe=work.probe,
        moves_z=plan.dialect.moves_z,
        mark_tool=torch.mark_tool if torch is not None else None,
        corners=corners,
        obstacles=work.obstacles,
    )
    whole = measure(path, machine)
    sheet, seconds = order.cutting.sheet, _cut_seconds(path, rows, machine)
    options, rate = settings.of(CutOptions), settings.of(SpeedOptions).shop_rate or 0.0
    norm = cut_norm(sheet, cuts, seconds, whole.time_s, options, work.data, corners, rate)
    crossings, close = (None, 0) if led is None else (len(led.crossing), len(led.close))
    cut_plan = CutPlan(sheet, work.data, cuts, norm, crossings, close)
    return Candidate(Order((order,)), path, whole, (cut_plan, led))


def _cut_seconds(path: Toolpath, rows: Sequence[slice], machine: Machine) -> list[tuple[float, float, float]]:
    """Return the seconds of every cut: cutting, piercing, rapids."""
    from leafcut.timing.toolpath import seconds_by_row

    moving = seconds_by_row(path, machine)
    rapid = path.kind == Kind.RAPID
    finding = path.kind == Kind.PROBE
    waiting = np.where(path.kind == Kind.DWELL, path.value, np.where(finding, moving, 0.0))
    columns = (np.where(rapid | finding, 0.0, moving), waiting, np.where(rapid, moving, 0.0))
    return [(float(columns[0][r].sum()), float(columns[1][r].sum()), float(columns[2][r].sum())) for r in rows]


def order_issues(plan: Plan, best: Candidate) -> list[Issue]:
    """Return what is noticed of heat, of starts in the air, and of parts that a head may hit."""
    from leafcut.processes.sheet.plan.freed_parts import freed_issue

    (cut_plan, led), apart, issues = best.detail, plan.job.settings.of(CutOptions).heat_distance, list[Issue]()
    cuts = cuts_of(plan, best.order)
    if apart > 0.0:
        issues.append(heat_issue(cuts.cutting, cuts.starts, apart))
    # A controller that probes before each cut would find a slat beside the sheet, or nothing.
    torch, beyond = plan.dialect.torch, [c.path.start for c in cut_plan.cuts if c.kind == "cut" and not c.pierce]
    if torch is not None and torch.heights == "controller" and beyond:
        many = "1 cut starts" if len(beyond) == 1 else f"{len(beyond)} cuts start"
        words = (
            f"{many} beyond the sheet's edge, where the controller probes beside the sheet: lay a piece of the same "
            "thickness there, or give --dialect plasma --probe off"
        )
        issues.append(Issue("L619", words, f"the first at ({beyond[0][0]:.4g}, {beyond[0][1]:.4g})"))
    freed = None if led is None else freed_issue(led, cut_plan.cuts)
    return issues if freed is None else [*issues, freed]
