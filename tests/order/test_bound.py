"""The lower bound: never above the optimum, whatever the costs, and near it on boards."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import leafcut
from leafcut.model.problem import METRICS, Metric, RoutingProblem
from leafcut.order import bound as bound_module
from leafcut.order import bound as spanning_tree
from leafcut.order.bound import lower_bound
from leafcut.order.instance import build_instance
from travel_reference import travel_cost

MACHINE = {"velocity": (40.0, 20.0), "acceleration": (90.0, 70.0), "per_mm": 1e-6}
ZONES = np.array([[10.0, 10.0, 30.0, 20.0]])
ENDS = [(None, None), ((1.0, 2.0), None), (None, (30.0, 5.0)), ((1.0, 2.0), (30.0, 5.0)), "closed"]
WHOLE = {"EUC_2D", "CEIL_2D", "ATT", "GEO", "MAX_2D", "MAN_2D", "EXPLICIT"}

GRIDDY = st.tuples(st.integers(0, 6).map(lambda v: 6.0 * v), st.integers(0, 6).map(lambda v: 6.0 * v))
IN_LINE = st.integers(0, 40).map(lambda v: (float(v), 3.0))
# Eighths: so that the reference and the kernels round the same distance to the same whole number.
ANYWHERE = st.tuples(st.integers(0, 320).map(lambda v: v / 8.0), st.integers(0, 320).map(lambda v: v / 8.0))
PLACES = st.one_of(*(st.lists(place, min_size=0, max_size=8) for place in (GRIDDY, IN_LINE, ANYWHERE)))


@pytest.fixture(autouse=True, scope="module", params=[0, 500], ids=["in rounds", "all pairs"])
def _how_trees_are_grown(request: pytest.FixtureRequest) -> Iterator[None]:
    """Every rule holds for trees of few nodes, made by looking at all pairs, and for those made in rounds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spanning_tree, "ALL_PAIRS", request.param)
        yield


def problem_of(xy: np.ndarray, metric: Metric, ends: object = "closed") -> RoutingProblem:
    """Return a closed problem, or one with the given ends."""
    if ends == "closed":
        return RoutingProblem.of_points(xy, metric, closed=True)
    start, end = ends
    return RoutingProblem.of_points(xy, metric, start=start, end=end)


def optimum(problem: RoutingProblem) -> float:
    """Return the minimum cost of a path or tour, by the plain reference and by dynamic programming over visited sets.

    Source: M. Held and R. M. Karp, J. SIAM 10 (1962).
    """
    n, metric, closed = problem.n_nodes, problem.metric, problem.closed
    places = [tuple(p) for p in problem.entry]

    def cost(i: int, j: int) -> float:
        return float(metric.matrix[i, j]) if metric.matrix is not None else travel_cost(metric, places[i], places[j])

    def first(j: int) -> float:
        return 0.0 if problem.start is None else travel_cost(metric, problem.start, places[j])

    def last(j: int) -> float:
        if closed:
            return cost(j, 0)
        return 0.0 if problem.end is None else travel_cost(metric, places[j], problem.end)

    c = [[cost(i, j) for j in range(n)] for i in range(n)]
    least = {(1 << j, j): 0.0 if closed else first(j) for j in range(1 if closed else n)}
    for _ in range(n - 1):
        longer: dict[tuple[int, int], float] = {}
        for (seen, i), so_far in least.items():
            for j in range(n):
                key = (seen | 1 << j, j)
                if not seen >> j & 1 and so_far + c[i][j] < longer.get(key, math.inf):
                    longer[key] = so_far + c[i][j]
        least = longer
    return min(so_far + last(j) for (_, j), so_far in least.items())


def metric_of(name: str, zones: bool, n: int, rng: np.random.Generator) -> Metric:
    """Return a metric by name; EXPLICIT has a random symmetric matrix, whose triangles need not close."""
    if name == "EXPLICIT":
        half = rng.integers(0, 50, (n, n)).astype(float)
        return Metric(name, matrix=half + half.T)
    if zones and name != "GEO":
        return Metric(name, **MACHINE, zones=ZONES, lift=7.0)
    return Metric(name, **MACHINE)


