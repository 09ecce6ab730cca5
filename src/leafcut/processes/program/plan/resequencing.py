"""Find the cuts and holes of a program that can be reordered, and the blocks that must stay.

A task (a cut or a hole) extends from the rapid to its start point up to the next such rapid. All blocks outside of
tasks keep their position and their text.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from collections.abc import Sequence as Many
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest
from statistics import median

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError, count_of, name_suggestion
from leafcut.gcode.modal_dependencies import HERE, BlockReader, next_position
from leafcut.gcode.program import Modal, Program
from leafcut.gcode.reversible_cut import ReversibleCut, find_reversible_cut
from leafcut.gcode.words import parse_plain_block
from leafcut.geometry.arrays import Point
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS, ProgramKind
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.sequence import FixedBlocks, ProgramTask, Section, Sequence, StayReason
from leafcut.model.toolpath import MOTIONS, SPEED_ALONE, Kind, latest_marked_rows
from leafcut.processes.program.plan.fixed_tasks import line_text, stay_reasons
from leafcut.processes.program.plan.precedence import are_related, detaching_stages, with_precedence
from leafcut.processes.program.plan.program_rows import (
    TOLERANCE,
    Rows,
    detect_process,
    find_barriers,
    read_rows,
    runs_without_barriers,
)
from leafcut.processes.program.proof.features import Features, is_uniform
from leafcut.processes.program.proof.outlines import TOUCHING
from leafcut.processes.program.proof.traces import SAGITTA, is_simple, traces_of

#: A cut is closed if the gap between its ends is at most this part of its length, or at most `TOUCHING`.
_CLOSED_PART = 0.1
#: Cosine of 150°. If the path turns further at an arc, the chords of the arc may miss a self-intersection.
_BACK = -0.866
#: A comment labels tasks if it occurs at least `_OFTEN` times, with a median of at most `_FEW` tasks after it.
_OFTEN, _FEW = 3, 2
_NUMBERS = re.compile(r"[-+]?[0-9]*\.?[0-9]+")
_WORD = re.compile(r"[^\W\d_]{2}")
#: Two sections can be merged only if these modal values are equal.
_SAME = (
    "unit", "feed_mode", "tool", "length", "radius", "frame", "shift", "rpm", "spindle", "coolant", "blending",
    "tolerance", "joining", "incremental",
)  # fmt: skip
#: Only rows of these kinds may occur between merged sections, and in a tool change that is removed.
_BETWEEN = frozenset({Kind.RAPID, Kind.DWELL, Kind.TOOL, Kind.OFFSET, Kind.SPINDLE, Kind.COOLANT, Kind.MACHINE})
#: Kinds of rows that restore a modal value after a tool change is removed.
_STATED_BY = {
    "length": Kind.OFFSET,
    "spindle": Kind.SPINDLE,
    "rpm": Kind.SPINDLE,
    "coolant": Kind.COOLANT,
    "tool": Kind.TOOL,
    "next_tool": Kind.TOOL,
}
#: Reason for a block that contains only fixed tasks. `Sequence.stays` has the reason for each task.
STAYING = Message("the tasks in the block keep their order")
_MOTIONS = frozenset(int(k) for k in MOTIONS)
#: A program retracts the tool before rows of these kinds.
STOPS = [int(k) for k in (Kind.TOOL, Kind.PAUSE, Kind.MACHINE, Kind.END, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)]
_FEEDS = [int(k) for k in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)]


def find_sequence(
    program: Program,
    *,
    process: str = "auto",
    merge_tools: bool = False,
    allow_reverse: bool = False,
    mix_operations: bool = False,
    tool_diameter: float = 0.0,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> Sequence:
    """Divide a program into sections of tasks that can be reordered, and blocks that stay.

    Parameters
    ----------
    process
        ``drill``, ``mill``, ``laser``, ``plasma`` or ``auto``, which detects the process. Other values raise a
        PlanError.
    merge_tools
        Whether to merge sections that use the same tool, which saves tool changes.
    allow_reverse
        Whether open cuts at a single depth may start at either end (`with_reversible`).
    mix_operations
        Whether tasks from different CAM operations may be mixed (`divide_at_operations`).
    tool_diameter
        Diameter of the mills that no comment describes, mm; 0 if it is unknown.
    """
    if process != "auto" and process not in tuple(ProgramKind):
        raise PlanError("unknown process '{}'{}", process, name_suggestion(process, ["auto", *ProgramKind]))
    found = detect_process(program) if process == "auto" else process
    finder = SectionFinder(program, found, check_cancelled, tool_diameter=tool_diameter)
    items = finder.sections_and_fixed_blocks()
    stays = tuple(stay for item in items if isinstance(item, FixedBlocks) for stay in finder.stay_reasons(item))
    sequence = Sequence(tuple(items), found, (), tuple(_issues(finder, items)), stays=stays)
    if merge_tools:
        sequence = merge_sections(program, sequence, finder.rows, check_cancelled)
    else:
        sequence = replace(
            sequence, mergeable=count_saved_tool_changes(program, sequence, finder.rows, check_cancelled)
        )
    sequence = divide_at_operations(program, sequence, finder.rows, mix_operations)
    if allow_reverse:
        sequence = with_reversible(program, sequence, finder.rows)
    return sequence


def unchanged_sequence(program: Program, process: str, reason: str) -> Sequence:
    """Return a sequence in which all tasks keep their position. The `reason` is a key of `fixed_tasks.PHRASES`."""
    rows = read_rows(program, process)
    ways, cuts = np.cumsum(rows.travel), np.flatnonzero(rows.cut)
    begins = cuts[np.flatnonzero(np.diff(ways[cuts], prepend=-1))]
    lines = program.line[program.row_block[begins]].tolist()
    return Sequence(
        (FixedBlocks(0, program.n_blocks),), process, stays=tuple(StayReason(reason, line) for line in lines)
    )


def build_problem(section: Section, metric: Metric, start: Point | None, end: Point | None) -> RoutingProblem:
    """Return the routing problem of a section, with one cluster per task.

    The first node of a task leads from its entry to its exit. A reversible task has a second node for the opposite
    direction. The second nodes come after all first nodes, in the order of the tasks.
    """
    entry = np.array([c.entry for c in section.pieces], dtype=np.float64).reshape(-1, 2).round(6)
    leave = np.array([c.exit for c in section.pieces], dtype=np.float64).reshape(-1, 2).round(6)
    both = _reversible_tasks(section)
    cluster = np.concatenate([np.arange(len(entry), dtype=np.int32), both])
    tool = "" if section.tool is None else f" T{section.tool}"
    return RoutingProblem(
        np.concatenate([entry, leave[both]]),
        np.concatenate([leave, entry[both]]),
        cluster,
        np.zeros(len(cluster)),
        metric,
        section.precedence,
        start,
        end,
        name=Message("line {}{}", section.pieces[0].line, tool),
    )


def tasks_from_nodes(section: Section, nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Convert an order of routing nodes to an order of tasks, int32[n]. ~k means that task k is reversed.

    The node numbers refer to `build_problem`.
    """
    piece = np.concatenate([np.arange(len(section.pieces), dtype=np.int32), ~_reversible_tasks(section)])
    order: NDArray[np.int32] = piece[nodes]
    return order


