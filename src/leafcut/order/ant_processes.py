"""Ants in processes that share no memory: a master and its workers, who send each other messages.

``processes``: a master has the pheromone. In each cycle it sends it to the workers, each of whom builds the tours of
its ants; the master waits for all of them and updates. The answer is that of threads.

``exchange``: each worker has pheromone of its own. It builds the tours of its ants, evaporates and deposits as its
algorithm says, by its own best tour, and sends what it laid to all others, who lay it, too, before their next ants go.
The answer depends on the seed and on how many workers there are, and on nothing else.

Source: of the first, the thesis on parallel ant colony optimisation for drilling (2011); of the second, M. Bolondi and
M. Bondanza, Parallelizzazione di un algoritmo per la risoluzione del problema del commesso viaggiatore, Politecnico di
Milano 1993, as the work on parallel ant colonies that builds on it describes it. Differs: messages go through the
master, who hands them on; nobody changes places at random.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.options import AcoOptions
from leafcut.order.aco import Ants, ColonyParameters, ColonyTrails, Deposit, Trails
from leafcut.order.algorithms import AlgorithmRun
from leafcut.order.firefly import learn_nothing
from leafcut.order.instance import Instance
from leafcut.order.loop import search
from leafcut.order.observing import on_candidates
from leafcut.order.running import SearchResult, until_interrupted
from leafcut.order.statistics import Best, WorkerLog
from leafcut.order.steps import branching_of, choices_of, step_of_ants
from leafcut.order.stop import Stop

#: Interval at which the master checks whether it is to stop, s; time that a worker has to end by itself, s.
LOOK, PATIENCE = 0.05, 1.0

#: Maximum wait for the exit status of a worker whose connection is closed, s.
EXIT_SECONDS = 10.0


class SharedAnts(Protocol):
    """Ants of which each worker has some."""

    stop: Stop

    def share(self, iteration: int, worker: int, workers: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return the tours of every `workers`-th ant, the first of them `worker`, and their costs (inf: no time)."""
        ...


#: Returns pheromone and ants for an instance, parameters, the cost of the nearest-neighbour tour, and a seed.
MakeAnts = Callable[[Any, ColonyParameters, float, int], tuple[Trails, SharedAnts]]


@dataclass(frozen=True, eq=False)
class WorkerStart:
    """What a worker begins with: the problem, the parameters, its number, and the tour that all know already.

    `make` is what makes its pheromone and its ants, a function that a module has under its name.
    """

    make: MakeAnts
    instance: Any
    parameters: ColonyParameters
    c_nn: float
    seed: int
    worker: int
    workers: int
    exchange: bool
    tour: NDArray[np.int32]
    cost: float


@dataclass(frozen=True, eq=False)
class AntTask:
    """One iteration of a worker, to be over in some seconds: the pheromone float64[n, k], or what the others laid."""

    iteration: int
    seconds: float
    pheromone: NDArray[np.float64] | None
    changes: list[Deposit]


@dataclass(frozen=True, eq=False)
class AntAnswer:
    """What a worker did: tours int32[ants, n], costs float64[ants], what it laid, and how long it took, s."""

    tours: NDArray[np.int32]
    costs: NDArray[np.float64]
    changes: list[Deposit]
    seconds: float


class AntWorker:
    """One worker: its ants, its pheromone, and the best tour that it knows."""

    def __init__(self, start: WorkerStart) -> None:
        self.start = start
        self.colony, self.ants = start.make(start.instance, start.parameters, start.c_nn, start.seed)
        self.best = Best(Stop())
        self.best.offer(start.tour, start.cost, 0)

    def do(self, task: AntTask) -> AntAnswer:
        """Build the tours of an iteration; learn from them, where the pheromone is its own."""
        began, colony = time.perf_counter(), self.colony
        if task.pheromone is not None:
            colony.pheromone[:] = task.pheromone
            colony.weigh()
        if task.changes:
            colony.receive(task.changes)
        self.ants.stop = Stop(seconds=task.seconds)
        tours, costs = self.ants.share(task.iteration, self.start.worker, self.start.workers)
        colony.changes = []
        if self.start.exchange and np.isfinite(costs).all():
            winner = int(np.argmin(costs))
            self.best.offer(tours[winner], float(costs[winner]), task.iteration)
            colony.reinforce(task.iteration, tours, costs, self.best)
        return AntAnswer(tours, costs, colony.changes, time.perf_counter() - began)


