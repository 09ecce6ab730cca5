"""Merging of short moves, as LinuxCNC does it within the tolerance of G64 (Q, or P without Q)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.turns import Turns


class MovingRows(NamedTuple):
    """The rows of a toolpath that move the tool, one entry per move.

    Attributes
    ----------
    row
        Row of the toolpath.
    delta
        Displacement, float64[m, 3], mm.
    arc
        Index of the arc, -1 for a straight move.
    feed, rapid
        Feed, mm/s, and whether the move is a rapid.
    mode, tolerance, joining
        End mode (`timing.moves`), and P and Q of G64, mm.
    flushed
        Whether the machine stops before the next move.
    """

    row: NDArray[np.int64]
    delta: NDArray[np.float64]
    arc: NDArray[np.int64]
    feed: NDArray[np.float64]
    rapid: NDArray[np.bool_]
    mode: NDArray[np.int8]
    tolerance: NDArray[np.float64]
    joining: NDArray[np.float64]
    flushed: NDArray[np.bool_]

    def take(self, rows: NDArray[np.int64]) -> MovingRows:
        """Return the selected moves; an index may occur several times."""
        return MovingRows(*(column[rows] for column in self))  # type: ignore[arg-type]  # each column keeps its type


def merge_moves(steps: MovingRows, turns: Turns) -> MovingRows:
    """Merge straight moves of equal feed, and replace shallow arcs by chords, as G64 allows.

    Source: LinuxCNC documentation, G64 ("naive CAM detector", which also applies to arcs in the XY plane).
    """
    from leafcut.kernels.chords import merge_chords

    steps = _flat_arcs_as_chords(steps, turns)
    mergeable = (steps.arc < 0) & ~steps.rapid & (steps.joining > 0)
    joins = np.zeros(len(mergeable), dtype=np.bool_)
    joins[1:] = mergeable[1:] & mergeable[:-1] & ~steps.flushed[:-1]
    joins[1:] &= (steps.feed[1:] == steps.feed[:-1]) & (steps.joining[1:] == steps.joining[:-1])
    if not joins.any():
        return steps
    point = np.zeros((len(mergeable) + 1, 3))
    np.cumsum(steps.delta, axis=0, out=point[1:])
    starts = np.empty(len(mergeable), dtype=np.bool_)
    merge_chords(point, joins, steps.joining, starts)
    first = np.flatnonzero(starts)
    last = np.append(first[1:], len(mergeable)) - 1
    return steps.take(first)._replace(delta=point[last + 1] - point[first], flushed=steps.flushed[last])


def _flat_arcs_as_chords(steps: MovingRows, turns: Turns) -> MovingRows:
    """Replace each arc by two chords if it is shorter than a quarter turn and its bulge is below Q."""
    arc, turn = steps.arc, turns.turn
    if not len(turns.row):
        return steps
    bulge = turn.radius * (1.0 - np.cos(0.5 * turn.sweep))
    flat = (arc >= 0) & (bulge[arc] < steps.joining) & (turn.sweep[arc] < 0.5 * np.pi) & (turns.plane[arc] == 0)
    if not flat.any():
        return steps
    result = steps.take(np.repeat(np.arange(len(arc)), 1 + flat))
    second = np.flatnonzero(np.repeat(flat, 1 + flat))[1::2]
    arcs = arc[flat]
    middle = turn.out[arcs] + turn.out_end[arcs]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    half_rise = 0.5 * np.abs(turn.normal[arcs]) * turn.rise[arcs, None]
    radius = turn.radius[arcs, None]
    result.delta[second - 1] = radius * (middle - turn.out[arcs]) + half_rise
    result.delta[second] = radius * (turn.out_end[arcs] - middle) + half_rise
    result.flushed[second - 1] = False
    result.arc[second] = -1
    result.arc[second - 1] = -1
    return result
