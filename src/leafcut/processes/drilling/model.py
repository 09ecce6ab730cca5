"""Results specific to drilling."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import FixtureBox


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling results beyond the general outcome.

    Attributes
    ----------
    low_ways_saved_s
        Time saved against the same order with all travel moves above the highest point, s; None for a flat part.
    thickness
        Of the plate, mm; None if unknown.
    surface
        The part that contains the holes, if given; None for a plate.
    """

    low_ways_saved_s: float | None = None
    thickness: float | None = None
    surface: Mesh | None = field(default=None, compare=False, repr=False)
    fixtures: tuple[FixtureBox, ...] = ()
