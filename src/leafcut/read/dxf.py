"""DXF drawings (ASCII and binary, R12 to R2018) through ezdxf: circles, and what amounts to circles, are holes.

Read are CIRCLE, arcs and bulged polylines that close a circle, circular ELLIPSE and POINT of model space, in blocks
too. A POINT is a hole of diameter 0 (a bare point) unless it marks the centre of a circle.
"""

from __future__ import annotations

import io
import logging
import math
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut.errors import ReadError
from leafcut.model import Hole, Issue, Part, Severity
from leafcut.options import ReadOptions
from leafcut.read.arcs import Piece, close_circles
from leafcut.read.dxf_blocks import INVISIBLE, Layers, Walk
from leafcut.read.dxf_shapes import ROUND, Matrix, Shape, half_axes, is_flat, moved, seen_span
from leafcut.read.format import (
    MAX_COORDINATE,
    MAX_HOLES,
    Format,
    Match,
    Source,
    count_of,
    factor_of,
    places_of,
    shown,
    too_many_holes,
    units_unknown,
)
from leafcut.read.sift import layer_filter, sift

BINARY_MARK = b"AutoCAD Binary DXF\r\n\x1a\x00"
#: ezdxf needs about 1.6 kB for a circle and 0.1 kB for a tag (two lines): beyond these it would eat the memory.
MAX_ENTITIES = 1_500_000
MAX_LINES = 30_000_000
#: Circles smaller than this are drawing errors, mm.
MIN_RADIUS = 1e-6

#: mm in one unit of $INSUNITS (DXF reference, HEADER section); 0 and what is not here is unknown.
INSUNITS = {
    1: 25.4,
    2: 304.8,
    3: 1609344.0,
    4: 1.0,
    5: 10.0,
    6: 1000.0,
    7: 1e6,
    8: 25.4e-6,
    9: 0.0254,
    10: 914.4,
    11: 1e-7,
    12: 1e-6,
    13: 1e-3,
    14: 100.0,
    15: 1e4,
    16: 1e5,
    21: 1200e3 / 3937,
    22: 100e3 / 3937,
    23: 3600e3 / 3937,
}
UNIT_NAMES = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 9: "mil", 13: "µm"}

#: Of what ezdxf repairs, this is a guess at a number: a hole would be where nobody drew it.
GUESSED_NUMBER = 117
#: And these touch no geometry: sections and tables that R12 should not have, the root dictionary, a letter.
TRIVIAL_REPAIRS = (9, 10, 14, 111)

_SECTION = re.compile(rb"(?:^|[\r\n])[ \t]*0[ \t]*\r?\n[ \t]*SECTION\b", re.IGNORECASE)
_END = re.compile(rb"[\r\n][ \t]*0[ \t]*\r?\n[ \t]*EOF[ \t]*(?:[\r\n\x1a\0]|$)", re.IGNORECASE)
_STRUCTURE = re.compile(rb"\n[ \t]*0[ \t]*\r?\n(?=[ \t]*[A-Za-z])")
_SECTION_END = re.compile(rb"\n[ \t]*0[ \t]*\r?\n[ \t]*ENDSEC\b")
_LINE = re.compile(r"\bline:? (\d+)")


def sniff(head: bytes) -> Match:
    """Say whether a file begins as a DXF does: the binary mark, or group code 0 with SECTION."""
    if head.startswith(BINARY_MARK) or _SECTION.search(head[:4096].replace(b"\r\n", b"\n").replace(b"\r", b"\n")):
        return Match.YES
    return Match.NO


