"""`ShownStock`: what a person may be shown of the stock that a run works on, or why there is nothing to show."""

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
    """The stock of a run and the tools that cut it, as far as they are known.

    Attributes
    ----------
    tools
        The tools that cut, by number.
    block
        Lower and upper corner of the block, mm; None: a block just around the cuts.
    around
        Smallest x and y, largest x and y that such a block reaches to at least, mm.
    floor
        Where such a block ends below, mm; None: under the deepest cut.
    surface
        The material itself, seen from above, where it is not a block; None: it is one.
    finished
        Whether this is the finished part, in which holes may be open already: they are filled up to their rim first.
    fixtures
        What holds the material, and is not cut.
    refused
        Why the stock cannot be shown, in a line; empty where it can.
    """

    tools: Mapping[int, Tool] = field(default_factory=dict)
    block: tuple[Corner, Corner] | None = None
    around: tuple[float, float, float, float] | None = None
    floor: float | None = None
    surface: Mesh | None = None
    finished: bool = False
    fixtures: tuple[FixtureBox, ...] = ()
    refused: str = ""


#: What a beam cuts.
CUT_THROUGH = ShownStock(refused="a beam cuts the sheet through: it has no heights to show")
