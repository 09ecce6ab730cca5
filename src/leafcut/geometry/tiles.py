"""Large shapes split into small tiles, for fast distance queries.

The distance to a shape is the distance to its nearest tile, which an index of bounding boxes finds at once. A part with
a thousand holes costs no more than the few holes near the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.index import unique_pairs

#: Maximum number of points of a tile, unless too many lie at the same position.
MOST_POINTS = 64
#: Maximum number of halvings of a shape.
MAX_DEPTH = 24


class Tiles:
    """An index of shapes (shapely polygons or lines) in tiles.

    `shapes` are the tiles, `owner` int64[n] the shape of each tile.
    """

    def __init__(self, shapes: Sequence[Any]) -> None:
        tiles = [(tile, number) for number, shape in enumerate(shapes) for tile in _tiles(shape)]
        self.shapes = np.array([tile for tile, _ in tiles], dtype=object)
        self.owner: NDArray[np.int64] = np.array([number for _, number in tiles], dtype=np.int64)
        self._tree = shapely.STRtree(self.shapes)

    def near(self, points: Any, distance: float) -> NDArray[np.int64]:
        """Return pairs (point, shape) within `distance`, mm, int64[2, k], each once, sorted."""
        point, tile = self._tree.query(np.asarray(points, dtype=object), predicate="dwithin", distance=distance)
        return unique_pairs(point, self.owner[tile]).T


def _tiles(shape: Any) -> list[Any]:
    tiles, stack = [], [(shape, 0)]
    while stack:
        piece, depth = stack.pop()
        if shapely.get_num_coordinates(piece) <= MOST_POINTS or depth == MAX_DEPTH:
            tiles.append(piece)
            continue
        low_x, low_y, high_x, high_y = piece.bounds
        x, y = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
        across = high_x - low_x >= high_y - low_y
        first = shapely.box(low_x, low_y, x, high_y) if across else shapely.box(low_x, low_y, high_x, y)
        second = shapely.box(x, low_y, high_x, high_y) if across else shapely.box(low_x, y, high_x, high_y)
        halves = shapely.get_parts(shapely.intersection(piece, [first, second]))
        stack += [(part, depth + 1) for part in halves if not part.is_empty]
    return tiles
