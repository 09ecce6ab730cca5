"""Kernels are the Python they are written in: compiled or not, they give the same answers."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).with_name("ten_nodes.py")
SOURCE = Path(__file__).parents[2] / "src" / "leafcut"


def answers(disable_jit: str) -> dict[str, object]:
    """Return the answers of the script in a fresh process."""
    environment = dict(os.environ, NUMBA_DISABLE_JIT=disable_jit)
    done = subprocess.run([sys.executable, str(SCRIPT)], capture_output=True, text=True, check=True, env=environment)
    return json.loads(done.stdout)


def test_compiled_kernels_and_plain_python_give_equal_answers() -> None:
    compiled, plain = answers("0"), answers("1")
    assert compiled.keys() == plain.keys()
    for name, value in compiled.items():
        assert value == plain[name], name


def test_what_python_calls_of_the_kernels_is_kept_on_disk() -> None:
    """A part of kernels that Python calls would be compiled on every run anew: `kernel` keeps, `part` does not."""
    made: dict[tuple[str, str], str] = {}
    for file in (SOURCE / "kernels").glob("*.py"):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef):
                for name in node.decorator_list:
                    if isinstance(name, ast.Name):
                        made[file.stem, node.name] = name.id
    called = [
        (node.module.rpartition(".")[2], name.name)
        for file in SOURCE.rglob("*.py")
        if file.parent.name != "kernels" and "leafcut.kernels." in (text := file.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("leafcut.kernels.")
        for name in node.names
    ]
    assert len([one for one in called if made.get(one) == "kernel"]) > 20
    assert [one for one in called if made.get(one) == "part"] == []
