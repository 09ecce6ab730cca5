"""Draw missing work as red hatching, or as crosses if its outlines are unknown."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.model.issue import Issue, MissingWork
from leafcut.report.frame import Frame
from leafcut.report.svg import element, scaled_group_element, segments_path_data, svg_number, title_element
from leafcut.report.wording import replace_unprintable

#: Spacing of hatch lines, and half the size of a cross, user units.
_HATCH, _CROSS = 6.0, 4.5
#: Chord error of arcs, user units.
_CHORDS = 0.06
#: Maximum number of marked positions. The issue always states the total number.
_MAX_MARKS = 2_000
#: Maximum number of hatch lines per area.
_MAX_LINES = 300


def points_of_missing_work(issues: Iterable[Issue]) -> Points:
    """Return the points of missing work that must be visible in the drawing, float64[n, 2], mm."""
    points: list[tuple[float, float]] = []
    for issue in issues:
        if issue.missing is not None:
            points += issue.missing.where[:_MAX_MARKS]
            points += [c for path in issue.missing.outlines[:_MAX_MARKS] for c in (path.extents[:2], path.extents[2:])]
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def missing_work_svg(frame: Frame, issues: Iterable[Issue]) -> str:
    """Draw missing work as SVG, in user units relative to the window of the frame. Return "" if no work is missing."""
    return "".join(
        _missing_item_svg(frame, issue.missing, issue.message) for issue in issues if issue.missing is not None
    )


def _missing_item_svg(frame: Frame, work: MissingWork, reason: str) -> str:
    words = title_element(f"missing: {replace_unprintable(reason)}")
    if work.outlines:
        rings = [frame.to_user_units(path.flattened(_CHORDS / frame.scale)) for path in work.outlines[:_MAX_MARKS]]
        edges = "".join(f"{segments_path_data(np.stack([ring[:-1], ring[1:]], axis=1))}z" for ring in rings)
        hatch = "".join(_hatch_lines(ring) for ring in rings)
        return element(
            "g", words, scaled_group_element(element("path", d=edges)), element("path", d=hatch), class_="missing"
        )
    if not work.where:
        return ""
    size = svg_number(2.0 * _CROSS)
    crosses = "".join(
        f"M{svg_number(x - _CROSS)} {svg_number(y - _CROSS)}l{size} {size}m0 -{size}l-{size} {size}"
        for x, y in frame.to_user_units(np.array(work.where[:_MAX_MARKS])).tolist()
    )
    return element("g", words, element("path", d=crosses), class_="missing")


def _hatch_lines(ring: Points) -> str:
    """Return the path data of hatch lines inside a ring, user units. The lines are at 45°."""
    area = shapely.make_valid(shapely.Polygon(ring))
    x0, y0, x1, y1 = shapely.bounds(area).tolist()
    first = _HATCH * math.ceil((x0 + y0) / _HATCH)
    sums = np.arange(first, x1 + y1, _HATCH)[:_MAX_LINES]
    lines = shapely.linestrings([[(s - y1, y1), (s - y0, y0)] for s in sums.tolist()])
    parts = shapely.get_parts(shapely.intersection(lines, area))
    ends = [shapely.get_coordinates(part)[[0, -1]].ravel().tolist() for part in parts if part.length > 0.0]
    return "".join(f"M{svg_number(a)} {svg_number(b)}L{svg_number(c)} {svg_number(d)}" for a, b, c, d in ends)