def nodes_from_tasks(section: Section, order: NDArray[np.int32]) -> NDArray[np.int32]:
    """Convert an order of tasks to an order of routing nodes, int32[n]. This is the inverse of `piece_order`."""
    reversible = _reversible_tasks(section)
    turned = len(section.pieces) + np.searchsorted(reversible, ~order)
    nodes: NDArray[np.int32] = np.where(order < 0, turned, order).astype(np.int32)
    return nodes


def first_cut_speeds(program: Program, section: Section) -> NDArray[np.float64]:
    """Return the spindle speed at the first cut of each task in a section, rpm, float64[n]."""
    kind, first = program.path.kind, program.first
    ends = np.array([(piece.begin, piece.end) for piece in section.pieces], dtype=np.intp).reshape(-1, 2)
    begin, end = first[ends].T
    low, high = int(begin.min(initial=len(kind))), int(end.max(initial=0))
    works = low + np.flatnonzero((kind[low:high] >= Kind.FEED) & (kind[low:high] <= Kind.DRILL))
    work = np.append(works, len(kind))[np.searchsorted(works, begin)]
    blocks = program.row_block[np.where(work < end, work, begin)] + 1
    return np.array([program.modal(block).rpm for block in blocks.tolist()], dtype=np.float64)


def _reversible_tasks(section: Section) -> NDArray[np.int32]:
    return np.array([k for k, c in enumerate(section.pieces) if c.reversible], dtype=np.int32)


def _issues(finder: SectionFinder, items: list[FixedBlocks | Section]) -> list[Issue]:
    where: dict[str, list[int]] = {}
    for item in items:
        if isinstance(item, FixedBlocks):
            for reason in item.reasons:
                if reason == STAYING:
                    continue
                where.setdefault(reason, []).append(finder.line_of_reason(item, reason))
    issues = []
    if not any(isinstance(item, Section) for item in items):
        # Work that stays because of its travel move is reported separately (`SectionFinder.stays`).
        told = where or any(isinstance(item, FixedBlocks) and item.reasons for item in items)
        why = "" if told else ": " + next(iter(finder.program.fixed.values()), Message("the block contains no work"))
        issues.append(Issue("L502", Message("no work in the program can be reordered{}", why), severity=Severity.NOTE))
    for reason, lines in where.items():
        times = (
            ("", Message(", here and once more"))[len(lines) - 1]
            if len(lines) < 3
            else Message(", here and {} times more", len(lines) - 1)
        )
        issues.append(
            Issue(
                "L501",
                Message("the block keeps its position: {}{}", reason, times),
                Message("line {}", lines[0]),
                Severity.NOTE,
            )
        )
    return issues


# -- reversible cuts -------------------------------------------------------------------------------------------------


def with_reversible(program: Program, sequence: Sequence, rows: Rows) -> Sequence:
    """Mark the reversible cuts of a sequence, and add a note with the number of these cuts.

    A reversible cut is open, stays at a single depth, and is uniform from start to end. A cut is not reversible if

    - it is closed or crosses itself,
    - it dwells, switches a device or retracts along the way,
    - its first or last move has a different feed or a different kind of motion, or
    - a beam dwells in it, because the dwell is a pierce.

    If a mill dwells at one end of the cut, the dwell moves to the other end.
    """
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
        if piece.kind != "cut" or not self._has_equal_end_heights(piece):
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

    def _has_equal_end_heights(self, piece: ProgramTask) -> bool:
        """Return whether the tool arrives and leaves at the same height, so that both ends have the same clearance."""
        height = [piece.arrive_z, piece.leave_z]
        return bool(np.isnan(height).all() and self.beam) or abs(height[0] - height[1]) < TOLERANCE

    def _matches_task(self, piece: ProgramTask, stroke: ReversibleCut) -> bool:
        path, before = self.program.path, self.program.path.before
        ends = before[stroke.rows[0], :2], path.end[stroke.rows[-1], :2]
        return bool(
            np.allclose(ends[0], piece.entry, rtol=0.0, atol=TOLERANCE)
            and np.allclose(ends[1], piece.exit, rtol=0.0, atol=TOLERANCE)
        )


