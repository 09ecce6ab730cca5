"""Generate the motion of a part program: first the holes of each drill, then the tasks of each mill."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.zones import touches_any_zone, widen_zones
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.toolpath import FIRST_OFFSET, Toolpath, ToolpathBuilder
from leafcut.processes.part.plan.holes import HoleGroup
from leafcut.processes.part.plan.task import Mill, MillTask, PartHeights
from leafcut.processes.spindle_moves import end_program, move_to_tool_change, retract, take_tool


def part_motion(
    drilled: Sequence[HoleGroup],
    milled: Sequence[tuple[Mill, Sequence[tuple[MillTask, int]]]],
    heights: PartHeights,
    machine: Machine,
    *,
    coolant: bool,
    pause: bool,
    work_offsets: Sequence[int] = (FIRST_OFFSET,),
) -> Toolpath:
    """Generate the motion of the whole program: first the holes of each drill, then the tasks of each mill.

    Each task comes with the index of its selected choice. Each tool does its work in all `work_offsets`, in the same
    order, and retracts before it goes to the next work offset.
    """
    builder = ToolpathBuilder()
    if machine.safe_z is not None:
        builder.machine(z=machine.safe_z)
    works: list[HoleGroup | tuple[Mill, Sequence[tuple[MillTask, int]]]] = [*drilled, *milled]
    for number, work in enumerate(works):
        if number:
            move_to_tool_change(builder, machine, heights.clearance, coolant=coolant)
        tool = work.tool if isinstance(work, HoleGroup) else work[0].data.tool
        take_tool(builder, machine, tool, heights.clearance, coolant=coolant, pause=pause, work_offset=work_offsets[0])
        for offset in work_offsets:
            if offset != builder.frame:
                retract(builder, machine, heights.clearance)
                builder.work_offset(offset)
            if isinstance(work, HoleGroup):
                _drill(builder, work, heights, machine)
            else:
                _mill(builder, *work, heights, machine)
    end_program(builder, machine, heights.clearance, heights.end, coolant=coolant)
    return builder.build()


def _mill(
    builder: ToolpathBuilder,
    mill: Mill,
    tasks: Sequence[tuple[MillTask, int]],
    heights: PartHeights,
    machine: Machine,
) -> None:
    ends = np.array([task.choices[choice] for task, choice in tasks], dtype=np.float64)
    high = _crosses_zone(ends[:, 0], ends[:, 1], heights, mill.data.tool, machine)
    for number, ((task, choice), place) in enumerate(zip(tasks, ends[:, 0].tolist(), strict=True)):
        if number:
            builder.rapid(z=heights.clearance if high[number] else heights.retract)
        builder.rapid(*place)
        if builder.position[2] != heights.retract:
            builder.rapid(z=heights.retract)
        task.mill(builder, choice, mill, heights)
    builder.rapid(z=heights.clearance)


def _crosses_zone(
    entries: NDArray[np.float64], exits: NDArray[np.float64], heights: PartHeights, tool: Tool, machine: Machine
) -> list[bool]:
    """Return whether the rapid to each entry crosses a keep-out zone. The first value is always False."""
    zones = widen_zones(heights.zones, 0.5 * tool.diameter)
    crossed = touches_any_zone(exits[:-1], entries[1:], zones, dogleg=machine.rapid_style == "dogleg")
    return [False, *crossed.tolist()]


def _drill(builder: ToolpathBuilder, group: HoleGroup, heights: PartHeights, machine: Machine) -> None:
    high = _crosses_zone(group.places, group.places, heights, group.tool, machine)
    for number, (x, y) in enumerate(group.places.tolist()):
        if not number:
            builder.rapid(x, y)
            if builder.position[2] != heights.clearance:
                builder.rapid(z=heights.clearance)
        elif high[number]:
            builder.rapid(z=heights.clearance)
            builder.rapid(x, y)
        builder.drill(x, y, group.cycle, feed=group.tool.feed)
    builder.rapid(z=heights.clearance)
