"""Kicks on several pieces of a tour in parallel.

A kick changes the tour locally, so distant sections can be kicked at the same time. The tour is cut into pieces of
consecutive nodes. Each piece is an instance with its two ends tied; workers kick the pieces, which are then joined
again. Every round cuts at other positions. A single worker gains a little too: its data are close in memory, and a
move rewrites at most one piece.

Source: D. S. Johnson and L. A. McGeoch, The traveling salesman problem: a case study in local optimization, in Aarts
and Lenstra (eds.), Local Search in Combinatorial Optimization, Wiley 1997 (tour-based partitioning).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import kick_and_mend
from leafcut.order.best import Best
from leafcut.order.construction import random_words
from leafcut.order.instance import Instance, matrix_of
from leafcut.order.kicks import BREADTH, choices, work_tour
from leafcut.order.stop import Stop
from leafcut.order.workers import Share, Workers

#: Approximate number of nodes in a piece. Moves across two pieces are not found: pieces of 5,000 nodes allow twice the
#: kicks per second of a whole tour of 100,000, but gain less.
PIECE = 20_000

#: Kicks per node in a round: few, so that the next round soon cuts at other positions.
KICKS_PER_NODE = 0.1

#: Kicks between two checks of the clock: a few milliseconds.
KICKS_PER_LOOK = 100

#: Time per node to join the pieces and evaluate the tour, s.
PUTTING_TOGETHER = 1.5e-7

# Purposes of random numbers; together with the seed they select the stream.
_KICKING, _CUTTING = 3, 4


@dataclass(frozen=True, eq=False)
class TourPiece:
    """Task of one worker in a round: a piece of a tour int32[m], a random state uint64[1], the number of kicks."""

    nodes: NDArray[np.int32]
    word: NDArray[np.uint64]
    kicks: int


def cut(instance: Instance, tour: NDArray[np.int32], random: np.random.Generator) -> list[NDArray[np.int32]]:
    """Cut the tour int32[n] into pieces of about `PIECE` nodes, at random positions and at the tied edge."""
    n, a, b = len(tour), instance.cost.tied_a, instance.cost.tied_b
    count = max(2, round(n / PIECE))
    if a < 0:
        return np.array_split(np.roll(tour, -int(random.integers(n))), count)
    at = int(np.flatnonzero(tour == a)[0])
    begin = at if tour[at - 1] == b else at + 1
    # The ends of the whole stay where they are: the first cut is at random a quarter to three quarters of a piece away.
    cuts = ((np.arange(count) + random.uniform(0.25, 0.75)) * (n / count)).astype(np.int64)
    return np.split(np.roll(tour, -begin), cuts)


def instance_of(instance: Instance, nodes: NDArray[np.int32]) -> tuple[Instance, NDArray[np.int32], NDArray[np.int32]]:
    """Return the instance of a piece int32[m] with tied ends, the piece in its numbering, and its labels int32[m]."""
    cost, m = instance.cost, len(nodes)
    label = np.sort(nodes)
    # The extra entry maps candidate -1 to -1.
    number = np.full(instance.n + 1, -1, dtype=np.int32)
    number[label] = np.arange(m, dtype=np.int32)
    candidates = number[instance.candidates[label]]
    outside = candidates < 0
    order = np.argsort(outside, axis=1, kind="stable")
    candidates = np.take_along_axis(candidates, order, axis=1)
    lengths = np.take_along_axis(np.where(outside, np.inf, instance.lengths[label]), order, axis=1)
    tour = number[nodes]
    own = cost._replace(
        plain=False,
        xy=cost.xy[label],
        matrix=matrix_of(cost, label),
        tied_a=int(tour[0]),
        tied_b=int(tour[-1]),
        free=int(number[cost.free]) if cost.free >= 0 else -1,
    )
    return replace(instance, cost=own, candidates=candidates, lengths=lengths, first=-1, second=-1), tour, label


def kick_piece(instance: Instance, piece: TourPiece, stop: Stop | None = None) -> Share:
    """Return the piece int32[1, m] after its kicks, with its first and last node unchanged, and no costs."""
    own, start, label = instance_of(instance, piece.nodes)
    tour, word = work_tour(start, queued=False, log=2 * own.n + 1000), piece.word.copy()
    breadth, spare = choices(own, BREADTH), PUTTING_TOGETHER * instance.n
    for made in range(0, piece.kicks, KICKS_PER_LOOK):
        if stop is not None and stop.now(spare):
            break
        kicks = min(KICKS_PER_LOOK, piece.kicks - made)
        kick_and_mend(own.cost, tour, *own.exchange_lists, breadth, word, 0, kicks)
    begin = int(tour.place[start[0]])
    nodes = np.roll(tour.node, -begin)
    if nodes[-1] != start[-1]:
        nodes = np.roll(nodes[::-1], 1)
    return label[nodes][None], np.zeros(0)


def kick_pieces(
    instance: Instance, tour: NDArray[np.int32], seed: int, best: Best, workers: Workers, iteration: int, most: float
) -> int:
    """Kick the pieces of a tour int32[n] in rounds (iterations), at most `most` times; return the last iteration."""
    made = 0
    while made < most and not workers.stop.reached(iteration, iteration - best.iteration):
        pieces = cut(instance, tour, np.random.default_rng((seed, _CUTTING, iteration)))
        words = random_words(seed, _KICKING, iteration, count=len(pieces))
        work = [TourPiece(p, words[k : k + 1], max(1, int(KICKS_PER_NODE * len(p)))) for k, p in enumerate(pieces)]
        tour = np.concatenate([nodes[0] for nodes, _ in workers.shares(kick_piece, instance, work)])
        iteration, made = iteration + 1, made + sum(piece.kicks for piece in work)
        best.offer(tour, float(tour_cost(instance.cost, tour)), iteration)
        best.tell(iteration)
    return iteration
