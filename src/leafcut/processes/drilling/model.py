"""Results specific to drilling."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import FixtureBox


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling results beyond the general outcome.

    `low_ways_saved_s` is the time saved against the same order with all travel moves above the highest point, s; None
    for a flat part. `thickness` (mm) is None if unknown. `surface` is the part that contains the holes; None for a
    plate.
    """

    low_ways_saved_s: float | None = None
    thickness: float | None = None
    surface: Mesh | None = field(default=None, compare=False, repr=False)
    fixtures: tuple[FixtureBox, ...] = ()
