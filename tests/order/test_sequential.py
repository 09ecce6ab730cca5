"""Paths with a direction: precedence is always kept, costs are true, and small problems are solved to the optimum."""

from __future__ import annotations

import itertools
import math
import re
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import SolveError
from leafcut.kernels.route import Route
from leafcut.model.heartbeat import Progress
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order import path_search
from leafcut.order.directed import DirectedInstance, build_directed_instance, greedy_path
from leafcut.order.exact import choose_nodes_for_order
from leafcut.order.instance import path_cost
from leafcut.order.literature import choices
from leafcut.order.path_search import PathSearch
from leafcut.order.precedence import impossible_moves_and_reduction, satisfies_pairs
from leafcut.order.search import Best
from leafcut.order.solve import keep_better, solve
from leafcut.order.stop import Stop
from travel_reference import travel_cost

METRICS = [Metric(), Metric("linear", (40.0, 20.0), (90.0, 70.0)), Metric("dogleg", (40.0, 20.0), (90.0, 70.0))]
ENDS = [(None, None), ((1.0, 2.0), None), (None, (30.0, 5.0)), ((1.0, 2.0), (30.0, 5.0)), "closed"]
KINDS = ["holes", "cuts", "ways", "table", "table of ways"]


def random_problem(seed: int, m: int, kind: str, ends: object = (None, None), pairs: int = 3) -> RoutingProblem:
    """Return m clusters in general position, or on few places when the seed is odd, with up to `pairs` pairs."""
    rng = np.random.default_rng(seed)
    cluster = np.arange(m, dtype=np.int32)
    if "ways" in kind:
        cluster = np.sort(np.concatenate([cluster, rng.integers(0, m, m)])).astype(np.int32) if m else cluster
    n = len(cluster)
    entry, leave = (rng.integers(0, 40, (n, 2)) if seed % 2 else rng.uniform(0, 40, (n, 2)) for _ in range(2))
    metric = METRICS[seed % 3]
    if "table" in kind:
        metric, ends = (
            Metric("EXPLICIT", matrix=rng.uniform(0, 40, (n, n))),
            "closed" if ends == "closed" else (None, None),
        )
    hidden = rng.permutation(m)
    chosen = [hidden[np.sort(rng.choice(m, 2, replace=False))] for _ in range(pairs if m > 1 else 0)]
    return RoutingProblem(
        entry=entry.astype(float),
        exit=(leave if kind in ("cuts", "ways") else entry).astype(float),
        cluster=cluster,
        service=rng.uniform(0, 5, n),
        metric=metric,
        precedence=np.array(chosen, dtype=np.int32).reshape(-1, 2),
        start=None if ends == "closed" else ends[0],
        end=None if ends == "closed" else ends[1],
        closed=ends == "closed",
    )


def added_up(problem: RoutingProblem, nodes: np.ndarray) -> float:
    """Return the cost of a path, way by way, by the plain reference."""
    total = float(problem.service[nodes].sum())
    if problem.metric.matrix is not None:
        total += sum(problem.metric.matrix[a, b] for a, b in itertools.pairwise(nodes))
        return total + (problem.metric.matrix[nodes[-1], nodes[0]] if problem.closed and len(nodes) else 0.0)
    ways = [(tuple(problem.exit[a]), tuple(problem.entry[b])) for a, b in itertools.pairwise(nodes)]
    if problem.closed and len(nodes):
        ways.append((tuple(problem.exit[nodes[-1]]), tuple(problem.entry[nodes[0]])))
    if not len(nodes) and problem.start is not None and problem.end is not None:
        ways.append((problem.start, problem.end))
    if problem.start is not None and len(nodes):
        ways.append((problem.start, tuple(problem.entry[nodes[0]])))
    if problem.end is not None and len(nodes):
        ways.append((tuple(problem.exit[nodes[-1]]), problem.end))
    return total + sum(travel_cost(problem.metric, a, b) for a, b in ways)


