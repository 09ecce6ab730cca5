"""LinuxCNC needs the estimated time for a short program."""

from __future__ import annotations

import os
import shutil

import pytest

from benchmarks import machine_time, timed_programs


def test_linuxcnc_takes_as_long_as_estimated_within_two_percent() -> None:
    if not (machine_time.SIMULATION / "simrun.py").exists():
        pytest.skip("the simulated LinuxCNC is missing; set LEAFCUT_LINUXCNC")
    for tool, package in machine_time.TOOLS.items():
        if shutil.which(tool) is None:
            if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
                pytest.fail(f"{tool} is required here: apt-get install {package}")
            pytest.skip(f"{tool} is not installed")
    text = timed_programs.polygon(3000, "G64")
    assert machine_time.estimated_seconds(text) == pytest.approx(machine_time.simulated_seconds(text), rel=0.02)
