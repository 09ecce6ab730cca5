"""`StockCut`: the material that a program removes, and the stock that is left."""

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
    """The effect of one tool on the stock.

    The data of `tool` come from the tool library or from the comments in the program. `cut_s` is the time at feed in
    material, and `air_s` is the time at feed in the air, s. `deepest_mm` and `widest_mm` are the maximum depth and
    width of cut.
    """

    tool: Tool
    removed_mm3: float
    cut_s: float
    air_s: float
    deepest_mm: float
    widest_mm: float


@dataclass(frozen=True)
class RapidCut:
    """A rapid in material, with its line in the program and its depth in the material, mm."""

    line: int
    depth_mm: float


@dataclass(frozen=True)
class BodyCut:
    """A move that takes the shank or the holder (`body`) of a tool into material.

    `line` is the line of the program, `tool` is the tool number, and `depth_mm` is the depth in the material, mm.
    """

    line: int
    tool: int
    body: Body
    depth_mm: float


@dataclass(frozen=True, eq=False)
class StockCut:
    """The material that a program removes, and the stock that is left.

    Attributes
    ----------
    block, derived
        The stock before the first cut, and whether it was derived from the cuts.
    tools
        The tools in the order of their first use.
    rapids, collisions
        Rapids in material, by line. Moves with a shank or holder in material, by line and tool.
    same_as, differences
        The program for comparison, or None, and the differences in the stock, sorted by descending number of cells.
        `before` is the height that the program for comparison leaves.
    part
        File of the part that served as stock, or "" for a block.
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
        """Volume removed by all tools, mm³."""
        return sum(cut.removed_mm3 for cut in self.tools)
