"""The colony: ants build tours of their own, then follow each other's trails until they all walk the same way.

A tour of the colony is the trail of one ant; what lies on an edge is the number of ants that walk it, and nothing is
kept for edges that no ant walks. In a generation every ant meets another one. Where the trails part, it goes round on
the other's edges, and keeps what makes its own tour shorter (`kernels.assembly`). When nothing is gained any more, a
new and larger colony is founded; the best ants of all colonies meet in one of their own.

Source: M. Guntsch and M. Middendorf, EvoWorkshops 2002, LNCS 2279 (pheromone that is a population of tours); Y. Nagata
and S. Kobayashi, INFORMS J. Computing 25 (2013) (how two tours are put together, and pairing by a random permutation).
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import EPSILON
from leafcut.kernels.ab_cycles import Assembly
from leafcut.kernels.assembly import MOST_CHANGES, assemble
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.kicks import kick_and_mend
from leafcut.order.best import Best, SearchView
from leafcut.order.construction import greedy, random_words
from leafcut.order.instance import Instance
from leafcut.order.kicks import BREADTH as KICKING_BREADTH
from leafcut.order.kicks import MANY, NODES_PER_LOOK, choices, descend, first_tour, kick_on, warm_kicks, work_tour
from leafcut.order.observing import of_tours
from leafcut.order.pieces import kick_pieces
from leafcut.order.search import AlgorithmRun, SearchResult, until_interrupted
from leafcut.order.stop import Stop
from leafcut.order.workers import Share, WorkerLog, Workers, thread_pool

#: Candidates tried at each depth of an exchange: by an ant that builds its tour, and in mending a child.
BREADTH = (0, 8, 5, 3, 1)

#: Budget of a preset in nodes of all tours that ants may build.
PRESETS = {"fast": 1e5, "default": 6e5, "thorough": 1e7}

#: Ants of the first colony, how many times as many each next one has, and most ants; never many more than nodes.
FIRST_ANTS, GROWTH, MOST_ANTS = 8, 4, 400

#: Fewer ants have too little to tell each other: what is left of the time goes to kicks on the best tour. On boards of
#: `MANY` nodes kicks gain less in that time than two ants, who meet the best one before them. Measured on pla85900 at
#: 3 s: 1.1 % above the optimum instead of 1.5 %.
FEWEST_ANTS, FEWEST_OF_MANY = 4, 2

#: The same with a clock. Measured on pcb3038 after 0.1 s: 1.0 % above the optimum instead of 1.2 %.
FEWEST_BY_CLOCK = 2

#: A colony takes all that is left when that is not enough for so many of its size: on a budget of work, and with a
#: clock. A small colony first costs time and helps the last one little; but where the time is long, there should be a
#: good tour early for those who stop the search.
ALL_OF_BUDGET, ALL_BY_CLOCK = 2, 16

#: Generations without any gain that end a colony.
PATIENCE = 3

#: With a clock these many generations end it that leave its best ant as it is, and in which ants come nearer to it by
#: less than this share of their mean distance. Such generations are many, and the time does more in kicks.
PATIENCE_BY_CLOCK, LITTLE = 2, 0.02

#: Colonies in a row without a better tour that end a search with a clock, and one on a budget of work.
SAME_ANSWERS, SAME_ANSWERS_ON_BUDGET = 5, 2

#: What a colony takes for each node of the tours that its ants build, s: about as much as it took on one core of 2024.
#: A counted cost and not the clock, so that answers stay the same.
SECONDS_PER_VISIT = 3e-5

#: Share of the time that is left in which the ants of the last colony build their tours; following trails takes about
#: as long again.
BUILDING_SHARE = 0.44

#: How much longer an ant takes whose greedy tour was changed at random, than one without whims.
WHIMS = 1.3

#: With a clock ants kick their tours so many times per node before they meet, if there is time for so many such ants:
#: kicks mend what is wrong in one place, and trails of others what is wrong on the large scale. Such an ant takes so
#: many times as long, and the ants of the last colony build for that share of the time.
KICKS_BEFORE, FEWEST_KICKING, KICKING_TAKES, KICKING_SHARE = 0.5, 12, 5.0, 0.75

#: Kicks between two looks at the clock.
KICKS_PER_LOOK = 200

#: Shares of a generation per worker: more of them end more evenly, fewer cost less.
MEETINGS_PER_WORKER = 2

#: Kicks per node when colonies find nothing better: ants that all build alike may all have missed something.
LAST_KICKS = 20

#: What a kick costs, in visits of an ant that builds its tour: about ten.
KICKS_PER_VISIT = 0.1

# What random numbers are for: with the seed this begins their stream.
_BUILDING, _FOLLOWING = 1, 2

# The number of the colony that the best ants of all colonies form.
_CHAMPIONS = 2**32 - 1


@dataclass(frozen=True, eq=False)
class Colony:
    """The state of a colony: arrays and numbers alone, so that it can be sent anywhere.

    Attributes
    ----------
    tours
        int32[m, n], one per ant.
    costs
        float64[m].
    number, generation
        Which colony it is, and how many generations it has lived.
    """

    tours: NDArray[np.int32]
    costs: NDArray[np.float64]
    number: int = 0
    generation: int = 0

    def joined_by(self, other: Colony) -> Colony:
        """Return this colony with the best ant of another one, if that has any."""
        if not len(other.costs):
            return self
        best = int(np.argmin(other.costs))
        tours = np.concatenate([self.tours, other.tours[best][None]])
        return replace(self, tours=tours, costs=np.append(self.costs, other.costs[best]))


@dataclass(frozen=True, eq=False)
class Founders:
    """Ants that build tours: their random words uint64[m], and how often each kicks its tour."""

    words: NDArray[np.uint64]
    kicks: int = 0


class ColonyView(SearchView):
    """A colony as observers see it: the share of its ants on each edge."""

    def __init__(self, instance: Instance, workers: Workers, colony: Colony | None = None) -> None:
        super().__init__(instance, workers.log)
        self.instance, self.colony = instance, colony

    def parts(self, best: Best) -> dict[str, Any]:
        """Return the figures of the workers, and the ants on each edge."""
        shown = None if self.colony is None else of_tours(self.instance, self.colony.tours)
        return super().parts(best) | {"pheromone": shown}


def build_tours(instance: Instance, founders: Founders, stop: Stop | None = None) -> Share:
    """Return one tour for each founder, and their costs (inf where the time was up before).

    An ant takes edges in the order of their costs, each changed a little at random, improves its tour by sequential
    exchanges, and then kicks it.
    """
    words = founders.words.copy()
    tours, costs = np.zeros((len(words), instance.n), dtype=np.int32), np.full(len(words), math.inf)
    for k, word in enumerate(founders.words):
        if stop is not None and stop.now():
            break
        tour = work_tour(greedy(instance, np.random.default_rng(word)))
        if descend(instance, tour, BREADTH, stop):
            node = _kicked(instance, tour.node, words, k, founders.kicks, stop)
            tours[k], costs[k] = node, tour_cost(instance.cost, node)
    return tours, costs


def _kicked(
    instance: Instance, node: NDArray[np.int32], words: NDArray[np.uint64], k: int, kicks: int, stop: Stop | None
) -> NDArray[np.int32]:
    """Return a tour int32[n] after so many kicks, or fewer when the time is up. Changes: words[k]."""
    if kicks <= 0:
        return node
    tour = work_tour(node, queued=False, log=2 * instance.n + 1000)
    breadth = choices(instance, KICKING_BREADTH)
    for made in range(0, kicks, KICKS_PER_LOOK):
        if stop is not None and stop.now():
            break
        some = min(KICKS_PER_LOOK, kicks - made)
        kick_and_mend(instance.cost, tour, *instance.exchange_lists, breadth, words, k, some)
    return tour.node


@dataclass(frozen=True, eq=False)
class Meetings:
    """Ants that meet: tours mine, other int32[m, n], costs of mine float64[m], and random words uint64[m]."""

    mine: NDArray[np.int32]
    other: NDArray[np.int32]
    costs: NDArray[np.float64]
    words: NDArray[np.uint64]


def assembly_for(n: int) -> Assembly:
    """Return what one worker needs to assemble tours of n nodes."""
    return Assembly(
        links=np.empty((n, 4), dtype=np.int32),
        trail=np.empty((n, 8), dtype=np.int32),
        lists=np.empty((4, 2 * n + 2), dtype=np.int32),
        pieces=np.empty((4, MOST_CHANGES), dtype=np.int32),
        log=np.empty((MOST_CHANGES, 3), dtype=np.int32),
    )


def follow_trails(instance: Instance, meetings: Meetings, stop: Stop | None = None) -> Share:
    """Return what becomes of the tours `mine` when each follows `other` where that is shorter, and what they cost.

    A function of its arguments alone, as far as it is not stopped.
    """
    n, pairs = instance.n, len(meetings.mine)
    tours, gains, words = meetings.mine.copy(), np.zeros(pairs), meetings.words.copy()
    tour = work_tour(np.arange(n, dtype=np.int32), queued=False)
    assembly = assembly_for(n)
    step, breadth = max(1, NODES_PER_LOOK // n), choices(instance, BREADTH)
    for first in range(0, pairs, step):
        if stop is not None and stop.now():
            break
        assemble(
            instance.cost, tour, assembly, *instance.exchange_lists, breadth,
            tours, meetings.other, words, gains, first, min(pairs, first + step),
        )  # fmt: skip
    # Added up anew: gains would carry their rounding from generation to generation.
    costs = meetings.costs.copy()
    for k in np.flatnonzero(gains > 0.0):
        costs[k] = tour_cost(instance.cost, tours[k])
    return tours, costs


def found_colony(instance: Instance, ants: int, seed: int, number: int, workers: Workers, kicks: int = 0) -> Colony:
    """Return a colony of ants that have built tours of their own; those that had no time to finish are not in it."""
    words = random_words(seed, _BUILDING, number, count=ants)
    founders = [Founders(words[k : k + 1], kicks) for k in range(ants)]
    tours, costs = workers.spread(build_tours, instance, founders)
    done = np.isfinite(costs)
    return Colony(tours[done], costs[done], number)


def next_generation(instance: Instance, colony: Colony, seed: int, workers: Workers) -> Colony:
    """Return the colony after every ant has met another one: a function of the colony and the seed."""
    ants = len(colony.tours)
    words = random_words(seed, _FOLLOWING, colony.number, colony.generation, count=ants)
    mine = np.random.default_rng(words[0]).permutation(ants)
    other = np.roll(mine, -1)
    block = max(1, ants // (MEETINGS_PER_WORKER * workers.count))
    items = [
        Meetings(colony.tours[mine[at]], colony.tours[other[at]], colony.costs[mine[at]], words[at])
        for at in (slice(k, k + block) for k in range(0, ants, block))
    ]
    tours, costs = workers.spread(follow_trails, instance, items)
    back = np.argsort(mine)
    return Colony(tours[back], costs[back], colony.number, colony.generation + 1)


def improve_by_colony(
    instance: Instance, seed: int, stop: Stop, best: Best, workers: Workers, visits: float = math.inf
) -> int:
    """Found colonies, one after another and each larger, until `stop`; return the generations that were lived.

    Parameters
    ----------
    visits
        The budget of work: the nodes of all tours that may be built. With budget or time left, the search ends when
        several colonies (`SAME_ANSWERS`), and some kicks on the best tour, have found nothing better, or when another
        colony is not worth its seconds (`stop.thrift`).
    """
    began = stop.elapsed()
    first_tour(instance, BREADTH, stop, best)
    seconds = WHIMS * (stop.elapsed() - began) / workers.count
    visits -= instance.n
    enough = SAME_ANSWERS if math.isinf(visits) else SAME_ANSWERS_ON_BUDGET
    champions = Colony(best.tour[None], np.array([best.cost]), _CHAMPIONS)
    many, generations, number, same = instance.n >= MANY, 0, 0, 0
    gain, kicking = math.inf, False
    while same < enough and not stop.reached(generations, 0):
        kicked, kicking = kicking, not many and _have_time_to_kick(seconds, stop)
        if kicked and not kicking:
            break  # a few ants that do not kick have nothing to tell those that did
        ants = _how_many(instance.n, number, seconds, stop, visits, kicking)
        if ants < (FEWEST_OF_MANY if many else FEWEST_BY_CLOCK if stop.seconds < math.inf else FEWEST_ANTS):
            break
        if not stop.thrift.is_worth(SECONDS_PER_VISIT * ants * instance.n, gain):
            break
        visits -= ants * instance.n
        before, began = best.cost, stop.elapsed()
        if kicking:
            rest = replace(stop, seconds=began + KICKING_SHARE * (stop.seconds - began))
            before_they_meet = int(KICKS_BEFORE * instance.n)
            colony = found_colony(instance, ants, seed, number, replace(workers, stop=rest), before_they_meet)
            seconds = (stop.elapsed() - began) / (KICKING_TAKES * max(1, len(colony.costs)))
        else:
            colony = found_colony(instance, ants, seed, number, workers)
            seconds = (stop.elapsed() - began) / ants
        if many:
            colony = colony.joined_by(champions)
        colony, generations = _live(instance, colony, seed, stop, best, workers, generations)
        champions = champions.joined_by(colony)
        champions, generations = _live(instance, champions, seed, stop, best, workers, generations)
        number, same = number + 1, same + 1 if best.cost >= before - EPSILON else 0
        gain = before - best.cost
    best.view = ColonyView(instance, workers)  # kicks follow no trails
    kicks = KICKS_PER_VISIT * (min(visits, gain / SECONDS_PER_VISIT) if stop.thrift.holds else visits)
    if same == enough:
        kicks = min(kicks, LAST_KICKS * instance.n)
    if many:
        return kick_pieces(instance, best.tour, seed, best, workers, generations, kicks)
    return kick_on(instance, best.tour, seed, stop, best, generations, kicks)


def _live(
    instance: Instance, colony: Colony, seed: int, stop: Stop, best: Best, workers: Workers, generations: int
) -> tuple[Colony, int]:
    """Let a colony live until all its ants walk the same way, or learn nothing.

    Return what became of it, and the count of generations of all colonies.
    """
    idle, by_clock = 0, stop.seconds < math.inf
    patience = PATIENCE_BY_CLOCK if by_clock else PATIENCE
    _offer(colony, best, generations)
    while idle < patience and differ(colony) and not stop.reached(generations, 0):
        following = next_generation(instance, colony, seed, workers)
        idle = 0 if _learned(colony.costs, following.costs, LITTLE if by_clock else 0.0) else idle + 1
        colony = following
        generations += 1
        _offer(colony, best, generations)
        best.view = ColonyView(instance, workers, colony)
        best.tell(generations)
    return colony, generations


def differ(colony: Colony) -> bool:
    """Return whether its ants do not all walk ways of one cost yet."""
    return len(colony.costs) > 1 and bool(np.ptp(colony.costs) > EPSILON)


def _learned(before: NDArray[np.float64], after: NDArray[np.float64], little: float) -> bool:
    """Return whether the best ant gained, or all of them on average more than `little` of how far they are from it."""
    gains, best = before - after, float(after.min())
    if float(before.min()) > best + EPSILON:
        return True
    return bool(gains.max() > EPSILON and gains.mean() > little * (after.mean() - best))


def _offer(colony: Colony, best: Best, generation: int) -> None:
    if len(colony.costs):
        winner = int(np.argmin(colony.costs))
        best.offer(colony.tours[winner], float(colony.costs[winner]), generation)


def _have_time_to_kick(seconds: float, stop: Stop) -> bool:
    """Return whether the time does for enough ants that kick their tours; on a budget of work none do."""
    left = stop.seconds - stop.elapsed()
    return stop.seconds < math.inf and KICKING_SHARE * left / (KICKING_TAKES * seconds) >= FEWEST_KICKING


def _how_many(n: int, number: int, seconds: float, stop: Stop, visits: float, kicking: bool = False) -> int:
    """Return how many ants the next colony has.

    `GROWTH` times as many as the last one; but where time or budget will not do for a much larger one after it, as many
    as they do for.
    """
    most = max(FIRST_ANTS, min(n, MOST_ANTS))
    planned = min(FIRST_ANTS * GROWTH ** min(number, 10), most)
    share = KICKING_SHARE / KICKING_TAKES if kicking else BUILDING_SHARE
    room = min(visits / n, share * (stop.seconds - stop.elapsed()) / seconds)
    if n < MANY and stop.seconds < math.inf:
        return max(1, min(int(room), most)) if room < ALL_BY_CLOCK * planned else planned
    return max(1, int(room)) if room < ALL_OF_BUDGET * planned else planned


def run_colony(instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run colonies: on the budget of the preset, without a time limit and a number of generations."""
    options, stop, best = run.options, run.stop, run.best
    visits = math.inf if options.is_limited else PRESETS[options.preset]
    if options.iterations is not None:
        stop.iterations = options.iterations
    threads = options.threads or os.cpu_count() or 1
    with thread_pool(threads) as executor:
        workers = Workers(executor, threads, stop, WorkerLog.of(threads))
        best.view = ColonyView(instance, workers)
        iterations = until_interrupted(
            lambda: improve_by_colony(instance, options.seed, stop, best, workers, visits), best
        )
    return SearchResult(best.tour, iterations, workers.log.figures())


def warm_colony(instance: Instance, run: AlgorithmRun, large: bool) -> NDArray[np.int32]:
    """Call every kernel of `run_colony`; its last kicks do not come in one iteration."""
    run_colony(instance, run)
    return warm_kicks(instance, replace(run, best=Best(Stop(cancelled=run.stop.cancelled))), large)
