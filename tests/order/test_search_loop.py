"""Runs of all algorithms: budgets, Ctrl-C, and the plain loop of a search."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from leafcut.model.heartbeat import Progress
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order.search import Best, Population, run_population, set_preset_budget, set_visit_budget
from leafcut.order.solve import solve
from leafcut.order.stop import Stop


@pytest.mark.parametrize(
    ("given", "iterations", "patience"),
    [
        (SolveOptions(), 8, 5),
        (SolveOptions(iterations=3), math.inf, math.inf),
        (SolveOptions(time_limit=9.0), math.inf, math.inf),
    ],
)
def test_the_budget_of_a_preset_applies_without_a_limit(
    given: SolveOptions, iterations: float, patience: float
) -> None:
    stop = Stop()
    set_preset_budget(stop, given, 7.2, 5)
    assert (stop.iterations, stop.patience) == (iterations, patience)


def test_a_budget_is_one_iteration_at_least() -> None:
    stop = Stop()
    set_preset_budget(stop, SolveOptions(), 0.01)
    assert (stop.iterations, stop.patience) == (1, math.inf)


@pytest.mark.parametrize(("preset", "visits", "patience"), [("fast", 2e5, 30), ("default", 4e6, 40)])
def test_the_budget_of_ants_is_a_number_of_visited_nodes(preset: str, visits: float, patience: int) -> None:
    stop = Stop()
    set_visit_budget(stop, SolveOptions(preset=preset), 400)
    assert (stop.iterations, stop.patience) == (visits / 400, patience)


class Candidates(Population):
    """Proposes two tours in each iteration, by a list of costs, and keeps a list of all that is learned."""

    def __init__(self, costs: list[tuple[float, float]]) -> None:
        super().__init__()
        self.given, self.learned = costs, []

    def construct(self, iteration: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array([[iteration, 0], [iteration, 1]], dtype=np.int32), np.array(self.given[iteration])

    def reinforce(self, iteration: int, tours: np.ndarray, costs: np.ndarray, best: Best) -> None:
        self.learned.append((iteration, tours.tolist(), costs.tolist(), best.cost))


def test_a_search_keeps_the_first_of_the_cheapest_and_learns_from_every_iteration() -> None:
    ants = Candidates([(9.0, 8.0), (8.0, 8.0), (6.0, 6.0), (7.0, math.inf)])
    reported: list[float] = []
    best = Best(Stop(iterations=4), progress=lambda now: reported.append(now.cost or 0.0))
    assert run_population(ants, best) == 4
    assert (best.tour.tolist(), best.cost, best.iteration) == ([2, 0], 6.0, 2)
    assert [row[0] for row in ants.learned] == [0, 1, 2, 3]
    assert [row[3] for row in ants.learned] == reported == [8.0, 8.0, 6.0, 6.0]


def test_a_search_ends_without_patience() -> None:
    ants = Candidates([(9.0, 9.0)] * 9)
    best = Best(Stop(patience=3))
    assert run_population(ants, best) == 3


def test_ctrl_c_keeps_the_best_tour_and_ends_the_program_without_one() -> None:
    """The event of the caller is set, so that later searches of a run end at once."""

    def interrupt(now: Progress) -> None:
        raise KeyboardInterrupt

    problem, cancelled = RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 90, (30, 2))), threading.Event()
    for algorithm in ("colony", "kicks", "mmas", "firefly"):
        found = solve(problem, SolveOptions(algorithm=algorithm), progress=interrupt, cancelled=cancelled)
        assert sorted(found.nodes.tolist()) == list(range(30))
        assert found.stopped_early
        assert cancelled.is_set()
        cancelled.clear()
