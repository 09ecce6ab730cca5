"""Algorithms of packages: their results are checked, and their errors name them."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
import pytest

from leafcut.errors import OptionError, SolveError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import ALGORITHM_TITLES, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import packaged
from leafcut.order.algorithms import algorithm_titles
from leafcut.order.instance import Instance, build_instance
from leafcut.order.search import AlgorithmRun, Best, SearchResult
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from packages import Installer

POINTS = np.random.default_rng(5).uniform(0, 40, (30, 2))


class Toy:
    """What all below are but for one thing: nodes in the order of their numbers."""

    title = "toy"

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        return SearchResult(self.tour(instance))

    def tour(self, instance: Instance) -> Any:
        return np.arange(instance.n, dtype=np.int32)


class Short(Toy):
    """Leaves a node out."""

    def tour(self, instance: Instance) -> Any:
        return np.arange(instance.n - 1)


class Twice(Toy):
    """Visits a node twice."""

    def tour(self, instance: Instance) -> Any:
        return np.maximum(np.arange(instance.n), 1)


class Nothing(Toy):
    """Returns no tour."""

    def tour(self, instance: Instance) -> Any:
        return None


class Torn(Toy):
    """Parts the start from the end."""

    def tour(self, instance: Instance) -> Any:
        return np.roll(np.arange(instance.n), instance.n // 2)[np.argsort(np.arange(instance.n) % 2, kind="stable")]


class Crashing(Toy):
    """Raises."""

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        raise ValueError("no\nway")


class Boasting(Toy):
    """Offers a bad tour as a very short one, and returns a better one."""

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        run.best.offer(np.random.default_rng(1).permutation(instance.n).astype(np.int32), 0.001, 0)
        return SearchResult(self.tour(instance), 1)


class Stopped(Toy):
    """Is ended by Ctrl-C once it has a tour."""

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        run.best.offer(self.tour(instance), instance.length(self.tour(instance)), 0)
        raise KeyboardInterrupt


class StoppedTwice(Stopped):
    """Is ended by Ctrl-C after it has offered a tour that visits a node twice."""

    def tour(self, instance: Instance) -> Any:
        return np.maximum(np.arange(instance.n, dtype=np.int32), instance.n == 30)


class Telling(Toy):
    """Reports its progress."""

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        run.best.offer(self.tour(instance), instance.length(self.tour(instance)), 0)
        run.best.tell(1)
        return SearchResult(run.best.tour, 1)


class Untitled(Toy):
    """Has no title."""

    title = None  # type: ignore[assignment]


HERE = (Toy, Short, Twice, Nothing, Torn, Crashing, Boasting, Stopped, StoppedTwice, Telling, Untitled)


@pytest.fixture(autouse=True)
def installed(install: Installer) -> None:
    """Install a package with all of them, and with two names that are leafcut's own."""
    points = {one.__name__.lower(): f"{__name__}:{one.__name__}" for one in HERE}
    install("toys", {"leafcut.algorithms": {**points, "mmas": f"{__name__}:Toy", "auto": f"{__name__}:Toy"}})


def found_by(name: str, ends: Any = None, **more: Any) -> Any:
    problem = RoutingProblem.of_points(POINTS, Metric(), closed=ends is None, start=ends, end=ends)
    return solve(problem, SolveOptions(algorithm=name), **more)


def test_one_is_an_object_or_a_class_and_its_tour_is_what_is_driven() -> None:
    found = found_by("toy")
    assert sorted(found.nodes.tolist()) == list(range(30))
    assert found.algorithm == "toy"
    assert found.lower_bound <= found.cost


@pytest.mark.parametrize("name", ["short", "twice", "nothing"])
def test_what_is_no_tour_is_refused(name: str) -> None:
    with pytest.raises(
        SolveError,
        match=f"algorithm '{name}' did not return a tour that visits each of the 40 nodes|not part of leafcut",
    ):
        found_by(name)


def test_a_tour_that_parts_the_start_from_the_end_is_refused() -> None:
    with pytest.raises(
        SolveError, match="algorithm 'torn' did not return a tour that visits each of the 32 nodes once, with its ends"
    ):
        found_by("torn", (1.0, 2.0))


def test_what_it_raises_is_told_in_a_line_as_its_own() -> None:
    with pytest.raises(
        SolveError, match=r"^algorithm 'crashing' failed \(ValueError: no way\); it is not part of leafcut$"
    ):
        found_by("crashing")


def test_lengths_that_it_tells_are_not_believed() -> None:
    found, honest = found_by("boasting"), found_by("toy")
    assert found.cost == honest.cost
    assert [cost for _, cost in found.history] == sorted((cost for _, cost in found.history), reverse=True)
    assert found.history[-1][1] == found.cost


def test_ctrl_c_keeps_its_best_tour() -> None:
    cancelled = threading.Event()
    found = found_by("stopped", cancelled=cancelled)
    assert found.stopped_early
    assert cancelled.is_set()
    assert sorted(found.nodes.tolist()) == list(range(30))


