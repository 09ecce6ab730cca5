"""Choose a strategy for each pocket: the strategy with the fewest retracts among those within 5 % of the lowest
cost.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError, SolveError
from leafcut.geometry.arrays import Floats, Points
from leafcut.geometry.regions import as_polyline
from leafcut.material.engagement import Engaged
from leafcut.material.removal import engaged_tool_path, entry_mask, measure_removal, min_reported_width
from leafcut.material.step_over import measure_widest_step_overs
from leafcut.material.tool_steps import ToolSteps
from leafcut.message import Message
from leafcut.model.heartbeat import Trial
from leafcut.model.issue import Issue
from leafcut.model.pocket import (
    UNCOVERED,
    USUAL,
    Pocket,
    PocketLevels,
    PocketMeasures,
    PocketPath,
    PocketPiece,
    PocketPlan,
    PocketProgram,
    PocketResult,
    PocketRules,
)
from leafcut.model.problem import RoutingProblem
from leafcut.processes.pocket.feeds import MIN_LENGTH, divide_section, with_load_dependent_feeds
from leafcut.processes.pocket.job import PocketJob, PocketMotion, raise_path
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.arcs import fit_arcs_to_path
from leafcut.processes.pocket.plan.region import CentreRegion, centre_regions
from leafcut.processes.pocket.plan.toolpath import Clearing, pocket_motion
from leafcut.processes.pocket.plan.walls import wall_passes
from leafcut.processes.pocket.strategies import STRATEGIES, ClearingStrategy, SearchTime
from leafcut.timing.toolpath import measure_toolpath
from leafcut.timing.travel import travel_metric
from leafcut.units import format_time

#: Maximum cost of a strategy relative to the lowest cost. Among the strategies below this limit, the program uses the
#: strategy with the fewest retracts, because each plunge wears the tool and marks the floor.
NEARLY = 1.05
#: Minimum length of an air cut, in tool diameters. A shorter air cut would hardly save time.
MIN_AIR_CUT = 0.5
#: Distance from the material at which the air feed starts and ends, in tool diameters (one step of the measurement).
MARGIN = 0.05


@dataclass(frozen=True, eq=False)
class ClearedPocket:
    """A pocket, cleared with every strategy.

    `clearings` contains the cleared regions for each strategy that succeeded. `even` contains the same regions, but
    with a constant feed. Both are equal unless feeds depend on the load.
    """

    plan: PocketPlan
    clearings: dict[str, list[Clearing]]
    even: dict[str, list[Clearing]]

    @property
    def usual_clearings(self) -> list[Clearing]:
        """The regions of the pocket, cleared with the strategy that most shops use."""
        return self.clearings[self.plan.usual.strategy]


@dataclass(frozen=True, eq=False)
class PocketWork:
    """All pockets of a job, each cleared with every strategy."""

    job: PocketJob
    cleared: tuple[ClearedPocket, ...]

    @property
    def chosen_clearings(self) -> list[Clearing]:
        """The regions of all pockets, cleared with the chosen strategy of each pocket."""
        return [clearing for pocket in self.cleared for clearing in pocket.clearings[pocket.plan.result.strategy]]


def clear_pocket(
    job: PocketJob, pocket: Pocket, number: int, time: SearchTime, names: Collection[str] = ()
) -> tuple[ClearedPocket, list[Issue]]:
    """Clear a pocket with the requested strategy, or try all strategies and choose the best result.

    Parameters
    ----------
    number
        Index of the pocket in the job.
    time
        Divides the time limit among the searches.
    names
        Strategies to try. By default, all strategies are allowed.

    Returns
    -------
    pocket
        The cleared pocket.
    issues
        Issues about areas that the tool cannot reach.
    """
    regions, issues = centre_regions(pocket, job.finish_rules)
    roughed = centre_regions(pocket, job.rules)[0] if job.rules.stock > 0.0 else regions
    results_of: dict[str, PocketResult] = {}
    clearings: dict[str, list[Clearing]] = {}
    even: dict[str, list[Clearing]] = {}
    asked = job.run.settings.of(PocketOptions).strategy
    allowed = names or [strategy.name for strategy in STRATEGIES]
    strategies = [strategy for strategy in STRATEGIES if asked in ("best", strategy.name) and strategy.name in allowed]
    each = len(regions) * (len(job.part.pockets) - number)
    time.to_come = each * sum(strategy.searches for strategy in strategies)
    for rank, strategy in enumerate(sorted(strategies, key=lambda strategy: strategy.searches)):
        pocket_name = [Message("pocket {}", number + 1)] if len(job.part.pockets) > 1 else []
        words = Message.joined(": ", [*pocket_name, strategy.name])
        share = (number + rank / len(strategies)) / len(job.part.pockets)
        job.run.report(words, share, Trial(words))
        result, steady, fitted = _try_strategy(job, number, strategy, regions, roughed, time)
        results_of[strategy.name] = result
        known = result.measures is not None
        figure = format_time(result.program_s) if known else "–"
        job.run.report(words, share, Trial(words, figure, result.program_s if known else None))
        if steady:
            clearings[strategy.name], even[strategy.name] = fitted, steady
    results = [results_of[strategy.name] for strategy in strategies]
    chosen, levels = _choose_strategy(job, pocket, results), job.levels[number]
    in_floor = job.around[number] is not None
    results = add_rejection_reasons(job, results, results[chosen])
    plan = PocketPlan(pocket, job.rules, levels.levels, tuple(results), chosen, levels.begin, in_floor)
    return ClearedPocket(plan, clearings, even), issues


def _try_strategy(
    job: PocketJob,
    number: int,
    strategy: ClearingStrategy,
    regions: list[CentreRegion],
    roughed: list[CentreRegion],
    time: SearchTime,
) -> tuple[PocketResult, list[Clearing], list[Clearing]]:
    """Try a strategy on all regions of a pocket.

    Returns
    -------
    result
        The result of the strategy.
    even, varied
        The cleared regions with a constant feed and with load-dependent feeds. Both lists are empty if the strategy is
        refused.
    """
    if job.run.cancelled.is_set() and strategy.name not in (*USUAL, job.run.settings.of(PocketOptions).strategy):
        return PocketResult(strategy.name, refused=Message("it was not tried before the search was stopped")), [], []
    try:
        clearings = [_clear_region(job, job.levels[number], strategy, region, roughed, time) for region in regions]
    except (PlanError, SolveError) as problem:
        return PocketResult(strategy.name, refused=str(problem)), [], []
    path = PocketPath(strategy.name, tuple(piece for c in clearings for piece in c.path.pieces))
    steps, engaged = engaged_tool_path(path, job.finish_rules)
    measures = measure_path(job.part.pockets[number], path, job.finish_rules, (steps, engaged))
    if job.data.air_feed > job.data.tool.feed:
        divided = iter(divide_at_air_cuts(path.pieces, steps, engaged, job.finish_rules))
        clearings = [_with_divided_pieces(clearing, divided) for clearing in clearings]
    fitted, time_s = _with_fastest_feeds(job, clearings)
    return PocketResult(strategy.name, path, measures, program_s=time_s), clearings, fitted


def _with_fastest_feeds(job: PocketJob, clearings: list[Clearing]) -> tuple[list[Clearing], float]:
    """Return the cleared regions with load-dependent feeds, if these are requested, and the machine time, s.

    Some machines stop after every move, so dividing a move can cost time. This function therefore compares three
    variants: feeds change anywhere, only between moves, or never. Cuts that exceed the spindle power are always slowed
    down.
    """
    even = (clearings, clearing_motion(job, clearings).measure.time_s)
    if job.limits is None:
        return even
    acceleration = min(job.run.machine.acceleration[:2]) * job.run.machine.acceleration_factor
    tried = []
    for anywhere in (True, False):
        divided = [
            # Measure each region separately, because the order of the regions is not known yet.
            _with_divided_pieces(
                c,
                iter(
                    with_load_dependent_feeds(
                        c.path.pieces, job.limits, job.finish_rules, acceleration, anywhere=anywhere
                    )
                ),
            )
            for c in clearings
        ]
        tried.append((divided, clearing_motion(job, divided).measure.time_s))
    slower = any(piece.feed < 1.0 for divided, _ in tried for c in divided for piece in c.path.pieces)
    return min(tried if slower else [even, *tried], key=lambda one: one[1])


def _slot_path(strategy: str, middle: Points) -> PocketPath:
    return PocketPath(strategy, (PocketPiece(as_polyline(middle)),))


def _with_divided_pieces(clearing: Clearing, divided: Iterator[list[PocketPiece]]) -> Clearing:
    rough, walls = (
        None if path is None else replace(path, pieces=tuple(p for _ in path.pieces for p in next(divided)))
        for path in (clearing.rough, clearing.walls)
    )
    return replace(clearing, rough=rough or clearing.rough, walls=walls)


def _clear_region(
    job: PocketJob,
    levels: PocketLevels,
    strategy: ClearingStrategy,
    region: CentreRegion,
    roughed: list[CentreRegion],
    time: SearchTime,
) -> Clearing:
    tolerance = job.rules.tolerance
    if region.slot_centre_line is not None:
        # In a slot as wide as the tool, there is only one possible path.
        along = _slot_path(strategy.name, region.slot_centre_line)
        return Clearing(region, region.polygon, fit_arcs_to_path(along, tolerance), levels)
    inside = [r for r in roughed if region.polygon.intersects(r.polygon)] if job.rules.stock > 0.0 else []
    if not inside:
        # A region too narrow to leave stock is cleared up to the wall.
        return Clearing(
            region, region.polygon, fit_arcs_to_path(time.plan_path(strategy, region, job.run), tolerance), levels
        )
    rough = [fit_arcs_to_path(time.plan_path(strategy, r, job.run), tolerance) for r in inside]
    allowed = shapely.union_all([r.polygon for r in inside])
    whole = PocketPath(strategy.name, tuple(piece for path in rough for piece in path.pieces))
    return Clearing(region, allowed, whole, levels, fit_arcs_to_path(wall_passes(region, allowed), tolerance))


def _choose_strategy(job: PocketJob, pocket: Pocket, results: list[PocketResult]) -> int:
    """Return the index of the requested strategy, or of the best strategy that clears the whole pocket.

    Raises
    ------
    PlanError
        The requested strategy was refused or exceeds a limit, or every strategy gouges or exceeds a limit.
    """
    options = job.run.settings.of(PocketOptions)
    name = pocket.label
    if options.strategy != "best":
        requested = {r.strategy: (k, r) for k, r in enumerate(results)}.get(options.strategy)
        if requested is None or requested[1].path is None:
            why = Message("leafcut has no such strategy") if requested is None else requested[1].refused
            raise PlanError("{}: --strategy {} is not possible: {}", name, options.strategy, why)
        if requested[1].measures is not None and (
            more := _limit_error(job, requested[1].strategy, requested[1].measures)
        ):
            raise PlanError("{}: {} {}", name, requested[1].strategy, more)
        return requested[0]
    known = [(k, r, r.measures) for k, r in enumerate(results) if r.measures is not None]
    sound = [row for row in known if not row[2].gouge_mm2 and not _limit_error(job, row[1].strategy, row[2])]
    if not sound:
        wrong = {k: _limit_error(job, r.strategy, m) or Message("gouges") for k, r, m in known}
        reasons = (Message("{}: {}", r.strategy, r.refused or wrong[k]) for k, r in enumerate(results))
        raise PlanError("{}: no strategy is possible ({})", name, Message.joined("; ", reasons))
    whole = [row for row in sound if row[2].uncovered_percent <= UNCOVERED]
    if not whole:
        return min(sound, key=lambda row: row[2].uncovered_percent)[0]
    costs = [_result_cost(job, row[1], row[2]) for row in whole]
    near = [
        (row[2].retracts, cost, row[0]) for row, cost in zip(whole, costs, strict=True) if cost <= NEARLY * min(costs)
    ]
    return min(near)[2]


def _result_cost(job: PocketJob, result: PocketResult, measures: PocketMeasures) -> float:
    """Return the cost of a result. Depending on the objective, this is the program time, s, or the path length, mm.

    The path length refers to a single level.
    """
    timed = job.run.settings.solve.objective == "time"
    return result.program_s if timed else measures.feed_mm + measures.rapid_mm


def add_rejection_reasons(job: PocketJob, results: list[PocketResult], written: PocketResult) -> list[PocketResult]:
    """Explain in each result that is cheaper than the `written` result why it was rejected. Return all results."""
    best = written.measures
    if best is None:
        return results
    cost = _result_cost(job, written, best)
    reasoned = []
    for result in results:
        reason, m = "", result.measures
        if m is not None and result is not written and _result_cost(job, result, m) < cost:
            reason = _exceeded_limit_text(job, result.strategy, m)
            if m.gouge_mm2:
                reason = Message("gouges {:.3g} mm² of the walls", m.gouge_mm2)
            elif not reason and m.uncovered_percent > UNCOVERED:
                reason = Message("leaves {:.3g} % uncut", m.uncovered_percent)
            elif not reason:
                reason = Message("costs at most {:.0f} % less, with more retracts", 100.0 * (NEARLY - 1.0))
        reasoned.append(replace(result, passed_over=reason))
    return reasoned


def _exceeded_limit_text(job: PocketJob, strategy: str, measures: PocketMeasures) -> str:
    """Return a message if the step-over or the engagement exceeds its limit, otherwise ""."""
    rules, limit = job.finish_rules, job.finish_rules.max_engagement
    if not rules.allows_step_over(measures.max_step_over):
        return Message(
            "has passes {:.2f} mm apart, more than the step-over of {:.4g} mm", measures.max_step_over, rules.step_over
        )
    if limit is None or measures.max_engagement <= limit:
        return ""
    return Message(
        "engages {:.0f}° with the stock on its walls, more than --max-engagement {:.0f}°"
        if strategy == "adaptive" and job.rules.stock > 0.0
        else "engages {:.0f}°, more than --max-engagement {:.0f}°",
        math.degrees(measures.max_engagement),
        math.degrees(limit),
    )


def _limit_error(job: PocketJob, strategy: str, measures: PocketMeasures) -> str:
    """Return an error message with advice if the step-over or the engagement exceeds its limit, otherwise ""."""
    excess = _exceeded_limit_text(job, strategy, measures)
    if not excess:
        return ""
    if not job.finish_rules.allows_step_over(measures.max_step_over):
        return Message("{}; choose another --strategy, or a larger --step-over", excess)
    if strategy != "adaptive":
        remedy = Message("use --strategy adaptive")
    elif job.rules.stock > 0.0:
        remedy = Message("leave out --stock")
    else:
        remedy = Message("choose a smaller --tool-diameter")
    return Message("{}; {}, or give a larger limit", excess, remedy)


def order_problem(job: PocketJob, pockets: list[list[Clearing]]) -> RoutingProblem:
    """Create the routing problem that finds the best order of all regions."""
    clearings = [c for regions in pockets for c in regions]
    return RoutingProblem(
        entry=np.array([c.start for c in clearings]),
        exit=np.array([c.end for c in clearings]),
        cluster=np.arange(len(clearings), dtype=np.int32),
        service=np.zeros(len(clearings)),
        precedence=_precedence(job, pockets),
        metric=travel_metric(job.run.machine, job.run.settings.solve.objective),
        start=job.start,
        end=job.heights.end,
    )


def _precedence(job: PocketJob, pockets: list[list[Clearing]]) -> NDArray[np.int32]:
    """Return pairs of regions (earlier, later), int32[n, 2].

    A pocket must be cleared before the pockets in its floor.
    """
    last = np.cumsum([len(regions) for regions in pockets])
    rows = [list(range(end - len(regions), end)) for regions, end in zip(pockets, last.tolist(), strict=True)]
    pairs = [
        (first, then)
        for number, over in enumerate(job.around)
        if over is not None
        for first in rows[over]
        for then in rows[number]
    ]
    return np.array(pairs, dtype=np.int32).reshape(-1, 2)


def clearing_motion(job: PocketJob, clearings: list[Clearing]) -> PocketMotion:
    """Generate the motion that clears the regions in the given order, and compute its time."""
    machine = job.run.machine
    pause = job.dialect.hand_change_pause and not machine.tool_changer
    coolant = job.run.settings.post.coolant
    corner = job.rules.tolerance if job.dialect.corner_tolerance else 0.0
    path, descents = pocket_motion(
        clearings,
        job.heights,
        job.data,
        machine,
        coolant=coolant,
        pause=pause,
        corner_tolerance=corner,
        rounded=job.dialect.rounding and job.max_corner_rounding <= job.rules.stock,
    )
    path = raise_path(path, job.top)
    return PocketMotion(path, descents, measure_toolpath(path, machine, start=job.start))


def strategy_programs(job: PocketJob, cleared: list[ClearedPocket], nodes: Sequence[int]) -> tuple[PocketProgram, ...]:
    """Compare the written program with one program for each strategy. Return the time and the rapids of each program.

    The written program has the name "". All programs clear the regions in the order `nodes`. Strategies that cannot
    clear every pocket are skipped. With a single pocket, the result is empty.
    """
    if len(cleared) < 2:
        return ()
    names = [name for name in cleared[0].clearings if all(name in c.clearings for c in cleared)]
    chosen = {"": [c.plan.result.strategy for c in cleared], **{name: [name] * len(cleared) for name in names}}
    programs = []
    for name, strategies in chosen.items():
        regions = [
            clearing for c, strategy in zip(cleared, strategies, strict=True) for clearing in c.clearings[strategy]
        ]
        order = [regions[node] for node in nodes]
        path = PocketPath(name, tuple(piece for clearing in order for piece in clearing.path.pieces))
        programs.append(PocketProgram(name, clearing_motion(job, order).measure.time_s, path.rapid_mm, path.retracts))
    return tuple(programs)


# -- air cuts --------------------------------------------------------------------------------------------------------


def divide_at_air_cuts(
    pieces: Sequence[PocketPiece], path: ToolSteps, engaged: Engaged, rules: PocketRules
) -> list[list[PocketPiece]]:
    """Divide the path wherever the tool enters or leaves material. Sections in air get the kind ``air``.

    Finishing sections and entries are not divided. The divided path is measured again, because the first measurement
    may miss a sliver between two samples, and the verification samples the program at different points.

    Parameters
    ----------
    pieces
        The sections of the path.
    path, engaged
        The sampled path, and the engagement at each sample.
    """
    stations, free = np.cumsum(path.step), _air_cuts(path, engaged, rules)
    rows = np.arange(len(pieces))
    ends = stations[np.searchsorted(path.piece, rows, side="right") - 1]
    starts = np.concatenate([[0.0], ends[:-1]])
    result = []
    for piece, start, end in zip(pieces, starts.tolist(), ends.tolist(), strict=True):
        if piece.kind not in ("rough", "link") or end - start <= MIN_LENGTH:
            result.append([piece])
            continue
        near = free[(free[:, 1] > start) & (free[:, 0] < end)]
        share = piece.path.length / (end - start)  # because arcs are longer than their sampled chords
        result.append(_divide_section(piece, (np.clip(near, start, end) - start) * share))
    return _without_false_air_cuts(pieces, result, rules)


def _without_false_air_cuts(
    pieces: Sequence[PocketPiece], divided: list[list[PocketPiece]], rules: PocketRules
) -> list[list[PocketPiece]]:
    parts = [part for pieces_of in divided for part in pieces_of]
    if all(part.kind != "air" for part in parts):
        return divided
    path, engaged = engaged_tool_path(PocketPath("", tuple(parts)), rules)
    cutting = set(np.unique(path.piece[engaged.angle > 0.0]).tolist())
    number = count()
    return [
        [
            PocketPiece(part.path, piece.kind) if next(number) in cutting and part.kind == "air" else part
            for part in pieces_of
        ]
        for piece, pieces_of in zip(pieces, divided, strict=True)
    ]


def _air_cuts(path: ToolSteps, engaged: Engaged, rules: PocketRules) -> Floats:
    """Find the air cuts along a path. Return the distances at which they start and end, float64[n, 2], mm."""
    stations = np.cumsum(path.step)
    # A step is in air if both its ends are in air and the tool is not lifted between them.
    step = (engaged.angle == 0.0) & np.isfinite(path.back[:, 0])
    step[1:] &= (engaged.angle[:-1] == 0.0) | (path.step[1:] == 0.0)
    edge = np.flatnonzero(np.diff(np.concatenate([[False], step, [False]]).astype(np.int8)))
    first, last = edge[0::2], edge[1::2] - 1
    margin = MARGIN * rules.tool_diameter
    free = np.column_stack([stations[first] - path.step[first] + margin, stations[last] - margin])
    long: Floats = free[free[:, 1] - free[:, 0] >= MIN_AIR_CUT * rules.tool_diameter]
    return long


def _divide_section(piece: PocketPiece, free: Floats) -> list[PocketPiece]:
    """Divide a section at its air cuts.

    `free` contains the distances from the start of the section at which air cuts start and end, float64[n, 2], mm.
    """
    parts, at = [], 0.0
    for start, end in free.tolist():
        parts += [(at, piece.kind, 1.0), (start, "air", 1.0)]
        at = end
    return divide_section(piece, [*parts, (at, piece.kind, 1.0)])


def measure_path(
    pocket: Pocket, path: PocketPath, rules: PocketRules, engaged: tuple[ToolSteps, Engaged] | None = None
) -> PocketMeasures:
    """Measure a path on one level of a pocket.

    Feed moves without engagement count as air cuts. The first cut into solid material has an engagement of 180°. Entry
    loops are not included in the engagement, the air cuts or the step-over, because the tool clears them while it
    descends. `engaged` is the result of `engaged_tool_path`, if it is already known.

    Raises
    ------
    PlanError
        The outline and the islands of the pocket cross themselves or touch.
    """
    removed = measure_removal(pocket, path, rules)
    samples, (angle, width, _) = engaged_tool_path(path, rules) if engaged is None else engaged
    entry = entry_mask(path, samples)
    step = np.where(entry, 0.0, samples.step)
    length = float(step.sum())
    opened = [shapely.Polygon(piece.path.flattened()) for piece in path.pieces if piece.kind == "entry"]
    gaps = measure_widest_step_overs(samples, removed.centres.difference(shapely.union_all(opened)), rules, ~entry)
    return PocketMeasures(
        feed_mm=path.feed_mm,
        rapid_mm=path.rapid_mm,
        retracts=path.retracts,
        finish_mm=path.finish_mm,
        gouge_mm2=float(removed.gouges.area),
        reachable_mm2=float(removed.reachable.area),
        uncovered_mm2=float(removed.uncovered.area),
        max_step_over=gaps.step_over,
        max_core=gaps.core,
        max_engagement=float(angle.max(initial=0.0)),
        mean_engagement=float(angle @ step) / length if length > 0.0 else 0.0,
        max_width=float(width.max(initial=0.0)),
        wide_mm=float(step[width > min_reported_width(rules)].sum()),
        air_mm=float(step[angle == 0.0].sum()),
        floor_mm=float(removed.centres.area) / rules.step_over,
    )
