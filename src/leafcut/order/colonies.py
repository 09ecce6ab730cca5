"""Several colonies that live apart, in threads, processes or on a cluster, and send each other their best tours.

A master gives out the colonies, each to live some generations alone; when all are back, each gets the best ant of the
one before it in a ring, in place of its own worst, and they are given out again. What a colony becomes depends on what
was sent and the seed alone. So the answer under a number of iterations is the same wherever they live, however many
workers there are, and when one of these dies: what it had begun is done again by another.

Source: M. Middendorf, F. Reischle and H. Schmeck, Multi colony ant algorithms, J. Heuristics 8 (2002), 305–320, section
3 (exchange of the best solution in a ring). Differs: the colonies are those of `order.colony`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from leafcut.errors import SolveError
from leafcut.kernels import EPSILON
from leafcut.order.colony import BREADTH, MOST_ANTS, Colony, differ, found_colony, next_generation
from leafcut.order.executors import WatchedExecutor, run_tasks
from leafcut.order.instance import Instance
from leafcut.order.kicks import first_tour, kick_on
from leafcut.order.statistics import Best, WorkerLog
from leafcut.order.stop import Stop
from leafcut.order.workers import Workers

#: Generations that a colony lives before the best ants are exchanged: an iteration of this search.
GENERATIONS = 5

#: Ants of a colony: as many as the budget builds, between these.
FEWEST_ANTS = 8

#: Exchanges without a better tour that end the search, and kicks per node on the best tour then.
PATIENCE, LAST_KICKS = 2, 20


@dataclass(frozen=True, eq=False)
class ColonyTask:
    """A colony that is to live some generations; without one yet, it is founded first, of so many ants.

    `stop` is there where the worker sees this memory: others finish what they have begun.
    """

    number: int
    instance: Instance
    colony: Colony | None
    ants: int
    seed: int
    stop: Stop | None = None


def live(task: ColonyTask) -> Colony:
    """Return what becomes of a colony: a function of the task alone, as far as it is not stopped."""
    stop = task.stop or Stop()
    alone = Workers(None, 1, stop, WorkerLog.of(1))
    colony = task.colony
    if colony is None:
        colony = found_colony(task.instance, task.ants, task.seed, task.number, alone)
    for _ in range(GENERATIONS):
        if not differ(colony) or stop.now():
            break
        colony = next_generation(task.instance, colony, task.seed, alone)
    return colony


def improve_by_colonies(
    instance: Instance, seed: int, stop: Stop, best: Best, executor: WatchedExecutor, count: int, visits: float
) -> int:
    """Let colonies live and exchange their best until `stop`, or nothing is gained; return the exchanges.

    Parameters
    ----------
    count
        How many colonies there are: part of the answer, other than the number of workers.
    visits
        The budget of work: the nodes of all tours that the colonies may build at their founding.

    Raises
    ------
    SolveError
        A colony could not be brought to its end.
    ExecutorError
        The cluster is gone.
    """
    ants = max(FEWEST_ANTS, min(int(visits / (instance.n * count)), MOST_ANTS, instance.n))
    first_tour(instance, BREADTH, stop, best)
    colonies: list[Colony | None] = [None] * count
    told = stop if executor.shared else None
    rounds = idle = 0
    while idle < PATIENCE and not stop.reached(rounds, 0):
        before = best.cost
        tasks = [ColonyTask(k, instance, colonies[k], ants, seed, told) for k in range(count)]
        back: dict[int, Colony] = {}
        for task, found in run_tasks(executor, live, tasks, ended=stop.now):
            if isinstance(found, BaseException):
                raise SolveError(f"--colonies: colony {task.number + 1} failed ({found}); run again")
            back[task.number] = found
        for k in sorted(
            k for k, colony in back.items() if len(colony.costs)
        ):  # in their order, whichever was back first
            winner = int(np.argmin(back[k].costs))
            best.offer(back[k].tours[winner], float(back[k].costs[winner]), rounds)
        if len(back) < count or stop.now():
            break
        rounds += 1
        best.tell(rounds)
        every = [back[k] for k in range(count)]
        idle = 0 if best.cost < before - EPSILON else idle + 1
        if not any(map(differ, every)) and np.ptp([one.costs.min() for one in every]) <= EPSILON:
            break
        colonies = [_joined(one, every[k - 1]) for k, one in enumerate(every)]
    if stop.reached(rounds, 0):
        return rounds
    return kick_on(instance, best.tour, seed, stop, best, rounds, LAST_KICKS * instance.n)


def _joined(colony: Colony, other: Colony) -> Colony:
    """Return a colony with the best ant of another one in place of its worst, where that is better."""
    winner, worst = int(np.argmin(other.costs)), int(np.argmax(colony.costs))
    if other.costs[winner] >= colony.costs[worst] - EPSILON:
        return colony
    tours, costs = colony.tours.copy(), colony.costs.copy()
    tours[worst], costs[worst] = other.tours[winner], other.costs[winner]
    return replace(colony, tours=tours, costs=costs)
