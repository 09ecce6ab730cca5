"""Orders of the cuts of a sheet: by search, from a plan file, and by nearest neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import PlanError
from leafcut.model.solution import Solution
from leafcut.options import AcoOptions, SolveOptions
from leafcut.options.search import ANTS_AS_PARTS
from leafcut.processes.deadline import Deadline
from leafcut.processes.sheet.job import SheetJob
from leafcut.processes.sheet.options import CutOptions

if TYPE_CHECKING:
    from leafcut.processes.sheet.plan.cutting import Cutting
    from leafcut.processes.sheet.plan.leads.cut_starts import CutStart

#: Part of the time left that the search for the order gets; the rest is for sliding and spreading the starts.
ORDER_PART = 0.9


def as_planned(job: SheetJob) -> tuple[SheetJob, list[CutStart]] | None:
    """Return the order and all choices of the plan file; None without a plan file, or if they no longer fit."""
    from leafcut.processes.sheet.plan.apply_plan_file import follow_plan, plan_order
    from leafcut.processes.sheet.plan.chains.chain_cutting import planned_chains, with_chains

    if job.plan is None:
        return None
    try:
        cutting = follow_plan(job.cutting, job.plan, everything=True)
        cutting = with_chains(cutting, planned_chains(cutting, job.plan, everything=True))
        return replace(job, cutting=cutting), plan_order(cutting, job.plan)
    except PlanError:
        return None


def ordered(job: SheetJob, before: list[CutStart] | None) -> tuple[list[CutStart], list[Solution]]:
    """Return the best order found, with its starts moved to their best places, and the solutions it came from.

    `before` is a known order; None means the order of the drawing.
    """
    from leafcut.processes.sheet.plan.cutting import bands, drawing_order, in_bands
    from leafcut.processes.sheet.plan.heat import spread_starts
    from leafcut.processes.sheet.plan.leads.clear_pierces import clear_pierces
    from leafcut.processes.sheet.plan.leads.refine_starts import slide_starts

    run, options = job.run, job.run.settings
    rules = options.of(CutOptions)
    before = in_bands(job.cutting, drawing_order(job.cutting), rules) if before is None else before
    if options.job.keep_order:
        return before, []
    order, solutions = _solve_bands(job, options.solve, before)
    travel = job.travel()
    if options.solve.algorithm == "none":
        return clear_pierces(job.cutting, order, travel, job.start, job.end), solutions
    run.tell("refining the starts")
    spreads = rules.heat_distance > 0.0
    with run.deadline.part(0.5 if spreads else 1.0).running(run.cancelled) as late:
        order = slide_starts(job.cutting, order, travel, job.start, job.end, late)
    if spreads:
        with run.deadline.part(1.0).running(run.cancelled) as late:
            order = spread_starts(
                job.cutting, order, rules.heat_distance, travel, job.start, bands(job.cutting, rules), late
            )
    return clear_pierces(job.cutting, order, travel, job.start, job.end), solutions


def nearest_order(job: SheetJob) -> list[CutStart]:
    """Return the nearest-neighbour order."""
    from leafcut.processes.sheet.plan.leads.clear_pierces import clear_pierces

    quiet = replace(job, run=job.run.quiet())
    order = _solve_bands(quiet, SolveOptions(algorithm="nn", bound=False, threads=1), None)[0]
    return clear_pierces(job.cutting, order, job.travel(), job.start, job.end)


def _solve_bands(
    job: SheetJob, options: SolveOptions, before: list[CutStart] | None
) -> tuple[list[CutStart], list[Solution]]:
    """Order the bands one after the other; each starts where the last one ends."""
    from leafcut.order.solve import keep_better, solve
    from leafcut.processes.sheet.plan.cutting import bands, build_problem

    cutting, run = job.cutting, job.run
    groups = bands(cutting, run.settings.of(CutOptions))
    total = left = sum(map(len, groups))
    deadline = run.deadline.part(ORDER_PART) if options.algorithm != "nn" else Deadline()
    place, solutions = job.start, list[Solution]()
    order: list[CutStart] = []
    for number, members in enumerate(groups, 1):
        end = job.end if number == len(groups) else None
        problem, starts = build_problem(cutting, members, job.metric, job.overhead, place, end)
        name = "ordering the cuts" if len(groups) == 1 else f"ordering band {number}"
        tell = run.passing_on(name, left / total, len(members) / total)
        budget = replace(options, time_limit=deadline.part(len(members) / left).seconds)
        aco = _ants(run.settings.aco, cutting, members)
        found = solve(
            problem, budget, aco, firefly=run.settings.firefly, progress=tell, observe=run.observe,
            cancelled=run.cancelled, bound_late=run.bound_late(len(members) / total),
        )  # fmt: skip
        deadline.spend(found.seconds)
        if before is not None and options.algorithm != "nn":
            node_of = {int(n): k for k, n in enumerate(starts)}
            position = {id(s): n for n, s in enumerate(cutting.starts)}
            inside = set(members)
            nodes = [node_of[position[id(s)]] for s in before if s.contour in inside]
            found = keep_better(problem, found, np.array(nodes, dtype=np.int32))
        solutions.append(found)
        order += [cutting.starts[int(starts[node])] for node in found.nodes]
        left -= len(members)
        place = order[-1].exit
    check_precedence(cutting, order)
    return order, solutions


def _ants(options: AcoOptions, cutting: Cutting, members: Sequence[int]) -> AcoOptions:
    """Return the options with one ant for each part among the contours `members`, if they ask for that."""
    if options.n_ants != ANTS_AS_PARTS:
        return options
    return replace(options, n_ants=max(1, len({cutting.contours[k].source.part for k in members})))


def check_precedence(cutting: Cutting, order: Sequence[CutStart]) -> None:
    """Refuse an order that frees a part before the contours inside it are cut; no later check would see it."""
    cut = [k for s in order for k in s.contours]
    at = {k: place for place, k in enumerate(cut)}
    if len(at) != len(cutting.contours) or len(cut) != len(at):
        raise PlanError("the order does not cut every contour once; this is a fault of the algorithm, choose another")
    for a, b in cutting.pairs:
        if at[a] > at[b]:
            raise PlanError(
                f"{cutting.contours[b].name()} would be cut before {cutting.contours[a].name()}; remove 'order' from "
                "the plan file, or leave out --sweep"
            )
