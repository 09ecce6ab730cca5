"""Find the outside programs that some tests need.

Tests of a missing program are skipped, or fail if LEAFCUT_REQUIRE_EXTERNAL is 1.
"""

from __future__ import annotations

import os
import shutil
from typing import NoReturn

import pytest


def missing(what: str, packages: str) -> NoReturn:
    """Skip the test because a program or file is missing; fail instead if LEAFCUT_REQUIRE_EXTERNAL is 1."""
    if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
        pytest.fail(f"{what} is required here: apt-get install {packages}")
    pytest.skip(f"{what} is not installed")


def program_path(name: str, package: str) -> str:
    """Return the path of a program of a Debian package."""
    return shutil.which(name) or missing(name, package)
