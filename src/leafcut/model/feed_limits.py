"""`FeedLimits`: limits for adapting the feed of a mill to its engagement."""

from __future__ import annotations

import math
from dataclasses import dataclass

from leafcut.model.work_material import WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

#: Largest factor by which a feed in material may grow.
FEED_INCREASE = 1.5


@dataclass(frozen=True)
class FeedLimits:
    """Limits of adaptive feeds of a mill: mm, mm/s, 1/min, W.

    Attributes
    ----------
    depth, film_depth, film
        Depth of cut: of a level; in a strip no wider than `film`, such as a finishing pass, the full depth
        `film_depth`.
    power
        Spindle power available at this speed, W, limited by power and torque; infinite if unknown.
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
        """Chip thickness per revolution, mm: single-tooth equivalent."""
        return SECONDS_PER_MINUTE * self.feed / self.rpm