def _is_open(cuts: Features) -> bool:
    """Return whether a cut is open and cannot cross itself.

    The ends must be far apart. No arc may turn back so sharply that the cut might cross itself.
    """
    pieces = traces_of(cuts).flattened(SAGITTA)
    way = pieces.end - pieces.begin
    length = np.hypot(*way.T)
    along, curved = way / np.maximum(length, TOLERANCE)[:, None], pieces.arc >= 0
    goes_back = (along[:-1] * along[1:]).sum(axis=1) < _BACK
    gap = float(np.hypot(*(cuts.end[-1, :2] - cuts.start[0, :2])))
    is_open = gap > max(TOUCHING, _CLOSED_PART * float(length.sum()))
    return is_open and not (goes_back & (curved[:-1] | curved[1:])).any()


# -- CAM operations --------------------------------------------------------------------------------------------------


def divide_at_operations(program: Program, sequence: Sequence, rows: Rows, mix_operations: bool) -> Sequence:
    """Divide the sections where a CAM operation starts, and before the cuts that detach parts.

    A comment line between two tasks starts an operation unless it only labels a single task. A comment is a label if
    the same text, apart from numbers, occurs often, with one or two tasks after each occurrence. Consecutive comments
    with one task each are labels too.

    Cuts that detach parts form a section of their own if no other work follows them. Operations are ignored for lasers
    and torches, and if `mix_operations` is set.
    """
    items: list[FixedBlocks | Section] = []
    for item in sequence.items:
        if not isinstance(item, Section):
            items.append(item)
            continue
        apart = set() if mix_operations or sequence.process in BEAMS else set(_operation_starts(program, item, rows))
        edges = sorted({0, *apart, *detaching_stages(item.pieces), len(item.pieces)})
        whole = replace(item, stays=stay_reasons(item, sorted(apart)))
        items += [_subsection(whole, low, high) for low, high in pairwise(edges)]
    return replace(sequence, items=tuple(items))


def _subsection(section: Section, low: int, high: int) -> Section:
    if high - low == len(section.pieces):
        return section
    pairs = section.precedence
    inside = ((pairs >= low) & (pairs < high)).all(axis=1)
    return replace(
        section,
        pieces=section.pieces[low:high],
        precedence=pairs[inside] - np.int32(low),
        start=section.start if not low else None,
        end=section.end if high == len(section.pieces) else None,
        stays=section.stays[low:high],
    )


def _operation_starts(program: Program, section: Section, rows: Rows) -> list[int]:
    """Return the first task of every operation but the first operation."""
    pieces = section.pieces
    last_cut = np.concatenate([[-1], latest_marked_rows(rows.cut)])
    texts = {k: text for k in range(len(pieces)) if (text := _comments_before(program, section, rows, k, last_cut))}
    begins = sorted({0, *texts})
    sizes = dict(zip(begins, np.diff([*begins, len(pieces)]).tolist(), strict=True))
    of_text: dict[str, list[int]] = defaultdict(list)
    for k, text in texts.items():
        of_text[text].append(sizes[k])
    labels = {text for text, found in of_text.items() if len(found) >= _OFTEN and median(found) <= _FEW}
    begins = [k for k in begins if k == 0 or texts.get(k) not in labels]
    sizes = dict(zip(begins, np.diff([*begins, len(pieces)]).tolist(), strict=True))
    return [b for a, b in pairwise(begins) if sizes[a] > 1 or sizes[b] > 1]


def _comments_before(program: Program, section: Section, rows: Rows, number: int, last_cut: NDArray[np.int64]) -> str:
    """Join the comments between the previous cut and the first travel move of a task into a single text.

    Numbers are replaced by a placeholder, so that numbered labels yield the same text. `last_cut` is the last cut
    before each row, or -1.
    """
    piece, line = section.pieces[number], program.text_line
    first, last = int(program.first[piece.begin]), int(program.first[piece.end])
    worked = last_cut[first]
    low = int(line[program.row_block[worked]]) if worked >= 0 else 0
    ways = np.flatnonzero(rows.travel[first:last])
    high = int(line[program.row_block[first + int(ways[0])]]) if len(ways) else int(line[piece.begin])
    comments = []
    for text in program.lines[low : high - 1]:
        if "(" not in text and ";" not in text:
            continue
        block = parse_plain_block(text)
        if block is not None and all(word.letter == "N" for word in block.words) and not block.deleted:
            comments += [comment for comment in block.comments if _WORD.search(comment)]
    return " ".join(_NUMBERS.sub("#", " ".join(comments)).upper().split())


# -- sections with the same tool -------------------------------------------------------------------------------------


def merge_sections(
    program: Program, sequence: Sequence, rows: Rows, check_cancelled: Heartbeat = ignore_heartbeat
) -> Sequence:
    """Merge later sections into earlier sections that use the same tool, and remove the tool changes between them.

    No section moves past a stop, a change of offset, an unknown block, fixed work, or touching work of a different
    tool.
    """
    merger = _Merger(program, sequence, rows, check_cancelled)
    merger.merge_all()
    if not merger.dropped:
        return sequence
    saved = merger.saved
    issue = Issue(
        "L503",
        Message("joining sections of the same tool saves {}", count_of(saved, "tool change")),
        severity=Severity.NOTE,
    )
    return replace(
        sequence,
        items=tuple(merger.items),
        dropped=(*sequence.dropped, *merger.dropped),
        issues=(*sequence.issues, issue),
    )


