"""A time limit is that of the whole run: what came before the search, and what comes behind it, is taken off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from leafcut.options import Settings, SolveOptions
from leafcut.processes.course import BoundTime, Run, RunClock, too_short
from leafcut.read.machine import load_machine


@dataclass
class Standing(RunClock):
    """A clock that stands at one time."""

    at: float = 0.0

    def elapsed(self) -> float:
        return self.at


def limited(limit: float | None, elapsed: float, bound: bool = True) -> Run:
    """Return a run with a time limit, so many seconds after its beginning."""
    settings = Settings().but(SolveOptions(time_limit=limit, bound=bound))
    return Run(settings, load_machine("haas-vf2"), clock=Standing(at=elapsed))


@pytest.mark.parametrize(
    ("limit", "elapsed", "left"),
    [
        (10.0, 0.5, 9.0),  # as much is kept for what comes behind the search
        (10.0, 4.0, 2.0),  # however much that is
        (10.0, 5.0, 0.5),  # a twentieth is the search's own
        (10.0, 9.0, 0.5),
        (10.0, 99.0, 0.5),
        (0.002, 5.0, 0.001),
    ],
)
def test_the_search_has_what_is_left_of_the_time_limit(limit: float, elapsed: float, left: float) -> None:
    assert limited(limit, elapsed, bound=False).time_to_search() == pytest.approx(left)


@pytest.mark.parametrize(("behind", "left"), [(0.0, 8.0), (1.0, 6.0), (2.0, 4.0), (9.0, 0.5)])
def test_what_comes_behind_the_search_is_sized_by_what_came_before(behind: float, left: float) -> None:
    run = replace(limited(10.0, 2.0, bound=False), behind=behind)
    assert run.time_to_search() == pytest.approx(left)
    assert BoundTime(run).reserve == pytest.approx(2.0 * behind)


def test_without_a_limit_there_is_none() -> None:
    run = limited(None, 5.0)
    assert run.time_to_search() is None
    assert not BoundTime(run).late()(1e9)
    assert too_short(run) == []


def test_a_tenth_of_what_is_left_for_the_search_is_for_its_bound() -> None:
    assert limited(10.0, 0.5).time_to_search() == pytest.approx(0.9 * 9.0)


@pytest.mark.parametrize(
    ("now", "taken", "to_come", "late"),
    [
        (8.9, 5.0, 0.0, False),  # as long as what is kept for proof and writing is still there
        (9.0, 5.0, 0.0, True),
        (6.9, 5.0, 2.0, False),  # and what the searches behind it may take
        (7.0, 5.0, 2.0, True),
        (99.0, 0.19, 0.0, False),  # a fiftieth of the limit is its own, whatever the time
        (99.0, 0.20, 0.0, True),
    ],
)
def test_a_bound_ends_when_what_is_behind_it_needs_the_time(
    now: float, taken: float, to_come: float, late: bool
) -> None:
    run = limited(10.0, 1.0)
    bounds = BoundTime(run)
    run.clock.at = now  # type: ignore[attr-defined]
    assert bounds.late(to_come=to_come)(taken) is late


@pytest.mark.parametrize(("took", "told"), [(10.0, False), (11.0, False), (11.2, True), (40.0, True)])
def test_a_limit_that_was_too_short_is_told_with_what_took_the_time(took: float, told: bool) -> None:
    run = limited(10.0, took)
    run.clock.searched = 1.5
    issues = too_short(run)
    assert [issue.code for issue in issues] == ["L416"] * told
    if told:
        assert f"took {took - 1.5:.3g} s, the search 1.5 s" in issues[0].message


def test_of_a_run_that_is_watched_no_such_thing_is_told() -> None:
    """It may have been held for long, while its search's clock stood still."""
    assert too_short(replace(limited(10.0, 40.0), observe=lambda _take, _alone: None)) == []
