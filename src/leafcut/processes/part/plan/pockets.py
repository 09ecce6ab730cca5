"""Pockets of a part. The pocketing process plans a path for each region, and the mill follows it level by level."""

from __future__ import annotations

import math
from dataclasses import dataclass

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.model.machine import Machine
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.part.model import PocketArea
from leafcut.processes.part.plan.task import Mill, PartHeights
from leafcut.processes.pocket.plan.toolpath import Clearing, ClearingMotion, PocketHeights


@dataclass(frozen=True, eq=False)
class PocketTask:
    """A region of a pocket, and the path that clears it.

    `later` contains the edges inside, across or around the pocket. They must be milled after the pocket.
    """

    pocket: PocketArea
    clearing: Clearing
    machine: Machine
    later: tuple[int, ...]

    @property
    def choices(self) -> list[tuple[Point, Point]]:
        """Entry and exit point. A pocket has only this choice."""
        return [(self.clearing.start, self.clearing.end)]

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Clear the region. Raises PlanError if the mill cannot ramp into the region."""
        planes = PocketHeights(
            heights.clearance, heights.retract, heights.clearance == heights.retract, zones=heights.zones
        )
        motion = ClearingMotion(builder, planes, mill.data, self.machine, down=True)
        motion.clear_region(self.clearing)
        if any(descent.kind == "plunge" for descent in motion.descents):
            raise PlanError(
                "{}: there is no room for a ramp of {:.3g} degrees; give a larger --entry-angle, a smaller "
                "--step-down, or a smaller mill",
                self.pocket.name,
                math.degrees(mill.data.entry_angle),
            )
