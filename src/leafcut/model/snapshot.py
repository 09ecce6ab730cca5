"""`Snapshot`: the state of a search, which an `Observer` can read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures


@dataclass(frozen=True, eq=False)
class Pheromone:
    """The pheromone on the edges between points.

    Attributes
    ----------
    points
        Positions, float64[m, 2], mm.
    edges
        Pairs of points, int32[k, 2]. Edges with negligible pheromone are left out.
    strength
        How much the ants agree on each edge, float32[k], from 0 to 1. It is 1 if every ant uses the edge.
    """

    points: NDArray[np.float64]
    edges: NDArray[np.int32]
    strength: NDArray[np.float32]


@dataclass(frozen=True)
class NextPlace:
    """A step that an ant can take from a point.

    Attributes
    ----------
    place
        Number of the destination, from 1.
    cost
        The symbol d in the formulas.
    pheromone
        The symbol τ.
    attraction
        The symbol η = 1 / (d + ε).
    probability
        Probability of this step at the start of a tour.
    """

    place: int
    cost: float
    pheromone: float
    attraction: float
    probability: float


@dataclass(frozen=True)
class SearchStep:
    """The last step of an algorithm from the literature, with the symbols of its formulas.

    Attributes
    ----------
    values
        Maps a symbol in `docs/glossary.md` to its value, such as ``alpha``, ``tau_max``, ``c_best`` (cost of the best
        path) or ``c_iteration`` (cost of the best path in this iteration).
    depositor
        The ant that deposits pheromone in MAX–MIN Ant System: ``best``, ``iteration``, or ``restart`` after a reset of
        all trails.
    here, choices
        Number of an example point, and the most likely steps from it. Empty if steps have a direction.
    """

    algorithm: str
    values: Mapping[str, float]
    depositor: str = ""
    here: int = 0
    choices: tuple[NextPlace, ...] = ()


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The state of a search.

    Attributes
    ----------
    path
        Points of the best path in the order of visits, float64[m, 2], mm, including given ends. A closed path ends at
        its start. Empty for a cost matrix without coordinates.
    cost, bound
        Cost of travel and service, and its lower bound, in the unit of the problem. The bound is None until it is
        known.
    pheromone
        Pheromone of ant algorithms, else None.
    brightness
        Brightness of fireflies, 1 / length, float64[f], else None.
    """

    path: NDArray[np.float64]
    cost: float
    bound: float | None
    iteration: int
    seconds: float
    workers: tuple[WorkerFigures, ...] = ()
    pheromone: Pheromone | None = None
    brightness: NDArray[np.float64] | None = None
    step: SearchStep | None = None


class Observer:
    """Observes searches without changing their results.

    By default, the methods do nothing. Every method must return quickly.
    """

    def begin(self) -> None:
        """Called before each search."""

    def note(
        self,
        number: int,
        seconds: float,
        shortest: float,
        costs: NDArray[np.float64] | None = None,
        branching: Callable[[], float | None] = lambda: None,
        working: float = 0.0,
    ) -> None:
        """Called after each iteration with its number, the time since the start, and the cost of the best path.

        `costs` contains the cost of each path in the iteration, or inf for an unfinished path. `branching` returns the
        mean λ-branching factor. `working` is the total working time of all workers so far, s.
        """

    def show(self, take: Callable[[], Snapshot], alone: bool) -> None:
        """Called after `note`. The function `take` returns a snapshot, and may only be called during `show`.

        Call `take` only if a user is watching. If `alone`, the whole search waits for `show`, and its clock is stopped.
        """
