"""Merge sections that use the same tool, to save tool changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leafcut.errors import count_of
from leafcut.gcode.modal_dependencies import BlockReader
from leafcut.gcode.program import Program
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.sequence import FixedBlocks, Section, Sequence
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.precedence import are_related, with_precedence
from leafcut.processes.program.plan.program_rows import TOLERANCE, Rows

#: Modal values that must be equal in both sections.
_SAME = (
    "unit", "feed_mode", "tool", "length", "radius", "frame", "shift", "rpm", "spindle", "coolant", "blending",
    "tolerance", "joining", "incremental",
)  # fmt: skip
#: Kinds of rows allowed between the sections, and in a removed tool change.
_BETWEEN = frozenset({Kind.RAPID, Kind.DWELL, Kind.TOOL, Kind.OFFSET, Kind.SPINDLE, Kind.COOLANT, Kind.MACHINE})
#: Kinds of rows that restore a modal value after a removed tool change.
_STATED_BY = {
    "length": Kind.OFFSET,
    "spindle": Kind.SPINDLE,
    "rpm": Kind.SPINDLE,
    "coolant": Kind.COOLANT,
    "tool": Kind.TOOL,
    "next_tool": Kind.TOOL,
}


def merge_sections(
    program: Program, sequence: Sequence, rows: Rows, check_cancelled: Heartbeat = ignore_heartbeat
) -> Sequence:
    """Merge later sections into earlier sections with the same tool, and remove the tool changes before them.

    No section moves past a stop, a change of offset, an unknown block, fixed work, or touching work of another tool.
    """
    merger = _Merger(program, sequence, rows, check_cancelled)
    merger.join_all()
    if not merger.dropped:
        return sequence
    saved = merger.saved
    issue = Issue(
        "L503", Message("{} saved by joining sections", count_of(saved, "tool change")), severity=Severity.NOTE
    )
    return replace(
        sequence,
        items=tuple(merger.items),
        dropped=(*sequence.dropped, *merger.dropped),
        issues=(*sequence.issues, issue),
    )


def changes_saved(
    program: Program, sequence: Sequence, rows: Rows, check_cancelled: Heartbeat = ignore_heartbeat
) -> int:
    """Return the number of tool changes that `merge_sections` would save."""
    tools = program.path.ref[program.path.kind == Kind.TOOL]
    if len(np.unique(tools)) == len(tools):
        return 0
    merger = _Merger(program, sequence, rows, check_cancelled, only_counts=True)
    merger.join_all()
    return merger.saved


class _Merger:
    def __init__(
        self, program: Program, sequence: Sequence, rows: Rows, check_cancelled: Heartbeat, only_counts: bool = False
    ) -> None:
        self.program, self.rows, self.process = program, rows, sequence.process
        self.check_cancelled, self.only_counts = check_cancelled, only_counts
        self.items = list(sequence.items)
        self.dropped: list[FixedBlocks] = []
        self.saved = 0
        self.reader = BlockReader(program)

    def join_all(self) -> None:
        at = 1
        while at < len(self.items):
            at += not self.join(at)

    def join(self, at: int) -> bool:
        """Merge a section into an earlier section. Return whether that was possible."""
        later, change = self.items[at], self.items[at - 1]
        if not isinstance(later, Section) or not isinstance(change, FixedBlocks) or at < 2:
            return False
        if not self._is_change(change) or not self._may_follow(at):
            return False
        for place in range(at - 2, -1, -1):
            item = self.items[place]
            if isinstance(item, FixedBlocks):
                if not self._work_may_move_past(item):
                    return False
            elif self._have_same_state(item, later):
                self._merge_into(place, at)
                return True
            elif any(piece.may_detach for piece in later.pieces):
                # A part would be detached before the work between the sections.
                return False
            elif are_related(self.program, self.rows, (item.pieces, later.pieces), self.process, self.check_cancelled):
                return False
        return False

    def _merge_into(self, place: int, at: int) -> None:
        earlier, later, change = self.items[place], self.items[at], self.items[at - 1]
        assert isinstance(earlier, Section) and isinstance(later, Section) and isinstance(change, FixedBlocks)
        both = (*earlier.pieces, *later.pieces)
        self.items[place] = replace(earlier, pieces=both)
        if not self.only_counts:
            pieces, precedence, ties = with_precedence(
                self.program, self.rows, both, self.process, self.check_cancelled
            )
            self.items[place] = replace(earlier, pieces=pieces, precedence=precedence, ties=ties)
        self.dropped.append(
            replace(change, reasons=(Message("a change to a tool that has already finished its work"),))
        )
        self.saved += self._kinds(change).count(Kind.TOOL)
        del self.items[at - 1 : at + 1]

    def _kinds(self, kept: FixedBlocks) -> list[Kind]:
        rows = slice(int(self.program.first[kept.begin]), int(self.program.first[kept.end]))
        return [Kind(k) for k in self.program.path.kind[rows].tolist()]

    def _work_may_move_past(self, kept: FixedBlocks) -> bool:
        """Return whether work after the fixed blocks can move to a position before them."""
        if not _BETWEEN.issuperset(self._kinds(kept)):
            return False
        for block in range(kept.begin, kept.end):
            words = self.reader.words(block)
            if words is None or (block in self.program.fixed and not words.empty):
                return False
        one, other = self.program.modal(kept.begin), self.program.modal(kept.end)
        return all(getattr(one, f) == getattr(other, f) for f in _SAME if f not in _STATED_BY)

    def _is_change(self, kept: FixedBlocks) -> bool:
        return Kind.TOOL in self._kinds(kept) and self._work_may_move_past(kept)

    def _have_same_state(self, one: Section, other: Section) -> bool:
        before, after = (self.program.modal(s.pieces[0].begin) for s in (one, other))
        same = all(getattr(before, f) == getattr(after, f) for f in _SAME)
        return same and one.tool is not None and abs(one.clearance - other.clearance) < TOLERANCE

    def _may_follow(self, at: int) -> bool:
        """Return whether the blocks after a section can directly follow the blocks before its tool change.

        The following blocks must end the program, or contain another tool change that restores all differing values.
        """
        change = self.items[at - 1]
        follower = self.items[at + 1] if at + 1 < len(self.items) else None
        if follower is None:
            return True
        if not isinstance(follower, FixedBlocks) or not isinstance(change, FixedBlocks):
            return False
        kinds = self._kinds(follower)
        first = int(self.program.first[follower.begin])
        cuts = self.rows.cut[first : first + len(kinds)]
        ends = Kind.END in kinds and not np.any(cuts)
        if ends:
            return all(k in _BETWEEN or k is Kind.END for k in kinds)
        if Kind.TOOL not in kinds or np.any(cuts[: kinds.index(Kind.TOOL)]):
            return False
        one, other = self.program.modal(change.begin), self.program.modal(follower.begin)
        stated = set(kinds[kinds.index(Kind.TOOL) :])
        differ = [f for f in (*_SAME, "next_tool") if getattr(one, f) != getattr(other, f)]
        return all(_STATED_BY.get(f) in stated for f in differ)
