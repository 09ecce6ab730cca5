"""Meshes made by hand: boxes, and their files."""

from __future__ import annotations

import numpy as np


def box_triangles(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> np.ndarray:
    """Return the twelve triangles of a box."""
    c = np.array([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)], dtype=np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return c[[(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)]]


def binary_stl(triangles: np.ndarray) -> bytes:
    """Return triangles as a binary STL file."""
    rows = np.zeros(len(triangles), dtype=[("n", "<f4", 3), ("corners", "<f4", (3, 3)), ("a", "<u2")])
    rows["corners"] = triangles
    return b"made by hand".ljust(80) + len(triangles).to_bytes(4, "little") + rows.tobytes()
