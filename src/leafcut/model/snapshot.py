"""`Snapshot`: state of a search for observers, and the type of an observer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures


@dataclass(frozen=True, eq=False)
class Pheromone:
    """Pheromone on the edges between points.

    `points` is float64[m, 2], mm; `edges` is int32[k, 2], rows of `points`, without edges of negligible pheromone;
    `strength` is float32[k], 0 … 1: the agreement of the ants on an edge, 1 if every ant uses it.
    """

    points: NDArray[np.float64]
    edges: NDArray[np.int32]
    strength: NDArray[np.float32]


@dataclass(frozen=True)
class NextPlace:
    """A step that an ant can take from a point.

    `place` is the destination, from 1. `cost`, `pheromone` and `attraction` are d, τ, and η = 1 / (d + ε);
    `probability` is that for an ant at the start of its tour.
    """

    place: int
    cost: float
    pheromone: float
    attraction: float
    probability: float


@dataclass(frozen=True)
class SearchStep:
    """Last step of an algorithm from the literature, in the symbols of its formulas.

    Attributes
    ----------
    values
        By the symbols of `docs/glossary.md`, with words for indices in a formula: ``alpha``, ``tau_max``, ``c_best``
        (the best path yet), ``c_iteration`` (the best of this iteration).
    depositor
        Depositing ant of MAX–MIN Ant System: ``best``, ``iteration``, or ``restart`` after a reset of all trails.
    here, choices
        Point of an example, and its most likely steps; empty if steps have a direction.
    """

    algorithm: str
    values: Mapping[str, float]
    depositor: str = ""
    here: int = 0
    choices: tuple[NextPlace, ...] = ()


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a search.

    Attributes
    ----------
    path
        float64[m, 2], mm: points of the best path so far in the order of visits, including given ends; a closed path
        ends at its start. Empty for a cost matrix without coordinates.
    cost, bound
        Travel and service in the problem's unit; the lower bound is None before it is known.
    pheromone
        Of ants, else None.
    brightness
        Of fireflies, float64[f]: 1 / length; else None.
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


#: Called by a search between its steps with a function that takes a snapshot, valid during this call only, and whether
#: the whole search waits for the call, its clock stopped. The call does not change the result. It must be quick and
#: take no snapshot unless somebody is watching.
Observer = Callable[[Callable[[], Snapshot], bool], None]
