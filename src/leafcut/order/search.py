"""The search loop of all population algorithms. It manages the budget, the best tour, and snapshots for observers."""

from __future__ import annotations

import itertools
import math
import threading
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.model.snapshot import Observer, Pheromone, Snapshot
from leafcut.model.solution import WorkerFigures, gap
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.stop import Stop
from leafcut.order.workers import WorkerLog

if TYPE_CHECKING:
    from leafcut.order.directed import AnyInstance

#: Relative tolerance for comparing costs. Two equal tours may sum their costs in different orders.
ROUNDING = 1e-12

#: Budget of each preset: the total number of nodes that ants visit, and the maximum number of iterations without a
#: better tour.
PRESETS = {"fast": (2e5, 30), "default": (4e6, 40), "thorough": (1e8, 2000)}

#: Tours, int32[m, n], and their costs, float64[m]. The cost of an unfinished tour is infinite.
Tours = tuple[NDArray[np.int32], NDArray[np.float64]]


class SearchView:
    """An observer's view of a search. By default, it shows the best path and the statistics of the workers."""

    def __init__(
        self,
        shown: AnyInstance | None = None,
        log: WorkerLog | None = None,
        pheromone: Callable[[], Pheromone] | None = None,
    ) -> None:
        """Create a view. If `shown` is None, snapshots contain no path."""
        self.shown, self.log, self.pheromone = shown, WorkerLog.empty(0) if log is None else log, pheromone

    def instance_nodes(self, tour: Ints) -> Ints:
        """Convert a tour of the search to nodes of the instance."""
        return tour

    def snapshot_fields(self, best: Best) -> dict[str, Any]:
        """Return the optional `Snapshot` fields that this algorithm provides."""
        pheromone = {} if self.pheromone is None else {"pheromone": self.pheromone()}
        return {"workers": self.log.worker_figures()} | pheromone

    def branching_factor(self) -> float | None:
        """Return the mean λ-branching factor of the pheromone trails."""
        return None


@dataclass
class Best:
    """The best known tour and its history.

    Attributes
    ----------
    cost, history
        Cost of the best tour and of each earlier best tour, without service times.
    service
        Total service time. It is the same for every path, so the search ignores it.
    shown_bound
        Lower bound for observers, including service times.
    """

    stop: Stop
    progress: OnProgress | None = None
    service: float = 0.0
    shown_bound: float | None = None
    view: SearchView = field(default_factory=SearchView)
    observer: Observer = field(default_factory=Observer)
    tour: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    cost: float = math.inf
    iteration: int = 0
    history: list[tuple[float, float]] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def offer(self, tour: NDArray[np.int32], cost: float, iteration: int) -> bool:
        """Keep a tour if it is cheaper than the best tour by more than the tolerance. Return whether it was kept."""
        with self.lock:
            if not cost + ROUNDING * abs(cost) < self.cost:
                return False
            self.tour, self.cost, self.iteration = tour.copy(), float(cost), iteration
            self.history.append((self.stop.elapsed(), float(cost)))
        return True

    def bound_if_cancelled(self) -> float | None:
        """Return the bound that observers saw if the search was cancelled. Otherwise, return None.

        A cancelled search computes no other bound.
        """
        return self.shown_bound if self.stop.cancelled.is_set() else None

    def tell(self, iteration: int, costs: NDArray[np.float64] | None = None, alone: bool = True) -> None:
        """Report progress after an iteration whose tours have the given `costs`.

        If `alone` is set, this call blocks the whole search.
        """
        if self.progress is not None:
            shares = (iteration / max(self.stop.iterations, 1), self.stop.elapsed() / self.stop.seconds)
            cost = self.cost + self.service
            self.progress(Progress(Message("searching"), min(1.0, max(shares)), cost, gap(cost, self.shown_bound)))
        with self.stop.paused() if alone else nullcontext():
            self._show_snapshot(iteration, costs, alone)

    def _show_snapshot(self, iteration: int, costs: NDArray[np.float64] | None, alone: bool) -> None:
        seconds, view = self.stop.elapsed(), self.view

        def take_snapshot() -> Snapshot:
            with self.lock:
                tour, cost = self.tour, self.cost
            path = (
                view.shown.path_positions(view.instance_nodes(tour))
                if view.shown is not None and len(tour)
                else np.zeros((0, 2))
            )
            return Snapshot(
                path, cost + self.service, self.shown_bound, iteration, seconds, **view.snapshot_fields(self)
            )

        whole, worked = None if costs is None else costs + self.service, sum(view.log.seconds)
        self.observer.note(iteration, seconds, self.cost + self.service, whole, view.branching_factor, worked)
        self.observer.show(take_snapshot, alone)


@dataclass(frozen=True)
class AlgorithmRun:
    """The arguments of an algorithm apart from the instance: options, best tour, and stopping criteria."""

    options: SolveOptions
    aco: AcoOptions
    firefly: FireflyOptions
    best: Best

    @property
    def stop(self) -> Stop:
        """The run's stopping criteria."""
        return self.best.stop


@dataclass(frozen=True)
class SearchResult:
    """An algorithm's result: the tour, the number of iterations, and the statistics of the workers."""

    tour: NDArray[np.int32]
    iterations: int = 0
    workers: tuple[WorkerFigures, ...] = ()


class Population(SearchView):
    """Base class for algorithms that construct a population of tours in each iteration and learn from them."""

    def construct(self, iteration: int) -> Tours:
        """Return an iteration's tours and their costs."""
        raise NotImplementedError

    def reinforce(self, iteration: int, tours: NDArray[np.int32], costs: NDArray[np.float64], best: Best) -> None:
        """Learn from an iteration's tours. The default implementation does nothing."""


def run_steps(
    steps: Iterator[NDArray[np.float64] | None],
    best: Best,
    iteration: int = 0,
    report: Callable[[int, NDArray[np.float64] | None], None] | None = None,
) -> int:
    """Run an algorithm step by step until a stopping criterion holds. Return the number of finished iterations.

    Each step constructs paths, improves them, offers the best path, learns from the paths, and yields their costs or
    None. `iteration` is the number of earlier iterations. `report` shows progress.
    """
    stop, report = best.stop, report or best.tell
    if not stop.reached(iteration, iteration - best.iteration):
        for costs in steps:
            iteration += 1
            report(iteration, costs)
            if stop.reached(iteration, iteration - best.iteration):
                break
    return iteration


def run_population(population: Population, best: Best) -> int:
    """Run a population algorithm and return the number of finished iterations.

    If several tours of an iteration are equally cheap, the first counts as the best. The result therefore does not
    depend on threads.
    """
    best.view = population
    return run_steps(_generations(population, best), best)


def _generations(population: Population, best: Best) -> Iterator[NDArray[np.float64]]:
    for iteration in itertools.count():
        tours, costs = population.construct(iteration)
        winner = int(np.argmin(costs))
        best.offer(tours[winner], costs[winner], iteration)
        if best.stop.must_stop():
            return
        population.reinforce(iteration, tours, costs, best)
        yield costs


def set_preset_budget(stop: Stop, options: SolveOptions, iterations: float, patience: float = math.inf) -> None:
    """Apply the preset's limits, unless the options limit the time or the number of iterations."""
    if not options.is_limited:
        stop.iterations = max(1, math.ceil(iterations))
        stop.patience = patience


def set_visit_budget(stop: Stop, options: SolveOptions, visited: float) -> None:
    """Set a preset's budget for ants that visit a total of `visited` nodes per iteration."""
    visits, patience = PRESETS[options.preset]
    set_preset_budget(stop, options, visits / visited, patience)
