"""Loops at sharp outer corners: on past the corner, round in the scrap, and back on the new line at full speed.

The corner then is as sharp as the two straight cuts that cross there, where the kerf would be led round it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline
from leafcut.processes.sheet.plan.cut_contours import CutContour, corner_turns, corners_along, flat_line
from leafcut.processes.sheet.plan.cut_rules import LOOP_ANGLE, CutRules
from leafcut.processes.sheet.plan.leads.leads import Scrap

#: How much the radius of an arc round a corner may differ from half a kerf, as a part of it.
SAME_RADIUS = 0.02


@dataclass(frozen=True, eq=False)
class _Loop:
    """A loop that would take the place of one corner: segment `at` of the contour's path is left out, if it is an arc.

    `rows` are the vertices (x, y, bulge) from where it leaves the path; it ends at `back`.
    """

    contour: int
    at: int
    arc: bool
    rows: Points
    back: tuple[float, float]
    line: Any
    round_line: Any


def with_loops(contours: list[CutContour], scrap: Scrap, rules: CutRules) -> list[CutContour]:
    """Return the contours with loops at the sharp corners of outlines that have room for one."""
    loops = [loop for k, c in enumerate(contours) if c.has_leads and not c.hole for loop in _loops_of(k, c, rules)]
    if not loops:
        return contours
    fits = np.zeros(len(loops), dtype=bool)
    apart = min(0.9 * rules.loop_length, rules.kerf)
    for number, loop in enumerate(loops):
        owner = contours[loop.contour]
        room = scrap.free([loop.line], owner)[0]
        fits[number] = room and not shapely.dwithin(loop.round_line, owner.line, apart)
    pairs = shapely.STRtree([x.line for x in loops]).query(
        [x.line for x in loops], predicate="dwithin", distance=rules.kerf
    )
    for a, b in sorted(zip(*pairs.tolist(), strict=True)):
        if a < b and fits[a]:
            fits[b] = False
    chosen: dict[int, dict[int, _Loop]] = {}
    for loop, fit in zip(loops, fits.tolist(), strict=True):
        if fit:
            chosen.setdefault(loop.contour, {})[loop.at] = loop
    return [_looped(c, chosen[k]) if k in chosen else c for k, c in enumerate(contours)]


def _loops_of(number: int, contour: CutContour, rules: CutRules) -> list[_Loop]:
    """Return the loops that a counter-clockwise path might have."""
    path, found = contour.path, []
    for at, turn in enumerate(corner_turns(path).tolist()):
        if rules.half == 0.0 and math.pi - LOOP_ANGLE < turn < math.pi - 0.01:
            corner = path.segment(at).start
            before = path.direction_at(_begin(path, at) - 1e-6)
            after = path.direction_at(_begin(path, at) + 1e-6)
            found.append(_loop(number, at, False, corner, corner, before, after, 0.0, rules))
    for at in range(path.n_segments):
        s = path.segment(at)
        turn = 4.0 * math.atan(s.bulge)
        around = s.is_arc and abs(s.radius - rules.half) < SAME_RADIUS * rules.half
        if not around or not math.pi - LOOP_ANGLE < turn < math.pi - 0.01:
            continue
        before, after = ((-(p[1] - s.center[1]) / s.radius, (p[0] - s.center[0]) / s.radius) for p in (s.start, s.end))
        found.append(_loop(number, at, True, s.start, s.end, before, after, rules.half, rules))
    return found


def _begin(path: Polyline, index: int) -> float:
    return float(path.lengths[:index].sum())


def _loop(
    number: int,
    at: int,
    arc: bool,
    start: tuple[float, float],
    end: tuple[float, float],
    before: tuple[float, float],
    after: tuple[float, float],
    half: float,
    rules: CutRules,
) -> _Loop:
    """Return the loop at one corner: straight on by its length past where the two lines cross, round, and back."""
    turn = math.atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
    on = half * math.tan(0.5 * turn) + rules.loop_length
    a = (start[0] + on * before[0], start[1] + on * before[1])
    b = (end[0] - on * after[0], end[1] - on * after[1])
    bulge = -math.tan(0.25 * (2.0 * math.pi - turn))
    rows = np.array([[*start, 0.0], [*a, bulge], [*b, 0.0]])
    line = flat_line(Polyline(np.vstack([rows, [[*end, 0.0]]])))
    return _Loop(number, at, arc, rows, end, line, flat_line(Polyline(np.array([[*a, bulge], [*b, 0.0]]))))


def _looped(contour: CutContour, loops: dict[int, _Loop]) -> CutContour:
    """Return a contour with these loops in its path."""
    path = contour.path
    rows: list[Points] = []
    spans: list[tuple[float, float]] = []
    length = 0.0
    for at in range(path.n_segments):
        if at in loops:
            loop = loops[at]
            own = Polyline(np.vstack([loop.rows, [[*loop.back, 0.0]]])).length
            rows.append(loop.rows)
            spans.append((length, length + own))
            length += own
            if loop.arc:
                continue
        rows.append(path.vertices[at : at + 1])
        length += float(path.lengths[at])
    whole = Polyline(np.vstack(rows), closed=True)
    line = flat_line(whole)
    return replace(
        contour,
        path=whole,
        line=line,
        loops=tuple(spans),
        corners=corners_along(contour.source.contour.path, whole, line),
    )
