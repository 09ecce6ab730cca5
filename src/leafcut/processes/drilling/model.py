"""Results that only drilling has."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import FixtureBox


@dataclass(frozen=True)
class DrillingDetail:
    """Results of drilling, in addition to the general outcome.

    `low_travel_saved_s` is the time, s, that low travel moves save compared with moves above the highest point; None
    for a flat part. `thickness`, mm, is None if unknown. `surface` is the surface of the part; None for a plate.
    `clearance` is the clearance height, mm. `retract` contains the lowest and the highest R plane, mm; None without
    holes.
    """

    low_travel_saved_s: float | None = None
    thickness: float | None = None
    surface: Mesh | None = field(default=None, compare=False, repr=False)
    fixtures: tuple[FixtureBox, ...] = ()
    clearance: float = 0.0
    retract: tuple[float, float] | None = None
