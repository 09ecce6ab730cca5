"""Convert DXF entities that can become holes (circles, arcs, bulged polylines, points), and transform blocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from leafcut.message import Message

Vector3 = tuple[float, float, float]

#: Transformation from a block to model space: the images of the x, y and z axes, and the origin.
Matrix = tuple[Vector3, Vector3, Vector3, Vector3]
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))

#: Relative difference of the half axes of a circle: 0.01 mm on a hole of 10 mm.
ROUND = 1e-3
#: Largest tilt of a circle out of the plane, relative to its radius; drawings keep normals to 6 digits or more.
FLAT = 1e-4


class Curve(NamedTuple):
    """The curve centre + u·cos(t) + v·sin(t), in drawing units.

    The parameter t runs from `start` over the angle `sweep`. A point has a sweep of 0.
    """

    center: Vector3
    u: Vector3
    v: Vector3
    start: float = 0.0
    sweep: float = math.tau


class Shape(NamedTuple):
    """An entity that may be a hole or a part of a hole. It can be a point, a circle, or a series of arcs."""

    dxftype: str
    curves: tuple[Curve, ...]
    layer: str
    handle: str
    arcs: bool


def entity_to_hole_shape(entity: Any) -> Shape | None:
    """Convert an entity to a shape, or return None if the entity can never be a hole.

    Raises
    ------
    ValueError
        The entity lacks a required coordinate or radius.
    """
    kind = entity.dxftype()
    maker = _MAKERS.get(kind)
    curves = maker(entity) if maker else ()
    if not curves:
        return None
    arcs = kind != "POINT" and not (len(curves) == 1 and curves[0].sweep == math.tau)
    return Shape(kind, curves, entity.dxf.get("layer", "0"), entity.dxf.get("handle") or "", arcs)


def require_values(entity: Any, *names: str) -> None:
    """Raise ValueError if an entity lacks a required value."""
    # ezdxf replaces missing values with defaults (the origin, radius 1). This would create a hole that is not drawn.
    if missing := [name for name in names if not entity.dxf.hasattr(name)]:
        raise ValueError(Message("no {}", missing[0]))


def _point_curve(entity: Any) -> tuple[Curve, ...]:
    require_values(entity, "location")
    return (Curve(entity.dxf.location.xyz, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0),)


def circle_in_plane(ocs: Any, center: Vector3, radius: float, start: float = 0.0, sweep: float = math.tau) -> Curve:
    """Return a circle or an arc in the plane of an object coordinate system (OCS), in layout coordinates."""
    return Curve(ocs.to_wcs(center).xyz, (ocs.ux * radius).xyz, (ocs.uy * radius).xyz, start, sweep)


def circle_curve(entity: Any) -> tuple[Curve, ...]:
    """Return the full circle of a CIRCLE or ARC."""
    require_values(entity, "center", "radius")
    radius = entity.dxf.radius
    if not radius > 0:
        raise ValueError(Message("invalid radius {:g}", radius))
    return (circle_in_plane(entity.ocs(), entity.dxf.center.xyz, radius),)


def arc_curve(entity: Any) -> tuple[Curve, ...]:
    """Return the arc of an ARC."""
    require_values(entity, "start_angle", "end_angle")
    circle = circle_curve(entity)[0]
    start, end = entity.dxf.start_angle, entity.dxf.end_angle
    return (circle._replace(start=math.radians(start), sweep=_arc_sweep(math.radians(end - start))),)


def _arc_sweep(angle: float) -> float:
    """Return the sweep of an arc. An arc from 0° to 360° is a full turn, and an arc from 0° to 0° is empty."""
    if abs(abs(angle) - math.tau) < 1e-9:
        return math.tau
    return angle % math.tau


def ellipse_curve(entity: Any) -> tuple[Curve, ...]:
    """Return the curve of an ELLIPSE, full or partial."""
    require_values(entity, "center", "major_axis", "ratio")
    major, ratio = entity.dxf.major_axis, entity.dxf.ratio
    minor = entity.dxf.extrusion.normalize().cross(major) * ratio
    start, end = entity.dxf.get("start_param", 0.0), entity.dxf.get("end_param", math.tau)
    return (Curve(entity.dxf.center.xyz, major.xyz, minor.xyz, start, _arc_sweep(end - start)),)


def _circular_ellipse_curve(entity: Any) -> tuple[Curve, ...]:
    curves = ellipse_curve(entity)
    if abs(entity.dxf.ratio) < 1 - ROUND and curves[0].sweep != math.tau:
        return ()  # an elliptical arc, not a circular one
    return curves


def polyline_vertices(entity: Any) -> tuple[Sequence[tuple[float, float, float]], bool, float]:
    """Return the geometry of an LWPOLYLINE or a 2D POLYLINE.

    Returns
    -------
    sequence of tuple
        The vertices (x, y, bulge).
    bool
        Whether the polyline is closed.
    float
        The height of the polyline.
    """
    if entity.dxftype() == "LWPOLYLINE":
        vertices = [(float(x), float(y), float(bulge)) for x, y, bulge in entity.get_points("xyb")]
        return vertices, entity.closed, entity.dxf.get("elevation", 0.0)
    elevation = entity.dxf.elevation.z if entity.dxf.hasattr("elevation") else 0.0
    vertices = [
        (v.dxf.location.x, v.dxf.location.y, v.dxf.get("bulge", 0.0)) for v in vertices_without_control_points(entity)
    ]
    return vertices, entity.is_closed, elevation


def vertices_without_control_points(entity: Any) -> list[Any]:
    """Return the vertices that lie on a POLYLINE.

    The control points of spline and curve frames (bit 16 of the flags) are left out.
    """
    return [v for v in entity.vertices if not v.dxf.get("flags", 0) & 16]


def _polyline_arcs(entity: Any) -> tuple[Curve, ...]:
    """Return the arcs of a polyline that consists only of arcs.

    Return no arcs for other polylines, because rounded corners are not holes.
    """
    if entity.dxftype() == "POLYLINE" and not entity.is_2d_polyline:
        return ()
    vertices, closed, elevation = polyline_vertices(entity)
    if all(v[2] == 0.0 for v in vertices):
        return ()
    ocs = entity.ocs()
    ends = [*vertices[1:], vertices[0]] if closed else vertices[1:]
    curves = []
    for (x0, y0, bulge), (x1, y1, _) in zip(vertices, ends, strict=False):
        if (x0, y0) == (x1, y1):
            continue
        arc = bulge_arc(x0, y0, x1, y1, bulge)
        if arc is None:
            return ()
        x, y, radius, start, sweep = arc
        curves.append(circle_in_plane(ocs, (x, y, elevation), radius, start, sweep))
    return tuple(curves)


_MAKERS = {
    "POINT": _point_curve,
    "CIRCLE": circle_curve,
    "ARC": arc_curve,
    "ELLIPSE": _circular_ellipse_curve,
    "LWPOLYLINE": _polyline_arcs,
    "POLYLINE": _polyline_arcs,
}


def transform_direction(matrix: Matrix, vector: Vector3) -> Vector3:
    """Transform a direction from a block to the coordinates of its parent."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz), _ = matrix
    x, y, z = vector
    return (x * ax + y * bx + z * cx, x * ay + y * by + z * cy, x * az + y * bz + z * cz)


