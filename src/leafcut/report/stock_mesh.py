"""A height field as a closed surface of triangles: binary STL."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from leafcut.material.height_field import HeightField

#: Most cells that become triangles, four each: a file of some 40 MB.
MOST_CELLS = 200_000
_ROW = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])


def stock_stl(field: HeightField) -> tuple[bytes, int]:
    """Return a height field as binary STL, mm, and of how many cells in a row one corner was made.

    The corners lie over the middles of cells, so that who reads the file has the heights back, and those of outer cells
    again on the sides of the stock; the surface is closed by walls and a floor, and there is nothing where the stock is
    cut through. Of more than `MOST_CELLS` cells every second, third … counts.
    """
    step = 1
    while (field.heights.shape[0] // step) * (field.heights.shape[1] // step) > MOST_CELLS:
        step += 1
    heights = np.maximum(field.heights[::step, ::step].astype(np.float64), field.floor)
    y, x = (
        _corners(start, field.cell, step, cells, many)
        for start, cells, many in zip((field.y, field.x), field.heights.shape, heights.shape, strict=True)
    )
    # A ring of corners on the floor all round makes the walls.
    top = np.pad(np.pad(heights, 1, mode="edge"), 1, constant_values=field.floor)
    corners = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), top], axis=-1)
    upper = _triangles(corners)
    lower = _triangles(np.concatenate([corners[..., :2], np.full_like(top, field.floor)[..., None]], axis=-1))
    # Where all lies on the floor there is nothing: the stock was cut through, or it is the foot of a wall.
    there = (upper[..., 2] > field.floor).any(axis=1)
    triangles = np.concatenate([upper[there], lower[there][:, ::-1]])
    span = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(span, axis=1)
    triangles, span, area = triangles[area > 0], span[area > 0], area[area > 0]
    table = np.zeros(len(triangles), dtype=_ROW)
    table["normal"], table["corner"] = span / area[:, None], triangles
    head = b"leafcut stock, mm".ljust(80)
    return head + len(table).to_bytes(4, "little") + table.tobytes(), step


def _corners(start: float, cell: float, step: int, cells: int, many: int) -> NDArray[np.float64]:
    """Return where corners lie along an axis, mm: over every `step`-th cell's middle, and twice at each side."""
    places = start + step * cell * np.arange(many, dtype=np.float64)
    low, high = start - 0.5 * cell, start + (cells - 0.5) * cell
    return np.concatenate([[low, low], places, [high, high]])


def _triangles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return two triangles for every four neighbouring corners, float64[m, 3, 3], their upper side up."""
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    return np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
