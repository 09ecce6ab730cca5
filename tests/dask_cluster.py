"""A Dask cluster on this machine for tests: one scheduler and two workers with one thread each."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

#: Kills a worker with SIGKILL when it starts its first task, so that it dies between receiving and finishing one.
DIES_AT_FIRST_TASK = """
import os
import signal

from distributed.diagnostics.plugin import WorkerPlugin


class DiesAtFirstTask(WorkerPlugin):
    def transition(self, key, start, finish, **kwargs):
        if finish == "executing":
            os.kill(os.getpid(), signal.SIGKILL)


async def dask_setup(worker):
    await worker.plugin_add(plugin=DiesAtFirstTask())
"""

#: Ends as soon as the scheduler has two workers.
WAIT_FOR_WORKERS = "import sys; from distributed import Client; Client(scheduler_file=sys.argv[1]).wait_for_workers(2)"


class Cluster:
    """A scheduler and two workers of Dask; both workers are registered.

    The first worker dies at its first task if `mortal` is set.
    """

    def __init__(self, folder: Path, mortal: bool = False) -> None:
        self.file = folder / "scheduler.json"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
        until(lambda: self.file.exists() and self.file.read_text().endswith("}"))
        self.spec = json.loads(self.file.read_text())["address"].replace("tcp://", "dask://")
        preload = folder / "dies_at_first_task.py"
        preload.write_text(DIES_AT_FIRST_TASK)
        worker = ["worker", "--no-nanny", "--nthreads", "1", "--no-dashboard"]
        self.workers = [
            self._start(*worker, *(["--preload", str(preload)] if mortal else [])),
            self._start(*worker),
        ]
        # In a process of its own: Dask's client keeps threads and sockets until Python ends.
        subprocess.run([sys.executable, "-c", WAIT_FOR_WORKERS, str(self.file)], check=True, stderr=subprocess.DEVNULL)

    def _start(self, kind: str, *words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self.file), *words]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.processes.append(subprocess.Popen(command, cwd=self.file.parent, **quiet))
        return self.processes[-1]

    def end(self) -> None:
        """End all processes."""
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def until(reached: Callable[[], bool]) -> None:
    """Wait until a condition holds; the limit of five minutes only guards against a hang."""
    for _ in range(3000):
        if reached():
            return
        time.sleep(0.1)
    raise AssertionError("the condition did not hold within five minutes")
