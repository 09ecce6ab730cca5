"""What is remembered of a search: the best, its history, and what every worker did."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures
from leafcut.solve.stop import Stop

#: Told about every step: (iteration, best cost, seconds, share of the work done 0 … 1). Must be quick.
Progress = Callable[[int, float, float, float], None]


@dataclass
class Best:
    """The best tour so far, and how it came about."""

    stop: Stop
    progress: Progress | None = None
    tour: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    cost: float = math.inf
    iteration: int = 0
    history: list[tuple[float, float]] = field(default_factory=list)

    def offer(self, tour: NDArray[np.int32], cost: float, iteration: int) -> bool:
        """Keep the tour if it is better; return whether it was."""
        if not cost < self.cost:
            return False
        self.tour, self.cost, self.iteration = tour.copy(), float(cost), iteration
        self.history.append((self.stop.elapsed(), float(cost)))
        return True

    def tell(self, iteration: int) -> None:
        """Report the state after an iteration."""
        if self.progress is None:
            return
        seconds = self.stop.elapsed()
        shares = (iteration / self.stop.iterations, seconds / self.stop.seconds)
        self.progress(iteration, self.cost, seconds, min(1.0, max(shares)))


@dataclass
class WorkerLog:
    """Adds up what each worker does."""

    ants: list[int]
    seconds: list[float]
    best: list[float]

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
