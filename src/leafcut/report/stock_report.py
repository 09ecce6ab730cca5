"""Report of the material that a program removes: for the terminal, as JSON, and as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from leafcut.errors import OptionError
from leafcut.report.json_answer import issues_as_json
from leafcut.report.wording import NO_VALUE, count
from leafcut.units import fixed, format_time

if TYPE_CHECKING:
    from rich.console import Console

    from leafcut.material.stock_cut import StockCut

#: File formats of the remaining stock.
_FILES = (".png", ".stl")
_MM3_PER_CM3 = 1000.0
_BYTES_PER_MB = 1e6
#: Maximum number of differing places listed.
_MOST_PLACES = 10


def check_name(output: str | None) -> None:
    """Refuse a file that is neither a picture nor a solid.

    Raises
    ------
    OptionError
        The extension is unknown.
    """
    if output is not None and Path(output).suffix.lower() not in _FILES:
        raise OptionError(f"--output: '{Path(output).name}' is neither a picture (.png) nor a solid (.stl)")


def as_file(found: StockCut, output: str) -> bytes:
    """Return the remaining stock in the format of the file's extension."""
    if output.lower().endswith(".png"):
        from leafcut.report.stock_picture import stock_png

        return stock_png(found.field, found.block.high[2])
    from leafcut.report.stock_mesh import stock_stl

    return stock_stl(found.field)[0]


def stock_as_json(found: StockCut, output: str | None = None) -> dict[str, Any]:
    """Return the answer of `leafcut stock --json`: lengths in mm, times in s."""
    return {
        "program": found.program,
        "machine": found.machine.name,
        "stock": {
            "low": list(found.block.low),
            "high": list(found.block.high),
            "derived": found.derived,
            **({"part": found.part} if found.part else {}),
            "cell": found.field.cell,
            "cells": found.field.heights.size,
            "bytes": found.field.heights.nbytes,
        },
        "removed_mm3": found.removed_mm3,
        "left_mm3": found.field.volume,
        "tools": [
            {
                "number": one.tool.number,
                "kind": one.tool.kind.value,
                "diameter": one.tool.diameter,
                "removed_mm3": one.removed_mm3,
                "cut_s": one.cut_s,
                "air_s": one.air_s,
                "deepest_mm": one.deepest_mm,
                "widest_mm": one.widest_mm,
            }
            for one in found.tools
        ],
        "rapids": [{"line": one.line, "depth_mm": one.depth_mm} for one in found.rapids],
        "collisions": [
            {"line": one.line, "tool": one.tool, "part": one.body.value, "depth_mm": one.depth_mm}
            for one in found.collisions
        ],
        **({"same_as": found.same_as, "same": not found.differences} if found.same_as else {}),
        "differences": [one._asdict() for one in found.differences],
        "issues": issues_as_json(found.issues),
        **({"output": output} if output else {}),
        **({"defaults": list(found.defaults)} if found.defaults else {}),
    }


def print_stock(found: StockCut, output: str | None, console: Console) -> None:
    """Print the material removed by each tool, its time in the air, and dangers."""
    from rich.table import Table

    for issue in found.issues:
        if issue.severity == "danger":
            console.print(f"danger: {issue}", style="bold red", markup=False, highlight=False, soft_wrap=True)
    sides = " × ".join(f"{b - a:.1f}" for a, b in zip(found.block.low, found.block.high, strict=True))
    whence = "a block around the cuts" if found.derived else found.part or "a block"
    console.print(
        f"{found.program}: {found.removed_mm3 / _MM3_PER_CM3:.2f} cm³ off {whence} of {sides} mm, in cells of "
        f"{found.field.cell:g} mm ({found.field.heights.size:,} of them, "
        f"{max(found.field.heights.nbytes / _BYTES_PER_MB, 0.1):.1f} MB)",
        markup=False, highlight=False, soft_wrap=True,
    )  # fmt: skip
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("tool")
    for name in ("removed", "in the stock", "in the air", "deepest", "widest"):
        table.add_column(name, justify="right")
    for one in found.tools:
        table.add_row(
            one.tool.label,
            f"{one.removed_mm3 / _MM3_PER_CM3:.2f} cm³",
            format_time(one.cut_s),
            format_time(one.air_s),
            f"{one.deepest_mm:.2f} mm",
            f"{one.widest_mm:.2f} mm" if one.widest_mm else NO_VALUE,
        )
    console.print(table)
    for issue in found.issues:
        if issue.severity != "danger":
            console.print(f"{issue.severity}: {issue}", markup=False, highlight=False, soft_wrap=True)
    for line in _compared(found):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    if output:
        console.print(f"wrote {output}", markup=False, highlight=False, soft_wrap=True)


def _compared(found: StockCut) -> list[str]:
    if found.same_as is None:
        return []
    if not found.differences:
        return [f"{found.same_as} leaves the same, in {found.field.heights.size:,} cells"]
    lines = [
        f"at X{fixed(one.x, 2)} Y{fixed(one.y, 2)}: Z{fixed(one.before, 3)} there, Z{fixed(one.after, 3)} here "
        f"({count(one.cells, 'cell')})"
        for one in found.differences[:_MOST_PLACES]
    ]
    more = len(found.differences) - _MOST_PLACES
    return [
        f"{found.same_as} does not leave the same:",
        *lines,
        *([f"and {count(more, 'more place')}"] if more > 0 else []),
    ]
