"""Consecutive paths are ordered together: the ends of each count for its neighbours."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from leafcut.model.plan import Order, Stage
from leafcut.model.problem import RoutingProblem
from leafcut.options import SolveOptions
from leafcut.order.instance import path_cost
from leafcut.order.solve import solve
from leafcut.order.stop import Deadline
from leafcut.processes.job import Job, machine_of
from leafcut.processes.ordering import solutions_of_order, solve_linked_stages
from leafcut.processes.settings import collect_settings


def stages_of(
    sizes: Sequence[int], seed: int, *, strokes: bool = False, start: tuple[float, float] | None = None
) -> list:
    """Return random consecutive paths; a stroke has different ends, and each stroke waits for another."""
    rng = np.random.default_rng(seed)
    stages = []
    for number, n in enumerate(sizes):
        entry = rng.uniform(0, 100, (n, 2))
        problem = RoutingProblem(
            entry=entry,
            exit=entry + rng.uniform(-5, 5, (n, 2)) if strokes else entry,
            cluster=np.arange(n, dtype=np.int32),
            service=np.zeros(n),
            precedence=np.array([[0, n - 1]] if strokes else np.zeros((0, 2)), dtype=np.int32),
            start=None if number else start,
        )
        stages.append(Stage(problem, number > 0, np.arange(n, dtype=np.int32)))
    return stages


def total(stages: list, orders: list) -> float:
    """Return the total travel, including moves between the paths."""
    places = [(s.problem.entry[k], s.problem.exit[k]) for s, order in zip(stages, orders, strict=True) for k in order]
    start = stages[0].problem.start
    ways = [np.subtract(b[0], a[1]) for a, b in itertools.pairwise(places)]
    return sum(float(np.hypot(*way)) for way in [*ways, *([places[0][0] - np.array(start)] if start else [])])


def solved(stages: list, **options: object) -> list:
    def search(_: int, problem: RoutingProblem, given: SolveOptions) -> object:
        return solve(problem, given)

    given = SolveOptions(threads=1, **options)  # type: ignore[arg-type]
    return solve_linked_stages(stages, search, given, search, threading.Event())  # type: ignore[arg-type]


@pytest.mark.parametrize("sizes", [(4, 4, 3), pytest.param((4, 4, 4), marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", range(6))
def test_three_small_paths_come_near_the_best_of_all_orders(seed: int, sizes: tuple[int, ...]) -> None:
    """Within 3 % of brute force over all orders; separate searches are up to 40 % longer."""
    stages = stages_of(sizes, seed, start=(0.0, 0.0))
    every = itertools.product(*(itertools.permutations(range(n)) for n in sizes))
    best = min(total(stages, list(orders)) for orders in every)
    found = solved(stages)
    assert total(stages, [s.nodes.tolist() for s in found]) <= 1.03 * best
    assert sum(s.cost for s in found) == pytest.approx(total(stages, [s.nodes.tolist() for s in found]))
    assert all(s.lower_bound is not None and s.lower_bound <= s.cost + 1e-9 for s in found)


@pytest.mark.parametrize(
    ("sizes", "iterations"),
    [((6, 9, 4, 7), (0, 1, 2, 5)), pytest.param((9, 15, 5, 12), (0, 1, 2, 5, 10), marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("strokes", [False, True])
@pytest.mark.parametrize("seed", range(2))
def test_more_iterations_never_give_a_longer_tour(
    seed: int, strokes: bool, sizes: tuple[int, ...], iterations: tuple[int, ...]
) -> None:
    stages = stages_of(sizes, seed, strokes=strokes)
    costs = [sum(s.cost for s in solved(stages, iterations=n, bound=False)) for n in iterations]
    assert all(more <= less + 1e-9 for less, more in itertools.pairwise(costs))


def test_what_must_come_first_does_so_in_every_path() -> None:
    stages = stages_of([9, 12, 20], 4, strokes=True)
    for stage, found in zip(stages, solved(stages, iterations=3), strict=True):
        nodes = found.nodes.tolist()
        assert sorted(nodes) == list(range(len(nodes)))
        assert nodes.index(0) < nodes.index(len(nodes) - 1)
        assert stage.problem.n_clusters == len(nodes)


def test_no_order_is_longer_than_the_one_there_was() -> None:
    stages = stages_of([6, 6], 1)
    best = [s.nodes for s in solved(stages)]
    kept = [Stage(s.problem, s.follows, nodes) for s, nodes in zip(stages, best, strict=True)]
    found = solved(kept, iterations=0)
    assert sum(s.cost for s in found) <= total(stages, [n.tolist() for n in best]) + 1e-9


def test_a_given_order_that_is_better_than_the_quick_ones_is_where_the_search_begins() -> None:
    """The quick searches return the given order shuffled; the search may only return what it begins with."""
    stages = stages_of([6, 7], 1)
    best = [s.nodes for s in solved(stages)]
    kept = [Stage(s.problem, s.follows, nodes) for s, nodes in zip(stages, best, strict=True)]

    def search(_: int, problem: RoutingProblem, given: SolveOptions) -> object:
        return solve(problem, replace(given, iterations=0))

    def quick(number: int, problem: RoutingProblem, given: SolveOptions) -> object:
        return replace(solve(problem, given), nodes=np.roll(best[number], 3)[::-1])

    given = SolveOptions(threads=1, bound=False)
    found = solve_linked_stages(kept, search, given, quick, threading.Event())  # type: ignore[arg-type]
    assert total(stages, [s.nodes.tolist() for s in found]) <= total(stages, [n.tolist() for n in best]) + 1e-9


def test_a_path_of_two_tasks_whose_first_is_fixed_has_an_exact_order() -> None:
    _, found = solved(stages_of([4, 2], 1))
    assert (found.algorithm, found.lower_bound) == ("exact", pytest.approx(found.cost))


def test_the_solutions_of_another_order_than_the_searched_one_state_its_cost() -> None:
    stages = stages_of([5, 6], 3)
    searched = tuple(solved(stages))
    settings = collect_settings({"machine": "haas-vf2", "threads": 1})
    job = Job(settings, machine_of(settings), Deadline())
    for choices, name in ([stage.given for stage in stages], "none"), ([s.nodes[::-1] for s in searched], "nn"):
        found = solutions_of_order(job, stages, Order(tuple(choices), searched))
        assert [s.nodes.tolist() for s in found] == [nodes.tolist() for nodes in choices]
        assert sum(s.cost for s in found) == pytest.approx(total(stages, [nodes.tolist() for nodes in choices]))
        assert [s.history[-1][1] for s in found] == [s.cost for s in found]
        assert {s.algorithm for s in found} == {name}
        assert all(s.lower_bound is not None and s.lower_bound <= s.cost + 1e-9 for s in found)


def test_a_path_with_a_start_of_its_own_is_ordered_by_itself() -> None:
    one, other = stages_of([8, 8], 2)
    apart = Stage(RoutingProblem.of_points(other.problem.entry, start=(500.0, 0.0)), False, other.given)
    found = solved([one, apart], bound=False)
    alone = solve(apart.problem, SolveOptions(threads=1, bound=False))
    assert path_cost(apart.problem, found[1].nodes) == pytest.approx(alone.cost)


@pytest.mark.parametrize(("limit", "calls"), [(None, 9), (1e6, 9), (1000.0, 4), (1.0, 3)])
def test_quick_searches_end_where_a_time_limit_has_no_room_for_them(limit: float | None, calls: int) -> None:
    """Each of three paths takes 85 s in the simulated clock: three tenths of 1000 s end in the second round."""
    asked = list[int]()

    def quick(number: int, problem: RoutingProblem, given: SolveOptions) -> object:
        asked.append(number)
        return replace(solve(problem, replace(given, time_limit=None)), seconds=85.0)

    def search(_: int, problem: RoutingProblem, given: SolveOptions) -> object:
        return solve(problem, replace(given, time_limit=None, iterations=1))

    stages = stages_of([6, 7, 8], 1)
    given = SolveOptions(threads=1, time_limit=limit, bound=False)
    found = solve_linked_stages(stages, search, given, quick, threading.Event())  # type: ignore[arg-type]
    assert len(asked) == calls
    assert [sorted(s.nodes.tolist()) for s in found] == [list(range(n)) for n in (6, 7, 8)]
