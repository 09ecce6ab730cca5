"""Kernels are the Python they are written in: compiled or not, they give the same answers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("ten_nodes.py")


def answers(disable_jit: str) -> dict[str, object]:
    """Return the answers of the script in a fresh process."""
    environment = dict(os.environ, NUMBA_DISABLE_JIT=disable_jit)
    done = subprocess.run([sys.executable, str(SCRIPT)], capture_output=True, text=True, check=True, env=environment)
    return json.loads(done.stdout)


@pytest.mark.slow
def test_compiled_kernels_and_plain_python_give_equal_answers() -> None:
    compiled, plain = answers("0"), answers("1")
    assert compiled.keys() == plain.keys()
    for name, value in compiled.items():
        assert value == plain[name], name
