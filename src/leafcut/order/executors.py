"""Run tasks in threads, in processes, or on a Dask cluster, with the interface of `concurrent.futures.Executor`.

A task is an importable function with arguments that can be pickled. Threads accept any arguments. If a worker dies,
another worker repeats its unfinished tasks. Dask is only imported when it is used.
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

#: Wait this many seconds for a cluster to answer, and for its first worker.
CONNECT_SECONDS, FIRST_WORKER_SECONDS = 5.0, 10.0

#: Tasks wait this many seconds for a worker before they fail. A batch system may take minutes to start workers.
PATIENCE_SECONDS = 600.0

#: Check the executor and look for a cancellation this often, in seconds.
LOOK_SECONDS = 0.2

#: A task fails if it has killed its worker this many times while no other task was running.
ATTEMPTS = 3

#: The user may request at most this many workers.
MOST_WORKERS = 1024

#: Number of tasks submitted per worker: one that is running, and another that is waiting, so that the worker never
#: idles.
GIVEN_OUT = 2


class ExecutorError(LeafcutError):
    """A cluster is unreachable, lost, or incompatible, or a task killed every worker that ran it."""


class WatchedExecutor(Executor):
    """An executor with a known number of workers, which can check whether its workers are still running.

    If `shared` is set, the tasks share this process's memory and can therefore be cancelled.
    """

    shared = False
    #: Number of tasks that run at the same time in the same process. Only their total processor time can be measured.
    together = 1

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def check_alive(self) -> None:
        """Raise `ExecutorError` if the submitted tasks can no longer finish."""


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
    """A pool of local processes.

    If a process dies, the whole pool shuts down, and a new pool takes over the next tasks.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self.pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        # Not "fork", because a forked process may wait forever for a lock that another thread held.
        context = multiprocessing.get_context("spawn")
        stop, self._alive = context.Pipe(duplex=False)
        return ProcessPoolExecutor(self.workers, context, _initialize_worker, (stop,))

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
    """Block Ctrl-C while new processes start, so that it cannot reach them before they ignore it themselves."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # started here, because its start by the first process would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _initialize_worker(stop: connection.Connection) -> None:
    """Ignore Ctrl-C, because the parent handles it. Exit when the parent closes `stop` or ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def exit_with_parent() -> None:
        if parent is not None:
            connection.wait([stop, parent.sentinel])
            os._exit(1)

    threading.Thread(target=exit_with_parent, daemon=True).start()


class _Dask(WatchedExecutor):
    """Executor on a Dask cluster.

    This class pickles arguments and results itself. Otherwise, Dask might deliver read-only arrays, which compiled
    kernels treat as a different type.
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
        self.executor.submit(_run_packed_call, __version__, packed).add_done_callback(
            lambda done: _copy_outcome(done, answer)
        )
        return answer

    def check_alive(self) -> None:
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


def _run_packed_call(version: str, packed: bytes) -> bytes:
    """Run a task on a worker of a cluster. Raises an error if the worker runs a different version of leafcut."""
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
    """Open an executor. At the end of the block, close it together with its threads, processes, and connections.

    Parameters
    ----------
    spec
        ``threads``, ``processes`` (on this machine), or ``dask://host:port`` (the scheduler of a Dask cluster).
    workers
        Number of tasks that run at the same time. 0 means one per core, or all workers of the cluster.

    Raises
    ------
    OptionError
        If `spec` has any other value.
    ExecutorError
        If the cluster does not respond, has no worker, or runs a different version of leafcut, or if the extra
        `cluster` is not installed.
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

    The cluster must have at least one worker, and all workers must run this version of leafcut.
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
                _wait_for_first_worker(client, spec)
                yield client
            finally:
                with suppress(Exception):
                    client.close(timeout=2)
    finally:
        log.setLevel(level)


def _wait_for_first_worker(client: Any, spec: str) -> None:
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
    """Run the tasks, and yield each task with the result or exception of ``work(task)`` as soon as it finishes.

    If a worker dies, its task may have killed it and might kill other workers as well. The task is therefore repeated
    alone. After `attempts` attempts, it fails with an `ExecutorError`. The iteration stops when `ended`, which is
    called repeatedly, returns True. If the scheduler of a cluster is lost, the function raises ExecutorError. Earlier
    results remain valid.
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
            executor.check_alive()
        for future in done:
            yield from course.collect_result(future)


class _TaskQueue:
    """Queue of submitted tasks.

    Tasks that may have killed their worker are suspects, and are repeated one at a time.
    """

    def __init__(self, executor: Executor, work: Callable[[Any], Any], todo: Iterator[Any], attempts: int) -> None:
        self.executor, self.work, self.todo, self.attempts = executor, work, todo, attempts
        self.given: dict[Future[Any], tuple[Any, int]] = {}
        self.suspects: deque[tuple[Any, int]] = deque()
        self.alone = False
        workers = executor.workers if isinstance(executor, WatchedExecutor) else os.cpu_count() or 1
        self.most = GIVEN_OUT * workers

    def submit_tasks(self) -> None:
        """Submit a task to each free worker. Submit a suspect only if no other task is running."""
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
        """Yield a task with its result or its error. Yield nothing if its worker died and the task will be repeated."""
        task, deaths = self.given.pop(future)
        problem = future.exception()
        if not isinstance(problem, BrokenExecutor | CancelledError):
            yield task, future.result() if problem is None else problem
            return
        if isinstance(self.executor, WatchedExecutor):
            self.executor.check_alive()
        deaths += self.alone
        if deaths >= self.attempts:
            yield task, ExecutorError(f"its worker died {deaths} times (not enough memory?)")
        else:
            self.suspects.append((task, deaths))
