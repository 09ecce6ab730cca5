"""When to stop: good enough, a budget of iterations, a clock, a person, or nothing new for long."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions

#: The first stretch of work takes so long, s: nobody minds it, and in less there is little to judge by.
FIRST_STRETCH = 1.0


def clock() -> float:
    """Return seconds from any beginning: time limits and histories are measured in them. Compiling takes none."""
    from leafcut.order.compiling import compile_seconds  # imports Numba

    return time.perf_counter() - compile_seconds()


@dataclass
class Thrift:
    """Compares what a search gains with what it takes, which is counted from its work: answers stay the same.

    Gains become smaller from stretch to stretch, so one that would have to gain more than the stretch before did is not
    worth it.

    Attributes
    ----------
    holds
        Whether the search ends so; else everything is worth it.
    spared
        Whether it has ended so.
    """

    holds: bool = False
    spared: bool = False
    _cost: float = math.inf
    _until: float = FIRST_STRETCH

    @classmethod
    def of(cls, options: SolveOptions, problem: RoutingProblem) -> Thrift:
        """Return the rule for a search: who asks for time, iterations or thoroughness gets them."""
        counted = options.iterations is not None or options.time_limit is not None
        return cls(not counted and options.preset != "thorough" and problem.metric.unit == "s")

    def is_worth(self, seconds: float, gained: float) -> bool:
        """Return whether to search for so many seconds more, when the stretch before gained so many of the machine."""
        if self.holds and gained < seconds:
            self.spared = True
        return not self.spared

    def goes_on(self, seconds: float, cost: float) -> bool:
        """Return whether to go on after so many seconds in all, with a path of this cost; stretches double."""
        if math.isinf(self._cost):
            self._cost = cost
        if seconds < self._until:
            return not self.spared
        gained, self._cost, self._until = self._cost - cost, cost, 2.0 * seconds
        return self.is_worth(seconds, gained)


@dataclass
class Stop:
    """All reasons to stop in one place.

    `now` is asked often (between ants): only a person, the clock, or a tour that is good enough stops there. `reached`
    is asked between iterations.

    Attributes
    ----------
    iterations, patience
        Most iterations, and most of them without a better tour.
    seconds
        Most seconds since the object was made, by the clock.
    target
        A tour that costs no more is good enough, in the search's costs (without service).
    satisfied
        Set by `Best.offer` when it was given such a tour.
    cancelled
        Set from outside (Ctrl-C, a button) to stop and keep the best.
    thrift
        Says whether more work is worth its seconds.
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
        """Return the seconds since the beginning."""
        return clock() - self.began

    def now(self, spare: float = 0.0) -> bool:
        """Return whether to stop at once, with what there is, when `spare` seconds are still needed afterwards."""
        return self.satisfied or self.cancelled.is_set() or self.elapsed() + spare >= self.seconds

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Do something that is not the search, such as seeking a lower bound, with the clock stopped."""
        began = clock()
        try:
            yield
        finally:
            self.began += clock() - began

    def reached(self, iteration: int, since_better: int) -> bool:
        """Return whether to stop before `iteration` (counted from 0), `since_better` iterations after the last gain."""
        return iteration >= self.iterations or since_better >= self.patience or self.now()
