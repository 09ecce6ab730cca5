"""A time limit applies to all searches of a run together; other work does not count."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

from leafcut.model.measure import Measure
from leafcut.model.plan import Candidate, Order, Stage
from leafcut.model.pocket import PocketPath, PocketRules
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.options import SolveOptions
from leafcut.order import algorithms, certificate, stop
from leafcut.order import solve as solving
from leafcut.order import stop as module
from leafcut.order.stop import Deadline
from leafcut.processes.job import Job, machine_of
from leafcut.processes.ordering import find_order
from leafcut.processes.pocket.plan import grid
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.strategies import STRATEGIES, ClearingStrategy, SearchTime
from leafcut.processes.settings import collect_settings
from leafcut.processes.sheet import order_passes
from leafcut.processes.sheet.plan import detached_parts
from leafcut.processes.sheet.plan.cutting import CutSequence, HeadTravel


def given_to(works: list[float], takes: Callable[[float], float], limit: float | None) -> list[float | None]:
    """Return the time limits of searches with these amounts of work, each of which uses a share of its limit."""
    deadline, left, given = Deadline(limit), sum(works), []
    for work in works:
        part = deadline.for_share(work / left)
        given.append(part.remaining_time_limit)
        part.subtract(takes(part.remaining_time_limit or 0.0))
        left -= work
    return given


def test_searches_share_the_limit_by_their_work() -> None:
    assert given_to([1.0, 3.0, 4.0], lambda limit: limit, 8.0) == pytest.approx([1.0, 3.0, 4.0])


def test_time_that_one_search_does_not_need_goes_to_those_after_it() -> None:
    assert given_to([1.0, 1.0, 1.0], lambda _: 1.0, 9.0) == pytest.approx([3.0, 4.0, 7.0])


def test_a_search_that_overruns_leaves_the_others_a_twentieth_of_their_share() -> None:
    """Of 8 s each of four searches may have 2 s; the first takes a minute."""
    given = given_to([1.0] * 4, lambda _: 60.0, 8.0)
    assert given == pytest.approx([2.0, 0.05 * 8.0 / 3, 0.05 * 8.0 / 2, 0.05 * 8.0])


def test_a_small_overrun_of_each_search_does_not_add_up() -> None:
    """Five searches that each take half a second too long end half a second late, not two and a half."""
    deadline = Deadline(10.0)
    for left in range(5, 0, -1):
        part = deadline.for_share(1.0 / left)
        part.subtract(part.limit + 0.5)
    assert deadline.left == 0.0
    deadline = Deadline(10.5 + 1e-9)
    for left in range(5, 0, -1):
        part = deadline.for_share(1.0 / left)
        part.subtract(part.limit)
    assert deadline.left <= 1e-9


def test_without_a_limit_no_search_has_one() -> None:
    assert given_to([1.0, 1.0], lambda _: 1e9, None) == [None, None]
    assert Deadline().left == float("inf")
    with Deadline().running(threading.Event()) as late:
        assert not late()


def test_a_limit_is_never_zero() -> None:
    """`SolveOptions` refuses it."""
    deadline = Deadline(0.002)
    deadline.subtract(1.0)
    assert deadline.remaining_time_limit == deadline.for_share(0.5).remaining_time_limit == pytest.approx(0.001)


def test_a_search_without_a_clock_of_its_own_stops_at_its_deadline_or_when_cancelled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, cancelled = [100.0], threading.Event()
    monkeypatch.setattr(module, "clock", lambda: now[0])
    deadline = Deadline(10.0)
    with deadline.for_share(0.5).running(cancelled) as late:
        now[0] += 4.9
        assert not late()
        now[0] += 0.2
        assert late()
    assert deadline.left == pytest.approx(4.9)
    now[0] += 1e6  # no search runs
    assert deadline.left == pytest.approx(4.9)
    with deadline.running(cancelled) as late:
        cancelled.set()
        assert late()


@pytest.mark.parametrize(("bound", "searched"), [(True, 9.0), (False, 10.0)])
def test_a_tenth_of_the_limit_is_kept_for_lower_bounds(bound: bool, searched: float) -> None:
    options = SolveOptions(time_limit=10.0, bound=bound)
    assert Deadline.from_options(options).remaining_time_limit == pytest.approx(searched)
    assert Deadline.for_bounds(options).remaining_time_limit == pytest.approx(1.0)


def test_without_a_limit_a_lower_bound_is_never_late() -> None:
    assert Deadline.from_options(SolveOptions()).remaining_time_limit is None
    assert Deadline.for_bounds(SolveOptions()).remaining_time_limit is None


def test_all_lower_bounds_of_a_run_share_a_tenth_of_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bound that its search did not prove in time is not sought again with the same time."""
    now = [0.0]

    def endless(_: object, late: Callable[[], bool]) -> None:
        while not late():
            now[0] += 0.01

    settings = collect_settings({"time_limit": 10.0})
    limits = Deadline.from_options(settings.solve), Deadline.for_bounds(settings.solve)
    job = Job(settings, machine_of(settings), limits[0], bounds=limits[1])
    problem = RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 100, (9, 2)))
    stages = [Stage(problem, False, np.arange(9, dtype=np.int32), name) for name in "ab"]
    monkeypatch.setattr(module, "clock", lambda: now[0])
    monkeypatch.setattr(certificate, "symmetric_relaxation", endless)
    find_order(job, stages, SolveOptions(algorithm="2opt"))
    assert 1.0 <= now[0] <= 1.2


