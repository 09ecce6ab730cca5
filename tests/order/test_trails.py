"""Pheromone trails: each algorithm evaporates and deposits as its equations say, on a full matrix of edges."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from leafcut.kernels import pheromone
from leafcut.model.snapshot import NextPlace, SearchStep
from leafcut.options import AcoOptions
from leafcut.order.literature.pheromone import TRAILS, AntParameters, Trails, deposit_interval, trail_limit_ratio
from leafcut.order.search import Best
from leafcut.order.stop import Stop
from plain_python import plain_parts, plain_python

__all__ = ["plain_parts"]

pytestmark = pytest.mark.usefixtures("plain_parts")

N, ANTS, C_NN = 6, 5, 40.0

#: Every other node, so that the lists hold all edges.
LISTS = np.array([[j for j in range(N) if j != i] for i in range(N)], dtype=np.int32)

#: The numbers of the options, each unlike all others.
OPTIONS = AcoOptions(n_ants=ANTS, pheromone_weight=1.5, heuristic_weight=3.0, evaporation_rate=0.2)


def trails_of(algorithm: str, one_way: bool = False, local_search: bool = False) -> Trails:
    """Return trails on all edges, which are not equal."""
    parameters = AntParameters.from_options(algorithm, OPTIONS, N, local_search)
    parameters = replace(parameters, elitist_weight=2.5, ranks=4, local_rate=0.3)
    trails = TRAILS[algorithm](LISTS, parameters, C_NN, one_way=one_way)
    trails.nearness[:] = np.random.default_rng(2).uniform(0.5, 2.0, LISTS.shape)
    tau = np.random.default_rng(1).uniform(0.01, 0.1, (N, N))
    tau = tau if one_way else (tau + tau.T) / 2
    trails.pheromone[:] = np.take_along_axis(tau, LISTS, axis=1)
    return trails


def matrix(trails: Trails) -> np.ndarray:
    """Return the trails as a matrix float64[n, n]."""
    tau = np.zeros((N, N))
    np.put_along_axis(tau, LISTS.astype(np.int64), trails.pheromone, axis=1)
    return tau


def proposed() -> tuple[np.ndarray, np.ndarray, Best]:
    """Return tours, their costs (the last is unfinished), and a best tour that is not among them."""
    rng = np.random.default_rng(7)
    tours = np.array([rng.permutation(N) for _ in range(ANTS)], dtype=np.int32)
    best = Best(Stop())
    best.offer(rng.permutation(N).astype(np.int32), 30.0, 0)
    return tours, np.array([44.0, 35.0, 50.0, 38.0, math.inf]), best


def lay(tau: np.ndarray, tour: np.ndarray, amount: float, one_way: bool, most: float = math.inf) -> None:
    """Add an amount to the edges of a closed tour, in both directions unless `one_way`."""
    for a, b in zip(tour, np.roll(tour, -1), strict=True):
        tau[a, b] = min(most, tau[a, b] + amount)
        if not one_way:
            tau[b, a] = min(most, tau[b, a] + amount)


@pytest.mark.parametrize("one_way", [False, True])
@pytest.mark.parametrize("algorithm", ["as", "eas", "asrank", "acs"])
def test_trails_change_by_the_equations_of_the_algorithm(algorithm: str, one_way: bool) -> None:
    """Dorigo and Stützle 2004: equations 3.2 to 3.4 (as), 3.5 (eas), 3.6 (asrank) and 3.11 (acs)."""
    trails = trails_of(algorithm, one_way)
    tours, costs, best = proposed()
    tau = matrix(trails)
    if algorithm != "acs":
        tau *= 0.8
    if algorithm in ("as", "eas"):
        for k in range(4):
            lay(tau, tours[k], 1.0 / costs[k], one_way)
    if algorithm == "eas":
        lay(tau, best.tour, 2.5 / 30.0, one_way)
    if algorithm == "asrank":
        for weight, k in ((3, 1), (2, 3), (1, 0)):  # by cost: 35, 38, 44
            lay(tau, tours[k], weight / costs[k], one_way)
        lay(tau, best.tour, 4.0 / 30.0, one_way)
    if algorithm == "acs":
        for a, b in zip(best.tour, np.roll(best.tour, -1), strict=True):
            tau[a, b] = 0.8 * tau[a, b] + 0.2 / 30.0
            if not one_way:
                tau[b, a] = 0.8 * tau[b, a] + 0.2 / 30.0
    with plain_python():
        trails.reinforce(1, tours, costs, best)
    assert matrix(trails) == pytest.approx(tau)
    assert trails.weights == pytest.approx(trails.pheromone**1.5 * trails.nearness)
    assert trails.iteration_best == 35.0


@pytest.mark.parametrize("local_search", [False, True])
@pytest.mark.parametrize("iteration", [24, 25, 30, 31])
def test_max_min_lets_one_ant_deposit_within_its_limits(iteration: int, local_search: bool) -> None:
    """Section 3.3.4: τ_max = 1/ρC; τ_min by p_best, or τ_max/2n with local search; the best-so-far tour by turns.

    From the 25th iteration on, the best-so-far tour deposits every fifth time with local search (ACOTSP), and every
    25th time without.
    """
    trails = trails_of("mmas", local_search=local_search)
    tours, costs, best = proposed()
    highest = 1.0 / (0.2 * 30.0)
    # n edges are chosen, each of (5 + 1)/2 on average: p_best is the chance of the best tour where trails are limits.
    root = 0.05 ** (1.0 / N)
    lowest = highest / (2.0 * N) if local_search else highest * (1.0 - root) / (3.0 * root)
    trails.pheromone[0] = 0.99 * highest / 0.8
    tau = np.maximum(0.8 * matrix(trails), lowest)
    np.fill_diagonal(tau, 0.0)
    by_best = iteration == 25 or (iteration == 30 and local_search)
    lay(tau, best.tour if by_best else tours[1], 1.0 / (30.0 if by_best else 35.0), False, highest)
    with plain_python():
        trails.reinforce(iteration, tours, costs, best)
    assert (trails.highest, trails.lowest) == pytest.approx((highest, lowest))
    assert matrix(trails) == pytest.approx(tau)
    assert trails.depositor == ("best" if by_best else "iteration")
    assert matrix(trails).max() <= highest


def test_the_best_tour_so_far_deposits_ever_more_often() -> None:
    """The schedule of ACOTSP, counted over whole stretches of iterations."""
    every = {since: deposit_interval(since, True) for since in (0, 24, 25, 74, 75, 124, 125, 249, 250, 9999)}
    assert every == {0: 25, 24: 25, 25: 5, 74: 5, 75: 3, 124: 3, 125: 2, 249: 2, 250: 1, 9999: 1}
    assert {deposit_interval(since, False) for since in (0, 30, 100, 9999)} == {25}


@pytest.mark.parametrize(
    ("iteration", "best_at", "agree", "restarts"),
    [(300, 50, True, True), (300, 51, True, False), (301, 0, True, False), (300, 50, False, False),
     (200, 0, True, False)],
)  # fmt: skip
def test_max_min_starts_again_with_equal_trails_once_converged_and_stuck(
    iteration: int, best_at: int, agree: bool, restarts: bool
) -> None:
    """Only every hundredth iteration, 250 without a better tour, and where two edges a node have all the pheromone."""
    trails = trails_of("mmas")
    tours, costs, best = proposed()
    best.iteration = best_at
    if agree:
        tau = np.full((N, N), 1e-6)
        lay(tau, best.tour, 1.0, False)
        trails.pheromone[:] = np.take_along_axis(tau, LISTS, axis=1)
    with plain_python():
        trails.reinforce(iteration, tours, costs, best)
        assert (trails.depositor == "restart") == restarts
        if not restarts:
            assert np.ptp(trails.pheromone) > 0.0
            assert trails.restarted_at == 0
            return
        assert (trails.pheromone == trails.highest).all()
        assert trails.highest == pytest.approx(1.0 / (0.2 * 30.0))
        assert trails.restarted_at == iteration
        # The iterations since then count: it does not start again at once.
        trails.pheromone[:] = np.take_along_axis(tau, LISTS, axis=1)
        trails.reinforce(iteration + 100, tours, costs, best)
        assert trails.depositor != "restart"


@pytest.mark.parametrize("algorithm", ["as", "eas", "asrank", "mmas", "acs"])
def test_trails_of_another_colony_are_laid_as_it_laid_them(algorithm: str) -> None:
    """Of two colonies with the same rules and equal trails, one learns; the other receives, without evaporation."""
    giver, taker = trails_of(algorithm), trails_of(algorithm)
    giver.changes = []
    tours, costs, best = proposed()
    tau = matrix(taker)
    with plain_python():
        giver.reinforce(1, tours, costs, best)
        taker.highest = giver.highest
        taker.add_deposits(giver.changes)
    if algorithm == "acs":
        assert matrix(taker) == pytest.approx(matrix(giver))
    else:
        for tour, amount in giver.changes:
            lay(tau, tour, amount, False, giver.highest)
        assert matrix(taker) == pytest.approx(tau)
    laid = {"as": 4, "eas": 5, "asrank": 4, "mmas": 1, "acs": 1}
    assert len(giver.changes) == laid[algorithm]
    assert taker.weights == pytest.approx(taker.pheromone**1.5 * taker.nearness)


def test_the_branching_factor_counts_the_strong_edges_of_a_node() -> None:
    """Node 0: trails 0, 1, 4 with mark 0 + 0.25 · 4 = 1, so two; node 1: equal trails, so both of its two edges.

    Node 2 has no edge but one to itself, and is left out.
    """
    lists = np.array([[1, 2, 3], [0, 1, 2], [2, -1, -1]], dtype=np.int32)
    tau = np.array([[0.0, 1.0, 4.0], [5.0, 99.0, 5.0], [7.0, 8.0, 9.0]])
    with plain_python():
        assert pheromone.branching_factor(lists, tau, 0.25) == 2.0
        assert pheromone.branching_factor(lists, tau, 0.26) == 1.5
        assert pheromone.branching_factor(lists[2:], tau[2:], 0.25) == 1.0


def test_local_decay_moves_a_trail_towards_the_first_one() -> None:
    """Equation 3.12: (1 − 0.3) · 2 + 0.3 · 5 = 2.9; its weight is 2.9² · 10."""
    tau, nearness, weights = np.full((2, 2), 2.0), np.full((2, 2), 10.0), np.zeros((2, 2))
    with plain_python():
        pheromone.decay_edge(tau, nearness, weights, 2.0, 0.3, 5.0, 1, 0)
    assert tau.tolist() == [[2.0, 2.0], [pytest.approx(2.9), 2.0]]
    assert weights.tolist() == [[0.0, 0.0], [pytest.approx(84.1), 0.0]]


@pytest.mark.parametrize(
    ("algorithm", "ants", "rate"),
    [("as", 80, 0.5), ("eas", 80, 0.5), ("asrank", 80, 0.1), ("mmas", 80, 0.02), ("acs", 10, 0.1)],
)
def test_parameters_are_those_recommended_by_the_book(algorithm: str, ants: int, rate: float) -> None:
    """Dorigo and Stützle 2004, box 3.1, for 80 nodes without local search; e is the number of ants."""
    found = AntParameters.from_options(algorithm, AcoOptions(), 80, False)
    assert (found.ants, found.rate, found.elitist_weight) == (ants, rate, ants)
    assert found.greedy_probability == (0.9 if algorithm == "acs" else 0.0)
    assert AntParameters.from_options(algorithm, AcoOptions(), 80, True).ants == (10 if algorithm == "acs" else 25)


@pytest.mark.parametrize(
    ("algorithm", "initial", "own"),
    [
        ("as", 5 / 40.0, {}),
        ("eas", (5 + 5) / (0.2 * 40.0), {"e": 5}),
        ("asrank", 0.5 * 5 * 4 / (0.2 * 40.0), {"w": 5}),
        ("mmas", 1.0 / (0.2 * 40.0), {"tau_max": math.inf, "tau_min": 0.0}),
        ("acs", 1.0 / (6 * 40.0), {"q_0": 0.9, "xi": 0.1}),
    ],
)
def test_the_first_trails_and_the_variables_of_a_step(algorithm: str, initial: float, own: dict[str, float]) -> None:
    """Box 3.1 of the book, with 5 ants, ρ = 0.2 and a nearest-neighbour tour of 40."""
    parameters = AntParameters.from_options(algorithm, OPTIONS, N, True)
    trails = TRAILS[algorithm](LISTS, parameters, C_NN)
    assert trails.pheromone.tolist() == [[pytest.approx(initial)] * 5] * N
    assert trails.offset == pytest.approx(1e-3 * 40.0 / 6)
    assert (trails.highest, trails.lowest, trails.depositor, trails.changes) == (math.inf, 0.0, "", None)
    best = Best(Stop(), cost=30.0)
    values = {
        "alpha": 1.5, "beta": 3.0, "rho": 0.2, "m": 5, "tau_0": pytest.approx(initial),
        "epsilon": pytest.approx(1e-3 * 40.0 / 6), "c_best": 30.0, "lambda": 5.0,
    }  # fmt: skip
    assert trails.describe_iteration(best) == SearchStep(algorithm, values | own, "", 0, ())
    trails.depositor, trails.iteration_best = "best", 44.0
    place = NextPlace(place=1, cost=2.0, pheromone=3.0, attraction=4.0, probability=0.5)
    assert trails.describe_iteration(best, 3, (place,)) == SearchStep(
        algorithm, values | {"c_iteration": 44.0} | own, "best", 3, (place,)
    )


def test_all_parameters_of_an_algorithm() -> None:
    given = AcoOptions(
        n_ants=4,
        pheromone_weight=1.5,
        heuristic_weight=3.0,
        evaporation_rate=0.3,
        greedy_probability=0.7,
        initial_pheromone=0.25,
    )
    assert AntParameters.from_options("acs", given, 80, False) == AntParameters(
        "acs", 4, 1.5, 3.0, 0.3, 4, 4, 0.7, 0.1, False, 0.25
    )
    assert AntParameters.from_options("asrank", given, 80, True) == AntParameters(
        "asrank", 4, 1.5, 3.0, 0.3, 4, 4, 0.0, 0.0, True, 0.25
    )
    many = AcoOptions(n_ants="parts")
    assert AntParameters.from_options("mmas", many, 80, True).ants == 80
    assert AntParameters.from_options("mmas", AcoOptions(), 80, True).rate == 0.2
    assert [AntParameters.from_options("as", AcoOptions(), n, False).ants for n in (999, 1000, 1001)] == [
        999,
        1000,
        1000,
    ]
    assert AntParameters.from_options("asrank", AcoOptions(), 80, False).ranks == 6
    for ants, initial in ((1, 5.0), (2, 5.0), (3, 15.0)):
        few = AntParameters.from_options("asrank", AcoOptions(n_ants=ants, evaporation_rate=0.2), 80, False)
        assert TRAILS["asrank"](LISTS, few, 1.0).initial == pytest.approx(initial)
    assert AntParameters.from_options("as", AcoOptions(), 80, True).initial is None
    for name, rate in (("as", 0.5), ("eas", 0.5), ("asrank", 0.1), ("mmas", 0.2), ("acs", 0.1)):
        assert AntParameters.from_options(name, AcoOptions(), 80, True).rate == rate


def test_a_trail_limit_is_a_share_by_the_chance_of_the_best_tour_or_by_the_number_of_nodes() -> None:
    """Equation 3.9 for lists of one edge, of which half an edge counts as one; it never exceeds the upper limit."""
    plain = AntParameters.from_options("mmas", OPTIONS, 50, False)
    root = 0.05 ** (1 / 50)
    assert trail_limit_ratio(plain, 50, 16) == pytest.approx((1 - root) / (8.5 * root))
    assert trail_limit_ratio(plain, 50, 1) == pytest.approx((1 - root) / root)
    assert trail_limit_ratio(plain, 2, 1) == 1.0
    assert trail_limit_ratio(replace(plain, local_search=True), 50, 16) == 0.01
