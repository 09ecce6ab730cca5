"""Place a drawing on the machine before planning: mirror it, rotate it about its zero, and set the origin.

Because this happens before planning, leads, kerf side, climb milling and arc directions need no correction. This is the
only module that sets the zero of a program.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.part import TURNS, Part, ProgramZero
from leafcut.options import ORIGINS, ReadOptions

if TYPE_CHECKING:
    from leafcut.model.mesh import Mesh

#: Cosine and sine of multiples of 90°, as exact numbers.
_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
#: Maximum distance between the machine zero and the start of the table's travel, mm. Many tables leave a margin for
#: leads.
TABLE_START = 20.0
#: Positions closer than this count as equal, mm.
_SAME_PLACE = 0.01
#: Tolerance for multiples of 90°, rad.
_SAME_ANGLE = 1e-9


def place_part(part: Part, options: ReadOptions) -> Part:
    """Mirror, rotate and move a part according to the options, and record the program zero."""
    matrix = _mirror_and_rotate_matrix(options)
    x, y = _origin(part, matrix, options)
    # The transpose of the matrix is its inverse: the zero in the original drawing.
    zero_in_drawing = (matrix.T @ (x, y)).tolist()
    zero = replace(
        part.zero or ProgramZero(), place=_zero_point_name(part, options), x=zero_in_drawing[0], y=zero_in_drawing[1]
    )
    moved = part
    if (x, y) != (0.0, 0.0) or not np.array_equal(matrix, np.eye(2)):
        moved = _transform_part(part, matrix, (-x, -y))
    return replace(moved, reference=None, zero=zero)


def shift_part(part: Part, offset: Point) -> Part:
    """Move everything in a part by an offset, mm. The program zero keeps its position."""
    return _transform_part(part, np.eye(2), offset)


def place_mesh(mesh: Mesh, part: Part, options: ReadOptions) -> Mesh:
    """Place the mesh of a part's surface in the same way as the part. `part` is the part before placing."""
    matrix = _mirror_and_rotate_matrix(options)
    x, y = _origin(part, matrix, options)
    triangles = mesh.triangles.copy()
    triangles[:, :, :2] = triangles[:, :, :2] @ matrix.T - (x, y)
    return replace(mesh, triangles=triangles)


def turn_mesh_like_part(mesh: Mesh, part: Part) -> Mesh:
    """Rotate and shift a mesh in the same way as the solid of a part.

    If the part comes from a drawing, the mesh does not change.
    """
    return mesh if part.zero is None or not part.zero.up else turn_mesh_up(mesh, part.zero.up, part.zero.z)


def turn_mesh_up(mesh: Mesh, up: str, z: float) -> Mesh:
    """Rotate a mesh until the direction `up` (a key of `model.part.TURNS`) points up, and then lower it by `z` mm."""
    return replace(mesh, triangles=mesh.triangles @ np.array(TURNS[up]).T - (0.0, 0.0, z))


def placement_text(file: str, part: Part, options: ReadOptions) -> str:
    """Describe where a part is placed, for the header of the program. The text starts with the file name.

    Example: ``plate.step, -x up, Z0 at Z12.5 mm, zero at X10 Y20 mm, mirrored x, turned 90 deg``. Here, the -x
    direction of the solid points up, and Z12.5 of the solid becomes Z0. After mirroring and rotation, X10 Y20 becomes
    X0 Y0.
    """
    texts = [Path(file).name]
    if part.zero is not None and part.zero.up:
        texts += [f"{part.zero.up} up"] if part.zero.up != "z" else []
        texts += [f"Z0 at Z{_length_text(part.zero.z)} mm"] if part.zero.z else []
    if options.origin is not None:
        x, y = _origin(part, _mirror_and_rotate_matrix(options), options)
        texts.append(f"zero at X{_length_text(x)} Y{_length_text(y)} mm")
    if options.mirror:
        texts.append(f"mirrored {options.mirror}")
    if options.rotate:
        texts.append(f"turned {math.degrees(options.rotate):.6g} deg")
    return ", ".join(texts)


