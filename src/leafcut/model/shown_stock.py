"""`ShownStock`: the stock of a job for display, or the reason why leafcut cannot show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from leafcut.message import Message

if TYPE_CHECKING:
    from leafcut.model.mesh import Mesh
    from leafcut.model.tool import Tool

Corner = tuple[float, float, float]
#: Lower corner and upper corner of a box, mm.
FixtureBox = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class ShownStock:
    """The stock of a job and the tools that cut it, if they are known.

    Attributes
    ----------
    block
        Lower and upper corner of the block, mm; None for a block just around the cuts.
    around
        Smallest x and y and largest x and y that a block around the cuts must include, mm.
    floor
        Lower end of a block around the cuts, mm. If it is None, the block ends just below the deepest cut.
    surface
        The stock as a solid, which replaces the block.
    finished
        Whether `surface` is the finished part. Its holes are then filled up to their rims.
    refused
        Reason why the stock cannot be shown, in one line; empty if it can be shown.
    """

    tools: Mapping[int, Tool] = field(default_factory=dict)
    block: tuple[Corner, Corner] | None = None
    around: tuple[float, float, float, float] | None = None
    floor: float | None = None
    surface: Mesh | None = None
    finished: bool = False
    fixtures: tuple[FixtureBox, ...] = ()
    refused: str = ""


#: Stock of a job with a laser or torch.
CUT_THROUGH = ShownStock(refused=Message("a beam cuts through the whole sheet, so the stock has no heights to show"))
