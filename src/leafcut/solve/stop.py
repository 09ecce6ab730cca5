"""When to stop: a budget of iterations, a clock, a person, or nothing new for long."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, field


@dataclass
class Stop:
    """All reasons to stop in one place.

    `now` is asked often (between ants): only a person or the clock stops there. `reached` is asked between iterations.

    Attributes
    ----------
    iterations, patience
        Most iterations, and most of them without a better tour.
    seconds
        Most seconds since the object was made, by the clock.
    cancelled
        Set from outside (Ctrl-C, a button) to stop and keep the best.
    """

    iterations: float = math.inf
    patience: float = math.inf
    seconds: float = math.inf
    cancelled: threading.Event = field(default_factory=threading.Event)
    began: float = field(default_factory=time.perf_counter)

    def elapsed(self) -> float:
        """Return the seconds since the beginning."""
        return time.perf_counter() - self.began

    def now(self) -> bool:
        """Return whether to stop at once, with what there is."""
        return self.cancelled.is_set() or self.elapsed() >= self.seconds

    def reached(self, iteration: int, since_better: int) -> bool:
        """Return whether to stop before `iteration` (counted from 0), `since_better` iterations after the last gain."""
        return iteration >= self.iterations or since_better >= self.patience or self.now()
