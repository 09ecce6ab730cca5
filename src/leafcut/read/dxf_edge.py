"""The lines of a drilling drawing: the edge of the plate. They are displayed, but never machined."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

from leafcut.errors import ReadError
from leafcut.geometry.curves import Spend
from leafcut.model.contour import Contour
from leafcut.options import ReadOptions
from leafcut.read.dxf_blocks import LayerFilter
from leafcut.read.dxf_contours import Strokes
from leafcut.read.dxf_document import layers_of
from leafcut.read.dxf_shapes import IDENTITY
from leafcut.read.dxf_strokes import stroke_of

#: Entity types of an edge.
_KINDS = ("LINE", "ARC", "LWPOLYLINE", "POLYLINE")
#: Most edges to display: a plate has a few, and a larger drawing shows something else.
MOST_EDGES = 5_000


def edge_of(
    document: Any, options: ReadOptions, factor: float, path: str, points: Spend, holes: Collection[str]
) -> tuple[Contour, ...]:
    """Return the lines, arcs and polylines placed directly in model space that are not holes, in mm.

    `holes` are the handles of the entities that became holes. Layers that are off or frozen stay hidden; the layer
    selection is ignored, because nothing is machined. Damaged entities are skipped.
    """
    layers = layers_of(document, replace(options, layers=()))
    strokes = Strokes(factor, path, points)
    try:
        for entity in document.modelspace():
            if entity.dxftype() in _KINDS:
                if len(strokes.contours) >= MOST_EDGES:
                    return ()
                _add(entity, layers, holes, strokes)
    except ReadError:  # the drawing exceeds its point budget, which is no reason to refuse its holes
        return ()
    return tuple(strokes.contours)


def _add(entity: Any, layers: LayerFilter, holes: Collection[str], strokes: Strokes) -> None:
    try:
        layer, handle = entity.dxf.get("layer", "0"), entity.dxf.get("handle") or ""
        hidden = not layers.shows(layer) or bool(entity.dxf.get("invisible", 0))
        stroke = None if hidden or handle in holes else stroke_of(entity)
    except Exception:  # ezdxf raises almost any exception on a damaged entity; the hole reader reports it
        return
    if stroke is not None:
        strokes.add(stroke._replace(kind="sheet", name=""), IDENTITY, layer)
