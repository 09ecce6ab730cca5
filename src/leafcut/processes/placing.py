"""A drawing mirrored, turned and moved before it is planned, so that all that follows is made for where it lies.

The order is fixed: it is mirrored, then rotated, both about the zero of the drawing, and last the origin is set. A
mirrored board is the board seen from its back, and drilled, cut or milled from there. As nothing is planned before, the
side of leads and of the kerf, climb milling and the directions of arcs are as for any drawing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.polyline import Polyline
from leafcut.model.mesh import Mesh
from leafcut.model.part import Part
from leafcut.options import ORIGINS, ReadOptions, SheetOptions
from leafcut.processes.layers import kinds_of

#: x and y of a turn by so many quarters, without the rounding of sines.
_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
#: An angle this near to a quarter is one, rad.
_SAME_ANGLE = 1e-9


def placed(part: Part, options: ReadOptions, counted: Sequence[bool] | None = None) -> Part:
    """Return a part as `options.mirror`, `rotate` and `origin` place it.

    Parameters
    ----------
    counted
        Which of its contours count for its corners; None for all.
    """
    turned = part
    matrix = _matrix(options)
    if not np.array_equal(matrix, np.eye(2)):
        turned = _moved(part, matrix, (0.0, 0.0))
    if options.origin is None:
        return turned
    there = turned
    if counted is not None:
        there = replace(turned, contours=tuple(c for c, yes in zip(turned.contours, counted, strict=True) if yes))
    x, y = _zero(options.origin, there.extents)
    return _moved(turned, np.eye(2), (-x, -y))


def placed_mesh(mesh: Mesh, part: Part, options: ReadOptions) -> Mesh:
    """Return a mesh as `placed` places the part that it is the surface of; `part` is as it was read."""
    matrix = _matrix(options)
    by = (0.0, 0.0)
    if options.origin is not None:
        x, y = _zero(options.origin, _moved(part, matrix, (0.0, 0.0)).extents)
        by = (-x, -y)
    triangles = mesh.triangles.copy()
    triangles[:, :, :2] = triangles[:, :, :2] @ matrix.T + by
    return replace(mesh, triangles=triangles)


def placed_sheet(part: Part, options: ReadOptions, sheet: SheetOptions) -> Part:
    """Return the drawing of a sheet as it is placed: contours that are left out do not say where its corners are."""
    counted = [kind != "" for kind in kinds_of(part.contours, sheet, [])] if options.origin is not None else None
    return placed(part, options, counted)


def _matrix(options: ReadOptions) -> NDArray[np.float64]:
    """Return float64[2, 2]: the mirror, then the turn."""
    mirror = np.diag([-1.0 if options.mirror == "x" else 1.0, -1.0 if options.mirror == "y" else 1.0])
    quarters = round(options.rotate / (0.5 * math.pi))
    c, s = math.cos(options.rotate), math.sin(options.rotate)
    if abs(options.rotate - quarters * 0.5 * math.pi) < _SAME_ANGLE:
        c, s = _QUARTERS[quarters % 4]
    return np.array([[c, -s], [s, c]]) @ mirror


def _zero(origin: str | tuple[float, ...], box: tuple[float, float, float, float]) -> tuple[float, float]:
    """Return the place that becomes zero."""
    if not isinstance(origin, str):
        return origin[0], origin[1]
    across, up = ORIGINS[origin]
    return box[0] + across * (box[2] - box[0]), box[1] + up * (box[3] - box[1])


def _moved(part: Part, matrix: NDArray[np.float64], by: tuple[float, float]) -> Part:
    """Return a part with every place p at matrix · p + by."""
    (a, b), (c, d) = matrix.tolist()

    def at(x: float, y: float) -> tuple[float, float]:
        return a * x + b * y + by[0], c * x + d * y + by[1]

    def along(path: Polyline) -> Polyline:
        x, y, bulge = path.vertices.T
        # In a mirror an arc runs the other way round.
        turn = 1.0 if a * d - b * c > 0.0 else -1.0
        return Polyline(np.column_stack([*at(x, y), turn * bulge]), path.closed)

    def around(path: Polyline, clockwise: bool) -> Polyline:
        there = along(path)
        return there.reversed() if (there.area < 0.0) != clockwise else there

    return replace(
        part,
        holes=tuple(replace(h, x=x, y=y) for h in part.holes for x, y in [at(h.x, h.y)]),
        slots=tuple(replace(s, start=at(*s.start), end=at(*s.end)) for s in part.slots),
        contours=tuple(replace(one, path=along(one.path)) for one in part.contours),
        edge=tuple(replace(one, path=along(one.path)) for one in part.edge),
        pockets=tuple(
            replace(p, outline=around(p.outline, False), islands=tuple(around(i, True) for i in p.islands))
            for p in part.pockets
        ),
    )
