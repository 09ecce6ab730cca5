"""What is remembered of a search: the best, its history, and what every worker did."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.model.snapshot import Observer, Pheromone, SearchStep, Snapshot
from leafcut.model.solution import WorkerFigures, gap
from leafcut.model.study import Study
from leafcut.order.stop import Stop

#: Costs that differ by less than this share differ by the order in which they were added up.
ROUNDING = 1e-12


@dataclass
class Best:
    """The best tour so far, and how it came about.

    `cost`, `history` and `Stop.target` are in the search's costs: travel alone. `service` is what every tour costs
    besides, and `bound` the lower bound of both together, where it is known before the search; `shown_bound` is one
    that is only told of. `watched` is there where somebody may look.
    """

    stop: Stop
    progress: OnProgress | None = None
    service: float = 0.0
    bound: float | None = None
    shown_bound: float | None = None
    watched: Watched | None = None
    tour: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    cost: float = math.inf
    iteration: int = 0
    history: list[tuple[float, float]] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def offer(self, tour: NDArray[np.int32], cost: float, iteration: int) -> bool:
        """Keep the tour if it is better, by more than rounding; return whether it was."""
        with self.lock:
            if not cost + ROUNDING * abs(cost) < self.cost:
                return False
            self.tour, self.cost, self.iteration = tour.copy(), float(cost), iteration
            self.history.append((self.stop.elapsed(), float(cost)))
        if cost <= self.stop.target:
            self.stop.satisfied = True
        return True

    @property
    def known_bound(self) -> float | None:
        """A lower bound, where any is known."""
        return self.shown_bound if self.bound is None else self.bound

    def bound_at_hand(self) -> float | None:
        """The bound that the answer has without another being sought; of a stopped search also one only told of."""
        return self.known_bound if self.stop.cancelled.is_set() else self.bound

    def tell(self, iteration: int, alone: bool = True, costs: NDArray[np.float64] | None = None) -> None:
        """Report the state after an iteration; `alone`: nothing of the search goes on meanwhile.

        `costs` are those of the iteration's paths, where it has any.
        """
        if self.progress is not None:
            self._report(self.progress, iteration)
        if self.watched is not None:
            self.watched.look(self, iteration, alone, costs)

    def _report(self, progress: OnProgress, iteration: int) -> None:
        shares = (iteration / max(self.stop.iterations, 1), self.stop.elapsed() / self.stop.seconds)
        cost = self.cost + self.service
        progress(Progress("searching", min(1.0, max(shares)), cost, gap(cost, self.known_bound)))


@dataclass
class Watched:
    """A search that somebody may look at.

    Attributes
    ----------
    path
        Places along a tour as the search keeps it, float64[m, 2].
    workers, pheromone, brightness, step
        As in `Snapshot`; put by the search as soon as it has any.
    branching
        Of the trails, as in `model.study.Iteration`.
    """

    observer: Observer
    path: Callable[[NDArray[np.int32]], NDArray[np.float64]]
    workers: Callable[[], tuple[WorkerFigures, ...]] = tuple
    pheromone: Callable[[], Pheromone | None] = lambda: None
    brightness: Callable[[], NDArray[np.float64] | None] = lambda: None
    step: Callable[[], SearchStep | None] = lambda: None
    branching: Callable[[], float | None] = lambda: None

    def __post_init__(self) -> None:
        if isinstance(self.observer, Study):
            self.observer.begin()

    def look(self, best: Best, iteration: int, alone: bool, costs: NDArray[np.float64] | None = None) -> None:
        """Let the observer look; `alone`: nothing of the search goes on meanwhile, and its clock stands still."""
        seconds = best.stop.elapsed()

        def take() -> Snapshot:
            with best.lock:
                tour, cost = best.tour, best.cost
            return Snapshot(
                path=self.path(tour) if len(tour) else np.zeros((0, 2)),
                cost=cost + best.service,
                bound=best.known_bound,
                iteration=iteration,
                seconds=seconds,
                workers=self.workers(),
                pheromone=self.pheromone(),
                brightness=self.brightness(),
                step=self.step(),
            )

        if not alone:
            self._note(best, iteration, seconds, costs)
            self.observer(take, False)
            return
        with best.stop.paused():
            self._note(best, iteration, seconds, costs)
            self.observer(take, True)

    def _note(self, best: Best, iteration: int, seconds: float, costs: NDArray[np.float64] | None) -> None:
        """Have the figures of an iteration kept, where a study asks for them."""
        if isinstance(self.observer, Study):
            whole = None if costs is None else costs + best.service
            self.observer.note(iteration, seconds, best.cost + best.service, whole, self.branching())


@dataclass
class WorkerLog:
    """Adds up what each worker does."""

    ants: list[int]
    seconds: list[float]
    best: list[float]
    known: list[object] = field(default_factory=list)

    def number(self, who: object) -> int:
        """Return the number of the worker that calls itself `who`: they are counted as they turn up."""
        if who not in self.known:
            self.known.append(who)
        return self.known.index(who) % len(self.ants)

    @classmethod
    def of(cls, workers: int) -> WorkerLog:
        """Return an empty log of that many workers."""
        return cls([0] * workers, [0.0] * workers, [math.inf] * workers)

    def add(self, worker: int, ants: int, seconds: float, best: float) -> None:
        """Add one share of work."""
        self.ants[worker] += ants
        self.seconds[worker] += seconds
        self.best[worker] = min(self.best[worker], best)

    def figures(self) -> tuple[WorkerFigures, ...]:
        """Return the sums, one per worker."""
        rows = zip(self.ants, self.seconds, self.best, strict=True)
        return tuple(WorkerFigures(w, ants, seconds, best) for w, (ants, seconds, best) in enumerate(rows))
