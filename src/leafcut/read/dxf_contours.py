"""Read DXF drawings for sheet cutting.

The reader returns every visible line, arc, polyline, ellipse and spline, including those in blocks.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

from leafcut.errors import ReadError, printable
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.heights import HeightCount
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.dxf_blocks import BlockWalk
from leafcut.read.dxf_document import layers_of, open_document, units_of, walk_issues
from leafcut.read.dxf_strokes import DxfStroke, Strokes, stroke_of
from leafcut.read.format import (
    Source,
    copy_budget,
    point_budget,
    refuse_tiny,
    units_unknown,
)


def read_dxf_contours(source: Source, options: ReadOptions, *, texts: bool = True) -> Part:
    """Read the lines and curves in the model space of a DXF drawing as contours, in mm.

    Each entity becomes one contour. With `texts`, the strokes of texts are added with the kind ``text``.

    Raises
    ------
    ReadError
        The file is not DXF, is damaged or truncated, or contains nothing to cut. The message lists the entities in the
        file.
    """
    issues: list[Issue] = []
    document = open_document(source, issues)
    factor, unit = units_of(document, options)
    walk = BlockWalk(
        document,
        copy_budget(source, "blocks"),
        layers_of(document, options),
        _shape_of if texts else stroke_of,
        "lines",
    )
    strokes = Strokes(factor, source.path, point_budget(source))
    for stroke, matrix, layer in walk.shapes():
        source.on_progress()
        strokes.add(stroke, matrix, layer)
    issues += walk_issues(walk) + strokes.issues()
    contours = tuple(strokes.contours)
    drawn = any(c.kind != "text" for c in contours)
    if others := walk.others + (Counter() if drawn else strokes.texts):
        message = ", ".join(f"{number} {printable(kind)}" for kind, number in others.most_common())
        issues.append(Issue("L210", Message("the program does not cut {}", message), severity=Severity.NOTE))
    if not drawn:
        reasons = Message.joined("; ", (i.message for i in issues)) or Message("the drawing is empty")
        if options.layers:
            names = sorted(str(layer.dxf.get("name", "")) for layer in document.layers)
            reasons = Message("{}; the drawing has the layers {}", reasons, printable(", ".join(names), 120))
        raise ReadError(source.path, Message("there is nothing to cut: {}", reasons))
    issues += _height_issues(tuple(c for c in contours if c.kind != "text"))
    part = Part(source.name, source=source.file_name, format="dxf", units=unit or "mm", contours=contours)
    refuse_tiny(source.path, part, options)
    if unit is None:
        issues.insert(0, units_unknown(Message("the drawing"), part, Severity.WARNING))
    return replace(part, issues=tuple(issues))


def _height_issues(contours: tuple[Contour, ...]) -> list[Issue]:
    """Report contours that lie at several heights, or at a height other than Z0.

    Such heights are invisible in a top view of the drawing.
    """
    heights = HeightCount.of((*c.path.start, c.z) for c in contours)
    if heights.differ:
        message = Message("lines are drawn at different heights: {}; they were projected onto the sheet", heights)
        return [Issue("L406", message)]
    return heights.notes("lines")


def read_dxf_pockets(
    source: Source, options: ReadOptions, pocket_options: PocketDrawingOptions, joining: SheetOptions
) -> Part:
    """Read the outlines of a DXF drawing as pockets with islands, in mm.

    Raises the same errors as `read_dxf_contours` and `pockets_of_drawing`.
    """
    from leafcut.read.pocket_outlines import pockets_of_drawing  # start-up

    return pockets_of_drawing(read_dxf_contours(source, options, texts=False), pocket_options, joining, source.path)


def _shape_of(entity: Any) -> DxfStroke | None:
    stroke = stroke_of(entity)
    if stroke is not None or entity.dxftype() not in ("TEXT", "MTEXT"):
        return stroke
    from leafcut.read.dxf_texts import text_of

    return text_of(entity)
