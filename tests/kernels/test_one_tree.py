"""Spanning trees, 1-trees and the sets of the ascent against Kruskal's algorithm and hand calculations."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.one_tree import (
    Graph,
    Sets,
    TreeScratch,
    build_sparse_spanning_tree,
    complete_one_tree,
    join_sets,
    penalty_direction,
    two_cheapest_hub_edges,
)
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order import bound as spanning_tree
from leafcut.order.bound import has_box_bounds, minimum_spanning_tree
from leafcut.order.instance import Instance, build_instance
from plain_python import plain_python
from travel_reference import travel_cost

MACHINE = {"velocity": (250.0, 150.0), "acceleration": (800.0, 300.0), "per_mm": 1e-6}
ZONES = np.array([[20.0, 10.0, 60.0, 40.0], [70.0, 70.0, 75.0, 95.0]])
METRICS = [
    *(Metric(name) for name in ("euclidean", "chebyshev", "manhattan", "EUC_2D", "CEIL_2D", "ATT", "MAX_2D", "MAN_2D")),
    Metric("linear", **MACHINE),
    Metric("dogleg", **MACHINE),
    Metric("linear", **MACHINE, zones=ZONES, lift=0.8),
    Metric("dogleg", **MACHINE, zones=ZONES, lift=0.8),
    Metric("GEO"),
]


@pytest.fixture(autouse=True, scope="module", params=[0, 500], ids=["in rounds", "all pairs"])
def _how_trees_are_grown(request: pytest.FixtureRequest) -> Iterator[None]:
    """Every rule holds for trees of few nodes, made by looking at all pairs, and for those made in rounds."""
    with plain_python(), pytest.MonkeyPatch.context() as patch:  # to compile them takes longer than all cases
        patch.setattr(spanning_tree, "ALL_PAIRS", request.param)
        yield


def kruskal(n: int, edges: list[tuple[float, int, int]]) -> list[tuple[int, int]]:
    """Return the edges of a smallest spanning forest of nodes 0 … n - 1, given (cost, i, j)."""
    part, kept = list(range(n)), []
    for _, i, j in sorted(edges):
        if part[i] != part[j]:
            old, new = part[i], part[j]
            part = [new if p == old else p for p in part]
            kept.append((i, j))
    return kept


def new_work(n: int) -> TreeScratch:
    """Return room for a tree of n nodes."""
    parent, heap, place = (np.zeros(n, dtype=np.int32) for _ in range(3))
    return TreeScratch(parent, np.zeros(n), heap, place, np.zeros(2 * n))


def new_graph(n: int, edges: dict[tuple[int, int], float]) -> Graph:
    """Return a graph of n nodes from the costs of its edges."""
    rows: list[list[tuple[int, float]]] = [[] for _ in range(n)]
    for (i, j), c in edges.items():
        rows[i].append((j, c))
        rows[j].append((i, c))
    begin = np.cumsum([0, *(len(row) for row in rows)]).astype(np.int32)
    flat = [e for row in rows for e in row]
    return Graph(
        begin, np.array([j for j, _ in flat], dtype=np.int32), np.array([c for _, c in flat], dtype=np.float64)
    )


@given(st.integers(2, 40), st.integers(0, 10**6))
def test_the_sparse_tree_weighs_what_kruskals_does(n: int, seed: int) -> None:
    """Whole numbers, so that sums are exact and many edges cost the same."""
    rng = np.random.default_rng(seed)
    edges = {(int(rng.integers(i)), i): float(rng.integers(0, 9)) for i in range(1, n)}
    for _ in range(2 * n):
        i, j = sorted(int(k) for k in rng.integers(0, n, 2))
        if i < j:
            edges[i, j] = float(rng.integers(0, 9))
    penalty = rng.integers(-5, 6, n).astype(float)
    work = new_work(n)
    total = build_sparse_spanning_tree(new_graph(n, edges), penalty, int(rng.integers(n)), work)
    cost = {e: c + penalty[e[0]] + penalty[e[1]] for e, c in edges.items()}
    assert total == sum(cost[e] for e in kruskal(n, [(c, *e) for e, c in cost.items()]))
    ends = [tuple(sorted((i, int(p)))) for i, p in enumerate(work.parent) if p >= 0]
    assert len(kruskal(n, [(0.0, *e) for e in ends])) == len(ends) == n - 1
    assert sum(cost[e] for e in ends) == total


@given(st.integers(4, 40), st.integers(0, len(METRICS) - 1), st.integers(0, 10**6), st.booleans())
def test_the_smallest_tree_of_all_pairs_weighs_what_kruskals_does(n: int, kind: int, seed: int, griddy: bool) -> None:
    """By the k-d tree or by looking at all pairs, with twins, with a hub that is left out; costs by the reference."""
    rng = np.random.default_rng(seed)
    xy = rng.integers(0, 8, (n, 2)) * 11.0 if griddy else rng.uniform(0, 90, (n, 2))
    instance = build_instance(RoutingProblem.of_points(xy, METRICS[kind], closed=True), 3)
    hub, penalty = int(rng.integers(n)), rng.normal(0, 20, n) * float(rng.integers(0, 2))
    tree = minimum_spanning_tree(instance, hub, penalty, new_graph(n, {}), lambda: False)
    cost = reference_costs(instance) + penalty[:, None] + penalty[None, :]
    pairs = [(cost[i, j], i, j) for i in range(n) for j in range(i) if hub not in (i, j)]
    least = sum(cost[e] for e in kruskal(n, pairs))
    assert tree is not None
    ends = [(int(a), int(b)) for a, b in tree.edges.T]
    assert sum(cost[e] for e in ends) == pytest.approx(least, rel=1e-9, abs=1e-9)
    assert len(kruskal(n, [(0.0, *e) for e in ends])) == len(ends) == n - 2
    assert hub not in tree.edges


def reference_costs(instance: Instance) -> np.ndarray:
    """Return the costs between the nodes of an instance without extra nodes, by the plain reference."""
    places, metric = instance.cost.xy, instance.problem.metric
    return np.array([[travel_cost(metric, tuple(p), tuple(q)) for q in places] for p in places])


def test_edges_of_a_graph_that_are_known_change_nothing_in_the_tree() -> None:
    xy = np.random.default_rng(4).uniform(0, 100, (80, 2))
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 3)
    penalty = np.random.default_rng(5).normal(0, 9, 80)
    places = instance.cost.xy
    some = {
        (i, j): math.dist(places[i], places[j]) for i, j in np.random.default_rng(6).integers(0, 79, (60, 2)) if i < j
    }
    trees = [minimum_spanning_tree(instance, 79, penalty, new_graph(80, e), lambda: False) for e in ({}, some)]
    assert all(t is not None for t in trees)
    one, two = ({tuple(sorted(e)) for e in t.edges.T.tolist()} for t in trees if t is not None)
    assert one == two


def test_a_tree_that_needs_too_many_looks_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spanning_tree, "ALL_PAIRS", 0)
    monkeypatch.setattr(spanning_tree, "MOST_LOOKS", 50)
    monkeypatch.setattr(spanning_tree, "MOST_LOOKS_PER_NODE", 0)
    instance = build_instance(
        RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 9, (200, 2)), closed=True), 3
    )
    assert minimum_spanning_tree(instance, 0, np.zeros(200), new_graph(200, {}), lambda: False) is None


def test_only_costs_that_grow_with_distance_are_searched_by_boxes() -> None:
    xy = np.random.default_rng(1).uniform(0, 9, (5, 2))
    plane = {m.name: has_box_bounds(build_instance(RoutingProblem.of_points(xy, m), 3).cost) for m in METRICS}
    assert [name for name, flat in plane.items() if not flat] == ["GEO"]
    assert not has_box_bounds(build_instance(RoutingProblem.of_points(xy, Metric(zones=ZONES, lift=-1.0)), 3).cost)


@given(st.lists(st.integers(-9, 9), min_size=4, max_size=12), st.integers(0, 3), st.booleans())
def test_the_two_cheapest_edges_of_the_hub_are_taken_and_the_tied_one_always(
    penalty: list[int], hub: int, tie: bool
) -> None:
    spokes = np.arange(len(penalty), dtype=np.float64) % 5
    cost = {j: spokes[j] + p for j, p in enumerate(penalty) if j != hub}
    tied = (hub + 1) % len(penalty) if tie else -1
    a, b = two_cheapest_hub_edges(spokes, np.array(penalty, dtype=np.float64), hub, tied)
    assert a != b
    if tie:
        assert a == tied
        assert cost[b] == min(c for j, c in cost.items() if j != tied)
    else:
        assert [cost[a], cost[b]] == sorted(cost.values())[:2]


def test_the_excess_of_a_one_tree_is_its_degrees_less_two() -> None:
    """A star of 0 with 1, 2, 3, and hub 4 at 1 and 2: degrees 3, 2, 2, 1; the edges of the hub cost 5 + 6."""
    work = new_work(5)
    work.parent[:4] = [-1, 0, 0, 0]
    added = complete_one_tree(np.array([9.0, 5.0, 6.0, 7.0, 0.0]), 4, -1, 0, np.zeros(5), work)
    assert added == 11.0
    assert work.excess[:5].tolist() == [1.0, 0.0, 0.0, -1.0, 0.0]


def test_sets_have_the_room_between_the_gap_inside_and_the_gap_outside() -> None:
    """Nodes at 0, 1, 11, 12 on a line: two pairs of gap 1, 10 apart, so a pair has 9 of room and a node has 1."""
    n, sets = 5, Sets(np.zeros(10, dtype=np.int32), np.zeros(10, dtype=np.int32), np.zeros(10))
    a, b = np.array([0, 2, 1], dtype=np.int32), np.array([1, 3, 2], dtype=np.int32)
    join_sets(a, b, np.array([1.0, 1.0, 10.0]), n, np.zeros(10, dtype=np.int32), np.zeros(10), np.zeros(10), sets)
    assert sets.width[:8].tolist() == [1.0, 1.0, 1.0, 1.0, 0.0, 9.0, 9.0, 0.0]
    assert [sorted((int(sets.left[s]), int(sets.right[s]))) for s in (5, 6, 7)] == [[0, 1], [2, 3], [5, 6]]
    # The path 0 – 1 – 2 – 3 with its ends open: nodes 0 and 3 lack an edge, so do the pairs.
    excess = np.array([-1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert penalty_direction(sets, n, excess) == 2 * 1.0 + 2 * 9.0
    assert excess[:5].tolist() == [-10.0, -9.0, -9.0, -10.0, 0.0]
