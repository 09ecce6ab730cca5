"""A strip packed by the irregular nester: asks `sparrow_process`, and sees to it that it ends."""

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

SCRIPT = Path(__file__).with_name("sparrow_process.py")
#: How often a wish to stop is looked for, s.
POLL = 0.1
#: Stands for "no limit" in a task.
UNLIMITED = 1e9
#: Of the answer's first steps none may take longer than this beyond its time, s; then something is wrong.
PATIENCE = 600.0


class NesterError(PlanError):
    """The nester gave no answer; one variant is lost, not the run."""


@dataclass(frozen=True)
class StripItem:
    """A shape (x, y in mm, without holes), how often, and its angles in degrees, None for any."""

    shape: Sequence[tuple[float, float]]
    demand: int
    angles: Sequence[float] | None


@dataclass(frozen=True)
class StripBudget:
    """When a search of one strip ends, at the latest; infinite where it must not.

    After so many `steps`, after giving up on a width so often (`failures`), after so many `seconds`. `workers` threads
    search; more than one give other strips than one.
    """

    steps: float = math.inf
    failures: float = math.inf
    seconds: float = math.inf
    workers: int = 1


@dataclass(frozen=True)
class Strip:
    """A packed strip: its width (mm), the items as (index, degrees, x, y), and what ended the search."""

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
    """Return all items in a strip of a height, as narrow as was found; it begins at (0, 0) and runs along x.

    An item is turned about its origin, then moved. The same seed and number of steps give the same strip; a limit of
    time may not. The nester (sparrow, by spyrrow) reckons in single precision: leave a hundredth of a millimetre.

    Parameters
    ----------
    enough
        A strip this narrow (mm) ends the search.

    Raises
    ------
    NesterError
        The nester failed, or `cancelled` was set.
    PlanError
        It is not installed.
    """
    require("spyrrow")
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
    answer = _ask(task, budget.seconds + PATIENCE, cancelled or threading.Event())
    placed = tuple((int(i), float(a), float(x), float(y)) for i, a, x, y in answer["items"])
    return Strip(float(answer["width"]), placed, int(answer["steps"]), str(answer["ended"]))


def require(package: str) -> None:
    """Raise `PlanError` with one line that names the extra, where a package is not installed."""
    if importlib.util.find_spec(package) is None:
        raise PlanError(f"nesting needs the package {package}: pip install 'leafcut[nest]'")


def _ask(task: dict[str, Any], patience: float, cancelled: threading.Event) -> dict[str, Any]:
    """Return the answer of a process of its own; it ends with this one, and when `cancelled` is set."""
    # -P: no module in the script's or the user's folder stands for one of Python's own.
    command = [sys.executable, "-P", str(SCRIPT)]
    environment = {**os.environ, "RAYON_NUM_THREADS": str(task["workers"]), "RUST_BACKTRACE": "0"}
    deadline = time.monotonic() + patience
    # Files, not pipes: nobody reads while it works, and a full pipe would stop it.
    with (
        tempfile.TemporaryFile() as said,
        tempfile.TemporaryFile() as complaint,
        subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=said, stderr=complaint) as process,
    ):
        try:
            _tell(process, task)
            while process.poll() is None and not cancelled.is_set() and time.monotonic() < deadline:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(POLL)
        finally:
            process.kill()  # also when Ctrl-C ends the wait; of a process that has ended, nothing
        process.wait()
        if cancelled.is_set():
            raise NesterError("stopped")
        said.seek(0)
        complaint.seek(0)
        return _understood(said.read(), complaint.read())


def _tell(process: subprocess.Popen[bytes], task: dict[str, Any]) -> None:
    """Give a process its task; its standard input stays open for as long as somebody waits for the answer."""
    assert process.stdin is not None
    try:
        process.stdin.write(json.dumps(task).encode() + b"\n")
        process.stdin.flush()
    except OSError:  # it has ended already; what it said tells why
        with suppress(OSError):
            process.stdin.close()


def _understood(said: bytes, complaint: bytes) -> dict[str, Any]:
    try:
        answer: dict[str, Any] = json.loads(said)
    except ValueError:
        lines = [" ".join(line.split()) for line in complaint.decode(errors="replace").splitlines() if line.strip()]
        after_panic = [b for a, b in pairwise(lines) if "panicked" in a]
        reason = (after_panic or lines[-1:] or ["no reason given"])[0]
        raise NesterError(f"the nester gave no answer ({reason[:120]})") from None
    return answer
