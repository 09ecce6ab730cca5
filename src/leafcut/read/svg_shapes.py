"""Convert SVG shapes to lines, arcs and Bézier curves, and place them in mm."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from svgelements import Arc, Close, CubicBezier, Move, Path, QuadraticBezier

from leafcut.geometry.arrays import Point
from leafcut.geometry.curves import Spend, accept_any_point_count, bezier_points, ellipse_path, fit_arcs_to_curve
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.read.svg_transform import Affine, parse_length, parse_numbers

#: Characters that path data may contain. svgelements silently skips unknown characters.
_PATH_DATA = re.compile(r"[MmZzLlHhVvCcSsQqTtAa0-9eE+\-.,\s]*")


class EllipseArc(NamedTuple):
    """The curve centre + u·cos(t) + v·sin(t). The parameter t runs from `start` over the angle `sweep`."""

    center: Point
    u: Point
    v: Point
    start: float
    sweep: float


class SvgSubpath(NamedTuple):
    """A subpath in user units: lines and Bézier curves, stored as control points, and elliptical arcs."""

    pieces: list[list[Point] | EllipseArc]
    closed: bool


class ViewSize(NamedTuple):
    """The reference size for percentages: the width and height of the view, in user units."""

    width: float
    height: float


def shape_subpaths(tag: str, attributes: Mapping[str, str], frame: ViewSize) -> list[SvgSubpath]:
    """Return the subpaths of a shape. Raise ValueError if the shape is invalid."""
    return list(SHAPES[tag](attributes, frame))


def _length_attribute(attributes: Mapping[str, str], name: str, reference: float, default: float = 0.0) -> float:
    text = attributes.get(name, "").strip()
    return default if text in ("", "auto") else parse_length(text, reference)


def _line_subpath(a: Mapping[str, str], frame: ViewSize) -> Iterator[SvgSubpath]:
    ends = [
        (_length_attribute(a, "x1", frame.width), _length_attribute(a, "y1", frame.height)),
        (_length_attribute(a, "x2", frame.width), _length_attribute(a, "y2", frame.height)),
    ]
    yield SvgSubpath([ends], closed=False)


def _polygon_parser(closed: bool) -> Callable[[Mapping[str, str], ViewSize], Iterator[SvgSubpath]]:
    def read(a: Mapping[str, str], _: ViewSize) -> Iterator[SvgSubpath]:
        values = parse_numbers(a.get("points", ""))
        if len(values) % 2:
            raise ValueError(Message("points with an odd number of coordinates"))
        points = list(zip(values[::2], values[1::2], strict=True))
        if len(points) > 1:
            yield SvgSubpath(_polygon_sides(points, closed), closed)

    return read


def _polygon_sides(points: list[Point], closed: bool) -> list[list[Point] | EllipseArc]:
    after = [*points[1:], points[0]] if closed else points[1:]
    return [[p, q] for p, q in zip(points, after, strict=False)]


def _rectangle_subpath(a: Mapping[str, str], frame: ViewSize) -> Iterator[SvgSubpath]:
    x, y = _length_attribute(a, "x", frame.width), _length_attribute(a, "y", frame.height)
    w, h = _length_attribute(a, "width", frame.width), _length_attribute(a, "height", frame.height)
    rx, ry = _length_attribute(a, "rx", frame.width, -1.0), _length_attribute(a, "ry", frame.height, -1.0)
    rx, ry = (ry if rx < 0.0 else rx), (rx if ry < 0.0 else ry)
    rx, ry = min(max(rx, 0.0), 0.5 * w), min(max(ry, 0.0), 0.5 * h)
    if not (w > 0.0 and h > 0.0):
        return
    if not (rx > 0.0 and ry > 0.0):
        yield SvgSubpath(_polygon_sides([(x, y), (x + w, y), (x + w, y + h), (x, y + h)], closed=True), closed=True)
        return
    pieces: list[list[Point] | EllipseArc] = []
    quarter = 0.5 * math.pi
    for k, (cx, cy) in enumerate(
        [(x + w - rx, y + ry), (x + w - rx, y + h - ry), (x + rx, y + h - ry), (x + rx, y + ry)]
    ):
        pieces.append(EllipseArc((cx, cy), (rx, 0.0), (0.0, ry), (k - 1) * quarter, quarter))
    starts = [(x + rx, y), (x + w, y + ry), (x + w - rx, y + h), (x, y + h - ry)]
    ends = [(x + w - rx, y), (x + w, y + h - ry), (x + rx, y + h), (x, y + ry)]
    sides = [[p, q] for p, q in zip(starts, ends, strict=True)]
    yield SvgSubpath([piece for pair in zip(sides, pieces, strict=True) for piece in pair], closed=True)


def _ellipse_subpath(a: Mapping[str, str], frame: ViewSize) -> Iterator[SvgSubpath]:
    diagonal = math.hypot(frame.width, frame.height) / math.sqrt(2.0)
    rx = ry = _length_attribute(a, "r", diagonal)
    if "r" not in a:
        rx, ry = _length_attribute(a, "rx", frame.width), _length_attribute(a, "ry", frame.height)
    if rx > 0.0 and ry > 0.0:
        center = (_length_attribute(a, "cx", frame.width), _length_attribute(a, "cy", frame.height))
        yield SvgSubpath([EllipseArc(center, (rx, 0.0), (0.0, ry), 0.0, math.tau)], closed=True)


def _path_subpaths(a: Mapping[str, str], _: ViewSize) -> Iterator[SvgSubpath]:
    text = a.get("d", "")
    if not _PATH_DATA.fullmatch(text):
        raise ValueError(Message("path data with unknown commands"))
    if text.strip() and text.strip()[0] not in "Mm":
        raise ValueError(Message("path data that does not start with M"))
    try:
        return iter(list(_split_path_data(text)))
    except (RecursionError, MemoryError):
        raise
    except Exception as problem:  # svgelements computes with the missing numbers
        words = str(problem) if isinstance(problem, ValueError) else ""
        raise ValueError(words or Message("path data in which numbers are missing")) from None


def _split_path_data(text: str) -> Iterator[SvgSubpath]:
    pieces: list[list[Point] | EllipseArc] = []
    for segment in Path(text):
        if isinstance(segment, Move):
            if pieces:
                yield SvgSubpath(pieces, closed=False)
            pieces = []
        elif isinstance(segment, Close):
            if pieces:
                side = [_finite_point(segment.start), _finite_point(segment.end)]
                yield SvgSubpath([*pieces, *([side] if side[0] != side[1] else [])], closed=True)
            pieces = []
        else:
            pieces.append(_convert_path_segment(segment))
    if pieces:
        yield SvgSubpath(pieces, closed=False)


def _convert_path_segment(segment: Any) -> list[Point] | EllipseArc:
    if isinstance(segment, Arc):
        center, u, v = segment.center, segment.prx, segment.pry
        if segment.sweep == 0 or center is None or u is None or v is None:
            return [_finite_point(segment.start), _finite_point(segment.end)]
        cx, cy = _finite_point(center)
        axes = [(float(p.x) - cx, float(p.y) - cy) for p in (u, v)]
        return EllipseArc((cx, cy), axes[0], axes[1], float(segment.get_start_t()), float(segment.sweep))
    if isinstance(segment, CubicBezier):
        return [_finite_point(p) for p in (segment.start, segment.control1, segment.control2, segment.end)]
    if isinstance(segment, QuadraticBezier):
        return [_finite_point(p) for p in (segment.start, segment.control, segment.end)]
    return [_finite_point(segment.start), _finite_point(segment.end)]


def _finite_point(point: Any) -> Point:
    if point is None:
        raise ValueError(Message("path data without a start point"))
    x, y = float(point.x), float(point.y)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(Message("a number that is not finite"))
    return (x, y)


#: Maps the tag of each shape element to the function that returns its subpaths.
SHAPES: dict[str, Callable[[Mapping[str, str], ViewSize], Iterator[SvgSubpath]]] = {
    "path": _path_subpaths,
    "rect": _rectangle_subpath,
    "circle": _ellipse_subpath,
    "ellipse": _ellipse_subpath,
    "line": _line_subpath,
    "polyline": _polygon_parser(closed=False),
    "polygon": _polygon_parser(closed=True),
}


def place_subpath(
    outline: SvgSubpath, matrix: Affine, tolerance: float, spend: Spend = accept_any_point_count
) -> Polyline | None:
    """Place an outline, and approximate curves by arcs to within `tolerance` mm.

    The result is in mm, or None if the outline has no length.
    """
    first = outline.pieces[0]
    if len(outline.pieces) == 1 and isinstance(first, EllipseArc):
        return _place_arc(first, matrix, tolerance, spend)
    rows, curve = [], [np.zeros((0, 2))]

    def flush_curve() -> None:
        points = np.concatenate(curve)
        if len(points) > 1:
            rows.append(fit_arcs_to_curve(points, tolerance, closed=False, spend=spend).vertices[:-1])
        curve[:] = [np.zeros((0, 2))]

    last: Point = (0.0, 0.0)
    for piece in outline.pieces:
        if isinstance(piece, EllipseArc):
            flush_curve()
            bend = _place_arc(piece, matrix, tolerance, spend)
            rows.append(bend.vertices[: None if bend.closed else -1])
            last = bend.end
            continue
        points = np.array([matrix.transform_point(*p) for p in piece])
        last = (float(points[-1, 0]), float(points[-1, 1]))
        if len(piece) == 2:
            flush_curve()
            rows.append(np.array([[*points[0], 0.0]]))
        elif np.ptp(points, axis=0).any():
            chords = bezier_points(points, 0.25 * tolerance)
            curve.append(chords[1:] if len(curve) > 1 else chords)
    flush_curve()
    if not outline.closed:
        rows.append(np.array([[*last, 0.0]]))
    table = np.concatenate(rows)
    if not outline.closed:
        table[-1, 2] = 0.0
    return Polyline(table, outline.closed) if len(table) > 1 else None


def _place_arc(bend: EllipseArc, matrix: Affine, tolerance: float, spend: Spend) -> Polyline:
    center, u, v = (
        matrix.transform_point(*bend.center),
        matrix.transform_direction(*bend.u),
        matrix.transform_direction(*bend.v),
    )
    return ellipse_path(center, u, v, bend.start, bend.sweep, tolerance, spend)
