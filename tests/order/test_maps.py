"""Maps as routing problems: sets, precedence and forbidden moves."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.api import solve
from leafcut.errors import PlanError, SolveError
from leafcut.model.part import Grouping, Hole, Part

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
        ([(1, 2), (2, 1)], -1, "no order can keep both"),
    ],
)
def test_precedence_that_no_tour_keeps_is_one_clear_line(pairs: object, first: int, words: str) -> None:
    with pytest.raises((PlanError, SolveError)) as caught:
        solve(four_sets(pairs=pairs, first=first))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_when_no_way_is_allowed_one_is_named() -> None:
    with pytest.raises(PlanError, match="forbids; the best one goes from node 1 to"):
        solve(four_sets(np.where(np.eye(5) > 0, 0.0, -1.0)))
