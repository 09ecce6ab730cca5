"""Find the cuts that can be reversed if the user permits it: open cuts at one depth that are uniform from start to end.

A cut is not reversible if it is closed or crosses itself, if it dwells, switches or retracts on the way, or if an end
has another feed or kind of move. A dwell of a mill at one end moves to the other end. A cut in which a beam dwells is
not reversible, because the dwell is a pierce.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leafcut.gcode.program import Program
from leafcut.gcode.reversible_cut import ReversibleCut, find_reversible_cut
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import ProgramTask, Section, Sequence
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.program_rows import TOLERANCE, Rows
from leafcut.processes.program.proof.features import Features, is_uniform
from leafcut.processes.program.proof.outlines import TOUCHING
from leafcut.processes.program.proof.traces import SAGITTA, is_simple, traces_of

#: Maximum gap between the ends of a closed cut, as a part of its length; `TOUCHING` is the minimum.
_CLOSED_PART = 0.1
#: Cosine of 150°: if the path turns further at an arc, its chords may miss an intersection.
_BACK = -0.866


def with_reversible(program: Program, sequence: Sequence, rows: Rows) -> Sequence:
    """Mark the reversible cuts of a sequence, and add a note that states their number."""
    finder = _ReversalFinder(program, rows, sequence.process)
    items = tuple(
        replace(item, pieces=tuple(map(finder.mark_reversible, item.pieces))) if isinstance(item, Section) else item
        for item in sequence.items
    )
    count = sum(piece.reversible for item in items if isinstance(item, Section) for piece in item.pieces)
    message = Message("{} cuts can be reversed", count)
    if count < 2:
        message = Message("{} cut can be reversed", count) if count else Message("no cut can be reversed")
    return replace(sequence, items=items, issues=(*sequence.issues, Issue("L504", message, severity=Severity.NOTE)))


class _ReversalFinder:
    def __init__(self, program: Program, rows: Rows, process: str) -> None:
        self.program, self.rows, self.beam = program, rows, process in BEAMS

    def mark_reversible(self, piece: ProgramTask) -> ProgramTask:
        return replace(piece, reversible=True) if self._is_reversible(piece) else piece

    def _is_reversible(self, piece: ProgramTask) -> bool:
        if piece.kind != "cut" or not self._same_height(piece):
            return False
        stroke = find_reversible_cut(self.program, piece.begin, piece.end)
        if stroke is None or not all(self.rows.cut[row] for row in stroke.rows):
            return False
        part = slice(int(self.program.first[piece.begin]), int(self.program.first[piece.end]))
        if self.beam and (self.program.path.kind[part] == Kind.DWELL).any():
            # The dwell is a pierce delay at a position chosen by the program.
            return False
        cuts = self.rows.features.pick(np.isin(self.rows.features.row, stroke.rows))
        return self._matches_task(piece, stroke) and is_uniform(cuts) and is_simple(cuts) and _is_open(cuts)

    def _same_height(self, piece: ProgramTask) -> bool:
        """Return whether the tool arrives and leaves at the same height, so that both ends are equally clear."""
        height = [piece.arrive_z, piece.leave_z]
        return bool(np.isnan(height).all() and self.beam) or abs(height[0] - height[1]) < TOLERANCE

    def _matches_task(self, piece: ProgramTask, stroke: ReversibleCut) -> bool:
        """Return whether the piece of work starts and ends at the ends of the cut."""
        path, before = self.program.path, self.program.path.before
        ends = before[stroke.rows[0], :2], path.end[stroke.rows[-1], :2]
        return bool(
            np.allclose(ends[0], piece.entry, rtol=0.0, atol=TOLERANCE)
            and np.allclose(ends[1], piece.exit, rtol=0.0, atol=TOLERANCE)
        )


def _is_open(cuts: Features) -> bool:
    """Return whether the ends of a cut are far apart, and no arc turns so far back that the cut might cross itself."""
    pieces = traces_of(cuts).flattened(SAGITTA)
    way = pieces.end - pieces.begin
    length = np.hypot(*way.T)
    along, curved = way / np.maximum(length, TOLERANCE)[:, None], pieces.arc >= 0
    goes_back = (along[:-1] * along[1:]).sum(axis=1) < _BACK
    gap = float(np.hypot(*(cuts.end[-1, :2] - cuts.start[0, :2])))
    is_open = gap > max(TOUCHING, _CLOSED_PART * float(length.sum()))
    return is_open and not (goes_back & (curved[:-1] | curved[1:])).any()
