"""Results of a fixed amount of work, compared with the last release; status 1 if any job became worse.

    python -m benchmarks guard
    python -m benchmarks guard --write         also replace docs/results/guard.md, the record of the release

Each job has a fixed seed and a fixed number of generations or kicks, few and many. Its result is the same on every
machine and under any load, so any change above `WORSE` counts. Processor time is measured in units of a NumPy loop that
runs before and after the job. It varies between runs, so only a factor above `SLOWER` counts.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import leafcut
from benchmarks import ROOT, page
from benchmarks.growth import holes
from leafcut.model.outcome import Outcome

EXAMPLES = ROOT / "examples"
#: Minimum relative increase of machine time or gap that counts as worse, and minimum factor of processor time.
WORSE, SLOWER = 1e-6, 1.5
#: Number of holes in the drilled board.
HOLES = 800
HEAD = ["work", "budget", "machine time, s", "gap, %", "done", "processor, loops"]


@dataclass(frozen=True)
class Figure:
    """Result of a job: machine time, s, gap as a fraction, iterations, and processor time in loops."""

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
        """Return the result given by the cells of a row of the table."""
        seconds, gap, iterations, loops = cells
        return cls(float(seconds), None if gap == "–" else float(gap) / 100.0, int(iterations), float(loops))


#: Name and budget of a job → its result.
Figures = dict[tuple[str, str], Figure]

#: Input, options and budgets of each job. The path of a pocket has no budget. A job without an input drills a board
#: with `HOLES` holes of two sizes.
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
    """Return the processor time of a loop without leafcut, s: sorting, and sums of squares."""
    values = np.random.default_rng(1).random(200_000)
    began = time.process_time()
    for _ in range(10):
        values = values[np.argsort(values[::-1])] + 1e-9 * sum(k * k for k in range(20_000))
    return time.process_time() - began


def results() -> Iterator[tuple[tuple[str, str], Figure]]:
    """Run each job and yield its result."""
    with tempfile.TemporaryDirectory() as folder:
        board = Path(folder) / "board.dxf"
        holes(HOLES, board)
        for name, (file, options, budgets) in JOBS.items():
            source = EXAMPLES / file if file else board
            for budget in budgets:
                given = {**options, **budget, "seed": 1, "threads": 1}
                leafcut.optimize(source, **given)  # compiles the kernels
                before, began = loop_seconds(), time.process_time()
                outcome = leafcut.optimize(source, **given)
                took = time.process_time() - began
                yield (name, words_of(budget)), figure_of(outcome, took / (0.5 * (before + loop_seconds())))


def words_of(budget: dict[str, int]) -> str:
    """Return a budget as text."""
    return ", ".join(f"{count} {name}" for name, count in budget.items()) or "whole path"


def figure_of(outcome: Outcome[Any], loops: float) -> Figure:
    """Return the result of an outcome; `loops` is its processor time in loops."""
    solutions = [operation.solution for operation in outcome.operations if operation.solution is not None]
    cost, bounds = sum(s.cost for s in solutions), [s.lower_bound for s in solutions]
    least = sum(bound for bound in bounds if bound is not None)
    gap = cost / least - 1.0 if least > 0.0 and None not in bounds else None
    return Figure(outcome.after.time_s, gap, sum(s.iterations for s in solutions), loops)


def text_of(figures: Figures, argv: Sequence[str]) -> str:
    """Return the results page."""
    rows = [[*key, *figure.cells()] for key, figure in figures.items()]
    return f"""# Results of a fixed amount of work

Machine time, gap to the lower bound and number of iterations are the same on every machine. A loop is a fixed NumPy
computation.

{page.facts("guard", argv, ["leafcut"])}

{page.table(HEAD, rows)}"""


def figures_of(text: str) -> Figures:
    """Return the results on a results page."""
    return {(row[0], row[1]): Figure.of_cells(row[2:]) for row in page.rows_of(text)}


def worse(before: Figures, after: Figures) -> list[str]:
    """Return a line for each result that became worse and for each missing job; new jobs are ignored."""
    lines = []
    for key, old in before.items():
        name = ", ".join(key)
        new = after.get(key)
        if new is None:
            lines.append(f"{name}: the job is missing")
            continue
        if new.seconds > old.seconds * (1.0 + WORSE):
            lines.append(f"{name}: machine time {new.seconds:.6g} s, before {old.seconds:.6g} s")
        if old.gap is not None and (new.gap is None or new.gap > old.gap + WORSE):
            gap = "no gap" if new.gap is None else f"gap {100.0 * new.gap:.4g} %"
            lines.append(f"{name}: {gap}, before {100.0 * old.gap:.4g} %")
        if new.loops > old.loops * SLOWER:
            lines.append(f"{name}: processor time {new.loops:.3g} loops, before {old.loops:.3g}")
    return lines


def main(argv: Sequence[str]) -> int:
    """Run all jobs and compare them with the record; return 1 if any result became worse."""
    given = page.parser("guard", __doc__).parse_args(argv)
    record = page.RESULTS / "guard.md"
    before = record.read_text(encoding="utf-8") if record.exists() else ""
    figures = dict(results())
    page.publish("guard", text_of(figures, argv), given.write)
    lines = worse(figures_of(before), figures)
    if lines:
        date = re.search(r"Date: (\S+)", before)
        print(f"\nworse than the record of {date[1] if date else '?'}:", *lines, sep="\n", file=sys.stderr)
    return int(bool(lines))
