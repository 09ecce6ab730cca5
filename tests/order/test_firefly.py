"""Fireflies: distances by hand, moves that keep tours whole, optima by brute force, same seed, same answer."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import SolveError
from leafcut.kernels.cost import tour_cost
from leafcut.kernels.firefly import count_different_edges, invert_and_repair, make_random_inversions
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.construction import random_states
from leafcut.order.directed import build_directed_instance
from leafcut.order.instance import Instance, build_instance
from leafcut.order.kicks import BREADTH, improve_queued_nodes, search_breadth, tour_with_buffers
from leafcut.order.literature import fireflies, flight
from leafcut.order.literature.fireflies import ChoiceFireflies, PlaceFireflies, cost_table
from leafcut.order.literature.flight import Flight, Swarm
from leafcut.order.search import AlgorithmRun, Best
from leafcut.order.solve import solve
from leafcut.order.stop import Stop

SIMPLE = Flight.from_options(FireflyOptions(), limited=False)


def places(n: int, seed: int = 1) -> np.ndarray:
    """Return n random places, float64[n, 2]."""
    return np.random.default_rng(seed).uniform(0.0, 100.0, (n, 2))


def instance_of(n: int, closed: bool = True, seed: int = 1) -> Instance:
    """Return an instance of n random places."""
    return build_instance(RoutingProblem.of_points(places(n, seed), closed=closed), 5)


def test_distances_are_counted_by_hand() -> None:
    """0–1–2–3–4–5 and 0–1–2–5–4–3: the run 3 4 5 is inverted, so the edges 2–3 and 5–0 are not in the other."""
    tour, other = np.arange(6, dtype=np.int32), np.array([0, 1, 2, 5, 4, 3], dtype=np.int32)
    place = np.argsort(other).astype(np.int32)
    assert count_different_edges(tour, other, place) == 2
    assert count_different_edges(np.roll(other, 2)[::-1].copy(), other, place) == 0
    assert (
        count_different_edges(np.array([0, 2, 4, 1, 5, 3], dtype=np.int32), other, place) == 5
    )  # 3–0 alone is in both


@given(st.integers(5, 40), st.integers(0, 99), st.integers(2, 38), st.integers(1, 300))
def test_flying_keeps_a_tour_whole_and_never_makes_it_longer(n: int, seed: int, longest: int, moves: int) -> None:
    instance = instance_of(n, closed=seed % 2 == 0, seed=seed)
    h, costs = instance.n, cost_table(instance)
    tour = np.random.default_rng(seed).permutation(h).astype(np.int32)
    place, before = np.argsort(tour).astype(np.int32), tour_cost(instance.cost, tour)
    words = np.array([seed + 1], dtype=np.uint64)
    gained = make_random_inversions(costs, tour, place, moves, min(longest, h - 2), words, 0)
    assert sorted(tour.tolist()) == list(range(h))
    assert place.tolist() == np.argsort(tour).tolist()
    assert gained >= 0.0
    assert tour_cost(instance.cost, tour) == pytest.approx(before - gained, abs=1e-3)


@given(st.integers(8, 40), st.integers(0, 99), st.integers(2, 38), st.integers(1, 30))
def test_mended_moves_keep_a_tour_whole_and_never_make_it_longer(n: int, seed: int, longest: int, moves: int) -> None:
    instance = instance_of(n, closed=seed % 2 == 0, seed=seed)
    h = instance.n
    tour = tour_with_buffers(
        np.random.default_rng(seed).permutation(h).astype(np.int32), queued=False, log=2 * h + 1000
    )
    before, words = tour_cost(instance.cost, tour.node), np.array([seed + 1], dtype=np.uint64)
    gained = invert_and_repair(
        instance.cost,
        tour,
        instance.candidates,
        instance.lengths,
        search_breadth(instance, BREADTH),
        moves,
        min(longest, h - 2),
        words,
        0,
    )
    assert sorted(tour.node.tolist()) == list(range(h))
    assert tour.place.tolist() == np.argsort(tour.node).tolist()
    assert gained >= -1e-9 * moves
    assert tour_cost(instance.cost, tour.node) == pytest.approx(before - gained)
    assert tour.counts[1] == 0


def shortest(xy: np.ndarray, closed: bool) -> float:
    """Return the length of the shortest path or tour, all orders tried."""
    d = np.hypot(*(xy[:, None] - xy).transpose(2, 0, 1))
    orders = np.array(list(itertools.permutations(range(len(xy)))))
    lengths = d[orders[:, :-1], orders[:, 1:]].sum(axis=1)
    return float((lengths + d[orders[:, -1], orders[:, 0]] if closed else lengths).min())


@pytest.mark.parametrize("local", [True, False])
def test_eight_places_have_the_shortest_of_all_orders(local: bool) -> None:
    for seed, closed in itertools.product((1, 2), (True, False)):
        xy = places(8, seed)
        options = SolveOptions(algorithm="firefly", local_search=local, bound=False, threads=1, iterations=40)
        for metric in (Metric(), Metric("EXPLICIT", matrix=np.hypot(*(xy[:, None] - xy).transpose(2, 0, 1)))):
            problem = RoutingProblem.of_points(xy, metric, closed=closed)
            found = solve(problem, options)
            assert found.cost == pytest.approx(shortest(xy, closed))


@pytest.mark.parametrize("local", [True, False])
@pytest.mark.parametrize("ends", [((0.0, 0.0), None), ((0.0, 0.0), (90.0, 90.0)), (None, (90.0, 90.0))])
def test_given_ends_stay_the_ends(local: bool, ends: tuple) -> None:
    problem = RoutingProblem.of_points(places(20), start=ends[0], end=ends[1])
    options = SolveOptions(algorithm="firefly", local_search=local, iterations=5, bound=False)
    best = solve(problem, SolveOptions(bound=False)).cost
    found = solve(problem, options)
    assert sorted(found.nodes.tolist()) == list(range(20))
    assert best - 1e-9 <= found.cost < 1.3 * best


@pytest.mark.parametrize("local", [True, False])
def test_the_same_seed_gives_the_same_answer_on_any_number_of_threads(local: bool) -> None:
    problem = RoutingProblem.of_points(places(60))
    options = {"algorithm": "firefly", "local_search": local, "iterations": 4, "bound": False}
    answers = [solve(problem, SolveOptions(seed=s, threads=t, **options)) for s, t in ((5, 1), (5, 1), (5, 3))]
    assert len({tuple(a.nodes.tolist()) for a in answers}) == 1
    other = solve(problem, SolveOptions(seed=6, threads=1, **options))
    assert local or other.nodes.tolist() != answers[0].nodes.tolist()


def test_the_search_ends_when_nothing_got_shorter_for_twenty_iterations_or_after_those_that_were_asked_for() -> None:
    problem = RoutingProblem.of_points([(0, 0), (0, 9), (9, 9), (9, 0), (5, 5)], closed=True)
    for iterations in (None, 1, 31):
        found = solve(problem, SolveOptions(algorithm="firefly", iterations=iterations, bound=False))
        assert found.iterations == (iterations or flight.PATIENCE)


def test_costs_between_too_many_nodes_are_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fireflies, "MOST_NODES", 49)
    problem = RoutingProblem.of_points(places(50), closed=True)
    with pytest.raises(SolveError, match="for at most 49 nodes; this problem has 50; leave out --no-local-search"):
        solve(problem, SolveOptions(algorithm="firefly", local_search=False))


def budget_of(swarm: Swarm, **options: object) -> tuple[float, float]:
    """Return the limits that a swarm sets: iterations, and iterations without a gain."""
    stop = Stop()
    swarm.set_budget(stop, SolveOptions(algorithm="firefly", **options))  # type: ignore[arg-type]
    return stop.iterations, stop.patience


def test_a_preset_has_a_number_of_inversions_repaired_moves_or_visits() -> None:
    """11 fireflies on 50 places: 20 flights of 50 inversions each, or 50 repaired moves; 2·10⁷ and 2·10⁴ if fast.

    Orders of 10 clusters and the anchor take 11·11·20 visits; 2·10⁵ if fast, and 30 iterations without a gain.
    """
    instance = instance_of(50)
    bare, mended = (
        PlaceFireflies(instance, SIMPLE, SolveOptions(local_search=local), Stop(), None, 1) for local in (False, True)
    )
    assert budget_of(bare, preset="fast") == (math.ceil(2e7 / (11 * 1000)), math.inf)
    assert budget_of(bare) == (math.ceil(4e8 / (11 * 1000)), math.inf)
    assert budget_of(mended, preset="fast") == (math.ceil(2e4 / (11 * 50)), math.inf)
    assert budget_of(mended, preset="thorough") == (math.ceil(1e7 / (11 * 50)), math.inf)
    assert budget_of(mended, iterations=7) == (math.inf, math.inf)
    assert budget_of(mended, time_limit=7.0) == (math.inf, math.inf)
    rng = np.random.default_rng(1)
    cuts = RoutingProblem(*rng.uniform(0, 9, (2, 10, 2)), np.arange(10, dtype=np.int32), np.zeros(10))
    orders = ChoiceFireflies(build_directed_instance(cuts, 5), SIMPLE, SolveOptions(), Stop())
    assert budget_of(orders, preset="fast") == (math.ceil(2e5 / (11 * 11 * 20)), 30)
    assert budget_of(orders, preset="thorough") == (math.ceil(1e8 / (11 * 11 * 20)), 2000)


def test_repaired_moves_of_a_swarm_are_those_of_the_kernel_between_looks_at_the_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """First every tour is improved; then each firefly makes 0.05·β·h moves of at most `LONGEST_REWRITE` nodes, two
    between two looks. All see the swarm as it was before the iteration.
    """
    monkeypatch.setattr(fireflies, "MENDED_PER_LOOK", 2)
    monkeypatch.setattr(fireflies, "LONGEST_REWRITE", 9)
    instance, stop = instance_of(60), Stop(iterations=4)
    flight_of_four = Flight.from_options(FireflyOptions(n_fireflies=4, attractiveness=2.0), limited=True)
    swarm = PlaceFireflies(instance, flight_of_four, SolveOptions(seed=3), stop, None, 1)
    assert swarm.costs.shape == (0, 0)
    assert swarm.lengths.tolist() == [instance.length(swarm.swarm[0].node), math.inf, math.inf, math.inf]
    best = Best(stop)
    swarm.offer_first_solution(best)
    assert (best.tour.tolist(), best.cost) == (swarm.swarm[0].node.tolist(), swarm.lengths[0])
    plain = []
    for f in range(4):
        tour = tour_with_buffers(flight.initial_tour(instance, flight_of_four, 3, f))
        improve_queued_nodes(instance, tour, BREADTH, Stop())
        plain.append(tour_with_buffers(tour.node, queued=False, log=2 * 60 + 1000))
    tours, lengths = swarm.construct(0)
    for iteration in range(4):
        if iteration:
            words = random_states(3, iteration, count=4)
            given = np.array([instance.length(t.node) for t in plain])
            plans = []
            for f, tour in enumerate(plain):
                apart = [int(count_different_edges(tour.node, t.node, t.place)) for t in plain]
                beta, longest = flight_of_four.choose_target(
                    given, f, apart.__getitem__, 60, iteration / 4, mended=True
                )
                plans.append((max(1, round(beta * 60 * 0.05)), min(9, longest)))
            for f, (moves, longest) in enumerate(plans):
                invert_and_repair(
                    instance.cost,
                    plain[f],
                    *instance.exchange_candidates,
                    search_breadth(instance, BREADTH),
                    moves,
                    longest,
                    words,
                    f,
                )
            tours, lengths = swarm.construct(iteration)
        assert tours.tolist() == [t.node.tolist() for t in plain]
        assert lengths.tolist() == [instance.length(t.node) for t in plain]
        assert swarm.log.ants == [4 * (iteration + 1)]
        assert swarm.log.best == [lengths.min()]


@pytest.mark.parametrize("local", [False, True])
def test_a_stopped_swarm_moves_its_first_firefly_until_the_next_look(
    local: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fireflies, "MENDED_PER_LOOK", 2)
    monkeypatch.setattr(fireflies, "MOVES_PER_LOOK", 2)
    instance, stop, made = instance_of(40), Stop(), []

    def note(*given: object) -> float:
        made.append((given[-1], given[-4]))
        return 0.0

    options = SolveOptions(seed=3, local_search=local)
    swarm = PlaceFireflies(instance, SIMPLE, options, stop, None, 1)
    swarm.construct(0)
    monkeypatch.setattr(fireflies, "invert_and_repair" if local else "make_random_inversions", note)
    stop.cancelled.set()
    swarm.construct(1)
    assert made == [(0, 2)]
    assert swarm.log.ants == [len(swarm.swarm) + 1]


def test_costs_between_all_nodes_leave_out_those_of_a_node_to_itself() -> None:
    instance = build_instance(RoutingProblem.of_points(places(6), Metric("GEO"), closed=True), 3)
    costs = cost_table(instance)
    assert (costs.dtype, costs.shape, costs.diagonal().tolist()) == (np.float32, (6, 6), [0.0] * 6)
    for a, b in itertools.permutations(range(6), 2):
        assert costs[a, b] == instance.costs(a, b)[0]


@pytest.mark.parametrize("variant", ["published", "published-complex"])
def test_published_variants_refuse_paths_with_choices(variant: str) -> None:
    options = FireflyOptions(variant=variant)
    fireflies.check_fireflies("firefly", AcoOptions(), options, False)
    fireflies.check_fireflies("firefly", AcoOptions(), FireflyOptions(), True)
    with pytest.raises(SolveError) as refused:
        fireflies.check_fireflies("firefly", AcoOptions(), options, True)
    assert str(refused.value) == (
        f"--variant {variant} supports only closed tours of points, without precedence, directions or alternative "
        "starts; use --variant leafcut"
    )


@pytest.mark.parametrize(
    ("options", "fireflies_of", "cores", "threads", "kind"),
    [
        (SolveOptions(algorithm="firefly", iterations=2), {}, 3, 3, "PlaceFireflies"),
        (SolveOptions(algorithm="firefly", iterations=2, threads=2), {}, 3, 2, "PlaceFireflies"),
        (SolveOptions(algorithm="firefly", iterations=2), {"n_fireflies": 2}, 8, 2, "PlaceFireflies"),
        (SolveOptions(algorithm="firefly", iterations=2), {}, None, 1, "PlaceFireflies"),
        (SolveOptions(algorithm="firefly"), {"variant": "published"}, 3, 3, "PublishedFireflies"),
    ],
)
def test_a_run_has_a_swarm_of_its_variant_with_a_worker_per_core_or_firefly(
    options: SolveOptions,
    fireflies_of: dict[str, object],
    cores: int | None,
    threads: int,
    kind: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    instance, best, seen = instance_of(20), Best(Stop()), []

    def searched(swarm: Swarm, same: Best) -> int:
        assert same is best
        seen.append(swarm)
        best.offer(np.arange(20, dtype=np.int32), 1.0, 0)
        return 6

    monkeypatch.setattr("os.cpu_count", lambda: cores)
    monkeypatch.setattr(fireflies, "run_population", searched)
    run = AlgorithmRun(options, AcoOptions(), FireflyOptions(**fireflies_of), best)  # type: ignore[arg-type]
    found = fireflies.run_fireflies(instance, run)
    (swarm,) = seen
    assert type(swarm).__name__ == kind
    assert swarm.flight == Flight.from_options(run.firefly, limited=options.is_limited)
    if kind == "PlaceFireflies":
        assert (swarm.workers, swarm.executor is None) == (threads, threads == 1)
    assert best.stop.patience == (math.inf if options.is_limited else 20)
    assert best.stop.iterations == (math.inf if options.is_limited else 4000)
    assert (found.iterations, found.tour.tolist()) == (6, list(range(20)))
    assert found.workers == swarm.log.worker_figures()