def read_dxf(source: Source, options: ReadOptions) -> Part:
    """Return the holes of a DXF drawing's model space, in mm.

    Raises
    ------
    ReadError
        It is no DXF, is damaged or cut off, or holds no holes; says what was found instead.
    """
    issues: list[Issue] = []
    document = _document(source, issues)
    factor, unit = _units(document, options)
    walk = Walk(document, source.path, _layers(document, options))
    finds = Finds(factor, source.path)
    for shape, matrix, layer in walk.shapes():
        finds.add(shape, matrix, layer)
    holes = finds.holes()
    issues += _walk_issues(walk) + finds.issues() + _not_holes(walk.others + finds.others)
    kept, noticed = sift(holes, options)
    if not kept:
        raise ReadError(source.path, _nothing(walk, finds, document, options, noticed))
    part = Part(source.name, kept, source=source.file_name, format="dxf", units=unit or "mm")
    if unit is None:
        issues.insert(0, units_unknown("the drawing", part, Severity.WARNING))
    bare = sum(h.diameter == 0 for h in kept)
    if 0 < bare < len(kept):
        noticed.append(Issue("L405", f"{count_of(bare, 'POINT')} beside the circles: taken as holes to drill"))
    return replace(part, issues=(*issues, *noticed))


def _document(source: Source, issues: list[Issue]) -> Any:
    """Return the ezdxf document, loaded with its repairs but without its audit.

    The audit deletes circles whose handle is used twice, and follows all paths through nested blocks, which a
    hundred lines of DXF can make endless; what it would find about holes and blocks, the walk finds itself.
    """
    data = source.data
    if data[:4] == b"AC10":
        raise ReadError(source.path, "this is a DWG drawing; save it as DXF")
    binary = data.startswith(BINARY_MARK)
    if not binary:
        if b"\n" not in data:
            data = data.replace(b"\r", b"\n")
        if not _SECTION.search(data[:65536]):
            raise ReadError(source.path, "this is no DXF drawing: it does not begin with group code 0 and SECTION")
        _check_whole(source.path, data, issues)
    elif b"EOF\0" not in data[-64:]:
        raise ReadError(source.path, "the drawing is cut off: its end is missing; save or send it again")
    with _quiet():
        try:
            document = _load_binary(data) if binary else _load_text(source.path, data, issues)
            document.modelspace()
            return document
        except ReadError:
            raise
        except Exception as problem:  # ezdxf raises nearly anything on a damaged file
            text = shown(str(problem), 160) or type(problem).__name__
            line = _LINE.search(text)
            reason = f"the drawing is damaged and could not be repaired: {text}"
            raise ReadError(source.path, reason, int(line.group(1)) if line else None) from None


def _check_whole(path: str, data: bytes, issues: list[Issue]) -> None:
    lines = data.count(b"\n")
    if lines > MAX_LINES or sum(1 for _ in _STRUCTURE.finditer(data)) > MAX_ENTITIES:
        raise ReadError(path, f"the drawing has more than {MAX_ENTITIES:,} entities or {MAX_LINES:,} lines; split it")
    if end := _END.search(data):
        if data[end.end() :].strip(b" \t\r\n\0\x1a"):
            issues.append(Issue("L101", "the drawing goes on after its end (EOF); what follows was not read"))
        return
    start = data.rfind(b"ENTITIES")
    if start < 0 or not _SECTION_END.search(data, start):
        raise ReadError(path, "the drawing is cut off: its end is missing; save or send it again", lines)
    issues.append(Issue("L101", "the drawing ends without EOF; its entities are complete"))


def _load_binary(data: bytes) -> Any:
    from ezdxf.document import Drawing
    from ezdxf.lldxf.tagger import binary_tags_loader

    return Drawing.load(binary_tags_loader(data))


def _load_text(path: str, data: bytes, issues: list[Issue]) -> Any:
    from ezdxf.document import Drawing
    from ezdxf.recover import Recover

    tool = Recover.run(io.BytesIO(data))
    for code, message in tool.errors:
        if code == GUESSED_NUMBER:
            line = _LINE.search(message)
            what = shown(message.split(" near ")[0].replace("recovered ", ""))
            reason = f"{what}; a guess would put holes where none are"
            raise ReadError(path, reason, int(line.group(1)) if line else None)
    document = Drawing()
    document._load_section_dict(tool.section_dict)
    repairs = [message for code, message in (*tool.errors, *tool.fixes) if code not in TRIVIAL_REPAIRS]
    if repairs:
        more = f" (and {len(repairs) - 1} more)" if len(repairs) > 1 else ""
        issues.append(Issue("L101", f"the drawing was damaged: {shown(repairs[0], 100)}{more}"))
    return document


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep ezdxf's warnings off the terminal: what matters of them becomes an `Issue`."""
    logger = logging.getLogger("ezdxf")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


