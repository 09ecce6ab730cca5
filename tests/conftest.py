"""What several rooms' tests share."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import settings

# Compiling and a busy machine make times noisy, and no test asserts a duration; the same cases in every run.
settings.register_profile("leafcut", deadline=None, derandomize=True)
settings.load_profile("leafcut")

# Nobody's own defaults are read, and nothing is remembered from run to run: what is told does not hang on that.
os.environ["LEAFCUT_DEFAULTS"] = ""
os.environ["XDG_STATE_HOME"] = os.environ["LOCALAPPDATA"] = os.devnull


@pytest.fixture(scope="session")
def rs274() -> str:
    """Return the path of LinuxCNC's interpreter; skip without it, or fail where it is required."""
    return _of_linuxcnc("rs274")


@pytest.fixture(scope="session")
def qtplasmac_gcode() -> str:
    """Return the path of the filter of LinuxCNC's QtPlasmaC screen; skip without it, or fail where it is required."""
    return _of_linuxcnc("qtplasmac_gcode")


def _of_linuxcnc(name: str) -> str:
    program = shutil.which(name)
    if program is None:
        if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
            pytest.fail(f"{name} is required here: apt-get install linuxcnc-uspace")
        pytest.skip(f"{name} is not installed")
    return program


@pytest.fixture(scope="session")
def data() -> Path:
    """Return the folder of shared real files, or skip."""
    folder = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data")
    if not folder.is_dir():
        pytest.skip("the shared data is not here; set LEAFCUT_DATA")
    return folder


@pytest.fixture(scope="session")
def examples() -> Path:
    """Return the folder of the drawings that leafcut ships."""
    return Path(__file__).parents[1] / "examples"
