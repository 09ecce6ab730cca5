"""Convert DXF entities that can be cut: lines, arcs, polylines, ellipses and splines.

The module also places the entities in blocks.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from leafcut.errors import PlanError, count_of, printable
from leafcut.geometry.arrays import Floats
from leafcut.geometry.curves import (
    MAX_DEGREE,
    Spend,
    accept_any_point_count,
    ellipse_path,
    fit_arcs_to_curve,
    spline_points,
)
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message, map_text
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork
from leafcut.read.dxf_shapes import (
    IDENTITY,
    Curve,
    Matrix,
    Vector3,
    arc_curve,
    circle_curve,
    ellipse_curve,
    half_axes,
    is_parallel_to_plate,
    polyline_vertices,
    require_values,
    transform_curve,
    vertices_without_control_points,
)
from leafcut.read.format import (
    CURVE_TOLERANCE,
    MAX_COORDINATE,
    MAX_SEGMENTS,
    OUT_OF_RANGE,
    first_positions_text,
    skipped_entities_issue,
    too_many_segments_error,
)

#: Application name of the extended data (XDATA) that hold the name of a part.
APPLICATION = "LEAFCUT"
#: A block scales uniformly if the axis lengths of a plane differ by less than this fraction.
ROUND_SHARE = 1e-6
#: Maximum slope of a line that still counts as lying in the plane.
SLOPE = 1e-3
#: For a spline without control points, ezdxf solves a full matrix of all fit points: 0.3 GB for 3,000 points.
MAX_FIT_POINTS = 3_000


class DxfPolyline(NamedTuple):
    """A line or polyline.

    It consists of vertices, float64[n, 3], bulges, float64[n], and the axes of the plane that contains its arcs.
    """

    vertices: Floats
    bulges: Floats
    closed: bool
    ux: Vector3
    uy: Vector3


class Freeform(NamedTuple):
    """A B-spline with its control points, float64[n, 3]."""

    control: Floats
    degree: int
    knots: Floats
    weights: Floats | None


class Letters(NamedTuple):
    """A text, stored as strokes. The strokes are open lines."""

    strokes: tuple[DxfStroke, ...]


class DxfStroke(NamedTuple):
    """An entity that can be cut, in the coordinates of its layout or block."""

    dxftype: str
    form: DxfPolyline | Curve | Freeform | Letters
    layer: str
    handle: str
    name: str = ""
    kind: str = "cut"


class NotInPlaneError(ValueError):
    """An entity lies outside the plane of the sheet."""


def entity_to_stroke(entity: Any) -> DxfStroke | None:
    """Convert an ezdxf entity to a stroke, or return None if the entity is never cut.

    Raises
    ------
    ValueError
        The entity lacks a required coordinate.
    """
    kind = entity.dxftype()
    maker = _MAKERS.get(kind)
    form = maker(entity) if maker else None
    if form is None:
        return None
    return DxfStroke(kind, form, entity.dxf.get("layer", "0"), entity.dxf.get("handle") or "", *_read_nest_data(entity))


def _read_nest_data(entity: Any) -> tuple[str, str]:
    """Read the nest data in the XDATA of an outline.

    Returns
    -------
    str
        The name that the nest stored, or "" if the outline has none.
    str
        The kind of outline: ``sheet`` or ``cut``.
    """
    texts = [str(tag.value) for tag in entity.get_xdata(APPLICATION)] if entity.has_xdata(APPLICATION) else []
    name, kind = [*texts[:2], "", ""][:2]
    return name, "sheet" if kind == "sheet" else "cut"


def _line_stroke(entity: Any) -> DxfPolyline:
    require_values(entity, "start", "end")
    return straight_polyline(np.array([entity.dxf.start.xyz, entity.dxf.end.xyz]), closed=False)


def straight_polyline(vertices: Floats, closed: bool) -> DxfPolyline:
    """Create straight lines through points, float64[n, 3]."""
    return DxfPolyline(vertices, np.zeros(len(vertices)), closed, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def _polyline_stroke(entity: Any) -> DxfPolyline | None:
    if entity.dxftype() == "POLYLINE" and not entity.is_2d_polyline:
        if not entity.is_3d_polyline:
            return None  # a mesh
        points = [v.dxf.location.xyz for v in vertices_without_control_points(entity)]
        return straight_polyline(np.array(points).reshape(-1, 3), entity.is_closed) if points else None
    vertices, closed, elevation = polyline_vertices(entity)
    if not vertices:
        return None
    ocs = entity.ocs()
    corners = np.array([ocs.to_wcs((x, y, elevation)).xyz for x, y, _ in vertices])
    return DxfPolyline(corners, np.array([bulge for *_, bulge in vertices]), closed, ocs.ux.xyz, ocs.uy.xyz)


def _spline_stroke(entity: Any) -> Freeform:
    if not entity.control_point_count() and entity.fit_point_count() > MAX_FIT_POINTS:
        raise ValueError(Message("more than {:,} fit points and no control points", MAX_FIT_POINTS))
    tool = entity.construction_tool()
    control = np.array([p.xyz for p in tool.control_points], dtype=np.float64)
    if tool.degree > MAX_DEGREE:
        raise ValueError(Message("invalid degree {}", tool.degree))
    weights = np.array(tool.weights(), dtype=np.float64)
    return Freeform(control, tool.degree, np.array(tool.knots(), dtype=np.float64), weights if len(weights) else None)


_MAKERS: dict[str, Any] = {
    "LINE": _line_stroke,
    "CIRCLE": lambda entity: circle_curve(entity)[0],
    "ARC": lambda entity: arc_curve(entity)[0],
    "ELLIPSE": lambda entity: ellipse_curve(entity)[0],
    "LWPOLYLINE": _polyline_stroke,
    "POLYLINE": _polyline_stroke,
    "SPLINE": _spline_stroke,
}


def place_stroke(
    stroke: DxfStroke, matrix: Matrix, factor: float, tolerance: float, spend: Spend = accept_any_point_count
) -> Polyline:
    """Transform a stroke to model space and project it to the top view, in mm.

    Curves become arcs that deviate by at most `tolerance` mm.

    Raises
    ------
    NotInPlaneError
        An arc does not lie in the plane of the sheet.
    PlanError, ValueError
        The numbers of the entity do not define a curve.
    """
    form = stroke.form
    if isinstance(form, Curve):
        return _transform_curve(transform_curve(matrix, form), factor, tolerance, spend)
    if isinstance(form, DxfPolyline):
        return _transform_polyline(form, matrix, factor, tolerance, spend)
    assert isinstance(form, Freeform)  # texts are placed stroke by stroke
    control = _transform_vertices(form.control, matrix)[:, :2] * factor
    points = spline_points(control, form.degree, form.knots, form.weights, 0.25 * tolerance)
    ends_meet = float(np.abs(points[0] - points[-1]).max()) <= 1e-9 * float(np.abs(points).max() + 1.0)
    return fit_arcs_to_curve(points, tolerance, ends_meet, spend)


def is_sloped(stroke: DxfStroke, matrix: Matrix) -> bool:
    """Return whether a line or polyline rises out of the plane of the sheet."""
    if not isinstance(stroke.form, DxfPolyline):
        return False
    if matrix is IDENTITY and len(set(stroke.form.vertices[:, 2].tolist())) == 1:
        return False
    points = _transform_vertices(stroke.form.vertices, matrix)
    high = float(points[:, 2].max() - points[:, 2].min())
    return high > 1e-9 and high > SLOPE * float(np.hypot(*np.ptp(points[:, :2], axis=0)))


def stroke_height(stroke: DxfStroke, matrix: Matrix) -> float:
    """Return the height of a stroke's first point, in drawing units."""
    form = stroke.form
    if isinstance(form, Curve):
        return float(transform_curve(matrix, form).center[2])
    assert not isinstance(form, Letters)
    points = form.vertices if isinstance(form, DxfPolyline) else form.control
    return float(points[0, 2] if matrix is IDENTITY else _transform_vertices(points[:1], matrix)[0, 2]) + 0.0


