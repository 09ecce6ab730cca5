"""`Study`: what a search found in every iteration, for those who want to see it learn."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.snapshot import Observer, Snapshot

#: Most iterations that are kept of one search: of a longer one every second, every fourth, and so on.
MOST_KEPT = 4000


class Iteration(NamedTuple):
    """One iteration of a search; None stands for what its algorithm has not.

    ========== ==================================================================================
    number     from 1
    seconds    since the search began, by its clock
    shortest   the best path of all iterations so far, travel and service in the problem's unit
    best       the best path of this iteration; `mean` and `worst` likewise, of those that were finished
    branching  the mean λ-branching factor of the trails after it, `order.aco.BRANCHING_SHARE` = λ
    ========== ==================================================================================
    """

    number: int
    seconds: float
    shortest: float
    best: float | None = None
    mean: float | None = None
    worst: float | None = None
    branching: float | None = None


class Study:
    """An observer that keeps the figures of every iteration, and lets another observer look as well.

    Given as `observe` to a search. It changes no answer; without one nothing of this is reckoned.

    Attributes
    ----------
    searches
        The iterations of every search that it was given to, in order.
    """

    def __init__(self, observer: Observer | None = None) -> None:
        self.observer = observer
        self.searches: list[_Kept] = []
        self._lock = threading.Lock()

    def __call__(self, take: Callable[[], Snapshot], alone: bool) -> None:
        """Let the other observer look."""
        if self.observer is not None:
            self.observer(take, alone)

    def begin(self) -> None:
        """Take what is noted from now on as another search."""
        with self._lock:
            self.searches.append(_Kept())

    def note(
        self, number: int, seconds: float, shortest: float, costs: NDArray[np.float64] | None = None,
        branching: float | None = None,
    ) -> None:  # fmt: skip
        """Keep an iteration; `costs` are those of its paths, inf for one that was not finished."""
        done = np.zeros(0) if costs is None else costs[np.isfinite(costs)]
        row = Iteration(number, seconds, shortest, branching=branching)
        if len(done):
            row = row._replace(best=float(done.min()), mean=float(done.mean()), worst=float(done.max()))
        with self._lock:
            self.searches[-1].add(row)

    def iterations(self, search: int = -1) -> list[Iteration]:
        """Return the iterations of a search, of the last one where none is named; the newest is always there."""
        with self._lock:
            return self.searches[search].all() if self.searches else []


class _Kept:
    """The iterations of one search, no more than `MOST_KEPT` and the newest."""

    def __init__(self) -> None:
        self.rows: list[Iteration] = []
        self.newest: Iteration | None = None
        self.every = 1

    def add(self, row: Iteration) -> None:
        self.newest = row
        if (row.number - 1) % self.every:
            return
        self.rows.append(row)
        if len(self.rows) > MOST_KEPT:
            self.every *= 2
            self.rows = [one for one in self.rows if (one.number - 1) % self.every == 0]

    def all(self) -> list[Iteration]:
        last = [] if self.newest is None or (self.rows and self.rows[-1] is self.newest) else [self.newest]
        return [*self.rows, *last]
