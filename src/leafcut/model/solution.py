"""`Solution`: the order that a search returns, with its cost. `Solved`: a map with its tour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.part import Part


@dataclass(frozen=True)
class WorkerFigures:
    """The work of a search thread: number of ants or kicks, wall time, s, and best cost (inf without a path)."""

    worker: int
    ants: int
    seconds: float
    best: float


@dataclass(frozen=True, eq=False)
class Solution:
    """Nodes in the order of visits.

    Attributes
    ----------
    nodes
        One node per cluster in the order of visits, int32[k]. A closed tour may start at any node, and returns to it.
    cost
        Cost of travel and service, in `unit`.
    history
        Pairs (seconds since the start, cost), one for every improvement.
    iterations
        Number of iterations; 0 for a construction heuristic.
    lower_bound
        Lower bound of the cost, or None if it was not computed.
    stopped_early
        Whether the user or the time limit stopped the search before it finished its planned work.
    spared
        Whether the search ended because more search would have taken longer than it could save.
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
        """Upper limit for the excess of the cost over the optimum, as a fraction; None without a lower bound."""
        return gap(self.cost, self.lower_bound)


@dataclass(frozen=True, eq=False)
class Solved:
    """A map with a closed tour through its points, or through one point of each cluster."""

    part: Part
    solution: Solution
    defaults: tuple[str, ...] = ()

    @property
    def gap(self) -> float | None:
        """Relative excess over the best known tour, or over the lower bound if no tour is known."""
        optimum = self.part.optimum
        return self.solution.cost / optimum - 1.0 if optimum else self.solution.gap


def gap(cost: float, bound: float | None) -> float | None:
    """Return the excess of a cost over a lower bound, as a fraction of the bound. Return None if it is undefined."""
    if bound is None or cost < bound:
        return None
    if cost == bound:
        return 0.0
    return cost / bound - 1.0 if bound > 0 else None
