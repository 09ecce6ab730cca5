"""Join arcs that together close a circle: halves of a hole, quarters, overlapping pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from leafcut.read.filter_holes import anchor_points

#: Tolerance in centre and radius of the arcs of one circle, mm: drawings keep 4 to 6 digits.
SAME_CIRCLE = 0.01
#: Largest gap between two arcs of a closed circle: mm along the arc, limited to these bounds in rad.
GAP_LENGTH, GAP_SMALLEST, GAP_LARGEST = 0.01, 2e-4, 0.01


class ArcPiece(NamedTuple):
    """An arc in mm and radians, counter-clockwise from `start` over `sweep`; `entity` is the number of its entity."""

    x: float
    y: float
    radius: float
    start: float
    sweep: float
    entity: int
    z: float = 0.0


def close_circles(pieces: Sequence[ArcPiece]) -> tuple[list[ArcPiece], set[int]]:
    """Return the first piece of each closed circle, in the given order, and the entities used. O(n log n)."""
    table = np.array([(p.x, p.y, p.radius) for p in pieces]).reshape(-1, 3)
    groups: dict[int, list[ArcPiece]] = {}
    for piece, anchor in zip(pieces, anchor_points(table, SAME_CIRCLE), strict=True):
        groups.setdefault(anchor, []).append(piece)
    circles: list[ArcPiece] = []
    used: set[int] = set()
    for group in groups.values():
        if _covers_full_turn(group):
            circles.append(group[0])
            used.update(p.entity for p in group)
    return circles, used


def _covers_full_turn(group: list[ArcPiece]) -> bool:
    gap = min(max(GAP_LENGTH / group[0].radius, GAP_SMALLEST), GAP_LARGEST)
    if sum(p.sweep for p in group) < math.tau - gap * len(group):
        return False
    spans = sorted((p.start % math.tau, p.sweep) for p in group)
    first_start = spans[0][0]
    covered = first_start
    for start, sweep in spans:
        if start > covered + gap:
            return False
        covered = max(covered, start + sweep)
    # The last piece must meet the first again, one turn later.
    return covered >= first_start + math.tau - gap


def bulge_arc(
    x0: float, y0: float, x1: float, y1: float, bulge: float
) -> tuple[float, float, float, float, float] | None:
    """Return (centre x, centre y, radius, start angle, sweep) of a bulged segment, counter-clockwise.

    The bulge is the tangent of a quarter of the arc's angle, positive for counter-clockwise (DXF reference, LWPOLYLINE,
    group code 42). None for a segment without length or bulge.
    """
    dx, dy = x1 - x0, y1 - y0
    chord = math.hypot(dx, dy)
    if chord == 0.0 or bulge == 0.0:
        return None
    offset = (1.0 - bulge * bulge) / (4.0 * bulge)
    cx, cy = 0.5 * (x0 + x1) - offset * dy, 0.5 * (y0 + y1) + offset * dx
    radius = chord * (1.0 + bulge * bulge) / (4.0 * abs(bulge))
    sweep = 4.0 * math.atan(abs(bulge))
    first = (x0, y0) if bulge > 0 else (x1, y1)
    return cx, cy, radius, math.atan2(first[1] - cy, first[0] - cx), sweep