@pytest.mark.parametrize("name", METRICS)
@given(
    places=PLACES, zones=st.booleans(), ends=st.sampled_from(ENDS), factor=st.sampled_from([0.0, 0.5, 1.0, 1.3, 9.0])
)
def test_the_bound_is_never_above_the_optimum(
    name: str, places: list[tuple[float, float]], zones: bool, ends: object, factor: float
) -> None:
    """Any metric, any ends, twins, nodes in line, tours that are known well, badly, or wrongly."""
    xy = np.array(places, dtype=np.float64).reshape(-1, 2)
    if name == "EXPLICIT":
        ends = "closed" if ends == "closed" else (None, None)
    metric = metric_of(name, zones, len(xy), np.random.default_rng(len(xy)))
    problem = problem_of(xy, metric, ends)
    if len(xy) < 2 and (name == "GEO" or len(xy) == 0):
        return  # no travel at all; the kilometre from a place to itself is TSPLIB's
    least = optimum(problem)
    found = lower_bound(build_instance(problem, 5), factor * least)
    assert found is not None
    assert found <= least + 1e-12 * least
    if name in WHOLE and not (zones and name not in {"GEO", "EXPLICIT"}):
        assert found == round(found)


@functools.cache
def nine_nodes(name: str, ends: object, seed: int) -> tuple[RoutingProblem, float]:
    """Return a problem and its optimum, once for trees of either kind."""
    problem = problem_of(np.random.default_rng(seed).uniform(0, 40, (9, 2)), Metric(name, **MACHINE), ends)
    return problem, optimum(problem)


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("name", ["euclidean", "EUC_2D", "linear", "dogleg", "chebyshev"])
def test_the_bound_of_nine_nodes_is_near_their_optimum(name: str, ends: object) -> None:
    """Within 1 % on the mean of five boards."""
    gaps = []
    for seed in range(5):
        problem, least = nine_nodes(name, ends, seed)
        found = lower_bound(build_instance(problem, 8), least)
        assert found is not None
        gaps.append(1.0 - found / least)
    assert min(gaps) >= 0.0
    assert np.mean(gaps) <= 0.01


def plain_ascent(c: np.ndarray, hub: int, tied: int, upper: float, steps: int) -> float:
    """Return the best value of Held and Karp's ascent with penalties of sets, from a matrix of costs.

    The sets are those that single linkage joins; each is as wide as the gap between the edge that formed it and the
    edge that joins it to another, and at least 30 % of that edge, divided by its nodes.
    """
    n = len(c)
    penalty, best = np.zeros(n), -math.inf

    def tree() -> list[tuple[int, int]]:
        of, edges = {v: v for v in range(n)}, []
        pairs = [(c[a, b] + penalty[a] + penalty[b], a, b) for a in range(n) for b in range(a) if hub not in (a, b)]
        for _, a, b in sorted(pairs):
            if of[a] != of[b]:
                edges.append((a, b))
                of = {v: of[a] if part == of[b] else part for v, part in of.items()}
        return edges

    sets: list[tuple[float, list[int]]] = []
    part = {v: ([v], 0.0) for v in range(n)}
    for a, b in tree():
        length = c[a, b]
        for nodes, formed in (part[a], part[b]):
            sets.append((max(0.0, length - formed, 0.3 * length / len(nodes)), nodes))
        joined = (part[a][0] + part[b][0], length)
        part.update(dict.fromkeys(joined[0], joined))
    for step in range(steps):
        edges = tree()
        near = sorted((v for v in range(n) if v != hub), key=lambda v: (v != tied, c[hub, v] + penalty[v]))[:2]
        edges += [(hub, v) for v in near]
        value = sum(c[a, b] + penalty[a] + penalty[b] for a, b in edges) - 2.0 * penalty.sum()
        best = max(best, value)
        excess = np.bincount(np.array(edges).ravel(), minlength=n) - 2.0
        product = sum(width * excess[nodes].sum() ** 2 for width, nodes in sets)
        if product == 0.0:
            break
        size = (1.0 - step / steps) ** 2 * (upper - value) / product
        moves = [(nodes, size * width * excess[nodes].sum()) for width, nodes in sets]
        for nodes, move in moves:
            penalty[nodes] += move
    return best


