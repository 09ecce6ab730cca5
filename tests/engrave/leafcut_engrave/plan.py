"""From lines to a routing problem, and from its solution to a toolpath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.options import JobOptions
from leafcut.processes.job import Job
from leafcut.processes.spindle_moves import rise, stop_spindle, take_tool
from leafcut_engrave.options import EngraveOptions

#: Depth of lines without --depth, and tolerance of flattened curves, mm.
DEPTH, TOLERANCE = 0.2, 0.005

Lines = Sequence[NDArray[np.float64]]


def problem_of(lines: Lines, metric: Metric, job: JobOptions) -> RoutingProblem:
    """Return a cluster of two nodes for every line, float64[k, 2]: node 2k engraves line k as drawn, 2k + 1 back."""
    ends = np.array([[line[0], line[-1]] for line in lines])
    entry = ends.reshape(-1, 2)
    leave = ends[:, ::-1].reshape(-1, 2)
    cluster = np.repeat(np.arange(len(lines), dtype=np.int32), 2)
    start, end = (None if point is None else (point[0], point[1]) for point in (job.start_point, job.end_point))
    return RoutingProblem(entry, leave, cluster, np.zeros(len(entry)), metric, start=start, end=end, name="lines")


def tool_of(options: EngraveOptions) -> Tool:
    """Return the engraving tool."""
    return Tool(
        options.engraver, 0.1, ToolKind.END_MILL, feed=options.engraving_feed, spindle_rpm=options.engraving_speed
    )


def lay(lines: Lines, nodes: Sequence[int], job: Job) -> Toolpath:
    """Return the motion: over to a line, down, along it, and up again."""
    machine, settings, options = job.machine, job.settings, job.settings.of(EngraveOptions)
    height, depth, coolant = settings.job.clearance_height, settings.job.depth or DEPTH, settings.post.coolant
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
    if settings.job.end_point is not None:
        builder.rapid(*settings.job.end_point)
    rise(builder, machine, height)
    stop_spindle(builder, coolant)
    builder.end()
    return builder.build()