def test_ctrl_c_keeps_no_tour_that_is_wrong() -> None:
    with pytest.raises(SolveError, match="did not return a tour that visits each of the 30 nodes once"):
        found_by("stoppedtwice")


def test_the_iterations_that_it_counts_are_those_of_the_result() -> None:
    assert (found_by("toy").iterations, found_by("telling").iterations) == (0, 1)


def test_what_whoever_is_told_raises_ends_it_as_it_is() -> None:
    def cancel(*_: object) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        found_by("telling", progress=cancel)


def test_one_that_cannot_be_used_is_told_also_where_there_is_nothing_to_order() -> None:
    words = "the algorithm 'untitled' is a plug-in of toys that cannot be used .*must have a title of one line"
    for n in (0, 2, 30):
        with pytest.raises(OptionError, match=words):
            solve(RoutingProblem.of_points(POINTS[:n]), SolveOptions(algorithm="untitled"))


def test_leafcuts_own_are_not_replaced() -> None:
    titles = algorithm_titles()
    assert {name: titles[name] for name in ALGORITHM_TITLES} == ALGORITHM_TITLES
    assert "cannot be used" in titles["untitled"]
    assert found_by("mmas").cost < found_by("toy").cost


@pytest.mark.parametrize("apart", [1, 5, 3])
def test_the_ends_of_a_path_are_neighbours_of_the_tour_also_across_its_end(apart: int) -> None:
    instance = build_instance(RoutingProblem.of_points(POINTS[:4], start=(0.0, 0.0), end=(9.0, 9.0)), 3)
    tour = [0, 1, 2, 3]
    tour.insert(0, instance.first)
    tour.insert(apart, instance.second)
    for way in (tour, tour[::-1]):
        if apart == 3:
            with pytest.raises(SolveError) as refused:
                packaged._checked_tour("torn", instance, way)
            assert str(refused.value) == (
                "algorithm 'torn' did not return a tour that visits each of the 6 nodes once, with its ends adjacent; "
                "it is not part of leafcut"
            )
        else:
            checked = packaged._checked_tour("torn", instance, np.array(way, dtype=np.int64))
            assert (checked.tolist(), checked.dtype) == (way, np.int32)


def test_the_shortest_of_the_returned_and_the_offered_tour_counts() -> None:
    instance = build_instance(RoutingProblem.of_points(POINTS[:9], closed=True), 3)
    tours = [np.random.default_rng(seed).permutation(9).astype(np.int32) for seed in range(4)]
    best = min(tours, key=instance.length)
    assert packaged._shortest_checked_tour("toy", instance, tours).tolist() == best.tolist()
    assert packaged._shortest_checked_tour("toy", instance, tours[::-1]).tolist() == best.tolist()


@pytest.mark.parametrize("title", [None, "two\nlines", "good"])
def test_an_algorithm_has_a_title_in_one_line_and_a_method(title: str | None) -> None:
    class Bare:
        pass

    for one in (Bare(), Toy()):
        one.title = title  # type: ignore[union-attr]
        if title == "good" and isinstance(one, Toy):
            assert packaged._create_algorithm("toy", one) is one
            continue
        with pytest.raises(
            TypeError, match=r"^an algorithm must have a title of one line and a method solve\(instance, run\)$"
        ):
            one.solve = 5 if isinstance(one, Bare) else one.solve  # type: ignore[union-attr]
            packaged._create_algorithm("toy", one)
    assert isinstance(packaged._create_algorithm("toy", Toy), Toy)


@pytest.mark.parametrize("reports", [False, True])
def test_an_algorithm_has_a_budget_of_visits_and_its_progress_is_passed_on(reports: bool) -> None:
    """4·10⁶ visits, and 40 iterations without a gain; memory errors and refusals of leafcut stay what they are."""
    instance, seen = build_instance(RoutingProblem.of_points(POINTS, closed=True), 3), []
    best = Best(Stop(), seen.append if reports else None)
    run = AlgorithmRun(SolveOptions(), AcoOptions(), FireflyOptions(), best)
    found = packaged.run_plugin_algorithm("telling", instance, run)
    assert (run.stop.iterations, run.stop.patience) == (math.ceil(4e6 / 30), 40)
    assert found.tour.tolist() == list(range(30))
    assert (found.iterations, len(seen)) == (1, int(reports))
    assert best.progress == (seen.append if reports else None)
    for error in (MemoryError, SolveError, KeyboardInterrupt):

        def fail(*_: object, error: type[BaseException] = error) -> None:
            raise error

        toy = packaged.PACKAGED.load("toy")
        with pytest.MonkeyPatch.context() as patch, pytest.raises(error):
            patch.setattr(type(toy), "solve", fail)
            packaged.run_plugin_algorithm(
                "toy", instance, AlgorithmRun(SolveOptions(), AcoOptions(), FireflyOptions(), Best(Stop()))
            )
