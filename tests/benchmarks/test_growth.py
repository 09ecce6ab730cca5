"""Powers of growth, stopwatches of searches, and peaks of memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from benchmarks import growth, limits, verify_large


@pytest.mark.parametrize(("power", "shown"), [(1, "1.0"), (1.5, "1.5"), (2, "2.0")])
def test_the_power_does_not_depend_on_the_start(power: float, shown: str) -> None:
    assert growth.exponent([3.0 + 2.0 * n**power for n in (1, 2, 4)]) == shown


def test_no_growth_has_no_power() -> None:
    assert growth.exponent([100.0, 101.0, 103.0]) == "–"


def test_nested_searches_count_once_and_a_generator_only_while_it_works(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(limits, "clock", lambda: now[0])
    watch = limits.Watch()

    def takes(seconds: float) -> None:
        now[0] += seconds

    inner = limits.watched(takes, watch)

    def values() -> Iterator[int]:
        for k in range(2):
            takes(1.0)
            inner(2.0)
            yield k

    for _ in limits.watched(values, watch)():
        takes(10.0)  # the caller's work is no search
    assert watch.seconds == pytest.approx(6.0)


@pytest.mark.slow
def test_the_peak_of_a_run_does_not_include_the_memory_of_the_benchmark(tmp_path: Path) -> None:
    """On Linux a process inherits the peak of its parent."""
    _, before, status = verify_large.run(["--version"], str(tmp_path))
    assert status == 0
    large = np.ones(40_000_000)  # 320 MB
    _, after, _ = verify_large.run(["--version"], str(tmp_path))
    assert large.all()
    assert 5e6 < after < 1.2 * before < 300e6


@pytest.mark.parametrize("benchmark", [growth, limits])
def test_an_unknown_work_is_refused_with_the_known_names(benchmark: object, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        benchmark.main(["cut", "nosuch"])  # type: ignore[attr-defined]
    assert "'nosuch' is not one of drill, panel, cut, engrave" in capsys.readouterr().err


@pytest.mark.parametrize("limit", ["0", "-3", "nan", "1e400", "soon"])
def test_a_limit_that_never_ends_a_search_is_refused(limit: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        limits.main(["drill", f"--limits={limit}"])
    assert capsys.readouterr().err.endswith(f"{limit!r} is not a number of seconds above 0\n")
