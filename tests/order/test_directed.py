"""Arrays of directed paths: lists hold exactly the possible neighbours, and costs agree with the problem."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from leafcut.errors import SolveError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order import directed
from leafcut.order.annealing import build_clusters
from leafcut.order.directed import build_directed_instance, cheapest_move_costs, is_directed
from leafcut.order.instance import path_cost
from travel_reference import travel_cost

M = 8
START, END = (1.0, 2.0), (30.0, 5.0)
ENDS = [(None, None), (START, None), (None, END), (START, END)]
KINDS = ["holes", "cuts", "ways", "table", "table of ways"]

#: 1 before 4 before 6, 1 before 6 follows; 3 before 0.
PAIRS = [(1, 4), (4, 6), (1, 6), (3, 0)]


def problem_of(
    kind: str, ends: tuple[object, object] | None = (None, None), pairs: list[tuple[int, int]] | None = None
) -> RoutingProblem:
    """Return eight clusters, of 1 to 3 nodes each if the kind has alternatives; a closed path if `ends` is None."""
    rng = np.random.default_rng(3)
    cluster = np.repeat(np.arange(M), rng.integers(1, 4, M)) if "ways" in kind else np.arange(M)
    n = len(cluster)
    entry, leave = rng.uniform(0, 40, (n, 2)), rng.uniform(0, 40, (n, 2))
    metric = Metric("linear", (40.0, 20.0), (90.0, 70.0))
    if "table" in kind:
        metric, ends = Metric("EXPLICIT", matrix=rng.uniform(1, 40, (n, n))), ends and (None, None)
    return RoutingProblem(
        entry,
        leave if kind in ("cuts", "ways") else entry,
        rng.permutation(cluster).astype(np.int32),
        rng.uniform(0, 5, n),
        metric,
        np.array(pairs or [], dtype=np.int32).reshape(-1, 2),
        start=ends and ends[0],
        end=ends and ends[1],
        closed=ends is None,
    )


def way(problem: RoutingProblem, a: int, b: int) -> float:
    """Return the cost of the travel from node a to node b, by the plain reference."""
    if problem.metric.matrix is not None:
        return float(problem.metric.matrix[a, b])
    return travel_cost(problem.metric, tuple(problem.exit[a]), tuple(problem.entry[b]))


def cheapest(problem: RoutingProblem, a: int, b: int) -> float:
    """Return the cost of the cheapest travel from cluster a to cluster b; cluster M is the anchor."""
    one, two = (np.flatnonzero(problem.cluster == c).tolist() for c in (a, b))
    if a == M:
        start = problem.start
        return min(0.0 if start is None else travel_cost(problem.metric, start, tuple(problem.entry[v])) for v in two)
    if b == M:
        end = problem.end
        return min(0.0 if end is None else travel_cost(problem.metric, tuple(problem.exit[v]), end) for v in one)
    return min(way(problem, v, w) for v in one for w in two)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ends", [None, *ENDS])
def test_the_table_of_least_costs_is_that_of_trying_all_nodes(kind: str, ends: tuple[object, object] | None) -> None:
    problem = problem_of(kind, ends)
    table = cheapest_move_costs(problem)
    n = M if ends is None else M + 1
    assert table is not None
    assert table.shape == (n, n)
    for a, b in itertools.permutations(range(n), 2):
        assert table[a, b] == pytest.approx(cheapest(problem, a, b)), (a, b)


def possible(problem: RoutingProblem, a: int, b: int, closure: bool) -> bool:
    """Return whether b may follow a at once, by the given pairs or by all that follows from them."""
    given = {(int(x), int(y)) for x, y in problem.precedence}
    if a == M:  # the anchor comes first
        return not any(y == b for _, y in given)
    if b == M:
        return not any(x == a for x, _ in given)
    if not closure:
        return (b, a) not in given
    # PAIRS states all that follows from it, so one step between two clusters is enough.
    return (b, a) not in given and not any((a, c) in given and (c, b) in given for c in range(M))


@pytest.mark.parametrize("closure", [True, False])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ends", [None, *ENDS])
def test_lists_hold_all_possible_neighbours_the_cheapest_first(
    kind: str, ends: tuple[object, object] | None, closure: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forward and back; with and without the consequences of pairs, which are worked out for few clusters only."""
    if not closure:
        monkeypatch.setattr(directed, "CLOSURE_LIMIT", 2)
    problem = problem_of(kind, ends, PAIRS)
    instance = build_directed_instance(problem, M - 1)
    lists, n = instance.rules.onward, instance.n
    assert n == (M if ends is None else M + 1)
    assert instance.anchored == (ends is not None)
    for v in range(n):
        for near, costs, back in ((lists.near, lists.near_cost, False), (lists.back, lists.back_cost, True)):
            arcs = [(w, v) if back else (v, w) for w in range(n) if w != v]
            cost = {w if a == v else a: cheapest(problem, a, w) for a, w in arcs if possible(problem, a, w, closure)}
            if v == M and not any(cost.values()):
                cost = {}  # leaving or coming back to the anchor is free everywhere: all are equal
            listed = [w for w in near[v].tolist() if w >= 0]
            assert sorted(listed) == sorted(cost), (v, back)
            assert costs[v, : len(listed)].tolist() == pytest.approx([cost[w] for w in listed])
            assert sorted(costs[v].tolist()) == costs[v].tolist()
            assert all(math.isinf(c) for c in costs[v, len(listed) :])
            assert (near[v, len(listed) :] == -1).all()
    backward = instance.rules.backward
    for one, two in zip(
        (backward.near, backward.near_cost, backward.back, backward.back_cost),
        (lists.back, lists.back_cost, lists.near, lists.near_cost),
        strict=True,
    ):
        assert np.array_equal(one, two)


