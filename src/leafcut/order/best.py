"""The best tour of a search, and what observers see of the search.

A search calls its observer after each iteration. A snapshot is built only if the observer takes it; its memory and time
grow with the number of nodes and candidates. Observing changes no result.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.model.snapshot import Observer, Snapshot
from leafcut.model.solution import gap
from leafcut.model.study import Study
from leafcut.order.directed import AnyInstance
from leafcut.order.stop import Stop
from leafcut.order.workers import WorkerLog

#: Costs that differ by less than this share are equal: they are sums in different orders.
ROUNDING = 1e-12


class SearchView:
    """State of a search as observers see it; by default the best path and the figures of the workers."""

    def __init__(self, shown: AnyInstance | None = None, log: WorkerLog | None = None) -> None:
        """Prepare; without the instance `shown` there are no places."""
        self.shown, self.log = shown, WorkerLog.of(0) if log is None else log

    def result(self, tour: Ints) -> Ints:
        """Return a tour of the search in the terms of the instance."""
        return tour

    def parts(self, best: Best) -> dict[str, Any]:
        """Return the fields of `Snapshot` that the algorithm has."""
        return {"workers": self.log.figures()}

    def branching(self) -> float | None:
        """Return the mean λ-branching factor of the trails."""
        return None


class SearchObserver:
    """Receives the state of a search after each iteration; by default it does nothing."""

    #: Whether the search shows its gap from the start, which needs a lower bound before the search.
    wants_bound = False

    def after_iteration(self, best: Best, iteration: int, alone: bool, costs: NDArray[np.float64] | None) -> None:
        """Receive the state; arguments as in `Best.tell`."""


class Watched(SearchObserver):
    """Passes snapshots of a search to an observer, and the figures of each iteration to a study."""

    wants_bound = True

    def __init__(self, observer: Observer) -> None:
        self.observer = observer
        if isinstance(observer, Study):
            observer.begin()

    def after_iteration(self, best: Best, iteration: int, alone: bool, costs: NDArray[np.float64] | None) -> None:
        """Pass the state to the observer; the clock of the search is stopped if the search waits (`alone`)."""
        seconds, view = best.stop.elapsed(), best.view

        def take() -> Snapshot:
            with best.lock:
                tour, cost = best.tour, best.cost
            path = view.shown.places(view.result(tour)) if view.shown is not None and len(tour) else np.zeros((0, 2))
            return Snapshot(path, cost + best.service, best.known_bound, iteration, seconds, **view.parts(best))

        def show() -> None:
            if isinstance(self.observer, Study):
                whole = None if costs is None else costs + best.service
                self.observer.note(iteration, seconds, best.cost + best.service, whole, view.branching())
            self.observer(take, alone)

        if not alone:
            show()
            return
        with best.stop.paused():
            show()


def observer_of(observe: Observer | None) -> SearchObserver:
    """Return the observer of a search; without one, the observer that does nothing."""
    return SearchObserver() if observe is None else Watched(observe)


@dataclass
class Best:
    """The best tour so far and its history.

    Attributes
    ----------
    cost, history
        Costs as the search counts them, like `Stop.target`.
    service
        Cost of every path that the search does not count.
    bound
        Lower bound including service if it was computed before the search; `shown_bound` is shown to observers only.
    view, observer
        The state that an observer sees, and the observer.
    """

    stop: Stop
    progress: OnProgress | None = None
    service: float = 0.0
    bound: float | None = None
    shown_bound: float | None = None
    view: SearchView = field(default_factory=SearchView)
    observer: SearchObserver = field(default_factory=SearchObserver)
    tour: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    cost: float = math.inf
    iteration: int = 0
    history: list[tuple[float, float]] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def offer(self, tour: NDArray[np.int32], cost: float, iteration: int) -> bool:
        """Keep the tour if it is better by more than rounding; return whether it is."""
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
        """Return a lower bound if one is known."""
        return self.shown_bound if self.bound is None else self.bound

    def final_bound(self) -> float | None:
        """Return the bound of the solution if none has to be computed; a cancelled search takes the shown bound."""
        return self.known_bound if self.stop.cancelled.is_set() else self.bound

    def tell(self, iteration: int, alone: bool = True, costs: NDArray[np.float64] | None = None) -> None:
        """Report the state after an iteration.

        `alone`: the search waits for this call. `costs` are those of the iteration's tours if it has any.
        """
        if self.progress is not None:
            shares = (iteration / max(self.stop.iterations, 1), self.stop.elapsed() / self.stop.seconds)
            cost = self.cost + self.service
            self.progress(Progress("searching", min(1.0, max(shares)), cost, gap(cost, self.known_bound)))
        self.observer.after_iteration(self, iteration, alone, costs)
