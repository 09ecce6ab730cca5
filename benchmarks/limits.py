"""Requested time limit compared with the time of the searches: every process, on an idle or loaded machine.

    python -m benchmarks limits
    python -m benchmarks limits drill cut --limits 1 5 --load 4

Each run is a separate process. It measures the wall-clock time of its searches, including their lower bounds, and of
the whole run. Loading compiled kernels is not part of a search. `--load` adds busy processes.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from inspect import isgeneratorfunction
from pathlib import Path
from typing import Any

from benchmarks import ROOT, page
from benchmarks.growth import WORKS, Work
from leafcut.order.stop import clock

#: Sizes of the work, which are so large that most searches do not end within 20 s.
SIZES = {
    "drill": 2000,
    "panel": 200,
    "cut": 300,
    "engrave": 1500,
    "reorder": 40_000,
    "pocket": 4,
    "pockets": 9,
    "nest": 60,
}
#: Modules and functions of the searches. A search inside a search counts only once.
SEARCHES = (
    ("leafcut.order.solve", "solve"),
    ("leafcut.processes.pocket.plan.connected_rings", "connected_path"),
    ("leafcut.nesting.plan.nesting", "variants"),
)
#: A run is late if its searches exceed the limit by 10 % and 0.1 s.
LATE, LEAST = 0.1, 0.1


class Watch:
    """A stopwatch that runs while its context is active, without the time to load and compile kernels."""

    def __init__(self) -> None:
        self.seconds, self._inside, self._began = 0.0, 0, 0.0

    def __enter__(self) -> None:
        if not self._inside:
            self._began = clock()
        self._inside += 1

    def __exit__(self, *_: object) -> None:
        self._inside -= 1
        if not self._inside:
            self.seconds += clock() - self._began


def run_watched(words: list[str]) -> None:
    """Run a leafcut command, and print the times of its searches and of the whole run, s, as JSON."""
    from leafcut.cli.app import run

    watch, began = Watch(), time.monotonic()
    for name, function in SEARCHES:
        module = import_module(name)
        setattr(module, function, watched(getattr(module, function), watch))
    status = 0
    try:
        run(words)
    except SystemExit as end:
        status = int(end.code or 0)
    print(json.dumps([watch.seconds, time.monotonic() - began]))
    sys.exit(status)


def watched(function: Callable[..., Any], watch: Watch) -> Callable[..., Any]:
    """Return the function or generator with the watch running during its execution."""

    def yielding(*given: Any, **named: Any) -> Iterator[Any]:
        values = function(*given, **named)
        while True:
            try:
                with watch:
                    value = next(values)
            except StopIteration:
                return
            yield value

    def plain(*given: Any, **named: Any) -> Any:
        with watch:
            return function(*given, **named)

    return yielding if isgeneratorfunction(function) else plain


def seconds(work: Work, count: int, limit: float, folder: str) -> tuple[float, float]:
    """Return the wall-clock times of the searches and of the whole run, s.

    Raises
    ------
    AssertionError
        The run ended with an error.
    """
    words = [*work.command(count), "--time-limit", f"{limit:g}", "--quiet"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "limits", "--run", json.dumps(words)],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise AssertionError(f"{' '.join(words)}: {done.stderr.strip()}")
    search, whole = json.loads(done.stdout.splitlines()[-1])
    return search, whole


@contextmanager
def loaded(count: int) -> Iterator[None]:
    """Keep `count` processes busy."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def above_zero(limit: str) -> float:
    """Return a time limit from the command line, s; refuse limits with which a search would never end."""
    try:
        taken = float(limit)
    except ValueError:
        taken = math.nan
    if not 0.0 < taken < math.inf:
        raise argparse.ArgumentTypeError(f"{limit!r} is not a number of seconds above 0")
    return taken


def measured(name: str, limits: list[float], folder: str) -> Iterator[list[str]]:
    """Yield a row for each limit."""
    work, count = WORKS[name], SIZES[name]
    work.make(count, Path(folder) / work.file)
    seconds(work, count, 0.001, folder)  # compiles the kernels
    for limit in limits:
        search, whole = seconds(work, count, limit, folder)
        note = "late" if search - limit > max(LATE * limit, LEAST) else ""
        times = [f"{limit:g} s", f"{search:.1f} s", f"{whole:.1f} s"]
        yield [name, f"{count:,} {work.counts}", *times, note]


def main(argv: Sequence[str]) -> int:
    """Measure all work and publish the table."""
    parser = page.parser("limits", __doc__)
    parser.add_argument("names", nargs="*", type=page.one_of(SIZES), help=f"of {', '.join(SIZES)} (default: all)")
    parser.add_argument("--limits", nargs="*", type=above_zero, default=[1.0, 5.0, 20.0], help="seconds")
    parser.add_argument("--load", type=int, default=0, help="number of other busy processes")
    parser.add_argument("--run", type=json.loads, help=argparse.SUPPRESS)
    given = parser.parse_args(argv)
    if given.run:
        run_watched(given.run)
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder, loaded(given.load):
        for name in given.names or SIZES:
            for row in measured(name, given.limits, folder):
                print("  ".join(row), file=sys.stderr, flush=True)
                rows.append(row)
    machine = f"beside {given.load} busy processes" if given.load else "on an idle machine"
    text = f"""# Time limits

The times are wall-clock seconds, {machine}. A limit applies to all searches and lower bounds of a run together
(*search*). *Whole* is the time of the whole run; it includes reading, planning, loading of kernels and proof, which
always finish. A run is *late* if its searches exceed the limit by more than a tenth. A search ends before its limit if
it cannot improve the answer.

{page.facts("limits", argv, ["leafcut", "numpy", "numba"])}

{page.table(["work", "size", "limit", "search", "whole", "note"], rows)}"""
    page.publish("limits", text, given.write)
    return 0
