"""Report the material that a program removes, on the terminal, as JSON, and as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.report.json_answer import issues_as_json
from leafcut.report.stock_picture import stock_png
from leafcut.report.wording import NO_VALUE, count_text, print_line
from leafcut.units import format_time, to_fixed

if TYPE_CHECKING:
    from rich.console import Console

    from leafcut.material.height_field import HeightField
    from leafcut.material.stock_cut import StockCut

#: File formats of the remaining stock.
_FILES = (".png", ".stl")
_MM3_PER_CM3 = 1000.0
_BYTES_PER_MB = 1e6
#: Maximum number of listed differences.
_MAX_PLACES = 10

#: Maximum number of cells in the mesh. Each cell has four triangles, so the file has about 40 MB.
MAX_CELLS = 200_000
_ROW = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])


def check_stock_extension(output: str | None) -> None:
    """Raise OptionError unless the file extension is ``.png`` (a picture) or ``.stl`` (a solid)."""
    if output is not None and Path(output).suffix.lower() not in _FILES:
        raise OptionError(f"--output: '{Path(output).name}' is neither a picture (.png) nor a solid (.stl)")


def stock_file_data(stock_cut: StockCut, output: str) -> bytes:
    """Convert the remaining stock to the format that the file extension selects."""
    if output.lower().endswith(".png"):
        return stock_png(stock_cut.field, stock_cut.block.high[2])

    return stock_stl(stock_cut.field)[0]


def stock_as_json(stock_cut: StockCut, output: str | None = None) -> dict[str, Any]:
    """Return the answer of `leafcut stock --json`, with lengths in mm and times in s."""
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
    """Print the dangers, and for each tool, the material that it removes and its times in material and in air."""
    from rich.table import Table

    for issue in stock_cut.issues:
        if issue.severity == "danger":
            print_line(console, f"danger: {issue}", "bold red")
    sides = " × ".join(f"{b - a:.1f}" for a, b in zip(stock_cut.block.low, stock_cut.block.high, strict=True))
    origin = "a block around the cuts" if stock_cut.derived else stock_cut.part or "a block"
    print_line(
        console,
        f"{stock_cut.program}: {stock_cut.removed_mm3 / _MM3_PER_CM3:.2f} cm³ off {origin} of {sides} mm, in cells of "
        f"{stock_cut.field.cell:g} mm ({stock_cut.field.heights.size:,} of them, "
        f"{max(stock_cut.field.heights.nbytes / _BYTES_PER_MB, 0.1):.1f} MB)",
    )
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
            print_line(console, f"{issue.severity}: {issue}")
    for line in _comparison_lines(stock_cut):
        print_line(console, line)
    if output:
        print_line(console, f"wrote {output}")


def _comparison_lines(stock_cut: StockCut) -> list[str]:
    if stock_cut.same_as is None:
        return []
    if not stock_cut.differences:
        return [f"{stock_cut.same_as} leaves the same stock, in {stock_cut.field.heights.size:,} cells"]
    lines = [
        f"at X{to_fixed(difference.x, 2)} Y{to_fixed(difference.y, 2)}: Z{to_fixed(difference.before, 3)} there, "
        f"Z{to_fixed(difference.after, 3)} here "
        f"({count_text(difference.cells, 'cell')})"
        for difference in stock_cut.differences[:_MAX_PLACES]
    ]
    n_more = len(stock_cut.differences) - _MAX_PLACES
    return [
        f"{stock_cut.same_as} leaves different stock:",
        *lines,
        *([f"and {count_text(n_more, 'more place')}"] if n_more > 0 else []),
    ]


def stock_stl(field: HeightField) -> tuple[bytes, int]:
    """Convert a height field to a binary STL, mm, and return it with the decimation step.

    The vertices are at the cell centres, so the heights can be recovered from the file. The outer cells are repeated at
    the sides of the stock. Walls and a floor close the surface, and through cuts become holes in the mesh. If the field
    has more than `MAX_CELLS` cells, the function only uses every second, third … cell in each direction.
    """
    step = 1
    while (field.heights.shape[0] // step) * (field.heights.shape[1] // step) > MAX_CELLS:
        step += 1
    heights = np.maximum(field.heights[::step, ::step].astype(np.float64), field.floor)
    y, x = (
        _corner_coordinates(start, field.cell, step, cells, count)
        for start, cells, count in zip((field.y, field.x), field.heights.shape, heights.shape, strict=True)
    )
    # A ring of vertices on the floor forms the walls.
    top = np.pad(np.pad(heights, 1, mode="edge"), 1, constant_values=field.floor)
    corners = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), top], axis=-1)
    upper = _triangles_of_grid(corners)
    lower = _triangles_of_grid(np.concatenate([corners[..., :2], np.full_like(top, field.floor)[..., None]], axis=-1))
    # Triangles on the floor are dropped: they are through cuts, or the foot of a wall.
    raised = (upper[..., 2] > field.floor).any(axis=1)
    triangles = np.concatenate([upper[raised], lower[raised][:, ::-1]])
    span = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(span, axis=1)
    triangles, span, area = triangles[area > 0], span[area > 0], area[area > 0]
    table = np.zeros(len(triangles), dtype=_ROW)
    table["normal"], table["corner"] = span / area[:, None], triangles
    head = b"leafcut stock, mm".ljust(80)
    return head + len(table).to_bytes(4, "little") + table.tobytes(), step


def _corner_coordinates(start: float, cell: float, step: int, cells: int, count: int) -> NDArray[np.float64]:
    """Return the centre of every `step`-th cell, mm. Both ends also have the side of the stock, twice."""
    places = start + step * cell * np.arange(count, dtype=np.float64)
    low, high = start - 0.5 * cell, start + (cells - 0.5) * cell
    return np.concatenate([[low, low], places, [high, high]])


def _triangles_of_grid(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Divide each quad in a grid of corners into two triangles that face up, float64[m, 3, 3]."""
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    return np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
