"""Straight cuts as few rows as possible: programs that differ only in how a line is divided do the same work."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Indices, Mask
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.proof.features import States, compensated_moves

#: The work of finding a line grows with the square of its rows.
_MOST_ROWS = 1000
#: G61 and G61.1: the tool may stop at the end of every move.
_STOPPING = (610, 611)


def needed_rows(path: Toolpath, states: States, *, still: float, tolerance: float) -> Indices:
    """Return the rows of a toolpath that remain if every straight cut is a single row.

    Feeds of no length are left out. Consecutive feeds with the same feed rate and in the same state become one, the
    last, if every place between its ends is within `tolerance` of it and none goes backwards. Feeds under or directly
    after radius compensation, in inverse time or with exact stops remain as they are.

    Parameters
    ----------
    still, tolerance
        mm; moves up to `still` have no length.
    """
    before, end = path.before, path.end
    feeds = (path.kind == Kind.FEED) & np.isfinite(before).all(axis=1) & np.isfinite(end).all(axis=1)
    # Under radius compensation the place of the tool also depends on the moves beside it, and the first move after it
    # takes it off along its length; in inverse time (G93) each move has its own time; in exact stop (G61) the tool
    # stands at the end of each.
    feeds &= ~compensated_moves(path, states) & (states.of("feed_mode") != 93)
    feeds &= ~np.isin(states.of("blending"), _STOPPING)
    moves = np.flatnonzero(~(feeds & (np.abs(end - before) <= still).all(axis=1)))
    goes_on = np.zeros(len(moves), dtype=bool)
    goes_on[1:] = _alike(path, states, feeds, moves)
    needed = np.ones(len(moves), dtype=bool)
    bounds = np.flatnonzero(np.diff(goes_on, prepend=False, append=False))
    for first, last in bounds.reshape(-1, 2).tolist():
        # Rows first - 1 to last - 1 are feeds, each of which goes on where the one before it ended.
        begin = first - 1
        while begin < last:
            stop = _end_of_line(path, moves[begin:last], tolerance)
            needed[begin : begin + stop - 1] = False
            begin += stop
    return moves[needed]


def _alike(path: Toolpath, states: States, feeds: Mask, rows: Indices) -> Mask:
    """Return which rows but the first are feeds in the same state as the feed before them."""
    both = feeds[rows[1:]] & feeds[rows[:-1]]
    same_state = states.number[rows[1:]] == states.number[rows[:-1]]
    alike: Mask = both & same_state & (path.value[rows[1:]] == path.value[rows[:-1]])
    return alike


def _end_of_line(path: Toolpath, rows: Indices, tolerance: float) -> int:
    """Return how many of these feeds, from the first, lie on one line: at least one."""
    start = path.before[rows[0]]
    count = 1
    while count < min(len(rows), _MOST_ROWS):
        places = path.end[rows[: count + 1]]
        line = places[-1] - start
        length = float(np.linalg.norm(line))
        if length <= tolerance:
            break
        along = (places - start) @ line / length
        aside = np.linalg.norm(places - start - along[:, None] * line / length, axis=1)
        if aside.max() > tolerance or (np.diff(along, prepend=0.0) < 0.0).any():
            break
        count += 1
    return count
