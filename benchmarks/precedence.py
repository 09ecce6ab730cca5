"""How near the best known leafcut comes where clusters precede others: the PCGTSP instances, per time limit and seeds.

    python benchmarks/precedence.py e1x_6 ESC47 --times 1,10 --seeds 3 --write docs/benchmarks.md

A set of such an instance is one contour, its nodes are places to pierce it, and inner contours come before outer ones
(e…), or it is derived from a sequential ordering problem. Every path is judged by code that shares nothing with its
maker: each set once, precedence kept, no way taken that the instance forbids, and the length added up again.
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray
from page import facts, table, write_section
from tsplib import numbers

from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.solve.in_order import warm_up_in_order
from leafcut.solve.solve import solve

DATA = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data") / "gtsp"

#: What a way costs that an instance forbids: more than all ways of any path together.
FORBIDDEN = 1e7


@dataclass(frozen=True, eq=False)
class Sheet:
    """An instance: costs float64[n, n] (-1 forbids), the set of each node int32[n], pairs of sets, the first set."""

    name: str
    costs: NDArray[np.float64]
    sets: NDArray[np.int32]
    pairs: NDArray[np.int32]
    first: int | None
    best_known: float

    @property
    def problem(self) -> RoutingProblem:
        """The closed problem that leafcut solves; the first set comes before all others."""
        count, none = int(self.sets.max()) + 1, np.zeros((len(self.sets), 2))
        start = [] if self.first is None else [(self.first, c) for c in range(count) if c != self.first]
        pairs = np.concatenate([self.pairs, np.array(start, dtype=np.int32).reshape(-1, 2)])
        metric = Metric("EXPLICIT", matrix=np.where(self.costs < 0, FORBIDDEN, self.costs))
        return RoutingProblem(none, none, self.sets, np.zeros(len(self.sets)), metric, pairs, closed=True)

    def judged(self, nodes: NDArray[np.int32]) -> float:
        """Return the length of a path through `nodes`; an answer that is not one ends the benchmark."""
        order = self.sets[nodes]
        place = np.argsort(order)
        ways = self.costs[nodes, np.roll(nodes, -1)]
        faults = {
            "a set is not visited once": sorted(order.tolist()) != list(range(int(self.sets.max()) + 1)),
            "precedence is broken": bool((place[self.pairs[:, 0]] >= place[self.pairs[:, 1]]).any()),
            "a forbidden way is taken": bool((ways < 0).any()),
            "it does not begin with the first set": self.first is not None and order[0] != self.first,
        }
        if any(faults.values()):
            sys.exit(f"{self.name}: {', '.join(words for words, fault in faults.items() if fault)}")
        return float(ways.sum())


def load(name: str, best_known: float) -> Sheet:
    """Return an instance by its name, read from the shared data."""
    words = iter((DATA / "pcgtsp" / f"{name}.pcglns").read_text(encoding="utf-8").replace(":", " ").split())
    keys: dict[str, list[str]] = {}
    section = ""
    for word in words:
        if (word[0].isalpha() and word.isupper() and "_" in word) or word in ("DIMENSION", "NAME", "TYPE", "COMMENT"):
            section = word
            keys[section] = []
        elif section:
            keys[section].append(word)
    n = int(keys["DIMENSION"][0])
    sets = np.full(n, -1, dtype=np.int32)
    for number, *nodes in _lines(keys["GTSP_SET_SECTION"]):
        sets[np.array(nodes) - 1] = number - 1
    pairs = [(a - 1, b - 1) for a, *after in _lines(keys.get("GTSP_SET_ORDERING", [])) for b in after]
    start = keys.get("START_GROUP_SECTION")
    return Sheet(
        name,
        np.array(keys["EDGE_WEIGHT_SECTION"], dtype=np.float64).reshape(n, n),
        sets,
        np.array(pairs, dtype=np.int32).reshape(-1, 2),
        int(start[0]) - 1 if start else None,
        best_known,
    )


def _lines(words: Sequence[str]) -> Iterator[list[int]]:
    """Yield runs of numbers that end with -1."""
    run: list[int] = []
    for word in words:
        if not word.lstrip("-").isdigit():
            return
        if word == "-1":
            yield run
            run = []
        else:
            run.append(int(word))


def known() -> dict[str, float]:
    """Return the best known length of every PCGTSP instance."""
    with (DATA / "best_known.csv").open(encoding="utf-8") as rows:
        return {Path(r["file"]).stem: float(r["best_known"]) for r in csv.DictReader(rows) if r["type"] == "PCGTSP"}


def gap_words(sheet: Sheet, lengths: Sequence[float]) -> str:
    """Return the median gap and, of several, the lowest and the highest, percent."""
    gaps = [100.0 * (length / sheet.best_known - 1.0) for length in lengths]
    words = f"{median(gaps):.2f}"
    return words if len(gaps) == 1 else f"{words} ({min(gaps):.2f} to {max(gaps):.2f})"


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    arguments = _arguments()
    best_known, rows, sums = known(), [], {t: [] for t in arguments.times}
    for name in arguments.sheets or best_known:
        sheet = load(name, best_known[name])
        problem = sheet.problem
        warm_up_in_order(problem)
        cells = []
        for t in arguments.times:
            lengths = []
            for seed in range(1, arguments.seeds + 1):
                found = solve(problem, SolveOptions(time_limit=t, seed=seed, bound=False))
                lengths.append(sheet.judged(found.nodes))
                if not math.isclose(lengths[-1], found.cost):
                    sys.exit(f"{name}: says {found.cost}, is {lengths[-1]}")
            cells.append(gap_words(sheet, lengths))
            sums[t].append(100.0 * (median(lengths) / sheet.best_known - 1.0))
        sizes = [f"{len(sheet.sets)}", f"{sheet.sets.max() + 1}", f"{len(sheet.pairs)}", f"{sheet.best_known:.0f}"]
        rows.append([name, *sizes, *cells])
        print(" ".join(rows[-1]), file=sys.stderr, flush=True)
    rows.append(["mean", "", "", "", "", *(f"{sum(gaps) / len(gaps):.2f}" for gaps in sums.values())])
    head = ["board", "nodes", "sets", "pairs", "best known", *(f"{t:g} s" for t in arguments.times)]
    seeds = f"median of {arguments.seeds} seeds (lowest to highest)" if arguments.seeds > 1 else "one seed"
    text = f"""## Where clusters precede others

Gap to the best known in percent, {seeds}; below 0 is better than that. The time is by the clock, compiling not in it.

{facts("precedence", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(head, rows)}"""
    print(text)
    if arguments.write:
        write_section(arguments.write, "precedence", text)


def _arguments() -> argparse.Namespace:
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("sheets", nargs="*", help="names of instances; all unless given")
    made.add_argument("--times", type=numbers, default=numbers("1,10"), help="seconds by the clock, with commas")
    made.add_argument("--seeds", type=int, default=3, help="runs of each, with the seeds 1, 2, …")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    return made.parse_args()


if __name__ == "__main__":
    main()
