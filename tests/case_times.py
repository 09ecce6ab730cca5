"""Record the processor time of each case and its set-up, and fail a run in which a fast case exceeds the limit.

A case counts as fast if it has no marker of `SLOW_TIER`. The set-up of a shared fixture counts for the case that needs
it first. Processor time includes ended child processes. Unlike wall time, it hardly depends on machine load.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

#: Markers of the cases that `make test-more` runs and `make test` leaves out.
SLOW_TIER = ("slow", "browser", "external")

#: Shorter set-ups are not recorded, s: most cases have almost none.
SHORT_SETUP = 0.1

#: Fixture that starts an outside program → marker of every case that uses it.
MARKER_OF_FIXTURE = {
    "browser": "browser",
    "chromium": "browser",
    "rs274": "external",
    "qtplasmac_gcode": "external",
    "inkscape": "external",
    "freecadcmd": "external",
    "kicad_python": "external",
    "linuxcnc_samples": "external",
    "simulated_linuxcnc": "external",
    "running": "external",  # the simulated GRBL board
    "bash": "external",
    "fish": "external",
    "zsh": "external",
}


def processor_seconds() -> float:
    """Return the processor time of this process and its ended children, s."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


class CaseTimes:
    """Collect the times of all cases; with xdist, in the process that started the workers."""

    def __init__(self, limit: float | None, file: Path | None) -> None:
        self.limit = limit
        self.file = file
        #: Case, or "setup of" and the case → (wall time, s; processor time, s; whether the case is fast).
        self.times: dict[str, tuple[float, float, bool]] = {}
        self.count = 0

    def over_limit(self) -> list[tuple[float, str]]:
        """Return processor time and name of each fast case or set-up above the limit, the slowest first.

        More processor time than all cores had in the case belongs to a child process of an earlier case.
        """
        if self.limit is None:
            return []
        cores = os.cpu_count() or 1
        own = [(min(cpu, wall * cores), case) for case, (wall, cpu, fast) in self.times.items() if fast]
        return sorted((times for times in own if times[0] > self.limit), reverse=True)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        # A case appends its times phase by phase, so the last value belongs to the phase of the report.
        values = dict(report.user_properties)
        if report.when == "call":
            self.count += 1
            self.times[report.nodeid] = (report.duration, values["processor"], values["fast"])
        elif report.when == "setup" and values.get("processor", 0.0) > SHORT_SETUP:
            self.times[f"setup of {report.nodeid}"] = (report.duration, values["processor"], values["fast"])

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if self.file is not None:
            rows = sorted(self.times.items(), key=lambda row: -row[1][1])
            lines = [f"{cpu:.3f}\t{wall:.3f}\t{case}\n" for case, (wall, cpu, _) in rows]
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self.file.write_text("processor, s\twall, s\tcase\n" + "".join(lines), encoding="utf-8")
        if self.over_limit() and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        total = sum(cpu for _, cpu, _ in self.times.values())
        terminalreporter.write_line(f"{self.count} cases and their set-ups took {total:.0f} s of processor")
        if slow := self.over_limit():
            terminalreporter.section(
                f"fast cases and set-ups above {self.limit:g} s of processor: make them smaller or mark them slow",
                red=True,
            )
            for cpu, case in slow:
                terminalreporter.write_line(f"{cpu:6.1f} s  {case}")


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("times of cases")
    group.addoption(
        "--case-limit",
        type=float,
        metavar="SECONDS",
        help="fail if a fast case or its set-up takes more processor time",
    )
    group.addoption("--case-times", type=Path, metavar="FILE", help="write the times of all cases to a table")


def pytest_configure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(CaseTimes(config.getoption("case_limit"), config.getoption("case_times")))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark each case that uses an outside program, so that no mark can be forgotten."""
    for item in items:
        for name in getattr(item, "fixturenames", ()):
            if name in MARKER_OF_FIXTURE:
                item.add_marker(MARKER_OF_FIXTURE[name])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Attach the processor time of the fixtures to the report of the set-up."""
    return (yield from _timed(item))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Attach the processor time of a case to its report."""
    return (yield from _timed(item))


def _timed(item: pytest.Item) -> Iterator[None]:
    start = processor_seconds()
    try:
        return (yield)
    finally:
        item.user_properties.append(("processor", processor_seconds() - start))
        item.user_properties.append(("fast", not any(item.get_closest_marker(name) for name in SLOW_TIER)))
