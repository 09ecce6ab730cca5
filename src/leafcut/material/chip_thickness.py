"""How thick the chips of a milling cut get, by where on its front the tool meets material."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.material.cutting import Removed

#: Cells are cut by their middles: the wall before a cut may stand so many cells nearer.
_NEARER = 1.0


def chip_share(removed: Removed, radius: Floats, cell: float) -> Floats:
    """Return the thickest chip of every move as a share of the feed per tooth; 0 where nothing is cut.

    A tooth that stands a distance d beside the way of its tool, of radius R, takes a chip of √(1 − (d/R)²) times the
    feed per tooth; the thickest one is where d is least. For a cut of width a at one side, a < R, that is the known
    2 √(a/D (1 − a/D)) of chip thinning (Altintas, Manufacturing Automation, 2nd ed., section 2.6: h = c sin φ).

    Parameters
    ----------
    radius
        Of every move's tool, mm.
    """
    # Beside the way on one side alone, left or right is negative: minus the distance from it to the cut.
    nearest = np.maximum(np.maximum(-removed.left, -removed.right) - _NEARER * cell, 0.0)
    nearest = np.where(removed.cuts, np.minimum(nearest, radius), radius)
    share: Floats = np.sqrt(1.0 - (nearest / radius) ** 2)
    return share


def cut_width(removed: Removed, radius: Floats, cell: float) -> Floats:
    """Return how wide every move cuts, across its way, mm; at most the tool's diameter."""
    wide = np.where(removed.cuts, removed.left + removed.right + cell, 0.0)
    width: Floats = np.minimum(np.maximum(wide, 0.0), 2.0 * radius)
    return width
