"""The benchmarks as modules: each runs by itself in their folder, where it finds the others."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"

# Behind everything else: none of them takes the place of a module of the tests.
sys.path.append(str(BENCHMARKS))


def benchmark(name: str) -> Any:
    """Return a module of the benchmarks."""
    return import_module(name)
