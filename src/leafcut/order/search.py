"""The search loop of all population algorithms, and the budget of a run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.best import Best, SearchView
from leafcut.order.stop import Stop

#: Budget of a preset: nodes visited by ants, and iterations without a better tour after which the search ends.
PRESETS = {"fast": (2e5, 30), "default": (4e6, 40), "thorough": (1e8, 2000)}

#: Tours int32[m, n] and their costs float64[m]; the cost of a tour that was not finished is infinite.
Tours = tuple[NDArray[np.int32], NDArray[np.float64]]


@dataclass(frozen=True)
class AlgorithmRun:
    """Arguments of an algorithm other than the instance: options, best tour, and stopping criteria."""

    options: SolveOptions
    aco: AcoOptions
    firefly: FireflyOptions
    best: Best

    @property
    def stop(self) -> Stop:
        """The stopping criteria."""
        return self.best.stop


@dataclass(frozen=True)
class SearchResult:
    """Result of an algorithm: the tour, its iterations, and the figures of its workers."""

    tour: NDArray[np.int32]
    iterations: int = 0
    workers: tuple[WorkerFigures, ...] = ()


class Population(SearchView):
    """Base class of population algorithms: they construct tours and learn from them."""

    def construct(self, iteration: int) -> Tours:
        """Return the tours of an iteration and their costs."""
        raise NotImplementedError

    def reinforce(self, iteration: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """Learn from the tours of an iteration; does nothing by default."""


def search(population: Population, best: Best) -> int:
    """Run an algorithm until a stopping criterion holds; return the number of finished iterations. The first of the
    cheapest tours of an iteration counts, regardless of the thread. Ctrl-C keeps the best tour.
    """
    best.view = population

    def run() -> int:
        stop, iteration = best.stop, 0
        while not stop.reached(iteration, iteration - best.iteration):
            tours, costs = population.construct(iteration)
            winner = int(np.argmin(costs))
            best.offer(tours[winner], costs[winner], iteration)
            if stop.now():
                break
            population.reinforce(iteration, tours, costs, best)
            iteration += 1
            best.tell(iteration, costs=costs)
        return iteration

    return until_interrupted(run, best)


def until_interrupted(work: Callable[[], int], best: Best) -> int:
    """Run `work` and return its iterations; Ctrl-C ends it and keeps the best tour, if any."""
    try:
        return work()
    except KeyboardInterrupt:
        best.stop.cancelled.set()
        if not len(best.tour):
            raise
        return best.iteration


def set_budget(stop: Stop, options: SolveOptions, iterations: float, patience: float = math.inf) -> None:
    """Set the iteration limit from the options; without it and without a time limit, use the preset's limits."""
    if options.iterations is not None:
        stop.iterations = options.iterations
    elif options.time_limit is None:
        stop.iterations = max(1, math.ceil(iterations))
        stop.patience = patience


def set_budget_of_visits(stop: Stop, options: SolveOptions, visited: float) -> None:
    """Set the budget of a preset for ants that visit `visited` nodes per iteration."""
    visits, patience = PRESETS[options.preset]
    set_budget(stop, options, visits / visited, patience)