def count_saved_tool_changes(
    program: Program, sequence: Sequence, rows: Rows, check_cancelled: Heartbeat = ignore_heartbeat
) -> int:
    """Count the tool changes that `merge_sections` would save."""
    tools = program.path.ref[program.path.kind == Kind.TOOL]
    if len(np.unique(tools)) == len(tools):
        return 0
    merger = _Merger(program, sequence, rows, check_cancelled, only_counts=True)
    merger.merge_all()
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

    def merge_all(self) -> None:
        at = 1
        while at < len(self.items):
            at += not self.merge_into_earlier(at)

    def merge_into_earlier(self, at: int) -> bool:
        later, change = self.items[at], self.items[at - 1]
        if not isinstance(later, Section) or not isinstance(change, FixedBlocks) or at < 2:
            return False
        if Kind.TOOL not in self._motion_kinds(change) or not self._work_may_move_past(change):
            return False
        if not self._may_follow(at):
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
        self.saved += self._motion_kinds(change).count(Kind.TOOL)
        del self.items[at - 1 : at + 1]

    def _motion_kinds(self, kept: FixedBlocks) -> list[Kind]:
        rows = slice(int(self.program.first[kept.begin]), int(self.program.first[kept.end]))
        return [Kind(k) for k in self.program.path.kind[rows].tolist()]

    def _work_may_move_past(self, kept: FixedBlocks) -> bool:
        if not _BETWEEN.issuperset(self._motion_kinds(kept)):
            return False
        for block in range(kept.begin, kept.end):
            words = self.reader.words(block)
            if words is None or (block in self.program.fixed and not words.empty):
                return False
        one, other = self.program.modal(kept.begin), self.program.modal(kept.end)
        return all(getattr(one, f) == getattr(other, f) for f in _SAME if f not in _STATED_BY)

    def _have_same_state(self, one: Section, other: Section) -> bool:
        before, after = (self.program.modal(s.pieces[0].begin) for s in (one, other))
        same = all(getattr(before, f) == getattr(after, f) for f in _SAME)
        return same and one.tool is not None and abs(one.clearance - other.clearance) < TOLERANCE

    def _may_follow(self, at: int) -> bool:
        """Return whether the blocks after a section can directly follow the blocks before its tool change.

        The blocks after the section must either end the program, or contain a tool change that restores all values that
        differ.
        """
        change = self.items[at - 1]
        follower = self.items[at + 1] if at + 1 < len(self.items) else None
        if follower is None:
            return True
        if not isinstance(follower, FixedBlocks) or not isinstance(change, FixedBlocks):
            return False
        kinds = self._motion_kinds(follower)
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


# -- sections --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _TaskStart:
    """A block where a task may start, with its first sideways row and the height of that move, mm."""

    block: int
    row: int
    height: float


