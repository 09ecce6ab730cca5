"""Threads, processes and clusters run each task once; a dead worker loses no task."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dask_cluster import Cluster
from leafcut._version import __version__
from leafcut.errors import OptionError, ReadError
from leafcut.order.executors import (
    ExecutorError,
    WatchedExecutor,
    _check_version,
    _Dask,
    _wait_for_first_worker,
    check_executor,
    open_executor,
    run_tasks,
)

#: Runs in a process of its own: Dask's client keeps threads and sockets until Python ends.
SUMS = """
import sys
from leafcut.order import executors
from leafcut.cli.shared import error_line_and_status
executors.CONNECT_SECONDS = float(sys.argv[2])
try:
    with executors.open_executor(sys.argv[1], 2) as executor:
        for task, found in executors.run_tasks(executor, {work}, {tasks}):
            print(task, found, flush=True)
except Exception as problem:
    print(error_line_and_status(problem)[0], flush=True)
"""


@pytest.fixture
def cluster(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Cluster]:
    """Yield a cluster; its first worker dies at its first task if the parameter is true."""
    pytest.importorskip("distributed")
    created = Cluster(tmp_path, mortal=getattr(request, "param", False))
    yield created
    created.end()


def client_of(spec: str, work: str, tasks: str, connect_seconds: float = 300.0) -> subprocess.Popen[str]:
    """Start a process that runs tasks on an executor and prints their results.

    With the default limit, no cluster on a busy machine counts as missing.
    """
    command = [sys.executable, "-c", SUMS.format(work=work, tasks=tasks), spec, str(connect_seconds)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


@pytest.mark.parametrize("spec", ["threads", "processes"])
def test_every_task_runs_once_and_an_error_is_the_result_of_its_own_task(spec: str) -> None:
    with open_executor(spec, 2) as executor:
        found = dict(run_tasks(executor, int, ["1", "x", *map(str, range(2, 30))]))
    assert isinstance(found.pop("x"), ValueError)
    assert found == {str(k): k for k in range(1, 30)}


def _refuse(kind: str) -> None:
    """Raise an error that has more arguments than its message."""
    raise ReadError("plate.dxf", kind, 7) if kind == "read" else OptionError("--feed: too high")


def test_an_error_of_leafcut_arrives_from_a_process_unchanged() -> None:
    with open_executor("processes", 1) as executor:
        found = dict(run_tasks(executor, _refuse, ["read", "option"]))
    read, option = found["read"], found["option"]
    assert (type(read), str(read), read.file, read.line) == (ReadError, "plate.dxf:7: read", "plate.dxf", 7)
    assert (type(option), str(option)) == (OptionError, "--feed: too high")


class DyingWorkers(WatchedExecutor):
    """Two workers without threads; chosen tasks lose their worker a number of times.

    As in a pool of processes, a dead worker also loses the task that runs next to it.
    """

    def __init__(self, deaths: dict[str, int], loss: Callable[[], BaseException]) -> None:
        super().__init__(2)
        self.deaths, self.loss = dict(deaths), loss
        self.started: list[str] = []
        self.pending: list[tuple[Future[Any], Callable[[str], str], str]] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.started.append(args[0])
        self.pending.append((future, fn, args[0]))
        return future

    def check_alive(self) -> None:
        """Finish all pending tasks, or lose all of them: called while no task is finished."""
        pending, self.pending = self.pending, []
        dead = [task for _, _, task in pending if self.deaths.get(task, 0) > 0]
        for task in dead:
            self.deaths[task] -= 1
        for future, fn, task in pending:
            if dead:
                future.set_exception(self.loss())
            else:
                future.set_result(fn(task))


@pytest.mark.parametrize("loss", [CancelledError, lambda: BrokenProcessPool("gone")], ids=["cluster", "processes"])
def test_tasks_of_dead_workers_run_again_alone_and_a_task_that_always_kills_is_given_up(
    loss: Callable[[], BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each task has its own result, though `bad` kills its workers always and `weak` kills two of them."""
    monkeypatch.setattr("leafcut.order.executors.LOOK_SECONDS", 0.0)
    executor = DyingWorkers({"bad": 99, "weak": 2}, loss)
    tasks = ["a", "bad", "b", "c", "d", "weak", "e"]
    results = list(run_tasks(executor, str.upper, tasks))
    assert sorted(task for task, _ in results) == sorted(tasks)
    found = dict(results)
    given_up = found.pop("bad")
    assert isinstance(given_up, ExecutorError) and "its worker died 3 times" in str(given_up)
    assert found == {task: task.upper() for task in tasks if task != "bad"}
    assert executor.started.count("bad") == 4, "once beside others, three times alone"


