"""Read the holes of DXF drawings (ASCII and binary, R12 to R2018) with ezdxf.

A hole can be a CIRCLE, a circular ELLIPSE, a POINT, or a set of arcs or bulged polylines that close a circle. The
reader takes these entities from model space and from blocks. A POINT becomes a hole of diameter 0 (a bare point),
unless it marks the centre of a circle.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut.errors import ReadError, count_of, printable
from leafcut.geometry.curves import Spend
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.dxf_blocks import BlockWalk, LayerFilter
from leafcut.read.dxf_document import (
    drawing_units,
    hidden_counts_text,
    layer_filter_of_document,
    open_document,
    skipped_content_issues,
)
from leafcut.read.dxf_shapes import (
    IDENTITY,
    ROUND,
    Matrix,
    Shape,
    arc_span_in_top_view,
    entity_to_hole_shape,
    half_axes,
    is_parallel_to_plate,
    transform_curve,
)
from leafcut.read.dxf_strokes import Strokes, entity_to_stroke
from leafcut.read.filter_holes import (
    ArcPiece,
    holes_on_part_layers,
    join_arcs_to_circles,
    outline_circle_indices,
    select_holes,
)
from leafcut.read.format import (
    FREE_HOLES,
    MAX_COORDINATE,
    MAX_HOLES,
    OUT_OF_RANGE,
    Source,
    expansion_budget,
    first_positions_text,
    point_budget,
    refuse_tiny_drawing,
    too_many_holes_error,
    unknown_units_issue,
)

#: Entities that can form a closed contour.
_LINES = ("LINE", "ARC", "LWPOLYLINE", "POLYLINE", "ELLIPSE", "SPLINE")
#: Minimum radius, mm. Smaller circles are drawing errors.
MIN_RADIUS = 1e-6

#: Entity types of an edge.
_KINDS = ("LINE", "ARC", "LWPOLYLINE", "POLYLINE")
#: Maximum number of edges to display. A plate only has a few edges, so a larger drawing shows something else.
MOST_EDGES = 5_000


def read_dxf(source: Source, options: ReadOptions) -> Part:
    """Read the holes in the model space of a DXF drawing, in mm.

    Raises
    ------
    ReadError
        The file is not DXF, is damaged or truncated, or contains no holes. The message lists the entities in the file.
    """
    issues: list[Issue] = []
    document = open_document(source, issues)
    factor, unit = drawing_units(document, options)
    walk = BlockWalk(
        document,
        expansion_budget(source, "blocks", FREE_HOLES),
        layer_filter_of_document(document, options),
        entity_to_hole_shape,
        "holes",
    )
    finds = HoleCollector(factor, source.path)
    for shape, matrix, layer in walk.shapes():
        source.on_progress()
        walk.copies(len(shape.curves) - 1)  # the walk counts a polyline of thousands of arcs as one shape
        finds.add(shape, matrix, layer)
    circles = finds.holes()
    polygons: list[Hole] = []
    paths: tuple[Polyline, ...] = ()
    others = walk.others + finds.others
    if any(kind in _LINES for kind in others + finds.squashed):
        from leafcut.read.besides_holes import collect_contours_besides_holes, hole_from_polygon  # start-up

        besides = collect_contours_besides_holes(
            document,
            walk.layers,
            expansion_budget(source, "blocks"),
            factor,
            source.path,
            point_budget(source),
            finds.owned,
        )
        classified = [(path, hole_from_polygon(path)) for path in besides.paths]
        paths = tuple(path for path, hole in classified if hole is None)
        polygons = [hole for _, hole in classified if hole is not None]
        others -= Counter(besides.entities)
    holes, frame_issues = holes_on_part_layers([*circles, *polygons], options)
    kept, selection_issues = select_holes(holes, options)
    selection_issues = [*frame_issues, *selection_issues]
    if polygons:
        selection_issues.append(_polygon_issue(polygons))
    if not kept:
        raise ReadError(source.path, _no_holes_message(walk, finds, selection_issues))
    undrilled: list[Issue] = []
    contours: list[Issue] = []
    outline_indices = outline_circle_indices(kept, paths)
    if paths or outline_indices:
        from leafcut.read.besides_holes import report_contours_besides_holes  # start-up

        outlines = [kept[k] for k in outline_indices]
        kept = tuple(hole for k, hole in enumerate(kept) if k not in outline_indices)
        undrilled, contours = report_contours_besides_holes(paths, kept, outlines)
    if not kept:
        raise ReadError(source.path, _no_holes_message(walk, finds, [*selection_issues, *undrilled]))
    issues += skipped_content_issues(walk) + finds.issues() + undrilled + _other_entity_notes(others)
    edge = read_contours_besides_holes(document, options, factor, source.path, point_budget(source), finds.owned)
    part = Part(
        source.name, kept, source=source.file_name, format="dxf", units=unit or "mm", edge=edge, besides=tuple(contours)
    )
    if len(kept) > 1:
        refuse_tiny_drawing(source.path, part, options)
    if unit is None:
        issues.insert(0, unknown_units_issue(Message("the drawing"), part, Severity.WARNING))
    n_points = sum(h.diameter == 0 for h in kept)
    if 0 < n_points < len(kept):
        selection_issues.append(
            Issue("L405", Message("treated {} in addition to the circles as holes", count_of(n_points, "POINT")))
        )
    return replace(part, issues=(*issues, *selection_issues))


@dataclass
class HoleCollector:
    """Collects holes, in mm, from shapes in drawing units. Shapes that are not holes are only counted."""

    factor: float
    path: str
    numbered_holes: list[tuple[int, Hole]] = field(default_factory=list)
    pieces: list[ArcPiece] = field(default_factory=list)
    #: Type, layer and handle of each entity that contributed arcs.
    owners: dict[int, tuple[str, str, str]] = field(default_factory=dict)
    leaning: list[tuple[float, float]] = field(default_factory=list)
    far: Counter[str] = field(default_factory=Counter)
    out_of_range: Counter[str] = field(default_factory=Counter)
    squashed: Counter[str] = field(default_factory=Counter)
    others: Counter[str] = field(default_factory=Counter)
    n_joined: int = 0
    #: Handles of the entities that became holes.
    owned: set[str] = field(default_factory=set)
    _number: int = 0

    def add(self, shape: Shape, matrix: Matrix, layer: str) -> None:
        """Place a shape, and add it as a hole or as a piece of a hole. Count the shape if it is neither."""
        self._number += 1
        pieces = []
        for local_curve in shape.curves:
            curve = transform_curve(matrix, local_curve)
            x, y = round(curve.center[0] * self.factor, 6), round(curve.center[1] * self.factor, 6)
            z = round(curve.center[2] * self.factor, 6)
            large, small = half_axes(curve)
            radius = 0.5 * (large + small) * self.factor
            if not (max(abs(x), abs(y), abs(z)) <= MAX_COORDINATE and radius <= MAX_COORDINATE):
                finite = all(math.isfinite(value) for value in (x, y, z, radius))
                (self.far if finite else self.out_of_range)[shape.dxftype] += 1
                return
            if shape.dxftype == "POINT":
                self._add_hole(Hole(x, y, 0.0, layer, shape.handle, z))
                return
            if not is_parallel_to_plate(curve):
                self._count_leaning(shape, x, y)
                return
            if large - small > ROUND * large:
                (self.others if shape.arcs else self.squashed)[shape.dxftype] += 1
                return
            if not radius >= MIN_RADIUS or not math.isfinite(curve.start + curve.sweep):
                self.out_of_range[shape.dxftype] += 1
                return
            pieces.append(ArcPiece(x, y, radius, *arc_span_in_top_view(curve), self._number, z))
        if shape.arcs:
            self.pieces += pieces
            self.owners[self._number] = (shape.dxftype, layer, shape.handle)
        else:
            self._add_hole(
                Hole(pieces[0].x, pieces[0].y, round(2 * pieces[0].radius, 6), layer, shape.handle, pieces[0].z)
            )

    def _add_hole(self, hole: Hole) -> None:
        self.numbered_holes.append((self._number, hole))
        if len(self.numbered_holes) > MAX_HOLES:
            raise too_many_holes_error(self.path)

    def _count_leaning(self, shape: Shape, x: float, y: float) -> None:
        if shape.arcs:
            self.others[shape.dxftype] += 1
        else:
            self.leaning.append((x, y))

    def holes(self) -> list[Hole]:
        """Return all holes in file order.

        Call this method only once, after all shapes were added, because it joins the arcs.
        """
        circles, used = join_arcs_to_circles(self.pieces)
        for piece in circles:
            _, layer, handle = self.owners[piece.entity]
            self.numbered_holes.append(
                (piece.entity, Hole(piece.x, piece.y, round(2 * piece.radius, 6), layer, handle, piece.z))
            )
        self.n_joined = len(circles)
        if len(self.numbered_holes) > MAX_HOLES:
            raise too_many_holes_error(self.path)
        self.owned = {hole.handle for _, hole in self.numbered_holes} | {self.owners[number][2] for number in used}
        self.others.update(kind for number, (kind, _, _) in self.owners.items() if number not in used)
        return [hole for _, hole in sorted(self.numbered_holes, key=lambda numbered: numbered[0])]

    def issues(self) -> list[Issue]:
        """Report the shapes that did not become holes."""
        issues = []
        if self.leaning:
            message = Message(
                "{} outside the plane of the plate will not be drilled", count_of(len(self.leaning), "circle")
            )
            missing = MissingWork("hole", len(self.leaning), tuple(self.leaning))
            issues.append(Issue("L202", message, first_positions_text(self.leaning), missing=missing))
        for kind, number in self.far.items():
            issues.append(
                Issue("L203", Message("{} {} {}", number, kind, OUT_OF_RANGE), missing=MissingWork("hole", number))
            )
        for kind, number in self.out_of_range.items():
            missing = MissingWork("hole", number)
            issues.append(
                Issue("L203", Message("{} {} with coordinates or radius out of range", number, kind), missing=missing)
            )
        for kind, number in self.squashed.items():
            if kind == "ELLIPSE":  # a closed ellipse is reported as a contour
                issues.append(Issue("L207", Message("{} {} not circular", number, kind), severity=Severity.NOTE))
                continue
            missing = MissingWork("hole", number)
            issues.append(
                Issue("L207", Message("{} {} scaled to an ellipse by its block", number, kind), missing=missing)
            )
        if self.n_joined:
            message = Message("{} made of arcs that close a circle", count_of(self.n_joined, "hole"))
            issues.append(Issue("L303", message, severity=Severity.NOTE))
        return issues


def _polygon_issue(holes: list[Hole]) -> Issue:
    sizes = ", ".join(f"Ø{diameter:.4g}" for diameter in sorted({round(hole.diameter, 3) for hole in holes})[:5])
    positions = [(hole.x, hole.y) for hole in holes]
    message = Message("treated {} with corners on a circle as round holes ({})", count_of(len(holes), "polygon"), sizes)
    return Issue("L405", message, first_positions_text(positions))


def _other_entity_notes(kinds: Counter[str]) -> list[Issue]:
    return [
        Issue("L201", Message("ignored {} {}, which cannot be a hole", number, printable(kind)), severity=Severity.NOTE)
        for kind, number in kinds.items()
    ]


def _no_holes_message(walk: BlockWalk[Shape], finds: HoleCollector, selection_issues: list[Issue]) -> Message:
    parts = [f"{number} {printable(kind)}" for kind, number in (walk.others + finds.others).most_common(6)]
    parts += [Message("{} {} not circular", number, kind) for kind, number in finds.squashed.items()]
    parts += [Message("{} {} {}", number, kind, OUT_OF_RANGE) for kind, number in finds.far.items()]
    parts += [Message("{} {} with numbers out of range", number, kind) for kind, number in finds.out_of_range.items()]
    if finds.leaning:
        parts.append(Message("{} not in the plane", count_of(len(finds.leaning), "circle")))
    if walk.broken:
        parts.append(Message("{} damaged", len(walk.broken)))
    if walk.missing_blocks or walk.endless_blocks:
        parts.append(Message("blocks that are missing or refer to themselves"))
    parts += [issue.message for issue in selection_issues]
    if walk.hidden:
        parts.append(Message("on layers that are off, frozen or not chosen: {}", hidden_counts_text(walk)))
    if not parts:
        parts.append(Message("the drawing is empty"))
    elif any(kind in _LINES for kind in walk.others + finds.others):
        parts.append(Message("use leafcut cut or leafcut part for contours, or leafcut pocket for pockets"))
    return Message("no holes: {}", Message.joined("; ", parts))


def read_contours_besides_holes(
    document: Any, options: ReadOptions, factor: float, path: str, points: Spend, holes: Collection[str]
) -> tuple[Contour, ...]:
    """Read the lines, arcs and polylines in model space that are not holes, in mm.

    `holes` contains the handles of the entities that became holes. The function skips blocks, damaged entities, and
    layers that are off or frozen. It ignores the layer selection, because these contours are not machined.
    """
    layers = layer_filter_of_document(document, replace(options, layers=()))
    strokes = Strokes(factor, path, points)
    try:
        for entity in document.modelspace():
            if entity.dxftype() in _KINDS:
                if len(strokes.contours) >= MOST_EDGES:
                    return ()
                _add_stroke(entity, layers, holes, strokes)
    except ReadError:  # the drawing exceeds its point budget, which is no reason to refuse its holes
        return ()
    return tuple(strokes.contours)


def _add_stroke(entity: Any, layers: LayerFilter, holes: Collection[str], strokes: Strokes) -> None:
    try:
        layer, handle = entity.dxf.get("layer", "0"), entity.dxf.get("handle") or ""
        hidden = not layers.shows(layer) or bool(entity.dxf.get("invisible", 0))
        stroke = None if hidden or handle in holes else entity_to_stroke(entity)
    except Exception:  # ezdxf raises almost any exception on a damaged entity; the hole reader reports it
        return
    if stroke is not None:
        strokes.add(stroke._replace(kind="sheet", name=""), IDENTITY, layer)
