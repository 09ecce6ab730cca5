"""Progress shown while waiting."""

from __future__ import annotations

import io
import sys

import pytest

from leafcut.cli import progress
from leafcut.cli.progress import Reporter
from leafcut.model.heartbeat import Progress


class Terminal(io.StringIO):
    """A standard error that claims to be a terminal."""

    def isatty(self) -> bool:
        return True


def test_without_a_terminal_only_compiling_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with Reporter() as reporter:
        reporter(Progress("reading"))
        reporter(Progress("compiling (once for each kind of job)"))
        reporter(Progress("ordering T1", 0.5, 12.5))
    out, err = capsys.readouterr()
    assert (out, err) == ("", "leafcut: compiling (once for each kind of job) …\n")


def test_quiet_is_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    with Reporter(quiet=True) as reporter:
        reporter(Progress("compiling"))
    assert capsys.readouterr() == ("", "")


def test_a_terminal_shows_a_bar_with_the_cost_when_the_run_takes_long(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress, "QUIET_SECONDS", 0.0)
    with Reporter() as reporter:
        reporter(Progress("ordering T1", 0.5, 1234.5))
        assert reporter.bar.tasks[0].completed == 50.0
        assert reporter.bar.tasks[0].description == "ordering T1: 1,234.50"
    assert reporter.bar.finished is False


def test_the_bar_tells_the_gap_and_how_long_the_rest_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the work in ten seconds: the half that is left takes twenty. Compiling before it does not count."""
    now = [0.0]
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(progress.time, "perf_counter", lambda: now[0])
    with Reporter() as reporter:
        for seconds, share in ((60.0, 0.0), (100.0, 0.25), (110.0, 0.5)):
            now[0] = seconds
            reporter(Progress("ordering T1", share, 10.0, 0.0123))
        task = reporter.bar.tasks[0]
        assert task.description == "ordering T1: 10.00, gap at most 1.23 %"
        assert task.fields["left"] == "20 s left"
        now[0] = 1100.0
        reporter(Progress("ordering T1", 0.5, 10.0))
        assert task.fields["left"] == "33 min left"


def test_a_short_run_shows_no_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(progress, "QUIET_SECONDS", 1e9)
    with Reporter() as reporter:
        reporter(Progress("ordering T1", 0.5, 1.0))
    assert reporter.bar is None
    assert sys.stderr.getvalue() == ""
