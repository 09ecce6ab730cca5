"""The discrete firefly algorithm as published for pocket milling. For leafcut's own variant, see `fireflies`.

Source: the published system for milling pockets, after G. K. Jati and Suyanto, ICAIS 2011, LNAI 6943, 393–403. The
swarm consists of n random tours of h nodes. If two tours have different nodes at A of the h positions, their distance
is r = 10·A/h, and their attractiveness is β = β0·exp(-γ·r²). In an iteration, each pair of fireflies (i, j) with i <= j
makes β0 moves: one firefly makes β of them, then the other firefly makes the remaining β0 - β. A move inverts the run
between two positions. The n shortest results form the new swarm.

- Complex pockets: during the first 27 % of the iterations, moves are long. During the first 37 %, a firefly explores,
  which means that it makes all moves of the pair, whatever its brightness. Simple pockets use neither percentage.
- Fireflies of equal brightness make long moves. This includes each firefly paired with itself (i = j).
- All other moves are short.

On two points, the source contradicts itself or gives no answer. The option `--reading` decides them.

- The algorithm's listing moves j towards i if I(i) < I(j), so the `brighter` firefly moves first. According to the
  text, the less bright firefly (`darker`) moves towards the brighter firefly.
- The source does not specify the length of a short inversion. With `tenth`, a short inversion has 2 to h/10 nodes. With
  `distance`, it has 2 to A nodes, as in Jati and Suyanto.

The default fits the published tables best (`docs/experiments.md`).

We decided three more points: β is rounded down, every result is one inversion of a current tour, and the percentages
apply to the iterations or to the time limit.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import PairRules, move_firefly_pairs, write_result_tours
from leafcut.model.snapshot import SearchStep
from leafcut.options import SolveOptions
from leafcut.order.construction import random_states
from leafcut.order.instance import Instance
from leafcut.order.literature.flight import Flight, Swarm, completed_share, initial_tour
from leafcut.order.search import Best, Tours, set_preset_budget
from leafcut.order.stop import Stop

#: For complex pockets: during these fractions of the iterations, fireflies explore, and all moves are long.
EXPLORE_BELOW, LONG_BELOW = 0.37, 0.27

#: With a `--reading` that contains `tenth`, a short inversion contains at most this fraction of the nodes.
TENTH = 0.1

#: Number of iterations for each preset. The published range is 2000 to 6000.
PRESETS = {"fast": 2000, "default": 4000, "thorough": 6000}

#: The kernel checks the clock after this many steps, about every 10 ms. A step compares a position or makes a move.
STEPS_PER_CHECK = 2_000_000


class PublishedFireflies(Swarm):
    """The published algorithm's swarm and moves. It runs in a single thread because iterations are short."""

    def __init__(self, instance: Instance, flight: Flight, options: SolveOptions, stop: Stop) -> None:
        super().__init__(instance, flight, options)
        self.instance, self.stop = instance, stop
        self.tours: Ints = np.stack([initial_tour(instance, flight, self.seed, f) for f in range(flight.fireflies)])
        self.lengths = np.array([tour_cost(instance.cost, tour) for tour in self.tours])

    def set_budget(self, stop: Stop, options: SolveOptions) -> None:
        """Set the preset's number of iterations."""
        set_preset_budget(stop, options, PRESETS[options.preset])

    def construct(self, iteration: int) -> Tours:
        """Move every pair of fireflies. Return the swarm's tours, int32[fireflies, h], and their lengths."""
        began = time.perf_counter()
        if iteration:
            self._move_swarm(random_states(self.seed, iteration, count=1), completed_share(self.stop, iteration))
        self.log.add(0, len(self.tours), time.perf_counter() - began, float(self.lengths.min()))
        return self.tours, self.lengths

    def pair_rules(self, done: float) -> PairRules:
        """Return the rules for an iteration. `done` is the completed fraction of all iterations."""
        flight = self.flight
        return PairRules(
            moves=max(1, round(flight.attractiveness)),
            absorption=flight.absorption,
            long=flight.complex and done < LONG_BELOW,
            explore=flight.complex and done < EXPLORE_BELOW,
            darker_first=flight.darker_moves,
            short=0 if flight.short_by_distance else math.ceil(TENTH * self.size),
        )

    def _move_swarm(self, words: NDArray[np.uint64], done: float) -> None:
        """Replace the swarm with the n shortest results. If there are fewer than n results, some old tours remain."""
        n, rules = len(self.tours), self.pair_rules(done)
        kept, lengths = np.zeros((n, 3), dtype=np.int32), np.full(n, math.inf)
        rows = max(1, STEPS_PER_CHECK // (n * (self.size + rules.moves)))
        for begin in range(0, n, rows):
            end = min(begin + rows, n)
            move_firefly_pairs(self.instance.cost, self.tours, self.lengths, begin, end, rules, words, 0, kept, lengths)
            if self.stop.must_stop():
                break
        moved = self.tours.copy()
        write_result_tours(self.instance.cost, self.tours, kept[np.isfinite(lengths)], moved, lengths)
        self.tours, self.lengths = moved, lengths

    def describe_next_flight(self, best: Best) -> SearchStep | None:
        """Always return None. The studio only explains the moves of leafcut's own variant."""
        return None
