"""Header comments of a program. They state its source, the options to regenerate it, and the set-up."""

from __future__ import annotations

from pathlib import Path

from leafcut._version import __version__
from leafcut.files.digests import DIGEST_LINE, header_line
from leafcut.model.plan import Candidate
from leafcut.model.tool import Tool
from leafcut.processes.placing import negative_axes
from leafcut.processes.plan import Plan
from leafcut.units import MM_PER_INCH, format_time


def header_lines(plan: Plan, given: Candidate, best: Candidate, command: str) -> list[str]:
    """Return the header lines of a program from a drawing. `command` is the command that writes the program.

    The header contains no date or other data that change, so the same seed always gives the same file.
    """
    part, machine, settings = plan.part, plan.job.machine, plan.job.settings
    inches = settings.post.output_units == "inch"
    scale, unit = (MM_PER_INCH, "in") if inches else (1.0, "mm")
    lines = [header_line(__version__, command), f"source: {Path(part.source or part.name).name}"]
    if plan.made_for:
        lines.append(f"part: {plan.made_for}")
    lines.append(f"machine: {machine.name}")
    options = [f"{flag} {value}" for flag, value in settings.changed().items() if flag != "--seed"]
    lines.append(" ".join([f"seed {settings.solve.seed}", *options]))
    lines.extend(_tool_line(tool, inches) for tool in plan.tools)
    if part.zero is not None:
        lines.extend(f"{name}: {fact}" for name, fact in part.zero.facts(scale))
    negative = "" if plan.box is None else negative_axes(plan.box, machine)
    if negative:
        lines.append(f"the part reaches the negative side of the zero in {negative}")
    for axis, minimum, maximum in zip("XYZ", *best.path.extents, strict=True):
        lines.append(f"{axis} {_length_text(minimum / scale)} to {_length_text(maximum / scale)} {unit}")
    before, after = format_time(given.measure.time_s), format_time(best.measure.time_s)
    return [*lines, f"estimated time {after}, {plan.compared_with} {before}", DIGEST_LINE]


def _length_text(length: float) -> str:
    return f"{round(length, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


def _tool_line(tool: Tool, inches: bool) -> str:
    size = f"{tool.diameter / MM_PER_INCH:.4f} in" if inches else f"{tool.diameter:g} mm"
    kind = tool.kind.value
    named = tool.name.lower().replace("-", " ").startswith(kind.replace("-", " "))
    parts = tool.name if named else f"{kind} {tool.name}".rstrip()
    assumed = " (assumed)" if tool.assumed else ""
    return f"T{tool.number} {parts} {size}, {tool.spindle_rpm:.0f} rpm{assumed}"
