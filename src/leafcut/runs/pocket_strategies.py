"""The ways to clear a pocket that there are: name → what makes the path of one region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from leafcut.model.pocket import PocketPath
from leafcut.runs.run import Run

if TYPE_CHECKING:
    from leafcut.plan.pocket_region import CentreRegion

#: Makes the path of the tool's centre over one level of one region.
Strategy = Callable[["CentreRegion", Run], PocketPath]


def _contour(region: CentreRegion, run: Run) -> PocketPath:
    from leafcut.plan.pocket_rings import contour

    return contour(region)


@dataclass(frozen=True)
class Way:
    """A strategy and what it is called in words."""

    name: str
    path: Strategy
    words: str


#: Every strategy, in the order in which they are told.
WAYS = (Way("contour", _contour, "rings, linked from the inside out"),)
