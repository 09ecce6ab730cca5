"""DXF drawings for sheet cutting: every visible line, arc, polyline, ellipse and spline, including those in blocks."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from leafcut.errors import PlanError, ReadError, count_of, printable
from leafcut.geometry.curves import Spend
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.heights import HeightCount
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.dxf_blocks import BlockWalk
from leafcut.read.dxf_document import layers_of, open_document, units_of, walk_issues
from leafcut.read.dxf_shapes import IDENTITY, Matrix
from leafcut.read.dxf_strokes import DxfStroke, Letters, NotInPlaneError, height_of, is_sloped, placed_stroke, stroke_of
from leafcut.read.dxf_texts import text_of
from leafcut.read.format import (
    CURVE_TOLERANCE,
    MAX_COORDINATE,
    MAX_SEGMENTS,
    OUT_OF_RANGE,
    Source,
    copy_budget,
    places_text,
    point_budget,
    refuse_tiny,
    too_many_segments,
    units_unknown,
)


def read_dxf_contours(source: Source, options: ReadOptions, *, texts: bool = True) -> Part:
    """Return the lines and curves of a DXF drawing's model space as contours, one per entity, in mm.

    `texts` adds the strokes of texts, with kind ``text``.

    Raises
    ------
    ReadError
        The file is not DXF, is damaged or truncated, or draws nothing to cut; lists what was found instead.
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
        issues.append(Issue("L210", Message("not cut: {}", message), severity=Severity.NOTE))
    if not drawn:
        reasons = "; ".join(i.message for i in issues) or Message("the drawing is empty")
        if options.layers:
            names = sorted(str(layer.dxf.get("name", "")) for layer in document.layers)
            reasons += Message("; the drawing has the layers {}", printable(", ".join(names), 120))
        raise ReadError(source.path, Message("nothing to cut: {}", reasons))
    issues += _heights(tuple(c for c in contours if c.kind != "text"))
    part = Part(source.name, source=source.file_name, format="dxf", units=unit or "mm", contours=contours)
    refuse_tiny(source.path, part, options)
    if unit is None:
        issues.insert(0, units_unknown("the drawing", part, Severity.WARNING))
    return replace(part, issues=tuple(issues))


def _heights(contours: tuple[Contour, ...]) -> list[Issue]:
    """Report contours at several heights or off Z0, which look the same from above."""
    heights = HeightCount.of((*c.path.start, c.z) for c in contours)
    if heights.differ:
        message = Message("lines are drawn at different heights: {}; projected onto the sheet", heights)
        return [Issue("L406", message)]
    return heights.notes("lines")


def read_dxf_pockets(
    source: Source, options: ReadOptions, pocket_options: PocketDrawingOptions, joining: SheetOptions
) -> Part:
    """Return the outlines of a DXF drawing as pockets with islands, in mm.

    Raises the errors of `read_dxf_contours` and `pockets_of_drawing`.
    """
    from leafcut.read.pocket_outlines import pockets_of_drawing  # start-up

    return pockets_of_drawing(read_dxf_contours(source, options, texts=False), pocket_options, joining, source.path)


def _shape_of(entity: Any) -> DxfStroke | None:
    return stroke_of(entity) or text_of(entity)


class _StrokePath(NamedTuple):
    """A stroke, mm; `rising` if it leaves the plane of the sheet."""

    path: Polyline
    rising: bool
    z: float


