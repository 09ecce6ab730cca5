"""Clean paths: remove very short segments, split arcs beyond a half circle, and replace arcs with a huge radius."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline

#: Maximum distance between vertices that coincide, mm. This is a hundredth of a machine's resolution.
SAME = 1e-5
#: Bulge of a half circle, plus a tolerance for rounding.
_HALF = 1.0 + 1e-9
#: Distance below which two points may round to the same point, mm. This is the diagonal of one step in an inch program
#: with four decimals.
LEAST_STEP = 0.0037
#: Maximum arc radius, mm. Larger arcs become lines, because controllers reject them and real parts do not have them.
LARGEST_RADIUS = 5000.0
#: Maximum chord error of lines that replace arcs with a huge radius, mm.
FLAT = 0.002


def clean_path(path: Polyline) -> Polyline | None:
    """Remove segments of length 0, and split arcs larger than a half circle. Return None if no segment is left.

    Arcs with a radius above `LARGEST_RADIUS` become lines, with a chord error of at most `FLAT` mm. If a full circle is
    drawn as a single arc with equal ends, it is lost, because its bulge is undefined.
    """
    if np.abs(path.bulges).max(initial=0.0) > _HALF:
        path = _split_large_arcs(path)
    path = without_huge_arcs(path, FLAT)
    rows = path.vertices
    after = np.roll(rows, -1, axis=0)
    keep = np.hypot(after[:, 0] - rows[:, 0], after[:, 1] - rows[:, 1]) > SAME
    if not path.closed:
        keep[-1] = True  # the end point of the path
    if keep.all():
        return path if path.n_segments else None
    kept = rows[keep]
    if len(kept) < 2:
        return None
    if not path.closed:
        kept[-1, 2] = 0.0
    return Polyline(kept, path.closed)


def _split_large_arcs(path: Polyline) -> Polyline:
    rows: list[tuple[float, float, float]] = []
    for s in path.segments():
        if abs(s.bulge) <= _HALF:
            rows.append((*s.start, s.bulge))
            continue
        half = math.tan(0.5 * math.atan(s.bulge))
        angle = math.atan2(s.start[1] - s.center[1], s.start[0] - s.center[0]) + 2.0 * math.atan(s.bulge)
        middle = (s.center[0] + s.radius * math.cos(angle), s.center[1] + s.radius * math.sin(angle))
        rows += [(*s.start, half), (*middle, half)]
    if not path.closed:
        rows.append((*path.end, 0.0))
    return Polyline(np.array(rows), path.closed)


def without_huge_arcs(path: Polyline, tolerance: float) -> Polyline:
    """Replace arcs with a radius above `LARGEST_RADIUS` by lines that stay within `tolerance` mm.

    Return the new path.
    """
    if not any(s.is_arc and s.radius > LARGEST_RADIUS for s in path.segments()):
        return path
    rows: list[tuple[float, float, float]] = []
    for s in path.segments():
        if s.is_arc and s.radius > LARGEST_RADIUS:
            arc = Polyline(np.array([[*s.start, s.bulge], [*s.end, 0.0]]))
            rows += [(x, y, 0.0) for x, y in arc.flattened(tolerance)[:-1].tolist()]
        else:
            rows.append((*s.start, s.bulge))
    if not path.closed:
        rows.append((*path.end, 0.0))
    return Polyline(np.array(rows), path.closed)


def without_short_steps(path: Polyline) -> Polyline:
    """Remove all segments of an open path that are so short that a program would round both ends to the same point."""
    lengths, rows = path.lengths, path.vertices
    if lengths.min(initial=math.inf) >= LEAST_STEP:
        return path
    kept: list[tuple[float, float, float]] = []
    x, y, left_out = float(rows[0, 0]), float(rows[0, 1]), 0.0
    for length, row, after in zip(lengths.tolist(), rows.tolist(), rows[1:].tolist(), strict=False):
        left_out += length
        if left_out < LEAST_STEP:
            continue
        kept.append((x, y, row[2] if length >= LEAST_STEP else 0.0))
        x, y, left_out = after[0], after[1], 0.0
    return Polyline(np.array([*(kept or [(x, y, 0.0)]), (*path.end, 0.0)]))


def counter_clockwise(path: Polyline) -> Polyline:
    """Return a closed path in counter-clockwise direction. An open path does not change."""
    return path.reversed() if path.area < 0.0 else path


def path_ends(paths: Sequence[Polyline]) -> Points:
    """Return the start and end points of all paths, alternating, float64[2n, 2]."""
    return np.array([end for path in paths for end in (path.start, path.end)]).reshape(-1, 2)