def transform_point(matrix: Matrix, point: Vector3) -> Vector3:
    """Transform a point from a block to the coordinates of its parent."""
    x, y, z = transform_direction(matrix, point)
    ox, oy, oz = matrix[3]
    return (x + ox, y + oy, z + oz)


def combine_transforms(outer: Matrix, inner: Matrix) -> Matrix:
    """Return the matrix that applies `inner` first, then `outer`."""
    return (
        transform_direction(outer, inner[0]),
        transform_direction(outer, inner[1]),
        transform_direction(outer, inner[2]),
        transform_point(outer, inner[3]),
    )


def transform_curve(matrix: Matrix, curve: Curve) -> Curve:
    """Transform a curve from a block to the coordinates of its parent."""
    if matrix is IDENTITY:
        return curve
    return Curve(
        transform_point(matrix, curve.center),
        transform_direction(matrix, curve.u),
        transform_direction(matrix, curve.v),
        curve.start,
        curve.sweep,
    )


def is_parallel_to_plate(curve: Curve) -> bool:
    """Return whether the curve is parallel to the plane of the plate."""
    ux, uy, uz = curve.u
    vx, vy, vz = curve.v
    return abs(uz) <= FLAT * math.hypot(ux, uy) and abs(vz) <= FLAT * math.hypot(vx, vy)


def half_axes(curve: Curve) -> tuple[float, float]:
    """Return the major and the minor semi-axis of the curve in top view. They are the singular values of (u v)."""
    (ux, uy, _), (vx, vy, _) = curve.u, curve.v
    even, odd = math.hypot(ux + vy, uy - vx) / 2, math.hypot(ux - vy, uy + vx) / 2
    return even + odd, abs(even - odd)


def arc_span_in_top_view(curve: Curve) -> tuple[float, float]:
    """Return the start and the sweep of a circular arc in top view.

    The arc runs counter-clockwise, even if a block mirrors it.
    """
    (ux, uy, _), (vx, vy, _) = curve.u, curve.v
    mirrored = ux * vy - uy * vx < 0
    first = curve.start + curve.sweep if mirrored else curve.start
    cos, sin = math.cos(first), math.sin(first)
    return math.atan2(uy * cos + vy * sin, ux * cos + vx * sin), curve.sweep


def bulge_arc(
    x0: float, y0: float, x1: float, y1: float, bulge: float
) -> tuple[float, float, float, float, float] | None:
    """Convert a bulged segment to a counter-clockwise arc: (centre x, centre y, radius, start angle, sweep).

    The bulge is the tangent of a quarter of the arc's angle, and is positive for counter-clockwise arcs (DXF reference,
    LWPOLYLINE, group code 42). Return None if the segment has no length or no bulge.
    """
    dx, dy = x1 - x0, y1 - y0
    chord = math.hypot(dx, dy)
    if chord == 0.0 or bulge == 0.0:
        return None
    offset = (1.0 - bulge * bulge) / (4.0 * bulge)
    cx, cy = 0.5 * (x0 + x1) - offset * dy, 0.5 * (y0 + y1) + offset * dx
    radius = chord * (1.0 + bulge * bulge) / (4.0 * abs(bulge))
    sweep = 4.0 * math.atan(abs(bulge))
    first = (x0, y0) if bulge > 0 else (x1, y1)
    return cx, cy, radius, math.atan2(first[1] - cy, first[0] - cx), sweep
