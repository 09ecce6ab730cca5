"""After a warm-up, no job waits for the compilation of a kernel."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numba
import pytest

from leafcut.cli import warming
from leafcut.cli.app import run
from plain_python import Kernel, is_part

ROOT = Path(__file__).parents[1] / "src" / "leafcut"


def called_by_python() -> dict[str, Any]:
    """Return the kernels that other rooms than theirs name, as ``module.name``."""
    named = {name for file in ROOT.rglob("*.py") if file.parent.name != "kernels" for name in _named_by(file)}
    found = {name: getattr(import_module(f"leafcut.kernels.{name[0]}"), name[1], None) for name in named}
    return {".".join(name): one for name, one in found.items() if isinstance(one, Kernel)}


def _named_by(file: Path) -> Iterator[tuple[str, str]]:
    """Yield what a file names of the kernels' modules: (module, name)."""
    text = file.read_text(encoding="utf-8")
    if "leafcut.kernels" not in text:
        return
    tree, modules = ast.parse(text), {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "leafcut.kernels":
            modules |= {alias.asname or alias.name: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("leafcut.kernels."):
            yield from ((str(node.module).rpartition(".")[2], alias.name) for alias in node.names)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
            yield modules[node.value.id], node.attr


@pytest.mark.slow
def test_every_kernel_is_compiled_after_a_warm_up() -> None:
    warmed = warming.compile_all_kernels()
    kernels = called_by_python()
    assert warmed.is_cached and len(kernels) > 40
    assert [name for name, kernel in kernels.items() if not kernel.signatures] == []


def test_python_calls_only_kernels_that_are_compiled_for_python() -> None:
    """A kernel that only kernels call has no entry for Python: a call would crash the process."""
    assert [name for name, kernel in called_by_python().items() if is_part(kernel)] == []


def test_a_warm_up_that_compiles_nothing_prints_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("_warm_order", "_warm_program_reader", "_warm_surfaces", "_warm_timing"):
        monkeypatch.setattr(warming, name, lambda: None)
    assert run(["install", "kernels"]) == 0
    assert capsys.readouterr() == ("", "")
    assert run(["install", "kernels", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"schema": 1, "compiled": 0, "seconds": 0.0, "kept": True}


def test_compiled_kernels_are_counted_and_a_missing_cache_folder_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("_warm_order", "_warm_program_reader"):
        monkeypatch.setattr(warming, name, lambda: None)
    monkeypatch.setattr(warming, "_warm_surfaces", lambda: numba.njit(lambda x: x)(1))
    assert run(["install", "kernels"]) == 0
    said = capsys.readouterr()
    assert re.fullmatch(r"1 kernel compiled in \d+ s\n", said.out)
    assert said.err == "leafcut: compiling (once for each kind of job) …\n"
    monkeypatch.setattr("leafcut.kernels.compiling.cache_folder", lambda: None)
    assert run(["install", "kernels"]) == 1
    assert "leafcut: no folder for compiled code is writable; set NUMBA_CACHE_DIR" in capsys.readouterr().err
