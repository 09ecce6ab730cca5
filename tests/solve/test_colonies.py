"""Colonies that live apart: the answer is that of the same exchange done by hand, wherever they live, whoever dies."""

from __future__ import annotations

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
from leafcut.executors import open_executor
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions
from leafcut.solve.colonies import FEWEST_ANTS, ColonyTask, improve_by_colonies, live
from leafcut.solve.instance import build_instance
from leafcut.solve.solve import solve
from leafcut.solve.statistics import Best
from leafcut.solve.stop import Stop

PLACES = np.random.default_rng(8).uniform(0.0, 100.0, (150, 2))
PROBLEM = RoutingProblem.of_points(PLACES)
OPTIONS = SolveOptions(colonies=3, iterations=2, bound=False, threads=2, preset="fast")


def length(order: np.ndarray) -> float:
    """Return the length of a path from place to place, added up here."""
    return float(np.hypot(*np.diff(PLACES[order], axis=0).T).sum())


def test_the_exchange_goes_round_in_a_ring() -> None:
    """The same by hand: three colonies live, each gets the best ant of the one before it, and they live again."""
    instance, stop = build_instance(PROBLEM, 8), Stop(iterations=2)
    best = Best(stop)
    with open_executor("threads", 2) as executor:
        assert improve_by_colonies(instance, 5, stop, best, executor, 3, 0.0) == 2  # no budget: as few ants as may be
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


@pytest.mark.parametrize("workers", [1, 3])
def test_the_answer_is_a_tour_and_does_not_depend_on_the_workers(workers: int) -> None:
    two = solve(PROBLEM, OPTIONS)
    other = solve(PROBLEM, SolveOptions(colonies=3, iterations=2, bound=False, threads=workers, preset="fast"))
    assert sorted(two.nodes) == list(range(150))
    assert length(np.asarray(two.nodes)) == pytest.approx(two.cost, rel=1e-9)
    assert (two.cost, list(two.nodes)) == (other.cost, list(other.nodes))


def test_without_a_limit_it_ends_by_itself_near_the_best_known() -> None:
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
def test_what_makes_no_colonies_is_refused(changes: dict[str, object], line: str) -> None:
    with pytest.raises(OptionError, match=line):
        SolveOptions(**changes)  # type: ignore[arg-type]


def test_what_has_an_order_of_its_own_is_refused_and_so_is_no_executor() -> None:
    pairs = np.array([[0, 1]], dtype=np.int32)
    ordered = replace(RoutingProblem.of_points(PLACES[:9]), precedence=pairs)
    with pytest.raises(SolveError, match="keep no precedence"):
        solve(ordered, OPTIONS)
    with pytest.raises(OptionError, match="use threads, processes or dask://host:port"):
        solve(PROBLEM, SolveOptions(colonies=2, colonies_on="thread", iterations=1, bound=False))


def nodes_of(tour: Path) -> list[int]:
    """Return the nodes of a tour in TSPLIB format, from 1."""
    words = tour.read_text().split("TOUR_SECTION")[1].split()
    return [int(word) for word in words[: words.index("-1")]]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    made = Cluster(tmp_path)
    yield made
    made.end()


def test_a_worker_of_two_that_is_killed_in_the_middle_changes_nothing(cluster: Cluster, tmp_path: Path) -> None:
    """It is killed after it has worked for a while, and the search is not over then."""
    size = ["random:1000:3", "--preset", "fast", "--colonies", "4", "--iterations", "2"]
    words = ["solve", *size, "--no-bound", "--no-defaults", "--json"]
    tours = [tmp_path / "alone.tour", tmp_path / "cluster.tour"]
    begin = [sys.executable, "-c", "from leafcut.cli import main; main()", *words, "--tour"]
    subprocess.run([*begin, str(tours[0])], capture_output=True, check=True)
    there = [*begin, str(tours[1]), "--colonies-on", cluster.spec]
    with subprocess.Popen(there, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as job:
        cluster.until_busy()
        cluster.workers[0].send_signal(signal.SIGKILL)
        assert job.poll() is None
        _, err = job.communicate(timeout=200)
    assert job.returncode == 0, err
    alone, other = map(nodes_of, tours)
    assert alone == other
    assert sorted(alone) == list(range(1, 1001))