def orders(problem: RoutingProblem) -> Iterator[np.ndarray]:
    """Yield every order of the clusters that keeps the precedence, grown cluster by cluster."""
    before: dict[int, set[int]] = {c: set() for c in range(problem.n_clusters)}
    for a, b in problem.precedence.tolist():
        before[b].add(a)

    def grow(done: tuple[int, ...]) -> Iterator[np.ndarray]:
        if len(done) == len(before):
            yield np.array(done, dtype=np.int32)
        for c in before.keys() - set(done):
            if before[c] <= set(done):
                yield from grow((*done, c))

    return grow(())


def least(problem: RoutingProblem) -> float:
    """Return the cost of the best path of all, by dynamic programming over what has been visited."""
    layer: dict[tuple[int, int, int], float] = {}
    m, members = problem.n_clusters, [np.flatnonzero(problem.cluster == c).tolist() for c in range(problem.n_clusters)]
    needs = [sum({1 << int(a) for a, b in problem.precedence if b == c}) for c in range(m)]

    def way(a: int, b: int) -> float:
        if problem.metric.matrix is not None:
            return float(problem.metric.matrix[a, b])
        return travel_cost(problem.metric, tuple(problem.exit[a]), tuple(problem.entry[b]))

    def outside(node: int, place: tuple[float, float] | None, side: np.ndarray) -> float:
        return 0.0 if place is None or problem.closed else travel_cost(problem.metric, place, tuple(side[node]))

    ways = {(a, b): way(a, b) for a in range(problem.n_nodes) for b in range(problem.n_nodes)}
    for c in range(m):
        for node in members[c] if not needs[c] else []:
            first = node if problem.closed else -1
            layer[first, 1 << c, node] = problem.service[node] + outside(node, problem.start, problem.entry)
    for _ in range(m - 1):
        following: dict[tuple[int, int, int], float] = {}
        for (first, seen, a), so_far in layer.items():
            for c in range(m):
                if seen >> c & 1 or needs[c] & ~seen:
                    continue
                for b in members[c]:
                    key, value = (first, seen | 1 << c, b), so_far + ways[a, b] + float(problem.service[b])
                    following[key] = min(following.get(key, math.inf), value)
        layer = following
    return min(
        value + (ways[a, first] if problem.closed else outside(a, problem.end, problem.exit))
        for (first, _, a), value in layer.items()
    )


def check(problem: RoutingProblem, nodes: np.ndarray, cost: float) -> None:
    """Check that every cluster is visited once, that all pairs are kept, and that the cost is the true one."""
    order = problem.cluster[nodes]
    assert sorted(order.tolist()) == list(range(problem.n_clusters))
    place = np.argsort(order)
    assert all(place[a] < place[b] for a, b in problem.precedence)
    assert cost == pytest.approx(added_up(problem, nodes))
    assert cost == pytest.approx(path_cost(problem, nodes))


