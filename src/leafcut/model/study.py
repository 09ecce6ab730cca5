"""`Study`: a record of every iteration of a search, which shows how the search learns."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.snapshot import Observer, Snapshot

#: Maximum number of recorded iterations. In a longer search, the study only records every second, fourth … iteration.
MAX_KEPT = 4000


class Iteration(NamedTuple):
    """One iteration of a search; None for values that its algorithm does not have.

    ========= ================================================================================================
    number    number of the iteration, from 1
    seconds   time since the start of the search, by its clock
    shortest  cost of the best path up to this iteration, travel and service in the unit of the problem
    best      cost of the best path of this iteration
    mean      mean cost of the finished paths of this iteration
    worst     cost of the worst finished path of this iteration
    branching mean λ-branching factor of the trails after the iteration; λ is
              `order.literature.pheromone.BRANCHING_SHARE`
    ========= ================================================================================================
    """

    number: int
    seconds: float
    shortest: float
    best: float | None = None
    mean: float | None = None
    worst: float | None = None
    branching: float | None = None


class Study(Observer):
    """An observer that records every iteration, and forwards all calls to another observer.

    Pass it to a search as `observe`. It does not change the result.
    """

    def __init__(self, observer: Observer | None = None) -> None:
        self.observer = observer or Observer()
        self.searches: list[_ThinnedIterations] = []
        self._lock = threading.Lock()

    def show(self, take: Callable[[], Snapshot], alone: bool) -> None:
        """Forward the call to the wrapped observer."""
        self.observer.show(take, alone)

    def begin(self) -> None:
        """Start the record of another search."""
        with self._lock:
            self.searches.append(_ThinnedIterations())

    def note(
        self,
        number: int,
        seconds: float,
        shortest: float,
        costs: NDArray[np.float64] | None = None,
        branching: Callable[[], float | None] = lambda: None,
        working: float = 0.0,
    ) -> None:
        """Record an iteration."""
        done = np.zeros(0) if costs is None else costs[np.isfinite(costs)]
        row = Iteration(number, seconds, shortest, branching=branching())
        if len(done):
            row = row._replace(best=float(done.min()), mean=float(done.mean()), worst=float(done.max()))
        with self._lock:
            self.searches[-1].add(row)

    def iterations(self, search: int = -1) -> list[Iteration]:
        """Return the recorded iterations of a search, by default the latest, including its newest iteration."""
        with self._lock:
            return self.searches[search].all() if self.searches else []


class _ThinnedIterations:
    """The newest iteration of a search, and at most `MAX_KEPT` other iterations."""

    def __init__(self) -> None:
        self.rows: list[Iteration] = []
        self.newest: Iteration | None = None
        self.every = 1

    def add(self, row: Iteration) -> None:
        self.newest = row
        if (row.number - 1) % self.every:
            return
        self.rows.append(row)
        if len(self.rows) > MAX_KEPT:
            self.every *= 2
            self.rows = [kept_row for kept_row in self.rows if (kept_row.number - 1) % self.every == 0]

    def all(self) -> list[Iteration]:
        last = [] if self.newest is None or (self.rows and self.rows[-1] is self.newest) else [self.newest]
        return [*self.rows, *last]
