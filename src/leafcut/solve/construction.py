"""The friendly side of the construction kernels: buffers of one worker, and the nearest-neighbour tour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.construct import nearest_neighbour_tour
from leafcut.solve.instance import Instance


@dataclass(frozen=True, eq=False)
class Scratch:
    """What one worker needs to build a tour: visited uint8[n], alive int32[tree nodes], stack int32[64]."""

    visited: NDArray[np.uint8]
    alive: NDArray[np.int32]
    stack: NDArray[np.int32]

    @classmethod
    def of(cls, instance: Instance) -> Scratch:
        """Return fresh buffers for one worker."""
        return cls(
            np.zeros(instance.n, dtype=np.uint8),
            np.zeros(len(instance.tree.parent), dtype=np.int32),
            np.zeros(64, dtype=np.int32),
        )


def nearest_neighbour(instance: Instance) -> NDArray[np.int32]:
    """Return the nearest-neighbour tour int32[n], from the given start or from node 0."""
    tour = np.zeros(instance.n, dtype=np.int32)
    scratch = Scratch.of(instance)
    first = instance.first if instance.first >= 0 else 0
    words = np.ones(1, dtype=np.uint64)
    nearest_neighbour_tour(
        instance.cost, instance.tree, first, instance.second, words, tour,
        scratch.visited, scratch.alive, scratch.stack,
    )  # fmt: skip
    return tour


def random_words(seed: int, iteration: int, count: int) -> NDArray[np.uint64]:
    """Return one random word per ant, uint64[count], none of them 0: a function of seed, iteration and ant alone."""
    words = np.random.SeedSequence((seed, iteration)).generate_state(count, np.uint64)
    return np.maximum(words, np.uint64(1))
