"""How near the optimum leafcut is after 0.1, 1, 10 and 60 seconds: median and spread over seeds, per board.

    python benchmarks/tsplib.py pcb442 pcb3038 --times 1,10 --seeds 5 --write docs/benchmarks.md

One run per seed and time, with that time as its limit, which a user would give: the colony plans by it. A tour that
came later than the limit does not count. The clock begins with the search: neighbour lists and start tour are inside;
import, compiling and the reading of the file are not.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import boards
import numpy as np
from boards import Board
from numpy.typing import NDArray
from page import facts, table, write_section

from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import ALGORITHMS, AcoOptions, SolveOptions
from leafcut.solve import solve as room
from leafcut.solve.solve import solve

NO_TOUR = "–"
#: A warm-up has so many nodes, or as many as the board has: enough for what `auto` does with large ones.
WARM_NODES = 3000


@dataclass(frozen=True, eq=False)
class Run:
    """One search: its history (seconds, length), its tour, what it took by the clock and of processors, seconds."""

    history: tuple[tuple[float, float], ...]
    tour: NDArray[np.int32]
    length: float
    wall: float
    processor: float

    def length_at(self, seconds: float) -> float:
        """Return the length of the best tour that there was then; inf for none."""
        return min((length for t, length in self.history if t <= seconds), default=math.inf)


def problem_of(board: Board) -> RoutingProblem:
    """Return the board as the closed problem that leafcut solves."""
    return RoutingProblem.of_points(board.xy, Metric(board.rule), closed=True, name=board.name)


def warm_up(board: Board, options: SolveOptions) -> None:
    """Have every kernel loaded or compiled, and the threads' memory there, before anything is measured."""
    few = boards.uniform(min(board.n, WARM_NODES))
    problem = RoutingProblem.of_points(few.xy, Metric(board.rule), closed=True)
    solve(problem, replace(options, iterations=1, time_limit=0.5, bound=False))
    room.warm_up(options, AcoOptions(), board.n)


def run_leafcut(board: Board, options: SolveOptions) -> Run:
    """Return one checked search of a board."""
    problem = problem_of(board)
    wall, processor = time.perf_counter(), time.process_time()
    found = solve(problem, replace(options, bound=False))
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    length = boards.checked_length(board, found.nodes, found.cost)
    return Run(found.history, found.nodes, length, wall, processor)


def gap_words(board: Board, lengths: Sequence[float]) -> str:
    """Return the median gap and, of several, the lowest and the highest: ``0.120 (0.080 to 0.210)``, percent."""
    gaps = [board.gap_percent(length) for length in lengths]
    words = [f"{gap:.3f}" if math.isfinite(gap) else NO_TOUR for gap in (median(gaps), min(gaps), max(gaps))]
    return words[0] if len(gaps) == 1 else f"{words[0]} ({words[1]} to {words[2]})"


def row(board: Board, runs: Mapping[float, Sequence[Run]]) -> list[str]:
    """Return a board's row of the table, from its runs at every time limit."""
    gaps = [gap_words(board, [run.length_at(t) for run in made]) for t, made in runs.items()]
    longest = runs[max(runs)]
    spent = [f"{median(run.wall for run in longest):.1f}", f"{median(run.processor for run in longest):.1f}"]
    return [board.name, f"{board.n:,}", f"{board.reference:,.0f} ({board.reference_words})", *gaps, *spent]


def section(rows: Sequence[Sequence[str]], times: Sequence[float], words: str, made: str) -> str:
    """Return the section of the page."""
    head = ["board", "nodes", "compared with", *(f"{t:g} s" for t in times), "clock, s", "processor, s"]
    return f"""## leafcut against the optimum

Gap in percent, {words}. One run per seed and time limit; neighbour lists and start tour are in the time; import,
compiling and file reading are not. The last columns are medians of the longest runs.

{made}

{table(head, rows)}"""


def numbers(text: str) -> list[float]:
    """Return the positive numbers of a list with commas, in rising order."""
    found = sorted(float(word) for word in text.split(","))
    if not all(0.0 < number < math.inf for number in found):
        raise ValueError(text)
    return found


def parser(description: str, times: str, seeds: int) -> argparse.ArgumentParser:
    """Return the parser of what the benchmarks have in common."""
    made = argparse.ArgumentParser(description=description)
    made.add_argument("boards", nargs="*", default=list(boards.BOARDS), help="TSPLIB names, or uniform:N[:SEED]")
    made.add_argument("--times", type=numbers, default=numbers(times), help="seconds by the clock, with commas")
    made.add_argument("--seeds", type=int, default=seeds, help="runs of each, with the seeds 1, 2, …")
    made.add_argument("--threads", type=int, default=1, help="threads of leafcut, and of peers that have any")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    return made


def main() -> None:
    """Measure and print the table; write it into the page where asked."""
    arguments = _arguments()
    times: list[float] = arguments.times
    options = SolveOptions(algorithm=arguments.algorithm, time_limit=times[-1], threads=arguments.threads)
    rows = []
    for name in arguments.boards:
        board = boards.load(name)
        warm_up(board, options)
        runs: dict[float, list[Run]] = {t: [] for t in times}
        for t, seed in itertools.product(times, range(1, arguments.seeds + 1)):
            runs[t].append(run_leafcut(board, replace(options, seed=seed, time_limit=t)))
            gap = board.gap_percent(runs[t][-1].length_at(t))
            print(f"{name} {t:g} s seed {seed}: {gap:.3f} %", file=sys.stderr, flush=True)
        rows.append(row(board, runs))
    seeds = f"median of {arguments.seeds} seeds (lowest to highest)" if arguments.seeds > 1 else "one seed"
    threads = f"{arguments.threads} thread{'s' if arguments.threads != 1 else ''}"
    made = facts("tsplib", sys.argv[1:], ["leafcut", "numpy", "numba"])
    text = section(rows, times, f"{seeds}, {threads}, algorithm {arguments.algorithm}", made)
    print(text)
    if arguments.write:
        write_section(arguments.write, "tsplib", text)


def _arguments() -> argparse.Namespace:
    made = parser((__doc__ or "").splitlines()[0], "0.1,1,10,60", 5)
    made.add_argument("--algorithm", choices=ALGORITHMS, default="auto")
    return made.parse_args()


if __name__ == "__main__":
    main()