@pytest.mark.slow
def test_a_task_that_ends_its_process_is_given_up_and_harms_no_other(tmp_path: Path) -> None:
    """Each other task has its own result, though the pool breaks under it."""
    tasks = ["", *(str(tmp_path / str(k)) for k in range(6))]
    with open_executor("processes", 2) as executor:
        found = dict(run_tasks(executor, _leave_or_name, tasks))
    gone = found.pop("")
    assert isinstance(gone, ExecutorError) and "died 3 times" in str(gone)
    assert found == {task: Path(task).name for task in tasks[1:]}


def _leave_or_name(path: str) -> str:
    """Return the name of a path; end this process if the path is empty."""
    if not path:
        os._exit(9)
    return Path(path).name


def test_a_run_that_is_to_end_submits_no_more_and_leaves_no_process() -> None:
    with open_executor("processes", 2) as executor:
        asked = iter([False, False, True])
        assert list(run_tasks(executor, time.sleep, [3600.0] * 5, ended=lambda: next(asked))) == []
        running = multiprocessing.active_children()
        assert running
    assert not any(process.is_alive() for process in running)


@pytest.mark.parametrize("spec", ["", "thread", "dask://", "dask://host", "tcp://host:1", "dask://host:1/x"])
def test_a_name_of_no_executor_is_refused(spec: str) -> None:
    with pytest.raises(OptionError, match="use threads, processes or dask://host:port"):
        check_executor(spec)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (ExecutorError("a worker has leafcut 0.1"), "a worker has leafcut 0.1"),
        (ModuleNotFoundError("numba"), "dask://here:1: a worker cannot run leafcut .*numba.*; install it there"),
    ],
)
def test_a_worker_that_cannot_run_leafcut_is_refused_and_one_that_dies_is_not(answer: Exception, message: str) -> None:
    def client(*answers: Exception | None) -> Any:
        """Return a client of a cluster whose workers give these answers to the version check."""
        return SimpleNamespace(
            wait_for_workers=lambda count, timeout: None,
            run=lambda *args, on_error: dict(enumerate(answers)),
        )

    with pytest.raises(ExecutorError, match=message):
        _wait_for_first_worker(client(None, answer), "dask://here:1")
    _wait_for_first_worker(client(None, OSError("connection lost")), "dask://here:1")


@pytest.mark.parametrize("refusal", [OSError("no answer\nafter 5 s"), ValueError("port 99999"), TimeoutError()])
def test_a_missing_cluster_is_refused_in_one_line(refusal: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    def client(*args: Any, **options: Any) -> Any:
        raise refusal

    config = SimpleNamespace(set=lambda values: nullcontext())
    monkeypatch.setitem(sys.modules, "dask", SimpleNamespace(config=config))  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=client))  # type: ignore[arg-type]
    with pytest.raises(ExecutorError) as refused, open_executor("dask://shop:8786"):
        pytest.fail("there is no cluster")
    line = str(refused.value)
    assert line.startswith("dask://shop:8786: no Dask scheduler responds there") and "\n" not in line


@pytest.mark.slow
def test_dask_reports_a_missing_cluster_as_one_line() -> None:
    pytest.importorskip("distributed")
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))  # and no `listen`: every connection is refused
        spec = f"dask://127.0.0.1:{silent.getsockname()[1]}"
        out, _ = client_of(spec, "abs", "range(3)", connect_seconds=0.5).communicate()
    assert out.startswith(f"{spec}: no Dask scheduler responds there") and out.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [True], indirect=True)
def test_a_worker_of_two_that_dies_during_a_task_costs_no_task(cluster: Cluster) -> None:
    client = client_of(cluster.spec, "abs", "range(40)")
    out, _ = client.communicate()
    assert sorted(out.splitlines()) == sorted(f"{k} {k}" for k in range(40))
    assert cluster.workers[0].wait() == -signal.SIGKILL


@pytest.mark.slow
def test_a_scheduler_that_dies_during_a_task_is_one_line(cluster: Cluster) -> None:
    with client_of(cluster.spec, "__import__('time').sleep", "[0.1] + [3600.0] * 9") as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "0.1 None\n"
        cluster.scheduler.send_signal(signal.SIGKILL)
        out = client.stdout.read()
    assert out == f"{cluster.spec}: the scheduler has stopped; restart it and repeat the command\n"


