"""The discrete firefly algorithm as published for pocket milling; `fireflies` is leafcut's own variant.

Source: G. K. Jati and Suyanto, ICAIS 2011, LNAI 6943, 393–403; distances, modes and percentages come from the
published system for milling pockets. A swarm of n random tours; two tours with different nodes at A of their h places
have the distance r = 10·A/h. In an iteration every firefly makes m moves from its tour; the n shortest of the m·n new
tours are the swarm.

The sources leave some points open, which are decided as follows.

- The attractiveness β = β0·exp(-γ·r²) is the number of inversions that a move tries, all from the same tour. The move
  takes the best of them, even if it is longer. A firefly without a brighter one tries β0.
- The sources do not define the percentages for complex pockets. Here they are shares of the iterations or of the time
  limit. The condition Ii = Ij for simple pockets suggests relative brightness instead. With that, tours of 318 cities
  stayed at twice the optimum: all were nearly equally bright and never made short moves.
- A long move inverts runs of up to h - 2 nodes, a short one at most a quarter of the nodes; without exploration the
  limit is also A nodes. In simple mode, a firefly makes long moves if no other is as bright.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import best_inversion, places_apart
from leafcut.model.snapshot import SearchStep
from leafcut.options import SolveOptions
from leafcut.order.best import Best
from leafcut.order.construction import random_words
from leafcut.order.instance import Instance
from leafcut.order.literature.flight import SHORT_SHARE, Flight, Swarm, first_of, share_done
from leafcut.order.search import Tours, set_budget
from leafcut.order.stop import Stop

#: Moves of a firefly in an iteration (m).
MOVES = 2

#: For complex pockets: share of the iterations in which fireflies explore, and in which they make long moves.
EXPLORE_BELOW, LONG_BELOW = 0.37, 0.27

#: Iterations of the presets; the published range is 2000 to 6000.
PRESETS = {"fast": 2000, "default": 4000, "thorough": 6000}


def longest_run(flight: Flight, as_bright: bool, done: float, apart: int, h: int) -> int:
    """Return the number of nodes of the longest inversion of a firefly, 2 to h - 2.

    Parameters
    ----------
    as_bright
        The target is as bright as the firefly, or there is no target.
    done
        Share of the iterations, or of the time limit, that has passed.
    apart
        Number of positions at which the target has another node; h without a target.
    """
    short = math.ceil(SHORT_SHARE * h)
    far = done < LONG_BELOW if flight.complex else as_bright
    explores = far or (flight.complex and done < EXPLORE_BELOW)
    longest = h if far else short if explores else min(apart, short)
    return max(2, min(longest, h - 2))


class PublishedFireflies(Swarm):
    """The swarm and its moves, on one thread because iterations are short."""

    def __init__(self, instance: Instance, flight: Flight, options: SolveOptions, stop: Stop) -> None:
        super().__init__(instance, flight, options)
        self.instance, self.stop = instance, stop
        self.tours: Ints = np.stack([first_of(instance, flight, self.seed, f) for f in range(flight.fireflies)])
        self.lengths = self._lengths_of(self.tours)
        self.moved = np.zeros((MOVES * flight.fireflies, instance.n), dtype=np.int32)

    def set_budget(self, stop: Stop, options: SolveOptions) -> None:
        """Set the published number of iterations."""
        set_budget(stop, options, PRESETS[options.preset])

    def _lengths_of(self, tours: Ints) -> NDArray[np.float64]:
        return np.array([tour_cost(self.instance.cost, tour) for tour in tours])

    def construct(self, iteration: int) -> Tours:
        """Return the swarm, int32[fireflies, h], and its lengths after every firefly has moved."""
        began = time.perf_counter()
        if iteration:
            self.done = share_done(self.stop, iteration)
            self._move(random_words(self.seed, iteration, count=len(self.tours)))
        self.log.add(0, len(self.tours), time.perf_counter() - began, float(self.lengths.min()))
        return self.tours, self.lengths

    def _move(self, words: NDArray[np.uint64]) -> None:
        for f, tour in enumerate(self.tours):
            tries, longest = self.aim_of(f)
            for move in range(MOVES):
                best_inversion(self.instance.cost, tour, tries, longest, words, f, self.moved[MOVES * f + move])
        lengths = self._lengths_of(self.moved)
        kept = np.argsort(lengths, kind="stable")[: len(self.tours)]
        self.tours, self.lengths = self.moved[kept], lengths[kept]

    def aim_of(self, f: int) -> tuple[int, int]:
        """Return the number of inversions that a move of firefly `f` tries, and their maximum length."""
        flight, h, length = self.flight, self.size, float(self.lengths[f])
        others = [j for j in np.flatnonzero(self.lengths <= length).tolist() if j != f]
        if not others:
            return max(1, round(flight.attractiveness)), longest_run(flight, True, self.done, h, h)
        apart = {j: int(places_apart(self.tours[f], self.tours[j])) for j in others}
        target = flight.target(self.lengths, f, apart, h)
        tries, as_bright = max(1, round(flight.attraction(apart[target], h))), self.lengths[target] == length
        return tries, longest_run(flight, bool(as_bright), self.done, apart[target], h)

    def step(self, best: Best) -> SearchStep | None:
        """Return None: the lesson explains the moves of leafcut's variant."""
        return None
