"""How near the optimum the fireflies come: TSPLIB up to 318 cities, and the grids of seven pockets.

    python benchmarks/firefly.py --seeds 3 --times 30,20 --write docs/benchmarks.md

Without local search and with it, on one thread; limits are seconds of the processor, as the machine is
shared. Tours are checked and added up again here. A grid's path is open; its gap is to (N - 1)·DP, N points of distance
DP. What no path can be below is told beside it: by the colours of a grid, black and white like a chessboard, or by the
proven bound of 1-trees over all allowed moves, whichever is more.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import sys
import time
from dataclasses import replace
from pathlib import Path
from statistics import mean, median

import boards
import numpy as np
import shapely
import tsplib
from page import facts, table, write_section

from leafcut.geometry.regions import polygons, shrunk
from leafcut.model.pocket import PocketRules
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions, SolveOptions
from leafcut.processes.pocket.plan.grid import ANGLES, Grid, GridContext, Retract, grid_points, grid_problem, lay_grid
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.solve import stop
from leafcut.solve.solve import solve, warm_up

CITIES = ("kroA100", "u159", "d198", "lin318")
DIAMETER, PITCH = 10.0, 6.0
#: Places of a grid that are tried along each axis.
OFFSETS = 12
#: Of grids that lie elsewhere so many are tried.
PROMISING = 4
#: Seconds of the search that a bound by 1-trees is sought beside.
BOUND_S = 3.0
PLAIN, MENDED = False, True
FIREFLY = SolveOptions(algorithm="firefly", threads=1, bound=False)


def folder() -> Path:
    """Return the folder of the pockets."""
    return boards.data_folder().parent / "pockets"


def known_grids() -> dict[str, tuple[int, float]]:
    """Return the points of every pocket's grid, and the gap that LKH leaves on it, from the list of baselines."""
    with (folder() / "baseline.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["method"] == "grid_lkh"]
    return {row["pocket"]: (int(row["grid_points"]), float(row["grid_gap_pct"])) for row in rows}


def grid_of(name: str, points: int) -> tuple[CentreRegion, Grid]:
    """Return a pocket's region and the grid with so many points that allows the shortest path by its colours.

    Raises
    ------
    ValueError
        No grid has so many points.
    """
    shape = shapely.from_wkt((folder() / f"{name}.wkt").read_text(encoding="utf-8"))
    rules = PocketRules(tool_diameter=DIAMETER, step_over=PITCH)
    region = CentreRegion(polygons(shrunk(shape, rules.radius, rules.tolerance))[0], rules)
    steps = np.arange(OFFSETS) * PITCH / OFFSETS
    grids = [grid_points(region, place) for place in itertools.product(steps, steps)]
    fitting = [grid for grid in grids if len(grid.points) == points]
    if not fitting:
        raise ValueError(f"{name}: no grid of {points} points was found")
    return region, min(fitting, key=lambda grid: grid.bound)


def checked_gap(context: GridContext, order: np.ndarray) -> float:
    """Return how far the path that is laid in an order is above (N - 1)·DP, percent, added up here.

    Raises
    ------
    AssertionError
        It leaves out a point, is lifted, or crosses an island or a wall.
    """
    points, pieces = context.grid.points, lay_grid(context, order).pieces
    corners = np.concatenate([piece.path.vertices[:, :2] for piece in pieces])
    if any(np.hypot(*(corners - point).T).min() > 1e-9 for point in points):
        raise AssertionError("the path does not come to every point")
    way = shapely.LineString(corners)  # from piece to piece, too
    if not context.region.polygon.buffer(1e-5).covers(way):
        raise AssertionError("the path is lifted, or crosses an island or a wall")
    return 100.0 * (float(way.length) / (context.grid.pitch * (len(points) - 1)) - 1.0)


def bound_gap(problem: RoutingProblem, grid: Grid) -> float:
    """Return how far above (N - 1)·DP every path is, percent."""
    best = solve(problem, SolveOptions(threads=1, time_limit=BOUND_S))
    least = max(grid.bound, best.lower_bound or 0.0)
    return 100.0 * (least / (grid.pitch * (len(grid.points) - 1)) - 1.0)


def grid_row(name: str, times: tuple[float, float], seeds: int) -> list[str]:
    """Return a pocket's row of the table."""
    points, lkh = known_grids()[name]
    region, grid = grid_of(name, points)
    problem, context = grid_problem(region, Retract(1e6, 1.0), grid=grid, finish=False)
    cells = []
    for local, limit in ((PLAIN, times[0]), (MENDED, times[1])):
        gaps, spent = [], []
        for seed in range(1, seeds + 1):
            options = replace(FIREFLY, local_search=local, time_limit=limit, seed=seed)
            began = time.process_time()
            gaps.append(checked_gap(context, solve(problem, options).nodes))
            spent.append(time.process_time() - began)
            print(f"{name} {limit:g} s, local search {local}: {gaps[-1]:.3f} %", file=sys.stderr, flush=True)
        cells += [spread(gaps), f"{median(spent):.1f}"]
    return [name, str(points), f"{bound_gap(problem, grid):.2f}", f"{lkh:.2f}", *cells]


def elsewhere_row(name: str, times: tuple[float, float]) -> list[str]:
    """Return a pocket's row of the table of grids that lie elsewhere: the four most promising share the time."""
    region, _ = grid_of(name, known_grids()[name][0])
    steps = np.arange(OFFSETS) * PITCH / OFFSETS
    grids = [(grid_points(region, (x, y), angle), angle) for angle, x, y in itertools.product(ANGLES, steps, steps)]
    found = []
    for grid, angle in sorted(grids, key=lambda pair: (pair[0].longer, pair[0].bound))[:PROMISING]:
        problem, context = grid_problem(region, Retract(1e6, 1.0), grid=grid, finish=False)
        order = solve(problem, replace(FIREFLY, time_limit=times[1] / PROMISING)).nodes
        found.append((checked_gap(context, order), len(found), angle, problem, context))
    gap, _, angle, problem, context = min(found)
    options = replace(FIREFLY, local_search=PLAIN, time_limit=times[0])
    plain = checked_gap(context, solve(problem, options).nodes)
    print(f"{name}, lying elsewhere: {plain:.3f} % plain, {gap:.3f} %", file=sys.stderr, flush=True)
    return [name, str(problem.n_nodes), f"{math.degrees(angle):.0f}°", spread([plain]), spread([gap])]


def city_row(name: str, seeds: int) -> tuple[list[str], list[float]]:
    """Return a TSPLIB board's row of the table, and its gaps with local search."""
    board, cells, gaps = boards.load(name), [], []
    for local in (PLAIN, MENDED):
        options, gaps, spent = replace(FIREFLY, local_search=local), [], []
        for seed in range(1, seeds + 1):
            began = time.process_time()
            found = solve(tsplib.problem_of(board), replace(options, seed=seed))
            spent.append(time.process_time() - began)
            gaps.append(board.gap_percent(boards.checked_length(board, found.nodes, found.cost)))
            print(f"{name}, local search {local}: {gaps[-1]:.3f} %", file=sys.stderr, flush=True)
        cells += [spread(gaps), f"{median(spent):.1f}"]
    return [name, str(board.n), *cells], gaps


def spread(gaps: list[float]) -> str:
    """Return the median gap, and of several the lowest and the highest, percent."""
    words = [f"{abs(gap):.2f}" if math.isclose(gap, 0.0, abs_tol=5e-3) else f"{gap:.2f}" for gap in
             (median(gaps), min(gaps), max(gaps))]  # fmt: skip
    return words[0] if len(gaps) == 1 else f"{words[0]} ({words[1]} to {words[2]})"


def section(cities: list[list[str]], average: float, grids: list[list[str]], times: tuple[float, float]) -> str:
    """Return the section of the page."""
    both = ["plain, %", "processor, s", "with local search, %", "processor, s"]
    made = facts("firefly", sys.argv[1:], ["leafcut", "numpy", "numba"])
    return f"""## The discrete firefly algorithm

Gaps in percent, median of the seeds (lowest to highest), one thread. Plain is inversions and nothing
else; with local search every move is mended. Simple mode, preset `default`: a run ends after 20 iterations that found
nothing shorter.

{table(["board", "nodes", *both], cities)}

The mean with local search is {average:.3f} %.

Grids of seven pockets (points 6 mm apart, tool of 10 mm), open path: gap to (N - 1)·DP after {times[0]:g} s plain and
{times[1]:g} s with local search, of a processor. No path is below *bound*: by the colours of the grid, or by 1-trees.
LKH solved a grid of as many points, which may lie otherwise. No step crosses an island or a wall.

{table(["instance", "N", "bound, %", "LKH, %", *both], grids)}

{made}"""


def main() -> None:
    """Measure and print the tables; write them into the page where asked."""
    arguments = _arguments()
    stop.clock = time.process_time
    times = (arguments.times[0], arguments.times[-1])
    for local in (PLAIN, MENDED):
        warm_up(replace(FIREFLY, local_search=local), AcoOptions())
    if arguments.elsewhere:
        head = ["instance", "N", "turned by", "plain, %", "with local search, %"]
        rows = [elsewhere_row(name, times) for name in arguments.pockets or known_grids()]
        finish(
            "firefly_elsewhere",
            f"""Grids that lie elsewhere, or turned: the best of the {PROMISING} most promising, which
share {times[1]:g} s of a processor with local search; plain it has {times[0]:g} s on that one.

{table(head, rows)}

{facts("firefly", sys.argv[1:], ["leafcut", "numpy", "numba"])}""",
            arguments.write,
        )
        return
    cities = [city_row(name, arguments.seeds) for name in arguments.boards]
    average = mean(gap for _, gaps in cities for gap in gaps) if cities else math.nan
    grids = [grid_row(name, times, arguments.grid_seeds) for name in arguments.pockets or known_grids()]
    finish("firefly", section([row for row, _ in cities], average, grids, times), arguments.write)


def finish(name: str, text: str, page: Path | None) -> None:
    """Print a section; write it into the page where asked."""
    print(text)
    if page:
        write_section(page, name, text)


def _arguments() -> argparse.Namespace:
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("boards", nargs="*", default=list(CITIES), help="TSPLIB names")
    made.add_argument("--pockets", nargs="*", default=[], help="names of pockets; all without")
    made.add_argument("--times", type=lambda text: [float(word) for word in text.split(",")], default=[30.0, 20.0],
                      help="seconds on a grid, plain and with local search")  # fmt: skip
    made.add_argument("--seeds", type=int, default=3, help="runs of each board")
    made.add_argument("--grid-seeds", type=int, default=1, help="runs of each grid")
    made.add_argument("--elsewhere", action="store_true", help="measure grids that lie elsewhere, and nothing else")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    return made.parse_args()


if __name__ == "__main__":
    main()
