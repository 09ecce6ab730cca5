"""A search for machine seconds ends when it takes longer than what it can still gain; work is counted, not clocked."""

from __future__ import annotations

import numpy as np

from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.solve.solve import solve

XY = np.random.default_rng(1).uniform(0.0, 300.0, (300, 2))


def generations(velocity: float, **options: object) -> tuple[int, float]:
    metric = Metric("linear", velocity=(velocity, velocity), acceleration=(1e4, 1e4))
    found = solve(RoutingProblem.of_points(XY, metric), SolveOptions(threads=1, bound=False, **options))  # type: ignore[arg-type]
    return found.iterations, found.cost


def test_less_is_sought_where_less_can_be_gained() -> None:
    """The same points on a slow machine and on one on which all of it takes a second; twice, the same answer."""
    slow, fast = generations(1.0), generations(3000.0)
    assert fast[0] < slow[0]
    assert generations(3000.0) == fast


def test_who_asks_for_thoroughness_or_iterations_gets_them() -> None:
    assert generations(3000.0, iterations=60)[0] >= generations(3000.0)[0]
    assert generations(3000.0, iterations=60)[1] <= generations(3000.0)[1] * 1.01
