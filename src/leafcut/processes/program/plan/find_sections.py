"""Divide a program from another CAM system into fixed blocks and movable pieces of work (cuts and holes)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest

import numpy as np

from leafcut.gcode.modal_dependencies import HERE, BlockReader, next_position
from leafcut.gcode.program import Modal, Program
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.kinds import BEAMS
from leafcut.model.sequence import FixedBlocks, ProgramTask, Section, StayReason
from leafcut.model.toolpath import MOTIONS, SPEED_ALONE, Kind, last_rows
from leafcut.processes.program.plan.fixed_last import follows_compensation, must_stay_last, stops_before_work
from leafcut.processes.program.plan.fixed_tasks import line_text
from leafcut.processes.program.plan.precedence import with_precedence
from leafcut.processes.program.plan.program_rows import (
    TOLERANCE,
    Rows,
    find_barriers,
    read_rows,
    runs_without_barriers,
)

#: Reason for blocks that contain only fixed work; `Sequence.stays` has the reason for each piece of work.
STAYING = Message("the tasks in the block keep their order")

_MOTIONS = frozenset(int(k) for k in MOTIONS)


@dataclass(frozen=True, slots=True)
class _TaskStart:
    """A block at which a piece of work may start, its first sideways row, and the height of that move, mm."""

    block: int
    row: int
    height: float


class SectionFinder:
    """Divides a program into sections of pieces of work that can be reordered."""

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
        #: By block of a travel move: the reason why no piece can start there, and the reason why a piece stays.
        self.refused: dict[int, str] = {}
        self.why: dict[int, tuple[str, int]] = {}
        #: Block of a subprogram → end of its call. The calling block itself is not included.
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
        #: For each block, the last earlier block with known modal values.
        known = np.array([modal.radius > 0 for modal in program.modals])
        self.last_known = last_rows(known[program.before])

    def sections(self) -> list[Section]:
        """Return all sections in program order."""
        found: list[Section] = []
        for section in reversed(list(self._candidates())):
            if (found and found[-1].pieces[0].begin == section.pieces[-1].end) or self._next_block_fits_all(section):
                found.append(section)
            else:
                self._record_reason(section.pieces, "goes-on", section.pieces[-1].end)
        return found[::-1]

    def _candidates(self) -> Iterator[Section]:
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
        """Return the blocks with an unknown height: from a change of length offset to the next block that states Z."""
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
        """Return the starts of the pieces of work in a series of blocks.

        A start is a travel move of the retracted tool after the previous work has ended.
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
            start = self._start(block)
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
        """Return the reason why no piece of work may start with this travel move (`fixed_tasks.PHRASES`), or ""."""
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
        """Return whether the second travel move to a piece of work can replace the first.

        The second move must not be lower, and the beam must be in the same state. Otherwise, if another piece ended at
        the point between the two moves, the tool would leave that piece by an untested move.
        """
        if start.height < first.height - TOLERANCE:
            return False
        spindle = [self.program.modal(s.block + 1).spindle for s in (start, first)]
        return not self.beam or spindle[0] == spindle[1]

    def _states_xy(self, block: int) -> bool:
        words = self.reader.words(block)
        return words is not None and {"X", "Y"} <= words.letters.keys()

    def _start(self, block: int) -> _TaskStart:
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
        """Return the height of the highest sideways cut in a series of blocks, mm.

        In a travel move below this height, the tool is not retracted.
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
        """Return the direction and speed of the spindle, which must be the same before and after a piece of work."""
        return modal.spindle, modal.rpm if modal.spindle and not self.beam else 0.0

    def _spindle_switches(self, starts: list[_TaskStart]) -> list[int]:
        """Return the blocks in a series that switch the spindle for the work after them."""
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
        """Return whether a series of blocks returns to an earlier spindle speed by S words alone.

        Reordering can then save changes of the speed. Speeds set together with M3 or M4 are fixed, and so is an S word
        in a separate block before a hole of a drilling cycle.
        """
        path, first = self.program.path, self.first
        speeds = [self._spindle_state(self.program.modal(s.block)) for s in starts]
        changes = sum(a != b for a, b in pairwise(speeds))
        if self.beam or not starts or changes < len(set(speeds)):
            return False
        rows = slice(int(first[starts[0].block]), int(first[starts[-1].block]))
        switched = path.kind[rows] == Kind.SPINDLE
        alone = bool((path.ref[rows][switched] == SPEED_ALONE).all())
        cycles = any(path.kind[s.row] == Kind.DRILL and self._only_speed(s.block - 1) for s in starts[1:])
        return alone and not cycles

    def _only_speed(self, block: int) -> bool:
        words, rows = self.reader.words(block), range(int(self.first[block]), int(self.first[block + 1]))
        path = self.program.path
        alone = [r for r in rows if path.kind[r] == Kind.SPINDLE and path.ref[r] == SPEED_ALONE]
        says = words is not None and words.letters.keys() == {"S"} and words.states <= {"rpm"}
        return says and len(alone) == len(rows) == 1 and not self.beam

    # -- pieces and sections -----------------------------------------------------------------------------------------

    def _sections_of_run(self, starts: list[_TaskStart], begin: int, end: int) -> Iterator[Section]:
        """Yield the sections in a series of blocks from `begin` to `end` - 1."""
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
        """Return why a single piece of work between two barriers stays, and which barrier separates it from
        other work.
        """
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
        """Return the end of the last piece of work in a series: after the block that retracts the tool.

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
        """Return the end of the retract after a piece of work, if the tool continues to other work from there.

        A retract before a tool change or before the end of the program is not part of the piece.
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
        """Return the end of the dwells after a cut. Dwells before a retract are part of the cut."""
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
        """Extend every piece of work except the first by the rapids at the clearance height that precede it."""
        result = pieces[:1]
        for piece in pieces[1:]:
            begin = piece.begin
            while begin - 1 > result[-1].begin and (
                self._stays_up(begin - 1, clearance) or self._only_speed(begin - 1)
            ):
                begin -= 1
            if begin < piece.begin:
                result[-1] = replace(result[-1], end=begin)
            result.append(replace(piece, begin=begin, line=int(self.program.line[begin])))
        return result

    def _stays_up(self, block: int, clearance: float) -> bool:
        """Return whether a block contains only rapids to the current position at the clearance height."""
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
        """Return whether the block after a section can follow any piece of work of the section.

        If that block is a hole that continues a cycle, every piece must end with the same cycle and at the same height.
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
        """Return whether a block moves an axis or may have an unknown effect."""
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

    def items(self) -> list[FixedBlocks | Section]:
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
        """Return the line of the first block that stays for a given reason."""
        blocks = range(kept.begin, kept.end)
        block = next((b for b in blocks if self.barriers.get(b) == reason), kept.begin)
        return int(self.program.line[block])

    def stays(self, kept: FixedBlocks) -> Iterator[StayReason]:
        """Yield the reason for each piece of work in blocks that stay."""
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
        """Return whether the program cuts both before and after a block."""
        return bool(self.cuts[self.first[block]] > 0 and self.cuts[self.first[block + 1]] < self.cuts[-1])


#: Maximum depth of grouping by height; real programs use far fewer heights.
_MOST_HEIGHTS = 40


def group_by_height(
    heights: Sequence[float], places: Sequence[tuple[float, float]]
) -> list[tuple[list[int], int, float]]:
    """Group consecutive pieces of work by the travel height between them. Each group can be reordered.

    Parameters
    ----------
    heights
        Travel height from piece i to piece i + 1, mm.
    places
        Start points of the pieces, mm.

    Returns
    -------
    list
        For each group: the first piece of each of its members, the end of the last member, and the travel height, mm. A
        member contains all pieces up to the next member, and moves as a whole.
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


def _count_movable(places: Sequence[tuple[float, float]]) -> int:
    """Return the number of pieces that can be reordered. Passes with the same start point count as one piece."""
    return len({(round(x, 1), round(y, 1)) for x, y in places}) - 1
