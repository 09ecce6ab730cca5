"""Says which kernels a search compiles or loads after the warm-up; run with an algorithm and a number of nodes."""

from __future__ import annotations

import importlib
import pkgutil
import sys

import numba
import numpy as np

import leafcut.kernels
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions, SolveOptions
from leafcut.solve.solve import solve, warm_up


def signatures() -> dict[str, int]:
    """Return how many signatures every kernel has been compiled or loaded for."""
    modules = [
        importlib.import_module(f"leafcut.kernels.{m.name}") for m in pkgutil.iter_modules(leafcut.kernels.__path__)
    ]
    return {
        f"{module.__name__}.{name}": len(value.signatures)
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, numba.core.registry.CPUDispatcher)
    }


def main(algorithm: str, n: int) -> None:
    """Warm up, search with n nodes, and compare."""
    options = SolveOptions(algorithm=algorithm, preset="fast", threads=1, bound=False)
    warm_up(options, AcoOptions(n_ants=2))
    before = signatures()
    xy = np.random.default_rng(2).uniform(0, 90, (n, 2))
    solve(RoutingProblem.of_points(xy, closed=True), options, AcoOptions(n_ants=2))
    new = [name for name, count in signatures().items() if count > before[name]]
    print("\n".join(new) or "nothing compiled")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
