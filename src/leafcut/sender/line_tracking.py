"""Determines the current program line from the position of the machine, because boards do not report the line."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.machine import XYZ
from leafcut.model.toolpath import Kind, Toolpath, arc_radius_start_sweep, plane_axes

#: Maximum chord error of an arc, mm, and maximum number of chords per arc.
_SAGITTA, _MAX_CHORDS = 0.02, 360
#: Maximum distance of a position from the nearest move, mm. Beyond it, the first move has not started yet.
_MAX_DISTANCE = 0.25
#: Tolerance for equal distances, mm. If several moves are equally near, the tracker chooses the first, so that no move
#: is skipped when the program resumes.
_TIE_TOLERANCE = 0.02


class LineTracker:
    """Finds the line that the machine is currently executing."""

    def __init__(self, path: Toolpath) -> None:
        starts, ends, rows = _chords(path)
        self._starts, self._ends = starts, ends
        self._lines = path.line[rows].astype(np.int64)

    def line_at(self, place: XYZ, first: int, last: int) -> int:
        """Return the line whose move is closest to a position, or `first` if no move is close.

        The position is in program coordinates, mm. The search considers only the lines from `first` to `last`.
        """
        low, high = np.searchsorted(self._lines, [first, last + 1])
        if low >= high:
            return first
        starts, ends = self._starts[low:high], self._ends[low:high]
        along = ends - starts
        length = np.maximum((along**2).sum(axis=1), 1e-18)
        offset = np.array(place) - starts
        share = np.clip((offset * along).sum(axis=1) / length, 0.0, 1.0)
        distance = np.sqrt(((offset - share[:, None] * along) ** 2).sum(axis=1))
        nearest = float(distance.min())
        if not nearest <= _MAX_DISTANCE:
            return first
        return int(self._lines[low:high][int(np.argmax(distance <= nearest + _TIE_TOLERANCE))])


def _chords(path: Toolpath) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return the chords of all moves with known ends.

    Returns
    -------
    start, end
        Ends of each chord, float64[k, 3] mm.
    row
        Row of the move of each chord.
    """
    before = path.before
    starts: list[Floats] = []
    ends: list[Floats] = []
    rows: list[int] = []
    moving = (path.kind <= Kind.ARC_CCW) & np.isfinite(path.end).all(axis=1) & np.isfinite(before).all(axis=1)
    for row in np.flatnonzero(moving).tolist():
        points = [before[row], path.end[row]]
        if path.kind[row] in (Kind.ARC_CW, Kind.ARC_CCW):
            points = _arc_points(path, row)
        starts += points[:-1]
        ends += points[1:]
        rows += [row] * (len(points) - 1)
    return np.reshape(starts, (-1, 3)), np.reshape(ends, (-1, 3)), np.array(rows, dtype=np.int64)


def _arc_points(path: Toolpath, row: int) -> list[Floats]:
    arc = path.arcs[int(path.ref[row])]
    first, second, normal = plane_axes(arc.plane)
    radius, start, sweep = arc_radius_start_sweep(path, row)
    angle = 2.0 * math.acos(max(1.0 - _SAGITTA / radius, 0.0)) if radius > 0.0 else math.pi
    count = min(max(1, math.ceil(abs(sweep) / angle)), _MAX_CHORDS)
    points = []
    for share in np.linspace(0.0, 1.0, count + 1).tolist():
        point = np.zeros(3)
        angle = start + share * sweep
        point[first] = arc.center[first] + radius * math.cos(angle)
        point[second] = arc.center[second] + radius * math.sin(angle)
        point[normal] = path.before[row][normal] * (1.0 - share) + path.end[row][normal] * share
        points.append(point)
    return points
