"""Stopping criteria: target cost, iterations, time limit, cancellation, and iterations without improvement."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from leafcut.kernels.compiling import compile_seconds
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions

#: Length of the first period, s: short enough to be acceptable, long enough to judge the progress.
FIRST_STRETCH = 1.0


def clock() -> float:
    """Return the time in seconds for limits and histories; its origin is arbitrary, and it excludes compilation."""
    return time.perf_counter() - compile_seconds()


@dataclass
class Thrift:
    """Ends a search when it takes longer than the machine time it saves: a period is not worth its time if it lasts
    longer than the machine time that the previous one saved. The search time is derived from the work done, so that
    results are reproducible. Without `holds`, every period is worth its time.
    """

    holds: bool = False
    spared: bool = False
    _cost: float = math.inf
    _until: float = FIRST_STRETCH

    @classmethod
    def of(cls, options: SolveOptions, problem: RoutingProblem) -> Thrift:
        """Return the rule; inactive with limits of time or iterations or preset `thorough`, and without times."""
        counted = options.iterations is not None or options.time_limit is not None
        return cls(not counted and options.preset != "thorough" and problem.metric.unit == "s")

    def is_worth(self, seconds: float, gained: float) -> bool:
        """Return whether a period of `seconds` is worth it after the previous one saved `gained` s of machine time."""
        if self.holds and gained < seconds:
            self.spared = True
        return not self.spared

    def goes_on(self, seconds: float, cost: float) -> bool:
        """Return whether to continue after `seconds` in total with a path of cost `cost`; the periods double."""
        if math.isinf(self._cost):
            self._cost = cost
        if seconds < self._until:
            return not self.spared
        gained, self._cost, self._until = self._cost - cost, cost, 2.0 * seconds
        return self.is_worth(seconds, gained)


@dataclass
class Stop:
    """All stopping criteria of a search.

    `now` is called often (between ants) and checks only cancellation, the time limit and the target. `reached` is
    called between iterations. `patience`: iterations without a better tour; `target`: cost at which a tour is good
    enough, as the search counts it (without service); `satisfied`: set by `Best.offer` when a tour reaches the target.
    """

    iterations: float = math.inf
    patience: float = math.inf
    seconds: float = math.inf
    target: float = -math.inf
    satisfied: bool = False
    cancelled: threading.Event = field(default_factory=threading.Event)
    thrift: Thrift = field(default_factory=Thrift)
    began: float = field(default_factory=lambda: clock())  # noqa: PLW0108  # whichever clock there is then

    def elapsed(self) -> float:
        """Return the time since the start, s, without pauses."""
        return clock() - self.began

    def now(self, spare: float = 0.0) -> bool:
        """Return whether to stop immediately, given that `spare` seconds are still needed afterwards."""
        return self.satisfied or self.cancelled.is_set() or self.elapsed() + spare >= self.seconds

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Stop the clock for work outside the search, such as computing a lower bound."""
        began = clock()
        try:
            yield
        finally:
            self.began += clock() - began

    def reached(self, iteration: int, since_better: int) -> bool:
        """Return whether to stop before `iteration` (from 0), `since_better` iterations after the last improvement."""
        return iteration >= self.iterations or since_better >= self.patience or self.now()
