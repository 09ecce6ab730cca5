"""Results that only drilling produces."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import FixtureBox


@dataclass(frozen=True)
class DrillingDetail:
    """Results of drilling, in addition to the general outcome.

    Attributes
    ----------
    low_travel_saved_s
        Time that low travel moves save compared with moves above the highest point, s; None for a flat part.
    thickness
        Thickness of the part, mm; None if unknown.
    surface
        Surface of the part; None for a plate.
    clearance
        Clearance height, mm.
    retract
        Lowest and highest R plane, mm; None if there are no holes.
    """

    low_travel_saved_s: float | None = None
    thickness: float | None = None
    surface: Mesh | None = field(default=None, compare=False, repr=False)
    fixtures: tuple[FixtureBox, ...] = ()
    clearance: float = 0.0
    retract: tuple[float, float] | None = None
