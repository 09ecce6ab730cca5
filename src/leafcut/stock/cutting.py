"""What a program takes off its material, move by move: volumes, depths, widths, air, and rapids in the material."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.cutter import Cutter
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.stock.height_field import HeightField
from leafcut.stock.straight_moves import StraightMoves

#: The field is cut in so many strips, whatever the threads, so that sums come out the same.
_STRIPS = 16
#: So many moves are cut in one go: between two, a heartbeat.
_AT_ONCE = 200_000
#: What is thinner is rounding, mm: heights are kept in single precision.
FILM = 1e-3
#: A rapid is looked at with a tool that is smaller by so many cells all round: it may go along a wall that was cut.
RAPID_INSET = 1.0


class Removed(NamedTuple):
    """What every move takes off, float64[m] each.

    Attributes
    ----------
    volume
        mm³.
    area
        What is cut, seen from above, mm².
    depth
        The deepest cut, mm.
    left, right
        How far to the left and the right of its way the tool cuts at most, mm; negative: beside the way only on the
        other side.
    """

    volume: Floats
    area: Floats
    depth: Floats
    left: Floats
    right: Floats

    @property
    def cuts(self) -> NDArray[np.bool_]:
        """Whether a move cuts anything that is thicker than a film."""
        return self.area > 0


def cut(
    field: HeightField,
    moves: StraightMoves,
    cutters: Mapping[int, Cutter],
    threads: int = 1,
    look: Heartbeat = unseen,
) -> Removed:
    """Cut material by the moves of a program, in their order; the field is changed.

    A rapid cuts, too, what it meets more than a cell inside of the tool. The answer is the same with any number of
    threads.

    Parameters
    ----------
    cutters
        By the number of the tool; every tool of the moves is there.
    """
    from leafcut.kernels.sweep import CellGrid, ToolShape, sweep

    rows = field.heights.shape[0]
    edges = np.linspace(0, rows, min(_STRIPS, rows) + 1).astype(np.int64)
    grid = CellGrid(field.x, field.y, field.cell)
    table = np.zeros((len(moves), 5))
    table[:, 3], table[:, 4] = math.inf, -math.inf
    inset = np.where(moves.rapid, RAPID_INSET * field.cell, 0.0)
    shapes = {number: ToolShape(*_shape(cutter)) for number, cutter in cutters.items()}
    middle = [field.y + 0.5 * (edges[k] + edges[k + 1] - 1) * field.cell for k in range(len(edges) - 1)]
    with ThreadPoolExecutor(max(threads, 1)) as pool:
        for begin, end, tool in _stretches(moves.tool):
            look()
            shape = shapes[tool]
            low = np.minimum(moves.ends[begin:end, 1], moves.ends[begin:end, 4]) - shape.radius
            high = np.maximum(moves.ends[begin:end, 1], moves.ends[begin:end, 4]) + shape.radius

            def strip(
                number: int, begin: int = begin, shape: ToolShape = shape, low: Floats = low, high: Floats = high
            ) -> tuple[NDArray[np.int64], Floats]:
                first, last = int(edges[number]), int(edges[number + 1])
                reach = 0.5 * (last - first) * field.cell
                which = begin + np.flatnonzero((low <= middle[number] + reach) & (high >= middle[number] - reach))
                found = np.empty((len(which), 5))
                sweep(field.heights, first, last, grid, shape, moves.ends, which, inset, FILM, found)
                return which, found

            for which, found in pool.map(strip, range(len(middle))):
                table[which, :2] += found[:, :2]
                table[which, 2] = np.maximum(table[which, 2], found[:, 2])
                table[which, 3] = np.minimum(table[which, 3], found[:, 3])
                table[which, 4] = np.maximum(table[which, 4], found[:, 4])
    area = field.cell**2
    return Removed(table[:, 0] * area, table[:, 1] * area, table[:, 2], table[:, 4], -table[:, 3])


def _shape(cutter: Cutter) -> tuple[float, ...]:
    slope = 0.0 if math.isinf(cutter.slope) else cutter.slope
    return (cutter.radius, cutter.flat, cutter.corner, *cutter.tangent, slope)


def _stretches(tool: NDArray[np.int64]) -> Iterable[tuple[int, int, int]]:
    """Yield moves of one tool that follow each other, not too many at once: begin, end, tool."""
    if not len(tool):
        return
    changes = np.flatnonzero(np.diff(tool)) + 1
    for first, last in zip([0, *changes.tolist()], [*changes.tolist(), len(tool)], strict=True):
        for begin in range(first, last, _AT_ONCE):
            yield begin, min(begin + _AT_ONCE, last), int(tool[first])