class FakeClient:
    """A Dask client whose cluster runs each task at once, with the outcome of the test."""

    def __init__(self) -> None:
        self.status, self.workers = "running", {"a": 1}
        self.outcome: BaseException | None = None
        self.closed: list[float] = []

    def nthreads(self) -> dict[str, int]:
        return {"a": 2, "b": 3}

    def get_executor(self, *, pure: bool) -> FakeClient:
        assert not pure
        return self

    def submit(self, work: Callable[..., Any], *given: Any) -> Future[Any]:
        done: Future[Any] = Future()
        if isinstance(self.outcome, CancelledError):
            done.cancel()
            done.set_running_or_notify_cancel()
        elif self.outcome is not None:
            done.set_exception(self.outcome)
        else:
            done.set_result(work(*given))
        return done

    def scheduler_info(self, *, n_workers: int) -> dict[str, Any]:
        assert n_workers == -1
        if self.status == "broken":
            raise OSError
        return {"workers": self.workers}

    def close(self, timeout: float) -> None:
        self.closed.append(timeout)
        raise OSError("the scheduler is gone")


class KilledWorker(Exception):
    """Named like the error of Dask for a task that ended every worker."""


def test_a_cluster_has_the_threads_of_its_workers_and_passes_on_results_and_errors() -> None:
    client = FakeClient()
    executor = _Dask(client, "dask://here:1", 0)
    assert (executor.workers, executor.together) == (5, 3)
    assert _Dask(client, "dask://here:1", 4).workers == 4
    assert executor.submit(int, "21", base=8).result() == 17
    for outcome, kind, words in (
        (KilledWorker(), ExecutorError, "every worker that started this task died (not enough memory?)"),
        (ValueError("no"), ValueError, "no"),
        (CancelledError(), CancelledError, ""),
    ):
        client.outcome = outcome
        problem = executor.submit(int, "1").exception()
        assert type(problem) is kind
        assert str(problem) == words
    executor.shutdown()
    assert client.closed == [2]


def test_a_lost_scheduler_and_ten_minutes_without_a_worker_end_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("leafcut.order.executors.time", SimpleNamespace(monotonic=lambda: now[0]))
    client = FakeClient()
    executor = _Dask(client, "dask://here:1", 0)
    client.workers = {}
    now[0] += 600.0
    executor.check_alive()
    client.workers = {"a": 1}
    now[0] += 1.0
    executor.check_alive()
    client.workers = {}
    now[0] += 600.0
    executor.check_alive()
    now[0] += 1.0
    with pytest.raises(ExecutorError) as refused:
        executor.check_alive()
    assert str(refused.value) == "dask://here:1: no worker for 10 minutes; start one and repeat the command"
    client.status = "closed"
    for call in (executor.check_alive, lambda: executor.submit(int, "1")):
        with pytest.raises(ExecutorError) as refused:
            call()
        assert str(refused.value) == "dask://here:1: the scheduler has stopped; restart it and repeat the command"


def test_a_worker_with_another_version_is_refused_with_both_versions() -> None:
    with pytest.raises(ExecutorError) as refused:
        _check_version("0.0.1")
    assert str(refused.value) == (f"a worker has leafcut {__version__}, this machine 0.0.1; install one version on all")
    _check_version(__version__)


class FakeDask:
    """The packages dask and distributed, with a client that answers as given."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, answers: dict[str, object], workers: bool = True) -> None:
        self.calls: list[object] = []

        class Client(FakeClient):
            def __init__(_, address: str, *, timeout: float, set_as_default: bool) -> None:
                super().__init__()
                self.calls.append((address, timeout, set_as_default, logging.getLogger("distributed").level))
                self.client = _

            def wait_for_workers(_, count: int, *, timeout: float) -> None:
                self.calls.append((count, timeout))
                if not workers:
                    raise TimeoutError

            def run(_, work: Callable[..., None], *given: object, on_error: str) -> dict[str, object]:
                self.calls.append((work, given, on_error))
                return answers

        @contextmanager
        def setting(values: dict[str, object]) -> Iterator[None]:
            self.calls.append(values)
            yield

        config = SimpleNamespace(set=setting)
        monkeypatch.setitem(sys.modules, "dask", SimpleNamespace(config=config))  # type: ignore[arg-type]
        monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=Client))  # type: ignore[arg-type]


def test_a_cluster_is_checked_used_and_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its log is silent meanwhile."""
    log = logging.getLogger("distributed")
    monkeypatch.setattr(log, "level", logging.ERROR)
    fake = FakeDask(monkeypatch, {"a": None, "b": OSError("died")})
    with open_executor("dask://shop:8786", 3) as executor:
        assert (executor.workers, executor.shared) == (3, False)
        assert executor.submit(int, "7").result() == 7
        assert log.level == logging.CRITICAL + 1
        assert fake.client.closed == []
    assert log.level == logging.ERROR
    assert fake.client.closed == [2, 2]
    assert fake.calls == [
        {"admin.large-graph-warning-threshold": "10GB"},
        ("tcp://shop:8786", 5.0, False, logging.CRITICAL + 1),
        (1, 10.0),
        (_check_version, (__version__,), "return"),
    ]


