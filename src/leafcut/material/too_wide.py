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
    """Returns the points of a path whose nearer neighbour is farther away than the step-over, float64[n, 2], mm.

    A path that differs from the previous one in a few places is only searched there.

    Parameters
    ----------
    centres
        shapely geometry of the allowed tool centres.
    """

    def __init__(self, centres: Any, rules: PocketRules) -> None:
        self.centres, self.rules = centres, rules
        self.cells = Cells(centres.bounds, FARTHEST * rules.tool_diameter, 2 * _REACHES + 4)
        self.last, self.found = np.zeros((0, 2)), np.zeros((0, 2))

    def __call__(self, path: PocketPath) -> Floats:
        """Return the points of a path."""
        way = way_of(path, self.rules)
        moved = self.cells.of(np.vstack([_not_in(way.xy, self.last), _not_in(self.last, way.xy)]))
        changed = self.cells.around(moved, _REACHES)
        looked = np.isin(self.cells.of(way.xy), self.cells.around(changed, 1))
        new = wide_places(way, self.centres, self.rules, looked)
        old = self.found[~np.isin(self.cells.of(self.found), changed)]
        self.last, self.found = way.xy, np.vstack([old, new[np.isin(self.cells.of(new), changed)]])
        return self.found


def _not_in(places: Floats, others: Floats) -> Floats:
    key = numbered(np.vstack([places, others]), _SAME)
    return places[~np.isin(key[: len(places)], key[len(places) :])]
