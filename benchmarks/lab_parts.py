"""Writes the plates and boards of the lab's experiments: holes of the examples in an order drawn by chance.

    python benchmarks/lab_parts.py src/leafcut/lab/parts/plates

The publications compare with programs whose order is "random"; here it is that of a fixed seed. mm and mm of diameter.
"""

from __future__ import annotations

import random
import sys
from pathlib import Path

from leafcut.read.examples import PLATE_NAMES, plate

SEED = 1
INCH = 25.4


def table(name: str) -> str:
    """Return the holes of an example as CSV, shuffled."""
    rows = [f"{INCH * one.x:.4f},{INCH * one.y:.4f},{INCH * one.diameter:.4f}" for one in plate(name).holes]
    random.Random(SEED).shuffle(rows)
    return "\n".join(["x,y,diameter", *rows, ""])


def main(folder: Path) -> None:
    """Write a file for each plate of 8 × 8 and 15 × 15 inches and each board."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in PLATE_NAMES:
        if "x" in name or name.startswith("board"):
            (folder / f"{name.replace('-', '_')}.csv").write_text(table(name), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
