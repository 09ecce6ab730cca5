"""Simulate a program move by move, and measure volumes, depths, widths, air cuts, and rapids in material."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.material.height_field import HeightField
from leafcut.material.straight_moves import StraightMoves
from leafcut.model.cutter import Body, BodyPart, Cutter
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat

if TYPE_CHECKING:
    from leafcut.kernels.sweep import CellRows, ToolShape

#: Number of strips of the field. It is independent of the number of threads, so that sums are reproducible.
_STRIPS = 16
#: Number of moves per batch. The simulation checks for cancellation after each batch.
_BATCH = 200_000
#: Maximum thickness of a layer that counts as a rounding error, mm. Heights have single precision.
FILM = 1e-3
#: Reduction of the tool radius for rapids, in cells. A rapid may run along a finished wall.
RAPID_INSET = 1.0
#: A shank collides if successive cells are higher than the flutes over this length, in tool diameters. The gaps between
#: these cells may have up to this size, in cells. Single higher cells do not count, because they often remain along
#: walls.
_SHANK_CELLS, _SHANK_GAP = 0.5, 2.0
#: Uncertainty of the position of a wall, in cells. A cell counts as cut if its centre is cut.
_MARGIN = 1.0


class Removed(NamedTuple):
    """The material that each move removes, in columns of float64[m].

    Attributes
    ----------
    volume
        Removed volume, mm³.
    area
        Cut area seen from above, mm².
    depth
        Maximum depth of cut, mm.
    left, right
        Maximum distance of the cut from the path on the left and on the right, mm. It is negative if the cut is only on
        the opposite side.
    over
        Height of the material above the tip of the tool just before the move, mm, measured within a margin around the
        tool. The height is negative if all material is lower, and −∞ without a margin.
    shank, holder
        Depth of the shank and the holder in the material, mm. It is 0 if they do not touch it, or if their shape is
        unknown.
    """

    volume: Floats
    area: Floats
    depth: Floats
    left: Floats
    right: Floats
    over: Floats
    shank: Floats
    holder: Floats

    @property
    def cuts(self) -> NDArray[np.bool_]:
        """Mask of the moves that remove a noticeable amount of material."""
        return self.area > 0


def simulate_cutting(
    field: HeightField,
    moves: StraightMoves,
    cutters: Mapping[int, Cutter],
    threads: int = 1,
    check_cancelled: Heartbeat = ignore_heartbeat,
    *,
    margin: float | None = None,
    surrounding_height: float | None = None,
    lowered: HeightField | None = None,
    bodies: Mapping[int, Sequence[BodyPart]] | None = None,
) -> Removed:
    """Cut material with the moves of a program, in order, and update the field.

    Rapids cut material as well, but with a tool radius that is one cell smaller (`RAPID_INSET`). The result does not
    depend on the number of threads.

    Parameters
    ----------
    cutters
        Profile of each tool of the moves, by tool number.
    margin
        Additional tool radius for `Removed.over`, mm.
    surrounding_height
        Height of the material outside the field for `Removed.over`, mm. None stands for the floor of the field.
    lowered
        A second field with the same cells. It stores the new height of each cell that a rapid lowers.
    bodies
        Sections of each tool above the flutes, by tool number. Tools with unknown sections are missing.
    """
    from leafcut.kernels.sweep import CellRows, ToolShape

    n_rows = field.heights.shape[0]
    edges = np.linspace(0, n_rows, min(_STRIPS, n_rows) + 1).astype(np.int64)
    table = np.zeros((len(moves), 9))
    table[:, 3], table[:, 4], table[:, 5] = math.inf, -math.inf, -math.inf
    if margin is not None:
        distances = margin + np.array([cutters[number].radius for number in moves.tool.tolist()])
        outside = ~field.contains(moves.ends, distances)
        height = field.floor if surrounding_height is None else surrounding_height
        table[outside, 5] = height - np.minimum(moves.ends[outside, 2], moves.ends[outside, 5])
    inset = np.where(moves.rapid, RAPID_INSET * field.cell, 0.0)
    wider = -1.0 if margin is None else margin
    lowered_heights = np.empty((0, 0), dtype=np.float32) if lowered is None else lowered.heights
    shapes = {number: ToolShape(*_cutter_as_tuple(cutter)) for number, cutter in cutters.items()}
    body_rows = {number: _body_parts_as_array(parts) for number, parts in (bodies or {}).items()}
    no_body, top = np.zeros((0, 8)), float(field.heights.max(initial=-math.inf)) - FILM
    strips = [
        CellRows(field.heights, lowered_heights, first, last, field.x, field.y, field.cell)
        for first, last in pairwise(edges.tolist())
    ]
    with ThreadPoolExecutor(max(threads, 1)) as pool:
        for start, end, tool in _split_by_tool(moves.tool):
            check_cancelled()
            shape, body, y = shapes[tool], body_rows.get(tool, no_body), moves.ends[start:end, 1::3]
            half_width = max(shape.radius + max(wider, 0.0), float(body[:, 0].max(initial=0.0)))
            low, high = np.minimum(y[:, 0], y[:, 1]) - half_width, np.maximum(y[:, 0], y[:, 1]) + half_width
            run = _ToolRun(start, low, high, shape, body)
            sweep_strip = partial(_cut_strip, run, ends=moves.ends, inset=inset, margin=wider, top=top)
            for selected, result in pool.map(sweep_strip, strips):
                table[selected, :2] += result[:, :2]
                table[selected, 3] = np.minimum(table[selected, 3], result[:, 3])
                for column in (2, 4, 5, 6, 7):
                    table[selected, column] = np.maximum(table[selected, column], result[:, column])
                table[selected, 8] += result[:, 8]
    area = field.cell**2
    shank = np.where(_shank_collides(moves, table[:, 8], cutters, field.cell), table[:, 6], 0.0)
    return Removed(
        table[:, 0] * area, table[:, 1] * area, table[:, 2], table[:, 4], -table[:, 3], table[:, 5], shank, table[:, 7]
    )


def collision_depths(moves: StraightMoves, removed: Removed) -> dict[str, Floats]:
    """Return the depth to which each move collides with material, mm, for each kind of collision.

    The kinds are rapid, shank and holder. The depth is 0 without a collision.
    """
    return {
        "rapid": np.where(moves.rapid & removed.cuts, removed.depth, 0.0),
        Body.SHANK.value: removed.shank,
        Body.HOLDER.value: removed.holder,
    }


def relative_chip_thickness(removed: Removed, radius: Floats, cell: float) -> Floats:
    """Return the maximum chip thickness of each move as a share of the feed per tooth, or 0 without a cut.

    Consider a tool with radius R. At a distance d from its path, the chip thickness is √(1 − (d/R)²) times the feed per
    tooth, so the thickest chip is at the smallest d. For a one-sided cut of width a < R, this equals the chip thinning
    formula 2 √(a/D (1 − a/D)) (Altintas, Manufacturing Automation, 2nd ed., section 2.6: h = c sin φ).
    """
    # If the cut is on one side only, `left` or `right` is the negative distance from the path to the cut.
    nearest = np.maximum(np.maximum(-removed.left, -removed.right) - _MARGIN * cell, 0.0)
    nearest = np.where(removed.cuts, np.minimum(nearest, radius), radius)
    share: Floats = np.sqrt(1.0 - (nearest / radius) ** 2)
    return share


def cut_width(removed: Removed, radius: Floats, cell: float) -> Floats:
    """Return the width of cut of each move perpendicular to its path, mm. It never exceeds the tool diameter."""
    swept = np.where(removed.cuts, removed.left + removed.right + cell, 0.0)
    width: Floats = np.minimum(np.maximum(swept, 0.0), 2.0 * radius)
    return width


class _ToolRun(NamedTuple):
    """Successive moves with the same tool.

    Attributes
    ----------
    first
        Index of the first move.
    low, high
        Range of y that the tool touches in each move, float64[m], mm.
    shape
        Profile of the tool.
    bodies
        Sections of the tool above the flutes, one per row.
    """

    first: int
    low: Floats
    high: Floats
    shape: ToolShape
    bodies: Floats


def _cut_strip(
    run: _ToolRun, rows: CellRows, *, ends: Floats, inset: Floats, margin: float, top: float
) -> tuple[NDArray[np.int64], Floats]:
    from leafcut.kernels.sweep import cut_moves

    middle = rows.y + 0.5 * (rows.first + rows.last - 1) * rows.cell
    half_height = 0.5 * (rows.last - rows.first) * rows.cell
    selected = run.first + np.flatnonzero((run.low <= middle + half_height) & (run.high >= middle - half_height))
    result = np.empty((len(selected), 9))
    cut_moves(rows, run.shape, ends, selected, inset, margin, FILM, top, run.bodies, result)
    return selected, result


def _body_parts_as_array(parts: Sequence[BodyPart]) -> Floats:
    rows = [
        (
            part.radius,
            part.flat,
            0.0,
            part.flat,
            0.0,
            0.0 if math.isinf(part.slope) else part.slope,
            part.above,
            float(part.body is Body.HOLDER),
        )
        for part in parts
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 8)


def _shank_collides(
    moves: StraightMoves, cells: Floats, cutters: Mapping[int, Cutter], cell: float
) -> NDArray[np.bool_]:
    """Return a mask of the moves in which the shank hits enough consecutive cells to count as a collision."""
    colliding = np.zeros(len(moves), dtype=np.bool_)
    hits = np.flatnonzero(cells > 0)
    if not len(hits):
        return colliding
    travelled = np.cumsum(np.hypot(*(moves.ends[:, 3:5] - moves.ends[:, :2]).T))
    length = np.diff(travelled, prepend=0.0)[hits]
    gap = np.diff(travelled[hits]) - length[1:] > _SHANK_GAP * cell
    is_start = np.concatenate([[True], gap | (np.diff(moves.tool[hits]) != 0)])
    group = np.cumsum(is_start) - 1
    threshold = np.array([_SHANK_CELLS * 2.0 * cutters[number].radius / cell for number in moves.tool[hits].tolist()])
    colliding[hits] = np.bincount(group, cells[hits])[group] > threshold
    return colliding


def _cutter_as_tuple(cutter: Cutter) -> tuple[float, ...]:
    slope = 0.0 if math.isinf(cutter.slope) else cutter.slope
    return (cutter.radius, cutter.flat, cutter.corner, *cutter.tangent_point, slope)


def _split_by_tool(tool: NDArray[np.int64]) -> Iterable[tuple[int, int, int]]:
    """Yield runs of moves with the same tool as (start, end, tool). Long runs are divided."""
    if not len(tool):
        return
    changes = np.flatnonzero(np.diff(tool)) + 1
    for first, last in zip([0, *changes.tolist()], [*changes.tolist(), len(tool)], strict=True):
        for start in range(first, last, _BATCH):
            yield start, min(start + _BATCH, last), int(tool[first])
