"""The discrete firefly algorithm as published for pocket milling; `fireflies` is leafcut's own variant.

Source: the published system for milling pockets, after G. K. Jati and Suyanto, ICAIS 2011, LNAI 6943, 393–403. A swarm
of n random tours of h nodes. Two tours with different nodes at A of the h positions have the distance r = 10·A/h and
the attractiveness β = β0·exp(-γ·r²). In an iteration, each pair (i, j), i <= j, makes β0 moves: β of one firefly, then
β0 - β of the other. A move inverts the run between two positions. The n shortest results are the new swarm.

- Complex pockets: moves are long during the first 27 % of the iterations. During the first 37 %, a firefly explores: it
  makes all moves of the pair, whatever the brightness. Simple pockets use neither percentage.
- Fireflies of equal brightness make long moves. This includes each firefly with itself (i = j).
- All other moves are short.

About two points, the source is contradictory or silent. The option `--reading` decides them.

- In the listing of the algorithm, j moves towards i if I(i) < I(j), so the `brighter` firefly moves first. In the text,
  the less bright firefly (`darker`) moves towards the brighter one.
- The source does not state the length of a short inversion. It has 2 to h/10 nodes with `tenth`, and 2 to A nodes with
  `distance`, as in Jati and Suyanto.

The default fits the published tables best (`docs/experiments.md`).

Three more points are decided here: the number β is rounded down, every result is one inversion of a current tour, and
the percentages are shares of the iterations or of the time limit.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import PairRules, apply_results, move_pairs
from leafcut.model.snapshot import SearchStep
from leafcut.options import SolveOptions
from leafcut.order.construction import random_words
from leafcut.order.instance import Instance
from leafcut.order.literature.flight import Flight, Swarm, completed_share, initial_tour
from leafcut.order.search import Best, Tours, set_budget
from leafcut.order.stop import Stop

#: Complex pockets: share of the iterations in which fireflies explore, and in which all moves are long.
EXPLORE_BELOW, LONG_BELOW = 0.37, 0.27

#: Maximum length of a short inversion for a `--reading` with `tenth`, as a share of the nodes.
TENTH = 0.1

#: Iterations of the presets; the published range is 2000 to 6000.
PRESETS = {"fast": 2000, "default": 4000, "thorough": 6000}

#: Steps of the kernel between two checks of the clock, about 10 ms: compared places and moves.
STEPS_PER_CHECK = 2_000_000


class PublishedFireflies(Swarm):
    """The swarm of the published algorithm and its moves. It uses a single thread, because iterations are short."""

    def __init__(self, instance: Instance, flight: Flight, options: SolveOptions, stop: Stop) -> None:
        super().__init__(instance, flight, options)
        self.instance, self.stop = instance, stop
        self.tours: Ints = np.stack([initial_tour(instance, flight, self.seed, f) for f in range(flight.fireflies)])
        self.lengths = np.array([tour_cost(instance.cost, tour) for tour in self.tours])

    def set_budget(self, stop: Stop, options: SolveOptions) -> None:
        """Set the number of iterations of the preset."""
        set_budget(stop, options, PRESETS[options.preset])

    def construct(self, iteration: int) -> Tours:
        """Move every pair of fireflies. Return the tours of the swarm, int32[fireflies, h], and their lengths."""
        began = time.perf_counter()
        if iteration:
            self._move(random_words(self.seed, iteration, count=1), completed_share(self.stop, iteration))
        self.log.add(0, len(self.tours), time.perf_counter() - began, float(self.lengths.min()))
        return self.tours, self.lengths

    def rules(self, done: float) -> PairRules:
        """Return the rules of an iteration; `done` is the completed share of all iterations."""
        flight = self.flight
        return PairRules(
            moves=max(1, round(flight.attractiveness)),
            absorption=flight.absorption,
            long=flight.complex and done < LONG_BELOW,
            explore=flight.complex and done < EXPLORE_BELOW,
            darker_first=flight.darker_moves,
            short=0 if flight.short_by_distance else math.ceil(TENTH * self.size),
        )

    def _move(self, words: NDArray[np.uint64], done: float) -> None:
        """Replace the swarm with the n shortest results. If there are fewer results, some of the old tours remain."""
        n, rules = len(self.tours), self.rules(done)
        kept, lengths = np.zeros((n, 3), dtype=np.int32), np.full(n, math.inf)
        rows = max(1, STEPS_PER_CHECK // (n * (self.size + rules.moves)))
        for begin in range(0, n, rows):
            end = min(begin + rows, n)
            move_pairs(self.instance.cost, self.tours, self.lengths, begin, end, rules, words, 0, kept, lengths)
            if self.stop.now():
                break
        moved = self.tours.copy()
        apply_results(self.instance.cost, self.tours, kept[np.isfinite(lengths)], moved, lengths)
        self.tours, self.lengths = moved, lengths

    def step(self, best: Best) -> SearchStep | None:
        """Return None, because the studio explains only the moves of leafcut's own variant."""
        return None
