"""What a fixed amount of work finds, kept with the commit: a release does not come out worse unnoticed.

    python benchmarks/guard.py                 do the jobs, and compare with the last record; status 1 where worse
    python benchmarks/guard.py --keep          the same, and keep what was found in benchmarks/history.jsonl
    python benchmarks/guard.py --draw FILE     draw what is kept: .svg or .png

A job is done with a fixed seed and a fixed number of generations or kicks, few and many. What it finds is the same on
every machine and under any load, so anything worse than `WORSE` counts. Processor seconds are told as parts of what a
loop of NumPy takes in the same run, before and after; they differ from run to run, so only `SLOWER` of them counts.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from growth import holes
from history import HISTORY, Record, keep, records
from page import facts, table

import leafcut
from leafcut.model.outcome import Outcome

EXAMPLES = Path(__file__).parents[1] / "examples"
SECTION = "guard"
#: A job that finds a program longer by more than this share is worse; one that takes so many times as long is slower.
WORSE, SLOWER = 1e-6, 1.5
HOLES = 800
HEAD = ["work", "budget", "machine time, s", "gap, %", "done", "processor, loops"]

#: Does the job with some of the options.
Job = Callable[..., "Outcome[Any]"]


@dataclass(frozen=True)
class Figure:
    """What one job found: seconds of the machine, the gap as a share, iterations, and processor time in loops."""

    seconds: float
    gap: float | None
    iterations: int
    loops: float

    def cells(self) -> list[str]:
        """Return the cells of the table."""
        gap = "–" if self.gap is None else f"{100.0 * self.gap:.6f}"
        return [f"{self.seconds:.6f}", gap, str(self.iterations), f"{self.loops:.2f}"]

    @classmethod
    def of_cells(cls, cells: Sequence[str]) -> Figure:
        """Return what `cells` wrote."""
        seconds, gap, iterations, loops = cells
        return cls(float(seconds), None if gap == "–" else float(gap) / 100.0, int(iterations), float(loops))


#: Name of a job and its budget → what it found.
Figures = dict[tuple[str, str], Figure]

#: Input and options of every job, and its budgets: options whose names tell them. A pocket's path has no budget; a job
#: without an input drills `HOLES` holes of two sizes that `growth.py` draws.
JOBS: dict[str, tuple[str, dict[str, Any], tuple[dict[str, int], ...]]] = {
    "drilling board": ("", {"process": "drill", "machine": "haas-vf2", "thickness": 3.0},
                       ({"iterations": 1}, {"iterations": 100})),
    "drilling board by kicks": ("", {"process": "drill", "machine": "haas-vf2", "thickness": 3.0, "algorithm": "kicks"},
                                ({"iterations": 1}, {"iterations": 100})),
    "sheet": ("sheet.dxf", {"process": "cut", "machine": "plasma-table", "thickness": 6.0},
              ({"iterations": 2}, {"iterations": 100})),
    "program": ("cam_121.nc", {"process": "reorder", "machine": "haas-vf2"},
                ({"iterations": 2}, {"iterations": 20})),
    "pocket": ("pocket.dxf", {"process": "pocket", "machine": "linuxcnc-mill", "depth": 4.0, "tool_diameter": 6.0,
                              "strategy": "connected"}, ({},)),
}  # fmt: skip


def loop_seconds() -> float:
    """Return the processor seconds of a loop that has nothing of leafcut's: sorting, and sums by index."""
    values = np.random.default_rng(1).random(200_000)
    began = time.process_time()
    for _ in range(10):
        values = values[np.argsort(values[::-1])] + 1e-9 * sum(k * k for k in range(20_000))
    return time.process_time() - began


def found() -> Iterator[tuple[tuple[str, str], Figure]]:
    """Do every job and yield what it found."""
    with tempfile.TemporaryDirectory() as folder:
        board = Path(folder) / "board.dxf"
        holes(HOLES, board)
        for name, (file, options, budgets) in JOBS.items():
            source = EXAMPLES / file if file else board
            for budget in budgets:
                given = {**options, **budget, "seed": 1, "threads": 1}
                leafcut.optimize(source, **given)  # compiles what is not compiled yet
                before, began = loop_seconds(), time.process_time()
                outcome = leafcut.optimize(source, **given)
                took = time.process_time() - began
                yield (name, words_of(budget)), figure_of(outcome, took / (0.5 * (before + loop_seconds())))


