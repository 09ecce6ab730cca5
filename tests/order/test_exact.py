"""The best order of a few clusters: no order is cheaper, precedence is kept, and the bound equals its cost."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order import exact
from leafcut.order.exact import choose_nodes_for_order, is_exactly_solvable, solve_exactly
from leafcut.order.instance import path_cost
from leafcut.order.precedence import satisfies_pairs, validate_pairs
from leafcut.order.solve import solve

METRICS = [Metric(), Metric("linear", (40.0, 20.0), (90.0, 70.0)), Metric("dogleg", (40.0, 20.0), (90.0, 70.0))]
ENDS = [(None, None), ((1.0, 2.0), None), (None, (30.0, 5.0)), ((1.0, 2.0), (30.0, 5.0)), "closed"]


def cuts(seed: int, ends: object, ways: int = 2, pairs: int = 2, m: int = 5) -> RoutingProblem:
    """Return m cuts with `ways` choices of start and end each."""
    rng = np.random.default_rng(seed)
    entry, leave = rng.uniform(0, 40, (2, m * ways, 2))
    hidden = rng.permutation(m)
    before = [hidden[np.sort(rng.choice(m, 2, replace=False))] for _ in range(pairs)]
    return RoutingProblem(
        entry,
        leave,
        np.repeat(np.arange(m, dtype=np.int32), ways),
        rng.uniform(0, 5, m * ways),
        METRICS[seed % 3],
        np.array(before, dtype=np.int32).reshape(-1, 2),
        start=None if ends == "closed" else ends[0],
        end=None if ends == "closed" else ends[1],
        closed=ends == "closed",
    )


def least(problem: RoutingProblem) -> float:
    """Return the cost of the cheapest of all orders that keep the precedence, each with its best nodes."""
    pairs = validate_pairs(problem)
    every = (np.array(o, dtype=np.int32) for o in itertools.permutations(range(problem.n_clusters)))
    return min(
        path_cost(problem, choose_nodes_for_order(problem, order)) for order in every if satisfies_pairs(pairs, order)
    )


@pytest.mark.parametrize("ends", ENDS)
def test_no_order_and_no_choice_of_nodes_is_cheaper(ends: object) -> None:
    for seed, pairs in itertools.product(range(3), (0, 3)):
        problem = cuts(seed, ends, pairs=pairs)
        nodes = solve_exactly(problem, validate_pairs(problem))
        assert satisfies_pairs(validate_pairs(problem), problem.cluster[nodes])
        assert path_cost(problem, nodes) == pytest.approx(least(problem))


def test_a_table_that_differs_by_direction_is_solved_to_the_optimum() -> None:
    for seed, closed in itertools.product(range(4), (True, False)):
        matrix = np.random.default_rng(seed).uniform(0, 40, (6, 6))
        problem = RoutingProblem.of_points(np.zeros((6, 2)), Metric("EXPLICIT", matrix=matrix), closed=closed)
        assert path_cost(problem, solve_exactly(problem, validate_pairs(problem))) == pytest.approx(least(problem))


def test_by_default_the_path_of_a_few_cuts_is_proved_to_be_the_shortest() -> None:
    problem = cuts(4, ENDS[1], ways=1, m=9)
    found = solve(problem)
    assert (found.algorithm, found.lower_bound) == ("exact", found.cost)
    assert found.gap == 0.0
    assert found.history == ((found.seconds, found.cost),)
    searched = solve(problem, SolveOptions("colony"))
    assert searched.algorithm == "colony"
    assert searched.cost >= found.cost - 1e-9
    assert solve(problem, SolveOptions(bound=False)).lower_bound is None


def test_what_has_too_many_sets_or_nodes_is_left_to_the_search() -> None:
    assert is_exactly_solvable(cuts(1, ENDS[1], ways=1, m=exact.MOST_CLUSTERS))
    assert not is_exactly_solvable(cuts(1, ENDS[1], ways=1, m=exact.MOST_CLUSTERS + 1))
    assert not is_exactly_solvable(cuts(1, "closed", ways=60, m=10))
    assert not is_exactly_solvable(cuts(1, ENDS[1], ways=60, m=14))
