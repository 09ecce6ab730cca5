"""Programs whose speeds and heights tests change, on one block."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import leafcut
from leafcut.model.outcome import Outcome

#: 70 × 50 × 10 mm, its top at Z0.
BLOCK = "0,0,-10,70,50,0"
HEAD = "(T1 D=6. - flat end mill)\nG21 G90 G94 G17 G64 P0.02\nT1 M6\nS6000 M3\n"
TAIL = "G0 Z15\nM5\nM30\n"


def reordered(folder: Path, text: str, **options: Any) -> Outcome:
    """Return a program put in order, on a machine whose search is nothing to wait for."""
    file = folder / "part.ngc"
    file.write_text(text)
    return leafcut.optimize(file, **{"process": "reorder", "header": False, "algorithm": "none", **options})


def body(outcome: Outcome) -> list[str]:
    """Return the lines between the head and the tail."""
    lines = outcome.text.splitlines()
    return lines[HEAD.count("\n") : -TAIL.count("\n")]