def _transform_vertices(vertices: Floats, matrix: Matrix) -> Floats:
    if matrix is IDENTITY:
        return vertices + 0.0
    table = np.array(matrix)
    points: Floats = vertices @ table[:3] + table[3]
    return points


def _transform_polyline(
    polyline: DxfPolyline, matrix: Matrix, factor: float, tolerance: float, spend: Spend
) -> Polyline:
    if not polyline.bulges.any():
        vertices = _transform_vertices(polyline.vertices, matrix) * factor
        vertices[:, 2] = 0.0
        return Polyline(vertices, polyline.closed)
    xy = _transform_vertices(polyline.vertices, matrix)[:, :2] * factor
    count = len(xy) if polyline.closed else len(xy) - 1
    bulges = np.where(np.arange(len(xy)) < count, polyline.bulges, 0.0)
    if not bulges.any():
        return Polyline(np.column_stack([xy, bulges]), polyline.closed)
    plane = transform_curve(matrix, Curve((0.0, 0.0, 0.0), polyline.ux, polyline.uy))
    if not is_parallel_to_plate(plane):
        raise NotInPlaneError
    large, small = half_axes(plane)
    (ux, uy, _), (vx, vy, _) = plane.u, plane.v
    if large - small <= ROUND_SHARE * large:
        side = math.copysign(1.0, ux * vy - uy * vx)
        return Polyline(np.column_stack([xy, side * bulges]), polyline.closed)
    flat = Polyline(
        np.column_stack([polyline.vertices @ np.column_stack([polyline.ux, polyline.uy]), bulges]), polyline.closed
    )
    return _place_unevenly_scaled_arcs(
        flat, xy, ((ux * factor, uy * factor), (vx * factor, vy * factor)), tolerance, spend
    )


