"""The end and the answer of a search for a strip; the steps are reported one by one, as by the nester."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("spyrrow")

from leafcut.nesting.plan.sparrow_process import GIVEN_UP, NEVER, OVERLAPPING, StripSearch, phase_time_limits

FOUND = 3
ENDLESS: dict[str, Any] = {"steps": 1e9, "failures": 1e9, "seconds": 1e9, "enough": 0.0}


def strip(width: float) -> Any:
    placed = SimpleNamespace(id="4", rotation=90.0, translation=(1.0, 2.0))
    return SimpleNamespace(width=width, placed_items=[placed])


def told(*steps: tuple[int, float], **limits: float) -> tuple[StripSearch, list[bool]]:
    """Return a search, and for every step whether it ended there."""
    search = StripSearch({**ENDLESS, **limits})
    return search, [search.record_step(kind, strip(width)) for kind, width in steps]


def test_the_narrowest_strip_in_which_nothing_overlaps_is_the_answer() -> None:
    search, _ = told((FOUND, 90.0), (FOUND, 70.0), (OVERLAPPING, 50.0), (GIVEN_UP, 40.0), (FOUND, 80.0))
    assert search.answer() == {"width": 70.0, "items": [(4, 90.0, 1.0, 2.0)], "steps": 5, "ended": ""}


def test_a_search_ends_after_its_steps_but_never_without_an_answer() -> None:
    search, ended = told((OVERLAPPING, 9.0), (OVERLAPPING, 9.0), (OVERLAPPING, 9.0), (FOUND, 90.0), steps=2)
    assert ended == [False, False, False, True]
    assert (search.reason, search.steps) == ("steps", 4)


def test_it_ends_after_giving_up_so_often_and_as_soon_as_the_strip_is_narrow_enough() -> None:
    assert told((FOUND, 90.0), (GIVEN_UP, 80.0), (OVERLAPPING, 80.0), (GIVEN_UP, 80.0), failures=2)[1] == [
        False,
        False,
        False,
        True,
    ]
    search, ended = told((FOUND, 90.0), (FOUND, 75.0), enough=75.0)
    assert (ended, search.reason) == ([False, True], "enough")


def test_time_that_is_over_ends_it_once_there_is_an_answer() -> None:
    search, _ = told((OVERLAPPING, 9.0), seconds=0.0)
    assert not search.is_late()
    search.record_step(FOUND, strip(90.0))
    assert search.is_late() and search.reason == "clock"
    assert not told((FOUND, 90.0))[0].is_late()


@pytest.mark.parametrize("seconds", [0.3, 1.0, 3.8, 4.0, 19.4, 59.99])
def test_the_nester_never_stops_before_the_time_of_the_search(seconds: float) -> None:
    exploration, compression = phase_time_limits(seconds)
    assert seconds <= exploration + compression < seconds + 2.0
    assert abs(exploration - 0.8 * seconds) <= 0.76
    assert phase_time_limits(1e9) == (NEVER, NEVER)
