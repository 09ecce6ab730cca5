"""What several rooms' tests share."""

from __future__ import annotations

import os
import shutil

import pytest
from hypothesis import settings

# Compiling and a busy machine make times noisy, and no test asserts a duration; the same cases in every run.
settings.register_profile("leafcut", deadline=None, derandomize=True)
settings.load_profile("leafcut")


@pytest.fixture(scope="session")
def rs274() -> str:
    """Return the path of LinuxCNC's interpreter; skip without it, or fail where it is required."""
    program = shutil.which("rs274")
    if program is None:
        if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
            pytest.fail("rs274 is required here: apt-get install linuxcnc-uspace")
        pytest.skip("rs274 is not installed")
    return program