class SectionFinder:
    """Divides a program into sections of tasks that can be reordered."""

    def __init__(
        self,
        program: Program,
        process: str,
        check_cancelled: Heartbeat = ignore_heartbeat,
        *,
        tool_diameter: float = 0.0,
    ) -> None:
        self.program, self.process, self.check_cancelled = program, process, check_cancelled
        self.rows: Rows = read_rows(program, process, tool_diameter)
        self.barriers = find_barriers(program, self.rows)
        self.reader = BlockReader(program)
        self.beam = process in BEAMS
        self.entries: set[int] = set()
        #: Maps the block of a travel move to the reason why no task can start there (`refused`), or why a task stays
        #: (`why`).
        self.refused: dict[int, str] = {}
        self.why: dict[int, tuple[str, int]] = {}
        #: Maps each block of a subprogram to the end of its call. The calling block itself is not included.
        self.called = {block: end for begin, end in program.calls for block in range(begin + 1, end)}
        self.compensates = bool((program.path.kind == Kind.RADIUS).any())
        self.blind = self._blocks_of_unknown_height()
        path, first = program.path, program.first
        self.cuts = np.concatenate([[0], np.cumsum(self.rows.cut)])
        travels = np.unique(self.program.row_block[self.rows.travel])
        self.travels = travels
        across = self.rows.travel & np.isfinite(path.end[:, 2])
        # Material is expected below the part zero, unless the zero is above all moves of the program.
        self.floor = 0.0 if (path.end[across, 2] > 0).any() and not self.beam else -math.inf
        self.first = first
        #: The last block with known modal values before each block.
        known = np.array([modal.radius > 0 for modal in program.modals])
        self.last_known = latest_marked_rows(known[program.before])

    def sections(self) -> list[Section]:
        """Return all sections in program order."""
        found: list[Section] = []
        for section in reversed(list(self._candidate_sections())):
            if (found and found[-1].pieces[0].begin == section.pieces[-1].end) or self._next_block_fits_all(section):
                found.append(section)
            else:
                self._record_reason(section.pieces, "goes-on", section.pieces[-1].end)
        return found[::-1]

    def _candidate_sections(self) -> Iterator[Section]:
        waiting = list(reversed(runs_without_barriers(self.program, self.barriers)))
        while waiting:
            begin, end = waiting.pop()
            starts = self._task_starts(begin, end)
            switches = self._spindle_switches(starts)
            if switches:
                self.barriers.update(dict.fromkeys(switches, Message("the spindle is switched on or off")))
                edges = [begin - 1, *switches, end]
                runs = [(a + 1, b) for a, b in pairwise(edges) if a + 1 < b]
                waiting += reversed(runs)
                continue
            yield from self._sections_of_run(starts, begin, end)

    def _blocks_of_unknown_height(self) -> set[int]:
        """Return the blocks in which the tool height is unknown.

        The height is unknown after a change of the length offset, until a block states Z.
        """
        found: set[int] = set()
        offsets = np.flatnonzero(self.program.path.kind == Kind.OFFSET)
        for block in self.program.row_block[offsets].tolist():
            for later in range(block, self.program.n_blocks):
                words = self.reader.words(later)
                if later in found or (words is not None and "Z" in words.letters):
                    break
                found.add(later)
        return found

    # -- starts of pieces -------------------------------------------------------------------------------------------

    def _task_starts(self, begin: int, end: int) -> list[_TaskStart]:
        """Return the blocks in a range where a task starts.

        A task starts with a travel move of the retracted tool after the previous work has ended.
        """
        low_block, high = np.searchsorted(self.travels, [begin, end])
        top = self._highest_cut(begin, end)
        # A laser or torch program need not state a height. If it does, the height applies to all pieces.
        level = self.beam and not math.isnan(self.program.path.place_before(int(self.first[end]))[2])
        starts: list[_TaskStart] = []
        done = low = -1
        for block in self.travels[low_block:high].tolist():
            if block in self.called:
                continue
            cuts = int(self.cuts[self.first[block]])
            start = self._task_start(block)
            up = self._may_start_task(start, top, level)
            if starts and cuts == done:
                # A waiting position before the first piece is not part of the piece.
                if len(starts) == 1 and up and self._states_xy(block):
                    starts = [start]
                elif not self._can_replace_arrival(start, starts[-1]):
                    self.entries.discard(starts.pop().block)
            elif not up:
                low = cuts if starts else -1
            elif cuts != low:
                # Otherwise the tool left the previous work without retracting.
                starts.append(start)
                self.entries.add(block)
                done = cuts
        return starts

    def _may_start_task(self, start: _TaskStart, top: float, level: bool) -> bool:
        unknown = level and math.isnan(self.program.path.before[start.row, 2])
        why = self._reason_against_start(start, top) or ("unknown-height" if unknown else "")
        if why:
            self.refused[start.block] = why
        return not why

    def _reason_against_start(self, start: _TaskStart, top: float) -> str:
        """Return why no task may start with this travel move (a key of `fixed_tasks.PHRASES`), or "" if it may."""
        modal = self.program.modal(start.block)
        if start.block in self.blind or math.isinf(start.height):
            return "unknown-height"
        if modal.incremental or not np.isfinite(self.program.path.end[start.row, :2]).all():
            return "relative"
        if start.height < top - TOLERANCE or start.height < self.floor:
            return "low"
        if modal.radius < 0:
            return "unknown-modes"
        if modal.radius != 40 or (self.compensates and follows_compensation(self.program, start.row)):
            return "compensated"
        return ""

    def _can_replace_arrival(self, start: _TaskStart, first: _TaskStart) -> bool:
        """Return whether the second travel move to a task can replace the first travel move.

        The second move must not be lower, and the beam must be in the same state. If another task ended at the point
        between the two moves, the tool would otherwise leave that task by an untested move.
        """
        if start.height < first.height - TOLERANCE:
            return False
        spindle = [self.program.modal(s.block + 1).spindle for s in (start, first)]
        return not self.beam or spindle[0] == spindle[1]

    def _states_xy(self, block: int) -> bool:
        words = self.reader.words(block)
        return words is not None and {"X", "Y"} <= words.letters.keys()

    def _task_start(self, block: int) -> _TaskStart:
        rows = range(int(self.first[block]), int(self.first[block + 1]))
        row = next(r for r in rows if self.rows.travel[r])
        path = self.program.path
        z0, z1 = float(self.program.path.before[row, 2]), float(path.end[row, 2])
        drill = path.kind[row] == Kind.DRILL
        height = max(z0, path.cycles[int(path.ref[row])].r_plane) if drill else min(z0, z1)
        if self.beam and math.isnan(height):
            height = 0.0
        return _TaskStart(block, row, height if not math.isnan(height) else -math.inf)

    def _highest_cut(self, begin: int, end: int) -> float:
        """Return the height of the highest sideways cut in a range of blocks, mm.

        Below this height, the tool does not count as retracted.
        """
        if self.beam:
            return -math.inf
        rows = slice(int(self.first[begin]), int(self.first[end]))
        z = np.maximum(self.program.path.end[rows, 2], self.program.path.before[rows, 2])
        travel = self.program.path.end[rows, 2][self.rows.travel[rows]]
        travel = travel[np.isfinite(travel)]
        highest = travel.max() if len(travel) else math.inf
        feeds = self.rows.cut[rows] & self.rows.sideways[rows] & (self.program.path.kind[rows] != Kind.DRILL)
        z = z[feeds & (z <= highest)]
        return float(z.max()) if len(z) else -math.inf

    def _has_default_modes(self, block: int) -> bool:
        modal = self.program.modal(block)
        return modal.radius == 40 and not modal.incremental

    def _spindle_state(self, modal: Modal) -> tuple[int, float]:
        """Return the direction and speed of the spindle. Both must be the same before and after a task."""
        return modal.spindle, modal.rpm if modal.spindle and not self.beam else 0.0

    def _spindle_switches(self, starts: list[_TaskStart]) -> list[int]:
        found = []
        free = self._returns_to_earlier_speed(starts)
        for one, other in pairwise(starts):
            key = self._spindle_state(self.program.modal(other.block))
            before = self._spindle_state(self.program.modal(one.block))
            if key != before and not (free and key[0] == before[0]):
                last = other.block - 1
                while self._spindle_state(self.program.modal(last)) == key or last in self.called:
                    last -= 1
                found.append(last)
        return found

    def _returns_to_earlier_speed(self, starts: list[_TaskStart]) -> bool:
        """Return whether a range of blocks returns to an earlier spindle speed by S words alone.

        In that case, a new order can save speed changes. A speed that is set together with M3 or M4 is fixed. So is an
        S word in a separate block before a hole of a drilling cycle.
        """
        path, first = self.program.path, self.first
        speeds = [self._spindle_state(self.program.modal(s.block)) for s in starts]
        changes = sum(a != b for a, b in pairwise(speeds))
        if self.beam or not starts or changes < len(set(speeds)):
            return False
        rows = slice(int(first[starts[0].block]), int(first[starts[-1].block]))
        switched = path.kind[rows] == Kind.SPINDLE
        alone = bool((path.ref[rows][switched] == SPEED_ALONE).all())
        cycles = any(path.kind[s.row] == Kind.DRILL and self._sets_only_speed(s.block - 1) for s in starts[1:])
        return alone and not cycles

    def _sets_only_speed(self, block: int) -> bool:
        words, rows = self.reader.words(block), range(int(self.first[block]), int(self.first[block + 1]))
        path = self.program.path
        alone = [r for r in rows if path.kind[r] == Kind.SPINDLE and path.ref[r] == SPEED_ALONE]
        says = words is not None and words.letters.keys() == {"S"} and words.states <= {"rpm"}
        return says and len(alone) == len(rows) == 1 and not self.beam

    # -- pieces and sections -----------------------------------------------------------------------------------------

    def _sections_of_run(self, starts: list[_TaskStart], begin: int, end: int) -> Iterator[Section]:
        edges = [begin - 1, end]
        if starts and self.cuts[self.first[end]] == self.cuts[starts[-1].row]:
            # The last travel move goes to the end position, not to work.
            end = starts[-1].block
            starts = starts[:-1]
        for start in starts:
            self.why[start.block] = self._why_single_task_stays(*edges) if len(starts) == 1 else ("crossing", -1)
        if len(starts) < 2:
            return
        path = self.program.path
        places = [(float(path.end[s.row, 0]), float(path.end[s.row, 1])) for s in starts]
        for members, stop, clearance in group_by_height([s.height for s in starts[1:]], places):
            chosen = [starts[m] for m in members]
            # Blocks between two members belong to the first of the two.
            self.entries -= {s.block for s in starts[members[0] : stop]} - {s.block for s in chosen}
            pieces = [self._build_task(a, b.block, b.row) for a, b in pairwise([*chosen, *starts[stop:][:1]])]
            last = self._end_after_retract(chosen[-1], end, clearance) if stop == len(starts) else None
            why = "lit" if self.beam and self.rows.beam[int(self.first[end]) - 1] else "low"
            if last is not None:
                pieces.append(self._build_task(chosen[-1], last, int(self.first[last])))
            pieces = self._with_prefixes(pieces, clearance)
            if stop == len(starts) and must_stay_last(self.program, self.rows, pieces[-1]):
                pieces, why = pieces[:-1], why if last is None else "goes-on"
            if len(pieces) > 1:
                yield self._build_section(pieces, chosen[0], clearance)
                chosen = chosen[len(pieces) :]
            self.why.update((start.block, (why, end if why == "goes-on" else -1)) for start in chosen)

    def _why_single_task_stays(self, before: int, after: int) -> tuple[str, int]:
        """Return why a single task between two barriers stays, and which barrier separates it from other work."""
        last = int(self.cuts[-1])
        if after < self.program.n_blocks and self.cuts[self.first[after]] < last:
            return "alone", after
        if before >= 0 and self.cuts[self.first[before + 1]] > 0:
            return "alone", before
        return "only", -1

    def _record_reason(self, pieces: Iterable[ProgramTask], why: str, block: int) -> None:
        for piece in pieces:
            self.why.update((b, (why, block)) for b in range(piece.begin, piece.end) if b in self.entries)

    def _end_after_retract(self, start: _TaskStart, end: int, clearance: float) -> int | None:
        """Return the end of the last task in a range: the block after the retract.

        Return None if the tool does not retract.
        """
        turning = self.program.modal(start.block).spindle
        low, high = int(self.first[start.block]), int(self.first[end])
        cuts = np.flatnonzero(self.rows.cut[low:high])
        if not len(cuts):
            return None
        for block in range(int(self.program.row_block[low + int(cuts[-1])]), end):
            if block + 1 in self.called:
                continue
            row = int(self.first[block + 1]) - 1
            z = self.program.path.place_before(row + 1)[2]
            up = (math.isnan(z) and self.beam) or z >= clearance - TOLERANCE
            same = self.program.modal(block + 1).spindle == turning and self._has_default_modes(block + 1)
            if up and same and not (self.beam and self.rows.beam[row]):
                return self._end_of_retract(self._end_of_dwells(block + 1, end, low + int(cuts[-1])), end)
        return None

    def _end_of_retract(self, block: int, end: int) -> int:
        """Return the end of the retract after a task, provided that the tool moves on to other work from there.

        A retract before a tool change or before the end of the program does not belong to the task.
        """
        row = int(self.first[end])
        while block < end and self._is_retract(block) and not stops_before_work(self.program, self.rows, row):
            block += 1
        return block

    def _is_retract(self, block: int) -> bool:
        rows = range(int(self.first[block]), int(self.first[block + 1]))
        return len(rows) > 0 and all(
            self.program.path.kind[r] == Kind.RAPID and not self.rows.sideways[r] for r in rows
        )

    def _end_of_dwells(self, block: int, end: int, last_cut: int) -> int:
        """Return the end of the dwells after a cut. A dwell before a retract belongs to the cut."""
        if np.isin(self.program.path.kind[last_cut : int(self.first[block])], [Kind.RAPID, Kind.DRILL]).any():
            return block
        while block < end and set(self.reader.kinds(block)) == {int(Kind.DWELL)}:
            block += 1
        return block

    def _build_task(self, start: _TaskStart, end: int, end_row: int) -> ProgramTask:
        self.check_cancelled()
        path = self.program.path
        rows = slice(start.row, int(self.first[end]))
        x, y, z = path.place_before(end_row)
        worked = path.kind[rows][self.rows.cut[rows]]
        depths = path.end[rows, 2][self.rows.cut[rows]]
        drills = worked == Kind.DRILL
        if drills.any():
            cycles = path.ref[rows][self.rows.cut[rows]][drills]
            depths = depths.copy()
            depths[drills] = [path.cycles[c].bottom for c in cycles.tolist()]
        # A full circle ends at its start, but still moves sideways.
        aside = self.rows.sideways[rows] | np.isin(path.kind[rows], [Kind.ARC_CW, Kind.ARC_CCW])
        upright = not (self.rows.cut[rows] & aside & (path.kind[rows] != Kind.DRILL)).any()
        drill = path.kind[start.row] == Kind.DRILL
        return ProgramTask(
            start.block,
            end,
            "hole" if upright and not self.beam else "cut",
            (float(path.end[start.row, 0]), float(path.end[start.row, 1])),
            (x, y),
            start.height if drill else float(path.end[start.row, 2]),
            z,
            float(depths[np.isfinite(depths)].min()) if np.isfinite(depths).any() else math.nan,
            int(self.program.line[start.block]),
        )

    def _with_prefixes(self, pieces: list[ProgramTask], clearance: float) -> list[ProgramTask]:
        """Extend every task but the first by the rapids at the clearance height before it."""
        result = pieces[:1]
        for piece in pieces[1:]:
            begin = piece.begin
            while begin - 1 > result[-1].begin and (
                self._stays_up(begin - 1, clearance) or self._sets_only_speed(begin - 1)
            ):
                begin -= 1
            if begin < piece.begin:
                result[-1] = replace(result[-1], end=begin)
            result.append(replace(piece, begin=begin, line=int(self.program.line[begin])))
        return result

    def _stays_up(self, block: int, clearance: float) -> bool:
        rows = range(int(self.first[block]), int(self.first[block + 1]))
        path, before = self.program.path, self.program.path.before
        return len(rows) > 0 and all(
            path.kind[r] == Kind.RAPID
            and abs(path.end[r, 2] - clearance) < TOLERANCE
            and np.array_equal(path.end[r], before[r], equal_nan=True)
            and not (self.compensates and follows_compensation(self.program, r))
            for r in rows
        )

    def _next_block_fits_all(self, section: Section) -> bool:
        """Return whether the block after a section can follow any task of the section.

        If that block is a hole that continues a cycle, every task must end with the same cycle and at the same height.
        """
        program, end = self.program, section.pieces[-1].end
        follower = next((b for b in range(end, program.n_blocks) if self._has_effect(b)), None)
        if follower is None:
            return True
        if int(Kind.DRILL) not in self.reader.kinds(follower) or follower in program.fixed:
            goes_on = follower in program.fixed and program.modal(end).cycle is not None
        else:
            goes_on = "motion" in self.reader.modal_use(follower, follower + 1).inherited
        if not goes_on:
            return True
        states = {(*self._cycle_state(c.end), round(c.leave_z, 6)) for c in section.pieces}
        here = next_position(self.reader, range(end, program.n_blocks), section.clearance) == HERE
        return len(states) == 1 and not here

    def _has_effect(self, block: int) -> bool:
        words = self.reader.words(block)
        hidden = block in self.program.fixed and (words is None or not words.empty)
        return hidden or not _MOTIONS.isdisjoint(self.reader.kinds(block))

    def _cycle_state(self, block: int) -> tuple[object, ...]:
        modal = self.program.modal(block)
        return modal.motion, modal.cycle, frozenset(modal.cycle_words), modal.to_initial

    def _build_section(self, pieces: list[ProgramTask], first: _TaskStart, clearance: float) -> Section:
        before = self.program.path.before[first.row, :2]
        marked, pairs, ties = with_precedence(self.program, self.rows, pieces, self.process, self.check_cancelled)
        return Section(
            marked,
            pairs,
            (float(before[0]), float(before[1])) if np.isfinite(before).all() else None,
            None,
            clearance,
            self.program.modal(pieces[0].begin).tool,
            ties,
        )

    # -- fixed blocks ------------------------------------------------------------------------------------------------

    def sections_and_fixed_blocks(self) -> list[FixedBlocks | Section]:
        """Return the sections and the fixed blocks between them, in program order."""
        items: list[FixedBlocks | Section] = []
        sections = self.sections()
        done = 0
        for section, follower in zip_longest(sections, sections[1:]):
            begin, end = section.pieces[0].begin, section.pieces[-1].end
            if begin > done:
                items.append(self._fixed_blocks(done, begin, inside=bool(items)))
            upto = self.program.n_blocks if follower is None else follower.pieces[0].begin
            place = next_position(self.reader, range(end, upto), section.clearance)
            items.append(replace(section, end=section.pieces[-1].exit if isinstance(place, str) else place))
            done = end
        if done < self.program.n_blocks:
            items.append(self._fixed_blocks(done, self.program.n_blocks, inside=False))
        return items

    def _fixed_blocks(self, begin: int, end: int, inside: bool) -> FixedBlocks:
        works = self.cuts[self.first[end]] > self.cuts[self.first[begin]]
        if not works and not inside:
            return FixedBlocks(begin, end)
        reasons = dict.fromkeys(
            self.barriers[b] for b in range(begin, end) if b in self.barriers and self._is_between_cuts(b)
        )
        if works and not reasons:
            reasons[STAYING] = None
        return FixedBlocks(begin, end, tuple(reasons))

    def line_of_reason(self, kept: FixedBlocks, reason: str) -> int:
        """Return the line of the first block that stays for the given reason."""
        blocks = range(kept.begin, kept.end)
        block = next((b for b in blocks if self.barriers.get(b) == reason), kept.begin)
        return int(self.program.line[block])

    def stay_reasons(self, kept: FixedBlocks) -> Iterator[StayReason]:
        """Yield the reason why each task in the fixed blocks stays."""
        begin = way = -1
        worked = False
        for block in range(kept.begin, kept.end):
            across = bool(self.rows.travel[self.first[block] : self.first[block + 1]].any())
            if across and worked and (block in self.entries or self._is_divided(begin, block)):
                yield self._stay_reason(begin, block)
                begin, worked = block, False
            if across and not worked:
                way = block
            if self.cuts[self.first[block + 1]] > self.cuts[self.first[block]]:
                if not worked:
                    begin = way if way >= 0 else block
                worked = True
        if worked:
            yield self._stay_reason(begin, kept.end)

    def _is_divided(self, begin: int, end: int) -> bool:
        return any(block in self.barriers for block in range(begin, end + 1))

    def _stay_reason(self, begin: int, end: int) -> StayReason:
        program = self.program
        cuts = [b for b in range(begin, end) if self.cuts[self.first[b + 1]] > self.cuts[self.first[b]]]
        holds = next((b for b in range(begin, cuts[-1] + 1) if b in self.barriers), None)
        way = next((b for b in range(begin, cuts[0] + 1) if b in self.refused or b in self.why), begin)
        reason, block = self.why.get(way, (self.refused.get(way, "low"), -1))
        if reason == "unknown-modes":
            block = int(self.last_known[way])
        if holds is not None and self.refused.get(way) != "unknown-height":
            reason, block = "holds", holds
        line = int(program.line[begin if block < 0 else min(block, program.n_blocks - 1)])
        if block < 0:
            return StayReason(reason, line)
        cause = "" if reason == "goes-on" else self.barriers.get(block, "")
        return StayReason(reason, line, line_text(program, line), cause)

    def _is_between_cuts(self, block: int) -> bool:
        return bool(self.cuts[self.first[block]] > 0 and self.cuts[self.first[block + 1]] < self.cuts[-1])


