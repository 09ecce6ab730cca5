"""`FeedLimits`: limits for feeds that depend on the engagement of a mill."""

from __future__ import annotations

import math
from dataclasses import dataclass

from leafcut.model.work_material import WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

#: Maximum factor by which a feed in material may increase.
FEED_INCREASE = 1.5


@dataclass(frozen=True)
class FeedLimits:
    """Limits for the feeds of a mill, in mm, mm/s, 1/min and W.

    Attributes
    ----------
    feed, most
        The tool's own feed, and the maximum feed.
    depth, film_depth, film
        Depth of cut on a level, and depth of cut in strips no wider than `film`, such as finishing passes.
    power
        Power that the spindle delivers at this speed, limited by its maximum power and torque; infinite if unknown.
    material, teeth
        Material and number of teeth; None and 0 if the power is unknown.
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
        """Chip thickness per revolution, mm, as if the tool had only one tooth."""
        return SECONDS_PER_MINUTE * self.feed / self.rpm
