"""What an algorithm of the literature just did, in the numbers of its formulas: for those who watch it step by step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.pheromone import branching
from leafcut.model.snapshot import NextPlace, SearchStep
from leafcut.order.aco import BRANCHING_SHARE
from leafcut.order.statistics import Best

if TYPE_CHECKING:
    from leafcut.order.aco import ColonyTrails, Trails
    from leafcut.order.firefly import Flight
    from leafcut.order.instance import Instance


class AnySwarm(Protocol):
    """Fireflies, whatever they order."""

    flight: Flight
    lengths: NDArray[np.float64]
    #: The share of the search that had gone when they last flew, and whether local search mends what a flight changed.
    done: float
    mended: bool

    @property
    def size(self) -> int:
        """How many nodes, or clusters, a tour has."""
        ...

    def apart(self, one: int, other: int) -> int:
        """Return how many edges, or steps, of a firefly another one has not."""
        ...

    def moves_of(self, attraction: float) -> int:
        """Return how many moves a flight has."""
        ...


#: So many of the steps that an ant can take are told, the likeliest.
MOST_CHOICES = 5


def branching_of(trails: Trails) -> float:
    """Return the mean λ-branching factor of trails."""
    return float(branching(trails.lists, trails.pheromone, BRANCHING_SHARE))


def step_of_ants(trails: Trails, best: Best, choices: tuple[int, tuple[NextPlace, ...]] = (0, ())) -> SearchStep:
    """Return the step of an ant algorithm; `choices` are an example's place and what an ant can do there."""
    p = trails.parameters
    values = {
        "alpha": p.alpha, "beta": p.beta, "rho": p.rate, "m": p.ants, "tau_0": trails.initial,
        "epsilon": trails.offset, "c_best": best.cost, "lambda": branching_of(trails),
    }  # fmt: skip
    if trails.iteration_best < math.inf:
        values["c_iteration"] = trails.iteration_best
    if p.algorithm == "eas":
        values["e"] = p.elitist_weight
    if p.algorithm == "asrank":
        values["w"] = p.ranks
    if p.algorithm == "mmas":
        values |= {"tau_max": trails.highest, "tau_min": trails.lowest}
    if p.algorithm == "acs":
        values |= {"q_0": p.greedy_probability, "xi": p.local_rate}
    return SearchStep(p.algorithm, values, trails.depositor, *choices)


def choices_of(colony: ColonyTrails) -> tuple[int, tuple[NextPlace, ...]]:
    """Return the place where a tour begins, and the likeliest steps of an ant that begins there; numbers from 1."""
    instance = colony.instance
    here = int(np.flatnonzero(instance.label == 0)[0])
    near = instance.candidates[here]
    there = np.flatnonzero((near >= 0) & (instance.label[near] < instance.problem.n_clusters))
    weights = colony.weights[here, there]
    total = float(colony.weights[here][near >= 0].sum())
    if not 0.0 < total < math.inf:
        return 1, ()
    likeliest = there[np.argsort(-weights, kind="stable")[:MOST_CHOICES]]
    return 1, tuple(_choice(instance, colony, here, int(c), total) for c in likeliest)


def _choice(instance: Instance, colony: ColonyTrails, here: int, c: int, total: float) -> NextPlace:
    cost = float(instance.lengths[here, c])
    return NextPlace(
        place=int(instance.label[instance.candidates[here, c]]) + 1,
        cost=cost,
        pheromone=float(colony.pheromone[here, c]),
        attraction=1.0 / (cost + colony.offset),
        probability=float(colony.weights[here, c]) / total,
    )


def step_of_fireflies(swarm: AnySwarm, best: Best) -> SearchStep:
    """Return the next flight of the darkest firefly: how far the tour that attracts it is, and how it moves."""
    flight, lengths, h = swarm.flight, swarm.lengths, swarm.size
    dark = int(np.argmax(np.where(np.isfinite(lengths), lengths, -math.inf)))
    values = {
        "n": len(lengths), "beta_0": flight.attractiveness, "gamma": flight.absorption, "h": h, "c_best": best.cost,
        "dark": dark + 1, "c_dark": float(lengths[dark]),
    }  # fmt: skip
    seen = {j: swarm.apart(dark, j) for j in np.flatnonzero(lengths < lengths[dark]).tolist()}
    if seen:
        target = flight.target(lengths, dark, seen, h)
        values |= {"target": target + 1, "c_target": float(lengths[target]), "edges_apart": seen[target]}
        values["r"] = 10.0 * seen[target] / h
    beta, longest = flight.aim(lengths, dark, seen.__getitem__, h, swarm.done, swarm.mended)
    values |= {"beta": beta, "moves": swarm.moves_of(beta), "longest": longest}
    return SearchStep("firefly", values)
