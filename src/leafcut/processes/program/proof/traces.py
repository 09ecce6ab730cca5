"""Project cuts onto the XY plane, as straight segments and as arcs of at most an eighth of a turn."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely

from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.model.toolpath import Kind, plane_axes
from leafcut.processes.program.proof.features import Features

_PIECE = math.pi / 4
#: Maximum number of segments of an arc. An arc with many turns gets longer segments.
_MOST_PIECES = 1024
#: Within a circle, the radius may differ by at most this distance, mm.
_SAME_RADIUS = 0.01
#: Maximum distance of an arc from its chords in the search for self-intersections, mm.
SAGITTA = 0.001
#: Maximum number of chords per segment of an arc.
_MOST_CHORDS = 1000


_COLUMNS = ("feature", "begin", "end", "bow", "arc", "low", "high")


@dataclass(frozen=True, eq=False)
class Arcs:
    """Arcs, stored in columns. Each arc is a curve with a parameter s from 0 to 1.

    Attributes
    ----------
    centre
        Centre, float64[m, 3], mm.
    axes
        First, second and normal axis of the plane, int64[m, 3].
    start, sweep
        Angle at the start, and its change, rad.
    radius, grows
        Radius at the start, and its change, mm.
    level, rises
        Position on the normal axis at the start, and its change, mm.
    """

    center: Floats
    axes: Indices
    start: Floats
    sweep: Floats
    radius: Floats
    grows: Floats
    level: Floats
    rises: Floats

    def points_at(self, which: Indices, s: Floats) -> Floats:
        """Return the XY points of the arcs `which` at the parameters `s`, float64[k, 2], mm."""
        angle = self.start[which] + s * self.sweep[which]
        radius = self.radius[which] + s * self.grows[which]
        places = np.empty((len(which), 3))
        rows = np.arange(len(which))
        first, second, normal = self.axes[which].T
        places[rows, first] = self.center[which, first] + radius * np.cos(angle)
        places[rows, second] = self.center[which, second] + radius * np.sin(angle)
        places[rows, normal] = self.level[which] + s * self.rises[which]
        return places[:, :2]

    def bow(self, which: Indices, length: Floats) -> Floats:
        """Return the maximum distance between arc segments and their chords, mm.

        `length` is the range of the parameter s in each segment.
        """
        radius = self.radius[which] + np.abs(self.grows[which])
        angle = np.abs(self.sweep[which]) * length
        bow: Floats = np.minimum(radius * angle**2 / 8.0, 2.0 * radius) + np.abs(self.grows[which]) * length
        return bow


@dataclass(frozen=True, eq=False)
class Traces:
    """Segments of cuts, in the order of their features.

    Attributes
    ----------
    feature
        Feature of each segment.
    begin, end
        Start and end, float64[k, 2], mm.
    bow
        Maximum distance of the segment from the straight line between its ends, mm.
    arc
        Row in `arcs`, or -1 for a straight segment.
    low, high
        Range of the curve parameter of an arc segment.
    """

    feature: Indices
    begin: Floats
    end: Floats
    bow: Floats
    arc: Indices
    low: Floats
    high: Floats
    arcs: Arcs

    def pick(self, which: Indices | Mask) -> Traces:
        """Return the segments that `which` selects."""
        return replace(self, **{name: getattr(self, name)[which] for name in _COLUMNS})

    def flattened(self, sagitta: float) -> Traces:
        """Return the segments with each arc divided into chords. The chord error is at most `sagitta`, mm."""
        # The chord error is proportional to the square of the angle for a circle, and to the angle for a spiral.
        spiral = (self.arc >= 0) & (np.abs(self.arcs.grows[self.arc]) > _SAME_RADIUS) if len(self.arcs.grows) else False
        ratio = self.bow / sagitta
        count = np.ceil(np.where(spiral, ratio, np.sqrt(ratio)) - 1e-9).clip(1, _MOST_CHORDS).astype(np.int64)
        if (count == 1).all():
            return self
        parts = self.pick(np.repeat(np.arange(len(count)), count))
        nth = np.arange(len(parts.feature)) - np.repeat(np.cumsum(count) - count, count)
        step = (parts.high - parts.low) / np.repeat(count, count)
        low, high = parts.low + nth * step, parts.low + (nth + 1) * step
        begin, end = parts.begin.copy(), parts.end.copy()
        inner = np.flatnonzero(nth > 0)
        begin[inner] = self.arcs.points_at(parts.arc[inner], low[inner])
        end[inner - 1] = begin[inner]
        return replace(parts, begin=begin, end=end, low=low, high=high, bow=np.minimum(parts.bow, sagitta))


def traces_of(features: Features) -> Traces:
    """Trace features. Features with an unknown end are skipped. If only the start is unknown, the trace is a point."""
    x_y, start = features.end[:, :2], features.start[:, :2]
    pointed = (features.kind != Kind.FEED) & (features.kind != Kind.RAPID)
    start = np.where(np.isnan(start) | pointed[:, None], x_y, start)
    known = np.isfinite(x_y).all(axis=1)
    curved = (features.kind == Kind.ARC_CW) | (features.kind == Kind.ARC_CCW)
    curved &= np.isfinite(features.end[:, :2]).all(axis=1) & np.isfinite(features.start[:, :2]).all(axis=1)
    # A laser program may state no Z at all; an arc in the XY plane does not need it.
    curved &= (features.of("plane") == 17) | (np.isfinite(features.end[:, 2]) & np.isfinite(features.start[:, 2]))
    straight = np.flatnonzero(known & ~curved)
    rows = np.flatnonzero(curved)
    arcs = _arcs(features.pick(rows))
    pieces = np.clip(np.ceil(np.abs(arcs.sweep) / _PIECE - 1e-9), 1, _MOST_PIECES).astype(np.int64)
    which = np.repeat(np.arange(len(rows)), pieces)
    nth = np.arange(len(which)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    low, high = nth / pieces[which], (nth + 1) / pieces[which]
    none = np.zeros(len(straight))
    feature = np.concatenate([straight, rows[which]])
    order = np.argsort(feature, kind="stable")
    traces = Traces(
        feature,
        np.concatenate([start[straight], arcs.points_at(which, low)]),
        np.concatenate([x_y[straight], arcs.points_at(which, high)]),
        np.concatenate([none, arcs.bow(which, high - low)]),
        np.concatenate([np.full(len(straight), -1), which]),
        np.concatenate([none, low]),
        np.concatenate([none, high]),
        arcs,
    )
    return traces.pick(order)


def _arcs(features: Features) -> Arcs:
    """Convert arcs to curves. All turns of a helix about Z count as a single turn."""
    plane, turns = features.of("plane"), features.of("turns")
    axes = np.array([plane_axes(p) if p in (17, 18, 19) else (0, 1, 2) for p in plane.tolist()], dtype=np.int64)
    axes = axes.reshape(-1, 3)
    rows = np.arange(len(features))
    center, end, begin = features.tables.center[features.arc], features.end, features.start
    (u0, v0), (u1, v1) = ([(side - center)[rows, axes[:, k]] for k in (0, 1)] for side in (begin, end))
    start, stop = np.arctan2(v0, u0), np.arctan2(v1, u1)
    turning = np.where(features.kind == Kind.ARC_CCW, 1.0, -1.0)
    sweep = (turning * (stop - start)) % math.tau
    sweep = np.where((sweep < 1e-9) | (sweep > math.tau - 1e-9), math.tau, sweep)
    radius, last = np.hypot(u0, v0), np.hypot(u1, v1)
    one_circle = (axes[:, 2] == 2) & (np.abs(last - radius) < _SAME_RADIUS) & (turns > 1)
    sweep = np.where(one_circle, math.tau, sweep + math.tau * (turns - 1))
    level, top = begin[rows, axes[:, 2]], end[rows, axes[:, 2]]
    return Arcs(center, axes, start, turning * sweep, radius, last - radius, level, top - level)


def is_simple(cuts: Features) -> bool:
    """Return whether consecutive cuts form a path that does not cross or touch itself."""
    if len(cuts) == 1:
        return True
    chords = traces_of(cuts).flattened(SAGITTA)
    outline = np.concatenate([chords.begin[:1], chords.end])
    outline = outline[np.concatenate([[True], (np.diff(outline, axis=0) != 0.0).any(axis=1)])]
    return bool(shapely.is_simple(shapely.linestrings(outline)))
