"""Find reversible cuts: open cuts at one depth, uniform from start to end; the user has to permit reversal.

Not reversed are cuts with a different feed or kind of move at an end, that are closed or cross themselves, or dwell,
switch or retract within the cut. A dwell of a mill at one end moves to the other end; a dwell of a beam is a pierce, so
the cut stays.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.gcode.program import Program
from leafcut.gcode.reversible_cut import ReversibleCut, find_stroke
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import PieceOfWork, Section, Sequence
from leafcut.model.toolpath import Kind, arc_sweep
from leafcut.processes.program.plan.sections.program_rows import TOLERANCE, Rows
from leafcut.processes.program.proof.outlines import TOUCHING

#: Maximum gap between the ends of a closed cut, as a part of its length; `TOUCHING` is the minimum.
_CLOSED_PART = 0.1
#: Number of chords per arc to detect self-intersection.
_CHORDS = 24
#: Cosine of the change of direction at an arc (150°) beyond which the chords may miss an intersection.
_BACK = -0.866


def with_reversible(program: Program, sequence: Sequence, rows: Rows) -> Sequence:
    """Mark the reversible pieces of a sequence, and add a note with their number."""
    finder = _Finder(program, rows, sequence.process)
    items = tuple(
        replace(item, pieces=tuple(map(finder.marked, item.pieces))) if isinstance(item, Section) else item
        for item in sequence.items
    )
    count = sum(piece.reversible for item in items if isinstance(item, Section) for piece in item.pieces)
    said = f"{count} cut{'s'[: count != 1]} can be reversed" if count else "no cut can be reversed"
    return replace(sequence, items=items, issues=(*sequence.issues, Issue("L504", said, severity=Severity.NOTE)))


class _Finder:
    def __init__(self, program: Program, rows: Rows, process: str) -> None:
        self.program, self.rows, self.beam = program, rows, process in BEAMS

    def marked(self, piece: PieceOfWork) -> PieceOfWork:
        return replace(piece, reversible=True) if self._may_turn(piece) else piece

    def _may_turn(self, piece: PieceOfWork) -> bool:
        if piece.kind != "cut" or not self._same_height(piece):
            return False
        stroke = find_stroke(self.program, piece.begin, piece.end)
        if stroke is None or not all(self.rows.cut[row] for row in stroke.rows):
            return False
        part = slice(int(self.program.first[piece.begin]), int(self.program.first[piece.end]))
        if self.beam and (self.program.path.kind[part] == Kind.DWELL).any():
            # The dwell is a pierce delay at a position chosen by the program.
            return False
        return self._fits(piece, stroke) and self._alike(stroke) and self._is_open(stroke)

    def _same_height(self, piece: PieceOfWork) -> bool:
        """Return whether arrival and departure have the same height, so that both ends are equally clear."""
        height = [piece.arrive_z, piece.leave_z]
        return bool(np.isnan(height).all() and self.beam) or abs(height[0] - height[1]) < TOLERANCE

    def _fits(self, piece: PieceOfWork, stroke: ReversibleCut) -> bool:
        """Return whether the piece starts and ends at the ends of the cut."""
        path, before = self.program.path, self.program.path.before
        ends = before[stroke.rows[0], :2], path.end[stroke.rows[-1], :2]
        return bool(
            np.allclose(ends[0], piece.entry, rtol=0.0, atol=TOLERANCE)
            and np.allclose(ends[1], piece.exit, rtol=0.0, atol=TOLERANCE)
        )

    def _alike(self, stroke: ReversibleCut) -> bool:
        """Return whether the first and last moves have the usual kind and feed of the cut (no lead-in or lead-out)."""
        rows = np.array(stroke.rows)
        arc = (self.program.path.kind[rows] != Kind.FEED).tolist()
        feed = self.program.path.value[rows].tolist()
        if len(rows) == 1:
            return True
        usual = Counter(feed).most_common(1)[0][0]
        return arc[0] in arc[1:] and arc[-1] in arc[:-1] and feed[0] == feed[-1] == usual

    def _is_open(self, stroke: ReversibleCut) -> bool:
        """Return whether the cut is neither closed nor self-intersecting."""
        path = np.concatenate([self.program.path.before[stroke.rows[:1], :2], *map(self._points, stroke.rows)])
        path = path[np.concatenate([[True], (np.diff(path, axis=0) != 0.0).any(axis=1)])]
        length = float(np.hypot(*np.diff(path, axis=0).T).sum())
        gap = float(np.hypot(*(path[-1] - path[0])))
        # A path that runs straight back over itself is not simple either.
        is_open = gap > max(TOUCHING, _CLOSED_PART * length) and not self._goes_back(stroke)
        return is_open and bool(shapely.is_simple(shapely.linestrings(path)))

    def _goes_back(self, stroke: ReversibleCut) -> bool:
        """Return whether the cut nearly reverses at a joint with an arc, where it may cross itself."""
        ends = [self._directions(row) for row in stroke.rows]
        arc = [self.program.path.kind[row] != Kind.FEED for row in stroke.rows]
        joints = zip(ends, ends[1:], arc, arc[1:], strict=False)
        return any((a or b) and float(one[1] @ other[0]) < _BACK for one, other, a, b in joints)

    def _directions(self, row: int) -> NDArray[np.float64]:
        """Return the unit tangents at the start and at the end of a row, float64[2, 2]."""
        path = self.program.path
        if path.kind[row] == Kind.FEED:
            way = path.end[row, :2] - self.program.path.before[row, :2]
            return np.tile(way / max(float(np.hypot(*way)), TOLERANCE), (2, 1))
        _, start, sweep = arc_sweep(path, row)
        angles = np.array([start, start + sweep])
        along: NDArray[np.float64] = np.sign(sweep) * np.stack([-np.sin(angles), np.cos(angles)], axis=1)
        return along

    def _points(self, row: int) -> NDArray[np.float64]:
        """Return the points of a row after its start, float64[k, 2]; arcs as chords."""
        path = self.program.path
        end: NDArray[np.float64] = path.end[row : row + 1, :2]
        if path.kind[row] == Kind.FEED:
            return end
        radius, start, sweep = arc_sweep(path, row)
        angles = start + sweep * np.arange(1, _CHORDS) / _CHORDS
        centre = np.array(path.arcs[int(path.ref[row])].center[:2])
        return np.concatenate([centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), end])
