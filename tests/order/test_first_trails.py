"""Pheromone before the first ant: τ₀ by hand, drawn trails, none at all; one iteration of Ant System added up again."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from leafcut.errors import OptionError
from leafcut.kernels.construct import choose_next_candidate
from leafcut.kernels.ordering import choose_next_cluster
from leafcut.model.problem import RoutingProblem
from leafcut.options import ANT_ALGORITHMS, AcoOptions, SolveOptions
from leafcut.order.instance import Instance, build_instance
from leafcut.order.literature.ants import Ants, initial_trails
from leafcut.order.literature.pheromone import AntParameters, Trails
from leafcut.order.literature.places import Places
from leafcut.order.search import Best
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from plain_python import plain_parts

__all__ = ["plain_parts"]

pytestmark = pytest.mark.usefixtures("plain_parts")

#: Of five places 1 mm apart on a line the nearest-neighbour tour from the first is 4 mm there and 4 mm back.
LINE, C_NN = build_instance(RoutingProblem.of_points([(x, 0.0) for x in range(5)], closed=True), 0), 8.0


def trails(instance: Instance, c_nn: float, algorithm: str = "as", seed: int = 1, **options: object) -> Trails:
    """Return the first trails of an algorithm."""
    parameters = AntParameters.from_options(algorithm, AcoOptions(**options), instance.n, local_search=False)
    return initial_trails(Places(instance, False), parameters, c_nn, seed)


@pytest.mark.parametrize(
    "algorithm, options, by_hand",
    [
        ("as", {"initial_pheromone": "1/nrC"}, 1 / (5 * 0.5 * 8)),
        ("as", {"initial_pheromone": "1/nrC", "evaporation_rate": 0.3}, 1 / (5 * 0.3 * 8)),
        ("acs", {"initial_pheromone": "1/nC"}, 1 / (5 * 8)),
        ("acs", {}, 1 / (5 * 8)),
        ("as", {}, 5 / 8),
        ("mmas", {"initial_pheromone": 0}, 0.0),
        ("as", {"initial_pheromone": "0.25"}, 0.25),
    ],
)
def test_the_first_pheromone_is_that_of_a_hand_calculation(algorithm: str, options: dict, by_hand: float) -> None:
    assert trails(LINE, C_NN, algorithm, **options).pheromone == pytest.approx(by_hand)


@pytest.mark.parametrize(
    "value, words", [("nC", "'nC' is not a number or one of random, 1/nrC, 1/nC"), (-1, "-1 is below the minimum")]
)
def test_what_is_no_first_pheromone_is_refused(value: object, words: str) -> None:
    with pytest.raises(OptionError, match=f"--initial-pheromone: {words}"):
        AcoOptions(initial_pheromone=value)


def test_drawn_trails_are_shares_of_one_by_n_c_and_the_same_from_both_ends() -> None:
    n = 60
    instance = build_instance(RoutingProblem.of_points(np.random.default_rng(3).uniform(0, 9, (n, 2)), closed=True), 8)
    drawn = [trails(instance, 100.0, "as", seed, initial_pheromone="random").pheromone for seed in (1, 1, 2)]
    assert np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[0], drawn[2])
    assert 0.0 < drawn[0].min() < 0.1 / (100 * n)
    assert 0.9 / (100 * n) < drawn[0].max() < 1.0 / (100 * n)
    assert drawn[0].mean() == pytest.approx(0.5 / (100 * n), rel=0.1)
    of_edge: dict[frozenset[int], set[float]] = {}
    for i, row in enumerate(instance.candidates.tolist()):
        for j, trail in zip(row, drawn[0][i].tolist(), strict=True):
            of_edge.setdefault(frozenset((i, j)), set()).add(trail)
    assert all(len(values) == 1 for values in of_edge.values())
    assert len(of_edge) < instance.candidates.size


def test_an_ant_without_any_trail_chooses_by_nearness_alone() -> None:
    """Nearness 3, 1 and 4, the last visited: the first is taken three times of four; by its greed always."""
    near, nothing = np.array([[3.0, 1.0, 4.0]] * 4), np.zeros((4, 3))
    lists, visited = np.array([[1, 2, 3]] * 4, dtype=np.int32), np.array([1, 0, 0, 1], dtype=np.uint8)
    words = np.array([5], dtype=np.uint64)
    taken = [choose_next_candidate(lists, nothing, near, visited, 0, 0.0, words, 0) for _ in range(4000)]
    assert np.bincount(taken, minlength=3) / 4000 == pytest.approx([0.75, 0.25, 0.0], abs=0.03)
    assert {choose_next_candidate(lists, nothing, near, visited, 0, 1.0, words, 0) for _ in range(20)} == {0}
    missing = np.array([-1, 0, 0, -1], dtype=np.int32)
    near, nothing = np.array([[0.0, 3.0, 1.0, 4.0]] * 4), np.zeros((4, 4))
    taken = [choose_next_cluster(nothing, near, missing, 0, 0.0, words, 0) for _ in range(4000)]
    assert np.bincount(taken, minlength=4) / 4000 == pytest.approx([0.0, 0.75, 0.25, 0.0], abs=0.03)


def test_where_some_edge_has_a_trail_one_without_is_not_taken() -> None:
    near, weights = np.ones((3, 2)), np.array([[0.0, 1e-9]] * 3)
    lists, visited = np.array([[1, 2]] * 3, dtype=np.int32), np.array([1, 0, 0], dtype=np.uint8)
    words = np.array([5], dtype=np.uint64)
    assert {choose_next_candidate(lists, weights, near, visited, 0, 0.0, words, 0) for _ in range(100)} == {1}


@pytest.mark.parametrize("algorithm", ANT_ALGORITHMS)
@pytest.mark.parametrize("first", [0, "random", "1/nrC", "1/nC"])
def test_every_algorithm_finds_a_whole_tour_from_every_first_pheromone(algorithm: str, first: object) -> None:
    problem = RoutingProblem.of_points(np.random.default_rng(4).uniform(0, 40, (50, 2)), closed=True)
    options = SolveOptions(algorithm=algorithm, iterations=5, local_search=False, bound=False, threads=1)
    found = solve(problem, options, AcoOptions(initial_pheromone=first, n_ants=10))
    assert sorted(found.nodes.tolist()) == list(range(50))
    again = solve(problem, options, AcoOptions(initial_pheromone=first, n_ants=10))
    assert found.nodes.tolist() == again.nodes.tolist()


def test_one_iteration_of_ant_system_with_the_parameters_of_the_sheet_paper() -> None:
    """τ = 0.7·τ₀ + Σ 1/C over the ants that went along an edge; weights are √τ·√η. Both are added up edge by edge."""
    xy = np.random.default_rng(8).uniform(0, 50, (12, 2))
    instance = build_instance(RoutingProblem.of_points(xy, closed=True), 0)
    colony = trails(
        instance,
        300.0,
        n_ants="parts",
        pheromone_weight=0.5,
        heuristic_weight=0.5,
        evaporation_rate=0.3,
    )
    assert colony.parameters.ants == instance.n == 12
    first = float(colony.pheromone[0, 0])
    tours, costs = Ants(Places(instance, False), colony, 1, Stop()).construct(0)
    tours, costs = tours.copy(), costs.copy()
    colony.reinforce(0, tours, costs, Best(Stop()))
    places = xy[instance.label]
    laid: dict[frozenset[int], float] = {}
    for tour in tours.tolist():
        steps = [frozenset(pair) for pair in pairwise([*tour, tour[0]])]
        length = sum(float(np.hypot(*(places[a] - places[b]))) for a, b in pairwise([*tour, tour[0]]))
        for step in steps:
            laid[step] = laid.get(step, 0.0) + 1.0 / length
    for i, row in enumerate(instance.candidates.tolist()):
        for c, j in enumerate(row):
            tau = 0.7 * first + laid.get(frozenset((i, j)), 0.0)
            eta = 1.0 / (float(np.hypot(*(places[i] - places[j]))) + colony.offset)
            assert colony.pheromone[i, c] == pytest.approx(tau)
            assert colony.weights[i, c] == pytest.approx((tau * eta) ** 0.5)


@pytest.mark.parametrize("ends", [{"closed": True}, {"start": (0.0, 0.0)}])
def test_the_example_of_a_step_shows_the_five_likeliest_places_after_the_first(ends: dict[str, object]) -> None:
    """Their shares are of the weights of all candidates, the start and the free node included."""
    xy = np.random.default_rng(3).uniform(0.0, 9.0, (12, 2))
    instance = build_instance(RoutingProblem.of_points(xy, **ends), 0)  # type: ignore[arg-type]
    parameters = AntParameters.from_options("as", AcoOptions(), instance.n, False)
    moves = Places(instance, False)
    laid = initial_trails(moves, parameters, 50.0, 1)
    laid.pheromone[:] = np.random.default_rng(4).uniform(0.1, 1.0, laid.pheromone.shape)
    laid.update_weights()
    here = int(np.flatnonzero(instance.label == 0)[0])
    near = instance.candidates[here]
    total = laid.weights[here][near >= 0].sum()
    listed = sorted(
        (-laid.weights[here, c], c) for c in range(len(near)) if near[c] >= 0 and instance.label[near[c]] < 12
    )
    step = moves.snapshot_fields(laid, Best(Stop()))["step"]
    assert step.here == 1
    assert [place.place for place in step.choices] == [int(instance.label[near[c]]) + 1 for _, c in listed[:5]]
    for place, (weight, c) in zip(step.choices, listed[:5], strict=True):
        assert place.cost == instance.lengths[here, c]
        assert place.pheromone == laid.pheromone[here, c]
        assert place.attraction == pytest.approx(1.0 / (place.cost + 0.05 / instance.n))
        assert place.probability == pytest.approx(-weight / total)
    laid.weights[here] = 0.0
    assert moves.snapshot_fields(laid, Best(Stop()))["step"].choices == ()
    laid.weights[here] = math.inf
    assert moves.snapshot_fields(laid, Best(Stop()))["step"].choices == ()
