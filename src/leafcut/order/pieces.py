"""Kicks on several pieces of a tour at once.

What a kick changes lies in one place, so places that are far apart on the tour can be kicked at the same time. The
tour is cut into pieces of nodes that follow each other. Each is an instance of its own, whose two ends are tied;
workers kick them, and they are put together again. Every round cuts elsewhere. One worker gains a little, too: what it
touches is near in memory, and a move writes no more than a piece anew.

Source: D. S. Johnson and L. A. McGeoch, The traveling salesman problem: a case study in local optimization, in Aarts
and Lenstra (eds.), Local Search in Combinatorial Optimization, Wiley 1997 (tour-based partitioning).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.cost import tour_cost
from leafcut.kernels.kicks import kick_and_mend
from leafcut.order.best import Best
from leafcut.order.construction import random_words
from leafcut.order.instance import Instance, matrix_of
from leafcut.order.kicks import BREADTH, choices, work_tour
from leafcut.order.stop import Stop
from leafcut.order.workers import Share, Workers

#: Nodes of a piece, about. Moves that need nodes of two pieces are not found: pieces of 5,000 have twice the kicks per
#: second of a whole tour of 100,000, and gain less by them.
PIECE = 20_000

#: Kicks per node in a round: few, so that the next round may cut elsewhere soon.
KICKS_PER_NODE = 0.1

#: Kicks between two looks at the clock: some milliseconds.
KICKS_PER_LOOK = 100

#: Seconds per node that it takes to put the pieces together and to add them up.
PUTTING_TOGETHER = 1.5e-7

# What random numbers are for: with the seed this begins their stream.
_KICKING, _CUTTING = 3, 4


@dataclass(frozen=True, eq=False)
class TourPiece:
    """What one worker does in a round: a piece of a tour int32[m], a random word uint64[1], how often to kick it."""

    nodes: NDArray[np.int32]
    word: NDArray[np.uint64]
    kicks: int


def cut(instance: Instance, tour: NDArray[np.int32], random: np.random.Generator) -> list[NDArray[np.int32]]:
    """Return the tour int32[n] in pieces of about `PIECE` nodes, cut at random places, and where an edge is tied.

    How many there are depends on n alone.
    """
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
    """Return a piece int32[m] as an instance whose first and last node are tied, the piece in its numbers, and labels.

    The label int32[m] of a node is its number in the whole instance. Candidates outside of the piece are left out.
    """
    cost, m = instance.cost, len(nodes)
    label = np.sort(nodes)
    # One entry more: candidate -1 stays -1.
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
    """Return the piece int32[1, m] after its kicks, its first and its last node where they were, and no costs."""
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
    """Kick the pieces of a tour int32[n], round after round, until it is to stop or `most` times; return the iteration.

    A round is an iteration.
    """
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
