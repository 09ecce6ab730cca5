"""The routing problem of lines, and the toolpath of its solution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.options import JobOptions
from leafcut.processes.job import Job, plane_point
from leafcut.processes.spindle_moves import end_program, take_tool
from leafcut_engrave.options import EngraveOptions

#: Depth of lines without --depth, and tolerance of flattened curves, mm.
DEPTH, TOLERANCE = 0.2, 0.005

Lines = Sequence[NDArray[np.float64]]


def problem_of(lines: Lines, metric: Metric, job: JobOptions) -> RoutingProblem:
    """Return the routing problem of lines, float64[k, 2] each.

    A line is a cluster of two nodes: node 2k engraves line k in its drawn direction, node 2k + 1 in reverse.
    """
    ends = np.array([[line[0], line[-1]] for line in lines])
    cluster = np.repeat(np.arange(len(lines), dtype=np.int32), 2)
    return RoutingProblem(
        ends.reshape(-1, 2),
        ends[:, ::-1].reshape(-1, 2),
        cluster,
        np.zeros(len(cluster)),
        metric,
        start=plane_point(job.start_point),
        end=plane_point(job.end_point),
        name="lines",
    )


def tool_of(options: EngraveOptions) -> Tool:
    """Return the engraving tool."""
    return Tool(
        options.engraver, 0.1, ToolKind.END_MILL, feed=options.engraving_feed, spindle_rpm=options.engraving_speed
    )


def depth_of(job: JobOptions) -> float:
    """Return the depth of all lines, mm. Raises OptionError for ``--depth through``."""
    if job.is_through:
        raise OptionError("--depth through: a line is engraved at a depth; give it in mm")
    return job.blind_depth or DEPTH


def generate_toolpath(lines: Lines, nodes: Sequence[int], job: Job) -> Toolpath:
    """Return the motion: for each line, a rapid above its start, a plunge, the cut, and a retract."""
    machine, settings, options = job.machine, job.settings, job.settings.of(EngraveOptions)
    height, depth, coolant = settings.job.clearance_height, depth_of(settings.job), settings.post.coolant
    builder = ToolpathBuilder()
    if machine.safe_z is not None:
        builder.machine(z=machine.safe_z)
    take_tool(builder, machine, tool_of(options), height, coolant=coolant)
    for node in nodes:
        line = lines[node // 2][:: -1 if node % 2 else 1]
        builder.rapid(*line[0].tolist())
        builder.rapid(z=height)
        builder.feed(z=-depth, feed=options.engraving_feed)
        for x, y in line[1:].tolist():
            builder.feed(x, y, feed=options.engraving_feed)
        builder.rapid(z=height)
    end_program(builder, machine, height, plane_point(settings.job.end_point), coolant=coolant)
    return builder.build()
