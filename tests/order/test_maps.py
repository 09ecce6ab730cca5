"""Maps as routing problems: sets, precedence and forbidden moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from leafcut.api import solve
from leafcut.errors import PlanError, SolveError
from leafcut.model.part import Grouping, Hole, Part
from leafcut.order.maps import check_forbidden_edges, problem_from_map

#: Costs of five nodes, by hand; sets 1, 2, 2, 3, 4.
COSTS = np.array([
    [0, 9, 1, 8, 5],
    [2, 0, 0, 1, 7],
    [9, 0, 0, 2, 3],
    [4, 9, 9, 0, 1],
    [1, 6, 2, 9, 0],
], dtype=float)  # fmt: skip


def four_sets(costs: np.ndarray = COSTS, pairs: object = (), first: int = 0) -> Part:
    cluster = np.array([0, 1, 1, 2, 3], dtype=np.int32)
    grouping = Grouping(cluster, np.array(pairs, dtype=np.int32).reshape(-1, 2), first)
    holes = tuple(Hole(float(i), 0.0, 0.0) for i in range(5))
    return Part("four", holes, edge_weight_type="EXPLICIT", matrix=costs, grouping=grouping)


def test_a_tour_visits_one_node_of_every_set_and_begins_where_it_must() -> None:
    """Of the six orders and two nodes 0 2 3 4 is shortest: 1 + 2 + 1 + 1."""
    found = solve(four_sets()).solution
    assert (found.nodes.tolist(), found.cost) == ([0, 2, 3, 4], 5)


def test_what_must_come_before_does_though_it_is_longer() -> None:
    """Node 4 before 1 and 2: 0 4 2 3 is 5 + 2 + 2 + 4; 0 4 1 3 is 16, 0 3 4 2 20, 0 4 3 2 32."""
    found = solve(four_sets(pairs=[(3, 1)])).solution
    assert (found.nodes.tolist(), found.cost) == ([0, 4, 2, 3], 13)


def test_ways_that_are_not_allowed_are_not_taken() -> None:
    """Without 2 → 3 the best is 0 1 3 4: 9 + 1 + 1 + 1; 0 4 2 1 3 is no tour, 0 4 1 3 is 16."""
    costs = COSTS.copy()
    costs[2, 3] = -1
    found = solve(four_sets(costs)).solution
    assert (found.nodes.tolist(), found.cost) == ([0, 1, 3, 4], 12)


@pytest.mark.parametrize(
    "pairs, first, words",
    [
        ([(1, 0)], 0, "the tour begins with set 1, and set 2 must come before it"),
        ([(1, 2), (2, 1)], -1, "no order satisfies both"),
    ],
)
def test_precedence_that_no_tour_keeps_is_one_clear_line(pairs: object, first: int, words: str) -> None:
    with pytest.raises((PlanError, SolveError)) as caught:
        solve(four_sets(pairs=pairs, first=first))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_when_no_way_is_allowed_one_is_named() -> None:
    with pytest.raises(PlanError, match="forbids; the best tour goes from node 1 to"):
        solve(four_sets(np.where(np.eye(5) > 0, 0.0, -1.0)))


def test_a_map_is_a_closed_problem_whose_first_set_comes_before_all_others() -> None:
    """A forbidden edge costs more than the four most expensive edges of a tour."""
    costs = COSTS.copy()
    costs[[2, 4], [3, 0]] = -1
    problem = problem_from_map(four_sets(costs, pairs=[(1, 3)], first=2))
    assert problem.precedence.tolist() == [[1, 3], [2, 0], [2, 1], [2, 3]]
    assert problem.cluster.tolist() == [0, 1, 1, 2, 3]
    assert (problem.closed, problem.name, problem.metric.name) == (True, "four", "EXPLICIT")
    matrix = problem.metric.matrix
    assert matrix is not None
    assert matrix[2, 3] == matrix[4, 0] > 4 * 9.0
    assert np.array_equal(np.where(costs < 0, -1, matrix), costs)
    anywhere = problem_from_map(four_sets(pairs=[(1, 3)], first=-1))
    assert anywhere.precedence.tolist() == [[1, 3]]
    assert np.array_equal(anywhere.metric.matrix, COSTS)  # type: ignore[arg-type]
    plain = problem_from_map(replace(four_sets(), grouping=None, matrix=None, edge_weight_type=None))
    assert (plain.n_clusters, plain.metric.name, plain.closed) == (5, "euclidean", True)
    rounded = problem_from_map(replace(four_sets(), matrix=None, edge_weight_type="CEIL_2D"))
    assert (rounded.metric.name, rounded.metric.matrix, rounded.n_clusters) == ("CEIL_2D", None, 4)


def test_the_messages_about_a_map_name_its_file() -> None:
    part = replace(four_sets(np.where(COSTS == 9, -1.0, COSTS), pairs=[(3, 1)], first=1), source="four.tsp")
    with pytest.raises(PlanError) as refused:
        problem_from_map(part)
    assert str(refused.value) == (
        "four.tsp: the tour begins with set 2, and set 4 must come before it; change one of the two"
    )
    with pytest.raises(PlanError) as refused:
        check_forbidden_edges(replace(part, source=""), np.array([4, 0, 2, 0], dtype=np.int32))
    assert str(refused.value) == (
        "four: no tour was found without edges that the file forbids; the best tour goes from node 3 to 1 (-1 in the "
        "matrix); give more time, or allow more edges"
    )
    check_forbidden_edges(part, np.array([4, 0, 2, 3], dtype=np.int32))
    check_forbidden_edges(part, np.array([2], dtype=np.int32))
    check_forbidden_edges(replace(part, matrix=None), np.array([2, 0, 3], dtype=np.int32))
    with pytest.raises(PlanError, match="from node 1 to 2 "):
        check_forbidden_edges(part, np.array([0, 1], dtype=np.int32))
