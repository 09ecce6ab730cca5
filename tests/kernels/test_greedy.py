"""The parts of the greedy tour."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.greedy import join_fragments, join_fragments_along_edges, list_joinable_edges, write_path

SEEDS = st.integers(0, 2**31)


def lists_of(n: int, k: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random lists int32[n, k] without repetition, some shorter, and symmetric costs."""
    rng = np.random.default_rng(seed)
    matrix = rng.choice([-2.0, -0.5, 0.0, 1e-9, 0.25, 3.0, 3.000001, 7e8], (n, n))
    matrix = np.triu(matrix) + np.triu(matrix, 1).T
    lists = np.full((n, k), -1, dtype=np.int32)
    for i in range(n):
        others = rng.permutation(np.delete(np.arange(n), i))[: rng.integers(0, k + 1)]
        lists[i, : len(others)] = others
    lengths = np.where(lists >= 0, matrix[np.arange(n)[:, None], lists], np.inf)
    return lists, lengths


def sorted_edges(lists: np.ndarray, lengths: np.ndarray, tail: np.ndarray, limit: float) -> np.ndarray:
    """Return (row, column) of the edges that can be joined, cheapest first."""
    n, k = lists.shape
    edges = np.zeros(n * k, dtype=np.uint64)
    count = list_joinable_edges(lists, lengths, np.arange(n, dtype=np.int32), tail, limit, edges)
    at = (np.sort(edges[:count]) & np.uint64(2**32 - 1)).astype(np.int64)
    return np.stack([at // k, at % k], axis=1)


@given(st.integers(2, 20), st.integers(1, 8), SEEDS, st.sampled_from([0.25, np.inf]))
def test_every_edge_up_to_a_limit_is_listed_once_and_in_the_order_of_costs(
    n: int, k: int, seed: int, limit: float
) -> None:
    """Negative costs first, which only matrices have; of equal ones the first row."""
    lists, lengths = lists_of(n, k, seed)
    found = sorted_edges(lists, lengths, np.arange(n, dtype=np.int32), limit)
    costs = lengths[found[:, 0], found[:, 1]]
    assert (np.diff(costs) >= 0).all()
    pairs = [frozenset((int(i), int(lists[i, c]))) for i, c in found]
    expected = {
        frozenset((i, int(j)))
        for i in range(n)
        for j, cost in zip(lists[i], lengths[i], strict=True)
        if j >= 0 and cost <= limit
    }
    assert len(pairs) == len(expected)
    assert set(pairs) == expected
    rows = found[:, 0]
    assert (np.diff(rows)[np.diff(costs) == 0] >= 0).all()


@given(st.integers(3, 25), SEEDS)
def test_joining_keeps_fragments_and_knows_their_ends(n: int, seed: int) -> None:
    """After any joins, every node has at most two neighbours, there are no cycles, and `tail` is the other end."""
    rng = np.random.default_rng(seed)
    tail, beside = np.arange(n, dtype=np.int32), np.full((n, 2), -1, dtype=np.int32)
    part = {v: {v} for v in range(n)}
    degree = [0] * n
    for i, j in rng.integers(0, n, (4 * n, 2)).tolist():
        if i == j:
            continue
        possible = degree[i] < 2 and degree[j] < 2 and part[i] is not part[j]
        assert join_fragments(tail, beside, i, j) == possible
        if possible:
            degree[i] += 1
            degree[j] += 1
            part[i] |= part[j]
            for v in part[j]:
                part[v] = part[i]
    for v in range(n):
        assert (beside[v] >= 0).sum() == degree[v]
        if degree[v] == 2:
            assert tail[v] == -1
        else:
            assert {v, int(tail[v])} == {w for w in part[v] if degree[w] < 2}


def test_a_path_is_written_down_from_its_beginning() -> None:
    tail, beside = np.arange(5, dtype=np.int32), np.full((5, 2), -1, dtype=np.int32)
    for i, j in ((3, 1), (0, 4), (1, 0), (2, 3)):
        assert join_fragments(tail, beside, i, j)
    tour = np.zeros(5, dtype=np.int32)
    write_path(beside, 2, tour)
    assert tour.tolist() == [2, 3, 1, 0, 4]


def test_rows_may_stand_for_other_nodes() -> None:
    """Two rows that are nodes 3 and 1 of four: they are joined, and no others."""
    lists, lengths = np.array([[1], [0]], dtype=np.int32), np.array([[2.0], [2.0]])
    nodes, edges = np.array([3, 1], dtype=np.int32), np.zeros(2, dtype=np.uint64)
    tail, beside = np.arange(4, dtype=np.int32), np.full((4, 2), -1, dtype=np.int32)
    assert list_joinable_edges(lists, lengths, nodes, tail, np.inf, edges) == 1
    join_fragments_along_edges(edges, 1, lists, nodes, tail, beside)
    assert tail.tolist() == [0, 3, 2, 1]
    assert list_joinable_edges(lists, lengths, nodes, tail, np.inf, edges) == 0
