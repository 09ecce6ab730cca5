"""Triangles seen from above: each raises the cells under it to where it lies."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import kernel

#: A cell's middle this far outside of a triangle, as a part of it, lies on its edge.
_ON_EDGE = 1e-6


@kernel
def raise_cell_middles(heights: NDArray, x: float, y: float, cell: float, triangles: NDArray) -> int:
    """Raise every cell to the highest triangle over its middle; return how many triangles were seen.

    heights    float32[rows, columns]  height of the material, mm
    x, y       the middle of the first cell, mm
    cell       its side, mm
    triangles  float64[n, 3, 3]        corners, mm; what stands upright has no place seen from above

    Changes: heights.
    """
    seen = 0
    for k in range(len(triangles)):
        ax, ay, az = triangles[k, 0, 0], triangles[k, 0, 1], triangles[k, 0, 2]
        bx, by, bz = triangles[k, 1, 0] - ax, triangles[k, 1, 1] - ay, triangles[k, 1, 2] - az
        cx, cy, cz = triangles[k, 2, 0] - ax, triangles[k, 2, 1] - ay, triangles[k, 2, 2] - az
        area = bx * cy - by * cx
        size = max(bx * bx + by * by, cx * cx + cy * cy)
        if abs(area) <= 1e-12 * size or size <= 0.0:
            continue
        seen += 1
        low_z, high_z = az + min(0.0, bz, cz), az + max(0.0, bz, cz)
        first = max(0, math.ceil((ay + min(0.0, by, cy) - y) / cell - _ON_EDGE))
        last = min(heights.shape[0] - 1, math.floor((ay + max(0.0, by, cy) - y) / cell + _ON_EDGE))
        left = max(0, math.ceil((ax + min(0.0, bx, cx) - x) / cell - _ON_EDGE))
        right = min(heights.shape[1] - 1, math.floor((ax + max(0.0, bx, cx) - x) / cell + _ON_EDGE))
        for row in range(first, last + 1):
            py = y + row * cell - ay
            for column in range(left, right + 1):
                px = x + column * cell - ax
                v, w = (px * cy - py * cx) / area, (bx * py - by * px) / area
                if v < -_ON_EDGE or w < -_ON_EDGE or v + w > 1.0 + _ON_EDGE:
                    continue
                z = min(max(az + v * bz + w * cz, low_z), high_z)
                heights[row, column] = max(heights[row, column], z)
    return seen
