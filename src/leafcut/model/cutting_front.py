"""`CuttingData`: Pareto-optimal speeds and feeds (time, cost, tool life), and the chosen point."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.kinds import CuttingWork, ToolMaterial
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.work_material import WorkMaterial

#: Objectives for choosing a point on the front.
OBJECTIVES = ("time", "cost", "life")


@dataclass(frozen=True)
class CuttingPoint:
    """A speed and a feed of a tool, with the resulting cost, time, tool life and load.

    Units are mm, mm/s, 1/min, s, N, N·mm and W. The cost is in the user's currency.

    Attributes
    ----------
    chip
        Feed per revolution (drills) or per tooth (mills), mm.
    speed
        Cutting speed at the largest diameter, mm/s.
    time, cost
        Time and cost of the tool per part: feed moves, other moves, and replacement of worn tools.
    life
        Time that the tool can cut before it is worn, s. An assumed maximum limits this value.
    worn
        Number of tools that wear out per part.
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
        Pareto front in order of time. No other speed and feed in the grid is at least as good in time, cost and life,
        and better in at least one of them.
    candidates, allowed
        Number of speeds and feeds that were evaluated, and number of speeds and feeds within all limits.
    given
        Point for the speed and feed from the tool library, or, for an assumed drill, from the options. None if they
        specify no speed and feed.
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
        """The chosen point of the front."""
        return self.points[self.chosen]


@dataclass(frozen=True)
class CuttingData:
    """Speeds and feeds of the tools for a part.

    The objective is time, cost or life. The shop rate is in currency per hour. `source` is empty if no drawing was
    given. `defaults` lists the options that come from the user's own defaults.
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