def serve(line: Connection, start: WorkerStart) -> None:
    """Run tasks from a connection until the master closes it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the master, which ends its workers
    try:
        worker = AntWorker(start)
        while True:
            line.send(worker.do(line.recv()))
    except (EOFError, OSError):
        return
    except Exception as problem:  # whatever it is, the master reports it
        with suppress(OSError):  # the master has closed the connection, since another worker failed
            line.send(f"{type(problem).__name__}: {problem}")


class AntProcesses:
    """The master: starts the workers, hands messages on, and ends them."""

    def __init__(self, starts: list[WorkerStart], colony: Trails | None, stop: Stop) -> None:
        """Start the workers; `colony` has the pheromone that they are sent, None where each has its own.

        Raises
        ------
        SolveError
            A process cannot be started.
        """
        self.colony, self.stop, count = colony, stop, len(starts)
        self.log = WorkerLog.of(count)
        self.changes: list[list[Deposit]] = [[] for _ in starts]
        ants, n = starts[0].parameters.ants, starts[0].instance.n
        self.tours, self.costs = np.zeros((ants, n), dtype=np.int32), np.full(ants, math.inf)
        self.lines: list[Connection] = []
        self.processes: list[BaseProcess] = []
        context = get_context("spawn")
        try:
            for start in starts:
                mine, theirs = context.Pipe()
                self.lines.append(mine)
                process = context.Process(target=serve, args=(theirs, start), daemon=True, name=f"ants-{start.worker}")
                with _undisturbed(), closing(theirs):
                    process.start()
                self.processes.append(process)
        except (OSError, AssertionError) as problem:
            self.close()
            raise SolveError(f"a worker process cannot be started ({problem}); use --parallel threads") from None
        except BaseException:
            self.close()
            raise

    def propose(self, iteration: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return the tours int32[m, n] of all ants and their costs float64[m] (inf: not finished in time).

        Raises
        ------
        SolveError
            A worker has ended or failed.
        """
        self.costs[:] = math.inf
        pheromone = None if self.colony is None else self.colony.pheromone
        seconds = self.stop.seconds - self.stop.elapsed()
        for k, line in enumerate(self.lines):
            others = [change for j, changes in enumerate(self.changes) if j != k for change in changes]
            try:
                line.send(AntTask(iteration, seconds, pheromone, others))
            except OSError:
                raise self._ended(k) from None
        waiting, workers = dict(zip(self.lines, range(len(self.lines)), strict=True)), len(self.lines)
        while waiting and not self.stop.cancelled.is_set():
            ready = wait(list(waiting), LOOK)
            for line in [one for one in waiting if one in ready]:
                k = waiting.pop(line)
                answer = self._answer(k)
                self.tours[k::workers], self.costs[k::workers] = answer.tours, answer.costs
                self.changes[k] = answer.changes
                done = int(np.isfinite(answer.costs).sum())
                self.log.add(k, done, answer.seconds, float(answer.costs.min(initial=math.inf)))
        return self.tours, self.costs

    def _answer(self, k: int) -> AntAnswer:
        try:
            answer = self.lines[k].recv()
        except (EOFError, OSError):
            raise self._ended(k) from None
        if not isinstance(answer, AntAnswer):
            raise SolveError(f"worker process {k + 1} failed ({answer}); use --parallel threads")
        return answer

    def _ended(self, k: int) -> SolveError:
        self.processes[k].join(EXIT_SECONDS)
        return SolveError(
            f"worker process {k + 1} of {len(self.lines)} ended with status {self.processes[k].exitcode}; run again, "
            "or use --parallel threads; a script must do its work under if __name__ == '__main__'"
        )

    def close(self) -> None:
        """End the workers: those that wait go by themselves, others are made to."""
        for line in self.lines:
            line.close()
        until = time.monotonic() + (0.0 if self.stop.cancelled.is_set() else PATIENCE)
        for process in self.processes:
            process.join(max(0.0, until - time.monotonic()))
            if process.is_alive():
                process.terminate()
        for process in self.processes:
            process.join(PATIENCE)
            if process.is_alive():
                process.kill()
                process.join()
            process.close()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Start a process that Ctrl-C does not reach before it is told to leave that to the master."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it would let the signal through again when the first process starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def starts_of(
    make: MakeAnts, instance: Any, aco: AcoOptions, parameters: ColonyParameters, c_nn: float, seed: int, best: Best
) -> list[WorkerStart]:
    """Return what each worker begins with; there are no more of them than ants.

    Raises
    ------
    SolveError
        One pheromone is asked for of ants that wear it off as they go.
    """
    if parameters.algorithm == "acs" and aco.parallel == "processes":
        raise SolveError(
            "--parallel processes: ants of acs wear off one pheromone in turn; use --parallel exchange or threads"
        )
    workers, exchange = min(aco.n_processes, parameters.ants), aco.parallel == "exchange"
    tour, cost = best.tour, best.cost
    return [
        WorkerStart(make, instance, parameters, c_nn, seed, k, workers, exchange, tour, cost) for k in range(workers)
    ]


def make_ants(instance: Instance, parameters: ColonyParameters, c_nn: float, seed: int) -> tuple[ColonyTrails, Ants]:
    """Return pheromone and ants for tours of places; one thread."""
    colony = ColonyTrails(instance, parameters, c_nn, seed)
    return colony, Ants(colony, seed, Stop(), None, 1)


def run_in_processes(instance: Instance, run: AlgorithmRun, parameters: ColonyParameters, c_nn: float) -> SearchResult:
    """Run one of the classical five in processes, which are started within the time that the run has.

    Raises
    ------
    SolveError
        A process cannot be started, has ended or failed; or as `starts_of`.
    """
    best, seed = run.best, run.options.seed
    starts = starts_of(make_ants, instance, run.aco, parameters, c_nn, seed, best)
    colony = None if starts[0].exchange else ColonyTrails(instance, parameters, c_nn, seed)
    log = WorkerLog.of(len(starts))

    def work() -> int:
        nonlocal log
        with closing(AntProcesses(starts, colony, run.stop)) as ants:
            log = ants.log
            _show(instance, colony, ants, best)
            return search(ants.propose, learn_nothing if colony is None else colony.reinforce, run.stop, best)

    iterations = until_interrupted(work, best)
    return SearchResult(best.tour, iterations, log.figures())


def _show(instance: Instance, colony: ColonyTrails | None, ants: AntProcesses, best: Best) -> None:
    """Let those who watch see the workers, and the pheromone where the master has it."""
    if best.watched is None:
        return
    best.watched.workers = ants.log.figures
    if colony is not None:
        best.watched.pheromone = lambda: on_candidates(instance, colony.lists, colony.pheromone)
        best.watched.step = lambda: step_of_ants(colony, best, choices_of(colony))
        best.watched.branching = lambda: branching_of(colony)
