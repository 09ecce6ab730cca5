"""What the runs of all algorithms share: what they return, their budgets, and how Ctrl-C ends them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures
from leafcut.options import SolveOptions
from leafcut.order.statistics import Best
from leafcut.order.stop import Stop

#: A preset is a budget of nodes visited by ants, and how many iterations without a better tour end it.
PRESETS = {"fast": (2e5, 30), "default": (4e6, 40), "thorough": (1e8, 2000)}


@dataclass(frozen=True)
class SearchResult:
    """What an algorithm returns to `solve`."""

    tour: NDArray[np.int32]
    iterations: int = 0
    workers: tuple[WorkerFigures, ...] = ()


def set_budget(stop: Stop, options: SolveOptions, iterations: float, patience: float = math.inf) -> None:
    """Stop after the iterations asked for; without any, and without a time limit, after the preset's."""
    if options.iterations is not None:
        stop.iterations = options.iterations
    elif options.time_limit is None:
        stop.iterations = max(1, math.ceil(iterations))
        stop.patience = patience


def set_budget_of_visits(stop: Stop, options: SolveOptions, visited: float) -> None:
    """Set the budget of ants, which visit `visited` nodes in an iteration."""
    visits, patience = PRESETS[options.preset]
    set_budget(stop, options, visits / visited, patience)


def until_interrupted(work: Callable[[], int], best: Best) -> int:
    """Return the iterations that `work` made; Ctrl-C ends it, and what is in `best` is kept, if there is anything."""
    try:
        return work()
    except KeyboardInterrupt:
        best.stop.cancelled.set()
        if not len(best.tour):
            raise
        return best.iteration
