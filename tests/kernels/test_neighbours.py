"""The k-d tree against looking at all points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.kernels.neighbours import nearest_k, nearest_unvisited, remove
from leafcut.solve.instance import plant_tree

GRIDDY = st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=2, max_size=120)


def distances(xy: np.ndarray, i: int) -> np.ndarray:
    """Return squared distances from point i, its own infinite."""
    d = ((xy - xy[i]) ** 2).sum(axis=1)
    d[i] = np.inf
    return d


@given(GRIDDY, st.integers(1, 9))
@settings(deadline=None)
def test_the_k_nearest_are_as_near_as_by_looking_at_all(places: list[tuple[int, int]], k: int) -> None:
    xy = np.array(places, dtype=np.float64)
    tree = plant_tree(xy)
    found, near, stack = np.zeros(k, dtype=np.int32), np.zeros(k), np.zeros(64, dtype=np.int32)
    for i in range(len(xy)):
        have = nearest_k(tree, i, k, -1, found, near, stack)
        assert have == min(k, len(xy) - 1)
        assert np.array_equal(near[:have], np.sort(distances(xy, i))[:have])
        assert len(set(found[:have].tolist())) == have


@given(GRIDDY)
@settings(deadline=None)
def test_quadrants_share_out_all_other_places(places: list[tuple[int, int]]) -> None:
    """Every point elsewhere belongs to exactly one quadrant, so four searches of size n find all of them once."""
    xy = np.unique(np.array(places, dtype=np.float64), axis=0)
    tree, n = plant_tree(xy), len(xy)
    found, near, stack = np.zeros(n, dtype=np.int32), np.zeros(n), np.zeros(64, dtype=np.int32)
    seen: list[int] = []
    for quadrant in range(4):
        have = nearest_k(tree, 0, n, quadrant, found, near, stack)
        seen += found[:have].tolist()
    assert sorted(seen) == list(range(1, n))


@pytest.mark.parametrize("clustered", [False, True])
def test_the_nearest_unvisited_is_right_until_none_is_left(clustered: bool) -> None:
    rng = np.random.default_rng(3)
    xy = rng.uniform(0, 100, (300, 2))
    if clustered:
        xy[:150] = xy[:150] / 1000.0
    tree = plant_tree(xy)
    alive = (tree.stop - tree.begin).astype(np.int32)
    visited, stack = np.zeros(300, dtype=np.uint8), np.zeros(64, dtype=np.int32)
    here = 0
    for _ in range(300):
        visited[here] = 1
        remove(tree, alive, here)
        there = nearest_unvisited(tree, alive, visited, here, stack)
        left = np.where(visited == 0, distances(xy, here), np.inf)
        if there < 0:
            assert visited.all()
            return
        assert distances(xy, here)[there] == left.min()
        here = there
