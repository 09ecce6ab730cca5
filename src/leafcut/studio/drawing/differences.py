"""The scene with the differences between two programs: missing and added moves, drawn over both toolpaths.

The scene has the kind ``differences`` (format: `studio.drawing.scene`). Its header lists the ``differences``, each
with its kind, its text, and its lines in the original and the new program (0: none). Its blocks are

=========== ======== ============================================================================================
``mark``    f4 × 4   position, index of the difference, and change (0 missing, 1 added, 2 changed)
``missing`` f4 × 2   points of moves that exist only in the original, separated by NaN
``added``   f4 × 2   points of moves that exist only in the new program, separated by NaN
=========== ======== ============================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath, arc_radius_start_sweep
from leafcut.report.wording import replace_unprintable
from leafcut.studio.drawing.scene import pack_scene

_CHORDS = 32
#: Maximum number of line pairs that are drawn for each difference.
_MAX_MARKS = 200


class Change(IntEnum):
    """The kinds of differences that the drawing distinguishes."""

    MISSING = 0
    ADDED = 1
    CHANGED = 2


def differences_scene(differences: Sequence[Difference], original: Toolpath, new: Toolpath) -> bytes:
    """Return the scene with the differences between two programs. Both toolpaths must have line numbers."""
    marks: list[tuple[float, float, int, Change]] = []
    strokes: dict[Change, list[NDArray[np.float64]]] = {Change.MISSING: [], Change.ADDED: []}
    moves = {side: path.kind <= Kind.DRILL for side, path in zip(strokes, (original, new), strict=True)}
    for index, difference in enumerate(differences):
        change = kind_of_change(difference)
        for pair in ((difference.original, difference.new), *difference.also)[:_MAX_MARKS]:
            for side, path, line in zip(strokes, (original, new), pair, strict=True):
                if not line or change not in (side, Change.CHANGED):
                    continue
                lines_drawn = [
                    _points_of_move(path, row) for row in np.flatnonzero((path.line == line) & moves[side]).tolist()
                ]
                strokes[side] += [path_points for path_points in lines_drawn if len(path_points) > 1]
                ends = [path_points[-1] for path_points in lines_drawn if len(path_points)]
                if ends:
                    marks.append((*ends[-1].tolist(), index, change))
    points = np.array([mark[:2] for mark in marks], dtype=np.float64).reshape(-1, 2)
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(2), np.zeros(2))
    origin = 0.5 * (low + high)
    gap = np.full((1, 2), math.nan)
    lines = {
        side: np.concatenate([gap, *(part for path_points in lines_drawn for part in (path_points, gap))])
        for side, lines_drawn in strokes.items()
    }
    header = {
        "kind": "differences",
        "name": "differences",
        "origin": origin.tolist(),
        "extents": [*low.tolist(), *high.tolist()] if len(points) else None,
        "differences": [
            [
                replace_unprintable(difference.what),
                replace_unprintable(difference.text),
                difference.original,
                difference.new,
            ]
            for difference in differences
        ],
    }
    mark = np.array(marks, dtype=np.float64).reshape(-1, 4)
    return pack_scene(
        header,
        {
            "mark": ("f4", mark - np.array([*origin, 0.0, 0.0])),
            "missing": ("f4", lines[Change.MISSING] - origin),
            "added": ("f4", lines[Change.ADDED] - origin),
        },
    )


def kind_of_change(difference: Difference) -> Change:
    """Return whether the lines of a difference are missing, added or changed."""
    if difference.original and not difference.new:
        return Change.MISSING
    return Change.ADDED if difference.new and not difference.original else Change.CHANGED


def _points_of_move(path: Toolpath, row: int) -> NDArray[np.float64]:
    """Return the points of a toolpath row in plan view, float64[k, 2] mm.

    It has no points if the end of the move is unknown.
    """
    start, end = path.before[row, :2], path.end[row, :2]
    end = np.where(np.isfinite(end), end, start)
    if not np.isfinite(end).all():
        return np.zeros((0, 2))
    if path.kind[row] == Kind.DRILL or not np.isfinite(start).all() or np.array_equal(start, end):
        return end.reshape(1, 2)
    if path.kind[row] in (Kind.ARC_CW, Kind.ARC_CCW) and path.arcs[int(path.ref[row])].plane == 17:
        centre = np.array(path.arcs[int(path.ref[row])].center[:2])
        radius, start_angle, sweep = arc_radius_start_sweep(path, row)
        angle = start_angle + sweep * np.linspace(0.0, 1.0, _CHORDS)
        return np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)])
    return np.stack([start, end])
