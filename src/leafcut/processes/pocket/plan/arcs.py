"""Fit arcs to a path. A few lines and arcs replace many chords, so programs are short and the feed is steady."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from leafcut.geometry.arrays import Points
from leafcut.geometry.cleaning import without_huge_arcs
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.model.pocket import PocketPath

#: Share of the tolerance that arc fitting may use. The remainder is for the chords of walls and for rounding.
FITTED_PART = 0.5
#: Minimum distance between points, mm. Closer points are merged, because they hardly differ after a program rounds
#: them.
NEAREST = 0.005


def fit_arcs_to_path(path: PocketPath, tolerance: float) -> PocketPath:
    """Replace the chords of a path with arcs that stay within half of `tolerance`, mm.

    Existing arcs and the end points of sections do not change.
    """
    return replace(path, pieces=tuple(replace(p, path=_fit_arcs_to_section(p.path, tolerance)) for p in path.pieces))


def _fit_arcs_to_section(path: Polyline, tolerance: float) -> Polyline:
    arcs = [i for i in range(path.n_segments) if path.bulges[i] != 0.0]
    pieces, at = [], 0
    for i in [*arcs, path.n_segments]:
        if i > at:
            pieces.append(_fit_arcs_to_points(path.vertices[at : i + 1, :2], tolerance))
        if i < path.n_segments:
            pieces.append(Polyline(np.array([path.vertices[i], [*path.vertices[i + 1, :2], 0.0]])))
        at = i + 1
    return concatenate(*pieces) if pieces else path


def _fit_arcs_to_points(points: Points, tolerance: float) -> Polyline:
    points = _without_repeats(points)
    if len(points) < 3:
        return Polyline.of_points(points)
    return without_huge_arcs(fit_arcs(points, FITTED_PART * tolerance), FITTED_PART * tolerance)


def _without_repeats(points: Points) -> Points:
    first, *middle, last = points.tolist()
    kept = [first]
    for point in middle:
        if math.dist(point, kept[-1]) > NEAREST:
            kept.append(point)
    while len(kept) > 1 and math.dist(last, kept[-1]) <= NEAREST:
        kept.pop()
    return np.array([*kept, last])
