"""Print the kernels that a search compiles or loads after the warm-up; run with an algorithm and a number of nodes."""

from __future__ import annotations

import importlib
import pkgutil
import sys

import numpy as np
from numba.core.dispatcher import Dispatcher

import leafcut.kernels
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import AcoOptions, SolveOptions
from leafcut.order.algorithms import warm_up
from leafcut.order.solve import solve


def signatures() -> dict[str, int]:
    """Return the number of compiled or loaded signatures of every kernel."""
    modules = [
        importlib.import_module(f"leafcut.kernels.{m.name}") for m in pkgutil.iter_modules(leafcut.kernels.__path__)
    ]
    return {
        f"{module.__name__}.{name}": len(value.signatures)
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, Dispatcher)
    }


def cuts(xy: np.ndarray, closed: bool = True) -> RoutingProblem:
    """Return as many cuts as there are places, each from one to another."""
    clusters = np.arange(len(xy), dtype=np.int32)
    return RoutingProblem(xy, xy[::-1].copy(), clusters, np.zeros(len(xy)), closed=closed)


def slots(xy: np.ndarray) -> RoutingProblem:
    """Return half as many slots as there are points, each with two directions."""
    clusters = np.repeat(np.arange(len(xy) // 2, dtype=np.int32), 2)
    xy = xy[: len(clusters)]
    return RoutingProblem(xy, xy.reshape(-1, 2, 2)[:, ::-1].reshape(-1, 2).copy(), clusters, np.zeros(len(xy)))


def before(xy: np.ndarray) -> RoutingProblem:
    """Return the places as holes, the first of them before all others."""
    pairs = np.array([[0, k] for k in range(1, len(xy))], dtype=np.int32)
    return RoutingProblem.of_points(xy, start=(0.0, 0.0), end=(9.0, 9.0), precedence=pairs)


def table(xy: np.ndarray) -> RoutingProblem:
    """Return the points with an asymmetric cost table."""
    matrix = np.abs(xy[:, None, 0] - 2.0 * xy[None, :, 0])
    return RoutingProblem.of_points(xy, Metric("EXPLICIT", matrix=matrix), closed=True)


KINDS = {"cuts": cuts, "slots": slots, "before": before, "table": table}


def main(algorithm: str, n: int) -> None:
    """Warm up, search with n nodes, and compare."""
    xy = np.random.default_rng(2).uniform(0, 90, (n, 2))
    if algorithm in KINDS:
        problem, algorithm = KINDS[algorithm](xy), "auto"
    else:
        problem = RoutingProblem.of_points(xy, closed=True)
    options = SolveOptions(algorithm=algorithm, preset="fast", threads=1, bound=False)
    warm_up(problem, options)
    before = signatures()
    solve(problem, options, AcoOptions(n_ants=2))
    new = [name for name, count in signatures().items() if count > before[name]]
    print("\n".join(new) or "nothing compiled")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
