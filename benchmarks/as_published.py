"""What the publications describe and leafcut does otherwise, side by side with leafcut's own way.

    python benchmarks/as_published.py trails --write docs/colony.md

`trails`: the first pheromone in kinds. `parallel`: ants in threads and in processes. `fireflies`: both variants,
without local search. `nests`: Ant System with the parameters of the paper on sheets. `closed`: pockets with levels
without a lift. Tours of boards are checked and added up again; programs are those that leafcut has proved.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import boards
import tsplib
from firefly import checked_gap, grid_of, known_grids, spread
from page import facts, table, write_section

from leafcut import api
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.processes.pocket.plan.grid import Retract, grid_problem
from leafcut.solve.solve import solve, warm_up

CITIES = ("kroA100", "d198", "lin318")
POCKETS = ("p1_rect_rounded", "p2_circle", "p5_islands3")
NESTS = ("nest_018", "nest_026", "nest_036")
PARTS = Path(api.__file__).parent / "lab" / "parts"
PLAIN = SolveOptions(local_search=False, bound=False, threads=1, iterations=100)
VARIANTS = ("leafcut", "published")
#: The parameters of the paper on sheets.
PAPER: dict[str, Any] = {
    "algorithm": "as", "pheromone_weight": 0.5, "heuristic_weight": 0.5, "evaporation_rate": 0.3, "iterations": 200,
    "n_ants": "parts", "local_search": False,
}  # fmt: skip


def gaps(name: str, options: SolveOptions, aco: AcoOptions, seeds: Iterable[int]) -> list[float]:
    """Return the gaps of some seeds to the optimum of a board, percent."""
    board, found = boards.load(name), []
    for seed in seeds:
        answer = solve(tsplib.problem_of(board), replace(options, seed=seed), aco)
        found.append(board.gap_percent(boards.checked_length(board, answer.nodes, answer.cost)))
    return found


def trails() -> str:
    """Return the table of the first pheromone."""
    kinds = (None, 0, "random", "1/nrC", "1/nC")
    rows = []
    for algorithm, name in ((a, n) for a in ("as", "acs", "mmas") for n in ("kroA100", "lin318")):
        options = replace(PLAIN, algorithm=algorithm)
        cells = [spread(gaps(name, options, AcoOptions(initial_pheromone=kind), range(1, 4))) for kind in kinds]
        rows.append([name, algorithm, *cells])
    head = ["board", "algorithm", "recommended", *("`" + str(kind) + "`" for kind in kinds[1:])]
    return f"""Gap to the optimum by the first pheromone, percent: median of three seeds (lowest to highest) after 100
iterations without local search, all other parameters as recommended.

{table(head, rows)}"""


def parallel() -> str:
    """Return the table of ants in threads and processes."""
    ways = [("threads", 1), ("threads", 2), ("processes", 2), ("exchange", 2)]
    rows = []
    for algorithm, name in ((a, n) for a in ("as", "mmas", "acs") for n in ("kroA100", "lin318")):
        cells = []
        for way, workers in ways:
            if (algorithm, way) == ("acs", "processes"):
                cells.append("refused")
                continue
            options = replace(PLAIN, algorithm=algorithm, threads=workers)
            began = time.perf_counter()
            found = gaps(name, options, AcoOptions(parallel=way, n_processes=workers), (1, 2, 3))
            cells.append(f"{median(found):.2f} · {(time.perf_counter() - began) / 3:.1f}")
        rows.append([name, algorithm, *cells])
    head = ["board", "algorithm", *(f"{way}, {workers}" for way, workers in ways)]
    return f"""Gap in percent · seconds by the clock, start of processes included; median and mean of three seeds, 100
iterations without local search, one or two workers.

{table(head, rows)}"""


def fireflies() -> str:
    """Return the tables of both variants, on boards and on grids of pockets."""
    options = replace(PLAIN, algorithm="firefly", iterations=None)
    rows = []
    for name in CITIES:
        board = boards.load(name)
        problem = tsplib.problem_of(board)

        def gap_of(found: Any, board: Any = board) -> float:
            return float(board.gap_percent(boards.checked_length(board, found.nodes, found.cost)))

        rows.append([name, str(board.n), *_variants(problem, options, gap_of)])
    grids = []
    for name in POCKETS:
        region, grid = grid_of(name, known_grids()[name][0])
        problem, context = grid_problem(region, Retract(1e6, 1.0), grid=grid, finish=False)

        def gap_on(found: Any, context: Any = context) -> float:
            return checked_gap(context, found.nodes)

        grids.append([name, str(problem.n_nodes), *_variants(problem, options, gap_on)])
    modes = itertools.product(VARIANTS, ("simple", "complex"), ("", ", all"))
    head = ["nodes", *(f"{variant}, {mode}{end}" for variant, mode, end in modes)]
    return f"""Both variants without local search, preset `default`, median of three seeds: gap in percent · seconds of
