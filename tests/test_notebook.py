"""The notebook of the examples runs, cell by cell.

Its code runs here as Python, in one namespace: nbclient would start a kernel in a second process and adds nothing.
"""

from __future__ import annotations

import ast
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
NOTEBOOK = json.loads((EXAMPLES / "library.ipynb").read_text(encoding="utf-8"))
CODE = ["".join(cell["source"]) for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]


def shown(code: str, names: dict[str, Any]) -> Any:
    """Run a cell and return the value of its last line, if that is an expression."""
    tree = ast.parse(code)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "<cell>", "exec"), names)
    return eval(compile(ast.Expression(last.value), "<cell>", "eval"), names) if last else None


def test_every_cell_of_the_notebook_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("plate_27.dxf", "cam_121.nc"):
        shutil.copy(EXAMPLES / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    values = [shown(code, names) for code in CODE]
    assert values[0]._repr_html_().count("<img") == 1
    assert values[2].verified and values[3].same
    assert {path.name for path in tmp_path.iterdir()} >= {"plate.nc", "plate.html", "faster.nc"}
    assert "--pierce-cost: this option does not apply to drilling" in capsys.readouterr().out


def test_the_notebook_holds_no_outputs() -> None:
    assert all(not cell["outputs"] for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code")
