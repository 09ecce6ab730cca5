"""`Solution`: an order, what it costs, and how it was found; `Solved`: that of a map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.part import Part


@dataclass(frozen=True)
class WorkerFigures:
    """What one thread did: ants built or kicks made, seconds by the clock, the best cost it found (inf for none)."""

    worker: int
    ants: int
    seconds: float
    best: float


@dataclass(frozen=True, eq=False)
class Solution:
    """The nodes in the order of their visit.

    Attributes
    ----------
    nodes
        int32[k]: one node per cluster, in order. A closed tour begins anywhere and returns there.
    cost
        Travel and service, in `unit`.
    history
        (seconds since the start, cost) at every improvement.
    iterations
        Of the algorithm, 0 for a construction heuristic.
    lower_bound
        No path can cost less, or None when no bound was computed.
    stopped_early
        True when a person or the clock stopped it before its budget of work was used.
    spared
        True when the search ended because more of it would have taken longer than it could still gain.
    """

    nodes: NDArray[np.int32]
    cost: float
    unit: str
    algorithm: str
    seed: int
    iterations: int = 0
    seconds: float = 0.0
    history: tuple[tuple[float, float], ...] = ()
    workers: tuple[WorkerFigures, ...] = ()
    lower_bound: float | None = None
    stopped_early: bool = False
    spared: bool = False

    @property
    def gap(self) -> float | None:
        """How far at most the cost is above the least possible, as a fraction; None without a bound."""
        return gap(self.cost, self.lower_bound)


@dataclass(frozen=True, eq=False)
class Solved:
    """A map, and a closed tour through its points.

    Attributes
    ----------
    part
        The map. Of its sets of points, where it has any, the tour visits one point of each.
    defaults
        Which of the options that were used are of the person's own defaults, as one types them.
    """

    part: Part
    solution: Solution
    defaults: tuple[str, ...] = ()

    @property
    def gap(self) -> float | None:
        """How far the tour is above the best known one, as a fraction; at most, by the lower bound, without one."""
        optimum = self.part.optimum
        return self.solution.cost / optimum - 1.0 if optimum else self.solution.gap


def gap(cost: float, bound: float | None) -> float | None:
    """Return how far a cost is above a lower bound, as a fraction of the bound; None where that says nothing."""
    if bound is None or cost < bound:
        return None
    if cost == bound:
        return 0.0
    return cost / bound - 1.0 if bound > 0 else None
