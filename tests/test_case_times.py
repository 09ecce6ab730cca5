"""The limit for fast cases and their set-ups, and the table of times."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

import case_times
from case_times import CaseTimes


def report(case: str, processor: float, *, fast: bool, when: str = "call") -> pytest.TestReport:
    """Return the report of a case that passed, as pytest-xdist hands it on: tuples have become lists."""
    properties = [["processor", processor], ["fast", fast]]
    return pytest.TestReport(
        case, (case, 1, case), {}, "passed", None, when, user_properties=properties, duration=2.0 * processor
    )  # type: ignore[arg-type]


@pytest.fixture
def times(tmp_path: Path) -> CaseTimes:
    return CaseTimes(limit=3.0, file=tmp_path / "build" / "times.tsv")


def exit_status_after(times: CaseTimes, *reports: pytest.TestReport) -> pytest.ExitCode:
    for one in reports:
        times.pytest_runtest_logreport(one)
    session = SimpleNamespace(exitstatus=pytest.ExitCode.OK)
    times.pytest_sessionfinish(session)  # type: ignore[arg-type]
    return session.exitstatus


def test_a_fast_case_above_the_limit_fails_the_run_and_is_named(times: CaseTimes) -> None:
    status = exit_status_after(times, report("a", 2.9, fast=True), report("b", 3.1, fast=True))
    assert status == pytest.ExitCode.TESTS_FAILED
    assert times.over_limit() == [(3.1, "b")]


def test_a_setup_above_the_limit_fails_the_run_and_names_the_case_that_pays_for_it(times: CaseTimes) -> None:
    status = exit_status_after(times, report("a", 3.1, fast=True, when="setup"), report("a", 0.2, fast=True))
    assert status == pytest.ExitCode.TESTS_FAILED
    assert times.over_limit() == [(3.1, "setup of a")]


def test_a_child_of_an_earlier_case_that_ends_now_does_not_count(times: CaseTimes) -> None:
    late = report("a", 5.6, fast=True)
    late.duration = 0.05
    assert exit_status_after(times, late) == pytest.ExitCode.OK
    assert times.over_limit() == []


def test_a_case_of_the_slow_tier_has_no_limit(times: CaseTimes) -> None:
    reports = (report("a", 60.0, fast=False, when=when) for when in ("setup", "call"))
    assert exit_status_after(times, *reports) == pytest.ExitCode.OK


def test_the_table_lists_the_slowest_case_first(times: CaseTimes) -> None:
    exit_status_after(times, report("a", 0.5, fast=True), report("b", 1.25, fast=True))
    assert times.file is not None
    lines = times.file.read_text(encoding="utf-8").splitlines()
    assert lines[1:] == ["1.250\t2.500\tb", "0.500\t1.000\ta"]


class Item:
    """The part of a pytest case that the hooks use."""

    def __init__(self) -> None:
        self.user_properties: list[tuple[str, object]] = []

    def get_closest_marker(self, name: str) -> None:
        return None


def report_of(item: Item, when: str) -> pytest.TestReport:
    return pytest.TestReport("a", ("a", 1, "a"), {}, "passed", None, when, user_properties=item.user_properties)  # type: ignore[arg-type]


def test_fixtures_and_body_of_a_case_are_measured_apart(times: CaseTimes, monkeypatch: pytest.MonkeyPatch) -> None:
    clock, item = [0.0], Item()
    with monkeypatch.context() as patch:  # no longer: the same hooks measure this case
        patch.setattr(case_times, "processor_seconds", lambda: clock[0])
        for when, hook, seconds in (
            ("setup", case_times.pytest_runtest_setup, 5.0),
            ("call", case_times.pytest_runtest_call, 0.5),
        ):
            steps = hook(item)  # type: ignore[arg-type]
            next(steps)
            clock[0] += seconds
            assert list(steps) == []
            times.pytest_runtest_logreport(report_of(item, when))
    assert times.times == {"setup of a": (0, 5.0, True), "a": (0, 0.5, True)}
