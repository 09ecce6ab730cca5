"""Ants and fireflies that order clusters: whole orders, kept precedence, true costs, and optima of few clusters."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from test_sequential import ENDS, KINDS, check, least, random_problem

from leafcut.errors import SolveError
from leafcut.kernels.ordering import count_different_steps, invert_runs
from leafcut.model.problem import RoutingProblem
from leafcut.options import LITERATURE, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.construction import random_states
from leafcut.order.directed import build_directed_instance
from leafcut.order.exact import choose_nodes_for_order
from leafcut.order.instance import path_cost
from leafcut.order.literature.choices import Choices
from leafcut.order.literature.fireflies import ChoiceFireflies
from leafcut.order.literature.flight import Flight
from leafcut.order.search import Best
from leafcut.order.solve import solve
from leafcut.order.stop import Stop


@pytest.mark.parametrize("algorithm", [*LITERATURE, "nn"])
@pytest.mark.parametrize("kind", KINDS)
def test_every_order_is_whole_keeps_precedence_and_states_its_cost(algorithm: str, kind: str) -> None:
    for seed in range(5):
        problem = random_problem(seed, 12, kind, ENDS[seed], pairs=6)
        options = SolveOptions(algorithm=algorithm, iterations=2, local_search=seed % 2 == 0, bound=False)
        found = solve(problem, options, AcoOptions(n_ants=3), firefly=FireflyOptions(n_fireflies=4))
        check(problem, found.nodes, found.cost)
        assert found.algorithm == algorithm
        assert found.history[-1][1] == pytest.approx(found.cost)


@pytest.mark.parametrize("algorithm", ["mmas", "acs", "firefly"])
def test_without_local_search_the_optimum_of_six_clusters_is_found(algorithm: str) -> None:
    """Ten problems, by dynamic programming over all sets; one may be missed."""
    missed = 0
    for seed in range(10):
        problem = random_problem(seed, 6, KINDS[seed % len(KINDS)], ENDS[seed % 5], pairs=3)
        options = SolveOptions(algorithm=algorithm, iterations=60, local_search=False, bound=False)
        found = solve(
            problem, options, AcoOptions(n_ants=10, greedy_probability=0.3), firefly=FireflyOptions(n_fireflies=10)
        )
        missed += found.cost > least(problem) * (1 + 1e-9)
    assert missed <= 1


@pytest.mark.parametrize("kind", KINDS)
def test_the_nodes_of_an_order_are_the_best_of_all(kind: str) -> None:
    """The kernel's choice costs what the plain one by NumPy does."""
    for seed in range(10):
        problem = random_problem(seed, 8, kind, ENDS[seed % 5], pairs=0)
        moves = Choices(build_directed_instance(problem, 6), False)
        order, length = moves.nearest_neighbour_order()
        nodes = moves.nodes_of_last_order()
        assert path_cost(problem, nodes) == pytest.approx(length)
        assert path_cost(problem, choose_nodes_for_order(problem, problem.cluster[nodes])) == pytest.approx(length)
        assert len(order) == moves.instance.n


def test_an_inversion_turns_one_run_round_and_leaves_the_rest() -> None:
    """Without precedence an order is two pieces of the old one and a third, turned, in between."""
    problem = random_problem(2, 9, "ways", (None, None), pairs=0)
    moves = Choices(build_directed_instance(problem, 6), False)
    words, m = np.array([9], dtype=np.uint64), moves.instance.n
    turned = set()
    for _ in range(60):
        order = np.append(m - 1, np.arange(m - 1)).astype(np.int32)
        before, place = order.copy(), np.argsort(order).astype(np.int32)
        invert_runs(moves.layers, order, place, 1, 4, words, 0)
        assert place.tolist() == np.argsort(order).tolist()
        changed = np.flatnonzero(order != before)
        run = slice(changed[0], changed[-1] + 1)
        assert order[run].tolist() == before[run][::-1].tolist()
        turned.add(run.stop - run.start)
    assert turned == {2, 3, 4}


def test_a_firefly_never_breaks_precedence() -> None:
    words = np.array([9], dtype=np.uint64)
    for seed in range(10):
        problem = random_problem(seed, 9, "holes", "closed", pairs=6)
        moves = Choices(build_directed_instance(problem, 6), False)
        order, _ = moves.nearest_neighbour_order()
        before, place = order.copy(), np.argsort(order).astype(np.int32)
        invert_runs(moves.layers, order, place, 200, 5, words, 0)
        assert order.tolist() != before.tolist()
        assert sorted(order.tolist()) == list(range(len(order)))
        assert all(place[a] < place[b] for a, b in problem.precedence.tolist())


