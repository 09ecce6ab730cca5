"""Iterated local search: make a small random change to a tour (a kick) and repair the tour locally.

The cost of a kick does not depend on the size of the tour.

Distant parts of a tour can be kicked at the same time. The search therefore cuts a large tour into pieces of
consecutive nodes and turns each piece into an instance with tied ends. Workers kick the pieces, and the search joins
them again. Each round cuts the tour at different positions. Even a single worker runs a little faster this way, because
its data are close together in memory and a move rewrites no more than one piece.

Source: D. S. Johnson and L. A. McGeoch, The traveling salesman problem: a case study in local optimization, in Aarts
and Lenstra (eds.), Local Search in Combinatorial Optimization, Wiley 1997 (tour-based partitioning).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import DEPTH, WAITING, Tour, improve_queued, kick_and_repair
from leafcut.kernels.long_edges import shorten_by_walking
from leafcut.model.solution import WorkerFigures
from leafcut.order.construction import greedy_tour, random_states
from leafcut.order.instance import MANY, Instance, costs_of_edges, matrix_of_nodes
from leafcut.order.search import AlgorithmRun, Best, SearchResult, run_steps, set_preset_budget
from leafcut.order.stop import Stop
from leafcut.order.workers import Share, Workers

#: A move tries this many candidates at each depth. On pcb3038 and rl11849, after 1 and 3 s, (8, 4, 2, 1) with two
#: neighbours per quadrant beat (5, 5, 3, 2), (5, 3, 2, 1) and (6, 4, 2, 1) with one neighbour.
BREADTH = (0, 8, 4, 2, 1)

#: As long as shorter moves remain, a move may rewrite at most this many tour positions. This saves a quarter of the
#: time with a million nodes and a fifth of the time with 86,000 nodes, for equally good tours.
LONGEST_REWRITE = 1000

#: The first improvement checks the clock after this many nodes, about every 10 ms.
NODES_PER_LOOK = 5000

#: When an end of a long edge walks, it takes at most this many steps, and all walks together rewrite at most this many
#: positions per node.
MOST_STEPS, PLACES_PER_NODE = 3000, 50

#: Budget of each preset: the number of kicks per node, and the maximum number of kicks.
PRESETS = {"fast": (10, 2e4), "default": (100, 2e5), "thorough": (2000, math.inf)}

#: Minimum interval between reports of an unfinished first tour, in seconds. Evaluating and copying a tour with a
#: million nodes takes 0.1 s.
OFFER_EVERY = 0.5


#: Approximate number of nodes in a piece. Compared with kicking a tour of 100,000 nodes as a whole, pieces of 5,000
#: nodes double the number of kicks per second but gain less, because they rule out moves across two pieces.
PIECE = 20_000

#: Number of kicks per node in a round. It is small so that the next round soon cuts the tour at other positions.
KICKS_PER_NODE = 0.1

#: Check the clock after this many kicks, which take a few milliseconds.
KICKS_PER_LOOK = 100

#: Time needed per node to join the pieces and evaluate the tour, in seconds.
PUTTING_TOGETHER = 1.5e-7

# Purposes of random numbers; together with the seed they select the stream.
_KICKING, _CUTTING = 3, 4


def kicks_per_iteration(n: int) -> int:
    """Choose the number of kicks per iteration.

    It is large enough that evaluating and copying the tour takes little time.
    """
    return max(200, n // 100)


def tour_with_buffers(node: NDArray[np.int32], queued: bool = True, log: int = 0) -> Tour:
    """Create a `Tour` from an array, int32[n], with all the buffers that the kernels need.

    If `queued` is set, the queue contains all nodes.
    """
    n = len(node)
    tour = Tour(
        node=node.copy(),
        place=np.zeros(n, dtype=np.int32),
        queue=np.zeros(n, dtype=np.int32),
        queued=np.zeros(n, dtype=np.uint8),
        counts=np.zeros(4, dtype=np.int64),
        log=np.zeros((log, 2), dtype=np.int32),
        buffer=np.zeros(n, dtype=np.int32),
        move=np.zeros((4, 2 * DEPTH), dtype=np.int64),
        gain=np.zeros(1),
    )
    tour.place[node] = np.arange(n, dtype=np.int32)
    if queued:
        tour.queue[:], tour.queued[:], tour.counts[1] = node, 1, n
    return tour


def queue_waiting_nodes(tour: Tour) -> None:
    """Refill the empty queue with the nodes whose exchange was too long for the buffer, in tour order."""
    waiting = tour.node[tour.queued[tour.node] == WAITING]
    tour.queue[: len(waiting)], tour.queued[waiting] = waiting, 1
    tour.counts[:2] = 0, len(waiting)


def search_breadth(instance: Instance, breadth: tuple[int, ...]) -> NDArray[np.int64]:
    """Choose the number of candidates to try at each depth, int64[DEPTH].

    The number never exceeds the candidate list length.
    """
    return np.minimum(np.array(breadth, dtype=np.int64), instance.exchange_candidates[0].shape[1])


def improve_queued_nodes(
    instance: Instance,
    tour: Tour,
    breadth: tuple[int, ...],
    stop: Stop,
    look: Callable[[], None] | None = None,
) -> bool:
    """Improve a tour at its queued nodes until `stop` returns True. Return whether the queue is empty.

    `look` is called regularly so that the caller can report the unfinished tour.
    """
    tries = search_breadth(instance, breadth)
    for longest in (LONGEST_REWRITE, instance.n):
        working = tour._replace(buffer=tour.buffer[:longest])
        if tour.counts[1] == 0:
            queue_waiting_nodes(tour)
        while tour.counts[1] > 0:
            if stop.must_stop():
                return False
            improve_queued(instance.cost, working, *instance.exchange_candidates, tries, NODES_PER_LOOK)
            if look is not None:
                look()
    return True


def shorten_long_edges(instance: Instance, tour: Tour) -> bool:
    """Try to replace edges that are longer than every candidate edge at their ends. Queue the nodes that change.

    Returns whether the tour became shorter.
    """
    ahead = np.roll(tour.node, -1)
    candidates, lengths = instance.exchange_candidates
    longest = np.maximum(lengths[tour.node, -1], lengths[ahead, -1])
    excess = costs_of_edges(instance.cost, tour.node, ahead) - longest
    at = np.flatnonzero(excess > 0.0)
    at = at[np.argsort(-excess[at], kind="stable")]
    edges = np.stack([tour.node[at], ahead[at]], axis=1)
    onto, steps = np.full(instance.n, -1, dtype=np.int32), np.zeros((MOST_STEPS, 2), dtype=np.int32)
    places = PLACES_PER_NODE * instance.n
    gain = shorten_by_walking(instance.cost, tour, candidates, lengths, edges, onto, steps, places)
    return bool(gain > 0.0)


def build_improved_greedy_tour(instance: Instance, breadth: tuple[int, ...], best: Best) -> NDArray[np.int32]:
    """Build the greedy tour, and improve it with `improve_queued_nodes`. Intermediate tours are offered to `best`.

    For a large tour, the last step shortens the long edges. On pla85900, with one thread and 1 s, the resulting tour is
    2.1 % above the optimum instead of 2.6 %. Ants skip this step, because recombination removes their long edges and
    the time is better spent on more ants.
    """
    stop, start = best.stop, greedy_tour(instance)
    best.offer(start, float(tour_cost(instance.cost, start)), 0)
    tour = tour_with_buffers(start)
    offered = stop.elapsed()

    def offer() -> None:
        nonlocal offered
        best.offer(tour.node, float(tour_cost(instance.cost, tour.node)), 0)
        best.tell(0)
        offered = stop.elapsed()

    def offer_regularly() -> None:
        if stop.elapsed() > offered + OFFER_EVERY:
            offer()

    done = improve_queued_nodes(instance, tour, breadth, stop, offer_regularly)
    if done and instance.n >= MANY and shorten_long_edges(instance, tour):
        improve_queued_nodes(instance, tour, breadth, stop, offer_regularly)
    offer()
    return tour.node


def kick_repeatedly(
    instance: Instance, node: NDArray[np.int32], seed: int, best: Best, iteration: int = 0, most: float = math.inf
) -> Iterator[None]:
    """Kick a locally optimal tour, int32[n], at most `most` times, with `kicks_per_iteration` kicks per iteration."""
    tour = tour_with_buffers(node, queued=False, log=2 * instance.n + 1000)
    breadth, words = search_breadth(instance, BREADTH), random_states(seed, 0, count=1)
    kicks, made = kicks_per_iteration(instance.n), 0
    while made < most:
        gained = kick_and_repair(instance.cost, tour, *instance.exchange_candidates, breadth, words, 0, kicks)
        iteration, made = iteration + 1, made + kicks
        if gained > 0.0:
            best.offer(tour.node, float(tour_cost(instance.cost, tour.node)), iteration)
        yield


def kick_within_time(
    instance: Instance, tour: Tour, word: NDArray[np.uint64], kicks: int, stop: Stop, spare: float = 0.0
) -> None:
    """Kick a tour `kicks` times, but stop when only `spare` seconds remain.

    Changes: tour, word (random state, uint64[1]).
    """
    breadth = search_breadth(instance, BREADTH)
    for made in range(0, kicks, KICKS_PER_LOOK):
        if stop.must_stop(spare):
            return
        some = min(KICKS_PER_LOOK, kicks - made)
        kick_and_repair(instance.cost, tour, *instance.exchange_candidates, breadth, word, 0, some)


def split_tour(instance: Instance, tour: Ints, random: np.random.Generator) -> list[Ints]:
    """Cut a tour, int32[n], into pieces of about `PIECE` nodes, at random positions and at the tied edge."""
    n, a, b = len(tour), instance.cost.tied_a, instance.cost.tied_b
    count = max(2, round(n / PIECE))
    if a < 0:
        return np.array_split(np.roll(tour, -int(random.integers(n))), count)
    at = int(np.flatnonzero(tour == a)[0])
    begin = at if tour[at - 1] == b else at + 1
    # The tour keeps its ends. The distance of the first cut from the start is random: 1/4 to 3/4 of a piece.
    cuts = ((np.arange(count) + random.uniform(0.25, 0.75)) * (n / count)).astype(np.int64)
    return np.split(np.roll(tour, -begin), cuts)


def build_piece_instance(instance: Instance, nodes: Ints) -> tuple[Instance, Ints, Ints]:
    """Turn a piece of a tour, int32[m], into an instance with tied ends.

    Returns the instance, the piece in the node numbers of this instance, and the labels of the piece's nodes, int32[m].
    """
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
        matrix=matrix_of_nodes(cost, label),
        tied_a=int(tour[0]),
        tied_b=int(tour[-1]),
        free=int(number[cost.free]) if cost.free >= 0 else -1,
    )
    return replace(instance, cost=own, candidates=candidates, lengths=lengths, first=-1, second=-1), tour, label


def kick_piece(instance: Instance, nodes: Ints, word: NDArray[np.uint64], kicks: int, stop: Stop) -> Share:
    """Kick a piece of a tour. Return the new piece, int32[1, m], and an empty array in place of costs.

    The first and the last node of the piece stay where they are. `word` is a random state, uint64[1]. Changes: word.
    """
    own, start, label = build_piece_instance(instance, nodes)
    tour = tour_with_buffers(start, queued=False, log=2 * own.n + 1000)
    kick_within_time(own, tour, word, kicks, stop, PUTTING_TOGETHER * instance.n)
    begin = int(tour.place[start[0]])
    nodes = np.roll(tour.node, -begin)
    if nodes[-1] != start[-1]:
        nodes = np.roll(nodes[::-1], 1)
    return label[nodes][None], np.zeros(0)


def kick_pieces(
    instance: Instance, tour: Ints, seed: int, best: Best, workers: Workers, iteration: int, most: float
) -> Iterator[None]:
    """Kick the pieces of a tour, int32[n], in rounds, with at most `most` kicks in total."""
    made = 0
    while made < most:
        pieces = split_tour(instance, tour, np.random.default_rng((seed, _CUTTING, iteration)))
        words = random_states(seed, _KICKING, iteration, count=len(pieces))
        kicks = [max(1, int(KICKS_PER_NODE * len(piece))) for piece in pieces]
        work = [partial(kick_piece, instance, p, words[k : k + 1], kicks[k]) for k, p in enumerate(pieces)]
        tour = np.concatenate([nodes[0] for nodes, _ in workers.run_tasks(work)])
        iteration, made = iteration + 1, made + sum(kicks)
        best.offer(tour, float(tour_cost(instance.cost, tour)), iteration)
        yield


def run_iterated_local_search(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the iterated local search within the preset's budget."""
    options, best = run.options, run.best
    per_node, most = PRESETS[options.preset]
    set_preset_budget(run.stop, options, min(per_node * instance.n, most) / kicks_per_iteration(instance.n))
    iterations = run_steps(
        kick_repeatedly(instance, build_improved_greedy_tour(instance, BREADTH, best), options.seed, best), best
    )
    kicks = iterations * kicks_per_iteration(instance.n)
    return SearchResult(best.tour, iterations, (WorkerFigures(0, kicks, run.stop.elapsed(), best.cost),))
