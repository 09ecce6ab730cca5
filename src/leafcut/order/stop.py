"""Stopping criteria for a search, and the time limit that all searches of a run share.

A search stops when it reaches its number of iterations or its time limit, when it is cancelled, or after too many
iterations without improvement.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from leafcut.kernels.compiling import compile_seconds
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions

#: Length of the first period in seconds. It is short enough for users and long enough to judge the progress.
FIRST_STRETCH = 1.0

#: A search gets at least this fraction of its time, even if earlier searches took too long, and at least this many
#: seconds.
LEAST_PART, LEAST_SECONDS = 0.05, 0.001
#: Fraction of the time limit that is reserved for lower bounds.
BOUND_PART = 0.1


def clock() -> float:
    """Return the time for limits and histories in seconds. The time spent on loading and compiling kernels is left out.

    The clock starts at an arbitrary value.
    """
    return time.perf_counter() - compile_seconds()


@dataclass
class PayoffLimit:
    """Ends a search when it takes longer than the machine time it saves.

    A period of the search is worth its time if it is shorter than the machine time that the previous period saved. The
    search time is derived from the amount of work, so results are reproducible. If `holds` is False, every period is
    worth its time.
    """

    holds: bool = False
    spared: bool = False
    _cost: float = math.inf
    _until: float = FIRST_STRETCH

    @classmethod
    def from_options(cls, options: SolveOptions, problem: RoutingProblem) -> PayoffLimit:
        """Create the limit for a problem.

        The limit is inactive if the options limit the time or the iterations, if the preset is `thorough`, or if costs
        are not times.
        """
        counted = options.iterations is not None or options.time_limit is not None
        return cls(not counted and options.preset != "thorough" and problem.metric.unit == "s")

    def is_period_worthwhile(self, seconds: float, gained: float) -> bool:
        """Check whether a period of `seconds` is worth its time if the previous period saved `gained` seconds."""
        if self.holds and gained < seconds:
            self.spared = True
        return not self.spared

    def is_worth_continuing(self, seconds: float, cost: float) -> bool:
        """Decide whether to continue after searching for `seconds` in total.

        `cost` is the cost of the current best path. Each period is twice as long as the previous period.
        """
        if math.isinf(self._cost):
            self._cost = cost
        if seconds < self._until:
            return not self.spared
        gained, self._cost, self._until = self._cost - cost, cost, 2.0 * seconds
        return self.is_period_worthwhile(seconds, gained)


@dataclass
class Stop:
    """All stopping criteria of a search.

    `must_stop` is called often (between ants) and only checks the time limit and whether the search was cancelled.
    `reached` is called between iterations. `patience` is the maximum number of iterations without a better tour.
    """

    iterations: float = math.inf
    patience: float = math.inf
    seconds: float = math.inf
    cancelled: threading.Event = field(default_factory=threading.Event)
    payoff_limit: PayoffLimit = field(default_factory=PayoffLimit)
    began: float = field(default_factory=lambda: clock())  # noqa: PLW0108  # whichever clock there is then

    @classmethod
    def from_options(cls, options: SolveOptions, problem: RoutingProblem, cancelled: threading.Event) -> Stop:
        """Read the stopping criteria from the options."""
        return cls(
            iterations=math.inf if options.iterations is None else options.iterations,
            seconds=math.inf if options.time_limit is None else options.time_limit,
            cancelled=cancelled,
            payoff_limit=PayoffLimit.from_options(options, problem),
        )

    def elapsed(self) -> float:
        """Return the seconds since the search started, without pauses."""
        return clock() - self.began

    def must_stop(self, spare: float = 0.0) -> bool:
        """Check whether the search must stop immediately.

        The caller needs `spare` seconds for the work that follows.
        """
        return self.cancelled.is_set() or self.elapsed() + spare >= self.seconds

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Stop the clock for work that does not belong to the search, such as computing a lower bound."""
        began = clock()
        try:
            yield
        finally:
            self.began += clock() - began

    def reached(self, iteration: int, since_better: int) -> bool:
        """Check whether the search must stop before `iteration` (counted from 0).

        The last improvement was `since_better` iterations ago.
        """
        return iteration >= self.iterations or since_better >= self.patience or self.must_stop()


class Deadline:
    """Time budget for a run's searches or for its lower bounds.

    Each search gets a share of the remaining time. Later searches can therefore use time that earlier searches left
    over.
    """

    def __init__(self, limit: float | None = None, parent: Deadline | None = None) -> None:
        """Start the clock. `limit` is in seconds; None means no limit. `parent` is the enclosing deadline."""
        self.limit = math.inf if limit is None else limit
        self._spent, self._parent = 0.0, parent
        self._started: float | None = None

    @classmethod
    def from_options(cls, options: SolveOptions) -> Deadline:
        """Create the deadline for all searches of a run: the run's time limit minus the share for lower bounds."""
        if options.time_limit is None:
            return cls()
        return cls((1.0 - BOUND_PART if options.bound else 1.0) * options.time_limit)

    @classmethod
    def for_bounds(cls, options: SolveOptions) -> Deadline:
        """Create the deadline for all lower bounds of a run: the rest of the run's time limit."""
        return cls() if options.time_limit is None else cls(BOUND_PART * options.time_limit)

    @property
    def left(self) -> float:
        """Remaining time in seconds, at least 0. Infinite if no limit is set."""
        running = 0.0 if self._started is None else clock() - self._started
        return max(self.limit - self._spent - running, 0.0)

    @property
    def remaining_time_limit(self) -> float | None:
        """Remaining time in seconds as a time limit for `SolveOptions`. Always positive, or None if no limit is set."""
        return None if math.isinf(self.limit) else max(self.left, LEAST_SECONDS)

    def for_share(self, share: float) -> Deadline:
        """Create a deadline for a given share of the remaining work."""
        if math.isinf(self.limit):
            return Deadline(None, self)
        return Deadline(max(share * self.left, LEAST_PART * share * self.limit, LEAST_SECONDS), self)

    def subtract(self, seconds: float) -> None:
        """Subtract the time that a finished search took."""
        self._spent += seconds
        if self._parent is not None:
            self._parent.subtract(seconds)

    @contextmanager
    def running(self, cancelled: threading.Event) -> Iterator[Callable[[], bool]]:
        """Measure how long the search in the block takes.

        Yield a function that returns whether the search must stop.
        """
        self._started = clock()
        try:
            yield lambda: cancelled.is_set() or self.left <= 0.0
        finally:
            seconds, self._started = clock() - self._started, None
            self.subtract(seconds)
