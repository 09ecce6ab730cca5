"""Heights of a mesh seen from above. For each cell, compute the maximum height of the triangles in it or around it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

#: If a cell's centre is outside a triangle by no more than this relative distance, it counts as on the edge.
_ON_EDGE = 1e-6


@inner_kernel
def _max_edge_height_in_box(
    x0: float, y0: float, z0: float, x1: float, y1: float, z1: float, left: float, right: float, low: float, high: float
) -> float:
    """Return the maximum height of an edge within a rectangle, or −∞ if the edge is outside (Liang–Barsky clipping)."""
    enter, leave = 0.0, 1.0
    for axis in range(2):
        start = x0 if axis == 0 else y0
        step = (x1 - x0) if axis == 0 else (y1 - y0)
        a = left if axis == 0 else low
        b = right if axis == 0 else high
        if step == 0.0:
            if start < a or start > b:
                return -math.inf
        else:
            t0, t1 = (a - start) / step, (b - start) / step
            if t0 > t1:
                t0, t1 = t1, t0
            enter, leave = max(enter, t0), min(leave, t1)
            if enter > leave:
                return -math.inf
    return max(z0 + enter * (z1 - z0), z0 + leave * (z1 - z0))


@kernel
def raise_cells_to_maximum(triangles: NDArray, x: float, y: float, cell: float, heights: NDArray) -> None:
    """Raise each cell to the maximum height of the triangles in it.

    Within a cell, a triangle is highest either at a cell corner that lies below the triangle or on an edge of the
    triangle. The function checks both cases, so the height is exact.

    ========= ================ ==================================================================
    triangles float64[n, 3, 3] vertices, mm
    x, y      float            lower left corner of the first cell, mm
    cell      float            side length of a cell, mm
    heights   float64[r, c]    heights row by row from the lowest y; −∞ where empty
    ========= ================ ==================================================================

    Changes: heights.
    """
    rows, columns = heights.shape
    for k in range(len(triangles)):
        ax, ay, az = triangles[k, 0, 0], triangles[k, 0, 1], triangles[k, 0, 2]
        bx, by, bz = triangles[k, 1, 0], triangles[k, 1, 1], triangles[k, 1, 2]
        cx, cy, cz = triangles[k, 2, 0], triangles[k, 2, 1], triangles[k, 2, 2]
        top = max(az, bz, cz)
        first_c = max(math.floor((min(ax, bx, cx) - x) / cell), 0)
        last_c = min(math.floor((max(ax, bx, cx) - x) / cell), columns - 1)
        first_r = max(math.floor((min(ay, by, cy) - y) / cell), 0)
        last_r = min(math.floor((max(ay, by, cy) - y) / cell), rows - 1)
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        for r in range(first_r, last_r + 1):
            low, high = y + r * cell, y + (r + 1) * cell
            for c in range(first_c, last_c + 1):
                if heights[r, c] >= top:
                    continue
                left, right = x + c * cell, x + (c + 1) * cell
                best = _max_edge_height_in_box(ax, ay, az, bx, by, bz, left, right, low, high)
                best = max(best, _max_edge_height_in_box(bx, by, bz, cx, cy, cz, left, right, low, high))
                best = max(best, _max_edge_height_in_box(cx, cy, cz, ax, ay, az, left, right, low, high))
                if area != 0.0:
                    for corner in range(4):
                        px = left if corner % 2 == 0 else right
                        py = low if corner < 2 else high
                        u = ((px - ax) * (cy - ay) - (cx - ax) * (py - ay)) / area
                        v = ((bx - ax) * (py - ay) - (px - ax) * (by - ay)) / area
                        if u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                            best = max(best, az + u * (bz - az) + v * (cz - az))
                heights[r, c] = max(heights[r, c], best)


@kernel
def dilate_heights(heights: NDArray, reach: NDArray, widest: NDArray) -> None:
    """Set each cell of `widest` to the maximum height of the cells within reach.

    ======= ============= ====================================================================
    heights float64[r, c] heights of the cells
    reach   int64[2d + 1] for rows −d to d: number of columns within reach on each side
    widest  float64[r, c] result
    ======= ============= ====================================================================

    Changes: widest.
    """
    rows, columns = heights.shape
    d = len(reach) // 2
    for r in range(rows):
        for c in range(columns):
            best = -math.inf
            for k in range(max(r - d, 0), min(r + d, rows - 1) + 1):
                half_width = reach[k - r + d]
                for j in range(max(c - half_width, 0), min(c + half_width, columns - 1) + 1):
                    best = max(best, heights[k, j])
            widest[r, c] = best


@kernel
def mesh_heights_at(triangles: NDArray, first: NDArray, x: NDArray, y: NDArray, top: NDArray, under: NDArray) -> None:
    """Find the maximum and minimum height of the triangles at the given points. Vertical triangles are ignored.

    ========= ================ =====================================================
    triangles float64[n, 3, 3] vertices, mm
    first     int64[n]         first point that is not to the left of a triangle
    x, y      float64[m]       points, mm, sorted by x
    top       float64[m]       maximum height; −∞ without a triangle
    under     float64[m]       minimum height; ∞ without a triangle
    ========= ================ =====================================================

    Changes: top, under.
    """
    for k in range(len(triangles)):
        ax, ay, az = triangles[k, 0, 0], triangles[k, 0, 1], triangles[k, 0, 2]
        bx, by, bz = triangles[k, 1, 0], triangles[k, 1, 1], triangles[k, 1, 2]
        cx, cy, cz = triangles[k, 2, 0], triangles[k, 2, 1], triangles[k, 2, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0:
            continue
        low, high = min(ay, by, cy), max(ay, by, cy)
        last = max(ax, bx, cx)
        for i in range(first[k], len(x)):
            if x[i] > last:
                break
            if y[i] < low or y[i] > high:
                continue
            u = ((x[i] - ax) * (cy - ay) - (cx - ax) * (y[i] - ay)) / area
            v = ((bx - ax) * (y[i] - ay) - (x[i] - ax) * (by - ay)) / area
            # Rounding must not leave a gap at a common edge of two triangles.
            if u >= -1e-9 and v >= -1e-9 and u + v <= 1.0 + 1e-9:
                z = az + u * (bz - az) + v * (cz - az)
                top[i] = max(top[i], z)
                under[i] = min(under[i], z)


def reach_in_cells(radius: float, cell: float) -> NDArray[np.int64]:
    """Convert a radius in mm to the argument `reach` of `dilate_heights`.

    The result covers all cells that have a point within the radius of any point of the central cell.
    """
    d = math.floor(radius / cell) + 1
    gap = np.maximum(np.abs(np.arange(-d, d + 1)) - 1, 0) * cell
    half_width = np.sqrt(np.maximum(radius**2 - gap**2, 0.0))
    reach: NDArray[np.int64] = np.floor(half_width / cell + 1e-12).astype(np.int64) + 1
    return reach


@kernel
def raise_cells_at_centres(heights: NDArray, x: float, y: float, cell: float, triangles: NDArray) -> int:
    """Raise each cell to the highest triangle above its centre. Return the number of triangles that are not vertical.

    heights    float32[rows, columns]  height of the material, mm
    x, y       centre of the first cell, mm
    cell       side length of a cell, mm
    triangles  float64[n, 3, 3]        vertices, mm; vertical triangles have no area seen from above

    Changes: heights.
    """
    n_used = 0
    for k in range(len(triangles)):
        ax, ay, az = triangles[k, 0, 0], triangles[k, 0, 1], triangles[k, 0, 2]
        bx, by, bz = triangles[k, 1, 0] - ax, triangles[k, 1, 1] - ay, triangles[k, 1, 2] - az
        cx, cy, cz = triangles[k, 2, 0] - ax, triangles[k, 2, 1] - ay, triangles[k, 2, 2] - az
        area = bx * cy - by * cx
        size = max(bx * bx + by * by, cx * cx + cy * cy)
        if abs(area) <= 1e-12 * size or size <= 0.0:
            continue
        n_used += 1
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
    return n_used
