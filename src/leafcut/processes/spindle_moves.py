"""Moves that all spindle programs share: retract, change the tool, switch the spindle, and end the program."""

from __future__ import annotations

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.message import Message
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.toolpath import FIRST_OFFSET, ToolpathBuilder
from leafcut.options import JobOptions


def check_spindle_heights(machine: Machine, job: JobOptions, work: str) -> None:
    """Raise PlanError if the machine has no spindle, or if its heights are in the wrong order.

    `work` is a verb that completes the message "which cannot …", such as "drill".
    """
    if machine.head is not Head.SPINDLE:
        raise PlanError("{} has a {}, which cannot {}; choose another --machine", machine.name, machine.head, work)
    if job.retract_height > job.clearance_height:
        raise PlanError(
            "--retract-height {:g} mm is above --clearance-height {:g} mm; "
            "the R plane must not be higher than the initial plane",
            job.retract_height,
            job.clearance_height,
        )
    if machine.safe_z is not None and machine.work_offset is not None:
        height = machine.safe_z - machine.work_offset[2]
        if height < job.clearance_height:
            raise PlanError(
                "the safe height of {}, z {:g} mm in machine coordinates, is {:g} mm "
                "over program zero, below --clearance-height {:g} mm; check --work-offset, or "
                "lower the clearance height",
                machine.name,
                machine.safe_z,
                height,
                job.clearance_height,
            )


def check_speeds(tool: Tool, machine: Machine, spindle_speed: float | None = None) -> None:
    """Raise PlanError if the speed or the feed of a drilling tool is missing or outside the machine's range.

    `spindle_speed` is the speed that the user gave for assumed tools, rpm.
    """
    if not (tool.spindle_rpm > 0 and tool.feed > 0):
        missing = Message("feed") if tool.spindle_rpm > 0 else Message("spindle_speed")
        raise PlanError("{} has no {}; give it in the tool library", tool.label, missing)
    if not machine.spindle_min_rpm <= tool.spindle_rpm <= machine.spindle_max_rpm:
        limits = Message(
            "the spindle of {} turns {:g} to {:g} rpm",
            machine.name,
            machine.spindle_min_rpm,
            machine.spindle_max_rpm,
        )
        if tool.assumed and tool.spindle_rpm == spindle_speed:
            raise PlanError("--spindle-speed {:g}: {}; choose a speed in this range", tool.spindle_rpm, limits)
        demand = Message("{} requires {:g} rpm, but {}", tool.label, tool.spindle_rpm, limits)
        if tool.spindle_rpm < machine.spindle_min_rpm:
            raise PlanError("{}: mill the hole, or change the speed in the tool library", demand)
        raise PlanError("{}: change the speed in the tool library, or use a faster spindle", demand)
    if tool.feed > machine.max_feed * (1 + 1e-9):
        raise PlanError(
            "{} requires {:g} mm/min, but {} feeds at most {:g} mm/min",
            tool.label,
            tool.feed * 60,
            machine.name,
            machine.max_feed * 60,
        )


def take_tool(
    builder: ToolpathBuilder,
    machine: Machine,
    tool: Tool,
    clearance: float,
    *,
    coolant: bool,
    pause: bool = False,
    work_offset: int = FIRST_OFFSET,
) -> None:
    """Change to a tool, select a work offset, and start the spindle and the coolant.

    Parameters
    ----------
    clearance
        Height after the change if the machine has no safe height, mm.
    pause
        Whether to add M0, for a controller whose M6 does not wait.
    """
    builder.tool(tool.number)
    if pause:
        builder.pause()
    # The work offset follows the tool change, because operators restart programs at a tool change.
    builder.work_offset(work_offset)
    if machine.safe_z is None:
        # This move comes after the change, because the length offset of the previous tool applies before it.
        builder.rapid(z=clearance)
    builder.spindle(tool.spindle_rpm)
    if machine.spindle_start_s > 0:
        builder.dwell(machine.spindle_start_s)
    if coolant:
        builder.coolant(2)


def retract(builder: ToolpathBuilder, machine: Machine, clearance: float) -> None:
    """Retract to the safe height of the machine.

    If the machine has no safe height, retract to the `clearance` height, mm.
    """
    if machine.safe_z is not None:
        builder.machine(z=machine.safe_z)
    elif builder.position[2] != clearance:
        builder.rapid(z=clearance)


def stop_spindle(builder: ToolpathBuilder, coolant: bool) -> None:
    """Stop the spindle and the coolant."""
    builder.spindle(0.0)
    if coolant:
        builder.coolant(0)


def move_to_tool_change(builder: ToolpathBuilder, machine: Machine, height: float, *, coolant: bool) -> None:
    """Retract, move to the position for tool changes, and stop the spindle.

    The tool retracts to the safe height. If there is no safe height, it retracts to `height`, mm.
    """
    retract(builder, machine, height)
    if machine.tool_change_position is not None:
        builder.machine(*machine.tool_change_position)
    stop_spindle(builder, coolant)
    if machine.optional_stop:
        builder.pause(optional=True)


def end_program(
    builder: ToolpathBuilder, machine: Machine, clearance: float, end: Point | None, *, coolant: bool
) -> None:
    """Move to the end point, if the user gave one. Then retract, stop the spindle, and end the program."""
    if end is not None:
        builder.rapid(*end)
    retract(builder, machine, clearance)
    stop_spindle(builder, coolant)
    builder.end()
