"""Threads, processes and clusters run each task once; a dead worker loses no task."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from dask_cluster import Cluster
from leafcut.errors import OptionError, ReadError
from leafcut.executors import ExecutorError, check_executor, open_executor, run_tasks

#: Runs in a process of its own: Dask's client leaves threads and sockets to Python's end.
SUMS = """
import sys
from leafcut.cli import _failure
from leafcut.executors import open_executor, run_tasks
try:
    with open_executor(sys.argv[1], 2) as executor:
        for task, found in run_tasks(executor, {work}, {tasks}):
            print(task, found, flush=True)
except Exception as problem:
    print(_failure(problem)[0], flush=True)
"""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    pytest.importorskip("distributed")
    made = Cluster(tmp_path)
    yield made
    made.end()


def client_of(spec: str, work: str, tasks: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", SUMS.format(work=work, tasks=tasks), spec]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


@pytest.mark.parametrize("spec", ["threads", "processes"])
def test_every_task_is_done_once_and_an_error_is_the_answer_of_its_own_task(spec: str) -> None:
    with open_executor(spec, 2) as executor:
        found = dict(run_tasks(executor, int, ["1", "x", *map(str, range(2, 30))]))
    assert isinstance(found.pop("x"), ValueError)
    assert found == {str(k): k for k in range(1, 30)}


def _refuse(kind: str) -> None:
    """Raise an error that is made of more than its message."""
    raise ReadError("plate.dxf", kind, 7) if kind == "read" else OptionError("--feed: too high")


def test_an_error_of_leafcut_comes_from_a_process_as_it_was() -> None:
    with open_executor("processes", 1) as executor:
        found = dict(run_tasks(executor, _refuse, ["read", "option"]))
    read, option = found["read"], found["option"]
    assert (type(read), str(read), read.file, read.line) == (ReadError, "plate.dxf:7: read", "plate.dxf", 7)
    assert (type(option), str(option)) == (OptionError, "--feed: too high")


def test_a_task_that_ends_its_workers_is_given_up_and_harms_no_other(tmp_path: Path) -> None:
    """Each of the others has its own answer, though the pool was broken under it."""
    tasks = ["", *(str(tmp_path / str(k)) for k in range(6))]
    with open_executor("processes", 2) as executor:
        found = dict(run_tasks(executor, _leave_or_name, tasks))
    gone = found.pop("")
    assert isinstance(gone, ExecutorError) and "died 3 times" in str(gone)
    assert found == {task: Path(task).name for task in tasks[1:]}


def _leave_or_name(path: str) -> str:
    """End this process where there is no path."""
    if not path:
        os._exit(9)
    return Path(path).name


def test_when_it_is_to_end_no_more_is_given_and_no_process_is_left() -> None:
    with open_executor("processes", 2) as executor:
        asked = iter([False, False, True])
        assert list(run_tasks(executor, time.sleep, [3600.0] * 5, ended=lambda: next(asked))) == []
        running = list(executor.pool._processes.values())  # type: ignore[attr-defined]
        assert running
    assert not any(process.is_alive() for process in running)


@pytest.mark.parametrize("spec", ["", "thread", "dask://", "dask://host", "tcp://host:1", "dask://host:1/x"])
def test_what_names_no_executor_is_refused(spec: str) -> None:
    with pytest.raises(OptionError, match="use threads, processes or dask://host:port"):
        check_executor(spec)


@pytest.mark.slow
def test_a_worker_of_two_that_is_killed_in_the_middle_costs_no_task(cluster: Cluster) -> None:
    with client_of(cluster.spec, "__import__('time').sleep", "[0.05 + k / 1000 for k in range(40)]") as client:
        assert client.stdout is not None
        first = client.stdout.readline()
        cluster.workers[0].send_signal(signal.SIGKILL)
        lines = [first, *client.stdout]  # and not communicate: what was read ahead with the first line would be lost
    assert sorted(float(line.split()[0]) for line in lines) == [0.05 + k / 1000 for k in range(40)]
    assert {line.split()[1] for line in lines} == {"None"}, lines


@pytest.mark.slow
def test_a_scheduler_that_dies_in_the_middle_is_one_line(cluster: Cluster) -> None:
    with client_of(cluster.spec, "__import__('time').sleep", "[0.1] + [60.0] * 9") as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "0.1 None\n"
        cluster.scheduler.send_signal(signal.SIGKILL)
        out = client.stdout.read()
    assert out == f"{cluster.spec}: the scheduler is gone; start it again and repeat the command\n"