@pytest.mark.parametrize("pairs", [[], PAIRS])
@pytest.mark.parametrize("kind", KINDS)
def test_short_lists_are_the_first_of_the_long_ones(kind: str, pairs: list[tuple[int, int]]) -> None:
    """Where all costs are compared, three candidates are the cheapest three that are possible."""
    if kind in ("holes", "cuts"):
        return  # candidates of places are also chosen by direction
    problem = problem_of(kind, None, pairs)
    short, long = (build_directed_instance(problem, k).rules.onward for k in (3, M - 1))
    assert short.near.shape == (M, 3)
    for few, many in ((short.near, long.near), (short.back, long.back)):
        assert np.array_equal(few, many[:, :3])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ends", [None, *ENDS])
@pytest.mark.parametrize("pairs", [[], PAIRS])
def test_a_path_has_its_cost_and_its_nodes_in_both_forms(
    kind: str, ends: tuple[object, object] | None, pairs: list[tuple[int, int]]
) -> None:
    problem = problem_of(kind, ends, pairs)
    instance, rng = build_directed_instance(problem, 5), np.random.default_rng(1)
    for _ in range(5):
        order = rng.permutation(M)
        nodes = np.array([rng.choice(np.flatnonzero(problem.cluster == c)) for c in order], dtype=np.int32)
        node, enter = instance.path_from_nodes(nodes)
        leave = enter + np.int32(instance.rules.beyond[0])
        if instance.anchored:
            assert node[0] == M
            leave[M] = instance.leave[M]
        assert instance.length(node, enter, leave) == pytest.approx(path_cost(problem, nodes))
        first = int(np.flatnonzero(order == 0)[0]) if ends is None and not pairs else 0
        assert instance.nodes_from_path(node, enter).tolist() == np.roll(nodes, -first).tolist()


def test_costs_by_direction_are_seen_in_tables_and_in_places() -> None:
    symmetric = np.array([[0.0, 1.0], [1.0, 0.0]])
    two = np.array([[0.0, 0.0], [3.0, 4.0]])
    assert not is_directed(RoutingProblem.of_points(two, Metric("EXPLICIT", matrix=symmetric)))
    assert is_directed(RoutingProblem.of_points(two, Metric("EXPLICIT", matrix=np.triu(symmetric))))
    assert not is_directed(RoutingProblem.of_points(two))
    assert is_directed(problem_of("cuts"))


