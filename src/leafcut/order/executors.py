"""Executors for tasks: threads, processes, or a Dask cluster, with the interface of `concurrent.futures.Executor`.

A task is an importable function with arguments that can be pickled (threads accept any arguments). If a worker dies,
another worker repeats its unfinished tasks. Dask is imported only when it is used.
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

#: Maximum time for which tasks wait without any worker, s. A batch system may take minutes to start workers.
PATIENCE_SECONDS = 600.0

#: Interval between checks of the executor and of cancellation, s.
LOOK_SECONDS = 0.2

#: A task fails after it has killed its worker this many times while it was the only running task.
ATTEMPTS = 3

#: Maximum number of workers that the user may request.
MOST_WORKERS = 1024

#: Submitted tasks per worker: a running task, and a waiting task so that the worker is never idle.
GIVEN_OUT = 2


class ExecutorError(LeafcutError):
    """A cluster is unreachable, lost or incompatible, or a task killed every worker that tried to run it."""


class WatchedExecutor(Executor):
    """An executor with a known number of workers, which can check whether its workers are running.

    `shared`: tasks share the memory of this process, so that they can be cancelled.
    """

    shared = False
    #: Number of tasks that run at once in the same process. Only their total processor time can be measured.
    together = 1

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def check(self) -> None:
        """Raise `ExecutorError` if submitted tasks can never finish."""


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
    """A pool of local processes. If a process dies, the whole pool ends, and a new pool runs the next tasks."""

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self.pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        # Not "fork", because a forked process may wait forever for a lock that another thread held.
        context = multiprocessing.get_context("spawn")
        stop, self._alive = context.Pipe(duplex=False)
        return ProcessPoolExecutor(self.workers, context, _start_worker, (stop,))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with _without_interrupts():  # a task may start a process
            try:
                return self.pool.submit(fn, *args, **kwargs)
            except BrokenExecutor:
                self.pool.shutdown(cancel_futures=True)
                self.pool = self._new_pool()
                return self.pool.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        if cancel_futures:
            self._alive.close()
        self.pool.shutdown(wait, cancel_futures=cancel_futures)


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block Ctrl-C in this process, so that new processes do not receive it before they ignore it themselves."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # started here, because its start by the first process would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start_worker(stop: connection.Connection) -> None:
    """Ignore Ctrl-C, which the parent handles; exit when the parent closes `stop` or ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def follow() -> None:
        if parent is not None:
            connection.wait([stop, parent.sentinel])
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


class _Dask(WatchedExecutor):
    """Executor on a Dask cluster.

    This class pickles arguments and results itself. Dask may deliver read-only arrays, which are another type for
    compiled kernels.
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
        self.executor.submit(_unpacked_call, __version__, packed).add_done_callback(
            lambda done: _copy_outcome(done, answer)
        )
        return answer

    def check(self) -> None:
        self._check_connected()
        try:
            known = self.client.scheduler_info(n_workers=-1).get("workers")
        except Exception:
            return  # the broken connection will be detected soon
        now = time.monotonic()
        if known:
            self.seen = now
        elif now - self.seen > PATIENCE_SECONDS:
            raise ExecutorError(
                f"{self.spec}: no worker for {PATIENCE_SECONDS / 60:.0f} minutes; start one and repeat the command"
            )

    def _check_connected(self) -> None:
        if self.client.status != "running":
            raise ExecutorError(f"{self.spec}: the scheduler has stopped; restart it and repeat the command")

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        with suppress(Exception):  # the scheduler may be gone
            self.client.close(timeout=2)


def _copy_outcome(done: Future[Any], answer: Future[Any]) -> None:
    """Copy the outcome of a Dask future to `answer`: its pickled result, its error, or its cancellation."""
    if done.cancelled():
        answer.set_exception(CancelledError())
        return
    problem = done.exception()
    if problem is None:
        answer.set_result(pickle.loads(done.result()))
    elif type(problem).__name__ == "KilledWorker":
        answer.set_exception(ExecutorError("every worker that started this task died (not enough memory?)"))
    else:
        answer.set_exception(problem)


def _unpacked_call(version: str, packed: bytes) -> bytes:
    """Run a task on a worker of a cluster. Raises an error if the worker has another version of leafcut."""
    _check_version(version)
    fn, args, kwargs = pickle.loads(packed)
    return pickle.dumps(fn(*args, **kwargs), pickle.HIGHEST_PROTOCOL)


def _check_version(version: str) -> None:
    if version != __version__:
        raise ExecutorError(f"a worker has leafcut {__version__}, this machine {version}; install one version on all")


def check_executor(spec: str) -> None:
    """Raise OptionError if `spec` is not ``threads``, ``processes`` or ``dask://host:port``."""
    if spec not in (THREADS, PROCESSES) and not re.fullmatch(r"dask://(\[[0-9a-fA-F:.]+\]|[\w.-]+):\d{1,5}", spec):
        raise OptionError(f"--executor: unknown value '{spec}'; use threads, processes or dask://host:port")


