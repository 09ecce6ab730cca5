"""When a search for machine seconds is worth its own: it ends where it takes longer than what it can still gain."""

from __future__ import annotations

import math
from dataclasses import dataclass

from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions

#: The first stretch of work takes so long, s: nobody minds it, and in less there is little to judge by.
FIRST_STRETCH = 1.0


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
