"""A Dask cluster on this machine, for tests: each of its processes is ended by its number."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import psutil


class Cluster:
    """A scheduler and two workers of Dask on this machine, each a process that is ended by its number."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
        until(self.file.exists)
        until(lambda: self.file.read_text().endswith("}"))
        self.spec = json.loads(self.file.read_text())["address"].replace("tcp://", "dask://")
        self.workers = [self._start("worker", "--no-nanny", "--nthreads", "1", "--no-dashboard") for _ in range(2)]

    def _start(self, kind: str, *words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self.file), *words]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.processes.append(subprocess.Popen(command, cwd=self.file.parent, **quiet))
        return self.processes[-1]

    def until_busy(self, seconds: float = 0.5) -> None:
        """Wait until the first worker has worked for so long since now, by the processor."""
        began = self._worked()
        until(lambda: self._worked() > began + seconds)

    def _worked(self) -> float:
        times = psutil.Process(self.workers[0].pid).cpu_times()
        return float(times.user + times.system)

    def end(self) -> None:
        """End all of them."""
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def until(there: object) -> None:
    """Wait for something that comes soon; a machine may be busy."""
    for _ in range(600):
        if there():  # type: ignore[operator]
            return
        time.sleep(0.1)
    raise AssertionError("it did not come in a minute")