def _units(document: Any, options: ReadOptions) -> tuple[float, str | None]:
    """Return mm per drawing unit, and the unit's name, None when it is only assumed."""
    if options.units:
        return factor_of(options, None), options.units
    code = document.header.get("$INSUNITS", 0)
    if code not in INSUNITS:
        return 1.0, None
    return INSUNITS[code], UNIT_NAMES.get(code, f"$INSUNITS {code}")


def _layers(document: Any, options: ReadOptions) -> Layers:
    frozen, off = set(), set()
    for layer in document.layers:
        name = str(layer.dxf.get("name", "")).casefold()
        if layer.is_frozen():
            frozen.add(name)
        if layer.is_off():
            off.add(name)
    return Layers(frozen, off, layer_filter(options.layers))


@dataclass
class Finds:
    """Collects holes in mm from shapes in drawing units, and counts what is none."""

    factor: float
    path: str
    found: list[tuple[int, Hole]] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    #: Of every entity that gave pieces: type, layer, handle.
    owners: dict[int, tuple[str, str, str]] = field(default_factory=dict)
    leaning: list[tuple[float, float]] = field(default_factory=list)
    absurd: Counter[str] = field(default_factory=Counter)
    squashed: Counter[str] = field(default_factory=Counter)
    others: Counter[str] = field(default_factory=Counter)
    n_joined: int = 0
    _number: int = 0

    def add(self, shape: Shape, matrix: Matrix, layer: str) -> None:
        """Take one shape at its place: a hole, pieces of one, or something to count."""
        self._number += 1
        pieces = []
        for own in shape.curves:
            curve = moved(matrix, own)
            x, y = round(curve.center[0] * self.factor, 6), round(curve.center[1] * self.factor, 6)
            large, small = half_axes(curve)
            radius = 0.5 * (large + small) * self.factor
            if not (abs(x) <= MAX_COORDINATE and abs(y) <= MAX_COORDINATE and radius <= MAX_COORDINATE):
                self.absurd[shape.dxftype] += 1
                return
            if shape.dxftype == "POINT":
                self._keep(Hole(x, y, 0.0, layer, shape.handle))
                return
            if not is_flat(curve):
                self._lean(shape, x, y)
                return
            if large - small > ROUND * large:
                (self.others if shape.arcs else self.squashed)[shape.dxftype] += 1
                return
            if not radius >= MIN_RADIUS or not math.isfinite(curve.start + curve.sweep):
                self.absurd[shape.dxftype] += 1
                return
            pieces.append(Piece(x, y, radius, *seen_span(curve), self._number))
        if shape.arcs:
            self.pieces += pieces
            self.owners[self._number] = (shape.dxftype, layer, shape.handle)
        else:
            self._keep(Hole(pieces[0].x, pieces[0].y, round(2 * pieces[0].radius, 6), layer, shape.handle))

    def _keep(self, hole: Hole) -> None:
        self.found.append((self._number, hole))
        if len(self.found) > MAX_HOLES:
            raise too_many_holes(self.path)

    def _lean(self, shape: Shape, x: float, y: float) -> None:
        if shape.arcs:
            self.others[shape.dxftype] += 1
        else:
            self.leaning.append((x, y))

    def holes(self) -> list[Hole]:
        """Return all holes in the order of the drawing; arcs are joined here, so call it once, at the end."""
        circles, used = close_circles(self.pieces)
        for piece in circles:
            _, layer, handle = self.owners[piece.entity]
            self.found.append((piece.entity, Hole(piece.x, piece.y, round(2 * piece.radius, 6), layer, handle)))
        self.n_joined = len(circles)
        if len(self.found) > MAX_HOLES:
            raise too_many_holes(self.path)
        self.others.update(kind for number, (kind, _, _) in self.owners.items() if number not in used)
        return [hole for _, hole in sorted(self.found, key=lambda numbered: numbered[0])]

    def issues(self) -> list[Issue]:
        """Return what was noticed about shapes."""
        found = []
        if self.leaning:
            message = f"{count_of(len(self.leaning), 'circle')} not in the plane of the plate"
            found.append(Issue("L202", message, places_of(self.leaning, len(self.leaning))))
        for kind, number in self.absurd.items():
            found.append(Issue("L203", f"{number} {kind} with coordinates or radius that cannot be meant"))
        for kind, number in self.squashed.items():
            severity = Severity.NOTE if kind == "ELLIPSE" else Severity.WARNING
            what = "not circular" if kind == "ELLIPSE" else "scaled to an ellipse by its block"
            found.append(Issue("L207", f"{number} {kind} {what}", severity=severity))
        if self.n_joined:
            message = f"{count_of(self.n_joined, 'hole')} made of arcs that close a circle"
            found.append(Issue("L303", message, severity=Severity.NOTE))
        return found


