"""Folder of real files (LEAFCUT_DATA); it may be missing."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

DATA = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data")


def tour_nodes(file: Path) -> NDArray[np.int32]:
    """Return the visiting order of a TSPLIB ``.tour`` file, nodes from 0."""
    section = file.read_text(encoding="ascii").split("TOUR_SECTION")[1].split("-1")[0]
    return np.array(section.split(), dtype=np.int32) - 1
