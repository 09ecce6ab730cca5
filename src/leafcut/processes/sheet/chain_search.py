"""Search for chains of a sheet: cuts that bridges join."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.processes.sheet.job import SheetJob
from leafcut.processes.sheet.options import CutOptions

if TYPE_CHECKING:
    from leafcut.processes.deadline import Deadline
    from leafcut.processes.sheet.plan.chains.chain_starts import Chain
    from leafcut.processes.sheet.plan.cutting import Cutting

#: Part of the time limit for chains; the rest is for the order of all cuts.
SHARE = 0.4


def chained(job: SheetJob) -> tuple[Cutting, float]:
    """Return the cutting with chains where they save time, and the seconds of the search.

    Bridges that a plan file fixes are kept; with ``keep_order`` all its bridges are.

    Raises
    ------
    PlanError
        A bridge of the plan file cannot be made.
    """
    from leafcut.processes.sheet.plan.chains.chain_cutting import chain_blocks, planned_chains, with_chains
    from leafcut.processes.sheet.plan.cutting import bands

    run, cutting, plan, settings = job.run, job.cutting, job.plan, job.run.settings
    options, keep = settings.of(CutOptions), settings.job.keep_order
    planned = [] if plan is None else planned_chains(cutting, plan, everything=keep)
    if not options.chains or keep or settings.solve.algorithm == "none":
        return with_chains(cutting, planned), 0.0
    blocks = chain_blocks(cutting, bands(cutting, options), planned)
    deadline, seconds, left = run.deadline.part(SHARE), 0.0, sum(map(len, blocks))
    chains = planned
    for block in blocks:
        run.tell("looking for bridges")
        more, spent = _search(job, block, chains, deadline.part(len(block) / left))
        chains, seconds, left = [*chains, *more], seconds + spent, left - len(block)
    return with_chains(cutting, chains), seconds


def _search(job: SheetJob, block: list[int], before: Sequence[Chain], deadline: Deadline) -> tuple[list[Chain], float]:
    """Return the chains of one block, and the seconds of the search."""
    from leafcut.order.solve import solve
    from leafcut.processes.sheet.plan.chains.chain_cutting import chain_problem, chains_of

    run, cutting, settings = job.run, job.cutting, job.run.settings
    rules = settings.of(CutOptions)
    found = chain_problem(cutting, rules, job.overhead, min(run.machine.rapid_velocity[:2]), block)
    if found is None:
        return [], 0.0
    options = replace(settings.solve, bound=False, algorithm="auto", time_limit=deadline.seconds)
    tell = run.passing_on("joining cuts", 0.0, 1.0)
    solution = solve(found.problem, options, settings.aco, progress=tell, cancelled=run.cancelled)
    deadline.spend(solution.seconds)
    return chains_of(cutting, found, [int(n) for n in solution.nodes], rules, before), solution.seconds