def _not_holes(kinds: Counter[str]) -> list[Issue]:
    return [Issue("L201", f"{number} {shown(kind)}: no hole", severity=Severity.NOTE) for kind, number in kinds.items()]


def _walk_issues(walk: Walk) -> list[Issue]:
    found = []
    reasons: dict[tuple[str, str], list[str]] = {}
    for kind, handle, reason in walk.broken:
        reasons.setdefault((kind, reason), []).append(handle)
    for (kind, reason), handles in reasons.items():
        place = f"handle {', '.join(h or '?' for h in handles[:3])}" + (" …" if len(handles) > 3 else "")
        found.append(Issue("L203", f"{len(handles)} {shown(kind)} skipped: {shown(reason)}", place))
    if walk.hidden:
        found.append(Issue("L204", f"left out: {_by_layer(walk)}", severity=Severity.NOTE))
    for name, number in walk.missing_blocks.items():
        found.append(Issue("L206", f"{count_of(number, 'insertion')} of block '{shown(name)}', which is not there"))
    for name, number in walk.endless_blocks.items():
        message = (
            f"block '{shown(name)}' refers to itself or is nested too deep: {count_of(number, 'insertion')} skipped"
        )
        found.append(Issue("L206", message))
    return found


def _by_layer(walk: Walk) -> str:
    named = [f"{n} on layer {shown(layer)}" for layer, n in walk.hidden.most_common(5) if layer != INVISIBLE]
    if invisible := walk.hidden.get(INVISIBLE):
        named.append(f"{invisible} invisible")
    return ", ".join(named) + (" …" if len(walk.hidden) > 5 else "")


def _nothing(walk: Walk, finds: Finds, document: Any, options: ReadOptions, noticed: list[Issue]) -> str:
    """Return why there are no holes: what was found instead, in one line."""
    parts = [f"{number} {shown(kind)}" for kind, number in (walk.others + finds.others).most_common(6)]
    parts += [f"{number} {kind} not circular" for kind, number in finds.squashed.items()]
    parts += [f"{number} {kind} with impossible numbers" for kind, number in finds.absurd.items()]
    if finds.leaning:
        parts.append(f"{count_of(len(finds.leaning), 'circle')} not in the plane")
    if walk.broken:
        parts.append(f"{len(walk.broken)} damaged")
    if walk.missing_blocks or walk.endless_blocks:
        parts.append("blocks that are missing or refer to themselves")
    parts += [issue.message for issue in noticed]
    if walk.hidden:
        parts.append(f"on layers that are off, frozen or not chosen: {_by_layer(walk)}")
    if options.layers:
        names = sorted(str(layer.dxf.get("name", "")) for layer in document.layers)
        parts.append(f"the drawing has the layers {shown(', '.join(names), 120)}")
    return f"no holes: {'; '.join(parts) or 'the drawing is empty'}"


FORMAT = Format("dxf", (".dxf",), "drawing (AutoCAD DXF, text or binary): circles are holes", read_dxf, sniff)
