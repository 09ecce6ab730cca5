"""Report of the material that a program removes, for the terminal, as JSON, and as a file."""

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
#: Maximum number of listed differences.
_MAX_PLACES = 10


def check_name(output: str | None) -> None:
    """Raise OptionError unless the extension of a file is for a picture or a solid."""
    if output is not None and Path(output).suffix.lower() not in _FILES:
        raise OptionError(f"--output: '{Path(output).name}' is neither a picture (.png) nor a solid (.stl)")


def as_file(stock_cut: StockCut, output: str) -> bytes:
    """Return the remaining stock in the format of the file extension."""
    if output.lower().endswith(".png"):
        from leafcut.report.stock_picture import stock_png

        return stock_png(stock_cut.field, stock_cut.block.high[2])
    from leafcut.report.stock_mesh import stock_stl

    return stock_stl(stock_cut.field)[0]


def stock_as_json(stock_cut: StockCut, output: str | None = None) -> dict[str, Any]:
    """Return the answer of `leafcut stock --json`: lengths in mm, times in s."""
    return {
        "program": stock_cut.program,
        "machine": stock_cut.machine.name,
        "stock": {
            "low": list(stock_cut.block.low),
            "high": list(stock_cut.block.high),
            "derived": stock_cut.derived,
            **({"part": stock_cut.part} if stock_cut.part else {}),
            "cell": stock_cut.field.cell,
            "cells": stock_cut.field.heights.size,
            "bytes": stock_cut.field.heights.nbytes,
        },
        "removed_mm3": stock_cut.removed_mm3,
        "left_mm3": stock_cut.field.volume,
        "tools": [
            {
                "number": item.tool.number,
                "kind": item.tool.kind.value,
                "diameter": item.tool.diameter,
                "removed_mm3": item.removed_mm3,
                "cut_s": item.cut_s,
                "air_s": item.air_s,
                "deepest_mm": item.deepest_mm,
                "widest_mm": item.widest_mm,
            }
            for item in stock_cut.tools
        ],
        "rapids": [{"line": item.line, "depth_mm": item.depth_mm} for item in stock_cut.rapids],
        "collisions": [
            {"line": item.line, "tool": item.tool, "part": item.body.value, "depth_mm": item.depth_mm}
            for item in stock_cut.collisions
        ],
        **({"same_as": stock_cut.same_as, "same": not stock_cut.differences} if stock_cut.same_as else {}),
        "differences": [item._asdict() for item in stock_cut.differences],
        "issues": issues_as_json(stock_cut.issues),
        **({"output": output} if output else {}),
        **({"defaults": list(stock_cut.defaults)} if stock_cut.defaults else {}),
    }


def print_stock(stock_cut: StockCut, output: str | None, console: Console) -> None:
    """Print dangers, the material that each tool removes, and its times in the material and in air."""
    from rich.table import Table

    for issue in stock_cut.issues:
        if issue.severity == "danger":
            console.print(f"danger: {issue}", style="bold red", markup=False, highlight=False, soft_wrap=True)
    sides = " × ".join(f"{b - a:.1f}" for a, b in zip(stock_cut.block.low, stock_cut.block.high, strict=True))
    origin = "a block around the cuts" if stock_cut.derived else stock_cut.part or "a block"
    console.print(
        f"{stock_cut.program}: {stock_cut.removed_mm3 / _MM3_PER_CM3:.2f} cm³ off {origin} of {sides} mm, in cells of "
        f"{stock_cut.field.cell:g} mm ({stock_cut.field.heights.size:,} of them, "
        f"{max(stock_cut.field.heights.nbytes / _BYTES_PER_MB, 0.1):.1f} MB)",
        markup=False, highlight=False, soft_wrap=True,
    )  # fmt: skip
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("tool")
    for name in ("removed", "in the stock", "in the air", "deepest", "widest"):
        table.add_column(name, justify="right")
    for tool in stock_cut.tools:
        table.add_row(
            tool.tool.label,
            f"{tool.removed_mm3 / _MM3_PER_CM3:.2f} cm³",
            format_time(tool.cut_s),
            format_time(tool.air_s),
            f"{tool.deepest_mm:.2f} mm",
            f"{tool.widest_mm:.2f} mm" if tool.widest_mm else NO_VALUE,
        )
    console.print(table)
    for issue in stock_cut.issues:
        if issue.severity != "danger":
            console.print(f"{issue.severity}: {issue}", markup=False, highlight=False, soft_wrap=True)
    for line in _comparison_lines(stock_cut):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    if output:
        console.print(f"wrote {output}", markup=False, highlight=False, soft_wrap=True)


def _comparison_lines(stock_cut: StockCut) -> list[str]:
    if stock_cut.same_as is None:
        return []
    if not stock_cut.differences:
        return [f"{stock_cut.same_as} leaves the same stock, in {stock_cut.field.heights.size:,} cells"]
    lines = [
        f"at X{fixed(difference.x, 2)} Y{fixed(difference.y, 2)}: Z{fixed(difference.before, 3)} there, "
        f"Z{fixed(difference.after, 3)} here "
        f"({count(difference.cells, 'cell')})"
        for difference in stock_cut.differences[:_MAX_PLACES]
    ]
    n_more = len(stock_cut.differences) - _MAX_PLACES
    return [
        f"{stock_cut.same_as} leaves different stock:",
        *lines,
        *([f"and {count(n_more, 'more place')}"] if n_more > 0 else []),
    ]
