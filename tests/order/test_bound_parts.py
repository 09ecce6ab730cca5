"""Steps, graphs and rounding of the lower bound by hand, and when proofs are made."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.kernels.cost import CostModel
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order import bound
from leafcut.order.bound import SpanningTree, lower_bound
from leafcut.order.instance import Instance, build_cost_model, build_instance

#: Five points of a 3-4-5 grid.
XY = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (0.0, 4.0), (6.0, 8.0)])


def model(name: str = "euclidean", **more: object) -> CostModel:
    """Return the costs between the five points."""
    return build_cost_model(Metric(name, (10.0, 10.0), (50.0, 50.0), **more), XY)  # type: ignore[arg-type]


def scattered(n: int, metric: Metric | None = None, **ends: object) -> Instance:
    """Return an instance of n random places."""
    xy = np.random.default_rng(9).uniform(0, 40, (n, 2))
    return build_instance(RoutingProblem.of_points(xy, metric or Metric(), **(ends or {"closed": True})), 8)  # type: ignore


def test_the_ascent_has_more_steps_for_more_nodes_up_to_a_limit_of_work() -> None:
    assert [bound._ascent_step_count(n) for n in (4, 10, 1000, 1500, 2000, 10_000, 30_000, 30_001, 200_000)] == [
        202,
        205,
        700,
        950,
        750,
        150,
        50,
        50,
        50,
    ]


@pytest.mark.parametrize(
    ("cost", "whole"),
    [
        (model("EUC_2D"), True),
        (model("CEIL_2D"), True),
        (model("ATT"), True),
        (model("GEO"), True),
        (model("MAX_2D"), True),
        (model("MAN_2D"), True),
        (model(), False),
        (model("chebyshev"), False),
        (model("manhattan"), False),
        (model("linear"), False),
        (model("EUC_2D", zones=np.array([[0.0, 0.0, 1.0, 1.0]]), lift=0.5), False),
        (model("EXPLICIT", matrix=np.arange(25.0).reshape(5, 5)), True),
        (model("EXPLICIT", matrix=np.arange(25.0).reshape(5, 5) / 2.0), False),
    ],
    ids=range(13),
)
def test_a_bound_is_lower_by_rounding_and_the_next_whole_number_for_whole_costs(cost: CostModel, whole: bool) -> None:
    """A billionth of all sums."""
    assert bound._rounded_lower_bound(cost, 10.2, 1e8) == pytest.approx(11.0 if whole else 10.1, abs=1e-12)
    assert bound._rounded_lower_bound(cost, 10.0 + 0.9e-7, 100.0) == pytest.approx(10.0, abs=1e-7)
    assert bound._rounded_lower_bound(cost, 10.0 + 1.1e-7, 100.0) == pytest.approx(11.0 if whole else 10.0, abs=1e-7)
    assert bound._rounded_lower_bound(cost, math.inf, 1.0) == math.inf


def test_the_plane_has_distances_that_grow_and_lifts_that_cost() -> None:
    zone = {"zones": np.array([[0.0, 0.0, 1.0, 1.0]])}
    assert bound.has_box_bounds(model())
    assert bound.has_box_bounds(model("linear", lift=0.0, **zone))
    assert not bound.has_box_bounds(model("linear", lift=-0.1, **zone))
    assert not bound.has_box_bounds(model("linear", per_mm=-0.1))
    assert bound.has_box_bounds(model("linear", per_mm=0.0))
    assert not bound.has_box_bounds(model("GEO"))
    assert not bound.has_box_bounds(model("EXPLICIT", matrix=np.zeros((5, 5))))


@pytest.mark.parametrize(
    "ends", [{"closed": True}, {}, {"start": (1.0, 1.0)}, {"start": (1.0, 1.0), "end": (9.0, 9.0)}]
)
def test_the_hub_is_the_free_node_a_tied_one_or_the_last(ends: dict[str, object]) -> None:
    """Points 0 … 4, then the start, the end, and the free node; costs of its edges, 0 for a tied or free one."""
    instance = build_instance(RoutingProblem.of_points(XY, **ends), 0)  # type: ignore[arg-type]
    hub, cost = bound._choose_one_tree_hub(instance.cost, instance.n), instance.cost
    if "closed" in ends:
        assert (hub.node, hub.tied) == (4, -1)
        assert hub.spokes.tolist() == np.hypot(*(cost.xy - cost.xy[4]).T).tolist()
    elif not ends:
        assert (hub.node, hub.tied, hub.spokes.tolist()) == (5, -1, [0.0] * 6)
    elif "end" in ends:
        assert (hub.node, hub.tied) == (6, 5)
        wanted = np.hypot(*(cost.xy - cost.xy[6]).T)
        wanted[5] = 0.0
        assert hub.spokes.tolist() == wanted.tolist()
    else:
        assert (hub.node, hub.tied, hub.spokes.tolist()) == (6, 5, [0.0] * 7)


def test_the_edges_of_the_graph_are_the_first_six_candidates_without_the_hub() -> None:
    lists = np.array([[1, 2, 3, 4, 5, 6, 7], [0, 2, -1, -1, -1, -1, -1], [3, 0, 1, 4, 5, 6, 7]], dtype=np.int32)
    edges = bound._candidate_edges(lists, 4)
    assert edges.tolist() == [[0] * 5 + [1] * 2 + [2] * 5, [1, 2, 3, 5, 6, 0, 2, 3, 0, 1, 5, 6]]
    assert bound._candidate_edges(lists, 1).tolist() == [[0] * 5 + [2] * 5, [2, 3, 4, 5, 6, 3, 0, 4, 5, 6]]


def test_a_graph_has_every_edge_once_at_both_ends_with_its_cost() -> None:
    edges = np.array([[1, 0, 2, 0, 4], [0, 1, 3, 2, 2]], dtype=np.int32)
    graph = bound._candidate_graph(model(), 5, edges)
    assert graph.begin.tolist() == [0, 2, 3, 6, 7, 8]
    assert graph.near.tolist() == [1, 2, 0, 0, 3, 4, 2, 2]
    assert graph.length.tolist() == [3.0, 5.0, 3.0, 5.0, 3.0, 5.0, 3.0, 5.0]
    assert (graph.begin.dtype, graph.near.dtype) == (np.int32, np.int32)


def test_the_two_spokes_are_the_cheapest_under_penalties_and_the_tied_one() -> None:
    hub = bound.Hub(2, -1, np.array([5.0, 1.0, 0.0, 2.0, 4.0]))
    assert sorted(bound._two_cheapest_hub_neighbours(hub, np.zeros(5)).tolist()) == [1, 3]
    assert sorted(bound._two_cheapest_hub_neighbours(hub, np.array([-5.0, 2.0, -99.0, 0.0, 0.0])).tolist()) == [0, 3]
    assert bound._two_cheapest_hub_neighbours(hub._replace(tied=4), np.zeros(5)).tolist() == [4, 1]


def test_the_weight_of_a_tree_is_that_of_its_edges_and_spokes_less_twice_the_penalties() -> None:
    """Tree 0–1–2–3 of 3, 4 and 3; the hub 4 has spokes of 10, √73, 5 and √52."""
    cost, penalty = model(), np.array([1.0, -2.0, 0.5, 0.25, 0.0])
    hub = bound._choose_one_tree_hub(cost, 5)
    tree = SpanningTree(np.array([[0, 1, 2], [1, 2, 3]], dtype=np.int32), np.array([3.0, 4.0, 3.0]))
    spokes = [5.0 + 0.5, min(math.sqrt(52.0) + 0.25, math.sqrt(73.0) - 2.0)]
    plain = (3.0 - 1.0) + (4.0 - 1.5) + (3.0 + 0.75) + sum(spokes) - 2.0 * penalty.sum()
    size = 2.0 + 2.5 + 3.75 + sum(spokes) + 4.0 * 3.75
    assert bound._one_tree_bound(cost, hub, tree, penalty) == pytest.approx(plain - 1e-9 * size, abs=1e-12)


@pytest.mark.parametrize(
    ("metric", "goals"),
    [(Metric(), [11, 21, 42, 88, 175, 263, 350]), (Metric("GEO"), [42, 88, 175, 263, 350])],
    ids=["plane", "table"],
)
def test_proofs_are_made_after_shares_of_the_steps_that_are_not_too_close(
    metric: Metric, goals: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """350 steps for 300 nodes; 5 steps apart in the plane, 30 where all pairs are compared. Of the bounds the best
    counts, and the edges of every tree join the graph.
    """
    instance, seen, edges = scattered(300, metric), [], []
    path = np.stack([np.arange(298), np.arange(1, 299)]).astype(np.int32)

    class Ascent:
        steps, step = 350, 0

        def __init__(self, n: int, sets: object, hub: bound.Hub, upper: float, stop: object) -> None:
            assert (n, hub.node, upper) == (300, 299, 5000.0)

        def climb(self, graph: object, goal: int) -> np.ndarray:
            self.step = goal
            seen.append(goal)
            edges.append(len(graph.near))  # type: ignore[attr-defined]
            return np.full(300, float(goal))

    def tree(_: Instance, hub: int, penalty: np.ndarray, *__: object) -> SpanningTree:
        return SpanningTree(path, np.full(298, 1.0))

    values = {0.0: 100.0, 42.0: 700.0, 263.0: 900.0}
    monkeypatch.setattr(bound, "_Ascent", Ascent)
    monkeypatch.setattr(bound, "minimum_spanning_tree", tree)
    monkeypatch.setattr(bound, "_one_tree_bound", lambda *given: values.get(float(given[3][0]), 50.0))
    assert bound._bound_of_large_instance(instance, 5000.0, lambda: False) == 900.0
    assert seen == goals
    assert len(set(edges)) == 1
    assert edges[0] > 2 * 298
    # A bound that reaches the known tour ends the ascent.
    seen.clear()
    values[88.0] = 5000.0
    assert bound._bound_of_large_instance(instance, 5000.0, lambda: False) == 5000.0
    assert seen[-1] == 88
    # A late proof is not begun, and the best bound so far is kept.
    seen.clear()
    assert bound._bound_of_large_instance(instance, 5000.0, lambda: len(seen) >= 3) == max(
        values.get(float(g), 50.0) for g in [0, *goals[:2]]
    )


def test_the_ascent_asks_after_fifty_thousand_node_steps_whether_to_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    """300 nodes: 166 steps at once. The best penalties of a call are returned, and the ascent goes on from its own."""
    calls, asked = [], []

    def climb(*given: object) -> float:
        upper, first, last, steps, penalty, best, value = given[5:12]
        calls.append((first, last, steps, upper, value))
        penalty += 1.0  # type: ignore[operator]
        best[:] = 10.0 * len(calls)  # type: ignore[index]
        return float(len(calls))

    def stop() -> bool:
        asked.append(len(calls))
        return len(calls) >= 3

    monkeypatch.setattr(bound, "ascend_subgradient", climb)
    hub = bound.Hub(299, -1, np.zeros(300))
    ascent = bound._Ascent(300, None, hub, 77.0, stop)  # type: ignore[arg-type]
    assert ascent.climb(None, 200).tolist() == [20.0] * 300  # type: ignore[arg-type]
    assert calls == [(0, 166, 350, 77.0, -math.inf), (166, 200, 350, 77.0, 1.0)]
    assert ascent.climb(None, 350).tolist() == [30.0] * 300  # type: ignore[arg-type]
    assert calls[2] == (200, 350, 350, 77.0, -math.inf)
    assert asked == [0, 1, 2]
    # Stopped before its first step, it returns the penalties where it is.
    ascent.step = 10
    assert ascent.climb(None, 20).tolist() == [3.0] * 300  # type: ignore[arg-type]
    assert ascent.step == 10


@pytest.mark.parametrize(("n", "few"), [(150, True), (151, False)])
def test_up_to_150_nodes_compare_all_pairs(n: int, few: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    used: list[str] = []
    monkeypatch.setattr(bound, "_bound_of_small_instance", lambda *_: used.append("few") or 5.0)
    monkeypatch.setattr(bound, "_bound_of_large_instance", lambda *_: used.append("many") or math.inf)
    assert lower_bound(scattered(n), 9.0) == (5.0 if few else None)
    assert used == ["few" if few else "many"]


def test_the_most_nodes_are_those_of_the_plane_or_of_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    plane, table = scattered(12), scattered(12, Metric("GEO"))
    for instance, name in ((plane, "MOST_NODES"), (table, "DENSE_LIMIT")):
        with monkeypatch.context() as patch:
            patch.setattr(bound, "MOST_NODES", 99 if name == "DENSE_LIMIT" else 12)
            patch.setattr(bound, "DENSE_LIMIT", 99 if name == "MOST_NODES" else 12)
            assert lower_bound(instance, 1e4) is not None
            patch.setattr(bound, name, 11)
            assert lower_bound(instance, 1e4) is None
