"""What is told of growth and of time limits is counted rightly."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from benchmarked import benchmark


@pytest.mark.parametrize(("power", "told"), [(1, "1.0"), (1.5, "1.5"), (2, "2.0")])
def test_the_power_is_found_whatever_the_start_takes(power: float, told: str) -> None:
    assert benchmark("growth").exponent([3.0 + 2.0 * n**power for n in (1, 2, 4)]) == told


def test_what_does_not_grow_has_no_power() -> None:
    assert benchmark("growth").exponent([100.0, 101.0, 103.0]) == "–"


def test_searches_within_each_other_are_counted_once_and_a_generator_only_while_it_works(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    limits, now = benchmark("limits"), [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    watch = limits.Watch()

    def takes(seconds: float) -> None:
        now[0] += seconds

    inner = limits.watched(takes, watch)

    def some() -> Iterator[int]:
        for k in range(2):
            takes(1.0)
            inner(2.0)
            yield k

    for _ in limits.watched(some, watch)():
        takes(10.0)  # what is done with it is not the search
    assert watch.seconds == pytest.approx(6.0)


def test_the_peak_of_a_run_is_its_own_however_much_memory_the_script_has_used(tmp_path: Path) -> None:
    """The kernel lets a process begin with the peak of the one that started it."""
    run = benchmark("verify_large").run
    _, before, said = run(["machines"], str(tmp_path))
    assert said == "status 0"
    large = np.ones(40_000_000)  # 320 MB
    _, after, _ = run(["machines"], str(tmp_path))
    assert large.all()
    assert 10e6 < after < 1.2 * before < 300e6
    assert run(["machines", "--nosuch"], str(tmp_path))[2] == "status 2"


@pytest.mark.parametrize("script", ["growth", "limits"])
def test_a_work_that_is_not_there_is_told_with_those_that_are(
    script: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", [script, "cut", "nosuch"])
    with pytest.raises(SystemExit):
        benchmark(script).main()
    assert "'nosuch' is not one of drill, panel, cut, engrave" in capsys.readouterr().err


@pytest.mark.parametrize("limit", ["0", "-3", "nan", "1e400", "soon"])
def test_a_limit_that_ends_nothing_is_told(
    limit: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["limits", "drill", f"--limits={limit}"])
    with pytest.raises(SystemExit):
        benchmark("limits").main()
    assert capsys.readouterr().err.endswith(f"{limit!r} is not a number of seconds above 0\n")
