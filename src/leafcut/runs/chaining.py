"""Chains found for a sheet: the bridges, the search, and the cutting with what the search chose."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.runs.run import Run, passing_on

if TYPE_CHECKING:
    from leafcut.plan.cutting import Cutting

#: The part of a time limit that is spent on chains; the rest is for the order of all cuts.
SHARE = 0.4


def chained(run: Run, cutting: Cutting, overhead: float) -> tuple[Cutting, float]:
    """Return the cutting with chains where they save time, and the seconds of the time limit that it took.

    `overhead` is what each cut takes to come down and to rise, s.
    """
    from leafcut.plan.chaining import chain_problem, chains_of, with_chains
    from leafcut.plan.cutting import bands
    from leafcut.solve.solve import solve

    settings = run.settings
    if not settings.cut.chains or settings.resequence.keep_order or settings.solve.algorithm == "none":
        return cutting, 0.0
    run.tell("looking for bridges")
    rapid = min(run.machine.rapid_velocity[:2])
    found = chain_problem(cutting, settings.cut, overhead, rapid, bands(cutting, settings.cut))
    if found is None:
        return cutting, 0.0
    limit = settings.solve.time_limit
    options = replace(
        settings.solve, bound=False, algorithm="auto", time_limit=None if limit is None else SHARE * limit
    )
    tell = passing_on(run.progress, "joining cuts", 0.0, 1.0)
    solution = solve(found.problem, options, settings.aco, progress=tell, cancelled=run.cancelled)
    chains = chains_of(cutting, found, [int(n) for n in solution.nodes], settings.cut)
    return with_chains(cutting, chains), solution.seconds
