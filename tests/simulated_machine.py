"""The simulated LinuxCNC in tests: its programs are required where all tools are, its scripts are shared data."""

from __future__ import annotations

import os
import shutil
from typing import Any

import pytest


def need_simulation(machine_time: Any) -> None:
    """Skip without the simulation's scripts; without its programs fail where those are required, else skip."""
    if not (machine_time.SIMULATION / "simrun.py").exists():
        pytest.skip("the simulated LinuxCNC is not here; set LEAFCUT_LINUXCNC")
    for tool, package in machine_time.TOOLS.items():
        if shutil.which(tool) is None:
            if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
                pytest.fail(f"{tool} is required here: apt-get install {package}")
            pytest.skip(f"{tool} is not installed")