a processor. A run ends after 20 iterations without a shorter tour; *all*: after all its iterations
(`--firefly-patience 100000`). Boards against the optimum, open paths over grids of pockets against (N - 1)·DP.

{table(["board", *head], rows)}

{table(["instance", *head], grids)}"""


def _variants(problem: Any, options: SolveOptions, gap_of: Callable[[Any], float]) -> list[str]:
    cells = []
    for variant in VARIANTS:
        for mode in ("simple", "complex"):
            for patience in (20, 100_000):
                asked = FireflyOptions(variant=variant, firefly_mode=mode, firefly_patience=patience)
                found, spent = [], []
                for seed in (1, 2, 3):
                    began = time.process_time()
                    found.append(gap_of(solve(problem, replace(options, seed=seed), firefly=asked)))
                    spent.append(time.process_time() - began)
                cells.append(f"{median(found):.2f} · {median(spent):.1f}")
    return cells


def nests() -> str:
    """Return the table of sheets."""
    common: dict[str, Any] = {
        "process": "cut", "machine": str(PARTS / "large_table.toml"), "material": "steel", "thickness": "6mm",
        "objective": "distance", "threads": 1, "bound": False,
    }  # fmt: skip
    ways = {
        "nearest neighbour": {"algorithm": "nn"},
        "Ant System of the paper": PAPER,
        "the same, τ₀ 1/nrC": {**PAPER, "initial_pheromone": "1/nrC"},
        "with local search": {**PAPER, "local_search": True},
        "leafcut": {"algorithm": "auto"},
    }
    rows = []
    for name in NESTS:
        made = [api.optimize(PARTS / "nests" / f"{name}.dxf", **common, **way).after.travel_mm for way in ways.values()]
        cells = [f"{made[0]:.0f}", *(f"{length:.0f} ({100 * (1 - length / made[0]):.2f})" for length in made[1:])]
        rows.append([name, *cells])
    return f"""Travel in mm, and how much less than that of the nearest neighbour, percent; one seed.

{table(["instance", *ways], rows)}"""


def closed() -> str:
    """Return the table of closed paths."""
    rows = []
    for pocket in POCKETS:
        file = boards.data_folder().parent / "pockets" / f"{pocket}.wkt"
        for strategy in ("connected", "firefly"):
            cells = []
            for closes in (False, True):
                made = api.optimize(
                    file, process="pocket", units="mm", tool_diameter=10, depth=6, step_down=2, strategy=strategy,
                    closed_path=closes, preset="fast", threads=1,
                )  # fmt: skip
                result = made.detail.plans[0].result
                cells += [f"{result.measures.feed_mm:.0f}", f"{made.after.time_s:.1f}"]
            change = 100.0 * (float(cells[3]) / float(cells[1]) - 1.0)
            rows.append([pocket, strategy, *cells, f"{change:+.2f}"])
    head = ["instance", "strategy", "path, mm", "program, s", "closed, mm", "closed, s", "change, %"]
    return f"""Feed of one level and time of the program (10 mm tool, three levels of 2 mm, `--preset fast`) without and
with `--closed-path`.

{table(head, rows)}"""


SECTIONS = {"trails": trails, "parallel": parallel, "fireflies": fireflies, "nests": nests, "closed": closed}


def main() -> None:
    """Measure and print a table; write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("section", choices=SECTIONS)
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    arguments = made.parse_args()
    for algorithm in ("as", "firefly"):
        for variant in VARIANTS:
            warm_up(replace(PLAIN, algorithm=algorithm), AcoOptions(), 0, variant)
    text = f"{SECTIONS[arguments.section]()}\n\n{facts('as_published', sys.argv[1:], ['leafcut', 'numpy', 'numba'])}"
    print(text)
    if arguments.write:
        write_section(arguments.write, f"as published: {arguments.section}", text)


if __name__ == "__main__":
    main()
