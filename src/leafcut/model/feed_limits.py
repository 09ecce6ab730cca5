"""`FeedLimits`: within what the feed of one mill may follow what it meets."""

from __future__ import annotations

import math
from dataclasses import dataclass

from leafcut.model.work_material import WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

#: A feed in the material grows by this factor at most.
FEED_INCREASE = 1.5


@dataclass(frozen=True)
class FeedLimits:
    """What feeds of one mill keep, where they follow what it meets: mm, mm/s, 1/min, W.

    Attributes
    ----------
    diameter
        Of the tool, mm.
    feed, rpm
        Of the tool: together they make its chip.
    most
        No feed in the material is higher.
    depth, film_depth, film
        How deep a cut is: that of a level; in a strip no wider than `film`, such as a finishing pass takes, all of its
        depth.
    power
        What the spindle gives to the cut at this speed, W, by its power and its torque; infinite where that is not
        known.
    material, teeth
        What is cut and by how many teeth; None and 0 where the power is not known.
    """

    diameter: float
    feed: float
    rpm: float
    most: float
    depth: float
    film_depth: float
    film: float
    power: float = math.inf
    material: WorkMaterial | None = None
    teeth: int = 0

    @property
    def chip(self) -> float:
        """The thickest chip in a revolution, mm: of one tooth, if it had but one."""
        return SECONDS_PER_MINUTE * self.feed / self.rpm
