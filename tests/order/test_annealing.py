"""Forgetting and finding again: paths stay whole and in order, and what is put back stands where it is cheapest."""

from __future__ import annotations

import itertools
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from test_sequential import ENDS, KINDS, added_up, check, least, random_problem

from leafcut.kernels.annealing import insert_cluster
from leafcut.kernels.cluster_paths import closed_path_length
from leafcut.model.heartbeat import Progress
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order.annealing import PathAnnealing, build_clusters, is_small_enough_to_anneal
from leafcut.order.directed import build_directed_instance, greedy_path
from leafcut.order.solve import solve
from plain_python import plain_parts

__all__ = ["plain_parts"]

pytestmark = pytest.mark.usefixtures("plain_parts")


def greedy_nodes(instance) -> np.ndarray:
    route = greedy_path(instance)
    return instance.nodes_from_path(route.node, route.enter)


@pytest.mark.parametrize("kind", KINDS)
def test_a_cooling_down_keeps_precedence_and_finds_the_optimum_of_seven_clusters(kind: str) -> None:
    """Twenty random problems of each kind and every kind of ends, by dynamic programming over all sets."""
    missed = 0
    for seed in range(20):
        problem = random_problem(seed, 7, kind, ENDS[seed % 5], pairs=seed % 6)
        instance = build_directed_instance(problem, 6)
        ant = PathAnnealing(instance, np.array([seed + 1], dtype=np.uint64))
        *_, (nodes, _) = ant.anneal(greedy_nodes(instance), 20.0, 400, 1e-9)
        cost = added_up(problem, nodes)
        check(problem, nodes, cost)
        missed += cost > least(problem) * (1 + 1e-9)
    assert missed <= 1


@pytest.mark.parametrize("kind", ["cuts", "ways", "table of ways"])
def test_a_cluster_is_put_where_it_is_cheapest_of_all_places_that_precedence_leaves(kind: str) -> None:
    """Every place and every node of it are tried by hand."""
    for seed in range(12):
        problem = random_problem(seed, 9, kind, ENDS[seed % 5], pairs=4)
        instance = build_directed_instance(problem, 6)
        ant, words = PathAnnealing(instance, np.array([5], dtype=np.uint64)), np.array([5], dtype=np.uint64)
        layers, walk, m = ant.layers, ant.walk, instance.n
        nodes = greedy_nodes(instance)
        ring = [*([len(layers.owner) - 1] if instance.anchored else []), *ant.number[nodes].tolist()]
        out = 3 + seed % 4
        c = int(layers.owner[ring.pop(out)])
        walk.trial[: m - 1], walk.place[:] = ring, -1
        walk.place[layers.owner[ring]] = np.arange(m - 1)
        places = []
        for spot, node in itertools.product(
            range(int(instance.anchored), m), range(layers.begin[c], layers.begin[c + 1])
        ):
            tried = [*ring[:spot], node, *ring[spot:]]
            order = [int(layers.owner[v]) for v in tried]
            if all(order.index(a) < order.index(b) for a, b in problem.precedence.tolist()):
                places.append(closed_path_length(layers, np.array(tried)))
        insert_cluster(layers, walk, c, m - 1, 0.0, words, 0)
        assert closed_path_length(layers, walk.trial) == pytest.approx(min(places))
        assert layers.owner[walk.trial[walk.place[c]]] == c


def test_costs_between_clusters_are_the_least_of_their_nodes() -> None:
    problem = random_problem(4, 8, "ways", "closed", pairs=0)
    layers = build_clusters(build_directed_instance(problem, 6))
    for c, d in itertools.permutations(range(8), 2):
        ways = [
            layers.table[u, v] for u in np.flatnonzero(layers.owner == c) for v in np.flatnonzero(layers.owner == d)
        ]
        assert layers.least[c, d] == min(ways)
        assert layers.least_back[d, c] == layers.least[c, d]


def test_service_that_outweighs_all_travel_does_not_keep_the_search_from_the_shortest_way() -> None:
    """Twenty contours on a line, each with an hour of work and two starts: the path along the line is best."""
    x = np.repeat(np.arange(20.0), 2)
    entry = np.column_stack([x, np.tile([0.0, 5.0], 20)])
    cluster = np.random.default_rng(3).permutation(20).astype(np.int32)
    problem = RoutingProblem(entry, entry, np.repeat(cluster, 2), np.full(40, 3600.0), start=(0.0, 0.0))
    assert solve(problem, SolveOptions(preset="fast", bound=False)).cost == pytest.approx(20 * 3600.0 + 19.0)


def test_several_threads_with_a_clock_give_one_true_answer_and_a_budget_does_not_depend_on_them() -> None:
    """The search is cancelled at its third report, however late a busy machine makes it."""
    problem, stopped = random_problem(3, 40, "ways", (None, None), pairs=9), threading.Event()
    told: list[float] = []

    def tell(progress: Progress) -> None:
        assert progress.cost is not None
        told.append(progress.cost)
        if len(told) == 3:
            stopped.set()

    options = SolveOptions(time_limit=3600.0, threads=3, bound=False)
    found = solve(problem, options, progress=tell, cancelled=stopped)
    check(problem, found.nodes, found.cost)
    assert len(found.workers) == 3
    assert min(w.best for w in found.workers) >= found.cost - 1e-9
    assert len(told) >= 3
    assert told == sorted(told, reverse=True)
    one, three = (solve(problem, SolveOptions(iterations=2, threads=t, bound=False)) for t in (1, 3))
    assert one.nodes.tolist() == three.nodes.tolist()


def test_stopping_from_outside_ends_all_threads_with_the_best_so_far() -> None:
    problem, stopped = random_problem(3, 40, "ways", (None, None), pairs=9), threading.Event()
    options = SolveOptions(time_limit=3600.0, threads=2, bound=False)
    found = solve(problem, options, progress=lambda *_: stopped.set(), cancelled=stopped)
    check(problem, found.nodes, found.cost)
    assert found.stopped_early


@pytest.mark.parametrize(("n", "nodes", "small"), [(500, 2500, True), (501, 501, False), (500, 2501, False)])
def test_paths_of_few_clusters_with_few_nodes_are_annealed(n: int, nodes: int, small: bool) -> None:
    instance = SimpleNamespace(n=n, rules=SimpleNamespace(way=range(nodes)))
    assert is_small_enough_to_anneal(instance) is small  # type: ignore[arg-type]
