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
from leafcut.read.dxf_document import drawing_units, layer_filter_of_document, open_document, skipped_content_issues
from leafcut.read.dxf_strokes import DxfStroke, Strokes, entity_to_stroke
from leafcut.read.format import (
    Source,
    expansion_budget,
    point_budget,
    refuse_tiny_drawing,
    unknown_units_issue,
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
    factor, unit = drawing_units(document, options)
    walk = BlockWalk(
        document,
        expansion_budget(source, "blocks"),
        layer_filter_of_document(document, options),
        _stroke_or_text if texts else entity_to_stroke,
        "lines",
    )
    strokes = Strokes(factor, source.path, point_budget(source))
    for stroke, matrix, layer in walk.shapes():
        source.on_progress()
        strokes.add(stroke, matrix, layer)
    issues += skipped_content_issues(walk) + strokes.issues()
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
    refuse_tiny_drawing(source.path, part, options)
    if unit is None:
        issues.insert(0, unknown_units_issue(Message("the drawing"), part, Severity.WARNING))
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

    Raises the same errors as `read_dxf_contours` and `drawing_to_pockets`.
    """
    from leafcut.read.pocket_outlines import drawing_to_pockets  # start-up

    return drawing_to_pockets(read_dxf_contours(source, options, texts=False), pocket_options, joining, source.path)


def _stroke_or_text(entity: Any) -> DxfStroke | None:
    stroke = entity_to_stroke(entity)
    if stroke is not None or entity.dxftype() not in ("TEXT", "MTEXT"):
        return stroke
    from leafcut.read.dxf_texts import text_to_stroke

    return text_to_stroke(entity)
