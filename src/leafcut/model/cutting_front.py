"""`CuttingData`: speeds and feeds than which no others are better in time, cost and tool life, and the chosen ones."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.kinds import CuttingWork, ToolMaterial
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.work_material import WorkMaterial

#: What a point of the front can be chosen for.
OBJECTIVES = ("time", "cost", "life")


@dataclass(frozen=True)
class CuttingPoint:
    """A speed and a feed of a tool, and what comes of them: mm, s, N, N·mm, W; cost in the user's currency.

    Attributes
    ----------
    rpm, feed
        Spindle speed, 1/min; feed rate, mm/s.
    chip
        Feed of a drill per revolution, of a mill per tooth, mm.
    speed
        Cutting speed at the largest diameter, mm/s.
    time, cost
        Of one part by this tool: fed, moved and replaced when worn.
    life
        Of the tool, in the cut, s; no longer than it is counted on.
    worn
        Tools that are worn by one part.
    power, torque, thrust
        What the cut asks for: at the spindle's motor, of the spindle, and of the feed (0 for a mill).
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
    """The best speeds and feeds of one tool.

    Attributes
    ----------
    tool, tool_material, work
    holes
        In one part; 0 for a mill.
    points
        The Pareto front by time, the quickest first: no other speed and feed of the grid is as good in time, cost and
        life, and better in one of them.
    chosen
        Number of the chosen point.
    candidates, allowed
        How many speeds and feeds were tried, and how many of them are within all limits.
    given
        What comes of the speed and feed in the tool library, or of those that were given for an assumed drill; None
        where there are none.
    sources
        Where the tool life's constants are from.
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
    """Speeds and feeds of the tools of one part.

    Attributes
    ----------
    source
        The drawing; empty without one.
    objective
        What was chosen for: time, cost or life.
    shop_rate
        Currency per hour.
    tools
        Those whose speed and feed were chosen.
    issues
        Tools that were left out, and what else was assumed.
    defaults
        Which of the options that were used are of the person's own defaults.
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
        """Of one part by all these tools, s, without changes from one to the other."""
        return sum(one.best.time for one in self.tools)

    @property
    def cost(self) -> float:
        """Of one part by all these tools, in the user's currency."""
        return sum(one.best.cost for one in self.tools)