def test_steps_apart_are_counted_as_by_hand() -> None:
    place = np.argsort([0, 1, 2, 3, 4]).astype(np.int32)
    assert count_different_steps(np.array([2, 3, 4, 0, 1], dtype=np.int32), place) == 1
    assert count_different_steps(np.array([4, 3, 2, 1, 0], dtype=np.int32), place) == 4


def test_the_same_seed_gives_the_same_answer_and_another_one_another_search() -> None:
    problem = random_problem(1, 30, "ways", (None, None), pairs=9)
    for algorithm in LITERATURE:
        options = [SolveOptions(algorithm=algorithm, iterations=2, local_search=False, seed=s) for s in (1, 1, 2)]
        aco, fireflies = AcoOptions(n_ants=5), FireflyOptions(n_fireflies=5)
        one, again, other = (solve(problem, o, aco, firefly=fireflies) for o in options)
        assert one.nodes.tolist() == again.nodes.tolist()
        assert one.nodes.tolist() != other.nodes.tolist()


def test_too_many_clusters_for_ants_that_order_them_are_refused_in_one_line() -> None:
    problem = random_problem(1, 1100, "holes", pairs=3)
    for algorithm in ("acs", "firefly"):
        ordered = RoutingProblem.of_points(problem.entry, precedence=np.array([[0, 1]], dtype=np.int32))
        with pytest.raises(SolveError, match=f"'{algorithm}' orders at most 1000 clusters"):
            solve(ordered, SolveOptions(algorithm=algorithm))


@pytest.mark.parametrize("local", [False, True])
@pytest.mark.parametrize("ends", ENDS[:1] + ENDS[-1:])
def test_a_swarm_of_orders_flies_one_after_the_other_the_shortest_first(local: bool, ends: object) -> None:
    """A flight has as many inversions as its attraction, each of one run, or two before a local search; an order that
    is not longer is kept at once. The first order is that of nearest neighbours.
    """
    instance = build_directed_instance(random_problem(6, 12, "ways", ends, pairs=4), 6)
    flight = Flight.from_options(FireflyOptions(n_fireflies=4, attractiveness=3.0), limited=True)
    stop = Stop(iterations=6)
    swarm, best = ChoiceFireflies(instance, flight, SolveOptions(seed=5, local_search=local), stop), Best(stop)
    moves, m = Choices(instance, local), instance.n
    drawn, words = np.zeros((4, m), dtype=np.int32), random_states(5, 0, count=4)
    for f in range(4):
        moves.construct_at_random(words, f, drawn[f])
    assert swarm.orders.tolist() == drawn.tolist()
    swarm.offer_first_solution(best)
    drawn[0], length = moves.nearest_neighbour_order()
    assert (best.tour.tolist(), best.cost, best.iteration) == (drawn[0].tolist(), length, 0)
    lengths, gained = np.full(4, np.inf), 0
    for iteration in range(6):
        orders, found = swarm.construct(iteration)
        words = random_states(5, iteration + 1, count=4)
        for f in np.argsort(lengths, kind="stable").tolist():
            if iteration == 0:
                lengths[f] = moves.improve_and_measure(drawn[f], stop)
                continue
            apart = {}
            for j in range(4):
                steps = {(int(a), int(b)) for a, b in itertools.pairwise(drawn[f])}
                apart[j] = sum((int(a), int(b)) not in steps for a, b in itertools.pairwise(drawn[j]))
            attraction, longest = flight.choose_target(lengths, f, apart.__getitem__, m, iteration / 6, local)
            for _ in range(max(1, round(attraction))):
                trial = drawn[f].copy()
                place = np.argsort(trial).astype(np.int32)
                invert_runs(moves.layers, trial, place, 2 if local else 1, longest, words, f)
                length = moves.improve_and_measure(trial, stop)
                if length <= lengths[f]:
                    gained += length < lengths[f]
                    drawn[f], lengths[f] = trial, length
        assert orders.tolist() == drawn.tolist()
        assert found.tolist() == lengths.tolist()
        assert swarm.log.ants == [4 * (iteration + 1)]
        assert swarm.log.best == [lengths.min()]
    assert gained > 3
    assert swarm.instance_nodes(drawn[1]).tolist() == moves.instance_nodes(drawn[1]).tolist()


def test_a_swarm_of_orders_stops_between_its_fireflies_once_one_has_its_length() -> None:
    instance = build_directed_instance(random_problem(6, 12, "ways", ENDS[0], pairs=4), 6)
    flight, stop = Flight.from_options(FireflyOptions(n_fireflies=4), limited=True), Stop()
    swarm = ChoiceFireflies(instance, flight, SolveOptions(), stop)
    swarm.offer_first_solution(Best(Stop()))
    stop.cancelled.set()
    _, lengths = swarm.construct(0)
    assert np.isfinite(lengths).tolist() == [True, False, False, False]
    assert swarm.log.ants == [1]
    swarm.construct(1)
    assert swarm.log.ants == [1]
