"""`StockCut`: what a program takes off its stock, and what it leaves."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.same_stock import StockDifference
from leafcut.model.cutter import Body
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool


@dataclass(frozen=True)
class ToolCut:
    """What one tool of a program does to the stock.

    Attributes
    ----------
    tool
        The tool, of the library or as the program's comments describe it.
    removed_mm3
        What it takes off.
    cut_s, air_s
        How long it is fed in the material and in the air, s.
    deepest_mm, widest_mm
        Its deepest cut, and the widest one across, seen from above.
    """

    tool: Tool
    removed_mm3: float
    cut_s: float
    air_s: float
    deepest_mm: float
    widest_mm: float


@dataclass(frozen=True)
class RapidCut:
    """A rapid in the material: its line, and how deep it is in it, mm."""

    line: int
    depth_mm: float


@dataclass(frozen=True)
class BodyCut:
    """A move on which the shank or the holder of a tool is in the material: its line, the tool, how deep, mm."""

    line: int
    tool: int
    body: Body
    depth_mm: float


@dataclass(frozen=True, eq=False)
class StockCut:
    """What a program takes off its stock, and what it leaves.

    Attributes
    ----------
    program
        Its name, as it was given.
    machine
        On which it was timed.
    block, derived
        The stock before the first cut, and whether that was made from the cuts.
    field
        What is left.
    tools
        In the order in which they are first used.
    rapids, collisions
        Rapids in the material, by line, and shanks and holders in it, by tool and line.
    same_as, differences
        The other program, None without one, and where that leaves something else, the largest places first: `before`
        is what the other one leaves.
    issues
        What is dangerous in the program, and what was assumed.
    defaults
        Which of the options that were used are of the person's own defaults.
    part
        The file of the part that was the stock before the program's cuts; "" for a block.
    """

    program: str
    machine: Machine
    block: StockBlock
    derived: bool
    field: HeightField
    tools: tuple[ToolCut, ...]
    rapids: tuple[RapidCut, ...]
    collisions: tuple[BodyCut, ...] = ()
    same_as: str | None = None
    differences: tuple[StockDifference, ...] = ()
    issues: tuple[Issue, ...] = ()
    defaults: tuple[str, ...] = ()
    part: str = ""

    @property
    def removed_mm3(self) -> float:
        """What all tools take off."""
        return sum(one.removed_mm3 for one in self.tools)