def _place_unevenly_scaled_arcs(
    flat: Polyline, xy: Floats, axes: tuple[tuple[float, float], ...], tolerance: float, spend: Spend
) -> Polyline:
    """Place a polyline whose arcs become elliptical because a block scales x and y differently.

    `flat` is the polyline in its own plane. `xy` contains the same vertices after placement.
    """
    (ux, uy), (vx, vy) = axes
    rows = []
    for k, s in enumerate(flat.segments()):
        if not s.is_arc:
            rows.append(np.array([[*xy[k], 0.0]]))
            continue
        start_angle = math.atan2(s.start[1] - s.center[1], s.start[0] - s.center[0])
        u, v = (ux * s.radius, uy * s.radius), (vx * s.radius, vy * s.radius)
        arcs = ellipse_path((0.0, 0.0), u, v, start_angle, 4.0 * math.atan(s.bulge), tolerance, spend)
        dx, dy = xy[k] - arcs.vertices[0, :2]
        rows.append(arcs.moved(float(dx), float(dy)).vertices[:-1])
    if not flat.closed:
        rows.append(np.array([[*xy[-1], 0.0]]))
    return Polyline(np.concatenate(rows), flat.closed)


def _transform_curve(curve: Curve, factor: float, tolerance: float, spend: Spend) -> Polyline:
    if not is_parallel_to_plate(curve):
        raise NotInPlaneError
    center, u, v = ((a[0] * factor, a[1] * factor) for a in (curve.center, curve.u, curve.v))
    return ellipse_path(center, u, v, curve.start, curve.sweep, tolerance, spend)


class _StrokePath(NamedTuple):
    """The path of a stroke, in mm. `rising` is true if the stroke leaves the plane of the sheet."""

    path: Polyline
    rising: bool
    z: float


