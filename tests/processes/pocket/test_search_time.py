"""A time limit is shared among the searches of all pockets, whatever each takes of its share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
import shapely

from leafcut.errors import PlanError
from leafcut.model.pocket import PocketPath, PocketRules
from leafcut.processes.course import Run, RunClock, machine_of
from leafcut.processes.pocket.plan import grid
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.strategies import WAYS, ClearingWay, SearchTime
from leafcut.processes.settings import collect
from leafcut.solve import solve as solving


class HandClock(RunClock):
    """A clock that goes on when it is told to."""

    seconds = 0.0

    def elapsed(self) -> float:
        return self.seconds


def limits(
    takes: Callable[[float], float], searches: int, besides: float = 0.0, proofs: int = 1, **options: Any
) -> tuple[list[float | None], float]:
    """Return the time limits that searches are given one after another, and what all took: `takes` of its limit.

    Behind each so much is done `besides`, and in the end for so many `proofs`.
    """
    settings = collect(options)
    clock, given = HandClock(), list[float | None]()
    run = Run(settings, machine_of(settings), clock=clock)

    def path(_: object, one: Run) -> PocketPath:
        given.append(one.settings.solve.time_limit)
        clock.seconds += takes(given[-1] or 0.0)
        return PocketPath("", ())

    time = SearchTime(run, 1.0)
    time.begin(searches, searches, proofs)
    for _ in range(searches):
        time.spent_on(ClearingWay("", path, ""), None)  # type: ignore[arg-type]  # the region does not matter
        clock.seconds += besides
    return given, clock.seconds


def test_searches_that_take_their_share_have_equal_ones_and_take_the_limit_together() -> None:
    given, taken = limits(lambda limit: limit, 4, time_limit=8.0)
    assert given == pytest.approx([2.0] * 4)
    assert taken == pytest.approx(8.0)


def test_what_one_does_not_need_is_there_for_those_behind_it() -> None:
    given, _ = limits(lambda _: 1.0, 3, time_limit=9.0)
    assert given == pytest.approx([3.0, 4.0, 7.0])


def test_a_search_that_takes_too_long_leaves_less_to_the_others() -> None:
    """Each takes half a second more than it may: together no more than the last one's half second too much."""
    _, taken = limits(lambda limit: limit + 0.5, 5, time_limit=10.0)
    assert 10.0 <= taken <= 10.5 + 1e-9


def test_without_a_limit_there_is_none_to_share() -> None:
    assert limits(lambda _: 1.0, 3) == ([None] * 3, 3.0)


def test_what_is_done_besides_the_searches_is_kept_for_those_to_come_and_for_the_proof() -> None:
    """Behind each of three searches one second is spent: from the second on that is known, and once more for the proof.

    10 / 3; then 10 − 3.33 − 1 − 2 − 1 for two; then what the second left.
    """
    given, taken = limits(lambda limit: limit, 3, besides=1.0, time_limit=10.0)
    assert given == pytest.approx([10 / 3, (10 - 10 / 3 - 1 - 3) / 2, (10 - 10 / 3 - 1 - 3) / 2])
    assert taken + 1.0 == pytest.approx(10.0)


def test_of_several_paths_that_are_proved_the_time_of_each_is_kept() -> None:
    """As above with 20 s, of which 4 go to four proofs: 20 / 3; then 20 − 6.67 − 1 − 2 − 4 for two."""
    given, taken = limits(lambda limit: limit, 3, besides=1.0, proofs=4, time_limit=20.0)
    assert given == pytest.approx([20 / 3, (20 - 20 / 3 - 1 - 6) / 2, (20 - 20 / 3 - 1 - 6) / 2])
    assert taken + 4.0 == pytest.approx(20.0)


def test_a_path_that_is_refused_says_nothing_of_how_long_it_takes_to_look_at_one() -> None:
    """One second was spent beside the first path; 9 s are left, of which two more paths and the proof take three."""
    clock = HandClock()
    run = Run(collect({"time_limit": 10.0}), machine_of(collect({})), clock=clock)
    time, given = SearchTime(run, 1.0), list[float | None]()

    def path(_: object, one: Run) -> PocketPath:
        given.append(one.settings.solve.time_limit)
        return PocketPath("", ())

    def refused(_: object, __: Run) -> PocketPath:
        raise PlanError("")

    time.begin(2, 4, 1)
    time.spent_on(ClearingWay("", path, "", searches=False), None)  # type: ignore[arg-type]
    clock.seconds += 1.0
    with pytest.raises(PlanError):
        time.spent_on(ClearingWay("", refused, "", searches=False), None)  # type: ignore[arg-type]
    time.spent_on(ClearingWay("", path, ""), None)  # type: ignore[arg-type]
    assert given == pytest.approx([10.0, (9.0 - 3.0) / 2])


@pytest.mark.parametrize(("takes", "left"), [(0.0, 5.0), (3.0, 2.0), (60.0, 0.001)])
def test_what_it_takes_to_make_a_grid_is_of_the_time_of_its_search(
    takes: float, left: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, asked = HandClock(), list[float | None]()
    made, found = grid.grid_problem, solving.solve

    def slow(*given: Any, **named: Any) -> Any:
        clock.seconds += takes
        return made(*given, **named)

    def spy(problem: Any, options: Any, *rest: Any, **named: Any) -> Any:
        asked.append(options.time_limit)
        return found(problem, replace(options, time_limit=None), *rest, **named)

    monkeypatch.setattr(grid, "grid_problem", slow)
    monkeypatch.setattr(solving, "solve", spy)
    settings = collect({"time_limit": 5.0, "strategy": "ants", "preset": "fast"})
    region = CentreRegion(shapely.box(0, 0, 30, 30), PocketRules(tool_diameter=10.0, step_over=6.0))
    (ants,) = (way for way in WAYS if way.name == "ants")
    ants.path(region, Run(settings, machine_of(settings), clock=clock))
    assert asked == [pytest.approx(left)]


def test_a_twentieth_of_the_limit_is_for_the_searches_however_late_it_is() -> None:
    given, _ = limits(lambda _: 60.0, 4, besides=60.0, time_limit=8.0)
    assert given == pytest.approx([2.0, 0.1, 0.1, 0.1])
