"""Iterated local search: perturb one tour locally and repair it there. The cost of a kick does not grow with n."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Ints
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.lin_kernighan import DEPTH, WAITING, Tour, improve_queued, kick_and_mend
from leafcut.kernels.long_edges import bring_home
from leafcut.model.solution import WorkerFigures
from leafcut.order.best import Best
from leafcut.order.construction import greedy, random_words
from leafcut.order.instance import Instance, costs_of_edges
from leafcut.order.search import AlgorithmRun, SearchResult, set_budget, until_interrupted
from leafcut.order.stop import Stop

#: Candidates tried at each depth of a move. Measured at 1 and 3 s on pcb3038 and rl11849: (8, 4, 2, 1) with two
#: neighbours per quadrant was better than (5, 5, 3, 2), (5, 3, 2, 1) and (6, 4, 2, 1) with one.
BREADTH = (0, 8, 4, 2, 1)
CANDIDATES = 8

#: Maximum number of tour positions that a move may rewrite while shorter moves remain. Measured for equally good tours:
#: a million nodes take a quarter less time, 86 thousand a fifth less.
LONGEST_REWRITE = 1000

#: Nodes processed between two checks of the clock in the first improvement: about 10 ms.
NODES_PER_LOOK = 5000

#: From this number of nodes on there is time for few ants only. The first tour is therefore also searched for long
#: edges after the last improving exchange, and kicks are applied to several pieces of the tour in parallel.
MANY = 20_000

#: Maximum steps of one end of a long edge, and maximum positions rewritten by all of them together, per node.
MOST_STEPS, PLACES_PER_NODE = 3000, 50

#: Budget of each preset: kicks per node, and maximum number of kicks.
PRESETS = {"fast": (10, 2e4), "default": (100, 2e5), "thorough": (2000, math.inf)}

#: Minimum interval between reports of an unfinished first tour, s. Evaluating and copying a tour of a million nodes
#: takes 0.1 s.
OFFER_EVERY = 0.5


def kicks_per_iteration(n: int) -> int:
    """Return the kicks per iteration: enough that evaluating and copying the tour takes little time in comparison."""
    return max(200, n // 100)


def work_tour(node: NDArray[np.int32], queued: bool = True, log: int = 0) -> Tour:
    """Return a tour int32[n] with the buffers that the kernels need, and all nodes or none in the queue."""
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


def queue_waiting(tour: Tour) -> None:
    """Fill the empty queue with the nodes whose move was too long for the buffer, in tour order."""
    waiting = tour.node[tour.queued[tour.node] == WAITING]
    tour.queue[: len(waiting)], tour.queued[waiting] = waiting, 1
    tour.counts[:2] = 0, len(waiting)


def choices(instance: Instance, breadth: tuple[int, ...]) -> NDArray[np.int64]:
    """Return the number of candidates tried at each depth, int64[DEPTH], limited to the length of the lists."""
    return np.minimum(np.array(breadth, dtype=np.int64), instance.exchange_lists[0].shape[1])


def descend(
    instance: Instance,
    tour: Tour,
    breadth: tuple[int, ...],
    stop: Stop | None,
    look: Callable[[], None] | None = None,
) -> bool:
    """Improve a tour at its queued nodes until `stop`; return whether the queue is empty. `look` is called regularly,
    so that the caller can report the unfinished tour.
    """
    tries = choices(instance, breadth)
    for longest in (LONGEST_REWRITE, instance.n):
        working = tour._replace(buffer=tour.buffer[:longest])
        if tour.counts[1] == 0:
            queue_waiting(tour)
        while tour.counts[1] > 0:
            if stop is not None and stop.now():
                return False
            improve_queued(instance.cost, working, *instance.exchange_lists, tries, NODES_PER_LOOK)
            if look is not None:
                look()
    return True


def shorten_long_edges(instance: Instance, tour: Tour) -> bool:
    """Replace edges longer than every candidate edge at their ends, and queue their nodes; return whether it helped."""
    ahead = np.roll(tour.node, -1)
    candidates, lengths = instance.exchange_lists
    longest = np.maximum(lengths[tour.node, -1], lengths[ahead, -1])
    excess = costs_of_edges(instance.cost, tour.node, ahead) - longest
    at = np.flatnonzero(excess > 0.0)
    at = at[np.argsort(-excess[at], kind="stable")]
    edges = np.stack([tour.node[at], ahead[at]], axis=1)
    onto, steps = np.full(instance.n, -1, dtype=np.int32), np.zeros((MOST_STEPS, 2), dtype=np.int32)
    places = PLACES_PER_NODE * instance.n
    gain = bring_home(instance.cost, tour, candidates, lengths, edges, onto, steps, places)
    return bool(gain > 0.0)


def first_tour(instance: Instance, breadth: tuple[int, ...], stop: Stop, best: Best) -> NDArray[np.int32]:
    """Build the greedy tour, improve it with `descend`, and return it. Intermediate tours are offered to `best`.

    Long edges of a large tour are shortened last. Measured on pla85900, one thread, 1 s: 2.1 % above the optimum
    instead of 2.6 %. Ants skip this step: recombination removes their long edges, and the time allows more ants.
    """
    start = greedy(instance)
    best.offer(start, float(tour_cost(instance.cost, start)), 0)
    tour = work_tour(start)
    offered = stop.elapsed()

    def offer() -> None:
        nonlocal offered
        best.offer(tour.node, float(tour_cost(instance.cost, tour.node)), 0)
        best.tell(0)
        offered = stop.elapsed()

    def look() -> None:
        if stop.elapsed() > offered + OFFER_EVERY:
            offer()

    done = descend(instance, tour, breadth, stop, look)
    if done and instance.n >= MANY and shorten_long_edges(instance, tour):
        descend(instance, tour, breadth, stop, look)
    offer()
    return tour.node


def improve_by_kicks(instance: Instance, seed: int, stop: Stop, best: Best) -> int:
    """Improve the greedy tour to a local optimum, then by `kicks_per_iteration` kicks; return the iterations."""
    return kick_on(instance, first_tour(instance, BREADTH, stop, best), seed, stop, best, 0, math.inf)


def kick_on(
    instance: Instance, node: NDArray[np.int32], seed: int, stop: Stop, best: Best, iteration: int, most: float
) -> int:
    """Kick a locally optimal tour int32[n] until `stop`, at most `most` times; return the last iteration number."""
    tour = work_tour(node, queued=False, log=2 * instance.n + 1000)
    breadth, words = choices(instance, BREADTH), random_words(seed, 0, count=1)
    kicks, made = kicks_per_iteration(instance.n), 0
    while made < most and not stop.reached(iteration, iteration - best.iteration):
        gained = kick_and_mend(instance.cost, tour, *instance.exchange_lists, breadth, words, 0, kicks)
        iteration, made = iteration + 1, made + kicks
        if gained > 0.0:
            best.offer(tour.node, float(tour_cost(instance.cost, tour.node)), iteration)
        best.tell(iteration)
    return iteration


def run_kicks(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the iterated local search with the budget of the preset."""
    options, stop, best = run.options, run.stop, run.best
    per_node, most = PRESETS[options.preset]
    set_budget(stop, options, min(per_node * instance.n, most) / kicks_per_iteration(instance.n))
    iterations = until_interrupted(lambda: improve_by_kicks(instance, options.seed, stop, best), best)
    kicks = iterations * kicks_per_iteration(instance.n)
    return SearchResult(best.tour, iterations, (WorkerFigures(0, kicks, stop.elapsed(), best.cost),))


def warm_kicks(instance: Instance, run: AlgorithmRun, large: bool) -> Ints:
    """Call every kernel of `run_kicks`; a `large` problem has long edges."""
    tour = run_kicks(instance, run).tour
    if large:
        shorten_long_edges(instance, work_tour(tour))
    return tour
