"""Gap to the optimum after given times: median and spread over seeds, for each board.

    python -m benchmarks tsplib pcb442 pcb3038 --times 1,10 --seeds 5

For each seed and time there is a separate run with that time limit, because the colony plans by the limit. A tour found
after the limit does not count. The measured time covers the search with neighbour lists and start tour, but not
imports, compilation and file reading.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from benchmarks import boards, page
from benchmarks.boards import Board
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import ALGORITHMS, SolveOptions
from leafcut.order.solve import solve

NO_TOUR = "–"
#: Maximum number of nodes in a warm-up; enough to compile all code that `auto` runs on large boards.
WARM_NODES = 3000


@dataclass(frozen=True, eq=False)
class Run:
    """One search: history (seconds, length), tour, and its wall-clock time and processor time, s."""

    history: tuple[tuple[float, float], ...]
    tour: NDArray[np.int32]
    length: float
    wall: float
    processor: float

    def length_at(self, seconds: float) -> float:
        """Return the length of the best tour at that time, or inf without a tour."""
        return min((length for t, length in self.history if t <= seconds), default=math.inf)


def problem_of(board: Board) -> RoutingProblem:
    """Return the routing problem of a board, which is closed."""
    return RoutingProblem.of_points(board.xy, Metric(board.rule), closed=True, name=board.name)


def warm_up(board: Board, options: SolveOptions) -> None:
    """Load or compile all kernels, and allocate the memory of all threads, before the measurement."""
    few = boards.uniform(min(board.n, WARM_NODES))
    problem = RoutingProblem.of_points(few.xy, Metric(board.rule), closed=True)
    solve(problem, replace(options, time_limit=0.5, bound=False))


def run_leafcut(board: Board, options: SolveOptions) -> Run:
    """Run one search on a board, and check its tour."""
    problem = problem_of(board)
    wall, processor = time.perf_counter(), time.process_time()
    found = solve(problem, replace(options, bound=False))
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    length = boards.checked_length(board, found.nodes, found.cost)
    return Run(found.history, found.nodes, length, wall, processor)


def gap_words(board: Board, lengths: Sequence[float]) -> str:
    """Return the median gap with the lowest and highest gap in percent, such as ``0.120 (0.080 to 0.210)``."""
    gaps = [board.gap_percent(length) for length in lengths]
    if not math.isfinite(min(gaps)):
        return NO_TOUR
    words = [f"{gap:.3f}" if math.isfinite(gap) else NO_TOUR for gap in (median(gaps), min(gaps), max(gaps))]
    return words[0] if len(gaps) == 1 else f"{words[0]} ({words[1]} to {words[2]})"


def row(board: Board, runs: Mapping[float, Sequence[Run]]) -> list[str]:
    """Return the row of a board from its runs at each time limit."""
    gaps = [gap_words(board, [run.length_at(t) for run in repeated]) for t, repeated in runs.items()]
    longest = runs[max(runs)]
    spent = [f"{median(run.wall for run in longest):.1f}", f"{median(run.processor for run in longest):.1f}"]
    return [board.name, f"{board.n:,}", f"{board.reference:,.0f} ({board.reference_words})", *gaps, *spent]


def results(rows: Sequence[Sequence[str]], times: Sequence[float], words: str, facts: str) -> str:
    """Return the results page."""
    head = ["board", "nodes", "compared with", *(f"{t:g} s" for t in times), "clock, s", "processor, s"]
    return f"""# Gap to the optimum

The table shows the gap in percent, {words}, with one run per seed and time limit. The time includes neighbour lists and
the start tour, but not import, compilation and file reading. {NO_TOUR} means that no tour was found within this time.
The last columns are medians of the longest runs.

{facts}

{page.table(head, rows)}"""


def numbers(text: str) -> list[float]:
    """Return the positive numbers in a comma-separated list, in ascending order."""
    found = sorted(float(word) for word in text.split(","))
    if not all(0.0 < number < math.inf for number in found):
        raise ValueError(text)
    return found


def search_parser(name: str, doc: str | None, times: str, seeds: int) -> argparse.ArgumentParser:
    """Return the argument parser of a benchmark that runs searches."""
    parser = page.parser(name, doc)
    parser.add_argument("boards", nargs="*", default=list(boards.BOARDS), help="TSPLIB names, or uniform:N[:SEED]")
    parser.add_argument("--times", type=numbers, default=numbers(times), help="seconds by the clock, with commas")
    parser.add_argument("--seeds", type=int, default=seeds, help="runs of each, with the seeds 1, 2, …")
    parser.add_argument("--threads", type=int, default=1, help="threads of leafcut, and of peers with threads")
    return parser


def main(argv: Sequence[str]) -> int:
    """Measure all boards and publish the table."""
    parser = search_parser("tsplib", __doc__, "0.1,1,10,60", 5)
    parser.add_argument("--algorithm", choices=ALGORITHMS, default="auto")
    arguments = parser.parse_args(argv)
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
    facts = page.facts("tsplib", argv, ["leafcut", "numpy", "numba"])
    text = results(rows, times, f"{seeds}, {threads}, algorithm {arguments.algorithm}", facts)
    page.publish("tsplib", text, arguments.write)
    return 0
