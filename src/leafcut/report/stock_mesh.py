"""Convert a height field to a closed triangle mesh in binary STL."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from leafcut.material.height_field import HeightField

#: Maximum number of cells in the mesh; with four triangles each, the file has about 40 MB.
MAX_CELLS = 200_000
_ROW = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])


def stock_stl(field: HeightField) -> tuple[bytes, int]:
    """Return a height field as binary STL, mm, and the decimation step.

    The vertices are at the cell centres, so the heights can be recovered from the file. The outer cells are repeated at
    the sides of the stock. Walls and a floor close the surface, and the mesh has a hole where the stock is cut through.
    If there are more than `MAX_CELLS` cells, only every second, third … cell is used in each direction.
    """
    step = 1
    while (field.heights.shape[0] // step) * (field.heights.shape[1] // step) > MAX_CELLS:
        step += 1
    heights = np.maximum(field.heights[::step, ::step].astype(np.float64), field.floor)
    y, x = (
        _corners(start, field.cell, step, cells, count)
        for start, cells, count in zip((field.y, field.x), field.heights.shape, heights.shape, strict=True)
    )
    # A ring of vertices on the floor forms the walls.
    top = np.pad(np.pad(heights, 1, mode="edge"), 1, constant_values=field.floor)
    corners = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), top], axis=-1)
    upper = _triangles(corners)
    lower = _triangles(np.concatenate([corners[..., :2], np.full_like(top, field.floor)[..., None]], axis=-1))
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


def _corners(start: float, cell: float, step: int, cells: int, count: int) -> NDArray[np.float64]:
    """Return the centre of every `step`-th cell, mm; each side of the stock is added twice, before and after them."""
    places = start + step * cell * np.arange(count, dtype=np.float64)
    low, high = start - 0.5 * cell, start + (cells - 0.5) * cell
    return np.concatenate([[low, low], places, [high, high]])


def _triangles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Divide a grid of corners into triangles, two for each quad, float64[m, 3, 3], facing up."""
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    return np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
