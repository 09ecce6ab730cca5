"""What drilling alone finds out in a run."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import FixtureBox


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling: nearly all that there is to tell is of every outcome.

    Attributes
    ----------
    low_ways_saved_s
        How much longer the same order would take with all ways over the highest place, s; None where all is flat.
    thickness
        Of the plate, mm; None where it is not given.
    surface
        The part that the holes are in, where that is given; None: a plate.
    fixtures
        What stands on it and holds it.
    """

    low_ways_saved_s: float | None = None
    thickness: float | None = None
    surface: Mesh | None = field(default=None, compare=False, repr=False)
    fixtures: tuple[FixtureBox, ...] = ()