def words_of(budget: dict[str, int]) -> str:
    """Return a budget in words."""
    return ", ".join(f"{count} {name}" for name, count in budget.items()) or "all of it"


def figure_of(outcome: Outcome[Any], loops: float) -> Figure:
    """Return the figure of an outcome."""
    solutions = [one.solution for one in outcome.operations if one.solution is not None]
    cost, bounds = sum(s.cost for s in solutions), [s.lower_bound for s in solutions]
    least = sum(bound for bound in bounds if bound is not None)
    gap = cost / least - 1.0 if least > 0.0 and None not in bounds else None
    return Figure(outcome.after.time_s, gap, sum(s.iterations for s in solutions), loops)


def text_of(figures: Figures, arguments: Sequence[str]) -> str:
    """Return the section that is kept, as pages of benchmarks have them."""
    rows = [[*key, *figure.cells()] for key, figure in figures.items()]
    return f"## What a fixed amount of work finds\n\n{facts(SECTION, arguments, ['leafcut'])}\n\n{table(HEAD, rows)}"


def figures_of(record: Record) -> Figures:
    """Return the figures of a record of the history."""
    (kept,) = record["tables"]
    return {(row[0], row[1]): Figure.of_cells(row[2:]) for row in kept["rows"]}


def worse(before: Figures, after: Figures) -> list[str]:
    """Return a line for everything that has become worse, or is not done any more; what is new is not judged."""
    lines = []
    for key, old in before.items():
        name = ", ".join(key)
        new = after.get(key)
        if new is None:
            lines.append(f"{name}: not done any more")
            continue
        if new.seconds > old.seconds * (1.0 + WORSE):
            lines.append(f"{name}: {new.seconds:.6g} s of the machine, before {old.seconds:.6g} s")
        if old.gap is not None and (new.gap is None or new.gap > old.gap + WORSE):
            known = "no gap" if new.gap is None else f"a gap of {100.0 * new.gap:.4g} %"
            lines.append(f"{name}: {known}, before {100.0 * old.gap:.4g} %")
        if new.loops > old.loops * SLOWER:
            lines.append(f"{name}: processor time of {new.loops:.3g} loops, before {old.loops:.3g}")
    return lines


def draw(some: Sequence[Record], file: Path) -> None:
    """Draw the records one after another: what machine and processor time of each job have changed since the first."""
    from matplotlib.figure import Figure as Drawing

    kept = [figures_of(record) for record in some]
    drawing = Drawing(figsize=(10.0, 6.0), layout="constrained")
    rows = drawing.subplots(2, 1, sharex=True)
    for axes, title, value in zip(
        rows, ("machine time", "processor time"), (lambda f: f.seconds, lambda f: f.loops), strict=True
    ):
        for key in dict.fromkeys(key for one in kept for key in one):
            course = [value(one[key]) if key in one else math.nan for one in kept]
            first = next(v for v in course if not math.isnan(v))
            axes.plot([100.0 * (v / first - 1.0) for v in course], marker="o", label=", ".join(key))
        axes.set_ylabel(f"{title}: change, %")
        axes.grid(axis="y", alpha=0.4)
    drawing.legend(*rows[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8, frameon=False)
    rows[1].set_xticks(range(len(some)), [f"{r['date']}\n{r['commit']}" for r in some], fontsize=8)
    drawing.savefig(file)


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the command line says; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--keep", action="store_true", help="keep what is found in the history")
    parser.add_argument("--draw", type=Path, help="draw what is kept into this file (.svg, .png), and do no job")
    parser.add_argument("--history", type=Path, default=HISTORY, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    kept = [record for record in records(given.history) if record["section"] == SECTION]
    if given.draw:
        if not kept:
            print("nothing is kept yet: run guard.py --keep first", file=sys.stderr)
            return 2
        if given.draw.suffix not in (".svg", ".png"):
            parser.error(f"--draw: {given.draw} is neither .svg nor .png")
        draw(kept, given.draw)
        return 0
    figures = dict(found())
    text = text_of(figures, sys.argv[1:] if arguments is None else arguments)
    print(text)
    lines = worse(figures_of(kept[-1]), figures) if kept else []
    if lines:
        print(f"\nworse than {kept[-1]['commit']} of {kept[-1]['date']}:", *lines, sep="\n", file=sys.stderr)
    if given.keep:
        keep(SECTION, text, given.history)
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main())