def test_lists_by_the_middles_of_clusters_name_the_nearest_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Too many nodes to compare all: eight pairs of places along a line, so the neighbours on the line are near."""
    monkeypatch.setattr(directed, "DENSE_LIMIT", 0)
    where = np.random.default_rng(2).permutation(M)
    entry = np.repeat(np.stack([10.0 * where, np.zeros(M)], axis=1), 2, axis=0) + np.tile(
        [[0.0, 1.0], [0.0, -1.0]], (M, 1)
    )
    exit_ = entry * (1.0, -1.0)  # each may be worked in two directions
    problem = RoutingProblem(entry, exit_, np.repeat(np.arange(M, dtype=np.int32), 2), np.zeros(2 * M), closed=True)
    lists = build_directed_instance(problem, 3).rules.onward
    for c in range(M):
        nearest = sorted(abs(int(where[c]) - int(where[w])) for w in range(M) if w != c)[:2]
        assert sorted(abs(int(where[c]) - int(where[w])) for w in lists.near[c].tolist() if w >= 0)[:2] == nearest
        assert c not in lists.near[c]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ends", [None, *ENDS])
@pytest.mark.parametrize("pairs", [[], PAIRS])
def test_layers_hold_the_costs_of_all_moves_with_the_work_at_their_end(
    kind: str, ends: tuple[object, object] | None, pairs: list[tuple[int, int]]
) -> None:
    """The nodes by cluster, then the anchor: a move from it starts at the start, a move to it ends at the end."""
    problem = problem_of(kind, ends, pairs)
    instance = build_directed_instance(problem, 5)
    layers, m = build_clusters(instance), M if ends is None else M + 1
    nodes = sorted(range(problem.n_nodes), key=lambda v: (problem.cluster[v], v))
    owner = [int(problem.cluster[v]) for v in nodes] + [M] * (m - M)
    assert layers.owner.tolist() == owner
    assert layers.begin.tolist() == [owner.index(c) for c in range(m)] + [len(owner)]
    assert layers.anchored.tolist() == [m - M]

    def cost(a: int, b: int) -> float:
        if owner[b] == M:
            free = owner[a] == M or problem.end is None
            return 0.0 if free else travel_cost(problem.metric, tuple(problem.exit[nodes[a]]), problem.end)
        work = float(problem.service[nodes[b]])
        if owner[a] < M:
            return work + way(problem, nodes[a], nodes[b])
        entry = tuple(problem.entry[nodes[b]])
        return work if problem.start is None else work + travel_cost(problem.metric, problem.start, entry)

    for a, b in itertools.permutations(range(len(owner)), 2):
        assert layers.table[a, b] == pytest.approx(cost(a, b)), (a, b)
    assert np.array_equal(layers.back, layers.table.T)
    for c, d in itertools.permutations(range(m), 2):
        ones, others = ([k for k, o in enumerate(owner) if o == x] for x in (c, d))
        assert layers.least[c, d] == min(layers.table[a, b] for a in ones for b in others)
    assert np.isinf(layers.least.diagonal()).all()
    assert np.array_equal(layers.least_back, layers.least.T)
    for c in range(m):
        near = [min(layers.least[c, d], layers.least[d, c]) for d in layers.near[c]]
        assert sorted(layers.near[c].tolist()) == sorted({*range(m)} - {c})
        assert near == sorted(near)
    follow = {(1, 4), (1, 6), (4, 6), (3, 0)} if pairs else set()
    for begin, partner, turned in (
        (layers.after_begin, layers.after, False),
        (layers.before_begin, layers.before, True),
    ):
        found = {(c, int(d)) for c in range(m) for d in partner[begin[c] : begin[c + 1]]}
        assert found == ({(b, a) for a, b in follow} if turned else follow)


@pytest.mark.parametrize("kind", ["holes", "cuts"])
@pytest.mark.parametrize("ends", [None, *ENDS])
def test_the_places_of_a_path_are_its_entries_and_exits_with_the_ends(
    kind: str, ends: tuple[object, object] | None
) -> None:
    problem = problem_of(kind, ends)
    instance, nodes = build_directed_instance(problem, 5), np.array([3, 1, 0, 2, 7, 6, 5, 4], dtype=np.int32)
    assert instance.cluster_order(nodes).tolist() == problem.cluster[nodes].tolist()
    assert (instance.service, instance.exact) == (0.0, True)
    places = [problem.entry[nodes].tolist()]
    if kind == "cuts":
        places.append(problem.exit[nodes].tolist())
    path = [place for row in zip(*places, strict=True) for place in row]
    first, last = ([], [path[0]]) if ends is None else ([list(p)] if p is not None else [] for p in ends)  # type: ignore
    assert instance.path_positions(nodes).tolist() == [*first, *path, *last]


def test_a_table_with_ends_is_refused_in_one_line() -> None:
    table = replace(problem_of("table"), start=START)
    for work in (lambda: build_directed_instance(table, 5), lambda: cheapest_move_costs(table)):
        with pytest.raises(SolveError) as refused:
            work()
        assert (
            str(refused.value) == "a cost table has no costs to or from a point; leave out the start and the end point"
        )


def test_least_costs_are_given_up_when_it_is_late() -> None:
    asked: list[bool] = []
    assert cheapest_move_costs(problem_of("ways"), lambda: bool(asked.append(True)) or len(asked) == 8) is None
    assert len(asked) == 8
    assert cheapest_move_costs(problem_of("ways"), lambda: False) is not None