def negative_axes(box: tuple[float, float, float, float], machine: Machine) -> str:
    """Return the axes with negative coordinates: "X", "Y", "X and Y", or "". With a known work offset, return "".

    An axis counts if all its coordinates are negative. If the travel of the axis starts at machine zero, a single
    negative coordinate is enough. `box` has the smallest x and y and the largest x and y of the work, mm.
    """
    if machine.work_offset is not None:
        return ""
    axes = []
    for k, name in enumerate("XY"):
        low, high, start = box[k], box[k + 2], machine.travel_min[k]
        is_table = abs(start) <= TABLE_START
        if low < (min(start, 0.0) if is_table else 0.0) - _SAME_PLACE and (is_table or high <= _SAME_PLACE):
            axes.append(name)
    return " and ".join(axes)


def _length_text(length: float) -> str:
    return f"{length + 0.0:.6f}".rstrip("0").rstrip(".")


def _mirror_and_rotate_matrix(options: ReadOptions) -> NDArray[np.float64]:
    """Return a matrix that first mirrors a point and then rotates it, float64[2, 2]."""
    mirror = np.diag([-1.0 if options.mirror == "x" else 1.0, -1.0 if options.mirror == "y" else 1.0])
    quarters = round(options.rotate / (0.5 * math.pi))
    c, s = math.cos(options.rotate), math.sin(options.rotate)
    if abs(options.rotate - quarters * 0.5 * math.pi) < _SAME_ANGLE:
        c, s = _QUARTERS[quarters % 4]
    return np.array([[c, -s], [s, c]]) @ mirror


def _origin(part: Part, matrix: NDArray[np.float64], options: ReadOptions) -> tuple[float, float]:
    if options.origin is None:
        return 0.0, 0.0
    if not isinstance(options.origin, str):
        return options.origin[0], options.origin[1]
    across, up = ORIGINS[options.origin]
    box = _transform_part(part.reference or part, matrix, (0.0, 0.0)).extents
    return box[0] + across * (box[2] - box[0]), box[1] + up * (box[3] - box[1])


def _zero_point_name(part: Part, options: ReadOptions) -> str:
    """Return a name for the point that becomes the zero, such as "lower left corner of the part".

    If the user gave the point as coordinates, the name is empty.
    """
    if not isinstance(options.origin, str):
        return ""
    name = options.origin if options.origin == "centre" else f"{options.origin.replace('-', ' ')} corner"
    reference = part.reference
    if reference is None:
        return f"{name} of the {'pockets' if part.pockets else 'hole centres'}"
    paths = [c.path for c in reference.contours]
    outline = any(path.closed and path.extents == reference.extents for path in paths)
    return f"{name} of the {'part' if outline else 'geometry'}"


def _transform_part(part: Part, matrix: NDArray[np.float64], offset: Point) -> Part:
    """Transform every point p of a part to matrix · p + offset."""
    (a, b), (c, d) = matrix.tolist()

    def transform(x: float, y: float) -> tuple[float, float]:
        return a * x + b * y + offset[0], c * x + d * y + offset[1]

    def move_path(path: Polyline) -> Polyline:
        x, y, bulge = path.vertices.T
        # Mirroring reverses the direction of arcs.
        turn = 1.0 if a * d - b * c > 0.0 else -1.0
        return Polyline(np.column_stack([*transform(x, y), turn * bulge]), path.closed)

    def orient(path: Polyline, clockwise: bool) -> Polyline:
        moved_path = move_path(path)
        return moved_path.reversed() if (moved_path.area < 0.0) != clockwise else moved_path

    def moved(issue: Issue) -> Issue:
        missing = issue.missing
        if missing is None:
            return issue
        points, outlines = (
            tuple(transform(*point) for point in missing.where),
            tuple(move_path(path) for path in missing.outlines),
        )
        return replace(issue, missing=replace(missing, where=points, outlines=outlines))

    return replace(
        part,
        issues=tuple(moved(issue) for issue in part.issues),
        besides=tuple(moved(issue) for issue in part.besides),
        openings=tuple(replace(opening, outline=move_path(opening.outline)) for opening in part.openings),
        holes=tuple(replace(h, x=x, y=y) for h in part.holes for x, y in [transform(h.x, h.y)]),
        slots=tuple(replace(s, start=transform(*s.start), end=transform(*s.end)) for s in part.slots),
        contours=tuple(replace(contour, path=move_path(contour.path)) for contour in part.contours),
        edge=tuple(replace(contour, path=move_path(contour.path)) for contour in part.edge),
        pockets=tuple(
            replace(p, outline=orient(p.outline, False), islands=tuple(orient(i, True) for i in p.islands))
            for p in part.pockets
        ),
    )
