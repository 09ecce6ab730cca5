"""The time limit of a run, shared among its searches."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event

from leafcut.options import SolveOptions
from leafcut.order.stop import clock

#: Share of its time that a search gets even if earlier searches overran; the minimum for a search, s.
LEAST_PART, LEAST_SECONDS = 0.05, 0.001
#: Share of the time limit reserved for lower bounds.
BOUND_PART = 0.1


class Deadline:
    """Time budget of the searches and lower bounds of a run. Each search gets a share of the remaining time; time that
    an earlier search does not need goes to later searches.
    """

    def __init__(self, limit: float | None = None, parent: Deadline | None = None) -> None:
        """`limit` in seconds, None for no limit; `parent` is the enclosing deadline."""
        self.limit = math.inf if limit is None else limit
        self._spent, self._parent = 0.0, parent
        self._started: float | None = None

    @classmethod
    def of(cls, options: SolveOptions) -> Deadline:
        """Return the deadline of all searches of a run: its time limit without the part for lower bounds."""
        if options.time_limit is None:
            return cls()
        return cls((1.0 - BOUND_PART if options.bound else 1.0) * options.time_limit)

    @classmethod
    def of_bounds(cls, options: SolveOptions) -> Deadline:
        """Return the deadline of all lower bounds of a run: the rest of its time limit."""
        return cls() if options.time_limit is None else cls(BOUND_PART * options.time_limit)

    @property
    def left(self) -> float:
        """Remaining time, s, at least 0; infinite without a limit."""
        running = 0.0 if self._started is None else clock() - self._started
        return max(self.limit - self._spent - running, 0.0)

    @property
    def seconds(self) -> float | None:
        """Remaining time as a time limit for `SolveOptions`, s: None without a limit, otherwise positive."""
        return None if math.isinf(self.limit) else max(self.left, LEAST_SECONDS)

    def part(self, share: float) -> Deadline:
        """Return a deadline for searches that do a share of the remaining work."""
        if math.isinf(self.limit):
            return Deadline(None, self)
        return Deadline(max(share * self.left, LEAST_PART * share * self.limit, LEAST_SECONDS), self)

    def spend(self, seconds: float) -> None:
        """Subtract the time of a finished search."""
        self._spent += seconds
        if self._parent is not None:
            self._parent.spend(seconds)

    @contextmanager
    def running(self, cancelled: Event) -> Iterator[Callable[[], bool]]:
        """Measure the time of a search; yield a function that returns True when the search must stop."""
        self._started = clock()
        try:
            yield lambda: cancelled.is_set() or self.left <= 0.0
        finally:
            seconds, self._started = clock() - self._started, None
            self.spend(seconds)
