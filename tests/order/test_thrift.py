"""A search for machine time ends when it takes longer than it can still gain; work is counted, not clocked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import SolveOptions
from leafcut.order.path_search import SECONDS_PER_KICK, preset_kicks
from leafcut.order.solve import solve
from leafcut.order.stop import FIRST_STRETCH, PayoffLimit
from leafcut.report.wording import ended_without_payoff

XY = np.random.default_rng(1).uniform(0.0, 300.0, (100, 2))


def generations(velocity: float, **options: object) -> tuple[int, float]:
    """Return iterations and cost of a search for 100 points on a machine of this speed, mm/s."""
    metric = Metric("linear", velocity=(velocity, velocity), acceleration=(1e4, 1e4))
    found = solve(RoutingProblem.of_points(XY, metric), SolveOptions(threads=1, bound=False, **options))  # type: ignore[arg-type]
    return found.iterations, found.cost


def test_the_search_is_shorter_if_less_time_can_be_gained() -> None:
    """The same points on a slow and on a fast machine; the result is reproducible; given iterations are used."""
    slow, fast = generations(1.0), generations(3000.0)
    assert fast[0] < slow[0]
    assert generations(3000.0) == fast
    asked = generations(3000.0, iterations=60)
    assert asked[0] >= fast[0]
    assert asked[1] <= fast[1] * 1.01


def contours(count: int, *, ways: int = 1, pairs: bool = False, velocity: float = 3000.0) -> RoutingProblem:
    """Return contours with several starts, or cuts with two ends, on a machine of this speed, mm/s."""
    rng = np.random.default_rng(2)
    entry = rng.uniform(0.0, 100.0, (count, 1, 2)) + rng.uniform(-2.0, 2.0, (count, ways, 2))
    return RoutingProblem(
        entry=entry.reshape(-1, 2),
        exit=entry.reshape(-1, 2) + np.array([1.0, 0.0]),
        cluster=np.repeat(np.arange(count, dtype=np.int32), ways),
        service=np.zeros(count * ways),
        metric=Metric("linear", velocity=(velocity, velocity), acceleration=(1e5, 1e5)),
        precedence=np.array(
            [[k, k + 1] for k in range(0, count - 1, 7)] if pairs else np.zeros((0, 2)), dtype=np.int32
        ),
    )


def kicks(found: Solution) -> int:
    return sum(figures.ants for figures in found.workers)


@pytest.mark.parametrize(
    "problem",
    [
        pytest.param(contours(150, ways=2), marks=pytest.mark.slow),
        pytest.param(contours(150), marks=pytest.mark.slow),
        contours(150, pairs=True),
    ],
)
def test_the_search_is_shorter_for_sheets_and_programs_too(problem: RoutingProblem) -> None:
    """Contours with several starts, cuts with two ends, and cuts with precedence."""
    found = solve(problem, SolveOptions(bound=False))
    assert found.spared and ended_without_payoff(found)
    nodes = 150 + 1  # with the node that joins the ends
    assert FIRST_STRETCH / (SECONDS_PER_KICK * nodes**0.5) <= kicks(found) < 0.5 * preset_kicks("default", 150)


def test_a_longer_budget_or_iterations_asked_for_are_used() -> None:
    problem = contours(40)
    found = solve(problem, SolveOptions(iterations=120, bound=False))
    assert found.iterations == 120 and not found.spared
    thrifty = [PayoffLimit.from_options(o, problem).holds for o in (SolveOptions(), SolveOptions(preset="thorough"))]
    assert thrifty == [True, False]
    assert not PayoffLimit.from_options(SolveOptions(time_limit=5.0), problem).holds
    assert not PayoffLimit.from_options(SolveOptions(), replace(problem, metric=Metric())).holds, (
        "costs in millimetres are no time"
    )


def test_stretches_double_and_each_has_to_gain_what_the_next_takes() -> None:
    """By hand: 1 s, 2 s, 4 s. From 10 to 6 is worth 1 s more, to 3.5 is worth 2 s more, to 0 is not worth 4 s."""
    rule = PayoffLimit(holds=True)
    steps = [(0.0, 10.0), (0.9, 9.99), (1.0, 6.0), (1.5, 6.0), (2.0, 3.5), (3.9, 3.4), (4.0, 0.0)]
    assert [rule.is_worth_continuing(*step) for step in steps] == [True] * 6 + [False]
    assert rule.spared and not rule.is_worth_continuing(4.1, -9.0)
