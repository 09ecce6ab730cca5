"""Facts for the operator who sets up the machine: tools, heights, range of motion, and work offset."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Part
from leafcut.model.toolpath import MOTIONS, Toolpath
from leafcut.report.wording import panel_number, replace_unprintable, time_words, to_mm_per_min
from leafcut.units import LARGE_UNITS, MM_PER_INCH

#: Maximum number of tools in the summary. The header of the program lists all tools.
MAX_TOOLS = 8


def coordinate_words(mm: float, scale: float = 1.0) -> str:
    """Format a coordinate with up to three decimals. `scale` is the number of mm per unit."""
    return f"{round(mm / scale, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


def axis_ranges(path: Toolpath) -> list[tuple[str, float, float]]:
    """Return the axes that the program moves, with their names and their lowest and highest positions, mm."""
    moving = np.isin(path.kind, [int(kind) for kind in MOTIONS])
    known = [bool(np.isfinite(path.end[moving, axis]).any()) for axis in range(3)]
    low, high = path.extents
    return [(name, low[k], high[k]) for k, name in enumerate("XYZ") if known[k]]


def range_facts(outcome: Outcome) -> list[Fact]:
    """Return the range of motion of the written program, and its work offset."""
    path = outcome.written or outcome.path_after
    scale, unit = (MM_PER_INCH, "in") if outcome.options.get("--output-units") == "inch" else (1.0, "mm")
    axes = [
        f"{name} {coordinate_words(low, scale)} to {coordinate_words(high, scale)}"
        for name, low, high in axis_ranges(path)
    ]
    facts = [Fact(sentence=f"{', '.join(axes)} {unit}", name=Message("Range"))] if axes else []
    offset = outcome.work_offset
    return [*facts, *([Fact(sentence=offset, name=Message("Work offset"))] if offset else [])]


def drawing_facts(part: Part) -> list[Fact]:
    """Return the size of a drawing whose unit is not mm, and this unit, so that a wrong unit is noticed."""
    unit = LARGE_UNITS.get(part.units, part.units)
    corners = np.array([part.extents, *(contour.path.extents for contour in part.edge)])
    size = corners[:, 2:].max(axis=0) - corners[:, :2].min(axis=0)
    if part.units == "mm" or not size.any():
        return []
    width, height = map(coordinate_words, size.tolist())
    return [Fact(sentence=Message("{} × {} mm, read in {}", width, height, unit), name=Message("Drawing"))]


def time_facts(outcome: Outcome) -> list[Fact]:
    """Return the time of the written program as text. The number itself is in the table of orders."""
    return [Fact(sentence=time_words(outcome.after.time_s), name=Message("Time"))]


def tool_facts(operations: Sequence[OperationOutcome]) -> list[Fact]:
    """Return facts about each tool in the order of use: its number, kind, size, speed, feed and cycle."""
    rows = list(dict.fromkeys(_tool_line(operation) for operation in operations))
    more = [f"and {len(rows) - MAX_TOOLS} more in the header of the program"] if len(rows) > MAX_TOOLS else []
    words = "; ".join([*rows[:MAX_TOOLS], *more])
    return [Fact(sentence=words, name=Message("Tools" if len(rows) > 1 else "Tool"))] if rows else []


def _tool_line(operation: OperationOutcome) -> str:
    tool = operation.tool
    parts: Iterable[str] = (
        replace_unprintable(tool.label),
        f"{panel_number(tool.spindle_rpm)} rpm",
        f"{panel_number(to_mm_per_min(tool.feed))} mm/min",
        operation.cycle if operation.cycle.startswith("G") else "",
    )
    return ", ".join(filter(None, parts))


def height_facts(clearance: float, retract: str) -> list[Fact]:
    """Return the heights of rapids: the clearance height, mm, and the retract height, which is already text."""
    words = Message("clearance Z{}, retract {}", coordinate_words(clearance), retract)
    return [Fact(sentence=words, name=Message("Heights"))]