@pytest.mark.parametrize("ends", ENDS)
def test_the_bound_is_the_best_value_of_a_plain_ascent(ends: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve steps, and all edges in the graph; rounding is allowed for by a billionth of all sums."""
    monkeypatch.setattr(bound_module, "FEWEST_STEPS", 12)
    monkeypatch.setattr(bound_module, "NODE_STEPS", 0)
    monkeypatch.setattr(bound_module, "MOST_NEAR", 50)
    gained = 0
    for seed, n in enumerate((6, 9, 14, 20)):
        xy = np.random.default_rng(seed).uniform(0, 40, (n, 2))
        instance = build_instance(problem_of(xy, Metric("linear", **MACHINE), ends), 0)
        hub = next((v for v in (instance.cost.free, instance.cost.tied_a) if v >= 0), instance.n - 1)
        tied = {instance.cost.tied_a: instance.cost.tied_b, instance.cost.tied_b: instance.cost.tied_a}.get(hub, -1)
        leave, arrive = np.indices((instance.n, instance.n), dtype=np.int32).reshape(2, -1)
        c = bound_module.costs_with_tied_edges_free(instance.cost, np.stack([leave, arrive])).reshape(
            instance.n, instance.n
        )
        upper = float(c.diagonal(1).sum() + c[-1, 0])
        found = lower_bound(instance, upper)
        assert found is not None
        first = plain_ascent(c, hub, tied, upper, 1)
        assert found == pytest.approx(plain_ascent(c, hub, tied, upper, 12), rel=1e-7)
        gained += found > first + 1e-3
    assert gained >= 3


@pytest.mark.parametrize("n", [0, 1, 2, 3])
@pytest.mark.parametrize("ends", ENDS)
def test_up_to_three_nodes_have_one_tour_only(n: int, ends: object) -> None:
    xy = np.random.default_rng(n).uniform(0, 40, (n, 2))
    problem = problem_of(xy, Metric(), ends)
    found = lower_bound(build_instance(problem, 8), 1.0)
    assert found is not None
    if n >= 2 and ends == "closed":
        assert found == pytest.approx(optimum(problem), rel=1e-8)
    elif n <= 1 and ends in ("closed", (None, None)):
        assert found == 0.0


def test_an_open_row_of_holes_is_bounded_by_its_length() -> None:
    xy = np.stack([np.random.default_rng(3).uniform(0, 500, 300), np.full(300, 7.0)], axis=1)
    found = lower_bound(build_instance(problem_of(xy, Metric(), (None, None)), 8), 600.0)
    assert found == pytest.approx(np.ptp(xy[:, 0]), rel=1e-7)


def test_holes_on_a_circle_are_bounded_by_their_polygon() -> None:
    """Shortest is to go round: n chords of 2·r·sin(π / n)."""
    angle = np.arange(101) * 2 * np.pi / 101
    xy = 50.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    length = 101 * 100.0 * math.sin(math.pi / 101)
    assert lower_bound(build_instance(problem_of(xy, Metric()), 8), length) == pytest.approx(length, rel=1e-6)


def test_a_second_hole_on_every_place_changes_nothing() -> None:
    xy = np.random.default_rng(8).uniform(0, 100, (40, 2))
    once, twice = (lower_bound(build_instance(problem_of(p, Metric()), 8), 560.0) for p in (xy, np.repeat(xy, 2, 0)))
    assert once == pytest.approx(twice, rel=2e-3)


def test_all_holes_on_one_place_cost_nothing() -> None:
    assert lower_bound(build_instance(problem_of(np.ones((500, 2)), Metric()), 8), 0.0) == 0.0


def test_the_same_distances_as_places_or_as_a_matrix_give_nearly_the_same_bound() -> None:
    xy = np.random.default_rng(2).uniform(0, 100, (80, 2))
    matrix = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
    metrics = (Metric(), Metric("EXPLICIT", matrix=matrix))
    plane, table = (lower_bound(build_instance(problem_of(xy, m), 8), 750.0) for m in metrics)
    assert plane == pytest.approx(table, rel=1e-3)


@pytest.mark.parametrize(
    "name", ["kroA100", "d198", "fl417", *(pytest.param(name, marks=pytest.mark.slow) for name in ("u1432", "rl5915"))]
)
def test_the_bound_is_never_above_a_published_optimum(name: str, data: Path) -> None:
    assert 0.975 <= gap_to_optimum(data, name) <= 1.0


@pytest.mark.parametrize("name", ["pcb442", "u724", pytest.param("pcb3038", marks=pytest.mark.slow)])
def test_the_bound_of_boards_is_within_one_percent(name: str, data: Path) -> None:
    assert 0.99 <= gap_to_optimum(data, name) <= 1.0


def gap_to_optimum(data: Path, name: str) -> float:
    """Return the bound of an instance as a part of its published optimum; the tour known is 5 % longer than that."""
    part = leafcut.read_part(data / "tsplib" / f"{name}.tsp")
    assert part.optimum is not None
    found = lower_bound(build_instance(problem_of(part.hole_xy, Metric(part.edge_weight_type)), 8), 1.05 * part.optimum)
    assert found is not None
    return found / part.optimum


def test_a_problem_that_is_more_than_a_tour_of_places_has_no_bound() -> None:
    """Clusters with two nodes, a slot with different entry and exit, asymmetric costs."""
    xy = np.random.default_rng(6).uniform(0, 50, (12, 2))
    ways = RoutingProblem(xy, xy, np.repeat(np.arange(6, dtype=np.int32), 2), np.zeros(12))
    slots = RoutingProblem(xy, xy[::-1].copy(), np.arange(12, dtype=np.int32), np.zeros(12))
    one_way = problem_of(xy, Metric("EXPLICIT", matrix=np.arange(144.0).reshape(12, 12)))
    for problem in (ways, slots, one_way):
        assert lower_bound(build_instance(problem, 5), 100.0) is None


def test_where_a_proof_would_take_too_long_there_is_no_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    instance = build_instance(problem_of(np.random.default_rng(6).uniform(0, 50, (12, 2)), Metric("GEO")), 5)
    assert lower_bound(instance, 1e4) is not None
    monkeypatch.setattr(bound_module, "DENSE_LIMIT", 11)
    assert lower_bound(instance, 1e4) is None


@pytest.mark.parametrize("upper", [0.0, -5.0, 1e-300, 1e300, math.inf, math.nan])
def test_nonsense_for_a_known_tour_gives_a_valid_bound(upper: float) -> None:
    problem = problem_of(np.random.default_rng(9).uniform(0, 40, (8, 2)), Metric())
    found = lower_bound(build_instance(problem, 5), upper)
    assert found is not None
    assert 0.0 < found <= optimum(problem)


def test_a_node_that_cannot_be_reached_leaves_no_bound() -> None:
    matrix = np.ones((9, 9))
    matrix[4], matrix[:, 4] = math.inf, math.inf
    assert lower_bound(build_instance(problem_of(np.zeros((9, 2)), Metric("EXPLICIT", matrix=matrix)), 5), 9.0) is None


@pytest.mark.parametrize("scale", [1e-90, 1e90])
def test_the_bound_grows_and_shrinks_with_the_board(scale: float) -> None:
    xy = np.random.default_rng(9).uniform(0, 40, (60, 2))
    one, other = (lower_bound(build_instance(problem_of(xy * s, Metric()), 8), 260.0 * s) for s in (1.0, scale))
    assert other == pytest.approx(one * scale, rel=1e-4)


def test_stopping_keeps_what_was_proved() -> None:
    """At first there is no bound; later a bound that is not better than the final one."""
    instance = build_instance(problem_of(np.random.default_rng(9).uniform(0, 40, (300, 2)), Metric()), 8)
    whole = lower_bound(instance, 560.0)
    assert lower_bound(instance, 560.0, stop=lambda: True) is None
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > 12

    found = lower_bound(instance, 560.0, stop=stop)
    assert found is not None
    assert whole is not None
    assert 0.5 * whole < found < whole


def test_the_same_problem_has_the_same_bound() -> None:
    xy = np.random.default_rng(9).uniform(0, 40, (200, 2))
    one, two = (lower_bound(build_instance(problem_of(xy, Metric()), 8), 450.0) for _ in range(2))
    assert one == two
