"""Separate colonies: the answer equals the exchange done by hand, on any executor, even if workers die."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dask_cluster import Cluster
from leafcut.errors import OptionError, SolveError
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order.colonies import FEWEST_ANTS, ColonyTask, improve_by_colonies, live
from leafcut.order.executors import open_executor
from leafcut.order.instance import build_instance
from leafcut.order.solve import solve
from leafcut.order.statistics import Best
from leafcut.order.stop import Stop

NODES = 80
PLACES = np.random.default_rng(8).uniform(0.0, 100.0, (NODES, 2))
PROBLEM = RoutingProblem.of_points(PLACES)
OPTIONS = SolveOptions(colonies=3, iterations=2, bound=False, threads=2, preset="fast")


def length(order: np.ndarray) -> float:
    """Return the length of a path, independent of the search."""
    return float(np.hypot(*np.diff(PLACES[order], axis=0).T).sum())


def test_colonies_exchange_their_best_tours_in_a_ring() -> None:
    """By hand: three colonies live, each gets the best ant of its predecessor, and they live again."""
    places = np.random.default_rng(8).uniform(0.0, 100.0, (150, 2))  # enough that colonies still differ afterwards
    instance, stop = build_instance(RoutingProblem.of_points(places), 8), Stop(iterations=2)
    best = Best(stop)
    with open_executor("threads", 2) as executor:
        assert improve_by_colonies(instance, 5, stop, best, executor, 3, 0.0) == 2  # no budget: fewest ants
    first = [live(ColonyTask(k, instance, None, FEWEST_ANTS, 5)) for k in range(3)]
    shortest = min(best.history[0][1], *(colony.costs.min() for colony in first))
    for k, colony in enumerate(first):
        before = first[k - 1]
        worst, winner = int(colony.costs.argmax()), int(before.costs.argmin())
        if before.costs[winner] < colony.costs[worst]:
            tours, costs = colony.tours.copy(), colony.costs.copy()
            tours[worst], costs[worst] = before.tours[winner], before.costs[winner]
        else:
            tours, costs = colony.tours, colony.costs
        joined = replace(colony, tours=tours, costs=costs)
        shortest = min(shortest, live(ColonyTask(k, instance, joined, FEWEST_ANTS, 5)).costs.min())
    assert best.cost == pytest.approx(shortest, rel=1e-12)


def test_the_answer_is_a_tour_and_does_not_depend_on_the_number_of_workers() -> None:
    two = solve(PROBLEM, OPTIONS)
    assert sorted(two.nodes) == list(range(NODES))
    assert length(np.asarray(two.nodes)) == pytest.approx(two.cost, rel=1e-9)
    for workers in (1, 3):
        other = solve(PROBLEM, replace(OPTIONS, threads=workers))
        assert (two.cost, list(two.nodes)) == (other.cost, list(other.nodes))


def test_a_search_without_a_limit_ends_near_the_best_known_tour() -> None:
    found = solve(PROBLEM, SolveOptions(colonies=2, bound=False, preset="fast"))
    known = solve(PROBLEM, SolveOptions(bound=False, preset="default"))
    assert found.cost <= 1.01 * known.cost


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"colonies_on": "processes"}, "--colonies-on: only used with --colonies"),
        ({"colonies": 1}, "--colonies"),
    ],
)
def test_options_that_need_several_colonies_are_refused_without_them(changes: dict[str, object], line: str) -> None:
    with pytest.raises(OptionError, match=line):
        SolveOptions(**changes)  # type: ignore[arg-type]


def test_precedence_and_unknown_executors_are_refused() -> None:
    pairs = np.array([[0, 1]], dtype=np.int32)
    ordered = replace(RoutingProblem.of_points(PLACES[:9]), precedence=pairs)
    with pytest.raises(SolveError, match="keep no precedence"):
        solve(ordered, OPTIONS)
    with pytest.raises(OptionError, match="use threads, processes or dask://host:port"):
        solve(PROBLEM, SolveOptions(colonies=2, colonies_on="thread", iterations=1, bound=False))


#: Runs in a process of its own: Dask's client keeps threads and sockets until Python ends.
SOLVE = """
import sys
from leafcut import api
options = {"preset": "fast", "colonies": 4, "iterations": 2, "bound": False, "colonies_on": sys.argv[1]}
print(api.solve("random:300:3", **options).solution.nodes.tolist())
"""


@pytest.fixture
def mortal_cluster(tmp_path: Path) -> Iterator[Cluster]:
    """Yield a cluster of two workers; the first dies at its first task."""
    pytest.importorskip("distributed")
    cluster = Cluster(tmp_path, mortal=True)
    yield cluster
    cluster.end()


@pytest.mark.slow
def test_a_worker_of_two_that_dies_during_a_task_does_not_change_the_answer(mortal_cluster: Cluster) -> None:
    here, there = (
        subprocess.run([sys.executable, "-c", SOLVE, where], check=True, capture_output=True).stdout
        for where in ("threads", mortal_cluster.spec)
    )
    assert mortal_cluster.workers[0].wait() == -signal.SIGKILL
    assert here == there
    assert sorted(json.loads(here)) == list(range(300))
