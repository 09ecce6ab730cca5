"""As another user, from a package that may only be read, with no home and no folder for compiled code, leafcut runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from outside_programs import program_path

PACKAGE = Path(__file__).parents[1] / "src" / "leafcut"
#: Root may write everywhere: these capabilities leave a user who may read everything, as Python may be in root's home.
READS_ONLY = "-all,+dac_read_search"


def another_user() -> list[str]:
    """Return the start of a command that runs as a user without write access; nothing if this user has none."""
    if os.geteuid():
        return []
    setpriv = program_path("setpriv", "util-linux")
    rights = [f"--{of}={READS_ONLY}" for of in ("inh-caps", "ambient-caps", "bounding-set")]
    return [setpriv, "--reuid", "65534", "--regid", "65534", "--clear-groups", *rights]


@pytest.fixture
def package(tmp_path: Path) -> Iterator[Path]:
    """Return a folder with leafcut as installed for all users: nothing is compiled, and nobody may write there."""
    installed = tmp_path / "installed"
    shutil.copytree(PACKAGE, installed / "leafcut", ignore=shutil.ignore_patterns("__pycache__"))
    for path in (installed, *installed.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    yield installed
    for path in (installed, *installed.rglob("*")):
        if path.is_dir():
            path.chmod(0o755)  # pytest removes it


@pytest.mark.slow
def test_where_nothing_can_be_written_leafcut_compiles_in_memory_and_says_so_in_one_line(package: Path) -> None:
    """Before, Numba found no folder and every command ended in its error."""
    words = ["optimize", "example:plate-10", "--thickness", "6", "--algorithm", "none", "--no-bound", "--dry-run"]
    known = {"PATH": os.environ["PATH"], "HOME": "/nonexistent", "PYTHONPATH": str(package), "LEAFCUT_DEFAULTS": ""}
    done = subprocess.run(
        [*another_user(), sys.executable, "-m", "leafcut", *words],
        cwd="/", env=known, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert re.search(r"^verified +yes", done.stdout, re.MULTILINE)
    (line,) = done.stderr.splitlines()
    assert "no writable folder for compiled code; set NUMBA_CACHE_DIR" in line
    assert not list(package.rglob("__pycache__"))