@pytest.mark.parametrize(
    ("problems", "clusters", "most_missed"), [(2, 5, 0), pytest.param(12, 8, 1, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("kind", KINDS)
def test_the_default_preset_finds_the_optimum_of_few_clusters(
    kind: str, problems: int, clusters: int, most_missed: int
) -> None:
    """Random problems with 5 to `clusters` clusters, compared with dynamic programming."""
    missed = []
    for seed in range(problems):
        problem = random_problem(seed, min(5 + seed % 4, clusters), kind, ENDS[seed % 5], pairs=seed % 6)
        found = solve(problem, SolveOptions("colony", bound=False))
        check(problem, found.nodes, found.cost)
        best = least(problem)
        assert found.cost >= best - 1e-9
        if found.cost > best * (1 + 1e-9):
            missed.append((seed, found.cost / best))
    assert len(missed) <= most_missed, missed
    assert all(ratio < 1.1 for _, ratio in missed), missed


@given(
    st.integers(0, 10_000),
    st.integers(0, 30),
    st.sampled_from(KINDS),
    st.sampled_from(ENDS),
    st.sampled_from([0, 1, 9, 60]),
)
def test_every_answer_keeps_precedence_visits_every_cluster_and_states_its_cost(
    seed: int, m: int, kind: str, ends: object, pairs: int
) -> None:
    problem = random_problem(seed, m, kind, ends, pairs)
    found = solve(problem, SolveOptions("colony", iterations=2, seed=seed))
    check(problem, found.nodes, found.cost)
    costs = [cost for _, cost in found.history]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(found.cost)
    assert found.lower_bound is None or found.lower_bound <= found.cost


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n", [0, 1, 2, 3, 4, 5, 6])
def test_few_clusters_on_one_place_are_no_trouble(kind: str, n: int) -> None:
    for closed in (False, True):
        problem = random_problem(2, n, kind, "closed" if closed else (None, None), pairs=n // 2)
        flat = RoutingProblem(
            np.ones_like(problem.entry),
            np.ones_like(problem.exit),
            problem.cluster,
            problem.service,
            Metric("EXPLICIT", matrix=np.ones((problem.n_nodes, problem.n_nodes))) if "table" in kind else Metric(),
            problem.precedence,
            closed=closed,
        )
        found = solve(flat, SolveOptions(preset="fast"))
        check(flat, found.nodes, found.cost)


def test_a_path_without_clusters_costs_the_move_from_start_to_end() -> None:
    nothing = np.zeros((0, 2))
    problem = RoutingProblem(
        nothing, nothing, np.zeros(0, dtype=np.int32), np.zeros(0), start=(1.0, 2.0), end=(4.0, 6.0)
    )
    assert solve(problem).cost == path_cost(problem, np.zeros(0, dtype=np.int32)) == 5.0


def test_an_order_that_is_forced_is_found() -> None:
    """Pairs from end to end leave one order; another cluster may stand anywhere."""
    pairs = np.array([[k + 1, k] for k in range(30)], dtype=np.int32)
    problem = RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 9, (31, 2)), precedence=pairs)
    found = solve(problem, SolveOptions(preset="fast"))
    assert found.nodes.tolist() == list(range(30, -1, -1))


def test_cuts_along_a_line_are_worked_in_the_direction_they_have() -> None:
    """Ten cuts from x = k to x = k + 1: entered in turn they need no travel, whatever the order of the drawing."""
    where = np.random.default_rng(3).permutation(10).astype(float)
    entry, leave = (np.stack([where + d, np.zeros(10)], axis=1) for d in (0.0, 1.0))
    problem = RoutingProblem(entry, leave, np.arange(10, dtype=np.int32), np.zeros(10))
    found = solve(problem, SolveOptions(preset="fast"))
    assert found.cost == 0.0
    assert where[found.nodes].tolist() == list(range(10))


def test_the_same_seed_gives_the_same_answer_whatever_the_threads() -> None:
    problem = random_problem(4, 40, "cuts", ENDS[1], pairs=15)
    answers = [solve(problem, SolveOptions(iterations=2, threads=t, seed=9)) for t in (1, 3)]
    assert np.array_equal(answers[0].nodes, answers[1].nodes)
    assert answers[0].history[-1][1] == answers[1].history[-1][1]
    other = solve(problem, SolveOptions(iterations=1, seed=10))
    check(problem, other.nodes, other.cost)


@pytest.mark.parametrize(
    "pairs, words",
    [
        ([[3, 3]], "cluster 3 must come before itself"),
        ([[1, 4], [4, 1]], "cluster 4 must come before cluster 1, and cluster 1 before cluster 4:"),
        ([[0, 1], [1, 2], [2, 5], [5, 1]], r"cluster \d must come before cluster \d, .* \(via 1 more\)"),
        ([[2, 9]], r"pair \(2, 9\): clusters are numbered 0 to 5"),
        ([[0, 1], [2, 9]], r"pair \(2, 9\)"),
        ([[-1, 2]], r"pair \(-1, 2\)"),
    ],
)
@pytest.mark.parametrize("algorithm", ["auto", "none"])
def test_precedence_that_no_order_can_keep_is_refused_in_one_line(
    pairs: list[list[int]], words: str, algorithm: str
) -> None:
    problem = RoutingProblem.of_points(np.zeros((6, 2)), precedence=np.array(pairs, dtype=np.int32))
    with pytest.raises(SolveError, match=words) as refused:
        solve(problem, SolveOptions(algorithm=algorithm))
    assert "\n" not in str(refused.value)


def test_the_clusters_named_of_a_ring_are_both_on_it_and_one_before_the_other() -> None:
    pairs = np.array([[0, 1], [1, 2], [2, 5], [5, 1], [5, 3]], dtype=np.int32)
    problem = RoutingProblem.of_points(np.zeros((6, 2)), precedence=pairs)
    with pytest.raises(SolveError) as refused:
        solve(problem, SolveOptions())
    first, last = (int(word) for word in re.findall(r"cluster (\d)", str(refused.value))[:2])
    assert [first, last] in pairs.tolist()
    assert {first, last} <= {1, 2, 5}


def test_the_order_as_drawn_is_refused_where_it_breaks_precedence() -> None:
    problem = RoutingProblem.of_points(np.zeros((6, 2)), precedence=np.array([[4, 1]], dtype=np.int32))
    with pytest.raises(SolveError, match="has cluster 1 before cluster 4, which must come first"):
        solve(problem, SolveOptions(algorithm="none"))
    kept = RoutingProblem.of_points(np.zeros((6, 2)), precedence=np.array([[1, 4]], dtype=np.int32))
    assert solve(kept, SolveOptions(algorithm="none")).nodes.tolist() == list(range(6))


def test_a_cheaper_order_from_elsewhere_is_not_taken_when_it_breaks_precedence() -> None:
    line = np.array([[float(k), 0.0] for k in range(6)])
    problem = RoutingProblem.of_points(line, start=(0.0, 0.0), precedence=np.array([[5, 0]], dtype=np.int32))
    found = solve(problem, SolveOptions(preset="fast"))
    assert np.array_equal(keep_better(problem, found, np.arange(6, dtype=np.int32)).nodes, found.nodes)


def test_a_table_of_costs_with_a_place_to_start_from_is_refused() -> None:
    metric = Metric("EXPLICIT", matrix=np.random.default_rng(1).uniform(0, 1, (6, 6)))
    with pytest.raises(SolveError, match="leave out the start and the end point"):
        solve(RoutingProblem.of_points(np.zeros((6, 2)), metric, start=(0.0, 0.0)), SolveOptions())


def test_the_bound_leaves_precedence_out_and_is_never_above_the_optimum() -> None:
    for seed in range(0, 25, 3):  # every kind, and all ends
        problem = random_problem(seed, 6, KINDS[seed % 5], ENDS[seed // 5], pairs=4)
        found = solve(problem, SolveOptions("colony", preset="fast"))
        assert found.lower_bound is not None
        assert found.lower_bound <= least(problem) + 1e-9
        free = RoutingProblem(
            problem.entry,
            problem.exit,
            problem.cluster,
            problem.service,
            problem.metric,
            start=problem.start,
            end=problem.end,
            closed=problem.closed,
        )
        assert found.lower_bound <= least(free) + 1e-9


def test_a_search_that_is_stopped_or_interrupted_keeps_the_best_that_it_has() -> None:
    problem, seen = random_problem(2, 80, "cuts", ENDS[1], pairs=30), []
    cancelled = threading.Event()

    def press(progress: Progress) -> None:
        seen.append(progress.cost)
        if len(seen) == 3:
            cancelled.set()

    found = solve(problem, SolveOptions(iterations=10_000), progress=press, cancelled=cancelled)
    check(problem, found.nodes, found.cost)
    assert found.stopped_early
    assert found.cost <= min(seen) + 1e-9

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    found = solve(problem, SolveOptions(iterations=10_000), progress=interrupt)
    check(problem, found.nodes, found.cost)
    assert found.stopped_early


def test_stopping_at_once_still_gives_a_whole_path() -> None:
    cancelled = threading.Event()
    cancelled.set()
    problem = random_problem(2, 80, "cuts", ENDS[3], pairs=40)
    found = solve(problem, SolveOptions(), cancelled=cancelled)
    check(problem, found.nodes, found.cost)


@pytest.mark.parametrize("kind", KINDS)
def test_the_search_knows_what_its_path_costs_and_never_loses_the_best(kind: str) -> None:
    """The gains that kernels report are added up over hot and cold times, and compared with the path itself."""
    problem = random_problem(6, 60, kind, "closed" if "table" in kind else ENDS[1], pairs=30)
    instance = build_directed_instance(problem, 16)
    search = PathSearch(instance, 3, Best(Stop()))
    for kicks in (300, 300, 800):
        search.run(search.kicks + kicks, greedy_path(instance))
        route = search.route
        assert sorted(route.node.tolist()) == list(range(instance.n))
        assert np.array_equal(route.place[route.node], np.arange(instance.n))
        assert search.cost == pytest.approx(instance.length(route.node, route.enter, route.leave))
        check(problem, instance.nodes_from_path(route.node, route.enter), search.cost)
        assert search.best.cost <= search.cost + 1e-9
        check(problem, search.best.tour, search.best.cost)


def test_the_first_path_keeps_precedence() -> None:
    for seed in range(10):
        problem = random_problem(seed, 50, KINDS[seed % 4], ENDS[seed % 5], pairs=120)
        instance = build_directed_instance(problem, 12)
        route = greedy_path(instance)
        check(
            problem,
            instance.nodes_from_path(route.node, route.enter),
            instance.length(route.node, route.enter, route.leave),
        )


@pytest.mark.parametrize("size", [25, 300])
def test_the_first_path_is_laid_once_for_ants_and_kicks(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    laid: list[int] = []

    def counted(instance: DirectedInstance) -> Route:
        laid.append(instance.n)
        return greedy_path(instance)

    problem = random_problem(1, size, "cuts", ENDS[3], pairs=4)
    for room in (path_search, choices):
        monkeypatch.setattr(room, "greedy_path", counted)
    solve(problem, SolveOptions(iterations=1, bound=False))
    assert len([n for n in laid if size <= n <= size + 2]) == 1  # the other call is for the compilation


def test_what_follows_from_pairs_is_found_by_looking_at_all_orders() -> None:
    for seed in range(5):
        problem = random_problem(2 * seed, 6, "holes", pairs=5)
        barred, pairs = impossible_moves_and_reduction(np.unique(problem.precedence, axis=0), 6)
        every = list(orders(problem))
        straight = {(int(a), int(b)) for order in every for a, b in itertools.pairwise(order)}
        assert straight == {(a, b) for a in range(6) for b in range(6) if a != b and not barred[a, b]}
        everything = [np.array(o, dtype=np.int32) for o in itertools.permutations(range(6))]
        assert len(every) == sum(satisfies_pairs(pairs, order) for order in everything)


def test_candidates_are_the_cheapest_of_every_direction_where_all_are_listed() -> None:
    problem = random_problem(4, 12, "cuts", ENDS[3], pairs=0)
    lists = build_directed_instance(problem, 11).rules.onward
    for i in range(12):
        costs = {
            j: travel_cost(problem.metric, tuple(problem.exit[i]), tuple(problem.entry[j])) for j in range(12) if j != i
        }
        costs[12] = travel_cost(problem.metric, tuple(problem.exit[i]), problem.end)
        listed = [j for j in lists.near[i].tolist() if j >= 0]
        assert listed == sorted(listed, key=costs.__getitem__)
        assert lists.near_cost[i][: len(listed)].tolist() == pytest.approx([costs[j] for j in listed])
        assert 8 <= len(listed) <= 12


@pytest.mark.parametrize("ends", ENDS)
def test_the_nodes_along_an_order_are_the_best_of_all_choices(ends: object) -> None:
    for kind in ("ways", "table of ways"):
        problem = random_problem(8, 5, kind, ends, pairs=0)
        order = np.array([3, 0, 4, 1, 2], dtype=np.int32)
        choices = itertools.product(*(np.flatnonzero(problem.cluster == c) for c in order))
        best = min(added_up(problem, np.array(choice)) for choice in choices)
        nodes = choose_nodes_for_order(problem, order)
        assert problem.cluster[nodes].tolist() == order.tolist()
        assert added_up(problem, nodes) == pytest.approx(best)
