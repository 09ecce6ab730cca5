"""The recorded values of every iteration are correct, and recording does not change the result."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from leafcut.kernels.pheromone import branching_factor
from leafcut.model import study as room
from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import Observer, Snapshot
from leafcut.model.study import Study
from leafcut.options import LITERATURE, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.instance import build_instance
from leafcut.order.literature.ants import Ants
from leafcut.order.literature.fireflies import PlaceFireflies
from leafcut.order.literature.pheromone import TRAILS, AntParameters
from leafcut.order.search import Tours
from leafcut.order.solve import solve

XY = np.random.default_rng(4).uniform(0.0, 100.0, (40, 2))
MAP = RoutingProblem.of_points(XY, closed=True)
FEW = AcoOptions(n_ants=5)
SWARM = FireflyOptions(n_fireflies=4)


def alone(algorithm: str, **more: object) -> SolveOptions:
    return SolveOptions(algorithm=algorithm, iterations=6, threads=1, local_search=False, **more)  # type: ignore[arg-type]


def length(tour: np.ndarray) -> float:
    """Return the length of a closed tour, by the theorem of Pythagoras."""
    return sum(math.dist(XY[a], XY[b]) for a, b in zip(tour, [*tour[1:], tour[0]], strict=True))


def noted(construct: Callable, label: np.ndarray, found: list[list[float]]) -> Callable:
    """Return the construction of an algorithm that also keeps the lengths of its tours."""

    def construct_and_note(strategy: Any, iteration: int) -> Tours:
        tours, costs = construct(strategy, iteration)
        if tours.shape[1] == len(label) and len(tours) > 2:  # else it is a search that compiles the kernels
            found.append([length(label[tour]) for tour in tours])
        return tours, costs

    return construct_and_note


@pytest.mark.parametrize("algorithm", LITERATURE)
def test_best_mean_and_worst_are_those_of_the_tours_of_the_iteration(
    algorithm: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[list[float]] = []
    label = build_instance(MAP, 16).label
    for kind in (Ants, PlaceFireflies):
        monkeypatch.setattr(kind, "construct", noted(kind.construct, label, found))
    study = Study()
    solve(MAP, alone(algorithm), FEW, firefly=SWARM, observe=study)
    rows = study.iterations()
    assert [row.number for row in rows] == [1, 2, 3, 4, 5, 6]
    shortest = math.inf
    for row, lengths in zip(rows, found, strict=True):
        assert row.best == pytest.approx(min(lengths))
        assert row.mean == pytest.approx(sum(lengths) / len(lengths))
        assert row.worst == pytest.approx(max(lengths))
        shortest = min(shortest, row.shortest)
        assert row.shortest == shortest <= min(lengths) + 1e-9
    assert all(a.seconds <= b.seconds for a, b in itertools.pairwise(rows))


@pytest.mark.parametrize("algorithm", [*LITERATURE, "colony", "kicks"])
def test_a_study_changes_no_answer(algorithm: str) -> None:
    plain = solve(MAP, alone(algorithm), FEW, firefly=SWARM)
    studied = solve(MAP, alone(algorithm), FEW, firefly=SWARM, observe=Study())
    assert studied.nodes.tobytes() == plain.nodes.tobytes()
    assert (studied.cost, studied.iterations, studied.lower_bound) == (plain.cost, plain.iterations, plain.lower_bound)


def test_of_a_search_without_trails_or_iterations_of_tours_nothing_is_made_up() -> None:
    study = Study()
    solve(MAP, alone("colony"), observe=study)
    assert study.iterations()
    assert all(row.best is row.mean is row.worst is row.branching is None for row in study.iterations())
    solve(MAP, alone("firefly"), firefly=SWARM, observe=study)
    assert len(study.searches) == 2
    assert all(row.mean is not None and row.branching is None for row in study.iterations())


def test_the_branching_factor_is_that_reckoned_by_hand() -> None:
    """With λ = 0.05 the marks of the nodes are 1.45, 2, 0.295 and 1.

    Node 0 has trails 1, 10 and 1.45: two reach 1 + 0.05·9. All of node 1 are equal: three reach it. Node 2 has one edge
    alone at 4.1 and others at 0.095: 0.095 + 0.05·4.005 = 0.29525, one reaches it. Node 3 has two edges, 1 and 1.
    """
    lists = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, -1]], dtype=np.int32)
    trails = np.array([[1.0, 10.0, 1.45], [2.0, 2.0, 2.0], [4.1, 0.095, 0.095], [1.0, 1.0, 99.0]])
    assert branching_factor(lists, trails, 0.05) == pytest.approx((2 + 3 + 1 + 2) / 4)


def test_an_entry_that_leads_nowhere_or_back_is_no_edge() -> None:
    lists = np.array([[0, 1, 2], [0, 1, 2], [-1, -1, -1]], dtype=np.int32)
    trails = np.array([[0.0, 5.0, 5.0], [1.0, 0.0, 9.0], [7.0, 7.0, 7.0]])
    assert branching_factor(lists, trails, 0.05) == pytest.approx((2 + 1) / 2)
    assert branching_factor(lists[2:], trails[2:], 0.05) == 1.0


def test_branching_falls_towards_two_as_ants_agree() -> None:
    study = Study()
    solve(MAP, replace(alone("mmas"), iterations=150), AcoOptions(n_ants=20, evaporation_rate=0.3), observe=study)
    factors = [row.branching for row in study.iterations()]
    assert all(factor is not None and 1.0 <= factor <= 16.0 for factor in factors)
    assert max(factors[:20]) > 3.0
    assert factors[-1] == pytest.approx(2.0, abs=0.5)


def test_of_a_long_search_every_second_or_fourth_iteration_is_kept_and_the_newest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(room, "MAX_KEPT", 10)
    study = Study()
    study.begin()
    for number in range(1, 36):
        study.note(number, 0.1 * number, 100.0 - number, np.array([3.0, math.inf, 5.0]))
    rows = study.iterations()
    assert [row.number for row in rows] == [1, 5, 9, 13, 17, 21, 25, 29, 33, 35]
    assert rows[-1][2:6] == (65.0, 3.0, 4.0, 5.0)


class Steps(Observer):
    """Takes every snapshot."""

    def __init__(self) -> None:
        self.seen: list[Snapshot] = []

    def show(self, take, alone: bool) -> None:  # type: ignore[no-untyped-def]
        self.seen.append(take())


@pytest.mark.parametrize("algorithm", LITERATURE[:-1])
def test_the_example_of_a_step_is_the_rule_of_the_book_in_numbers(algorithm: str) -> None:
    """From point 1: p = τ^α·η^β divided by the sum of all, d by Pythagoras; lists are full, so all steps are shown."""
    steps, few = Steps(), XY[:6]
    ants = AcoOptions(n_ants=5, pheromone_weight=1.5, heuristic_weight=3.0)
    problem = RoutingProblem.of_points(few, closed=True)
    solve(problem, alone(algorithm, candidates=0), ants, observe=steps)
    for one in steps.seen:
        assert one.step is not None
        assert one.step.here == 1
        v, choices = one.step.values, one.step.choices
        assert (v["alpha"], v["beta"], v["m"]) == (1.5, 3.0, 5)
        assert sorted(c.place for c in choices) == [2, 3, 4, 5, 6]
        for c in choices:
            assert c.cost == pytest.approx(math.dist(few[0], few[c.place - 1]))
            assert c.attraction == pytest.approx(1.0 / (c.cost + v["epsilon"]))
        weights = [c.pheromone**1.5 * c.attraction**3.0 for c in choices]
        assert [c.probability for c in choices] == pytest.approx([w / sum(weights) for w in weights])
        assert v["c_iteration"] >= v["c_best"] - 1e-9
        assert v["c_best"] == pytest.approx(one.cost)


def test_the_trails_start_from_what_is_asked_for_else_from_the_books_rule() -> None:
    lists = np.array([[1, 2], [0, 2], [0, 1]], dtype=np.int32)
    asked = AntParameters.from_options("acs", AcoOptions(initial_pheromone=0.25), 3, False)
    assert TRAILS["acs"](lists, asked, 50.0).pheromone.tolist() == [[0.25, 0.25]] * 3
    usual = AntParameters.from_options("acs", AcoOptions(), 3, False)
    assert TRAILS["acs"](lists, usual, 50.0).initial == pytest.approx(1.0 / (3 * 50.0))


def test_the_darkest_firefly_flies_to_the_most_attractive_of_the_shorter_ones() -> None:
    steps = Steps()
    solve(MAP, alone("firefly"), firefly=SWARM, observe=steps)
    told = [one.step for one in steps.seen if one.step is not None and "target" in one.step.values]
    assert told
    for step in told:
        v = step.values
        assert v["r"] == pytest.approx(10.0 * v["edges_apart"] / 40)
        assert v["beta"] == pytest.approx(v["beta_0"] * math.exp(-v["gamma"] * v["r"] ** 2))
        assert v["c_target"] < v["c_dark"]
        assert v["target"] != v["dark"]
