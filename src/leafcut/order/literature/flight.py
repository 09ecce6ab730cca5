"""Parameters of the firefly algorithm, and the base class of its variants. See `fireflies` for the sources."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.model.snapshot import SearchStep
from leafcut.options import FireflyOptions, SolveOptions
from leafcut.order.construction import greedy_tour
from leafcut.order.directed import AnyInstance
from leafcut.order.instance import Instance
from leafcut.order.search import Best, Population
from leafcut.order.stop import Stop
from leafcut.order.workers import WorkerLog

#: Number of fireflies and β0 for each value of `--variant`. The published values are 11 and 20 for simple pockets, and
#: 10 and 15 for complex pockets.
MODES = {"leafcut": (11, 20.0), "published": (11, 20.0), "published-complex": (10, 15.0)}

#: In leafcut's variant, inversions become short after this fraction of the search.
SWITCH = 0.27

#: The published system stops after this many iterations without a shorter tour.
PATIENCE = 20

#: Maximum length of a short inversion: a fraction of all nodes, or a number of nodes with repair.
SHORT_SHARE, SHORT_MENDED = 0.25, 50


@dataclass(frozen=True)
class Flight:
    """Options of the firefly algorithm. The defaults depend on the selected variant.

    `at_random` selects the published algorithm, which starts with random tours. `complex`, `darker_moves`, and
    `short_by_distance` are rules of the published algorithm (`published_fireflies`).
    """

    fireflies: int
    attractiveness: float
    absorption: float
    patience: float
    at_random: bool
    complex: bool
    darker_moves: bool
    short_by_distance: bool

    @classmethod
    def from_options(cls, options: FireflyOptions, limited: bool) -> Flight:
        """Read the parameters from the options.

        If the time or the iterations are `limited`, the search does not stop early when it finds no improvement.
        """
        count, attractiveness = MODES[options.variant]
        moving, short_limit = options.reading.split("-")
        return cls(
            fireflies=options.n_fireflies or count,
            attractiveness=attractiveness if options.attractiveness is None else options.attractiveness,
            absorption=options.absorption,
            patience=math.inf if limited else PATIENCE,
            at_random=options.variant != "leafcut",
            complex=options.variant == "published-complex",
            darker_moves=moving == "darker",
            short_by_distance=short_limit == "distance",
        )

    def attraction(self, apart: int, h: int) -> float:
        """Compute the attractiveness β between two tours of h nodes that differ in `count_different_edges` edges."""
        r = 10.0 * apart / h
        return self.attractiveness * math.exp(-self.absorption * r * r)

    def most_attractive(self, lengths: NDArray[np.float64], f: int, apart: dict[int, int], h: int) -> int:
        """Find the most attractive of the brighter fireflies and return its index. The brightness is 1 / length."""
        # Costs from a table may be negative. Then all fireflies are equally bright.
        floor = max(float(lengths[f]), 1e-300)
        return max(apart, key=lambda j: self.attraction(apart[j], h) * floor / max(float(lengths[j]), 1e-300))

    def choose_target(
        self, lengths: NDArray[np.float64], f: int, apart: Callable[[int], int], h: int, done: float, mended: bool
    ) -> tuple[float, int]:
        """Return the attractiveness of a firefly's target, and the maximum number of nodes in an inversion.

        `apart` returns the number of edges in which the firefly differs from another firefly.
        """
        short = SHORT_MENDED if mended else math.ceil(SHORT_SHARE * h)
        seen = {j: apart(j) for j in np.flatnonzero(lengths < lengths[f]).tolist()}
        if not seen:
            return self.attractiveness, self.longest_inversion(h, h, done, short)
        away = seen[self.most_attractive(lengths, f, seen, h)]
        return self.attraction(away, h), self.longest_inversion(away, h, done, short)

    def longest_inversion(self, apart: int, h: int, share_done: float, short: int) -> int:
        """Return the maximum number of nodes in an inversion, between 2 and h - 2."""
        limit = apart if share_done < SWITCH else min(apart, short)
        return max(2, min(limit, h - 2))


def completed_share(stop: Stop, iteration: int) -> float:
    """Compute the fraction of the iterations or of the time limit that is used up, from 0 to 1."""
    return max(stop.elapsed() / stop.seconds, iteration / stop.iterations)


class Swarm(Population):
    """Fireflies with their parameters and tour lengths, and a view of the swarm for observers."""

    def __init__(self, instance: AnyInstance, flight: Flight, options: SolveOptions, workers: int = 1) -> None:
        super().__init__(instance, WorkerLog.empty(workers))
        self.flight, self.seed, self.mended = flight, options.seed, options.local_search
        self.size = instance.n
        self.lengths = np.full(flight.fireflies, math.inf)
        #: Progress of the search at the last move, from 0 to 1.
        self.done = 0.0

    def set_budget(self, stop: Stop, options: SolveOptions) -> None:
        """Set the preset's budget."""
        raise NotImplementedError

    def offer_first_solution(self, best: Best) -> None:
        """Offer the first tour if its cost is known."""

    def count_different_edges(self, one: int, other: int) -> int:
        """Count the edges in tour `one` that are missing in tour `other`."""
        raise NotImplementedError

    def moves_per_flight(self, attraction: float) -> int:
        """Return the number of moves in a flight."""
        raise NotImplementedError

    def moves_to_target(self, f: int) -> tuple[int, int]:
        """Choose the number of a firefly's moves towards its target, and the maximum length of an inversion."""
        attraction, longest = self.flight.choose_target(
            self.lengths, f, lambda j: self.count_different_edges(f, j), self.size, self.done, self.mended
        )
        return self.moves_per_flight(attraction), longest

    def snapshot_fields(self, best: Best) -> dict[str, Any]:
        """Return the fields that this algorithm adds to a snapshot: worker statistics, brightness, and next step."""
        return super().snapshot_fields(best) | {
            "brightness": self.brightness(),
            "step": self.describe_next_flight(best),
        }

    def brightness(self) -> NDArray[np.float64]:
        """Compute each firefly's brightness, 1 / length. It is 0 if the length is unknown or not positive."""
        known = np.isfinite(self.lengths) & (self.lengths > 0.0)
        return np.where(known, 1.0 / np.where(known, self.lengths, 1.0), 0.0)

    def describe_next_flight(self, best: Best) -> SearchStep | None:
        """Describe the darkest firefly's next flight: the distance to its target, and the moves."""
        flight, lengths, h = self.flight, self.lengths, self.size
        dark = int(np.argmax(np.where(np.isfinite(lengths), lengths, -math.inf)))
        values = {
            "n": len(lengths), "beta_0": flight.attractiveness, "gamma": flight.absorption, "h": h,
            "c_best": best.cost, "dark": dark + 1, "c_dark": float(lengths[dark]),
        }  # fmt: skip
        seen = {j: self.count_different_edges(dark, j) for j in np.flatnonzero(lengths < lengths[dark]).tolist()}
        if seen:
            target = flight.most_attractive(lengths, dark, seen, h)
            values |= {"target": target + 1, "c_target": float(lengths[target]), "edges_apart": seen[target]}
            values["r"] = 10.0 * seen[target] / h
        beta, longest = flight.choose_target(lengths, dark, seen.__getitem__, h, self.done, self.mended)
        values |= {"beta": beta, "moves": self.moves_per_flight(beta), "longest": longest}
        return SearchStep("firefly", values)


def initial_tour(instance: Instance, flight: Flight, seed: int, f: int) -> Ints:
    """Create a firefly's initial tour, int32[h]: a random tour, or the greedy tour with small random changes."""
    rng = np.random.default_rng((seed, f))
    if not flight.at_random:
        return greedy_tour(instance, rng if f else None)
    tied = [node for node in (instance.first, instance.second) if instance.second >= 0]
    return np.append(rng.permutation(np.setdiff1d(np.arange(instance.n), tied)), tied).astype(np.int32)
