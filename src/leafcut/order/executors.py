"""Where tasks are done: threads, processes, or the workers of a Dask cluster, behind `concurrent.futures.Executor`.

A task is a function that a worker can import, with arguments that can be pickled; in threads any will do. Workers may
join and die: what a dead one had begun is done again by another. A cluster that is not there, or whose scheduler dies,
is one line. Dask is imported when it is asked for, and not before.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import pickle
import re
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from itertools import islice
from multiprocessing import connection, resource_tracker
from typing import Any, TypeVar

from leafcut._version import __version__
from leafcut.errors import LeafcutError, OptionError

TaskT = TypeVar("TaskT")

THREADS, PROCESSES, DASK = "threads", "processes", "dask://"

#: Maximum wait for the answer of a cluster, and for its first worker, s.
CONNECT_SECONDS, FIRST_WORKER_SECONDS = 5.0, 10.0

#: How long a cluster may be without any worker while tasks wait: queues of batch systems give new ones after minutes.
PATIENCE_SECONDS = 600.0

#: Seconds between two looks at whether the executor is still there, and whether somebody wants the work to end.
LOOK_SECONDS = 0.2

#: How often a task may end the worker that does it alone, before it is given up.
ATTEMPTS = 3

#: Most workers that a person may ask for.
MOST_WORKERS = 1024

#: Tasks that are given out per worker: one that it does, and one that waits so that it never stands idle.
GIVEN_OUT = 2


class ExecutorError(LeafcutError):
    """A cluster is not there, is gone, or does not suit; or a task ended each worker that tried it."""


class WatchedExecutor(Executor):
    """An executor that knows how many workers it has, whether they see this memory, and whether it is still there.

    Attributes
    ----------
    workers
        How many tasks it does at once.
    shared
        Whether tasks see the memory of this process, so that they can be told to stop.
    """

    shared = False
    #: How many tasks are done at once in one process, whose processor time is that of all of them.
    together = 1

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def check(self) -> None:
        """Raise `ExecutorError` when nothing that was given out will ever come back."""


class _Threads(WatchedExecutor):
    shared = True

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self.together = workers
        self.pool = ThreadPoolExecutor(workers, thread_name_prefix="leafcut-task")

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        return self.pool.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self.pool.shutdown(wait, cancel_futures=cancel_futures)


class _Processes(WatchedExecutor):
    """Processes of this machine; when one dies the others end with it, and new ones are begun for what comes next."""

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self.pool = self._new()

    def _new(self) -> ProcessPoolExecutor:
        # Spawned: a fork of a process that has threads may wait for ever for a lock that one of them held.
        context = multiprocessing.get_context("spawn")
        stop, self._alive = context.Pipe(duplex=False)
        return ProcessPoolExecutor(self.workers, context, _begin_worker, (stop,))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with _without_interrupts():  # a task may start a process
            try:
                return self.pool.submit(fn, *args, **kwargs)
            except BrokenExecutor:
                self.pool.shutdown(cancel_futures=True)
                self.pool = self._new()
                return self.pool.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        if cancel_futures:
            self._alive.close()
        self.pool.shutdown(wait, cancel_futures=cancel_futures)


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block Ctrl-C, and with it in processes that are started here, until they ignore it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # its start, by the first process, would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker(stop: connection.Connection) -> None:
    """Leave Ctrl-C to the parent process; exit when the other end of `stop` is closed or the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def follow() -> None:
        if parent is not None:
            connection.wait([stop, parent.sentinel])
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


