"""Read a complete DXF drawing for display.

The reader returns entities that can be machined, and draws texts, dimensions, hatches and leaders as lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from leafcut.errors import ReadError
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.dxf_blocks import BlockWalk
from leafcut.read.dxf_document import drawing_units, layer_filter_of_document, open_document
from leafcut.read.dxf_shapes import (
    ROUND,
    Curve,
    Matrix,
    entity_to_hole_shape,
    half_axes,
    is_parallel_to_plate,
    transform_curve,
    transform_point,
)
from leafcut.read.dxf_strokes import DxfPolyline, DxfStroke, Letters, Strokes, entity_to_stroke, straight_polyline
from leafcut.read.dxf_texts import text_to_stroke
from leafcut.read.format import FREE_HOLES, MAX_COORDINATE, Source, expansion_budget, point_budget

#: Annotations that consist of several lines and are never machined.
_DIMENSIONS = ("ARC_DIMENSION", "DIMENSION", "LEADER", "MULTILEADER")
_ANNOTATIONS = (*_DIMENSIONS, "HATCH", "MLINE", "MPOLYGON", "SOLID", "TRACE", "3DFACE")
#: Maximum number of displayed lines per entity, and of points per line.
_MOST_LINES, _MOST_POINTS = 500, 2_000
#: Flattening tolerance of curves for display, relative to the size of the curve.
_COARSE = 0.005


def read_dxf_whole(source: Source, options: ReadOptions) -> Part:
    """Read all visible entities of model space, in mm.

    Circles and points become holes, and everything else becomes contours.

    The function ignores layer and hole selections.

    Raises
    ------
    ReadError
        The file is not DXF, is damaged or truncated, or shows nothing.
    """
    document = open_document(source, [])
    factor, unit = drawing_units(document, options)
    layers = layer_filter_of_document(document, replace(options, layers=()))
    walk = BlockWalk(
        document, expansion_budget(source, "blocks", FREE_HOLES), layers, _entity_to_display_stroke, "lines"
    )
    strokes, holes = Strokes(factor, source.path, point_budget(source)), []
    for stroke, matrix, layer in walk.shapes():
        source.on_progress()
        hole = _stroke_to_hole(stroke, matrix, layer, factor)
        if hole is None:
            strokes.add(stroke, matrix, layer)
        elif max(abs(hole.x), abs(hole.y), hole.diameter) <= MAX_COORDINATE:
            holes.append(hole)
    if not strokes.contours and not holes:
        raise ReadError(source.path, "the drawing shows nothing")
    return Part(
        source.name,
        tuple(holes),
        source=source.file_name,
        format="dxf",
        units=unit or "mm",
        contours=tuple(strokes.contours),
    )


def _stroke_to_hole(stroke: DxfStroke, matrix: Matrix, layer: str, factor: float) -> Hole | None:
    """Convert a stroke to a hole if it is a point, or still a circle after placement; otherwise return None."""
    if isinstance(stroke.form, DxfPolyline) and stroke.dxftype == "POINT":
        x, y, z = transform_point(matrix, stroke.form.vertices[0].tolist())
        return Hole(x * factor, y * factor, 0.0, layer, stroke.handle, z * factor)
    if not isinstance(stroke.form, Curve) or stroke.dxftype != "CIRCLE":
        return None
    curve = transform_curve(matrix, stroke.form)
    large, small = half_axes(curve)
    if not is_parallel_to_plate(curve) or large - small > ROUND * large:
        return None
    x, y, z = (v * factor for v in curve.center)
    return Hole(x, y, round((large + small) * factor, 6), layer, stroke.handle, z)


def _entity_to_display_stroke(entity: Any) -> DxfStroke | None:
    return entity_to_stroke(entity) or text_to_stroke(entity) or _point_stroke(entity) or _annotation_stroke(entity)


def _point_stroke(entity: Any) -> DxfStroke | None:
    if entity.dxftype() != "POINT" or entity_to_hole_shape(entity) is None:
        return None
    point = np.array([entity.dxf.location.xyz])
    return DxfStroke(
        "POINT", straight_polyline(point, closed=False), entity.dxf.get("layer", "0"), entity.dxf.get("handle") or ""
    )


def _annotation_stroke(entity: Any) -> DxfStroke | None:
    """Convert an annotation to lines. Return None for other entities, and for annotations without readable lines."""
    kind = entity.dxftype()
    if kind not in _ANNOTATIONS:
        return None
    layer, handle = entity.dxf.get("layer", "0"), entity.dxf.get("handle") or ""
    strokes: list[DxfStroke] = []
    try:
        for stroke in _annotation_strokes(entity):
            strokes.append(stroke._replace(dxftype=kind, layer=layer, handle=handle, name="", kind="text"))
            if len(strokes) == _MOST_LINES:
                break
    except Exception:  # ezdxf raises almost any exception on a damaged entity: show the lines already read
        strokes = strokes[:_MOST_LINES]
    return DxfStroke(kind, Letters(tuple(strokes)), layer, handle, "", "text") if strokes else None


def _annotation_strokes(entity: Any) -> Iterator[DxfStroke]:
    from ezdxf import path
    from ezdxf.disassemble import make_primitive, recursive_decompose

    if entity.dxftype() in ("HATCH", "MPOLYGON"):
        for boundary in path.from_hatch(entity):
            yield _flatten_curve(boundary)
        return
    for part in recursive_decompose([entity]):
        if part.dxftype() == "POINT":
            continue
        stroke = entity_to_stroke(part) or text_to_stroke(part)
        if stroke is not None:
            yield from stroke.form.strokes if isinstance(stroke.form, Letters) else (stroke,)
            continue
        primitive = make_primitive(part)
        if primitive.path is not None:
            yield _flatten_curve(primitive.path)


def _flatten_curve(curve: Any) -> DxfStroke:
    ends = np.array([p.xyz for p in curve.control_vertices()])
    size = float(np.ptp(ends, axis=0).max(initial=0.0)) or 1.0
    points = [p.xyz for p in curve.flattening(_COARSE * size)][:_MOST_POINTS]
    return DxfStroke("", straight_polyline(np.array(points).reshape(-1, 3), closed=False), "", "", "", "text")
