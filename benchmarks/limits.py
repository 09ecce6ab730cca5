"""Time limits beside the time that was taken: every process, several limits, on an idle and on a loaded machine.

    python benchmarks/limits.py --write docs/benchmarks.md
    python benchmarks/limits.py drill cut --limits 1 5 --load 4

Each run is a process of its own. The same run with a limit of a millisecond takes the start, reading, planning and the
proof; what a run takes more than that by the clock is its search. `--load` keeps so many other processes busy.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from growth import WORKS, Work
from page import facts, table, write_section

#: How large each work is: so that no search ends before 20 s by itself, where it can.
SIZES = {
    "drill": 4000,
    "panel": 600,
    "cut": 1200,
    "engrave": 6000,
    "reorder": 100_000,
    "pocket": 16,
    "pockets": 9,
    "nest": 120,
}
#: What the least limit is, s.
NOTHING = "0.001"
#: More than this over its limit is late: a tenth, or a tenth of a second.
LATE, LEAST = 0.1, 0.1


def seconds(work: Work, count: int, limit: str, folder: str) -> float:
    """Return the seconds of one run by the clock.

    Raises
    ------
    AssertionError
        It ended with an error.
    """
    words = [*work.command(count), "--time-limit", limit, "--quiet"]
    words += [] if words[0] == "nest" else ["--no-bound"]
    began = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", "from leafcut.cli import main; main()", *words],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    took = time.monotonic() - began
    if done.returncode:
        raise AssertionError(f"{' '.join(words)}: {done.stderr.strip()}")
    return took


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


def measured(name: str, limits: list[float], folder: str) -> Iterator[list[str]]:
    """Yield a row for each limit."""
    work, count = replace(WORKS[name], words=WORKS[name].words), SIZES[name]
    work.make(count, Path(folder) / work.file)
    seconds(work, count, NOTHING, folder)  # compiles what is not compiled yet
    other = min(seconds(work, count, NOTHING, folder) for _ in range(2))
    for limit in limits:
        search = seconds(work, count, f"{limit:g}", folder) - other
        late = "late" if search > limit + max(LATE * limit, LEAST) else ""
        what = [name, f"{count:,} {work.counts}", f"{limit:g} s", f"{other:.1f} s", f"{search:.1f} s"]
        yield [*what, f"{100.0 * (search / limit - 1.0):+.0f} %", late]


def main() -> None:
    """Measure, print the table, write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("names", nargs="*", help=f"only these of {', '.join(SIZES)}")
    made.add_argument("--limits", nargs="*", type=float, default=[1.0, 5.0, 20.0])
    made.add_argument("--load", type=int, default=0, help="so many other processes are busy")
    made.add_argument("--write", type=Path, help="write the table into this page")
    given = made.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder, loaded(given.load):
        for name in given.names or SIZES:
            for row in measured(name, given.limits, folder):
                print("  ".join(row), file=sys.stderr, flush=True)
                rows.append(row)
    text = f"""## Time limits

Seconds by the clock, with {given.load} other processes kept busy by the script. *all else* is the same run with a limit
of a millisecond: start, reading, planning, proof; *search* is what the run takes beyond that. Late is what is over its
limit by more than a tenth. A search may end before its limit where nothing more is to be found.

{facts("limits", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["work", "size", "limit", "all else", "search", "beside the limit", "note"], rows)}"""
    print(text)
    if given.write:
        write_section(given.write, "limits", text)


if __name__ == "__main__":
    main()
