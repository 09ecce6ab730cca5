"""Material as a height field, which stores the height of each cell of a grid seen from above."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats

#: Maximum number of cells. Each cell takes 4 bytes, and 8 bytes during verification.
MOST_CELLS = 64_000_000
#: Target number of cells if no cell size is given.
USUAL_CELLS = 4_000_000
#: Default cell size as a share of the smallest tool diameter.
SHARE_OF_TOOL = 0.025
#: Maximum cell size of a large stock whose cells fit into memory, as a share of the smallest tool diameter. Larger
#: cells would miss cuts.
COARSEST = 0.2
#: Minimum default cell size, mm.
FINEST = 0.01


@dataclass(frozen=True)
class StockBlock:
    """A block of material, defined by its lowest and its highest corner, mm."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def __post_init__(self) -> None:
        if not all(math.isfinite(n) for n in (*self.low, *self.high)):
            raise PlanError("a coordinate is not a number; give two corners with three coordinates each, in mm")
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            sizes = " × ".join(f"{b - a:g}" for a, b in zip(self.low, self.high, strict=True))
            raise PlanError("a block of {} mm has no volume; give the lower corner first", sizes)


@dataclass(eq=False)
class HeightField:
    """The height of the material in square cells.

    Attributes
    ----------
    heights
        Height of each cell, float32[rows, columns], mm. Rows are sorted by ascending y, and columns by ascending x.
    x, y
        Centre of the first cell, mm.
    cell
        Side length of a cell, mm.
    floor
        Height of the floor, mm. If a cell is below the floor, the material was cut through.
    """

    heights: NDArray[np.float32]
    x: float
    y: float
    cell: float
    floor: float

    @classmethod
    def of_block(cls, block: StockBlock, cell: float) -> HeightField:
        """Convert a block to a height field. The last cell of a row or column may extend beyond the block.

        Raises PlanError if there would be more than `MOST_CELLS` cells.
        """
        columns, rows = (max(math.ceil((block.high[k] - block.low[k]) / cell - 1e-9), 1) for k in range(2))
        if columns * rows > MOST_CELLS:
            width, depth = (block.high[k] - block.low[k] for k in range(2))
            min_cell = math.sqrt(width * depth / MOST_CELLS)
            # If the sides are not multiples of the cell size, the last cell of each row and column counts too.
            while math.ceil(width / min_cell) * math.ceil(depth / min_cell) > MOST_CELLS:
                min_cell *= 1.01
            raise PlanError(
                "cells of {:g} mm: {:,} are needed, but the limit is {:,}; use cells of {:g} mm or a smaller stock",
                cell,
                columns * rows,
                MOST_CELLS,
                math.ceil(1000 * min_cell) / 1000,
            )
        heights = np.full((rows, columns), block.high[2], dtype=np.float32)
        return cls(heights, block.low[0] + 0.5 * cell, block.low[1] + 0.5 * cell, cell, block.low[2])

    def copy(self) -> HeightField:
        """Return an independent copy of the field."""
        return HeightField(self.heights.copy(), self.x, self.y, self.cell, self.floor)

    def contains(self, ends: Floats, margins: Floats) -> NDArray[np.bool_]:
        """Return a mask of the moves, float64[m, 6], that stay inside the field and keep a margin from its rim, mm."""
        half = 0.5 * self.cell
        inside = np.ones(len(ends), dtype=np.bool_)
        for axis, first, count in ((0, self.x, self.heights.shape[1]), (1, self.y, self.heights.shape[0])):
            low, high = first - half, first + (count - 1) * self.cell + half
            inside &= np.minimum(ends[:, axis], ends[:, axis + 3]) - margins >= low - 1e-9
            inside &= np.maximum(ends[:, axis], ends[:, axis + 3]) + margins <= high + 1e-9
        return inside

    def cells_between(self, low: tuple[float, float], high: tuple[float, float]) -> tuple[slice, slice]:
        """Return the rows and columns of all cells whose centre lies inside a rectangle, mm."""
        spans = []
        for start, first, last, size in zip((self.y, self.x), low[::-1], high[::-1], self.heights.shape, strict=True):
            edges = math.ceil((first - start) / self.cell), math.floor((last - start) / self.cell) + 1
            spans.append(slice(*(min(max(edge, 0), size) for edge in edges)))
        return spans[0], spans[1]

    def heights_around(self, x: float, y: float, radius: float) -> tuple[NDArray[np.float32], Floats]:
        """Return a view of the heights around a disc, and the distance from each cell to the centre of the disc, mm."""
        rows, columns = self.cells_between((x - radius, y - radius), (x + radius, y + radius))
        across = self.x + self.cell * np.arange(columns.start, columns.stop) - x
        up = self.y + self.cell * np.arange(rows.start, rows.stop) - y
        return self.heights[rows, columns], np.hypot(across[None, :], up[:, None])

    @property
    def volume(self) -> float:
        """Volume of the material, mm³."""
        # Sum row by row, because double precision for all cells would take twice the memory of the field.
        return sum(float(np.maximum(row.astype(np.float64) - self.floor, 0.0).sum()) for row in self.heights) * (
            self.cell**2
        )

    def height_at(self, x: float, y: float) -> float:
        """Return the height of the material at a position, mm. Outside the field, this is the height of the floor."""
        column, row = round((x - self.x) / self.cell), round((y - self.y) / self.cell)
        rows, columns = self.heights.shape
        return float(self.heights[row, column]) if 0 <= row < rows and 0 <= column < columns else self.floor


def default_cell_size(
    block: StockBlock,
    smallest: float,
    share: float = SHARE_OF_TOOL,
    cells: int = USUAL_CELLS,
    most_cells: int = MOST_CELLS,
) -> float:
    """Return the default cell size of a height field, mm, in steps of 0.01 mm.

    The size is a share of the smallest tool diameter. If this results in too many cells, the size grows up to a fifth
    of the diameter. It only grows further if the cells would not fit into memory.
    """
    area = (block.high[0] - block.low[0]) * (block.high[1] - block.low[1])
    preferred = max(share * smallest, math.sqrt(area / cells))
    coarsest = max(COARSEST * smallest, 1.01 * math.sqrt(area / most_cells))
    return math.ceil(max(min(preferred, coarsest), FINEST) / FINEST - 1e-9) * FINEST
