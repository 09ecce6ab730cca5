"""Convert a triangle mesh to a height field of its upper surface."""

from __future__ import annotations

import numpy as np

from leafcut.errors import PlanError
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.model.mesh import Mesh

#: Maximum total number of cells below all triangles, which limits the run time to minutes.
_MAX_VISITS = 10_000_000_000
#: Maximum height of a triangle on the floor of a solid above the lowest point of the solid, mm.
_FLAT = 0.01


def bounding_block(mesh: Mesh) -> StockBlock:
    """Return the bounding box of a solid. Raises PlanError if it is flat."""
    low, high = mesh.low.tolist(), mesh.high.tolist()
    return StockBlock((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def mesh_to_height_field(mesh: Mesh, cell: float) -> HeightField:
    """Convert a solid to a height field with cells of side length `cell`, mm.

    A cell has the height of the solid at its centre, or the height of the floor outside the solid. The space below an
    overhang counts as material (`overhang_area`).

    Raises
    ------
    PlanError
        There would be too many cells, or too many triangles per cell.
    """
    field = HeightField.of_block(bounding_block(mesh), cell)
    field.heights[:] = field.floor
    raise_field_to_mesh(field, mesh)
    return field


def raise_field_to_mesh(field: HeightField, mesh: Mesh) -> None:
    """Raise each cell to the highest triangle above its centre. Raises PlanError if a cell has too many triangles."""
    from leafcut.kernels.surface import raise_cells_at_centres

    cell = field.cell
    size = np.ptp(mesh.triangles[:, :, :2], axis=1) / cell + 1.0
    n_visits = float(size.prod(axis=1).sum())
    if n_visits > _MAX_VISITS:
        raise PlanError(
            "{}: {:,.0f} triangles cover each cell on average; export a coarser mesh, or use larger cells",
            mesh.name,
            n_visits / field.heights.size,
        )
    raise_cells_at_centres(field.heights, field.x, field.y, cell, mesh.triangles)


def overhang_area(mesh: Mesh) -> float:
    """Return the downward-facing area of a solid above its floor, mm².

    A height field treats the space below this area as material.
    """
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    cross = np.cross(b - a, c - a)
    signed_volume = float((a * cross).sum())  # six times the volume, negative for inverted triangles
    faces_down = cross[:, 2] * (1.0 if signed_volume >= 0 else -1.0) < 0
    above = mesh.triangles[:, :, 2].max(axis=1) > float(mesh.low[2]) + _FLAT
    return 0.5 * float(np.abs(cross[faces_down & above, 2]).sum())
