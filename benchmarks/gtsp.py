"""How near the best known leafcut comes where nodes are in sets of which one is visited, with and without precedence.

    python benchmarks/gtsp.py sheets e5x_1 --time 10 --seeds 3 --write docs/benchmarks.md

Sets of instances: `gtsplib` (symmetric, up to 442 nodes), `large` (more than 442 nodes), `sheets` (a set is a contour
to be cut from a real nest, its nodes are places to pierce it, inner contours come before outer ones) and `sequential`
(derived from sequential ordering problems). The time limit is in seconds of the processor, as the machine is shared.
Every tour is judged by code that shares nothing with its maker: each set once, precedence kept, no way taken that the
instance forbids, and the length added up again from the file.
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

import numpy as np
from numpy.typing import NDArray
from page import facts, table, write_section

from leafcut.options import ALGORITHMS, SolveOptions
from leafcut.read import read
from leafcut.solve import stop
from leafcut.solve.maps import problem_of_map
from leafcut.solve.solve import solve

#: What the sets of instances are called in the headings of the page.
GROUPS = {
    "gtsplib": "symmetric, up to 442 nodes",
    "large": "symmetric, more than 442 nodes",
    "sheets": "contours of real sheets",
    "sequential": "with precedence",
}
DATA = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data") / "gtsp"


@dataclass(frozen=True)
class Known:
    """What is known of an instance: its file, its group, nodes, sets, pairs, best length, and what PCGLNS reached."""

    file: Path
    group: str
    sizes: tuple[str, str, str]
    best: float
    peer: str


@dataclass(frozen=True, eq=False)
class Sheet:
    """An instance: costs float64[n, n] (-1 forbids), the set of each node int32[n], pairs of sets, the first set."""

    name: str
    costs: NDArray[np.float64]
    sets: NDArray[np.int32]
    pairs: NDArray[np.int32]
    first: int | None

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


def load(path: Path) -> Sheet:
    """Return an instance as its file says it."""
    keys: dict[str, list[str]] = {}
    section = ""
    text = path.read_text(encoding="utf-8").replace(":", " ")
    for name, plain in (("_2D", ""), ("FULL_MATRIX", "FULL"), ("UPPER_ROW", "UPPER")):
        text = text.replace(name, plain)
    for word in text.split():
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
    if "NODE_COORD_SECTION" in keys:
        places = np.array(keys["NODE_COORD_SECTION"][: 3 * n], dtype=np.float64).reshape(n, 3)[:, 1:]
        costs = distances(keys["EDGE_WEIGHT_TYPE"][0], places)
    else:
        costs = np.array(keys["EDGE_WEIGHT_SECTION"], dtype=np.float64)
        if keys["EDGE_WEIGHT_FORMAT"][0] == "UPPER":
            half = np.zeros((n, n))
            half[np.triu_indices(n, 1)] = costs
            costs = np.maximum(half, half.T)
        costs = costs.reshape(n, n)
    first = int(start[0]) - 1 if start else None
    return Sheet(path.stem, costs, sets, np.array(pairs, dtype=np.int32).reshape(-1, 2), first)


def distances(rule: str, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return TSPLIB's distances between all places, float64[n, n]."""
    if rule == "GEO":
        whole = np.trunc(places)
        latitude, longitude = (3.141592 * (whole + 5.0 * (places - whole) / 3.0) / 180.0).T
        q1 = np.cos(longitude[:, None] - longitude)
        q2, q3 = np.cos(latitude[:, None] - latitude), np.cos(latitude[:, None] + latitude)
        return np.floor(6378.388 * np.arccos(np.clip(0.5 * ((1 + q1) * q2 - (1 - q1) * q3), -1, 1)) + 1.0)
    away = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    if rule == "ATT":
        real = away / math.sqrt(10.0)
        return np.ceil(real - 0.5 - 1e-12) + (np.ceil(real - 0.5 - 1e-12) < real)
    return np.ceil(away) if rule == "CEIL" else np.floor(away + 0.5)


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


