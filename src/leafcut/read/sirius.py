"""Read sheets of the Sirius CAM system in JSON (``*.dbs.json``).

The file stores parts as paths of (x, y, bulge). One path is the outline of the sheet. Bulges are defined as in DXF
(LWPOLYLINE, group code 42), and lengths are in mm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from leafcut.errors import ReadError, printable
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read.format import (
    MAX_COORDINATE,
    MAX_SEGMENTS,
    Source,
    parse_json,
    to_mm,
    too_many_segments_error,
)
from leafcut.units import MM_PER_UNIT

#: Tolerance for closing a path, mm.
CLOSED = 1e-6


def read_sirius_contours(source: Source, options: ReadOptions) -> Part:
    """Read the parts of a sheet and the outline of the sheet as contours, in mm.

    The first path is the outline of the sheet if its name starts with LIST, or if it encloses all other paths.

    Raises
    ------
    ReadError
        The file does not have this JSON format, or contains no paths.
    """
    entries = _load_entries(source)
    factor = MM_PER_UNIT[options.units or "mm"]
    issues: list[Issue] = []
    contours: list[Contour] = []
    count = 0
    for number, (name, paths) in enumerate(entries):
        for k, rows in enumerate(paths):
            try:
                path = _parse_path(rows, factor)
            except (ValueError, TypeError, LookupError, OverflowError):
                message = Message(
                    "path {} of part {} was skipped, because it is not a list of (x, y, bulge)", k + 1, number
                )
                issues.append(Issue("L203", message, missing=MissingWork("contour")))
                continue
            count += path.n_segments
            if count > MAX_SEGMENTS:
                raise too_many_segments_error(source.path)
            contours.append(Contour(path, layer=name, handle=f"{number}.{k}", part=number + 1))
    if not contours:
        raise ReadError(source.path, "nothing to cut: the file has no paths")
    if _is_sheet_outline(contours, entries[0][0]):
        contours = [replace(c, kind="sheet", part=0) if c.part == 1 else replace(c, part=c.part - 1) for c in contours]
    return Part(
        source.name,
        source=source.file_name,
        format="sirius",
        units=options.units or "mm",
        contours=tuple(contours),
        issues=tuple(issues),
    )


def _load_entries(source: Source) -> list[tuple[str, list[Any]]]:
    try:
        data = parse_json(source.text())
    except (ValueError, RecursionError) as problem:
        line = getattr(problem, "lineno", None)
        raise ReadError(source.path, Message("not valid JSON: {}", printable(str(problem), 80)), line) from None
    return list(_checked_entries(source, data))


def _checked_entries(source: Source, data: Any) -> Iterator[tuple[str, list[Any]]]:
    if not isinstance(data, list) or not data:
        raise ReadError(source.path, "no sheet: a list of parts was expected")
    for number, entry in enumerate(data):
        paths = entry.get("paths") if isinstance(entry, dict) else None
        if not isinstance(paths, list):
            raise ReadError(source.path, Message("part {} of the list has no 'paths'", number))
        yield printable(str(entry.get("partid", "")), 60), paths


def _parse_path(rows: Any, factor: float) -> Polyline:
    table = [[float(row[0]), float(row[1]), float(row[2]) if len(row) > 2 else 0.0] for row in rows]
    vertices = np.array([[to_mm(x, factor), to_mm(y, factor), bulge] for x, y, bulge in table])
    if len(vertices) < 2 or not np.abs(vertices).max() <= MAX_COORDINATE:
        raise ValueError(rows)
    closed = float(np.hypot(*(vertices[0, :2] - vertices[-1, :2]))) <= CLOSED and len(vertices) > 2
    if closed:
        vertices = vertices[:-1]
    else:
        vertices[-1, 2] = 0.0
    path = Polyline(vertices, closed)
    if not np.abs(path.extents).max() <= MAX_COORDINATE:
        raise ValueError(rows)
    return path


def _is_sheet_outline(contours: list[Contour], name: str) -> bool:
    first = [c for c in contours if c.part == 1]
    others = np.array([c.path.extents for c in contours if c.part != 1]).reshape(-1, 4)
    if len(first) != 1 or not first[0].path.closed:
        return False
    x0, y0, x1, y1 = first[0].path.extents
    encloses = len(others) > 0 and bool((others[:, :2] >= (x0, y0)).all() and (others[:, 2:] <= (x1, y1)).all())
    return name.upper().startswith("LIST") or encloses
