"""Algorithms on instances with a published optimum."""

from __future__ import annotations

from pathlib import Path

import pytest

import leafcut
from leafcut.api import solve
from shared_data import tour_nodes

ANTS = ("as", "eas", "asrank", "mmas", "acs")


def test_the_published_optimal_tour_has_the_published_length(data: Path) -> None:
    """Reader, TSPLIB's rounding and the sum of costs agree with the optimum in the file."""
    from leafcut.model.problem import Metric, RoutingProblem
    from leafcut.order.instance import path_cost

    for name in ("kroA100", "pcb442"):
        part = leafcut.read_part(data / "tsplib" / f"{name}.tsp")
        problem = RoutingProblem.of_points(part.hole_xy, Metric(part.edge_weight_type), closed=True)
        tour = tour_nodes(data / "tsplib" / f"{name}.opt.tour")
        assert path_cost(problem, tour) == part.optimum


@pytest.mark.parametrize("algorithm", ANTS)
def test_each_algorithm_comes_within_three_percent_on_kroa100(algorithm: str, data: Path) -> None:
    part = leafcut.read_part(data / "tsplib" / "kroA100.tsp")
    assert part.optimum == 21282
    found = solve(part, algorithm=algorithm, iterations=40).solution
    assert 21282 <= found.cost <= 1.03 * 21282


@pytest.mark.parametrize("algorithm", ANTS)
@pytest.mark.parametrize(
    "name", ["d198", "pcb442", *(pytest.param(name, marks=pytest.mark.slow) for name in ("fl417", "u724", "rl1304"))]
)
def test_each_algorithm_improves_on_nearest_neighbour(algorithm: str, name: str, data: Path) -> None:
    part = leafcut.read_part(data / "tsplib" / f"{name}.tsp")
    nearest = solve(part, algorithm="nn").solution
    found = solve(part, algorithm=algorithm, iterations=1).solution
    assert part.optimum <= found.cost < nearest.cost


@pytest.mark.parametrize(
    ("algorithm", "iterations"),
    [("as", 60), ("eas", 60), ("asrank", 60), pytest.param("mmas", 800, marks=pytest.mark.slow), ("acs", 60)],
)
def test_ants_without_local_search_learn(algorithm: str, iterations: int, data: Path) -> None:
    """Tours of ants alone improve on nearest neighbour; MAX–MIN is the slowest, with the least evaporation (0.02)."""
    part = leafcut.read_part(data / "tsplib" / "kroA100.tsp")
    nearest = solve(part, algorithm="nn").solution
    found = solve(part, algorithm=algorithm, local_search=False, iterations=iterations, n_ants=50).solution
    assert 21282 <= found.cost < 0.92 * nearest.cost


@pytest.mark.slow
def test_mmas_comes_within_one_percent_on_pcb442(data: Path) -> None:
    part = leafcut.read_part(data / "tsplib" / "pcb442.tsp")
    assert solve(part, algorithm="mmas", iterations=200).solution.cost <= 1.01 * 50778


@pytest.mark.parametrize(
    "name, percent",
    [
        ("pcb442", 1.0),
        pytest.param("pcb3038", 1.5, marks=pytest.mark.slow),
        pytest.param("rl11849", 2.5, marks=pytest.mark.slow),
    ],
)
def test_kicks_come_near_the_optimum_of_large_boards(name: str, percent: float, data: Path) -> None:
    part = leafcut.read_part(data / "tsplib" / f"{name}.tsp")
    found = solve(part, algorithm="kicks", iterations=60).solution
    assert part.optimum <= found.cost <= (1 + percent / 100) * part.optimum
    assert sorted(found.nodes.tolist()) == list(range(len(part.holes)))