#: Maximum depth of grouping by height. Real programs use far fewer heights.
_MOST_HEIGHTS = 40


def group_by_height(heights: Many[float], places: Many[tuple[float, float]]) -> list[tuple[list[int], int, float]]:
    """Group consecutive tasks that travel at the same height. Each group can be reordered.

    Parameters
    ----------
    heights
        Travel height from task i to task i + 1, mm.
    places
        Start points of the tasks, mm.

    Returns
    -------
    list
        One entry per group: the index of the first task of each member, the end of the last member, and the travel
        height in mm. A member is a run of tasks that stay together when the group is reordered.
    """
    groups: list[tuple[list[int], int, float]] = []
    waiting = [(0, len(places), 0)]
    while waiting:
        low, high, depth = waiting.pop()
        if high - low < 2:
            continue
        top = max(heights[low : high - 1])
        cuts = [i + 1 for i in range(low, high - 1) if heights[i] >= top - TOLERANCE]
        if len(cuts) < high - low - 1 and depth < _MOST_HEIGHTS:
            edges = [low, *cuts, high]
            parts = list(pairwise(edges))
            if sum(_count_movable(places[a:b]) for a, b in parts) > len(cuts):
                waiting += [(a, b, depth + 1) for a, b in reversed(parts)]
                continue
        groups.append(([low, *cuts], high, top))
    return groups


