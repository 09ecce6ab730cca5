"""Incremental search for cuts that are too wide: unchanged parts of successive paths are not searched again."""

from __future__ import annotations

from typing import Any

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.geometry.cells import Cells, numbered
from leafcut.material.step_over import FARTHEST, wide_places
from leafcut.material.tool_steps import way_of
from leafcut.model.pocket import PocketPath, PocketRules

#: Distance within which points are equal, mm.
_SAME = 1e-4
#: Update radius of a change, in maximum neighbour distances: the neighbour of a point, and that neighbour's corner.
_REACHES = 2


class TooWide:
    """Finds the points of a path whose nearer neighbour is farther away than the step-over, float64[n, 2], mm.

    A path that differs from the previous one in a few positions is only searched there.

    Parameters
    ----------
    centres
        shapely geometry of the allowed tool centres.
    """

    def __init__(self, centres: Any, rules: PocketRules) -> None:
        self.centres, self.rules = centres, rules
        self.cells = Cells(centres.bounds, FARTHEST * rules.tool_diameter, 2 * _REACHES + 4)
        self.previous, self.wide = np.zeros((0, 2)), np.zeros((0, 2))

    def __call__(self, pocket_path: PocketPath) -> Floats:
        """Return the points of a path."""
        path = way_of(pocket_path, self.rules)
        moved_cells = self.cells.of(np.vstack([_without(path.xy, self.previous), _without(self.previous, path.xy)]))
        changed = self.cells.around(moved_cells, _REACHES)
        to_check = np.isin(self.cells.of(path.xy), self.cells.around(changed, 1))
        new = wide_places(path, self.centres, self.rules, to_check)
        old = self.wide[~np.isin(self.cells.of(self.wide), changed)]
        self.previous, self.wide = path.xy, np.vstack([old, new[np.isin(self.cells.of(new), changed)]])
        return self.wide


def _without(points: Floats, excluded: Floats) -> Floats:
    key = numbered(np.vstack([points, excluded]), _SAME)
    return points[~np.isin(key[: len(points)], key[len(points) :])]