@pytest.mark.parametrize(
    ("answers", "workers", "message"),
    [
        ({}, False, "dask://shop:1: the cluster has no worker; start one with dask worker shop:1"),
        (
            {"a": None, "b": ImportError("numba")},
            True,
            f"dask://shop:1: a worker cannot run leafcut {__version__} (ImportError: numba); install it there",
        ),
        ({"a": ExecutorError("another version")}, True, "another version"),
    ],
)
def test_a_cluster_that_cannot_be_used_is_left(
    answers: dict[str, object], workers: bool, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake, log = FakeDask(monkeypatch, answers, workers), logging.getLogger("distributed")
    level = log.level
    with pytest.raises(ExecutorError) as refused, open_executor("dask://shop:1"):
        pytest.fail("the cluster cannot be used")
    assert str(refused.value) == message
    assert (fake.client.closed, log.level) == ([2], level)


def test_a_cluster_needs_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)  # type: ignore[arg-type]
    with pytest.raises(ExecutorError) as refused, open_executor("dask://shop:1"):
        pytest.fail("the package is missing")
    assert str(refused.value) == "dask://shop:1 needs the package distributed: pip install 'leafcut[cluster]'"


@pytest.mark.parametrize(("workers", "cores", "count"), [(3, 8, 3), (0, 8, 8), (0, None, 1)])
def test_threads_share_memory_and_are_as_many_as_cores(
    workers: int, cores: int | None, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    with open_executor("threads", workers) as executor:
        assert (executor.workers, executor.together, executor.shared) == (count, count, True)
        assert executor.submit(int, "21", base=8).result() == 17
        executor.check_alive()
    with pytest.raises(RuntimeError):
        executor.submit(int, "1")


class Slots(WatchedExecutor):
    """An executor whose tasks end when a test says so."""

    def __init__(self) -> None:
        super().__init__(2)
        self.given: list[tuple[object, Future[Any]]] = []
        self.checks = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if args == ("broken",):
            raise BrokenProcessPool("no pool")
        self.given.append((*args, Future()))
        return self.given[-1][1]

    def check_alive(self) -> None:
        self.checks += 1


def test_two_tasks_per_worker_are_submitted_and_suspects_run_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two workers have four tasks at once. They die with all four; then each of these runs alone, and one of them,
    which kills its worker three more times, is given up. The tasks that were not submitted yet come last.
    """
    monkeypatch.setattr("leafcut.order.executors.LOOK_SECONDS", 0.0)
    slots, running = Slots(), []
    killer: list[object] = []

    def ended() -> bool:
        still = [(task, future) for task, future in slots.given if not future.done()]
        running.append(len(still))
        if len(running) == 3:
            for _, future in still:
                future.set_exception(BrokenProcessPool("died"))
        elif len(running) > 3 and len(still) == 1:
            killer[:] = killer or [still[0][0]]
            if still[0][0] == killer[0]:
                still[0][1].set_exception(BrokenProcessPool("died again"))
            else:
                still[0][1].set_result("done")
        elif len(running) > 3:
            for _, future in still:
                future.set_result("done")
        return False

    found = {task: str(result) for task, result in run_tasks(slots, str, "abcdefg", ended=ended)}
    assert [count for count in running if count] == [4, 4, *[1] * 6, 3]
    assert {task for task, result in found.items() if result != "done"} == set(killer)
    assert found[killer[0]] == "its worker died 3 times (not enough memory?)"  # type: ignore[index]
    assert set(found) == set("abcdefg")
    assert slots.checks >= 7


def test_an_executor_that_takes_no_task_ends_the_work() -> None:
    with pytest.raises(ExecutorError) as refused:
        list(run_tasks(Slots(), str, ["broken"]))
    assert str(refused.value) == "the workers have stopped (no pool)"
