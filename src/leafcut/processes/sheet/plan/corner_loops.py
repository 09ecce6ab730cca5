"""Loops at sharp outer corners, in which the torch keeps its full speed.

The torch cuts straight past the corner, turns through the scrap, and crosses its own kerf onto the next edge. Without a
loop, it would slow down at the corner.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely

from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.polyline import Polyline
from leafcut.processes.sheet.plan.contours import CutContour, corner_turns, corners_along, flat_line
from leafcut.processes.sheet.plan.cut_rules import LOOP_ANGLE
from leafcut.processes.sheet.plan.scrap import Scrap

#: Tolerance for the radius of an arc around a corner, relative to half a kerf.
SAME_RADIUS = 0.02


#: A loop at a segment of a path: whether the loop replaces this segment (an arc), and its vertices (x, y, bulge).
_Loop = tuple[bool, Points]


def with_loops(contours: list[CutContour], scrap: Scrap) -> list[CutContour]:
    """Return the contours, with loops added at the sharp corners of outlines where a loop fits."""
    rules = scrap.rules
    outlines = [(k, c) for k, c in enumerate(contours) if c.has_leads and not c.hole]
    loops = [(k, at, loop) for k, c in outlines for at, loop in _possible_loops(c)]
    if not loops:
        return contours
    lines = [flat_line(Polyline(rows)) for _, _, (_, rows) in loops]
    fits = np.zeros(len(loops), dtype=bool)
    apart = min(0.9 * rules.loop_length, rules.kerf)
    for number, (k, _, (_, rows)) in enumerate(loops):
        turn = flat_line(Polyline(np.array([rows[1], [*rows[2, :2], 0.0]])))
        free = scrap.allows([lines[number]], contours[k])[0]
        fits[number] = free and not shapely.dwithin(turn, contours[k].line, apart)
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=rules.kerf)
    for a, b in sorted(zip(*pairs.tolist(), strict=True)):
        if a < b and fits[a]:
            fits[b] = False
    chosen: dict[int, dict[int, _Loop]] = {}
    for (k, at, loop), fit in zip(loops, fits.tolist(), strict=True):
        if fit:
            chosen.setdefault(k, {})[at] = loop
    return [_with_own_loops(c, chosen[k]) if k in chosen else c for k, c in enumerate(contours)]


def _possible_loops(contour: CutContour) -> Iterator[tuple[int, _Loop]]:
    """Yield pairs (segment, loop) for the corners of an outline, and for the arcs around corners of the drawing."""
    path, half, length = contour.path, contour.rules.half, contour.rules.loop_length
    for at, turn in enumerate(corner_turns(path).tolist()):
        if half == 0.0 and math.pi - LOOP_ANGLE < turn < math.pi - 0.01:
            corner, along = path.segment(at).start, float(path.lengths[:at].sum())
            before, after = path.direction_at(along - 1e-6), path.direction_at(along + 1e-6)
            yield at, (False, _loop_vertices((corner, corner), before, after, 0.0, length))
    for at in range(path.n_segments):
        s = path.segment(at)
        turn = 4.0 * math.atan(s.bulge)
        around = s.is_arc and abs(s.radius - half) < SAME_RADIUS * half
        if around and math.pi - LOOP_ANGLE < turn < math.pi - 0.01:
            before, after = (
                (-(p[1] - s.center[1]) / s.radius, (p[0] - s.center[0]) / s.radius) for p in (s.start, s.end)
            )
            yield at, (True, _loop_vertices((s.start, s.end), before, after, half, length))


def _loop_vertices(ends: tuple[Point, Point], before: Point, after: Point, half: float, length: float) -> Points:
    """Return the vertices of a loop, float64[4, 3]: straight past the corner, around, and back to the next edge.

    `ends` are the points of the path where the loop starts and ends; `before` and `after` are the directions there. The
    loop turns `length` mm past the intersection of both lines. `half` is half a kerf, mm.
    """
    start, end = ends
    turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
    run = half * math.tan(0.5 * turn) + length
    a = (start[0] + run * before[0], start[1] + run * before[1])
    b = (end[0] - run * after[0], end[1] - run * after[1])
    bulge = -math.tan(0.25 * (2.0 * math.pi - turn))
    return np.array([[*start, 0.0], [*a, bulge], [*b, 0.0], [*end, 0.0]])


def _with_own_loops(contour: CutContour, loops: dict[int, _Loop]) -> CutContour:
    path = contour.path
    rows: list[Points] = []
    spans: list[tuple[float, float]] = []
    length = 0.0
    for at in range(path.n_segments):
        if at in loops:
            arc, loop = loops[at]
            own = Polyline(loop).length
            rows.append(loop[:-1])
            spans.append((length, length + own))
            length += own
            if arc:
                continue
        rows.append(path.vertices[at : at + 1])
        length += float(path.lengths[at])
    whole = Polyline(np.vstack(rows), closed=True)
    line = flat_line(whole)
    corners = corners_along(contour.source.path, whole, line)
    return replace(contour, path=whole, line=line, loops=tuple(spans), corners=corners)