def test_the_clock_of_a_search_runs_while_its_instance_is_built(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loading and compiling kernels does not count."""
    now = [0.0]

    def slow(place: Any, name: str, seconds: float) -> None:
        inner = getattr(place, name)

        def later(*given: Any, **named: Any) -> Any:
            now[0] += seconds
            return inner(*given, **named)

        monkeypatch.setattr(place, name, later)

    slow(algorithms.Algorithm, "build_instance", 2.0)
    slow(solving, "validate_pairs", 1.0)
    slow(solving, "check_options", 100.0)
    slow(certificate, "add_lower_bound", 1000.0)
    monkeypatch.setattr(stop, "clock", lambda: now[0])
    problem = RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 100, (9, 2)))
    assert solving.solve(problem, SolveOptions(algorithm="nn", time_limit=10.0)).seconds == 3.0


def test_the_seconds_of_an_exact_solution_include_its_search(monkeypatch: pytest.MonkeyPatch) -> None:
    now, best_nodes = [0.0], solving.solve_exactly

    def slow(*given: Any) -> Any:
        now[0] += 2.0
        return best_nodes(*given)

    monkeypatch.setattr(solving, "solve_exactly", slow)
    monkeypatch.setattr(stop, "clock", lambda: now[0])
    problem = RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 100, (7, 2)))
    problem = replace(problem, precedence=np.array([[0, 6]], dtype=np.int32))
    solution = solving.solve(problem, SolveOptions(bound=False))
    assert (solution.algorithm, solution.seconds) == ("exact", 2.0)


def test_a_stage_with_given_first_choices_gets_one_lower_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    bounds, certify = list[int](), certificate.add_lower_bound

    def counted(problem: RoutingProblem, *given: Any, **named: Any) -> Any:
        bounds.append(problem.n_clusters)
        return certify(problem, *given, **named)

    monkeypatch.setattr(certificate, "add_lower_bound", counted)
    problem = RoutingProblem.of_points(np.random.default_rng(1).uniform(0, 100, (12, 2)))
    nodes = np.arange(12, dtype=np.int32)
    settings = collect_settings({"preset": "fast", "threads": 1})
    job = Job(settings, machine_of(settings), Deadline())
    find_order(job, [Stage(problem, False, nodes, "", nodes[3:5])])
    assert bounds == [12]


def test_only_strategies_that_search_take_a_share_of_the_time() -> None:
    settings, given = collect_settings({"time_limit": 10.0}), list[float | None]()
    run = Job(settings, machine_of(settings), Deadline.from_options(settings.solve))

    def path(_: object, one: Job, grids: object) -> PocketPath:
        given.append(one.deadline.remaining_time_limit)
        if one.deadline is not run.deadline:
            one.deadline.subtract(one.deadline.limit)
        return PocketPath("", ())

    time, region = SearchTime(Deadline(10.0)), CentreRegion(shapely.box(0, 0, 9, 9), PocketRules(4.0, 2.0))
    time.to_come = 2
    for searches in (False, True, False, True):
        way = ClearingStrategy("", path, searches=searches)
        time.plan_path(way, region, run)
    assert given[1] == given[3] == pytest.approx(5.0)
    assert given[0] == given[2] == run.deadline.remaining_time_limit


def test_freeing_parts_later_ends_with_the_time_of_all_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    now, looks = [0.0], list[bool]()
    deadline = Deadline(10.0)

    def slow(*given: Any) -> list[int]:
        looks.append(given[-1]())
        now[0] += 10.0
        looks.append(given[-1]())
        return []

    cuts: Any = SimpleNamespace(cuts=(), crossings=1, close=0)
    before = Candidate(
        Order(()), ToolpathBuilder().build(), Measure(0.0, 0.0, 0.0), (cuts, SimpleNamespace(crossing=(1,)))
    )
    nothing: Any = SimpleNamespace(contours=[], contour_precedence=[], rules=SimpleNamespace(kerf=1.0))
    order = Order((CutSequence(nothing, ()),))
    settings = collect_settings({})
    head = HeadTravel(Metric(), 0.0, None, None)
    work: Any = SimpleNamespace(cutting=nothing, head=head, parts=(), order_fixed=False, planned=None)
    plan: Any = SimpleNamespace(work=work, job=Job(settings, machine_of(settings), deadline))
    monkeypatch.setattr(module, "clock", lambda: now[0])
    monkeypatch.setattr(detached_parts, "cut_outlines_later", slow)
    monkeypatch.setattr(order_passes, "cached_motion", lambda *_: before)
    assert order_passes.postpone_detaching_cuts(plan, order) is order
    assert looks == [False, True]
    assert deadline.left == 0.0


def test_making_a_grid_is_not_searching(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long that takes, the search for the order of its points has all of its time."""
    now, asked = [0.0], list[float | None]()
    made, found = grid.grid_problem, solving.solve

    def slow(*given: Any, **named: Any) -> Any:
        now[0] += 1e6
        return made(*given, **named)

    def spy(problem: Any, options: Any, *rest: Any, **named: Any) -> Any:
        asked.append(options.time_limit)
        return found(problem, SolveOptions(algorithm="nn", bound=False), *rest, **named)

    monkeypatch.setattr(module, "clock", lambda: now[0])
    monkeypatch.setattr(grid, "grid_problem", slow)
    monkeypatch.setattr(solving, "solve", spy)
    settings = collect_settings({"time_limit": 5.0, "strategy": "ants", "preset": "fast"})
    region = CentreRegion(shapely.box(0, 0, 30, 30), PocketRules(tool_diameter=10.0, step_over=6.0))
    (ants,) = (way for way in STRATEGIES if way.name == "ants")
    ants.path(region, Job(settings, machine_of(settings), Deadline(5.0)), {})
    assert asked == [pytest.approx(5.0)]
