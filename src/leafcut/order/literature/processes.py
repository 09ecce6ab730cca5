"""Ants in processes without shared memory: a master and workers that exchange messages.

``processes``: the master holds the pheromone. In each iteration it sends the pheromone to the workers, and each
constructs the tours of its ants. The master waits for all of them and updates. The result is the same as with threads.

``exchange``: each worker has its own pheromone. It constructs the tours of its ants, updates its pheromone with its own
best tour, and sends its deposits to all others, which add them before their next tours. The result depends only on the
seed and the number of workers.

Source: for ``processes``, the thesis on parallel ant colony optimisation for drilling (2011); for ``exchange``,
M. Bolondi and M. Bondanza, Parallelizzazione di un algoritmo per la risoluzione del problema del commesso viaggiatore,
Politecnico di Milano 1993, as described in later work on parallel ant colonies. Differs: the master forwards the
messages; workers do not exchange random positions.
"""

from __future__ import annotations

import math
import pickle
import time
import uuid
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.order.best import Best
from leafcut.order.directed import DirectedInstance
from leafcut.order.executors import PROCESSES, WatchedExecutor, open_executor
from leafcut.order.instance import Instance
from leafcut.order.literature.ants import AntColony, Ants, MoveSet, move_set, trails_of
from leafcut.order.literature.pheromone import AntParameters, Deposit
from leafcut.order.search import AlgorithmRun, Tours
from leafcut.order.stop import Stop

#: Interval at which the master checks whether it must stop, s.
LOOK = 0.05


@dataclass(frozen=True, eq=False)
class WorkerStart:
    """Initial data of a worker: problem, parameters, number, and the best tour so far; `run` is a unique ID."""

    run: str
    instance: Instance | DirectedInstance
    parameters: AntParameters
    c_nn: float
    seed: int
    worker: int
    workers: int
    exchange: bool
    tour: NDArray[np.int32]
    cost: float


@dataclass(frozen=True, eq=False)
class AntTask:
    """One iteration of a worker, its time in seconds, and the pheromone float64[n, k] or the deposits of the others."""

    iteration: int
    seconds: float
    pheromone: NDArray[np.float64] | None
    changes: list[Deposit]


@dataclass(frozen=True, eq=False)
class AntAnswer:
    """Result of an iteration: tours int32[ants, n], costs float64[ants], deposits, and the time in seconds."""

    tours: NDArray[np.int32]
    costs: NDArray[np.float64]
    changes: list[Deposit]
    seconds: float


class AntWorker:
    """A worker: its ants, its pheromone, and its best known tour."""

    def __init__(self, start: WorkerStart) -> None:
        self.start = start
        moves = move_set(start.instance, start.parameters.local_search)
        self.trails = trails_of(moves, start.parameters, start.c_nn, start.seed)
        self.ants = Ants(moves, self.trails, start.seed, Stop())
        self.best = Best(Stop())
        self.best.offer(start.tour, start.cost, 0)

    def do(self, task: AntTask) -> AntAnswer:
        """Construct the tours of an iteration; in ``exchange`` mode, also update the worker's own pheromone."""
        began, trails = time.perf_counter(), self.trails
        if task.pheromone is not None:
            trails.pheromone[:] = task.pheromone
            trails.weigh()
        if task.changes:
            trails.receive(task.changes)
        self.ants.stop = Stop(seconds=task.seconds)
        tours, costs = self.ants.share(task.iteration, self.start.worker, self.start.workers)
        trails.changes = []
        if self.start.exchange and np.isfinite(costs).all():
            winner = int(np.argmin(costs))
            self.best.offer(tours[winner], float(costs[winner]), task.iteration)
            trails.reinforce(task.iteration, tours, costs, self.best)
        return AntAnswer(tours, costs, trails.changes, time.perf_counter() - began)


@cache
def _worker(packed: bytes) -> AntWorker:
    return AntWorker(pickle.loads(packed))


def do_task(packed: bytes, task: AntTask) -> AntAnswer:
    """Run a task on the worker with the pickled initial data `packed`."""
    return _worker(packed).do(task)


class AntProcesses(AntColony):
    """The master: each worker has an executor with one process, which starts with the first iteration."""

    def __init__(self, moves: MoveSet, run: AlgorithmRun, parameters: AntParameters, c_nn: float) -> None:
        """The number of workers is set by the options and is at most the number of ants."""
        count, exchange = min(run.aco.n_processes, parameters.ants), run.aco.parallel == "exchange"
        seed, best, name = run.options.seed, run.best, uuid.uuid4().hex
        trails = None if exchange else trails_of(moves, parameters, c_nn, seed)
        super().__init__(moves, trails, parameters.ants, count)
        self.stop, self._stack = run.stop, ExitStack()
        self.starts = [
            WorkerStart(name, moves.instance, parameters, c_nn, seed, k, count, exchange, best.tour, best.cost)
            for k in range(count)
        ]
        self.packed = [pickle.dumps(start, pickle.HIGHEST_PROTOCOL) for start in self.starts]
        self.changes: list[list[Deposit]] = [[] for _ in self.starts]
        self.executors: list[WatchedExecutor] = []

    def construct(self, iteration: int) -> Tours:
        """Return the tours int32[m, n] of all ants and their costs float64[m] (inf: not finished in time). Raises
        SolveError if a worker cannot be started, has ended or failed.
        """
        while len(self.executors) < len(self.starts):
            self.executors.append(self._stack.enter_context(open_executor(PROCESSES, 1)))
        self.costs[:] = math.inf
        pheromone = None if self.trails is None else self.trails.pheromone
        seconds, waiting = self.stop.seconds - self.stop.elapsed(), {}
        for k, packed in enumerate(self.packed):
            others = [change for j, changes in enumerate(self.changes) if j != k for change in changes]
            task = AntTask(iteration, seconds, pheromone, others)
            waiting[self._submit(k, packed, task)] = k
        while waiting and not self.stop.cancelled.is_set():
            for future in wait(waiting, LOOK, FIRST_COMPLETED).done:
                self._receive(waiting.pop(future), future)
        return self.tours, self.costs

    def _submit(self, k: int, packed: bytes, task: AntTask) -> Future[AntAnswer]:
        try:
            return self.executors[k].submit(do_task, packed, task)
        except (OSError, AssertionError) as problem:  # a daemonic process must not have children
            raise SolveError(f"a worker process cannot be started ({problem}); use --parallel threads") from None

    def _receive(self, k: int, future: Future[AntAnswer]) -> None:
        try:
            answer = future.result()
        except BrokenExecutor:
            raise SolveError(
                f"worker process {k + 1} of {len(self.starts)} ended; run again, or use --parallel threads; a script "
                "must do its work under if __name__ == '__main__'"
            ) from None
        except Exception as problem:
            why = f"{type(problem).__name__}: {problem}"
            raise SolveError(f"worker process {k + 1} failed ({why}); use --parallel threads") from problem
        workers = len(self.starts)
        self.tours[k::workers], self.costs[k::workers] = answer.tours, answer.costs
        self.changes[k] = answer.changes
        done = int(np.isfinite(answer.costs).sum())
        self.log.add(k, done, answer.seconds, float(answer.costs.min(initial=math.inf)))

    def close(self) -> None:
        """End the workers."""
        self._stack.close()
