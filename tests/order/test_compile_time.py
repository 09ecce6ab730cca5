"""The time to load and compile kernels is reported apart from all other times."""

from __future__ import annotations

import itertools
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest
from numba.core import event

import leafcut
from leafcut import kernels
from leafcut.kernels import COMPILE, PREPARE, compiling
from leafcut.order import stop
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json


class Clock:
    """A clock that only a test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    kernels.install_compilation_listener()
    made = Clock()
    monkeypatch.setattr(compiling, "time", made)
    monkeypatch.setattr(stop, "time", made)
    return made


def test_the_clock_of_searches_stands_still_while_kernels_are_loaded_or_compiled(clock: Clock) -> None:
    """Searching 2 s, loading or compiling 30 s, searching 1 s: a limit of 4 s is not over."""
    limit = stop.Stop(seconds=4.0)
    clock.now += 2.0
    with event.trigger_event(PREPARE):
        clock.now += 30.0
        assert limit.elapsed() == pytest.approx(2.0)
    clock.now += 1.0
    assert limit.elapsed() == pytest.approx(3.0)
    assert not limit.must_stop()
    clock.now += 1.0
    assert limit.must_stop()


def test_seconds_of_nested_compilations_count_once(clock: Clock) -> None:
    """A kernel that calls another kernel compiles it inside; a third is loaded."""
    with compiling.announced_compilations(lambda _: None) as compilations:
        with event.trigger_event(PREPARE), event.trigger_event(COMPILE):
            clock.now += 5.0
            with event.trigger_event(PREPARE), event.trigger_event(COMPILE):
                clock.now += 7.0
            clock.now += 1.0
        with event.trigger_event(PREPARE):
            clock.now += 2.0
    assert (compilations.count, compilations.seconds) == (2, pytest.approx(15.0))


def test_the_end_of_a_compilation_that_had_begun_before_is_not_counted(clock: Clock) -> None:
    """Another thread is compiling when the counting begins: the clock of searches must not stand still afterwards."""
    with ExitStack() as counting:
        with event.trigger_event(PREPARE), event.trigger_event(COMPILE):
            counted = counting.enter_context(compiling.announced_compilations(lambda _: None))
            clock.now += 3.0
        clock.now += 4.0
        with event.trigger_event(PREPARE), event.trigger_event(COMPILE):
            clock.now += 5.0
    clock.now += 6.0
    assert (counted.count, counted.seconds) == (1, pytest.approx(5.0))


@pytest.mark.parametrize("cached", [False, True])
def test_numba_loads_and_compiles_kernels_outside_the_clock_of_searches(
    cached: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kernels.cache_folder.cache_clear()
    try:
        for _ in range(1 + cached):
            double = kernels.kernel(lambda x: 2 * x)
            before, compilations = compiling.compile_seconds(), compiling.Compilations()
            kernels.listeners.append(compilations.record_event)
            assert double(21) == 42
            kernels.listeners.remove(compilations.record_event)
    finally:
        kernels.cache_folder.cache_clear()
    assert compilations.count == (0 if cached else 1)
    assert compiling.compile_seconds() > before


def test_a_run_states_compile_time_beside_its_own(examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile time during the run is not part of its seconds."""
    spent = itertools.chain([100.0], itertools.repeat(140.0))
    monkeypatch.setattr("leafcut.api.compile_seconds", lambda: next(spent))
    outcome = leafcut.optimize(examples / "plate_8x8_10.dxf", process="drill", thickness=5, preset="fast")
    assert outcome.compile_seconds == 40.0
    answer = program_as_json(report_of(replace(outcome, seconds=2.0)))
    assert (answer["seconds"], answer["compile_seconds"]) == (2.0, 40.0)
