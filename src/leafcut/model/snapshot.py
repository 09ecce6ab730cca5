"""`Snapshot`: where a search stands, for those who watch it; and what an observer of searches is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures


@dataclass(frozen=True, eq=False)
class Pheromone:
    """What ants have laid on the edges between places.

    Attributes
    ----------
    points
        float64[m, 2], mm.
    edges
        int32[k, 2]: rows of `points`. Edges with next to nothing on them are left out.
    strength
        float32[k], 0 … 1: how far the ants agree on an edge. 1 where every ant goes along it.
    """

    points: NDArray[np.float64]
    edges: NDArray[np.int32]
    strength: NDArray[np.float32]


@dataclass(frozen=True)
class NextPlace:
    """One of the steps that an ant can take from a place.

    Attributes
    ----------
    place
        Where it leads: the number of a point or hole, from 1.
    cost, pheromone, attraction
        Of the step: d, τ, and η = 1 / (d + ε).
    probability
        With which an ant takes it that has been at none of the places.
    """

    place: int
    cost: float
    pheromone: float
    attraction: float
    probability: float


@dataclass(frozen=True)
class SearchStep:
    """What an algorithm of the literature just did, in the numbers of its formulas.

    Attributes
    ----------
    algorithm
        Its name among the options.
    values
        By the letters of `docs/glossary.md`, with words where a formula has an index: ``alpha``, ``tau_max``,
        ``c_best`` (the best path so far), ``c_iteration`` (the best of this iteration).
    depositor
        Who of MAX–MIN Ant System laid pheromone: ``best``, ``iteration``, or ``restart`` where all trails are equal
        again.
    here, choices
        The place of an example, and the likeliest steps from there; none where steps have a direction.
    """

    algorithm: str
    values: Mapping[str, float]
    depositor: str = ""
    here: int = 0
    choices: tuple[NextPlace, ...] = ()


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment of a search.

    Attributes
    ----------
    path
        float64[m, 2], mm: the places of the best path so far in the order of their visit, given ends included; a closed
        path ends where it began. Of a table of costs without places it has no length.
    cost, bound
        Travel and service in the problem's unit; the lower bound is None where none is known yet.
    iteration, seconds
        Counted as the search counts them; seconds by its clock, which may stand still.
    workers
        What every worker has done so far; empty where there is one.
    pheromone
        Of ants, else None.
    brightness
        Of fireflies, float64[f]: 1 / length; else None.
    step
        What the algorithm did, where it is one of the literature; else None.
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


#: Called by a search between its steps with a function that takes a snapshot, good for this call only, and whether the
#: whole search waits for the call to return, its clock stopped. What it does changes no result; where nobody looks it
#: must be quick and take none.
Observer = Callable[[Callable[[], Snapshot], bool], None]
