"""Precedence: what pairs imply, worked out by hand, and the messages about pairs that no order satisfies."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.errors import SolveError
from leafcut.model.problem import RoutingProblem
from leafcut.order.precedence import (
    compressed_rows,
    impossible_moves_and_reduction,
    satisfies_pairs,
    transitive_closure,
    validate_pairs,
    violated_pair,
)

#: 0 before 1 and 2, both before 3; 3 before 4, and 0 before 4, which follows. Cluster 5 is in no pair.
DIAMOND = np.array([[0, 1], [0, 2], [0, 4], [1, 3], [2, 3], [3, 4]], dtype=np.int32)


def matrix(n: int, true: set[tuple[int, int]]) -> list[list[bool]]:
    """Return bool[n, n], true at the given places."""
    return [[(i, j) in true for j in range(n)] for i in range(n)]


def problem_with(pairs: list[list[int]], n: int = 6) -> RoutingProblem:
    """Return a problem of n clusters with pairs."""
    return RoutingProblem.of_points(np.zeros((n, 2)), precedence=np.array(pairs, dtype=np.int32).reshape(-1, 2))


def test_pairs_are_sorted_and_each_is_kept_once() -> None:
    assert validate_pairs(problem_with([[3, 1], [0, 5], [3, 1], [0, 2]])).tolist() == [[0, 2], [0, 5], [3, 1]]
    assert validate_pairs(problem_with([])).shape == (0, 2)
    assert validate_pairs(problem_with([[5, 0]])).tolist() == [[5, 0]]


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([[0, 1], [2, 6], [7, 1]], "precedence pair (2, 6): clusters are numbered 0 to 5; correct the pair"),
        ([[6, 0]], "precedence pair (6, 0): clusters are numbered 0 to 5; correct the pair"),
        ([[0, 5], [-1, 2]], "precedence pair (-1, 2): clusters are numbered 0 to 5; correct the pair"),
        ([[0, 1], [2, -3]], "precedence pair (2, -3): clusters are numbered 0 to 5; correct the pair"),
        ([[3, 3]], "cluster 3 must come before itself: no order satisfies this; remove that pair"),
        (
            [[1, 4], [4, 1]],
            "cluster 4 must come before cluster 1, and cluster 1 before cluster 4: no order satisfies both; remove one "
            "of the pairs",
        ),
        (
            [[0, 1], [1, 2], [2, 5], [5, 1], [5, 3]],
            "cluster 5 must come before cluster 1, and cluster 1 before cluster 5 (via 1 more): no order satisfies "
            "both; remove one of the pairs",
        ),
        (
            [[4, 2], [2, 4], [2, 0], [0, 1]],
            "cluster 4 must come before cluster 2, and cluster 2 before cluster 4: no order satisfies both; remove one "
            "of the pairs",
        ),
        (
            [[1, 2], [2, 3], [3, 4], [4, 5], [5, 1]],
            "cluster 5 must come before cluster 1, and cluster 1 before cluster 5 (via 3 more): no order satisfies "
            "both; remove one of the pairs",
        ),
    ],
)
def test_pairs_that_no_order_satisfies_are_refused_by_naming_one(pairs: list[list[int]], message: str) -> None:
    with pytest.raises(SolveError) as refused:
        validate_pairs(problem_with(pairs))
    assert str(refused.value) == message


def test_an_order_breaks_the_first_pair_whose_second_comes_first() -> None:
    pairs = np.array([[0, 1], [2, 3], [3, 0]], dtype=np.int32)
    for order, broken in (
        ([2, 3, 0, 1], None),
        ([2, 3, 1, 0], (0, 1)),
        ([3, 2, 0, 1], (2, 3)),
        ([2, 0, 3, 1], (3, 0)),
        ([0, 1, 3, 2], (2, 3)),
    ):
        assert violated_pair(pairs, np.array(order, dtype=np.int32)) == broken
        assert satisfies_pairs(pairs, np.array(order, dtype=np.int32)) is (broken is None)
    assert satisfies_pairs(pairs[:0], np.array([1, 0, 2, 3], dtype=np.int32)) is True


def test_rows_list_the_partners_of_each_cluster_in_ascending_order() -> None:
    begin, partner = compressed_rows(np.array([[3, 2], [0, 4], [3, 0], [0, 1]], dtype=np.int32), 5)
    assert (begin.tolist(), partner.tolist()) == ([0, 2, 2, 2, 4, 4], [1, 4, 0, 2])
    assert (begin.dtype, partner.dtype) == (np.int32, np.int32)
    begin, partner = compressed_rows(np.zeros((0, 2), dtype=np.int32), 2)
    assert (begin.tolist(), partner.tolist()) == ([0, 0, 0], [])


def test_what_must_come_later_is_what_a_chain_of_pairs_reaches() -> None:
    reached = {(0, 1), (0, 2), (0, 3), (0, 4), (1, 3), (1, 4), (2, 3), (2, 4), (3, 4)}
    assert transitive_closure(DIAMOND, 6).tolist() == matrix(6, reached)
    reversed_names = 5 - DIAMOND
    assert transitive_closure(reversed_names, 6).tolist() == matrix(6, {(5 - a, 5 - b) for a, b in reached})


def test_a_move_is_impossible_backwards_and_past_a_cluster_and_implied_pairs_are_left_out() -> None:
    barred, left = impossible_moves_and_reduction(DIAMOND, 6)
    backwards = {(b, a) for a, b in [(0, 1), (0, 2), (0, 3), (0, 4), (1, 3), (1, 4), (2, 3), (2, 4), (3, 4)]}
    assert barred.tolist() == matrix(6, backwards | {(0, 3), (0, 4), (1, 4), (2, 4)})
    assert left.tolist() == [[0, 1], [0, 2], [1, 3], [2, 3], [3, 4]]
