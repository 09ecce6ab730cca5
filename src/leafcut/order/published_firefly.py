"""The discrete firefly algorithm as it is published for pockets, beside leafcut's own way of `order.firefly`.

Source: G. K. Jati and Suyanto, ICAIS 2011, LNAI 6943, 393–403; of distances, modes and percentages, the published
system for milling pockets. A swarm of n random tours; two with different nodes at A of their h places are r = 10·A/h
apart. In an iteration every firefly makes m moves from where it is; of the m·n new tours the n shortest are the swarm.

What the sources leave open is settled as follows.

- A move tries as many inversions as the firefly is attracted, β = β0·exp(-γ·r²), all from the same tour, and has the
  best of them, shorter or not. Nobody sees nothing at β0.
- Of what the percentages for complex pockets are is not said; here of the iterations, or of the time limit. As the
  share by which the other firefly is brighter, as Ii = Ij for simple ones might suggest, tours of 318 cities stayed at
  twice the optimum: all are nearly as bright, and never came to move short.
- A long move inverts runs of up to h - 2 nodes, a short one no more than a quarter of the nodes; one that does not
  explore keeps to A nodes besides. Who sees nobody brighter or as bright moves far in simple mode.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import best_inversion, places_apart
from leafcut.order.algorithms import AlgorithmRun
from leafcut.order.construction import random_words
from leafcut.order.firefly import SHORT_SHARE, Flight, first_of, learn_nothing, share_done
from leafcut.order.instance import Instance
from leafcut.order.loop import search
from leafcut.order.observing import brightness_of
from leafcut.order.running import SearchResult, set_budget, until_interrupted
from leafcut.order.statistics import WorkerLog
from leafcut.order.stop import Stop

#: Moves of a firefly in an iteration (m).
MOVES = 2

#: Of complex pockets: fireflies explore below this share of the iterations, and move far below the other.
EXPLORE_BELOW, LONG_BELOW = 0.37, 0.27

#: Iterations of the presets: from 2000 to 6000 are published.
PRESETS = {"fast": 2000, "default": 4000, "thorough": 6000}


def longest_run(flight: Flight, as_bright: bool, done: float, apart: int, h: int) -> int:
    """Return how many nodes the longest inversion of a firefly has, 2 … h - 2.

    Parameters
    ----------
    as_bright
        The one that attracts it is as bright as itself, or there is none.
    done
        Share of the iterations, or of the time limit, that has gone.
    apart
        At how many places the one that attracts it has another node; h where there is none.
    """
    short = math.ceil(SHORT_SHARE * h)
    far = done < LONG_BELOW if flight.complex else as_bright
    explores = far or (flight.complex and done < EXPLORE_BELOW)
    longest = h if far else short if explores else min(apart, short)
    return max(2, min(longest, h - 2))


class PublishedFireflies:
    """The swarm, its tours, and what becomes of it in an iteration; on one thread, as it is over in no time."""

    def __init__(self, instance: Instance, flight: Flight, seed: int, stop: Stop) -> None:
        self.instance, self.flight, self.seed, self.stop = instance, flight, seed, stop
        self.log, self.done = WorkerLog.of(1), 0.0
        self.tours: Ints = np.stack([first_of(instance, flight, seed, f) for f in range(flight.fireflies)])
        self.lengths = self._lengths_of(self.tours)
        self.moved = np.zeros((MOVES * flight.fireflies, instance.n), dtype=np.int32)

    def _lengths_of(self, tours: Ints) -> NDArray[np.float64]:
        return np.array([tour_cost(self.instance.cost, tour) for tour in tours])

    def propose(self, iteration: int) -> tuple[Ints, NDArray[np.float64]]:
        """Return the swarm, int32[fireflies, h], and its lengths after every firefly has moved."""
        began = time.perf_counter()
        if iteration:
            self.done = share_done(self.stop, iteration)
            self._move(random_words(self.seed, iteration, count=len(self.tours)))
        self.log.add(0, len(self.tours), time.perf_counter() - began, float(self.lengths.min()))
        return self.tours, self.lengths

    def _move(self, words: NDArray[np.uint64]) -> None:
        for f, tour in enumerate(self.tours):
            tries, longest = self.aim(f)
            for move in range(MOVES):
                best_inversion(self.instance.cost, tour, tries, longest, words, f, self.moved[MOVES * f + move])
        lengths = self._lengths_of(self.moved)
        kept = np.argsort(lengths, kind="stable")[: len(self.tours)]
        self.tours, self.lengths = self.moved[kept], lengths[kept]

    def aim(self, f: int) -> tuple[int, int]:
        """Return how many inversions a move of a firefly tries, and how many nodes the longest has."""
        flight, h, length = self.flight, self.instance.n, float(self.lengths[f])
        others = [j for j in np.flatnonzero(self.lengths <= length).tolist() if j != f]
        if not others:
            return max(1, round(flight.attractiveness)), longest_run(flight, True, self.done, h, h)
        apart = {j: int(places_apart(self.tours[f], self.tours[j])) for j in others}
        target = flight.target(self.lengths, f, apart, h)
        tries, as_bright = max(1, round(flight.attraction(apart[target], h))), self.lengths[target] == length
        return tries, longest_run(flight, bool(as_bright), self.done, apart[target], h)


def run_published(instance: Instance, run: AlgorithmRun, flight: Flight) -> SearchResult:
    """Run the swarm until its iterations, its patience or its time is over."""
    options, stop, best = run.options, run.stop, run.best
    swarm = PublishedFireflies(instance, flight, options.seed, stop)
    set_budget(stop, options, PRESETS[options.preset])
    stop.patience = flight.patience
    if best.watched is not None:
        best.watched.workers = swarm.log.figures
        best.watched.brightness = lambda: brightness_of(swarm.lengths)
    iterations = until_interrupted(lambda: search(swarm.propose, learn_nothing, stop, best), best)
    return SearchResult(best.tour, iterations, swarm.log.figures())
