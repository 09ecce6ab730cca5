"""Pack pieces on a strip with the shape nester.

It runs in a subprocess (`sparrow_process`), so it can be stopped anytime.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from leafcut.errors import PlanError
from leafcut.message import Message

SCRIPT = Path(__file__).with_name("sparrow_process.py")
#: Interval at which cancellation is checked, s.
POLL = 0.1
#: Value for "no limit" in a task.
UNLIMITED = 1e9
#: The nester is considered hung if it exceeds its time limit by this time, s.
PATIENCE = 600.0


class NesterError(PlanError):
    """The nester returned no result. Only the current variant is lost, and the others continue."""


@dataclass(frozen=True)
class StripItem:
    """A shape to pack.

    It has points (x, y in mm, without holes), a quantity, and allowed rotations in degrees (None for any).
    """

    shape: Sequence[tuple[float, float]]
    demand: int
    angles: Sequence[float] | None


@dataclass(frozen=True)
class StripBudget:
    """Limits for the search for a strip.

    They apply to the number of steps, the number of failed strip widths (`failures`), and the time, s. `workers` is the
    number of threads, which affects the result.
    """

    steps: float = math.inf
    failures: float = math.inf
    seconds: float = math.inf
    workers: int = 1


@dataclass(frozen=True)
class Strip:
    """A packed strip, as returned by the nester.

    It contains the length, mm, the items as (index, degrees, x, y), the number of steps, and the reason why the search
    ended.
    """

    width: float
    items: tuple[tuple[int, float, float, float], ...]
    steps: int
    ended: str


def pack_strip(
    items: Sequence[StripItem],
    height: float,
    seed: int,
    budget: StripBudget,
    *,
    enough: float = 0.0,
    cancelled: threading.Event | None = None,
) -> Strip:
    """Pack all items into the shortest strip that the search can find. The strip starts at (0, 0) and extends along x.

    Each item is rotated about its origin, and then moved. The same seed and number of steps give the same strip, but
    with a time limit, results may differ. The nester (sparrow, through spyrrow) computes in single precision, so allow
    for errors of 0.01 mm. The search ends as soon as the length is at most `enough` mm.

    Raises
    ------
    NesterError
        If the nester failed or `cancelled` was set.
    PlanError
        If the nester is not installed.
    """
    require_package("spyrrow")
    task = {
        "height": height,
        "items": [{"shape": list(i.shape), "demand": i.demand, "angles": i.angles} for i in items],
        "seed": seed,
        "steps": min(budget.steps, UNLIMITED),
        "failures": min(budget.failures, UNLIMITED),
        "seconds": min(budget.seconds, UNLIMITED),
        "enough": enough,
        "workers": budget.workers,
    }
    answer = _run_nester(task, budget.seconds + PATIENCE, cancelled or threading.Event())
    placed = tuple((int(i), float(a), float(x), float(y)) for i, a, x, y in answer["items"])
    return Strip(float(answer["width"]), placed, int(answer["steps"]), str(answer["ended"]))


def require_package(package: str) -> None:
    """Raise PlanError if a package is not installed. The message contains the command that installs it."""
    if importlib.util.find_spec(package) is None:
        raise PlanError("nesting needs the package {}: pip install 'leafcut[nest]'", package)


def _run_nester(task: dict[str, Any], patience: float, cancelled: threading.Event) -> dict[str, Any]:
    """Run the nester in a subprocess and return its answer. If `cancelled` is set, the subprocess is killed."""
    # -P: modules in the folder of the script or of the user must not shadow the standard library.
    command = [sys.executable, "-P", str(SCRIPT)]
    environment = {**os.environ, "RAYON_NUM_THREADS": str(task["workers"]), "RUST_BACKTRACE": "0"}
    deadline = time.monotonic() + patience
    # Use files instead of pipes: a pipe that is not read during the search could fill up and block the nester.
    with (
        tempfile.TemporaryFile() as output,
        tempfile.TemporaryFile() as errors,
        subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=output, stderr=errors) as process,
    ):
        try:
            _send_task(process, task)
            while process.poll() is None and not cancelled.is_set() and time.monotonic() < deadline:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(POLL)
        finally:
            process.kill()  # also after Ctrl-C; has no effect if the process has ended
        process.wait()
        if cancelled.is_set():
            raise NesterError("stopped")
        output.seek(0)
        errors.seek(0)
        return _parse_answer(output.read(), errors.read())


def _send_task(process: subprocess.Popen[bytes], task: dict[str, Any]) -> None:
    assert process.stdin is not None
    try:
        process.stdin.write(json.dumps(task).encode() + b"\n")
        process.stdin.flush()
    except OSError:  # the process has already ended; its standard error contains the reason
        with suppress(OSError):
            process.stdin.close()


def _parse_answer(output: bytes, errors: bytes) -> dict[str, Any]:
    try:
        answer: dict[str, Any] = json.loads(output)
    except ValueError:
        lines = [" ".join(line.split()) for line in errors.decode(errors="replace").splitlines() if line.strip()]
        after_panic = [b for a, b in pairwise(lines) if "panicked" in a]
        reason = (after_panic or lines[-1:] or [Message("no reason given")])[0]
        raise NesterError("the nester returned no result ({})", reason[:120]) from None
    return answer
