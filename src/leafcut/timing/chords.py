"""Merging of short moves, as LinuxCNC does it within the tolerance of G64 (Q, or P without Q)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from leafcut.kernels.chords import merge_chords

if TYPE_CHECKING:
    from leafcut.model.turns import Turns
    from leafcut.timing.moves import MovingRows


def merge_moves(steps: MovingRows, turns: Turns) -> MovingRows:
    """Merge straight moves of equal feed, and replace shallow arcs by chords, as G64 allows.

    Source: LinuxCNC documentation, G64 ("naive CAM detector", which also applies to arcs in the XY plane).
    """
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
