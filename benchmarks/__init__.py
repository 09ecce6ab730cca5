"""Benchmarks that guard a release: `python -m benchmarks NAME [options]`, run in the root of the checkout."""

from __future__ import annotations

import os
from pathlib import Path

#: Root of the checkout.
ROOT = Path(__file__).parents[1]


def shared(variable: str, name: str) -> Path:
    """Return the folder that the environment variable names, or by default shared/NAME next to the checkout."""
    return Path(os.environ.get(variable) or ROOT.parent / "shared" / name)


def data_folder() -> Path:
    """Return the folder of the shared test data."""
    return shared("LEAFCUT_DATA", "data")
