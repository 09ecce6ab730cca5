"""Ants in processes without shared memory. A master and its workers exchange messages.

``processes``: The master holds the pheromone. In each iteration, it sends the pheromone to the workers, and each worker
constructs its ants' tours. The master waits for all tours and then updates the pheromone. The result is the same as
with threads.

``exchange``: Each worker has its own pheromone. In each iteration, it constructs its ants' tours, updates its pheromone
with its own best tour, and sends its deposits to all other workers. The other workers add the deposits before they
construct their next tours. The result depends only on the seed and the number of workers.

``partners``: Like ``exchange``, but in each iteration, each worker sends its deposits to only one other worker, chosen
at random.

Sources: For ``processes``, the thesis on parallel ant colony optimisation for drilling (2011). For ``exchange``, M.
Bolondi and M. Bondanza, Parallelizzazione di un algoritmo per la risoluzione del problema del commesso viaggiatore,
Politecnico di Milano 1993, as described in later work on parallel ant colonies. For ``partners``, the paper on parallel
ant colonies for G-code (P-ACO), which proposes random exchange between processors without giving details. Differs: the
master forwards the messages.
"""

from __future__ import annotations

import math
import pickle
import time
import uuid
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.order.directed import DirectedInstance
from leafcut.order.executors import PROCESSES, WatchedExecutor, open_executor
from leafcut.order.instance import Instance
from leafcut.order.literature.ants import AntColony, Ants, MoveSet, create_move_set, initial_trails
from leafcut.order.literature.pheromone import AntParameters, Deposit
from leafcut.order.search import AlgorithmRun, Best, Tours
from leafcut.order.stop import Stop

#: The master checks this often whether it must stop, in seconds.
LOOK = 0.05

# Second word of the random stream of the partners.
_PARTNERS = 5

#: Result of an iteration: tours, int32[ants, n]; costs, float64[ants]; deposits; and the time that the ants took, in
#: seconds.
WorkerAnswer = tuple[NDArray[np.int32], NDArray[np.float64], list[Deposit], float]


@dataclass(eq=False)
class AntWorker:
    """A worker with the problem, its own ants and pheromone, and the best tour that it knows. `run` is a unique ID."""

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

    @cached_property
    def ants(self) -> Ants:
        """The ants and their pheromone trails. They are created in the worker's process."""
        moves = create_move_set(self.instance, self.parameters.local_search)
        return Ants(moves, initial_trails(moves, self.parameters, self.c_nn, self.seed), self.seed, Stop())

    @cached_property
    def best(self) -> Best:
        """The best tour that the worker knows."""
        best = Best(Stop())
        best.offer(self.tour, self.cost, 0)
        return best

    def run_iteration(
        self, iteration: int, seconds: float, pheromone: NDArray[np.float64] | None, changes: list[Deposit]
    ) -> WorkerAnswer:
        """Construct the tours of an iteration within the given time.

        The master sends either the pheromone, float64[n, k], or the deposits of other workers (`changes`). In the
        second case, the worker also updates its own pheromone.
        """
        trails = self.ants.trails
        if pheromone is not None:
            trails.pheromone[:] = pheromone
            trails.update_weights()
        if changes:
            trails.add_deposits(changes)
        self.ants.stop, began = Stop(seconds=seconds), time.perf_counter()
        tours, costs = self.ants.construct_share(iteration, self.worker, self.workers)
        working, trails.changes = time.perf_counter() - began, []
        if self.exchange and np.isfinite(costs).all():
            winner = int(np.argmin(costs))
            self.best.offer(tours[winner], float(costs[winner]), iteration)
            trails.reinforce(iteration, tours, costs, self.best)
        return tours, costs, trails.changes, working


@cache
def _unpickle_worker(packed: bytes) -> AntWorker:
    worker: AntWorker = pickle.loads(packed)
    return worker


def run_iteration(packed: bytes, *task: Any) -> WorkerAnswer:
    """Run an iteration on the pickled worker `packed`. Each process unpickles its worker only once."""
    return _unpickle_worker(packed).run_iteration(*task)


