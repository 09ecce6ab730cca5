"""Benchmarks that guard a release: `python -m benchmarks NAME [options]`, run in the root of the checkout."""

from __future__ import annotations

import os
from pathlib import Path

#: Root of the checkout.
ROOT = Path(__file__).parents[1]
#: Code that runs a command of a checkout; in older checkouts, the command is in other modules.
COMMAND = """
try:
    from leafcut.__main__ import main
except ImportError:
    try:
        from leafcut.cli.app import main
    except ImportError:
        from leafcut.cli import main
main()
"""


def environment_of(source: Path, cache: Path) -> dict[str, str]:
    """Return the environment of a process that runs the code of a checkout, with a folder for its compiled code."""
    environment = {key: text for key, text in os.environ.items() if not key.startswith("PYTHON")}
    return environment | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(source / "src")}


def shared(variable: str, name: str) -> Path:
    """Return the folder that the environment variable names, or by default shared/NAME next to the checkout."""
    return Path(os.environ.get(variable) or ROOT.parent / "shared" / name)


def data_folder() -> Path:
    """Return the folder of the shared test data."""
    return shared("LEAFCUT_DATA", "data")
