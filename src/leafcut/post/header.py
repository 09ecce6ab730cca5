"""Header comments of a program: its source, the options to regenerate it, and the set-up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from leafcut.files.digests import DIGEST_LINE, first_line
from leafcut.model.machine import Machine
from leafcut.model.part import ProgramZero
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath
from leafcut.units import MM_PER_INCH, format_time


def header_lines(
    *,
    source: str,
    command: str,
    version: str,
    machine: Machine,
    tools: Iterable[Tool],
    path: Toolpath,
    seconds: tuple[float, float],
    seed: int,
    options: Mapping[str, str],
    units: str,
    beside: str = "in the drawing's order",
    zero: ProgramZero | None = None,
    part: str = "",
    negative: str = "",
) -> list[str]:
    """Return the lines of the header.

    `command` is the leafcut command that writes such a program. `seconds` are the machine times before and after the
    optimisation, and `beside` describes the order before. `part` is the solid or surface for which the program is
    written, and its placing. `negative` names the axes on which the part reaches the negative side of the zero. The
    header has no date or other changing data, so the same seed gives the same file.
    """
    lines = [first_line(version, command), f"source: {source}"]
    if part:
        lines.append(f"part: {part}")
    lines.append(f"machine: {machine.name}")
    lines.append(
        " ".join([f"seed {seed}", *(f"{flag} {value}" for flag, value in options.items() if flag != "--seed")])
    )
    lines.extend(_tool_line(tool, units) for tool in tools)
    scale, unit = (MM_PER_INCH, "in") if units == "inch" else (1.0, "mm")
    if zero is not None:
        lines.extend(f"{name}: {fact}" for name, fact in zero.facts(scale))
    if negative:
        lines.append(f"the part reaches the negative side of the zero in {negative}")
    low, high = path.extents
    for axis, minimum, maximum in zip("XYZ", low, high, strict=True):
        lines.append(f"{axis} {_short(minimum / scale)} to {_short(maximum / scale)} {unit}")
    before, after = seconds
    lines.append(f"estimated time {format_time(after)}, {beside} {format_time(before)}")
    lines.append(DIGEST_LINE)
    return lines


def _short(length: float) -> str:
    return f"{round(length, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


def _tool_line(tool: Tool, units: str) -> str:
    size = f"{tool.diameter / MM_PER_INCH:.4f} in" if units == "inch" else f"{tool.diameter:g} mm"
    kind = tool.kind.value
    named = tool.name.lower().replace("-", " ").startswith(kind.replace("-", " "))
    parts = tool.name if named else f"{kind} {tool.name}".rstrip()
    assumed = " (assumed)" if tool.assumed else ""
    return f"T{tool.number} {parts} {size}, {tool.spindle_rpm:.0f} rpm{assumed}"
