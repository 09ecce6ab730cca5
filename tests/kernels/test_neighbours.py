"""The k-d tree against looking at all points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.neighbours import (
    LEAF_SIZE,
    MOST_TWINS,
    REST,
    TWINS,
    Tree,
    find_nearby,
    mark_point_visited,
    nearest_unvisited,
)
from leafcut.order.instance import allocate_nearby_buffers, build_tree

GRIDDY = st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=2, max_size=120)
COARSE = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), min_size=2, max_size=120)
IN_LINE = st.lists(st.tuples(st.just(3), st.integers(0, 40)), min_size=2, max_size=120)
DIAGONAL = st.lists(st.integers(0, 40).map(lambda v: (v, 2 * v)), min_size=2, max_size=120)
PLACES = st.one_of(GRIDDY, COARSE, IN_LINE, DIAGONAL)


def distances(xy: np.ndarray, i: int) -> np.ndarray:
    """Return squared distances from point i, its own infinite."""
    d = ((xy - xy[i]) ** 2).sum(axis=1)
    d[i] = np.inf
    return d


def quadrant_of(dx: float, dy: float) -> int:
    """Return the quadrant of a direction: each starts with one axis and ends before the next, counter-clockwise."""
    quarter = np.floor(np.degrees(np.arctan2(dy, dx)) % 360 / 90)
    return int(quarter)


def in_numbers(tree: Tree) -> np.ndarray:
    """Return the points in the numbering of the tree, float64[n, 2]."""
    return np.stack([tree.x, tree.y], axis=1)


@given(PLACES, st.integers(0, 2))
def test_a_tree_holds_every_point_once_and_tight_boxes_round_them(places: list[tuple[int, int]], apart: int) -> None:
    xy = np.array(places, dtype=np.float64)
    n = len(xy)
    tree, label = build_tree(xy, apart)
    assert sorted(label.tolist()) == list(range(n))
    assert np.array_equal(in_numbers(tree), xy[label])
    assert np.array_equal(label[n - apart :], np.arange(n - apart, n))
    leaves = [m for m in range(len(tree.child)) if tree.child[m] < 0]
    assert sorted(i for m in leaves for i in range(tree.begin[m], tree.stop[m])) == list(range(n))
    for m in range(len(tree.child)):
        inside = xy[label[tree.begin[m] : tree.stop[m]]]
        assert np.array_equal(tree.box[m], np.concatenate([inside.min(axis=0), inside.max(axis=0)]))
        if tree.child[m] < 0:
            assert 1 <= len(inside) <= max(LEAF_SIZE, 1)
            assert (tree.leaf_of[tree.begin[m] : tree.stop[m]] == m).all()
        else:
            left = tree.child[m]
            assert left > m  # whoever goes through them backwards meets children first
            assert tree.parent[left] == tree.parent[left + 1] == m
            assert (tree.begin[m], tree.stop[m]) == (tree.begin[left], tree.stop[left + 1])
            assert tree.stop[left] == tree.begin[left + 1]


@given(st.one_of(GRIDDY, COARSE, IN_LINE))
def test_points_on_one_place_have_numbers_in_a_row(places: list[tuple[int, int]]) -> None:
    tree, _ = build_tree(np.array(places, dtype=np.float64))
    xy = in_numbers(tree)
    runs = 1 + int((np.diff(xy, axis=0) != 0).any(axis=1).sum())
    assert runs == len(np.unique(xy, axis=0))


@given(PLACES, st.integers(1, 3), st.integers(0, 9))
def test_what_is_found_is_as_near_as_by_looking_at_all(
    places: list[tuple[int, int]], per_quadrant: int, more: int
) -> None:
    """By quadrant, of the rest, and twins; of the points on another place the first two count."""
    tree, _ = build_tree(np.array(places, dtype=np.float64))
    xy, k = in_numbers(tree), per_quadrant + more
    nearby = allocate_nearby_buffers(k)
    for i in range(len(xy)):
        find_nearby(tree, i, per_quadrant, k, nearby)
        d, own = distances(xy, i), (xy == xy[i]).all(axis=1)
        others, many = np.unique(xy[~own], axis=0, return_counts=True)
        by_quadrant: list[list[float]] = [[], [], [], []]
        for place, count in zip(others, many, strict=True):
            away = place - xy[i]
            by_quadrant[quadrant_of(*away)] += [float((away**2).sum())] * min(2, int(count))
        nearest = [sorted(row)[:per_quadrant] for row in by_quadrant]
        rest = sorted(v for row in by_quadrant for v in sorted(row)[per_quadrant:])
        rest = rest[: max(0, k - sum(map(len, nearest)))]
        for row, expected in enumerate([*nearest, rest]):
            found = nearby.found[row, : len(expected)]
            assert nearby.near[row, : len(expected)].tolist() == expected
            assert d[found].tolist() == expected
        twins = [j for j in nearby.found[TWINS, :MOST_TWINS].tolist() if j >= 0]
        assert len(twins) == min(MOST_TWINS, int(own.sum()) - 1)
        assert all(own[j] and j != i for j in twins)
        assert {j for j in (i - 1, i + 1) if 0 <= j < len(xy) and own[j]} <= set(twins)
        seen = [*nearby.found[:REST].ravel().tolist(), *nearby.found[REST, : len(rest)].tolist(), *twins]
        seen = [j for j in seen if j >= 0]
        assert len(set(seen)) == len(seen)


def test_a_point_apart_finds_those_on_its_place_and_they_find_it() -> None:
    """The start of a path that stands on a hole, and its end on a place where many holes are."""
    xy = np.random.default_rng(1).uniform(0, 50, (60, 2))
    xy[:20] = 7.0
    tree, label = build_tree(np.concatenate([xy, xy[[40]], xy[[0]]]), apart=2)
    on_hole = int(np.flatnonzero(label == 40)[0])
    nearby = allocate_nearby_buffers(8)
    find_nearby(tree, 60, 2, 8, nearby)
    assert nearby.found[TWINS, :MOST_TWINS].tolist() == [on_hole, -1]
    find_nearby(tree, on_hole, 2, 8, nearby)
    assert nearby.found[TWINS, :MOST_TWINS].tolist() == [60, -1]
    find_nearby(tree, 61, 2, 8, nearby)
    assert (label[nearby.found[TWINS, :MOST_TWINS]] < 20).all()


@pytest.mark.parametrize("clustered", ["no", "near", "twins"])
def test_the_nearest_unvisited_is_right_until_none_is_left(clustered: str) -> None:
    rng = np.random.default_rng(3)
    xy = rng.uniform(0, 100, (300, 2))
    if clustered != "no":
        xy[:150] = xy[:150] / 1000.0 if clustered == "near" else xy[150]
    tree, label = build_tree(xy)
    xy = xy[label]
    alive = (tree.stop - tree.begin).astype(np.int32)
    visited, stack = np.zeros(300, dtype=np.uint8), np.zeros(64, dtype=np.int32)
    here = 0
    for _ in range(300):
        visited[here] = 1
        mark_point_visited(tree, alive, here)
        there = nearest_unvisited(tree, alive, visited, here, stack)
        left = np.where(visited == 0, distances(xy, here), np.inf)
        if there < 0:
            assert visited.all()
            return
        assert distances(xy, here)[there] == left.min()
        here = there
