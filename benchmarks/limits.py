"""Time limits beside the time that was taken: every process, several limits, on an idle and on a loaded machine.

    python benchmarks/limits.py --write docs/benchmarks.md
    python benchmarks/limits.py drill cut --limits 1 5 --load 4

Each run is a process of its own, which measures by the clock what is spent in its searches, and the whole. `--load`
keeps so many other processes busy.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from inspect import isgeneratorfunction
from pathlib import Path
from typing import Any

from growth import WORKS, Work
from page import facts, one_of, table, write_section

#: How large each work is: so that no search ends before 20 s by itself, where it can.
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
#: Where the searches are: modules and their functions. What one does within another is counted once.
SEARCHES = (
    ("leafcut.solve.solve", "solve"),
    ("leafcut.processes.pocket.plan.connected", "best"),
    ("leafcut.processes.nesting.plan.nesting", "variants"),
)
#: More than this over its limit, or over what any answer needs, is late: a tenth, or a tenth of a second.
LATE, LEAST = 0.1, 0.1


class Watch:
    """A stop-watch that runs while anything is in it."""

    def __init__(self) -> None:
        self.seconds, self._inside, self._began = 0.0, 0, 0.0

    def __enter__(self) -> None:
        if not self._inside:
            self._began = time.monotonic()
        self._inside += 1

    def __exit__(self, *_: object) -> None:
        self._inside -= 1
        if not self._inside:
            self.seconds += time.monotonic() - self._began


def run_watched(words: list[str]) -> None:
    """Do what a command line says, and print the seconds of its searches and of all, as JSON."""
    from leafcut.cli import run

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
    """Return a function, or a generator, with a watch that runs in it."""

    def yielding(*given: Any, **named: Any) -> Iterator[Any]:
        made = function(*given, **named)
        while True:
            try:
                with watch:
                    one = next(made)
            except StopIteration:
                return
            yield one

    def plain(*given: Any, **named: Any) -> Any:
        with watch:
            return function(*given, **named)

    return yielding if isgeneratorfunction(function) else plain


def seconds(work: Work, count: int, limit: float, folder: str) -> tuple[float, float]:
    """Return the seconds of one run by the clock: in its searches, and in all.

    Raises
    ------
    AssertionError
        It ended with an error.
    """
    words = [*work.command(count), "--time-limit", f"{limit:g}", "--quiet"]
    done = subprocess.run(
        [sys.executable, __file__, "--run", json.dumps(words)],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise AssertionError(f"{' '.join(words)}: {done.stderr.strip()}")
    search, whole = json.loads(done.stdout.splitlines()[-1])
    return search, whole


@contextmanager
def loaded(count: int) -> Iterator[None]:
    """Keep so many processes busy meanwhile."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


def above_zero(limit: str) -> float:
    """Return a time limit of the command line, s, and say what one is where it is none: 0 ends nothing."""
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
    seconds(work, count, 0.001, folder)  # compiles what is not compiled yet
    for limit in limits:
        # Beside each run, as the load of a machine changes.
        least = seconds(work, count, 0.001, folder)[1]
        search, whole = seconds(work, count, limit, folder)
        allowed = max(limit, least)
        over = whole - allowed
        note = "late" if over > max(LATE * allowed, LEAST) else "needs more" if least > limit else ""
        what = [name, f"{count:,} {work.counts}", f"{limit:g} s", f"{least:.1f} s", f"{search:.1f} s", f"{whole:.1f} s"]
        yield [*what, f"{100.0 * over / allowed:+.0f} %", note]


def main() -> None:
    """Measure, print the table, write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("names", nargs="*", type=one_of(SIZES), help=f"only these of {', '.join(SIZES)}")
    made.add_argument("--limits", nargs="*", type=above_zero, default=[1.0, 5.0, 20.0])
    made.add_argument("--load", type=int, default=0, help="so many other processes are busy")
    made.add_argument("--write", type=Path, help="write the table into this page")
    made.add_argument("--run", type=json.loads, help=argparse.SUPPRESS)
    given = made.parse_args()
    if given.run:
        run_watched(given.run)
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder, loaded(given.load):
        for name in given.names or SIZES:
            for row in measured(name, given.limits, folder):
                print("  ".join(row), file=sys.stderr, flush=True)
                rows.append(row)
            if given.write:
                write_section(given.write, "limits", text_of(rows, given.load))
    print(text_of(rows, given.load))


def text_of(rows: list[list[str]], load: int) -> str:
    """Return the section with some rows."""
    return f"""## Time limits

Seconds by the clock, with {load} other processes kept busy by the script: *search* in all searches of a run,
*whole* with reading, planning, bounds and proof; *least* is the whole with a limit of a millisecond: what any answer
needs. *Over* is the whole beside its limit, or beside the least where that is more: late above a tenth. A run ends
before its limit where nothing more is to be found.

{facts("limits", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["work", "size", "limit", "least", "search", "whole", "over", "note"], rows)}"""


if __name__ == "__main__":
    main()