class _Dask(WatchedExecutor):
    """The workers of a Dask cluster. What they are given and what they return is pickled here, not by Dask.

    Arrays that Dask sends may be read-only, which is another type to compiled kernels.
    """

    def __init__(self, client: Any, spec: str, workers: int) -> None:
        super().__init__(workers or sum(client.nthreads().values()))
        self.client, self.spec = client, spec
        self.together = max(client.nthreads().values(), default=1)
        self.executor = client.get_executor(pure=False)
        self.seen = time.monotonic()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self._check_connected()
        packed = pickle.dumps((fn, args, kwargs), pickle.HIGHEST_PROTOCOL)
        answer: Future[Any] = Future()
        answer.set_running_or_notify_cancel()
        self.executor.submit(_unpacked_call, __version__, packed).add_done_callback(lambda done: _pass_on(done, answer))
        return answer

    def check(self) -> None:
        self._check_connected()
        try:
            known = self.client.scheduler_info(n_workers=-1).get("workers")
        except Exception:
            return  # the connection is about to be found broken
        now = time.monotonic()
        if known:
            self.seen = now
        elif now - self.seen > PATIENCE_SECONDS:
            raise ExecutorError(f"{self.spec}: no worker for {PATIENCE_SECONDS / 60:.0f} minutes; start one and go on")

    def _check_connected(self) -> None:
        if self.client.status != "running":
            raise ExecutorError(f"{self.spec}: the scheduler is gone; start it again and repeat the command")

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        with suppress(Exception):  # a scheduler that is gone cannot be told
            self.client.close(timeout=2)


def _pass_on(done: Future[Any], answer: Future[Any]) -> None:
    """Give an answer what Dask's own has: its pickled result, its error, or that it was lost."""
    if done.cancelled():
        answer.set_exception(CancelledError())
        return
    problem = done.exception()
    if problem is None:
        answer.set_result(pickle.loads(done.result()))
    elif type(problem).__name__ == "KilledWorker":
        answer.set_exception(ExecutorError("each worker that began this task died (too little memory?)"))
    else:
        answer.set_exception(problem)


def _unpacked_call(version: str, packed: bytes) -> bytes:
    """Do a task on a worker of a cluster; one with another leafcut could have another answer."""
    _check_version(version)
    fn, args, kwargs = pickle.loads(packed)
    return pickle.dumps(fn(*args, **kwargs), pickle.HIGHEST_PROTOCOL)


def _check_version(version: str) -> None:
    if version != __version__:
        raise ExecutorError(f"a worker has leafcut {__version__}, this machine {version}; install one version on all")


def check_executor(spec: str) -> None:
    """Refuse what names no executor.

    Raises
    ------
    OptionError
        It is not ``threads``, ``processes`` or ``dask://host:port``.
    """
    if spec not in (THREADS, PROCESSES) and not re.fullmatch(r"dask://(\[[0-9a-fA-F:.]+\]|[\w.-]+):\d{1,5}", spec):
        raise OptionError(f"--executor: unknown value '{spec}'; use threads, processes or dask://host:port")


@contextmanager
def open_executor(spec: str, workers: int = 0) -> Iterator[WatchedExecutor]:
    """Give an executor, and end it: at the end of the block no thread, process or connection of it is left.

    Parameters
    ----------
    spec
        ``threads``, ``processes`` of this machine, or ``dask://host:port``, the scheduler of a Dask cluster.
    workers
        How many tasks are done at once; 0 for one per core, and for all that the cluster has.

    Raises
    ------
    OptionError
        `spec` is none of these.
    ExecutorError
        The cluster does not answer, has no worker, or another version of leafcut; or the extra is not installed.
    """
    check_executor(spec)
    if spec.startswith(DASK):
        with _connected(spec) as client:
            executor: WatchedExecutor = _Dask(client, spec, workers)
            try:
                yield executor
            finally:
                executor.shutdown()
        return
    count = workers or os.cpu_count() or 1
    executor = _Threads(count) if spec == THREADS else _Processes(count)
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)


@contextmanager
def _connected(spec: str) -> Iterator[Any]:
    """Give a client of a Dask cluster that has a worker, all with this version of leafcut; closed at the end."""
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise ExecutorError(f"{spec} needs the package distributed: pip install 'leafcut[cluster]'") from None
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)  # leafcut reports each failure in one line
    try:
        # A large map is a large task, and is meant to be.
        with dask.config.set({"admin.large-graph-warning-threshold": "10GB"}):
            try:
                client = Client(f"tcp://{spec.removeprefix(DASK)}", timeout=CONNECT_SECONDS, set_as_default=False)
            except (OSError, ValueError) as problem:
                raise ExecutorError(
                    f"{spec}: no Dask scheduler answers there; start one with dask scheduler, or check host and port"
                ) from problem
            try:
                _check_workers(client, spec)
                yield client
            finally:
                with suppress(Exception):
                    client.close(timeout=2)
    finally:
        log.setLevel(level)


