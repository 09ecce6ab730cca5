"""The stock of a job as coarse cells for display, and all moves that cut this stock."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats
from leafcut.material.cutting import Removed, collision_depths, cut_width, relative_chip_thickness, simulate_cutting
from leafcut.material.height_field import FINEST, HeightField, StockBlock
from leafcut.material.mesh_field import raise_field_to_mesh
from leafcut.material.straight_moves import (
    StraightMoves,
    cutting_moves_for_cells,
    smallest_tool_diameter,
    undivided_cutting_moves,
)
from leafcut.material.surface import heights_around_holes
from leafcut.model.cutter import BodyPart, Cutter, cutter_of_tool, shank_and_holder_sections
from leafcut.model.mesh import Mesh
from leafcut.model.shown_stock import ShownStock
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath

#: Number of cells along the longer side.
CELLS = 512
#: Maximum length of the segments of cuts, as a share of the smallest tool diameter, and maximum number of these
#: segments.
_PIECE, _PIECES = 0.5, 400_000
#: Maximum number of moves of a displayed program.
_MOST_MOVES = 1_000_000
#: Margin of a block around the cuts, as a share of its longer side. Minimum and maximum of this margin, mm. Thickness
#: of the block below the cuts, mm.
_BESIDE, _LEAST_BESIDE, _MOST_BESIDE, _BELOW = 0.06, 1.0, 12.0, 1.0
#: Minimum thickness of the block, as a share of its longer side. A thinner block would look like a sheet of foil.
_THICK = 0.03
#: Maximum number of displayed collisions.
_MOST_COLLISIONS = 500
#: Number of positions along a move that are compared with the block.
_PLACES = 65
#: Displayed thickness of a surface whose lower side is unknown, as a share of its longer side, and its minimum, mm.
_SURFACE_THICK, _LEAST_THICK = 0.03, 1.0
#: Maximum distance between plunges in the same hole, mm.
_SAME = 1e-3


class Collision(NamedTuple):
    """A collision of a tool with material.

    `kind` names the part of the tool that collides, or a rapid. `row` is the row in the toolpath. The position and the
    depth are in mm.
    """

    kind: str
    row: int
    place: tuple[float, float, float]
    depth: float


@dataclass(frozen=True, eq=False)
class Solid:
    """The stock before and after a job, and the moves of the job.

    Positions are relative to `origin`, and are rounded to single precision for drawing. The moves change the stock from
    `before` to `after`.

    Attributes
    ----------
    origin
        Centre of the block in program coordinates, x and y, mm.
    held
        Mask of the cells that fixtures cover, bool[rows, columns].
    width, chip
        Width of cut as a share of the tool diameter, and maximum chip thickness as a share of the feed per tooth, for
        each move, float64[m].
    """

    origin: tuple[float, float]
    block: StockBlock
    before: HeightField
    after: HeightField
    held: NDArray[np.bool_]
    moves: StraightMoves
    tools: dict[int, Tool]
    cutters: dict[int, Cutter]
    bodies: dict[int, tuple[BodyPart, ...]]
    width: Floats
    chip: Floats
    collisions: tuple[Collision, ...]


def displayed_block(path: Toolpath, stock: ShownStock) -> StockBlock:
    """Return the block of material that the display of a job shows.

    Raises PlanError if the block is unknown, and OptionError if a tool has no diameter.
    """
    return _cutters_and_block(path, stock)[1]


def _cutters_and_block(path: Toolpath, stock: ShownStock) -> tuple[dict[int, Cutter], StockBlock]:
    if stock.refused:
        raise PlanError(stock.refused)
    if not stock.tools:
        raise PlanError("no known tool cuts")
    cutters = {number: cutter_of_tool(tool) for number, tool in stock.tools.items()}
    if stock.surface is not None:
        return cutters, _surface_bounding_block(stock.surface, stock)
    if stock.block:
        return cutters, StockBlock(*stock.block)
    return cutters, _block_around_cuts(undivided_cutting_moves(path, cutters), cutters, stock)


def cut_display_solid(path: Toolpath, stock: ShownStock) -> Solid:
    """Cut the stock of a job with a toolpath, using coarse cells for display.

    Raises
    ------
    PlanError
        The stock is unknown or is not cut at all, or there are too many moves.
    OptionError
        A tool has no diameter.
    """
    cutters, block = _cutters_and_block(path, stock)
    tools = dict(stock.tools)
    sides = [block.high[k] - block.low[k] for k in range(2)]
    cell = max(max(sides) / CELLS, FINEST)
    moves = cutting_moves_for_cells(path, cutters, cell, max(_PIECE * smallest_tool_diameter(cutters), 2.0 * cell))
    if len(moves) > _PIECES:
        moves = cutting_moves_for_cells(path, cutters, cell)
    if len(moves) > _MOST_MOVES:
        raise PlanError("{:,} moves are too many to show; the limit is {:,}", len(moves), _MOST_MOVES)
    origin = (0.5 * (block.low[0] + block.high[0]), 0.5 * (block.low[1] + block.high[1]))
    shift = np.array([*origin, 0.0, *origin, 0.0])
    moves = replace(moves, ends=(moves.ends - shift).astype(np.float32).astype(np.float64))
    if stock.surface is not None:
        before, held = _surface_to_height_field(
            stock.surface, stock, _shifted_block(block, origin), origin, cell, moves, cutters
        )
    else:
        before = HeightField.of_block(_shifted_block(block, origin), cell)
        held = np.zeros(before.heights.shape, dtype=np.bool_)
    after = before.copy()
    bodies = {number: shank_and_holder_sections(tool) for number, tool in tools.items()}
    removed = simulate_cutting(after, moves, cutters, os.cpu_count() or 1, bodies=bodies)
    if not removed.cuts.any():
        raise PlanError("the program never touches the stock")
    radius = np.array([cutters[number].radius for number in moves.tool.tolist()])
    return Solid(
        origin,
        block,
        before,
        after,
        held,
        moves,
        tools,
        cutters,
        bodies,
        cut_width(removed, radius, cell) / (2.0 * radius),
        np.where(removed.cuts, relative_chip_thickness(removed, radius, cell), 0.0),
        _collect_collisions(moves, removed, bodies, block, origin),
    )


def _shifted_block(block: StockBlock, origin: tuple[float, float]) -> StockBlock:
    (x0, y0, z0), (x1, y1, z1) = block.low, block.high
    return StockBlock((x0 - origin[0], y0 - origin[1], z0), (x1 - origin[0], y1 - origin[1], z1))


def _block_around_cuts(moves: StraightMoves, cutters: dict[int, Cutter], stock: ShownStock) -> StockBlock:
    """Return a block that encloses all cuts below Z0 and adds a margin. Raises PlanError if no cut goes below Z0."""
    ends = moves.ends
    cutting = ~moves.rapid & (np.minimum(ends[:, 2], ends[:, 5]) < 0.0)
    if not cutting.any():
        raise PlanError("the program cuts nothing below Z0, so the top of the stock is unknown; give --workpiece")
    lowest, highest = moves.swept_box(cutting, cutters)
    low, high, deepest = lowest[:2], highest[:2], float(lowest[2])
    margin = min(max(_BESIDE * float((high - low).max()), _LEAST_BESIDE), _MOST_BESIDE)
    low, high = low - margin, high + margin
    if stock.around:
        low, high = np.minimum(low, stock.around[:2]), np.maximum(high, stock.around[2:])
    floor = min(deepest - _BELOW, -_THICK * float((high - low).max()))
    floor = stock.floor if stock.floor is not None and stock.floor < 0.0 else floor
    return StockBlock((float(low[0]), float(low[1]), floor), (float(high[0]), float(high[1]), 0.0))


def _collect_collisions(
    moves: StraightMoves,
    removed: Removed,
    bodies: dict[int, tuple[BodyPart, ...]],
    block: StockBlock,
    origin: tuple[float, float],
) -> tuple[Collision, ...]:
    result = []
    for kind, depth in collision_depths(moves, removed).items():
        deepest: dict[int, int] = {}
        for index in np.flatnonzero(depth > 0.0).tolist():
            row = int(moves.row[index])
            if row not in deepest or depth[index] > depth[deepest[row]]:
                deepest[row] = index
        for row, index in deepest.items():
            x, y, z = _position_in_block(moves.ends[index], block, origin)
            above = [part.above for part in bodies.get(int(moves.tool[index]), ()) if part.body == kind]
            if above:
                z = float(moves.ends[index, [2, 5]].min()) + min(above)
            result.append(Collision(kind, row, (x, y, z), float(depth[index])))
    return tuple(sorted(result, key=lambda collision: collision.row)[:_MOST_COLLISIONS])


def _position_in_block(
    move: NDArray[np.float64], block: StockBlock, origin: tuple[float, float]
) -> tuple[float, float, float]:
    """Clip a move to a block, and return the midpoint of the clipped move, relative to the origin.

    If the whole move lies outside the block, return its lower end.
    """
    share = np.linspace(0.0, 1.0, _PLACES)[:, None]
    points = move[:3] + share * (move[3:] - move[:3])
    low, high = np.array(block.low) - (*origin, math.inf), np.array(block.high) - (*origin, 0.0)
    inside = points[((points >= low) & (points <= high)).all(axis=1)]
    x, y, z = (inside[len(inside) // 2] if len(inside) else min(move[:3], move[3:], key=lambda end: end[2])).tolist()
    return x, y, z


def _surface_bounding_block(mesh: Mesh, stock: ShownStock) -> StockBlock:
    """Return the bounding box of a surface and its fixtures. Raises PlanError if the box has no width."""
    low, high = mesh.low, mesh.high
    floor = float(low[2])
    if not mesh.closed or low[2] >= high[2]:
        floor -= max(_SURFACE_THICK * float((high - low)[:2].max()), _LEAST_THICK)
    boxes = np.array(stock.fixtures, dtype=np.float64).reshape(-1, 6)
    low = np.vstack([low, boxes[:, :3]]).min(axis=0)
    high = np.vstack([high, boxes[:, 3:]]).max(axis=0)
    return StockBlock((float(low[0]), float(low[1]), floor), (float(high[0]), float(high[1]), float(high[2])))


def _surface_to_height_field(
    mesh: Mesh,
    stock: ShownStock,
    block: StockBlock,
    origin: tuple[float, float],
    cell: float,
    moves: StraightMoves,
    cutters: dict[int, Cutter],
) -> tuple[HeightField, NDArray[np.bool_]]:
    """Convert a surface to a height field with the cells of a block.

    Also return a mask of the cells that fixtures cover. The block and the moves are relative to `origin`. If the
    surface is a finished part, the holes that the moves drill are filled.

    Raises
    ------
    PlanError
        There would be too many cells, or too many triangles per cell.
    """
    moved = replace(mesh, triangles=mesh.triangles - (*origin, 0.0))
    field = HeightField.of_block(block, cell)
    # Leave out a last cell whose centre is beyond the block, because it is outside the surface.
    rows, columns = (
        max(int((edge - start) / cell + 1e-9) + 1, 1)
        for edge, start in ((block.high[1], field.y), (block.high[0], field.x))
    )
    field.heights = np.full((rows, columns), field.floor, dtype=np.float32)
    raise_field_to_mesh(field, moved)
    if stock.finished:
        _fill_holes(field, moved, moves, cutters)
    held = np.zeros(field.heights.shape, dtype=np.bool_)
    for x0, y0, _, x1, y1, top in stock.fixtures:
        held_in = field.cells_between((x0 - origin[0], y0 - origin[1]), (x1 - origin[0], y1 - origin[1]))
        part = field.heights[held_in]
        held[held_in] |= part < top
        np.maximum(part, top, out=part)
    return field, held


def _fill_holes(field: HeightField, mesh: Mesh, moves: StraightMoves, cutters: dict[int, Cutter]) -> None:
    """Fill open holes below straight plunges. Each hole is filled up to the lowest point of its rim."""
    ends = moves.ends
    plunging = ~moves.rapid & (ends[:, 0] == ends[:, 3]) & (ends[:, 1] == ends[:, 4]) & (ends[:, 5] < ends[:, 2])
    if not plunging.any():
        return
    _, first, hole = np.unique(np.rint(ends[plunging, :2] / _SAME), axis=0, return_index=True, return_inverse=True)
    xy = ends[plunging, :2][first]
    radius = np.zeros(len(xy))
    np.maximum.at(radius, hole.ravel(), np.array([cutters[number].radius for number in moves.tool[plunging].tolist()]))
    rims = heights_around_holes(mesh.triangles, xy, radius)
    for (x, y), tool_radius, top in zip(xy.tolist(), radius.tolist(), rims.lowest.tolist(), strict=True):
        if not np.isfinite(top):
            continue
        rim_radius = tool_radius + 0.5 * field.cell
        part, away = field.heights_around(x, y, rim_radius)
        inside = away <= rim_radius
        part[inside] = np.maximum(part[inside], top)
