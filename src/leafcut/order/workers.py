"""Run the tasks of a search in threads, and record statistics for each worker."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.model.solution import WorkerFigures
from leafcut.options import SolveOptions
from leafcut.order.stop import Stop

#: A task's result: tours, int32[m, n], and their costs, float64[m].
Share = tuple[NDArray[np.int32], NDArray[np.float64]]


@dataclass
class WorkerLog:
    """Counts the total work of each worker."""

    ants: list[int]
    seconds: list[float]
    best: list[float]
    known: dict[int, int] = field(default_factory=dict)

    @classmethod
    def empty(cls, workers: int) -> WorkerLog:
        """Create an empty log."""
        return cls([0] * workers, [0.0] * workers, [math.inf] * workers)

    def number_of_thread(self, thread: int) -> int:
        """Return the number of a worker. Workers are numbered in the order in which they run their first task."""
        return self.known.setdefault(thread, len(self.known)) % len(self.ants)

    def add(self, worker: int, ants: int, seconds: float, best: float) -> None:
        """Add a task to a worker's totals."""
        self.ants[worker] += ants
        self.seconds[worker] += seconds
        self.best[worker] = min(self.best[worker], best)

    def worker_figures(self) -> tuple[WorkerFigures, ...]:
        """Return the statistics of each worker."""
        rows = zip(self.ants, self.seconds, self.best, strict=True)
        return tuple(WorkerFigures(w, ants, seconds, best) for w, (ants, seconds, best) in enumerate(rows))


@dataclass(frozen=True)
class Workers:
    """A search's thread pool and the stopping criteria of its tasks.

    Without a pool (None), only the current thread works.
    """

    executor: Executor | None
    count: int
    stop: Stop
    log: WorkerLog

    def run_tasks(self, tasks: Sequence[Callable[[Stop], Share]]) -> list[Share]:
        """Run the tasks and return their results in order. The results do not depend on the number of workers."""
        done = list((map if self.executor is None else self.executor.map)(self._run_timed, tasks))
        for thread, seconds, (_, costs) in done:
            self.log.add(self.log.number_of_thread(thread), len(costs), seconds, float(costs.min(initial=math.inf)))
        return [share for _, _, share in done]

    def run_and_join(self, tasks: Sequence[Callable[[Stop], Share]]) -> Share:
        """Run the tasks and concatenate their results."""
        tours, costs = zip(*self.run_tasks(tasks), strict=True)
        return np.concatenate(tours), np.concatenate(costs)

    def _run_timed(self, task: Callable[[Stop], Share]) -> tuple[int, float, Share]:
        began = time.perf_counter()
        share = task(self.stop)
        return threading.get_ident(), time.perf_counter() - began, share


def thread_count(options: SolveOptions) -> int:
    """Return the number of threads. The default is one per core."""
    return options.threads or os.cpu_count() or 1


@contextmanager
def thread_pool(threads: int, stop: Stop) -> Iterator[Executor | None]:
    """Open a thread pool for the block, or yield None for a single thread. Ctrl-C cancels the search."""
    if threads <= 1:
        yield None
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="ants") as executor:
        try:
            yield executor
        except KeyboardInterrupt:
            stop.cancelled.set()  # otherwise the pool would wait for running tasks
            raise


def run_on_all_workers(executor: Executor | None, workers: int, work: Callable[[int], None]) -> None:
    """Call ``work(worker)`` for each worker, and wait until all calls have finished."""
    list((map if executor is None else executor.map)(work, range(workers)))