@dataclass
class Strokes:
    """Collects contours, in mm, from strokes in drawing units, and counts unusable strokes."""

    factor: float
    path: str
    points: Spend
    contours: list[Contour] = field(default_factory=list)
    leaning: Counter[str] = field(default_factory=Counter)
    sloping: list[tuple[float, float]] = field(default_factory=list)
    skipped: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    #: Number of texts by type.
    texts: Counter[str] = field(default_factory=Counter)
    _segments: int = 0
    #: Strokes of blocks that are inserted at the origin, or the exceptions raised for them, by stroke and rotation of
    #: the block. All copies are translations of these strokes.
    _cache: dict[tuple[int, Any], _StrokePath | Exception] = field(default_factory=dict)

    def add(self, stroke: DxfStroke, matrix: Matrix, layer: str) -> None:
        """Place a stroke, or all strokes of a text, and add them as contours."""
        if isinstance(stroke.form, Letters):
            self.texts[stroke.dxftype] += 1
            for line in stroke.form.strokes:
                self.add(line, matrix, layer)
            return
        try:
            stroke_path = (
                self._place_cached(stroke, matrix[:3]) if matrix is not IDENTITY else self._place(stroke, matrix)
            )
        except NotInPlaneError:
            self.leaning[stroke.dxftype] += 1
            return
        except (PlanError, ArithmeticError, ValueError) as problem:
            self._record_skipped(stroke, str(problem))
            return
        dx, dy = matrix[3][0] * self.factor, matrix[3][1] * self.factor
        x0, y0, x1, y1 = stroke_path.path.extents
        if not max(abs(x0 + dx), abs(x1 + dx), abs(y0 + dy), abs(y1 + dy)) <= MAX_COORDINATE:
            finite = np.isfinite((x0 + dx, x1 + dx, y0 + dy, y1 + dy)).all()
            self._record_skipped(stroke, OUT_OF_RANGE if finite else Message("coordinates or radius out of range"))
            return
        self._segments += stroke_path.path.n_segments
        if self._segments > MAX_SEGMENTS:
            raise too_many_segments_error(self.path)
        path = stroke_path.path if matrix is IDENTITY else stroke_path.path.moved(dx, dy)
        if stroke_path.rising:
            self.sloping.append(path.start)
        z = 0.0 if stroke_path.rising else stroke_path.z + (0.0 if matrix is IDENTITY else matrix[3][2] * self.factor)
        placed = _round_to_file_precision(path, self.factor)
        self.contours.append(Contour(placed, stroke.kind, layer, stroke.handle, z=z, name=stroke.name))

    def _place_cached(self, stroke: DxfStroke, turn: Any) -> _StrokePath:
        stroke_path = self._cache.get((id(stroke), turn))
        if stroke_path is None:
            try:
                stroke_path = self._place(stroke, (*turn, (0.0, 0.0, 0.0)))
            except (PlanError, ArithmeticError, ValueError) as problem:
                stroke_path = problem
            self._cache[id(stroke), turn] = stroke_path
        if isinstance(stroke_path, Exception):
            raise stroke_path
        return stroke_path

    def _place(self, stroke: DxfStroke, matrix: Matrix) -> _StrokePath:
        with np.errstate(all="ignore"):
            path = place_stroke(stroke, matrix, self.factor, CURVE_TOLERANCE, self.points)
            return _StrokePath(path, is_sloped(stroke, matrix), stroke_height(stroke, matrix) * self.factor)

    def _record_skipped(self, stroke: DxfStroke, reason: str) -> None:
        self.skipped.setdefault((stroke.dxftype, reason), []).append(stroke.handle)

    def issues(self) -> list[Issue]:
        """Report the strokes that cannot be used."""
        issues = []
        for kind, number in self.leaning.items():
            message = Message("{} {} outside the plane of the sheet will not be cut", number, kind)
            issues.append(Issue("L202", message, missing=MissingWork("element", number)))
        if self.sloping:
            message = Message(
                "projected onto the plane of the sheet: {} that sloped out of it",
                count_of(len(self.sloping), "line"),
            )
            issues.append(Issue("L202", message, first_positions_text(self.sloping)))
        for (kind, reason), handles in self.skipped.items():
            message = Message(
                "skipped {} {}: {}", len(handles), printable(kind), map_text(reason, lambda text: printable(text, 100))
            )
            issues.append(skipped_entities_issue(handles, message))
        return issues


def _round_to_file_precision(path: Polyline, factor: float) -> Polyline:
    """Round off the digits that unit conversion adds to a path."""
    if factor == 1.0:
        return path
    vertices = path.vertices.copy()
    vertices[:, :2] = np.round(vertices[:, :2], 6)
    return Polyline(vertices, path.closed)
