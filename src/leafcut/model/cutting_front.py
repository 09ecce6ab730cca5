"""`CuttingData`: Pareto-optimal speeds and feeds (time, cost, tool life), and the choice among them."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.kinds import CuttingWork, ToolMaterial
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.work_material import WorkMaterial

#: Objectives for choosing a point of the front.
OBJECTIVES = ("time", "cost", "life")


@dataclass(frozen=True)
class CuttingPoint:
    """A speed and a feed of a tool, with the resulting cost, time, tool life and load.

    Units are mm, mm/s, 1/min, s, N, N·mm and W; the cost is in the user's currency.

    Attributes
    ----------
    chip
        Feed per revolution (drills) or per tooth (mills), mm.
    speed
        Cutting speed at the largest diameter, mm/s.
    time, cost
        Time and cost of the tool per part: feed moves, other moves, and replacement of worn tools.
    life
        Tool life in the cut, s, at most the assumed maximum.
    worn
        Number of tools worn per part.
    power, torque, thrust
        Load of the cut: power at the spindle motor, spindle torque, and feed force (0 for a mill).
    """

    rpm: float
    feed: float
    chip: float
    speed: float
    time: float
    cost: float
    life: float
    worn: float
    power: float
    torque: float
    thrust: float


@dataclass(frozen=True)
class ToolFront:
    """Pareto-optimal speeds and feeds of a tool.

    Attributes
    ----------
    holes
        Holes per part; 0 for a mill.
    points
        Pareto front in order of time: no other speed and feed of the grid is at least as good in time, cost and life,
        and better in one of them.
    candidates, allowed
        Number of evaluated speeds and feeds, and number within all limits.
    given
        Point for the speed and feed of the tool library, or of the options for an assumed drill; None if neither states
        them.
    """

    tool: Tool
    tool_material: ToolMaterial
    work: CuttingWork
    holes: int
    points: tuple[CuttingPoint, ...]
    chosen: int
    candidates: int
    allowed: int
    given: CuttingPoint | None
    sources: tuple[str, ...]

    @property
    def best(self) -> CuttingPoint:
        """The chosen point."""
        return self.points[self.chosen]


@dataclass(frozen=True)
class CuttingData:
    """Speeds and feeds of the tools of a part.

    The objective is time, cost or life; the shop rate is in currency per hour. `source` is empty without a drawing.
    `defaults` are the options whose values come from the user's own defaults.
    """

    source: str
    machine: Machine
    material: WorkMaterial
    objective: str
    shop_rate: float
    tools: tuple[ToolFront, ...]
    issues: tuple[Issue, ...] = ()
    defaults: tuple[str, ...] = ()

    @property
    def time(self) -> float:
        """Time of all tools per part, s, without tool changes."""
        return sum(tool.best.time for tool in self.tools)

    @property
    def cost(self) -> float:
        """Cost of all tools per part."""
        return sum(tool.best.cost for tool in self.tools)