class AntProcesses(AntColony):
    """The master of the workers. Each worker has an executor with one process, which starts in the first iteration."""

    def __init__(self, moves: MoveSet, run: AlgorithmRun, parameters: AntParameters, c_nn: float) -> None:
        """Create the workers. Their number comes from the options, but never exceeds the number of ants."""
        count, exchange = min(run.aco.n_processes, parameters.ants), run.aco.parallel in ("exchange", "partners")
        self.partners, seed = run.aco.parallel == "partners", run.options.seed
        best, name = run.best, uuid.uuid4().hex
        trails = None if exchange else initial_trails(moves, parameters, c_nn, seed)
        super().__init__(moves, trails, parameters.ants, count)
        self.stop, self.seed, self._stack = run.stop, seed, ExitStack()
        self.colonies = [
            AntWorker(name, moves.instance, parameters, c_nn, seed, k, count, exchange, best.tour, best.cost)
            for k in range(count)
        ]
        self.packed = [pickle.dumps(worker, pickle.HIGHEST_PROTOCOL) for worker in self.colonies]
        self.changes: list[list[Deposit]] = [[] for _ in self.colonies]
        self.executors: list[WatchedExecutor] = []

    def construct(self, iteration: int) -> Tours:
        """Return the tours of all ants, int32[m, n], and their costs, float64[m].

        The cost of an unfinished tour is infinite. Raises SolveError if a worker fails, ends, or does not start.
        """
        while len(self.executors) < len(self.colonies):
            self.executors.append(self._stack.enter_context(open_executor(PROCESSES, 1)))
        self.costs[:] = math.inf
        pheromone = None if self.trails is None else self.trails.pheromone
        seconds, waiting = self.stop.seconds - self.stop.elapsed(), {}
        senders = self.senders(iteration)
        for k, packed in enumerate(self.packed):
            others = [change for j in senders[k] for change in self.changes[j]]
            waiting[self._submit(k, packed, iteration, seconds, pheromone, others)] = k
        while waiting and not self.stop.cancelled.is_set():
            for future in wait(waiting, LOOK, FIRST_COMPLETED).done:
                self._receive(waiting.pop(future), future)
        return self.tours, self.costs

    def senders(self, iteration: int) -> list[list[int]]:
        """For each worker, list the workers that send their deposits to it."""
        workers = range(len(self.colonies))
        if not self.partners or len(workers) == 1:
            return [[j for j in workers if j != k] for k in workers]
        steps = np.random.default_rng((self.seed, _PARTNERS, iteration)).integers(1, len(workers), len(workers))
        return [[j for j in workers if (j + steps[j]) % len(workers) == k] for k in workers]

    def _submit(self, k: int, packed: bytes, *task: Any) -> Future[WorkerAnswer]:
        try:
            return self.executors[k].submit(run_iteration, packed, *task)
        except (OSError, AssertionError) as problem:  # a daemonic process must not have children
            raise SolveError("a worker process cannot be started ({}); use --parallel threads", problem) from None

    def _receive(self, k: int, future: Future[WorkerAnswer]) -> None:
        try:
            tours, costs, changes, seconds = future.result()
        except BrokenExecutor:
            raise SolveError(
                "worker process {} of {} ended; run again, or use --parallel threads; a script "
                "must do its work under if __name__ == '__main__'",
                k + 1,
                len(self.colonies),
            ) from None
        except Exception as problem:
            why = f"{type(problem).__name__}: {problem}"
            raise SolveError("worker process {} failed ({}); use --parallel threads", k + 1, why) from problem
        workers = len(self.colonies)
        self.tours[k::workers], self.costs[k::workers], self.changes[k] = tours, costs, changes
        self.log.add(k, int(np.isfinite(costs).sum()), seconds, float(costs.min(initial=math.inf)))

    def close(self) -> None:
        """Shut down the workers."""
        self._stack.close()