def known() -> dict[str, Known]:
    """Return what is known of every instance, by its name."""
    found = {}
    with (DATA / "best_known.csv").open(encoding="utf-8") as rows:
        for row in csv.DictReader(rows):
            file, peer = Path(row["file"]), re.search(r"PCGLNS (\d+)", row["note"])
            if row["type"] == "GTSP":
                group = "gtsplib" if int(row["nodes"]) <= 442 else "large"
            else:
                group = "sheets" if file.name.startswith("e") else "sequential"
            sizes = (row["nodes"], row["sets"], row["precedence_pairs"])
            words = "" if peer is None else f"{100.0 * (float(peer[1]) / float(row['best_known']) - 1.0):.2f}"
            found[file.stem] = Known(DATA / file, group, sizes, float(row["best_known"]), words)
    return found


def measure(one: Known, options: argparse.Namespace) -> tuple[list[float], list[float]]:
    """Return the gaps to the best known in percent, and the seconds by the clock, of all seeds."""
    sheet, problem = load(one.file), problem_of_map(read(one.file))
    stop.clock = time.process_time
    gaps, seconds = [], []
    for seed in range(1, options.seeds + 1):
        search = SolveOptions(algorithm=options.algorithm, time_limit=options.time, seed=seed, threads=1, bound=False)
        began = time.perf_counter()
        found = solve(problem, search)
        seconds.append(time.perf_counter() - began)
        length = sheet.judged(found.nodes)
        if not math.isclose(length, found.cost):
            sys.exit(f"{sheet.name}: says {found.cost}, is {length}")
        gaps.append(100.0 * (length / one.best - 1.0))
    return gaps, seconds


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    options = _arguments()
    instances, rows, means = known(), [], {}
    chosen = [n for n, k in instances.items() if not options.sheets or n in options.sheets or k.group in options.sheets]
    for name in chosen:
        one = instances[name]
        gaps, seconds = measure(one, options)
        spread = "" if len(gaps) == 1 else f" ({min(gaps):.2f} to {max(gaps):.2f})"
        cells = [f"{one.best:.0f}", one.peer, f"{median(gaps):.2f}{spread}", f"{mean(seconds):.1f}"]
        rows.append([name, *one.sizes, *cells])
        means.setdefault(one.group, []).append(median(gaps))
        print(" ".join(rows[-1]), file=sys.stderr, flush=True)
    for group, gaps in means.items():
        rows.append([f"{group}: mean", "", "", "", "", "", f"{mean(gaps):.3f}", ""])
    head = ["board", "nodes", "sets", "pairs", "best known", "PCGLNS", "gap", "clock s"]
    seeds = f"median of {options.seeds} seeds (lowest to highest)" if options.seeds > 1 else "one seed"
    title = ": " + "; ".join(GROUPS[group] for group in means) if options.sheets else ""
    text = f"""## One node of every set{title}

Gap to the best known in percent, {seeds}, with one thread, after {options.time:g} s of the processor; below 0 is
better than that. The machine was shared, so seconds by the clock are many more; where they are less than a second the
best order of all was found by dynamic programming. PCGLNS: its published gap after several seconds.

{facts("gtsp", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(head, rows)}"""
    print(text)
    if options.write:
        write_section(options.write, options.section, text)


def _arguments() -> argparse.Namespace:
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("sheets", nargs="*", help="names of instances or of their sets; all unless given")
    made.add_argument("--time", type=float, default=10.0, help="seconds of the processor")
    made.add_argument("--seeds", type=int, default=1, help="runs of each, with the seeds 1, 2, …")
    made.add_argument("--algorithm", default="auto", choices=ALGORITHMS)
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    made.add_argument("--section", default="gtsp", help="the name of that section")
    return made.parse_args()


if __name__ == "__main__":
    main()
