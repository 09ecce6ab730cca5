"""Read well-known text (OGC 06-103r4, section 7).

Polygons and collections of polygons become pockets with islands.
"""

from __future__ import annotations

import itertools
import re
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from leafcut.errors import ReadError, parser_errors, printable
from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.model.pocket import ISLAND, POCKET
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.format import (
    MAX_COORDINATE,
    MAX_SEGMENTS,
    Source,
    drawing_unit_mm,
    first_positions_text,
    too_many_segments_error,
    unknown_units_issue,
)

#: Maximum size of a text, bytes. A million corners need less.
MAX_BYTES = 64 * 1024 * 1024
#: Maximum nesting depth of collections, to protect the stack of the parser.
MAX_DEPTH = 20
#: Number of points in the smallest ring: three corners, and the first corner again.
_RING = 4

_PREFIX = re.compile(r"\s*SRID\s*=\s*\d+\s*;", re.IGNORECASE)
#: Separators between geometries.
_BETWEEN = " \t\r\n;"
_BRACKET_OR_EMPTY = re.compile(r"[()]|\bEMPTY\b", re.IGNORECASE)


def read_wkt_pockets(source: Source, options: ReadOptions, _: PocketDrawingOptions, joining: SheetOptions) -> Part:
    """Read the polygons of a text as pockets, in mm. The interior rings of a polygon become islands.

    A file may contain several geometries in sequence.

    Raises
    ------
    ReadError
        The text is too large, nested too deeply, or damaged (the message names the line), or contains no polygon. The
        error is also raised if a polygon crosses itself, touches or overlaps another polygon, or has corners that are
        not finite.
    """
    from leafcut.read.pocket_outlines import contours_to_pockets  # start-up

    if len(source.data) > MAX_BYTES:
        raise ReadError(source.path, Message("the text has more than {} MiB; split it", MAX_BYTES >> 20))
    factor = drawing_unit_mm(options, None)
    rings, issues = _RingCollector(source.path, factor), []
    for line, text in _split_geometries(source):
        source.on_progress()
        rings.add(_parse_geometry(source.path, line, text), line)
    if not rings.rings:
        kinds = ", ".join(sorted(rings.others)) or Message("empty geometries")
        raise ReadError(
            source.path, Message("no region to mill: the text contains {}; POLYGON or MULTIPOLYGON was expected", kinds)
        )
    if rings.others:
        words = ", ".join(f"{number} {kind}" for kind, number in sorted(rings.others.items()))
        issues.append(Issue("L210", Message("no region: {}", words), severity=Severity.NOTE))
    if rings.heights:
        message = Message("corners have different heights and were projected onto the plane")
        issues.append(Issue("L202", message, first_positions_text(rings.heights)))
    contours = tuple(Contour(Polyline.of_points(ring.points, closed=True)) for ring in rings.rings)
    part = Part(source.name, source=source.file_name, format="wkt", units=options.units or "mm", contours=contours)
    if options.units is None:
        issues.insert(0, unknown_units_issue(Message("the text"), part, Severity.NOTE))
    return contours_to_pockets(
        replace(part, issues=tuple(issues)), [ring.kind for ring in rings.rings], joining, source.path
    )


def _split_geometries(source: Source) -> Iterator[tuple[int, str]]:
    """Yield each geometry with its first line. A geometry ends at its closing bracket."""
    text = source.text()
    piece_start = depth = counted = 0
    line = 1
    for match in itertools.chain(_BRACKET_OR_EMPTY.finditer(text), [None]):
        if match is not None:
            depth += {"(": 1, ")": -1}.get(match[0], 0)
            if depth > MAX_DEPTH:
                raise ReadError(source.path, Message("brackets nested more than {} deep", MAX_DEPTH), line)
            if depth > 0:
                continue
        piece = text[piece_start : match.end() if match else len(text)]
        start = piece_start + len(piece) - len(piece.lstrip(_BETWEEN))
        line, counted = line + text.count("\n", counted, start), start
        if piece.strip(_BETWEEN):
            yield line, piece.strip(_BETWEEN)
        piece_start, depth = piece_start + len(piece), 0


def _parse_geometry(path: str, line: int, text: str) -> Any:
    import shapely  # start-up

    with parser_errors(path, Message("this is not well-known text (WKT)"), line), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # invalid numbers are reported below
        try:
            prefix = _PREFIX.match(text)
            return shapely.from_wkt(text[prefix.end() if prefix else 0 :].strip())
        except (shapely.errors.ShapelyError, NotImplementedError) as problem:
            message = printable(str(problem), 120)
            reason = message.removeprefix("ParseException: ").removeprefix("IllegalArgumentException: ")
            raise ReadError(path, Message("this is not well-known text (WKT): {}", reason), line) from None


class _Ring(NamedTuple):
    """A wall or an island of a pocket. Corners are in mm, and the last corner repeats the first corner."""

    points: Points
    kind: str


class _RingCollector:
    """Collects the rings of all polygons, in mm, and counts all other geometries."""

    def __init__(self, path: str, factor: float) -> None:
        self.path = path
        self.factor = factor
        self.rings: list[_Ring] = []
        self.others: dict[str, int] = {}
        #: First point of each ring that is not level.
        self.heights: list[tuple[float, float]] = []
        self._corners = 0

    def add(self, geometry: Any, line: int) -> None:
        if geometry is None or geometry.is_empty:
            return
        if geometry.geom_type == "Polygon":
            self._add_ring(geometry.exterior, POCKET, line)
            for ring in geometry.interiors:
                self._add_ring(ring, ISLAND, line)
        elif hasattr(geometry, "geoms"):
            for piece in geometry.geoms:
                self.add(piece, line)
        else:
            kind = geometry.geom_type.upper()
            self.others[kind] = self.others.get(kind, 0) + 1

    def _add_ring(self, ring: Any, kind: str, line: int) -> None:
        import shapely  # start-up

        if ring.is_empty:
            return
        points = shapely.get_coordinates(ring, include_z=bool(ring.has_z)) * self.factor
        if not np.isfinite(points).all():
            raise ReadError(self.path, "a coordinate is not a number", line)
        if np.abs(points).max() > MAX_COORDINATE:
            raise ReadError(self.path, Message("a coordinate of {:.6g} mm is out of range", np.abs(points).max()), line)
        if len(points) < _RING:
            raise ReadError(
                self.path,
                Message("a ring has {} points; it needs at least 4, and the last must repeat the first", len(points)),
                line,
            )
        self._corners += len(points)
        if self._corners > MAX_SEGMENTS:
            raise too_many_segments_error(self.path)
        if points.shape[1] > 2 and np.ptp(points[:, 2]) > 0.0:
            self.heights.append((float(points[0, 0]), float(points[0, 1])))
        xy = points[:, :2]
        self.rings.append(_Ring(xy if self.factor == 1.0 else np.round(xy, 6), kind))
