"""`ShownStock`: stock of a run for display, or the reason for none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from leafcut.model.mesh import Mesh
from leafcut.model.tool import Tool

Corner = tuple[float, float, float]
#: Lower corner, upper corner, mm.
FixtureBox = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class ShownStock:
    """Stock of a run and the tools that cut it, as far as known.

    Attributes
    ----------
    block
        Lower and upper corner of the block, mm; None: a block just around the cuts.
    around
        Smallest x and y, largest x and y that such a block includes at least, mm.
    floor
        Lower end of such a block, mm; None: below the deepest cut.
    finished
        Whether this is the finished part, which may contain holes: these are filled up to their rim first.
    refused
        Why the stock cannot be shown, in one line; empty if it can.
    """

    tools: Mapping[int, Tool] = field(default_factory=dict)
    block: tuple[Corner, Corner] | None = None
    around: tuple[float, float, float, float] | None = None
    floor: float | None = None
    surface: Mesh | None = None
    finished: bool = False
    fixtures: tuple[FixtureBox, ...] = ()
    refused: str = ""


#: Stock of work with a beam.
CUT_THROUGH = ShownStock(refused="a beam cuts the sheet through: it has no heights to show")