def _check_workers(client: Any, spec: str) -> None:
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_SECONDS)
    except (OSError, TimeoutError):
        raise ExecutorError(
            f"{spec}: the cluster has no worker; start one with dask worker {spec.removeprefix(DASK)}"
        ) from None
    for problem in client.run(_check_version, __version__, on_error="return").values():
        if isinstance(problem, LeafcutError):
            raise problem
        # `OSError`: the worker has died meanwhile, and other workers take its tasks.
        if isinstance(problem, Exception) and not isinstance(problem, OSError):
            why = f"{type(problem).__name__}: {problem}"
            raise ExecutorError(f"{spec}: a worker cannot run leafcut {__version__} ({why}); install it there")


def run_tasks(
    executor: Executor,
    work: Callable[[TaskT], Any],
    tasks: Iterable[TaskT],
    *,
    attempts: int = ATTEMPTS,
    ended: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[TaskT, Any]]:
    """Yield every task with what ``work(task)`` returns, or with the exception that it raises, as they finish.

    Tasks whose worker died are done again, each alone, so that the one that ends its workers harms no other; after
    `attempts` of these it is given up with an `ExecutorError`.

    Parameters
    ----------
    ended
        Asked again and again while waiting; when it returns True, no more is yielded.

    Raises
    ------
    ExecutorError
        The scheduler of a cluster is gone. What was yielded before stays done.
    """
    # What was given out and is not waited for any more ends with the executor: a pool of processes that is broken would
    # stumble over tasks that were called off one by one.
    course = _Course(executor, work, iter(tasks), attempts)
    while not ended():
        course.give_out()
        if not course.given:
            return
        done, _ = wait(course.given, LOOK_SECONDS, FIRST_COMPLETED)
        if not done and isinstance(executor, WatchedExecutor):
            executor.check()
        for future in done:
            yield from course.take(future)


class _Course:
    """Tasks on their way: those that are given out, and those whose worker died, which are then done one at a time."""

    def __init__(self, executor: Executor, work: Callable[[Any], Any], todo: Iterator[Any], attempts: int) -> None:
        self.executor, self.work, self.todo, self.attempts = executor, work, todo, attempts
        self.given: dict[Future[Any], tuple[Any, int]] = {}
        self.suspects: deque[tuple[Any, int]] = deque()
        self.alone = False
        workers = executor.workers if isinstance(executor, WatchedExecutor) else os.cpu_count() or 1
        self.most = GIVEN_OUT * workers

    def give_out(self) -> None:
        """Submit as many tasks as there is room for; a suspect when nothing else is under way."""
        if not self.given:
            self.alone = bool(self.suspects)
            if self.alone:
                self._submit(*self.suspects.popleft())
        if self.alone or self.suspects:
            return
        for task in islice(self.todo, self.most - len(self.given)):
            self._submit(task, 0)

    def _submit(self, task: Any, deaths: int) -> None:
        try:
            self.given[self.executor.submit(self.work, task)] = task, deaths
        except BrokenExecutor as problem:
            raise ExecutorError(f"the workers are gone ({problem})") from problem

    def take(self, future: Future[Any]) -> Iterator[tuple[Any, Any]]:
        """Yield a task with its result or its error; nothing where its worker died and it is to be done again."""
        task, deaths = self.given.pop(future)
        problem = future.exception()
        if not isinstance(problem, BrokenExecutor | CancelledError):
            yield task, future.result() if problem is None else problem
            return
        if isinstance(self.executor, WatchedExecutor):
            self.executor.check()
        deaths += self.alone
        if deaths >= self.attempts:
            yield task, ExecutorError(f"its worker died {deaths} times (too little memory?)")
        else:
            self.suspects.append((task, deaths))