def _count_movable(places: Many[tuple[float, float]]) -> int:
    """Count the tasks that can be reordered. Passes with the same start point count as a single task."""
    return len({(round(x, 1), round(y, 1)) for x, y in places}) - 1


# -- the last piece of a series --------------------------------------------------------------------------------------


def must_stay_last(program: Program, rows: Rows, piece: ProgramTask) -> bool:
    """Return whether the fixed blocks after a task force it to stay the last task of its section.

    This is the case if

    - a dwell or cutter compensation follows without a rapid, or a cut follows without a travel move;
    - the tool retracts higher in a fixed block and continues to other work from there;
    - the task moves elsewhere after its work, for example to the operator or to the end position;
    - the beam is on in the next travel move but off in the first travel move of the task.
    """
    low, high = int(program.first[piece.begin]), int(program.first[piece.end])
    last = low + int(np.flatnonzero(rows.cut[low:high])[-1])
    return (
        _continues_from_cut(program, rows, last, high)
        or bool((rows.travel & ~rows.cut)[last + 1 : high].any())
        or _is_lit_after(program, rows, low, high)
    )


def _continues_from_cut(program: Program, rows: Rows, last: int, high: int) -> bool:
    """Return whether the fixed rows after the last cut depend on the end point of that cut."""
    kind, ref, z = program.path.kind, program.path.ref, program.path.end[:, 2]
    risen = higher = False
    for row in range(last + 1, len(kind)):
        stays = row >= high
        if kind[row] == Kind.RAPID:
            compensated = follows_compensation(program, row)
            if rows.sideways[row] or (stays and compensated):
                return (stays and compensated) or (higher and not stops_before_work(program, rows, row))
            risen |= not compensated
            higher = stays and bool(z[row] > program.path.before[high, 2] + TOLERANCE)
        elif kind[row] in _FEEDS:
            return stays
        elif kind[row] == Kind.DRILL:
            # If the hole follows directly, another last piece retracts in the same way.
            r_plane = program.path.cycles[int(ref[row])].r_plane
            return higher or (row > high and r_plane > program.path.before[high, 2] + TOLERANCE)
        elif kind[row] in STOPS:
            return False
        elif stays and not risen and (kind[row] == Kind.DWELL or (kind[row] == Kind.RADIUS and ref[row] != 40)):
            return True
    return False