@dataclass
class Strokes:
    """Collects contours in mm from strokes in drawing units, and counts unusable strokes."""

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
    #: Strokes of blocks inserted at the origin, or the exception raised, by the rotation of the block; copies are only
    #: translated.
    _cache: dict[tuple[int, Any], _StrokePath | Exception] = field(default_factory=dict)

    def add(self, stroke: DxfStroke, matrix: Matrix, layer: str) -> None:
        """Add a placed stroke, or all strokes of a text."""
        if isinstance(stroke.form, Letters):
            self.texts[stroke.dxftype] += 1
            for line in stroke.form.strokes:
                self.add(line, matrix, layer)
            return
        try:
            stroke_path = (
                self._block_stroke(stroke, matrix[:3]) if matrix is not IDENTITY else self._make(stroke, matrix)
            )
        except NotInPlaneError:
            self.leaning[stroke.dxftype] += 1
            return
        except (PlanError, ArithmeticError, ValueError) as problem:
            self._skip(stroke, str(problem))
            return
        dx, dy = matrix[3][0] * self.factor, matrix[3][1] * self.factor
        x0, y0, x1, y1 = stroke_path.path.extents
        if not max(abs(x0 + dx), abs(x1 + dx), abs(y0 + dy), abs(y1 + dy)) <= MAX_COORDINATE:
            finite = np.isfinite((x0 + dx, x1 + dx, y0 + dy, y1 + dy)).all()
            self._skip(stroke, OUT_OF_RANGE if finite else "coordinates or radius out of range")
            return
        self._segments += stroke_path.path.n_segments
        if self._segments > MAX_SEGMENTS:
            raise too_many_segments(self.path)
        path = stroke_path.path if matrix is IDENTITY else stroke_path.path.moved(dx, dy)
        if stroke_path.rising:
            self.sloping.append(path.start)
        z = 0.0 if stroke_path.rising else stroke_path.z + (0.0 if matrix is IDENTITY else matrix[3][2] * self.factor)
        placed = _rounded(path, self.factor)
        self.contours.append(Contour(placed, stroke.kind, layer, stroke.handle, z=z, name=stroke.name))

    def _block_stroke(self, stroke: DxfStroke, turn: Any) -> _StrokePath:
        stroke_path = self._cache.get((id(stroke), turn))
        if stroke_path is None:
            try:
                stroke_path = self._make(stroke, (*turn, (0.0, 0.0, 0.0)))
            except (PlanError, ArithmeticError, ValueError) as problem:
                stroke_path = problem
            self._cache[id(stroke), turn] = stroke_path
        if isinstance(stroke_path, Exception):
            raise stroke_path
        return stroke_path

    def _make(self, stroke: DxfStroke, matrix: Matrix) -> _StrokePath:
        with np.errstate(all="ignore"):
            path = placed_stroke(stroke, matrix, self.factor, CURVE_TOLERANCE, self.points)
            return _StrokePath(path, is_sloped(stroke, matrix), height_of(stroke, matrix) * self.factor)

    def _skip(self, stroke: DxfStroke, reason: str) -> None:
        self.skipped.setdefault((stroke.dxftype, reason), []).append(stroke.handle or "?")

    def issues(self) -> list[Issue]:
        """Return the issues of the strokes."""
        issues = []
        for kind, number in self.leaning.items():
            message = Message("{} {} not in the plane of the sheet: not cut", number, kind)
            issues.append(Issue("L202", message, missing=MissingWork("element", number)))
        if self.sloping:
            message = Message(
                "{} sloping out of the plane of the sheet: projected onto it", count_of(len(self.sloping), "line")
            )
            issues.append(Issue("L202", message, places_text(self.sloping, len(self.sloping))))
        for (kind, reason), handles in self.skipped.items():
            location = Message("handle {}", ", ".join(handles[:3])) + (" …" if len(handles) > 3 else "")
            message = Message("{} {} skipped: {}", len(handles), printable(kind), printable(reason, 100))
            issues.append(Issue("L203", message, location, missing=MissingWork("element", len(handles))))
        return issues


def _rounded(path: Polyline, factor: float) -> Polyline:
    """Remove digits that come from the unit conversion."""
    if factor == 1.0:
        return path
    vertices = path.vertices.copy()
    vertices[:, :2] = np.round(vertices[:, :2], 6)
    return Polyline(vertices, path.closed)
