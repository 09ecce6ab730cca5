"""The work of each tool for a drawing: number of holes, distance at feed, and time of all other moves."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import PlanError
from leafcut.model.heartbeat import OnProgress
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.options import Settings
from leafcut.order.stop import Deadline
from leafcut.processes import registry
from leafcut.processes.course import run_process
from leafcut.processes.job import Job
from leafcut.read.registry import read_source

if TYPE_CHECKING:
    from leafcut.read import Input


def work_of_drawing(
    drawing: Input, settings: Settings, machine: Machine, issues: list[Issue], progress: OnProgress | None
) -> list[tuple[Tool, int, float, float, float]]:
    """Return the work of each tool that drills a drawing, in order.

    Each entry contains the tool, the number of its holes, its distance at feed, mm, its distance in the material, mm,
    and the time of its other moves, s. The drawing is planned and ordered as by `leafcut drill`. Only the distance in
    the material wears a tool; the feed from the R plane to the surface does not.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError
        The drawing cannot be drilled.
    """
    from leafcut.timing.toolpath import time_rows

    format_, source = read_source(drawing)
    process = registry.process("drill")
    if "drill" not in format_.processes:
        raise PlanError(f"{drawing}: is a {format_.name}; speeds and feeds are chosen for a drawing with holes")
    # The material determines the speeds; in drilling, the option only selects presets of a Fusion library.
    asked = settings.asked - {"material"}
    limits = Deadline.of(settings.solve), Deadline.of_bounds(settings.solve)
    # The planned speeds do not matter, so the spindle may turn slower than it can.
    slow = replace(machine, spindle_min_rpm=0.0)
    job = Job(replace(settings, asked=asked), slow, limits[0], progress, bounds=limits[1])
    outcome = run_process(process, job, [source], "drill")
    issues += [issue for issue in outcome.issues if issue.severity is not Severity.NOTE]
    times = time_rows(outcome.path_after, machine)
    path = times.path
    tool_numbers = path.latest(Kind.TOOL, path.ref)
    at_feed = path.kind == Kind.FEED
    length = np.zeros(len(path))
    length[1:] = np.abs(np.diff(path.end[:, 2]))
    holes: dict[int, int] = {}
    tools: dict[int, Tool] = {}
    for operation in outcome.operations:
        tools[operation.tool.number] = operation.tool
        drilled = 0 if operation.slots else len(operation.holes)
        holes[operation.tool.number] = holes.get(operation.tool.number, 0) + drilled
    works = []
    for number, tool in tools.items():
        if tool.kind is not ToolKind.DRILL or not holes[number]:
            works.append((tool, 0, 0.0, 0.0, 0.0))
            continue
        of_tool = tool_numbers == number
        feed_length = float(length[of_tool & at_feed].sum())
        # The times of the tool change and the spindle start belong to the part, but do not depend on the speed.
        idle = float(times.seconds[of_tool].sum()) - feed_length / tool.feed
        works.append(
            (
                tool,
                holes[number],
                feed_length,
                feed_length - holes[number] * settings.job.retract_height,
                max(idle, 0.0),
            )
        )
    return works
