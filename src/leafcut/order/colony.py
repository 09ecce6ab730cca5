"""Colony search: ants build tours independently and then recombine them until all tours have the same cost.

Each ant has one tour. The pheromone on an edge is the number of ants that use the edge. Unused edges are not stored. In
each generation, every ant gets a partner. Wherever the two tours differ, the ant tries the partner's edges and keeps
them if they shorten its own tour (`kernels.assembly`). When a colony stops improving, the search starts a larger
colony. At the end, the best ant of each colony joins a final colony of champions.

Sources: M. Guntsch and M. Middendorf, EvoWorkshops 2002, LNCS 2279, for pheromone represented by a population of tours.
Y. Nagata and S. Kobayashi, INFORMS J. Computing 25 (2013), for edge assembly crossover and for pairing by a random
permutation.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import EPSILON
from leafcut.kernels.assembly import MOST_CHANGES, Assembly, recombine_by_edge_assembly
from leafcut.kernels.cost import tour_cost
from leafcut.order.construction import greedy_tour, random_states
from leafcut.order.instance import MANY, Instance
from leafcut.order.kicks import (
    NODES_PER_LOOK,
    build_improved_greedy_tour,
    improve_queued_nodes,
    kick_pieces,
    kick_repeatedly,
    kick_within_time,
    search_breadth,
    tour_with_buffers,
)
from leafcut.order.pheromone_view import pheromone_from_tours
from leafcut.order.search import AlgorithmRun, Best, SearchResult, SearchView, run_steps
from leafcut.order.stop import Stop
from leafcut.order.workers import Share, WorkerLog, Workers, thread_count, thread_pool

#: Exchanges try this many candidates at each depth, both when an ant builds a tour and when it repairs a recombined
#: tour.
BREADTH = (0, 8, 5, 3, 1)

#: Work budget of each preset. It counts the nodes in all tours that the ants build.
PRESETS = {"fast": 1e5, "default": 6e5, "thorough": 1e7}

#: Size of the first colony, growth factor from one colony to the next, and maximum size. A colony never has more ants
#: than the problem has nodes.
FIRST_ANTS, GROWTH, MOST_ANTS = 8, 4, 400

#: Minimum number of ants in a colony. A smaller colony gains so little that kicking the best tour is a better use of
#: the time. From `MANY` nodes on, recombining even two ants with the champions gains more than kicks: on pla85900 after
#: 3 s, the tour is 1.1 % above the optimum instead of 1.5 %.
FEWEST_ANTS, FEWEST_OF_MANY = 4, 2

#: Minimum number of ants under a time limit. On pcb3038 after 0.1 s, the tour is 1.0 % above the optimum instead of
#: 1.2 %.
FEWEST_BY_CLOCK = 2

#: If fewer than this many colonies fit into the remaining work budget or time limit, the next colony uses the whole
#: remainder. Smaller colonies take time and hardly help the last colony. In a long search, however, they provide a good
#: tour early, in case the user stops the search.
ALL_OF_BUDGET, ALL_BY_CLOCK = 2, 16

#: A colony ends when this many generations have passed without any gain.
PATIENCE = 3

#: Patience under a time limit. Here, a generation also counts as a failure if the best tour has not improved and the
#: mean gain is below this fraction of the mean excess over the best cost. Kicks use the remaining time better.
PATIENCE_BY_CLOCK, LITTLE = 2, 0.02

#: The search ends when this many colonies in a row fail to find a better tour. The second value applies to searches
#: with a work budget.
SAME_ANSWERS, SAME_ANSWERS_ON_BUDGET = 5, 2

#: Assumed time per node for building a tour, in seconds, measured on a core of a 2024 processor. Because this is a
#: constant, results are reproducible.
SECONDS_PER_VISIT = 3e-5

#: The last colony spends this fraction of the remaining time on building tours. Recombining them takes about as long.
BUILDING_SHARE = 0.44

#: Building a randomized greedy tour takes this many times as long as building the deterministic greedy tour.
WHIMS = 1.3

#: Settings for kicks before recombination under a time limit. Kicks repair local defects, and recombination repairs
#: large-scale defects. The values are: kicks per node; the minimum number of ants in a colony with kicks; the building
#: time of such ants relative to other ants; and the fraction of the remaining time that the last colony spends on
#: building tours.
KICKS_BEFORE, FEWEST_KICKING, KICKING_TAKES, KICKING_SHARE = 0.5, 12, 5.0, 0.75

#: Split a generation into this many batches per worker. More batches balance the load better, and fewer batches have
#: less overhead.
MEETINGS_PER_WORKER = 2

#: If colonies find no improvement, the search kicks this many times per node. All ants follow the same rules, so all of
#: them may miss the same improvement.
LAST_KICKS = 20

#: A kick takes about as long as ten node visits, so this many kicks take as long as one visit.
KICKS_PER_VISIT = 0.1

# Purposes of random numbers; together with the seed they select the stream.
_BUILDING, _FOLLOWING = 1, 2

# Number of the colony of champions.
_CHAMPIONS = 2**32 - 1


@dataclass(frozen=True, eq=False)
class Colony:
    """The tours of a colony, int32[m, n], with one row per ant, and the cost of each tour, float64[m]."""

    tours: NDArray[np.int32]
    costs: NDArray[np.float64]
    number: int = 0
    generation: int = 0

    def with_best_of(self, other: Colony) -> Colony:
        """Return this colony plus the best ant of `other`, unless `other` is empty."""
        if not len(other.costs):
            return self
        best = int(np.argmin(other.costs))
        tours = np.concatenate([self.tours, other.tours[best][None]])
        return replace(self, tours=tours, costs=np.append(self.costs, other.costs[best]))


def build_tour(instance: Instance, word: NDArray[np.uint64], kicks: int, stop: Stop) -> Share:
    """Build a greedy tour with randomized costs, then improve it with exchanges and kicks.

    Returns the tour and its cost. If the time runs out, the cost is infinite. `word` is a random state, uint64[1].
    Changes: word.
    """
    node, cost = np.zeros(instance.n, dtype=np.int32), math.inf
    if not stop.must_stop():
        tour = tour_with_buffers(greedy_tour(instance, np.random.default_rng(word[0])))
        if improve_queued_nodes(instance, tour, BREADTH, stop):
            if kicks > 0:
                tour = tour_with_buffers(tour.node, queued=False, log=2 * instance.n + 1000)
                kick_within_time(instance, tour, word, kicks, stop)
            node, cost = tour.node, float(tour_cost(instance.cost, tour.node))
    return node[None], np.array([cost])


def allocate_assembly_buffers(n: int) -> Assembly:
    """Allocate the buffers that a worker needs to recombine tours of n nodes."""
    return Assembly(
        links=np.empty((n, 4), dtype=np.int32),
        trail=np.empty((n, 8), dtype=np.int32),
        lists=np.empty((4, 2 * n + 2), dtype=np.int32),
        pieces=np.empty((4, MOST_CHANGES), dtype=np.int32),
        log=np.empty((MOST_CHANGES, 3), dtype=np.int32),
    )


def recombine_tours(
    instance: Instance,
    mine: NDArray[np.int32],
    other: NDArray[np.int32],
    costs: NDArray[np.float64],
    words: NDArray[np.uint64],
    stop: Stop,
) -> Share:
    """Recombine each tour with its partner and keep the improvements.

    Parameters
    ----------
    mine, other
        Tours to improve, and their partners, int32[m, n] each.
    costs
        Costs of the tours in `mine`, float64[m].
    words
        Random states, uint64[m].

    Returns
    -------
    Share
        The recombined tours and their costs.
    """
    n, pairs = instance.n, len(mine)
    tours, costs, gains, words = mine.copy(), costs.copy(), np.zeros(pairs), words.copy()
    tour = tour_with_buffers(np.arange(n, dtype=np.int32), queued=False)
    assembly = allocate_assembly_buffers(n)
    step, breadth = max(1, NODES_PER_LOOK // n), search_breadth(instance, BREADTH)
    for first in range(0, pairs, step):
        if stop.must_stop():
            break
        recombine_by_edge_assembly(
            instance.cost,
            tour,
            assembly,
            *instance.exchange_candidates,
            breadth,
            tours,
            other,
            words,
            gains,
            first,
            min(pairs, first + step),
        )
    # Costs are summed again: subtracting gains would accumulate rounding errors over the generations.
    for k in np.flatnonzero(gains > 0.0):
        costs[k] = tour_cost(instance.cost, tours[k])
    return tours, costs


def create_colony(instance: Instance, ants: int, seed: int, number: int, workers: Workers, kicks: int = 0) -> Colony:
    """Build the tours of a new colony. Tours that are not finished in time are left out."""
    words = random_states(seed, _BUILDING, number, count=ants)
    tours, costs = workers.run_and_join([partial(build_tour, instance, words[k : k + 1], kicks) for k in range(ants)])
    done = np.isfinite(costs)
    return Colony(tours[done], costs[done], number)


def next_generation(instance: Instance, colony: Colony, seed: int, workers: Workers) -> Colony:
    """Recombine each tour of a colony with its partner's tour. The result depends only on the colony and the seed."""
    ants = len(colony.tours)
    words = random_states(seed, _FOLLOWING, colony.number, colony.generation, count=ants)
    mine = np.random.default_rng(words[0]).permutation(ants)
    other = np.roll(mine, -1)
    block = max(1, ants // (MEETINGS_PER_WORKER * workers.count))
    tours, costs = workers.run_and_join(
        [
            partial(
                recombine_tours,
                instance,
                colony.tours[mine[at]],
                colony.tours[other[at]],
                colony.costs[mine[at]],
                words[at],
            )
            for at in (slice(k, k + block) for k in range(0, ants, block))
        ]
    )
    back = np.argsort(mine)
    return Colony(tours[back], costs[back], colony.number, colony.generation + 1)


def improve_by_colony(
    instance: Instance, seed: int, best: Best, workers: Workers, seconds: float, visits: float = math.inf
) -> Iterator[None]:
    """Improve the best tour with larger and larger colonies. Each step of the search is a generation.

    Parameters
    ----------
    seconds
        Time needed to build a tour.
    visits
        Work budget: the maximum number of nodes in all tours that the ants build. The search ends earlier if several
        colonies (`SAME_ANSWERS`) and the kicks after them find no improvement, or if another colony is not worth its
        time (`stop.payoff_limit`).
    """
    stop = best.stop
    enough = SAME_ANSWERS if math.isinf(visits) else SAME_ANSWERS_ON_BUDGET
    champions = Colony(best.tour[None], np.array([best.cost]), _CHAMPIONS)
    many, generations, number, same = instance.n >= MANY, 0, 0, 0
    gain, kicking = math.inf, False
    while same < enough and not stop.must_stop():
        kicked, kicking = kicking, not many and _have_time_to_kick(seconds, stop)
        if kicked and not kicking:
            break  # a few ants without kicks cannot improve the tours of ants with kicks
        ants = _colony_size(instance.n, number, seconds, stop, visits, kicking)
        if ants < (FEWEST_OF_MANY if many else FEWEST_BY_CLOCK if stop.seconds < math.inf else FEWEST_ANTS):
            break
        if not stop.payoff_limit.is_period_worthwhile(SECONDS_PER_VISIT * ants * instance.n, gain):
            break
        visits -= ants * instance.n
        before, began = best.cost, stop.elapsed()
        if kicking:
            rest = replace(stop, seconds=began + KICKING_SHARE * (stop.seconds - began))
            before_they_meet = int(KICKS_BEFORE * instance.n)
            colony = create_colony(instance, ants, seed, number, replace(workers, stop=rest), before_they_meet)
            seconds = (stop.elapsed() - began) / (KICKING_TAKES * max(1, len(colony.costs)))
        else:
            colony = create_colony(instance, ants, seed, number, workers)
            seconds = (stop.elapsed() - began) / ants
        if many:
            colony = colony.with_best_of(champions)
        colony, generations = yield from _run_generations(instance, colony, seed, best, workers, generations)
        champions = champions.with_best_of(colony)
        champions, generations = yield from _run_generations(instance, champions, seed, best, workers, generations)
        number, same = number + 1, same + 1 if best.cost >= before - EPSILON else 0
        gain = before - best.cost
    if stop.must_stop():
        return
    best.view = SearchView(instance, workers.log)  # kicks use no pheromone
    kicks = KICKS_PER_VISIT * (min(visits, gain / SECONDS_PER_VISIT) if stop.payoff_limit.holds else visits)
    if same == enough:
        kicks = min(kicks, LAST_KICKS * instance.n)
    if many:
        yield from kick_pieces(instance, best.tour, seed, best, workers, generations, kicks)
    else:
        yield from kick_repeatedly(instance, best.tour, seed, best, generations, kicks)


def _run_generations(
    instance: Instance, colony: Colony, seed: int, best: Best, workers: Workers, generations: int
) -> Generator[None, None, tuple[Colony, int]]:
    """Run generations until all tours have the same cost or no tour improves.

    Returns the colony and the number of generations.
    """
    idle, by_clock = 0, best.stop.seconds < math.inf
    patience = PATIENCE_BY_CLOCK if by_clock else PATIENCE
    _offer_best_tour(colony, best, generations)
    while idle < patience and costs_differ(colony) and not best.stop.must_stop():
        following = next_generation(instance, colony, seed, workers)
        idle = 0 if _has_improved(colony.costs, following.costs, LITTLE if by_clock else 0.0) else idle + 1
        colony = following
        generations += 1
        _offer_best_tour(colony, best, generations)
        best.view = SearchView(instance, workers.log, partial(pheromone_from_tours, instance, colony.tours))
        yield
    return colony, generations


def costs_differ(colony: Colony) -> bool:
    """Check whether at least two tours of a colony differ in cost."""
    return len(colony.costs) > 1 and bool(np.ptp(colony.costs) > EPSILON)


def _has_improved(before: NDArray[np.float64], after: NDArray[np.float64], little: float) -> bool:
    """Check whether the best cost has improved or the mean cost has improved enough.

    The mean has improved enough if the gain exceeds `little` times the difference between the mean and the best cost.
    """
    gains, best = before - after, float(after.min())
    if float(before.min()) > best + EPSILON:
        return True
    return bool(gains.max() > EPSILON and gains.mean() > little * (after.mean() - best))


def _offer_best_tour(colony: Colony, best: Best, generation: int) -> None:
    if len(colony.costs):
        winner = int(np.argmin(colony.costs))
        best.offer(colony.tours[winner], float(colony.costs[winner]), generation)


def _have_time_to_kick(seconds: float, stop: Stop) -> bool:
    """Check whether enough ants with kicks fit into the remaining time. Without a time limit, the result is False."""
    left = stop.seconds - stop.elapsed()
    return stop.seconds < math.inf and KICKING_SHARE * left / (KICKING_TAKES * seconds) >= FEWEST_KICKING


def _colony_size(n: int, number: int, seconds: float, stop: Stop, visits: float, kicking: bool = False) -> int:
    """Choose the number of ants for the next colony: `GROWTH` times the previous number.

    If no much larger colony would fit afterwards, the next colony uses all the remaining time or budget.
    """
    most = max(FIRST_ANTS, min(n, MOST_ANTS))
    planned = min(FIRST_ANTS * GROWTH ** min(number, 10), most)
    share = KICKING_SHARE / KICKING_TAKES if kicking else BUILDING_SHARE
    room = min(visits / n, share * (stop.seconds - stop.elapsed()) / seconds)
    if n < MANY and stop.seconds < math.inf:
        return max(1, min(int(room), most)) if room < ALL_BY_CLOCK * planned else planned
    return max(1, int(room)) if room < ALL_OF_BUDGET * planned else planned


def run_colony(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run the colony search. The preset's work budget applies unless the options set a limit."""
    options, stop, best = run.options, run.stop, run.best
    visits = math.inf if options.is_limited else PRESETS[options.preset]
    threads = thread_count(options)
    with thread_pool(threads, stop) as executor:
        workers = Workers(executor, threads, stop, WorkerLog.empty(threads))
        best.view, began = SearchView(instance, workers.log), stop.elapsed()
        build_improved_greedy_tour(instance, BREADTH, best)
        seconds = WHIMS * (stop.elapsed() - began) / threads
        iterations = run_steps(
            improve_by_colony(instance, options.seed, best, workers, seconds, visits - instance.n), best
        )
    return SearchResult(best.tour, iterations, workers.log.worker_figures())
