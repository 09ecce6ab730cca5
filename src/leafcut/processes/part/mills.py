"""Extra mills that layers name, such as a V-bit for chamfers. They run before the end mill of the part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from leafcut.errors import PlanError
from leafcut.model.issue import Issue
from leafcut.model.tool import CONES, ToolLibrary
from leafcut.options import MillingOptions
from leafcut.processes.job import Job
from leafcut.processes.milling.mill import milling_data
from leafcut.processes.part.operations import LayeredPart
from leafcut.processes.part.plan.task import Mill
from leafcut.read.operations import LayerRule, check_tool, library_tool, rules_with_tools


def other_mills(
    divided: LayeredPart, job: Job, main: Mill, library: ToolLibrary | None
) -> tuple[list[Mill], list[Issue]]:
    """Return all mills that layers name, except the `main` mill, with their feeds.

    Returns
    -------
    mills
        The mills with their feeds.
    issues
        Issues about assumed feeds.

    Raises
    ------
    OptionError, PlanError
        The library does not contain a suitable milling tool, or the tool is too short.
    """
    # Feeds on the command line are those of the end mill.
    milling = replace(job.settings.of(MillingOptions), plunge_feed=None)
    asked = replace(job.settings.job, feed=None, spindle_speed=None)
    mills: dict[int, Mill] = {}
    issues: list[Issue] = []
    for rule in (own for face, _ in divided.faces for own in rules_with_tools(face)):
        tool = main.data.tool if rule.tool in (None, main.data.tool.number) else library_tool(rule, library)
        check_tool(rule, tool)
        if tool.number == main.data.tool.number or tool.number in mills:
            continue
        data, more = milling_data(milling, asked, tool.diameter, job.machine, tool)
        mills[tool.number] = Mill(data, asked.step_down or 0.5 * tool.diameter, main.climb)
        issues += more
    rest_rules = [rule for rule, _ in divided.faces if rule.rest is not None]
    flat_rules = [rule for rule, _ in divided.faces if rule.flat is not None]
    for rule in rest_rules:
        _check_rest(rule, {**mills, main.data.tool.number: main}, main)
    for rule in flat_rules:
        _check_flat(rule, {**mills, main.data.tool.number: main}, main)

    def position(mill: Mill) -> tuple[bool, float]:
        """Return a sort key: V-bits after the mills of their floors, and the mill of a rest after the larger mill."""
        tool = mill.data.tool
        return bool(flat_rules) and tool.kind in CONES, -tool.diameter if rest_rules else 0.0

    return sorted(mills.values(), key=position), issues


def _check_flat(rule: LayerRule, mills: Mapping[int, Mill], main: Mill) -> None:
    tool = mills[rule.flat or 0].data.tool
    if tool is main.data.tool:
        raise PlanError(
            "{}: {} is the end mill of the part, which works last; name another mill after 'flat'",
            rule.place,
            tool.label,
        )
    if tool.corner_radius:
        raise PlanError(
            "{}: {} has a corner radius of {:g} mm and would not clear the floor up to the slopes; use a mill with "
            "sharp corners",
            rule.place,
            tool.label,
            tool.corner_radius,
        )


def _check_rest(rule: LayerRule, mills: Mapping[int, Mill], main: Mill) -> None:
    first, rest = mills[rule.tool or 0].data.tool, mills[rule.rest or 0].data.tool
    if first is main.data.tool:
        raise PlanError(
            "{}: {} is the end mill of the part, which works last; name another mill before 'rest'",
            rule.place,
            first.label,
        )
    if rest.diameter >= first.diameter:
        raise PlanError(
            "{}: {} is not smaller than {}; name a smaller mill after 'rest'", rule.place, rest.label, first.label
        )
