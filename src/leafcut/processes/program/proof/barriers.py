"""Compare the barriers of two programs, such as pauses, tool changes and work offsets.

Barriers must keep their order, and they separate groups of work.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from leafcut.gcode.block_description import BlockDescription, normalize_line
from leafcut.gcode.program import Modal, Program
from leafcut.geometry.arrays import Floats, Indices, Ints, Mask
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import FIRST_CYCLE, Features, ProgramPath
from leafcut.processes.program.proof.matching import FeatureChange, StateChange, state_change_text
from leafcut.proof.clearance import rows_at_machine_height
from leafcut.proof.difference import describe_motion, position_text

#: More kinds of barriers: block delete (/), comments and settings that the controller obeys, and messages.
SKIPPED, OBEYED, MESSAGE = -1, -2, -3
#: The tool position does not matter for these barriers.
PLACELESS = (SKIPPED, OBEYED, MESSAGE, Kind.DWELL)

_HARD = (Kind.PAUSE, Kind.TOOL, Kind.SHIFT, Kind.MACHINE, Kind.END, Kind.FOREIGN)
#: Kinds of rows that occur in a tool change. The whole change can be omitted if the tool stays the same.
_PART_OF_CHANGE = (Kind.TOOL, Kind.MACHINE, Kind.PAUSE, Kind.DWELL)
#: These barriers are compared by their full text, because their effect is unknown.
_COMPARED_AS_TEXT = (Kind.FOREIGN, Kind.SHIFT)
#: Matches a block that sets an offset from the tool position: G92, G10 L10, L11 and L20.
_FROM_HERE = re.compile(r"\bG92(?![.0-9][0-9])|\bL(?:10|11|20)\b")


class Barrier(NamedTuple):
    """A barrier in a program, or a dwell that belongs to a barrier.

    Attributes
    ----------
    values
        All values that must be equal in both programs.
    kind
        A `Kind`, `SKIPPED`, `OBEYED` or `MESSAGE`.
    key
        Row number, minus 0.5 if the barrier comes before the row.
    line
        Line of the program.
    place
        Position of the tool, mm.
    fixed_place
        Whether the position must be the same in both programs, because the block may move from there.
    text
        Text for messages.
    height_unknown
        Whether the tool is at an unknown height other than machine zero.
    """

    values: tuple[object, ...]
    kind: int
    key: float
    line: int
    place: tuple[float, float, float]
    fixed_place: bool
    text: str
    height_unknown: bool = False


@dataclass(frozen=True, eq=False)
class BarrierGroup:
    """Consecutive barriers without work between them.

    `after` is the number of features that come before the barriers.
    """

    marks: tuple[Barrier, ...]
    after: int

    @property
    def values(self) -> tuple[object, ...]:
        """All values that must be equal in both programs."""
        return tuple(mark.values for mark in self.marks)

    @property
    def is_tool_change(self) -> bool:
        """Whether the barriers do nothing but change the tool."""
        kinds = {mark.kind for mark in self.marks}
        return Kind.TOOL in kinds and kinds <= set(_PART_OF_CHANGE)


def barriers_of(program_path: ProgramPath) -> list[Barrier]:
    """Return the barriers of a program in order."""
    program, path, source = program_path.program, program_path.path, program_path.source
    kind, before = path.kind, path.before
    frame = (kind == Kind.FRAME) & (np.diff(program_path.modal("frame"), prepend=540) != 0)
    rows = np.flatnonzero(np.isin(kind, [int(k) for k in _HARD]) | frame)
    lost = np.isnan(before[:, 2]) & ~rows_at_machine_height(path, 0.0)
    marks = []
    for row in rows.tolist():
        motion = path[row]
        block, modal = int(program.row_block[source[row]]), program_path.modal_at(row)
        description, text = program.descriptions.get(block, BlockDescription()), ""
        context: tuple[object, ...] = ()
        if motion.kind in _COMPARED_AS_TEXT:
            text = _normalized_line(program, motion.line)
            context = _modal_context(program.modal(block), motion.kind, description)
        shown = description.text
        values = (
            int(motion.kind),
            0 if text else motion.ref,
            text if description == BlockDescription() else description,
            context,
        )
        end = tuple(round(v, 6) for v in motion.end if not np.isnan(v)) if motion.kind is Kind.MACHINE else ()
        at = (before[row, 0], before[row, 1], before[row, 2])
        fixed_place = motion.kind is Kind.FOREIGN or (motion.kind is Kind.SHIFT and bool(_FROM_HERE.search(shown)))
        state = modal.spindle, modal.coolant, modal.radius
        # The next program may rely on a cancelled length offset.
        left_on = motion.kind is Kind.END and modal.length != 0
        words = _block_text(text, shown) if text else describe_motion(motion) + (f" {shown}" if shown else "")
        if motion.kind is Kind.END and motion.ref < 0:
            words = Message("end of the text, without M2 or M30")
        marks.append(
            Barrier(
                (*values, end, *state, left_on),
                int(motion.kind),
                row,
                motion.line,
                at,
                fixed_place,
                words,
                bool(lost[row]),
            )
        )
    return sorted(
        [*marks, *_skipped_blocks_and_messages(program, source), *_obeyed_comments(program, source)],
        key=lambda mark: mark.key,
    )


def _modal_context(m: Modal, kind: Kind, description: BlockDescription) -> tuple[object, ...]:
    """Return the part of the modal state `m` that may affect a barrier block.

    If the block is not understood, the whole state is returned. A shift of the origin depends only on the units, the
    distance mode, the tool and the active offsets.
    """
    if kind is Kind.SHIFT:
        return (m.unit, m.incremental, m.frame, m.length, m.tool)
    letters = {word[0] for word in description.text.split()}
    if description.is_closed and letters.issubset(_PLAIN):
        return ()
    own = {"feed": "F", "rpm": "S"}
    return tuple(None if own.get(name) in letters else getattr(m, name) for name in _READ)


#: Letters of M words and their arguments. If a block contains no other letters, no modal state affects it.
_PLAIN = frozenset("MPQTELR$")
#: Modal values that an unknown block may read. The number of origin shifts is left out, because shifts are barriers
#: themselves.
_READ = tuple(field.name for field in fields(Modal) if field.name != "shift")


def _skipped_blocks_and_messages(program: Program, source: Indices) -> Iterator[Barrier]:
    nowhere = (np.nan, np.nan, np.nan)
    kinds = program.path.kind
    for block, description in program.descriptions.items():
        begin, end = int(program.first[block]), int(program.first[block + 1])
        skipped = description.text.startswith("/")
        if not skipped and np.isin(kinds[begin:end], _HARD).any():
            continue
        line, kind = int(program.line[block]), SKIPPED if skipped else MESSAGE
        row = int(np.searchsorted(source, begin))
        text = program.lines[line - 1].strip()
        yield Barrier((kind, description), kind, row - 0.5, line, nowhere, False, text)


def _block_text(text: str, description: str) -> str:
    """Format a block for a message: its text, followed by the computed values if they differ from the text."""
    values = description.replace(" ", "").replace(".", "")
    computed = "".join(text.split()) != "".join(description.split()) and ("#" in text or "[" in values)
    return f"{text} = {description}" if description and text and computed else text


def _obeyed_comments(program: Program, source: Indices) -> Iterator[Barrier]:
    """Yield the comments and settings that the controller obeys, in the order of execution."""
    obeyed = {one.line: one for one in program.obeyed}
    nowhere = (np.nan, np.nan, np.nan)
    for block in np.flatnonzero(np.isin(program.line, list(obeyed))).tolist():
        one = obeyed[int(program.line[block])]
        row = int(np.searchsorted(source, program.first[block]))
        unit = program.modal(block).unit
        yield Barrier((OBEYED, *one.value, unit), OBEYED, row - 0.5, one.line, nowhere, False, one.text)


def compare_unreached_settings(before: Program, after: Program) -> Iterator[Difference]:
    """Yield the settings that differ in lines that never run, for example in a subprogram that is never called."""
    run = [set(p.line.tolist()) if p.obeyed else set() for p in (before, after)]
    one, other = (
        [setting for setting in p.obeyed if setting.line not in lines]
        for p, lines in zip((before, after), run, strict=True)
    )
    if [setting.value for setting in one] != [setting.value for setting in other]:
        lines = one[0].line if one else 0, other[0].line if other else 0
        was, now = (", ".join(setting.text for setting in side) or Message("none") for side in (one, other))
        text = Message("the controller settings in lines that are not executed differ: {} became {}", was, now)
        yield Difference(Message("changed setting"), *lines, text)


def _normalized_line(program: Program, line: int) -> str:
    return normalize_line(program.lines[line - 1]) if 0 < line <= len(program.lines) else ""


def with_barrier_dwells(
    marks: list[Barrier], features: Features, travel: Indices, across: Indices, program_path: ProgramPath
) -> tuple[list[Barrier], Mask]:
    """Add the dwells that belong to barriers. Return all barriers and a mask of these dwells.

    A dwell before the first cut of a stage belongs to the barrier. So does a dwell after the last cut and a rapid, or
    after a drilling cycle, which ends with a rapid. A dwell that leads into a cut without a rapid, such as a pierce
    delay, belongs to that cut.

    Parameters
    ----------
    travel
        Rows of all rapids, int64[k].
    across
        Rows of the rapids in X or Y, int64[k].
    """
    keys = np.array([-1.0, *(mark.key for mark in marks), np.inf])
    dwell = features.kind == Kind.DWELL
    rows, work = features.row[dwell], features.row[~dwell]
    at = np.searchsorted(keys, rows)
    begin, end = keys[at - 1], keys[at]
    last_work = np.maximum(_last_row_before(work, rows), begin)
    head = (last_work == begin) & (_last_row_before(across, rows) <= begin)
    # An unknown block may cut, so it matters whether the dwell comes before or after the rapid away from it.
    foreign = np.array([False, *(mark.kind == Kind.FOREIGN for mark in marks), False])[at - 1]
    waits_there = foreign & (_last_row_before(travel, rows) <= begin)
    coming = np.append(work, np.inf)[np.searchsorted(work, rows)]
    cycle = np.append(features.kind[~dwell] >= FIRST_CYCLE, True)
    head &= cycle[np.searchsorted(work, rows)] | (coming > end) | (_last_row_before(travel, coming) > rows)
    works_later = np.searchsorted(work, rows) < np.searchsorted(work, end)
    risen = (last_work > begin) & cycle[np.searchsorted(work, rows) - 1]
    tail = ~works_later & (risen | (_last_row_before(travel, rows) > last_work))
    moved = np.zeros(len(features), dtype=bool)
    moved[dwell] = head | tail
    added = []
    of_barrier = zip(np.flatnonzero(moved).tolist(), head[head | tail].tolist(), waits_there[head | tail], strict=True)
    for index, first, there in of_barrier:
        row, line, seconds = int(features.row[index]), int(features.line[index]), float(features.dwell[index])
        modal = program_path.modal_at(row)
        state = modal.spindle, modal.coolant
        values = (int(Kind.DWELL), "head" if first else "tail", bool(there), round(seconds, 4), *state)
        x, y, z = features.end[index].tolist()
        added.append(Barrier(values, int(Kind.DWELL), row, line, (x, y, z), False, Message("dwell of {:g} s", seconds)))
    return sorted([*marks, *added], key=lambda mark: mark.key), moved


def _last_row_before(among: Indices, rows: Indices | Floats) -> Floats:
    """Return the last row in `among` before each row, or -1 if there is none."""
    return np.concatenate([[-1.0], among])[np.searchsorted(among, rows)]


def group_barriers(marks: list[Barrier], work: Ints) -> list[BarrierGroup]:
    """Group consecutive barriers without work between them.

    `work` contains the rows of the features in ascending order, int32[n].
    """
    ranks = np.searchsorted(work, [mark.key for mark in marks]).tolist()
    groups = groupby(zip(marks, ranks, strict=True), key=itemgetter(1))
    return [BarrierGroup(tuple(mark for mark, _ in group), rank) for rank, group in groups]


class ComparisonGroups(NamedTuple):
    """Groups of work between matching barriers, and the differences between the barriers.

    Attributes
    ----------
    before, after
        Number of features up to the end of each group but the last, in the original program and in the new program.
    mark_of
        Maps the key of a barrier in the original program to the equal barrier in the new program.
    differences
        Differences between the barriers.
    states
        Barriers that differ only in the machine state, with their changes as in `matching.state_change_text`.
    implied
        Changes that follow from removed or added tool changes and work offsets.
    """

    before: list[int]
    after: list[int]
    mark_of: dict[float, Barrier]
    differences: list[Difference]
    states: list[tuple[Difference, frozenset[FeatureChange]]]
    implied: list[StateChange]


def compare_barrier_groups(before: list[BarrierGroup], after: list[BarrierGroup]) -> ComparisonGroups:
    """Match the barriers of two programs. Return the groups of work between the barriers, and all differences.

    Both programs must have the same barriers in the same order. The new program may only omit whole tool changes. In
    that case, the work on both sides of the tool change forms a single group.
    """
    if _count_tool_changes(after) >= _count_tool_changes(before):
        return _match_groups(before, after)
    hard = _match_groups(_without_tool_changes(before), _without_tool_changes(after))
    left: dict[tuple[int, tuple[object, ...]], list[BarrierGroup]] = defaultdict(list)
    for wall in reversed(_only_tool_changes(before)):
        left[bisect_left(hard.before, wall.after), wall.values].append(wall)
    for wall in _only_tool_changes(after):
        same = left[bisect_left(hard.after, wall.after), wall.values]
        if same:
            hard.mark_of.update({a.key: b for a, b in zip(same.pop().marks, wall.marks, strict=True)})
        else:
            hard.differences.append(_added_tool_change(wall, [one for walls in left.values() for one in walls]))
            hard.implied.extend(_implied_changes(list(wall.marks), "new"))
    return hard


def _added_tool_change(wall: BarrierGroup, others: list[BarrierGroup]) -> Difference:
    """Report a tool change that only the new program contains.

    If the original program changes to the same tool at another position, the message includes that change.
    """
    text, tools = Message.joined(", ", (mark.text for mark in wall.marks)), _tool_numbers(wall)
    for other in others:
        was = Message.joined(", ", (mark.text for mark in other.marks))
        if _tool_numbers(other) == tools and was != text:
            return Difference(
                Message("tool change"), other.marks[0].line, wall.marks[0].line, Message("'{}' became '{}'", was, text)
            )
    return Difference(Message("tool change"), 0, wall.marks[0].line, Message("'{}' is not in the original", text))


def _tool_numbers(wall: BarrierGroup) -> list[object]:
    return [mark.values[1] for mark in wall.marks if mark.kind == Kind.TOOL]


def _count_tool_changes(walls: list[BarrierGroup]) -> int:
    return sum(mark.kind == Kind.TOOL for wall in walls for mark in wall.marks)


def _without_tool_changes(walls: list[BarrierGroup]) -> list[BarrierGroup]:
    return [wall for wall in walls if not wall.is_tool_change]


def _only_tool_changes(walls: list[BarrierGroup]) -> list[BarrierGroup]:
    return [wall for wall in walls if wall.is_tool_change]


def _match_groups(before: list[BarrierGroup], after: list[BarrierGroup]) -> ComparisonGroups:
    """Match barriers from both ends of the programs.

    If some barriers in the middle do not match, they are reported as differences. The work between them forms a single
    group.
    """
    one, other = ([(mark, wall.after) for wall in walls for mark in wall.marks] for walls in (before, after))
    shorter = min(len(one), len(other))
    head = next((i for i in range(shorter) if one[i][0].values != other[i][0].values), shorter)
    rest = shorter - head
    tail = next((i for i in range(rest) if one[-1 - i][0].values != other[-1 - i][0].values), rest)
    pairs = [*zip(one[:head], other[:head], strict=True)]
    pairs += zip(one[len(one) - tail :], other[len(other) - tail :], strict=True)
    ends = sorted({(a[1], b[1]) for a, b in pairs})
    middle = ([m for m, _ in side[head : len(side) - tail]] for side in (one, other))
    return ComparisonGroups(
        [a for a, _ in ends], [b for _, b in ends], {a[0].key: b[0] for a, b in pairs}, *_unmatched_differences(*middle)
    )


def _unmatched_differences(
    before: list[Barrier], after: list[Barrier]
) -> tuple[list[Difference], list[tuple[Difference, frozenset[FeatureChange]]], list[StateChange]]:
    """Compute `differences`, `states` and `implied` of `ComparisonGroups` for barriers that have no match."""
    found: list[Difference] = []
    states: list[tuple[Difference, frozenset[FeatureChange]]] = []
    left, right = Counter(mark.values for mark in after), Counter(mark.values for mark in before)
    gone: list[Barrier] = []
    new: list[Barrier] = []
    for marks, others, kept in ((before, left, gone), (after, right, new)):
        for mark in marks:
            others[mark.values] -= 1
            if others[mark.values] < 0:
                kept.append(mark)
    if not gone and not new and before:
        text = Message("'{}' has moved in the order", before[0].text)
        found.append(Difference(Message("order of barriers"), before[0].line, after[0].line, text))
    for one, other in zip(gone, new, strict=False):
        if state := _state_changes(one, other):
            told = Difference(
                Message("changed {}", _barrier_noun(one)),
                one.line,
                other.line,
                Message("at '{}': {}", one.text, Message.joined("; ", (change.message for change in state))),
            )
            states.append((told, frozenset(state)))
            continue
        text = Message("'{}' became '{}'", one.text, other.text)
        if one.text == other.text:
            reads = _changed_inputs(one, other)
            text = (
                Message("'{}' differs: {}", one.text, Message.joined("; ", reads))
                if reads
                else Message("the state of the spindle, the coolant or the tasks around '{}' has changed", one.text)
            )
        found.append(Difference(Message("changed {}", _barrier_noun(one)), one.line, other.line, text))
    found += (
        Difference(Message("missing {}", _barrier_noun(mark)), mark.line, 0, Message("'{}' is missing", mark.text))
        for mark in gone[len(new) :]
    )
    found += (
        Difference(Message("extra {}", _barrier_noun(mark)), 0, mark.line, Message("'{}' is new", mark.text))
        for mark in new[len(gone) :]
    )
    return found, states, [*_implied_changes(gone, "gone"), *_implied_changes(new, "new")]


def _changed_inputs(one: Barrier, other: Barrier) -> list[str]:
    descriptions = [[value for value in mark.values if isinstance(value, BlockDescription)] for mark in (one, other)]
    return [name for a, b in zip(*descriptions, strict=False) for name in a.changed_inputs(b)]


#: Names of barriers in messages.
_NOUNS: dict[int, Message] = {
    Kind.PAUSE: Message("stop"),
    Kind.TOOL: Message("tool"),
    Kind.FRAME: Message("work offset"),
    Kind.SHIFT: Message("shift of the origin"),
    Kind.MACHINE: Message("machine move"),
    Kind.END: Message("end of program"),
    Kind.DWELL: Message("dwell"),
    OBEYED: Message("setting"),
    MESSAGE: Message("message"),
}


def _barrier_noun(mark: Barrier) -> Message:
    written = mark.kind != MESSAGE or mark.text.startswith("(")
    return _NOUNS.get(mark.kind, Message("block")) if written else Message("block")


def _state_changes(one: Barrier, other: Barrier) -> list[FeatureChange]:
    if one.kind != other.kind or one.kind in (SKIPPED, OBEYED, MESSAGE):
        return []
    names = ("spindle", "coolant") if one.kind == Kind.DWELL else ("spindle", "coolant", "radius")
    begin = 4 if one.kind == Kind.DWELL else 5
    here, there = (slice(begin), slice(begin + len(names), None))
    if one.values[here] != other.values[here] or one.values[there] != other.values[there]:
        return []
    states = zip(names, one.values[begin:], other.values[begin:], strict=False)
    return [
        state_change_text(name, was, now)
        for name, was, now in states
        if was != now and isinstance(was, int) and isinstance(now, int)
    ]


def _implied_changes(marks: list[Barrier], which: str) -> Iterator[StateChange]:
    for mark in marks:
        if mark.kind in (Kind.TOOL, Kind.FRAME) and isinstance(ref := mark.values[1], int):
            name = "tool" if mark.kind == Kind.TOOL else "frame"
            yield (name, ref, None) if which == "gone" else (name, None, ref)


def find_misplaced_barriers(
    marks: list[Barrier], mark_of: dict[float, Barrier], tolerance: float
) -> Iterator[Difference]:
    """Yield the barriers where the tool is lower than in the original, at an unknown height, or at a wrong position."""
    for mark in marks:
        new = mark_of.get(mark.key)
        if new is None or mark.kind in PLACELESS:
            continue
        here, there = np.array(mark.place), np.array(new.place)
        apart = ~(np.abs(here - there) <= tolerance + 1e-9) & ~(np.isnan(here) & np.isnan(there))
        if mark.fixed_place and apart.any():
            was, now = position_text(*mark.place), position_text(*new.place)
            text = Message(
                "'{}' may start at the current position of the tool, which has changed from {} to {}",
                mark.text,
                was,
                now,
            )
            yield Difference(Message("barrier at another position"), mark.line, new.line, text)
        elif new.height_unknown and not mark.height_unknown:
            text = Message("at '{}' the height of the tool is no longer known", mark.text)
            yield Difference(Message("unknown height"), mark.line, new.line, text)
        elif new.place[2] < mark.place[2] - tolerance - 1e-9:
            text = Message("at '{}' the tool was at Z{:.3f}, now at Z{:.3f}", mark.text, mark.place[2], new.place[2])
            yield Difference(Message("lower retract"), mark.line, new.line, text)
