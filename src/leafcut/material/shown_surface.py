"""Material with an arbitrary surface, for display: a solid or a surface seen from above, and its fixtures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.mesh_field import raise_by_mesh
from leafcut.material.straight_moves import StraightMoves
from leafcut.material.surface import rims_of
from leafcut.model.cutter import Cutter
from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import ShownStock

#: Displayed thickness of a surface without a known lower side: share of its longer side, and minimum, mm.
_THICK, _LEAST_THICK = 0.03, 1.0
#: Distance of hole centres up to which they are one hole, mm.
_SAME = 1e-3


def block_of_surface(mesh: Mesh, stock: ShownStock) -> StockBlock:
    """Return the bounding box of a surface (down to its bottom) and fixtures. Raises PlanError if it has no width."""
    low, high = mesh.low, mesh.high
    floor = float(low[2])
    if not mesh.closed or low[2] >= high[2]:
        floor -= max(_THICK * float((high - low)[:2].max()), _LEAST_THICK)
    boxes = np.array(stock.fixtures, dtype=np.float64).reshape(-1, 6)
    low = np.vstack([low, boxes[:, :3]]).min(axis=0)
    high = np.vstack([high, boxes[:, 3:]]).max(axis=0)
    return StockBlock((float(low[0]), float(low[1]), floor), (float(high[0]), float(high[1]), float(high[2])))


def field_of_surface(
    mesh: Mesh,
    stock: ShownStock,
    block: StockBlock,
    origin: tuple[float, float],
    cell: float,
    moves: StraightMoves,
    cutters: dict[int, Cutter],
) -> tuple[HeightField, NDArray[np.bool_]]:
    """Return a surface as cells of a block, and the cells of its fixtures.

    The block and the moves are relative to an origin. For a finished part, holes drilled by the moves are filled.
    Raises PlanError if there would be too many cells, or too many triangles per cell.
    """
    moved = replace(mesh, triangles=mesh.triangles - (*origin, 0.0))
    field = HeightField.of_block(block, cell)
    # A last cell that extends beyond the block has its centre outside the surface.
    rows, columns = (
        max(int((edge - start) / cell + 1e-9) + 1, 1)
        for edge, start in ((block.high[1], field.y), (block.high[0], field.x))
    )
    field.heights = np.full((rows, columns), field.floor, dtype=np.float32)
    raise_by_mesh(field, moved)
    if stock.finished:
        _fill_holes(field, moved, moves, cutters)
    held = np.zeros(field.heights.shape, dtype=np.bool_)
    for x0, y0, _, x1, y1, top in stock.fixtures:
        held_in = _cells(field, (x0 - origin[0], y0 - origin[1]), (x1 - origin[0], y1 - origin[1]))
        part = field.heights[held_in]
        held[held_in] |= part < top
        np.maximum(part, top, out=part)
    return field, held


def _fill_holes(field: HeightField, mesh: Mesh, moves: StraightMoves, cutters: dict[int, Cutter]) -> None:
    """Fill open holes below straight plunges up to the lowest point of the rim."""
    ends = moves.ends
    plunging = ~moves.rapid & (ends[:, 0] == ends[:, 3]) & (ends[:, 1] == ends[:, 4]) & (ends[:, 5] < ends[:, 2])
    if not plunging.any():
        return
    _, first, hole = np.unique(np.rint(ends[plunging, :2] / _SAME), axis=0, return_index=True, return_inverse=True)
    xy = ends[plunging, :2][first]
    radius = np.zeros(len(xy))
    np.maximum.at(radius, hole.ravel(), np.array([cutters[number].radius for number in moves.tool[plunging].tolist()]))
    rims = rims_of(mesh.triangles, xy, radius)
    for (x, y), tool_radius, top in zip(xy.tolist(), radius.tolist(), rims.lowest.tolist(), strict=True):
        if not np.isfinite(top):
            continue
        rim_radius = tool_radius + 0.5 * field.cell
        rows, columns = _cells(field, (x - rim_radius, y - rim_radius), (x + rim_radius, y + rim_radius))
        part = field.heights[rows, columns]
        across = field.x + field.cell * np.arange(columns.start, columns.stop) - x
        up = field.y + field.cell * np.arange(rows.start, rows.stop) - y
        inside = across[None, :] ** 2 + up[:, None] ** 2 <= rim_radius**2
        part[inside] = np.maximum(part[inside], top)


def _cells(field: HeightField, low: tuple[float, float], high: tuple[float, float]) -> tuple[slice, slice]:
    spans = []
    for start, first, last, size in zip((field.y, field.x), low[::-1], high[::-1], field.heights.shape, strict=True):
        edges = math.ceil((first - start) / field.cell), math.floor((last - start) / field.cell) + 1
        spans.append(slice(*(min(max(edge, 0), size) for edge in edges)))
    return spans[0], spans[1]