def stops_before_work(program: Program, rows: Rows, row: int) -> bool:
    """Return whether a stop or a tool change comes between a row and the next cut."""
    upcoming = [np.flatnonzero(mask[row:]) for mask in (rows.cut, np.isin(program.path.kind, STOPS))]
    work, stop = (int(found[0]) if len(found) else math.inf for found in upcoming)
    return stop < work


def follows_compensation(program: Program, row: int) -> bool:
    """Return whether cutter compensation is on in the move before a row, so that it ends in this row."""
    kind = program.path.kind
    before = next((r for r in range(row - 1, -1, -1) if kind[r] <= Kind.DRILL), -1)
    if before < 0:
        return False
    return program.modal(int(program.row_block[before]) + 1).radius != 40


def _is_lit_after(program: Program, rows: Rows, low: int, high: int) -> bool:
    """Return whether the beam is on in the first travel move after a task but off in its own first travel move."""
    if not rows.beam.any():
        return False
    ways = [np.flatnonzero(part) for part in (rows.travel[low:high], rows.travel[high:])]
    if not all(len(way) for way in ways):
        return False
    blocks = [int(program.row_block[start + int(way[0])]) for start, way in zip((low, high), ways, strict=True)]
    own, after = (program.modal(block + 1).spindle for block in blocks)
    return own == 0 and after != 0
