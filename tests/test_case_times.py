"""The limit for fast cases, and the table of times."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from case_times import CaseTimes


def report(case: str, processor: float, *, fast: bool) -> pytest.TestReport:
    """Return the report of a case that passed, as pytest-xdist hands it on: tuples have become lists."""
    properties = [["processor", processor], ["fast", fast]]
    return pytest.TestReport(
        case, (case, 1, case), {}, "passed", None, "call", user_properties=properties, duration=2.0 * processor
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


def test_a_case_of_the_slow_tier_has_no_limit(times: CaseTimes) -> None:
    assert exit_status_after(times, report("a", 60.0, fast=False)) == pytest.ExitCode.OK


def test_the_table_lists_the_slowest_case_first(times: CaseTimes) -> None:
    exit_status_after(times, report("a", 0.5, fast=True), report("b", 1.25, fast=True))
    assert times.file is not None
    lines = times.file.read_text(encoding="utf-8").splitlines()
    assert lines[1:] == ["1.250\t2.500\tb", "0.500\t1.000\ta"]
