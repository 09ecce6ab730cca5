"""Read SVG drawings for sheet cutting: paths, basic shapes, transforms, units and uses, but no texts or pictures.

The files are untrusted. The reader refuses entities and external references (defusedxml), and opens no other file. The
y axis of SVG points down, so the reader flips the part to look the same as on the screen.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from leafcut.errors import LeafcutError, ReadError, count_of, printable
from leafcut.message import Message, map_text
from leafcut.model.contour import Contour, layer_filter
from leafcut.model.heartbeat import Heartbeat
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Part
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.format import (
    CURVE_TOLERANCE,
    MAX_COORDINATE,
    MAX_SEGMENTS,
    OUT_OF_RANGE,
    ReadBudget,
    Source,
    convert_xml_errors,
    expansion_budget,
    point_budget,
    too_many_segments_error,
)
from leafcut.read.svg_shapes import SHAPES, SvgSubpath, ViewSize, place_subpath, shape_subpaths
from leafcut.read.svg_transform import (
    PHYSICAL,
    PX_PER_UNIT,
    Affine,
    parse_class_rules,
    parse_length,
    parse_style,
    parse_transform,
    parse_view_box,
    split_length,
    viewport_transform,
)
from leafcut.units import MM_PER_UNIT

MAX_BYTES = 64 * 1024 * 1024
MAX_DEPTH = 100
MM_PER_PX = 25.4 / 96.0

#: Container elements, which are drawn in place.
GROUPS = ("g", "a", "switch", "svg")
#: Elements whose content is drawn only by a `use`, or never.
UNDRAWN = ("defs", "symbol", "clippath", "mask", "marker", "pattern", "lineargradient", "radialgradient", "filter")
#: The style properties used here.
_STYLED = ("display", "visibility", "stroke", "clip-path", "mask")
SILENT = ("style", "title", "desc", "metadata", "namedview", "script")


def read_svg_contours(source: Source, options: ReadOptions) -> Part:
    """Read the paths and shapes of an SVG drawing as contours, in mm. Each subpath becomes one contour.

    The layer of a contour is the name of its Inkscape layer. Without an Inkscape layer, the layer is the class of the
    element, or else its stroke colour.

    Raises
    ------
    ReadError
        The file is not well-formed, declares entities, or contains nothing to cut.
    """
    root = _parse_root(source)
    issues: list[Issue] = []
    page, has_size = _parse_page(root, options, source.path)
    walk = _Walk(
        source.path,
        page,
        layer_filter(options.layers),
        point_budget(source),
        expansion_budget(source, "uses"),
        source.on_progress,
    )
    walk.index_elements(root)
    walk.visit_children(root, _Context(page.matrix), 0, ())
    issues += walk.issues()
    if not walk.contours:
        reasons = Message.joined("; ", (i.message for i in issues)) or Message("the drawing is empty")
        raise ReadError(source.path, Message("there is nothing to cut: {}", reasons))
    units = options.units or "mm"
    part = Part(source.name, source=source.file_name, format="svg", units=units, contours=tuple(walk.contours))
    if not has_size:
        extents = part.extents
        size = Message("{:.6g} × {:.6g} mm", extents[2] - extents[0], extents[3] - extents[1])
        message = Message(
            "the drawing gives its size in pixels only: {} at 96 per inch; set --units if that is wrong", size
        )
        issues.insert(0, Issue("L102", message))
    return replace(part, issues=tuple(issues))


def read_svg_pockets(
    source: Source, options: ReadOptions, pocket_options: PocketDrawingOptions, joining: SheetOptions
) -> Part:
    """Read the outlines of an SVG drawing as pockets with islands, in mm.

    Raises the same errors as `read_svg_contours` and `drawing_to_pockets`.
    """
    from leafcut.read.pocket_outlines import drawing_to_pockets  # start-up

    return drawing_to_pockets(read_svg_contours(source, options), pocket_options, joining, source.path)


class _Page(NamedTuple):
    """The transform from user units to mm with y pointing up, and the reference size for percentages."""

    matrix: Affine
    frame: ViewSize


def _parse_root(source: Source) -> Any:
    from defusedxml.ElementTree import fromstring

    if len(source.data) > MAX_BYTES:
        raise ReadError(source.path, Message("the drawing has more than {} MiB; split it", MAX_BYTES >> 20))
    with convert_xml_errors(source.path, Message("which it does not need; save it as plain SVG")):
        root = fromstring(source.data, forbid_dtd=False, forbid_entities=True, forbid_external=True)
    if _tag_name(root) != "svg":
        raise ReadError(
            source.path, Message("this is not an SVG drawing: its root is <{}>", printable(_tag_name(root), 30))
        )
    return root


def _tag_name(element: Any) -> str:
    tag = element.tag
    return tag.rpartition("}")[2].lower() if isinstance(tag, str) else ""


def _parse_page(root: Any, options: ReadOptions, path: str) -> tuple[_Page, bool]:
    """Return the page of a drawing, and whether the file states a physical size."""
    try:
        box = parse_view_box(root.get("viewBox", ""))
        sizes = [split_length(root.get(name, "100%")) for name in ("width", "height")]
        if box and len(box) != 4:
            raise ValueError(Message("a view box needs four numbers"))
        view_size = [box[2] if box else 0.0, box[3] if box else 0.0]
        px = [v * PX_PER_UNIT[u] if u != "%" else reference for (v, u), reference in zip(sizes, view_size, strict=True)]
        fit = viewport_transform(box, px[0], px[1], root.get("preserveAspectRatio", "")) if box else Affine()
    except ValueError as problem:
        raise ReadError(path, Message("the size of the drawing is invalid: {}", problem)) from None
    mm, has_size = MM_PER_PX, any(unit in PHYSICAL for _, unit in sizes)
    if options.units:
        # The user's unit applies to the numbers in the drawing.
        fit, mm, has_size = (Affine(e=-box[0], f=-box[1]) if box else Affine()), MM_PER_UNIT[options.units], True
        px = view_size if box else px
    matrix = Affine(mm, 0.0, 0.0, -mm, 0.0, px[1] * mm).after(fit)
    return _Page(matrix, ViewSize(box[2] if box else px[0], box[3] if box else px[1])), has_size


class _Attributes(NamedTuple):
    """The attributes of an element that stay the same wherever the element is drawn."""

    shown: bool
    #: Empty if the element does not set the visibility.
    visibility: str
    matrix: Affine | None
    layer: str
    css: str
    stroke: str
    clipped: bool
    href: str


class _Context(NamedTuple):
    matrix: Affine
    layer: str = ""
    css: str = ""
    stroke: str = ""
    clipped: bool = False
    #: Shapes inherit the visibility of their groups. Unlike `display`, a shape may be visible in a hidden group.
    visibility: str = ""


@dataclass
class _Walk:
    """Visits every drawn element, including each `use`, and counts skipped elements."""

    path: str
    page: _Page
    chosen: Any
    points: ReadBudget
    copies: ReadBudget
    on_progress: Heartbeat
    contours: list[Contour] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)
    hidden: Counter[str] = field(default_factory=Counter)
    unfollowed: Counter[str] = field(default_factory=Counter)
    broken: dict[str, list[str]] = field(default_factory=dict)
    n_clipped: int = 0
    _by_id: dict[str, Any] = field(default_factory=dict)
    _rules: dict[str, dict[str, str]] = field(default_factory=dict)
    _segments: int = 0
    #: Results for elements that a `use` draws, or the exceptions raised for them. Further copies only need to be
    #: placed.
    _cache: dict[tuple[str, int], Any] = field(default_factory=dict)

    def index_elements(self, root: Any) -> None:
        """Index the ids and the style rules. Raise an error if elements are nested deeper than `MAX_DEPTH`."""
        waiting = [(root, 0)]
        while waiting:
            element, depth = waiting.pop()
            if depth > MAX_DEPTH:
                raise ReadError(self.path, Message("groups nested more than {} deep; ungroup them", MAX_DEPTH))
            if name := element.get("id"):
                self._by_id.setdefault(name, element)
            if _tag_name(element) == "style":
                rules = parse_class_rules("".join(element.itertext()))
                self._rules.update({name: {n: rule[n] for n in _STYLED if n in rule} for name, rule in rules.items()})
            waiting.extend((child, depth + 1) for child in element)

    def visit_children(self, element: Any, context: _Context, depth: int, trail: tuple[str, ...]) -> None:
        for child in element:
            self._visit_element(child, context, depth + 1, trail)

    def _visit_element(self, element: Any, outer: _Context, depth: int, trail: tuple[str, ...]) -> None:
        self.copies(1)
        self.on_progress()
        tag = _tag_name(element)
        if not tag or tag in UNDRAWN or tag in SILENT:
            return
        try:
            attributes = self._cached("own", element, self._parse_attributes, trail)
            context = self._inherited_context(attributes, outer)
            if not attributes.shown or (tag in SHAPES and context.visibility in ("hidden", "collapse")):
                self.hidden[Message("not shown")] += 1
                return
            if tag in GROUPS:
                self.visit_children(
                    element, self._viewport_context(element, context) if tag == "svg" else context, depth, trail
                )
            elif tag == "use":
                self._visit_use(element, attributes.href, context, depth, trail)
            elif tag in SHAPES:
                self._draw_shape(tag, element, context, trail)
            else:
                self.others[tag] += 1
        except (ValueError, ArithmeticError, LeafcutError) as problem:
            if isinstance(problem, ReadError):
                raise
            reason = map_text(str(problem) or type(problem).__name__, lambda text: printable(text, 80))
            self.broken.setdefault(Message("<{}>: {}", tag, reason), []).append(printable(element.get("id", "?"), 30))

    def _resolve_style(self, element: Any) -> dict[str, str]:
        """Return the style of an element. Classes override attributes, and the style attribute overrides classes."""
        properties = {n: element.get(n) for n in _STYLED if element.get(n)}
        for name in element.get("class", "").split():
            properties.update(self._rules.get(name, {}))
        return {**properties, **parse_style(element.get("style", ""))}

    def _cached(self, what: str, element: Any, make: Callable[[Any], Any], trail: tuple[str, ...]) -> Any:
        """Return `make(element)`, and cache the result if a `use` draws the element.

        Without the cache, a few thousand copies of a long path would take hours.
        """
        if not trail:
            return make(element)
        key = what, id(element)
        if key not in self._cache:
            try:
                self._cache[key] = make(element)
            except (ValueError, ArithmeticError, LeafcutError) as problem:
                self._cache[key] = problem
        result = self._cache[key]
        if isinstance(result, Exception):
            raise result
        return result

    def _parse_attributes(self, element: Any) -> _Attributes:
        style = self._resolve_style(element)
        attributes = {k.rpartition("}")[2]: v for k, v in element.attrib.items()}
        layer = attributes.get("label", "") if attributes.get("groupmode") == "layer" else ""
        classes = attributes.get("class", "").split()
        stroke = style.get("stroke", "")
        shown = style.get("display") != "none"
        visibility = style.get("visibility", "")
        return _Attributes(
            shown,
            "" if visibility == "inherit" else visibility,
            parse_transform(attributes["transform"]) if shown and attributes.get("transform") else None,
            " ".join(layer.split())[:100],
            classes[0][:100] if classes else "",
            " ".join(stroke.split())[:40] if stroke and stroke != "none" else "",
            any(style.get(n, "none") != "none" for n in ("clip-path", "mask")),
            next((v for k, v in element.attrib.items() if k.rpartition("}")[2] == "href"), ""),
        )

    def _inherited_context(self, attributes: _Attributes, outer: _Context) -> _Context:
        return _Context(
            outer.matrix if attributes.matrix is None else outer.matrix.after(attributes.matrix),
            attributes.layer or outer.layer,
            attributes.css or outer.css,
            attributes.stroke or outer.stroke,
            attributes.clipped or outer.clipped,
            attributes.visibility or outer.visibility,
        )

    def _viewport_context(self, element: Any, context: _Context) -> _Context:
        frame = self.page.frame
        x, y = parse_length(element.get("x", "0"), frame.width), parse_length(element.get("y", "0"), frame.height)
        w = parse_length(element.get("width", "100%"), frame.width)
        h = parse_length(element.get("height", "100%"), frame.height)
        box = parse_view_box(element.get("viewBox", ""))
        inner = viewport_transform(box, w, h, element.get("preserveAspectRatio", "")) if len(box) == 4 else Affine()
        return context._replace(matrix=context.matrix.after(Affine(e=x, f=y)).after(inner))

    def _visit_use(self, element: Any, name: str, context: _Context, depth: int, trail: tuple[str, ...]) -> None:
        target = self._by_id.get(name[1:]) if name.startswith("#") else None
        if target is None or name in trail or depth > MAX_DEPTH:
            self.unfollowed[name or "without a name"] += 1
            return
        frame = self.page.frame
        x, y = parse_length(element.get("x", "0"), frame.width), parse_length(element.get("y", "0"), frame.height)
        context = context._replace(matrix=context.matrix.after(Affine(e=x, f=y)))
        if _tag_name(target) == "symbol":
            if target.get("viewBox"):
                size = {n: element.get(n) or target.get(n) or "100%" for n in ("width", "height")}
                w, h = parse_length(size["width"], frame.width), parse_length(size["height"], frame.height)
                inner = viewport_transform(
                    parse_view_box(target.get("viewBox")), w, h, target.get("preserveAspectRatio", "")
                )
                context = context._replace(matrix=context.matrix.after(inner))
            self.visit_children(target, context, depth, (*trail, name))
        else:
            self._visit_element(target, context, depth + 1, (*trail, name))

    def _draw_shape(self, tag: str, element: Any, context: _Context, trail: tuple[str, ...]) -> None:
        layer = context.layer or context.css or context.stroke
        if not self.chosen(layer):
            self.hidden[Message("on layer {}", printable(layer))] += 1
            return
        outlines = self._cached("outlines", element, lambda e: shape_subpaths(tag, e.attrib, self.page.frame), trail)
        self.n_clipped += context.clipped
        for outline in outlines:
            self._add_contour(outline, context, layer, element.get("id", ""))

    def _add_contour(self, outline: SvgSubpath, context: _Context, layer: str, name: str) -> None:
        self._count_segments(len(outline.pieces))  # before placing: some pieces may have no length
        with np.errstate(all="ignore"):
            path = place_subpath(outline, context.matrix, CURVE_TOLERANCE, self.points)
            reach = 0.0 if path is None else np.abs(path.extents).max()
        if not reach <= MAX_COORDINATE:
            raise ValueError(OUT_OF_RANGE if np.isfinite(reach) else Message("coordinates out of range"))
        if path is None:
            return
        self._count_segments(max(path.n_segments - len(outline.pieces), 0))
        self.contours.append(Contour(path, layer=layer, handle=name[:100]))

    def _count_segments(self, segments: int) -> None:
        self._segments += segments
        if self._segments > MAX_SEGMENTS:
            raise too_many_segments_error(self.path)

    def issues(self) -> list[Issue]:
        issues = []
        if self.others:
            texts = ", ".join(f"{number} <{printable(kind, 30)}>" for kind, number in self.others.most_common(8))
            issues.append(
                Issue(
                    "L210",
                    Message("these objects will not be cut: {}; convert text to paths to cut it", texts),
                    severity=Severity.NOTE,
                )
            )
        if self.hidden:
            texts = Message.joined(", ", (Message("{} {}", n, reason) for reason, n in self.hidden.most_common(5)))
            issues.append(Issue("L204", Message("left out: {}", texts), severity=Severity.NOTE))
        for name, number in list(self.unfollowed.items())[:5]:
            message = Message(
                "{} of '{}', which is not in the drawing or refers to itself", count_of(number, "use"), printable(name)
            )
            issues.append(Issue("L206", message, missing=MissingWork("element", number)))
        for reason, names in list(self.broken.items())[:20]:
            location = Message("id {}", ", ".join(names[:3])) + (" …" if len(names) > 3 else "")
            missing = MissingWork("element", len(names))
            issues.append(Issue("L203", Message("{} skipped: {}", len(names), reason), location, missing=missing))
        if self.n_clipped:
            message = Message(
                "{} with a clip path or mask will be cut without clipping", count_of(self.n_clipped, "element")
            )
            issues.append(Issue("L215", message))
        return issues
