"""Chip thickness of a milling cut, from the position of the material on the tool's front."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.material.cutting import Removed

#: Cells are cut by their centres: the wall before a cut may be this many cells nearer.
_MARGIN = 1.0


def chip_share(removed: Removed, radius: Floats, cell: float) -> Floats:
    """Return the maximum chip thickness of every move as a share of the feed per tooth; 0 without a cut.

    At a distance d beside the path of a tool of radius R, a tooth takes a chip of √(1 − (d/R)²) times the feed per
    tooth. The thickest chip is at the smallest d. For a one-sided cut of width a < R, this is the chip thinning formula
    2 √(a/D (1 − a/D)) (Altintas, Manufacturing Automation, 2nd ed., section 2.6: h = c sin φ).
    """
    # For a cut on one side only, left or right is negative: minus the distance from the path to the cut.
    nearest = np.maximum(np.maximum(-removed.left, -removed.right) - _MARGIN * cell, 0.0)
    nearest = np.where(removed.cuts, np.minimum(nearest, radius), radius)
    share: Floats = np.sqrt(1.0 - (nearest / radius) ** 2)
    return share


def cut_width(removed: Removed, radius: Floats, cell: float) -> Floats:
    """Return the width of cut of every move, mm, perpendicular to its path; at most the tool's diameter."""
    swept = np.where(removed.cuts, removed.left + removed.right + cell, 0.0)
    width: Floats = np.minimum(np.maximum(swept, 0.0), 2.0 * radius)
    return width
