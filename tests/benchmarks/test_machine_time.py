"""The programs whose time is compared with LinuxCNC's are understood, and LinuxCNC agrees on a short one."""

from __future__ import annotations

import os
import shutil
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def benchmark(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return what imports a module of the benchmarks."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return import_module


def test_every_program_that_is_made_here_can_be_timed(benchmark: Any) -> None:
    script = benchmark("machine_time")
    made = {name: text() for name, text in benchmark("timed_programs").programs().items() if "," in name}
    assert len(made) >= 30
    assert all(5.0 < script.estimated_seconds(text) < 400.0 for text in made.values())


@pytest.mark.external
def test_linuxcnc_takes_as_long_as_estimated_within_two_percent(benchmark: Any) -> None:
    script = benchmark("machine_time")
    if not (script.SIMULATION / "simrun.py").exists() or shutil.which("linuxcnc") is None:
        if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
            pytest.fail("LinuxCNC and its simulation are required here; see LEAFCUT_LINUXCNC")
        pytest.skip("LinuxCNC or its simulation is not here")
    text = benchmark("timed_programs").polygon(3000, "G64")
    assert script.estimated_seconds(text) == pytest.approx(script.simulated_seconds(text), rel=0.02)