@contextmanager
def open_executor(spec: str, workers: int = 0) -> Iterator[WatchedExecutor]:
    """Open an executor and close it, with all its threads, processes and connections, at the end of the block.

    `spec`: ``threads``, ``processes`` of this machine, or ``dask://host:port``, the scheduler of a Dask cluster.
    `workers`: number of tasks that run at once; 0 for one per core, or for all workers of the cluster. Raises
    OptionError for any other `spec`. Raises ExecutorError if the cluster does not respond, has no worker or another
    version of leafcut, or if the extra `cluster` is not installed.
    """
    check_executor(spec)
    if spec.startswith(DASK):
        with _connect_to_dask(spec) as client:
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
def _connect_to_dask(spec: str) -> Iterator[Any]:
    """Connect to a Dask cluster, and disconnect at the end of the block.

    The cluster must have a worker, and all its workers must have this version of leafcut.
    """
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise ExecutorError(f"{spec} needs the package distributed: pip install 'leafcut[cluster]'") from None
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)  # leafcut reports each failure in one line
    try:
        # Large maps make large tasks; no warning is needed.
        with dask.config.set({"admin.large-graph-warning-threshold": "10GB"}):
            try:
                client = Client(f"tcp://{spec.removeprefix(DASK)}", timeout=CONNECT_SECONDS, set_as_default=False)
            except (OSError, ValueError) as problem:
                raise ExecutorError(
                    f"{spec}: no Dask scheduler responds there; start one with dask scheduler, or check host and port"
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
        # `OSError`: the worker has died, and other workers take over its tasks.
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
    """Yield every task with the result of ``work(task)``, or with its exception, as soon as it finishes.

    If the worker of a task dies, the task is repeated alone, because it may be the cause and kill other tasks as well.
    After `attempts` attempts, the task fails with an `ExecutorError`. The iteration ends when `ended`, which is called
    repeatedly, returns True. Raises ExecutorError if the scheduler of a cluster is lost; earlier results remain valid.
    """
    # Submitted tasks that are no longer needed end with the executor. Cancelling them one by one would fail in a broken
    # process pool.
    course = _TaskQueue(executor, work, iter(tasks), attempts)
    while not ended():
        course.submit_tasks()
        if not course.given:
            return
        done, _ = wait(course.given, LOOK_SECONDS, FIRST_COMPLETED)
        if not done and isinstance(executor, WatchedExecutor):
            executor.check()
        for future in done:
            yield from course.collect_result(future)


class _TaskQueue:
    """Submitted tasks, and suspects: tasks that may have killed their worker. Suspects are repeated one at a time."""

    def __init__(self, executor: Executor, work: Callable[[Any], Any], todo: Iterator[Any], attempts: int) -> None:
        self.executor, self.work, self.todo, self.attempts = executor, work, todo, attempts
        self.given: dict[Future[Any], tuple[Any, int]] = {}
        self.suspects: deque[tuple[Any, int]] = deque()
        self.alone = False
        workers = executor.workers if isinstance(executor, WatchedExecutor) else os.cpu_count() or 1
        self.most = GIVEN_OUT * workers

    def submit_tasks(self) -> None:
        """Submit as many tasks as there are free workers. Submit a suspect only if no other task is running."""
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
            raise ExecutorError(f"the workers have stopped ({problem})") from problem

    def collect_result(self, future: Future[Any]) -> Iterator[tuple[Any, Any]]:
        """Yield a task with its result or error; nothing if its worker died and the task will be repeated."""
        task, deaths = self.given.pop(future)
        problem = future.exception()
        if not isinstance(problem, BrokenExecutor | CancelledError):
            yield task, future.result() if problem is None else problem
            return
        if isinstance(self.executor, WatchedExecutor):
            self.executor.check()
        deaths += self.alone
        if deaths >= self.attempts:
            yield task, ExecutorError(f"its worker died {deaths} times (not enough memory?)")
        else:
            self.suspects.append((task, deaths))
