"""Write a program with its tasks (cuts and holes) in a new order.

Tasks and fixed blocks keep their text. If a task relied on modal words that the previous task no longer provides, these
words are added to its first block. If the heights differ, a rapid is inserted before the task.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator
from collections.abc import Sequence as Many
from contextlib import contextmanager
from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PostError
from leafcut.gcode.modal_dependencies import (
    HERE,
    INHERITED,
    BlockReader,
    ModalUse,
    depends_on_height,
    next_position,
    replace_fields,
)
from leafcut.gcode.program import Modal, Program
from leafcut.gcode.reversible_cut import ReversibleCut, find_reversible_cut
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.kinds import BEAMS, ProgramKind
from leafcut.model.sequence import FixedBlocks, ProgramTask, Section, Sequence
from leafcut.model.toolpath import MOTIONS, Kind
from leafcut.processes.program.post.insertion import (
    code_without_comments,
    format_length,
    format_value,
    insert_words,
    insert_words_within,
    line_ending,
    renumbered,
    replace_all_words,
    replace_words,
)

if TYPE_CHECKING:
    from leafcut.model.obstacles import Obstacles

_TOLERANCE = 1e-6
#: Words that must not be written in a separate block. An arc without a centre is an error in rs274 ("R i j k words all
#: missing for arc") and in GRBL (error 26).
_ARCS = frozenset({"G2", "G3"})
_NUMBER = re.compile(r"[-+]?[0-9.]+")
#: The first task of a section may restate these fields of `Modal`.
_RESTATED = frozenset({"plane", "incremental", "feed_mode", "feed", "rpm"})
#: Number of the G word for the reversed motion, by the kind of the original motion.
_BACK = {int(Kind.FEED): 1, int(Kind.ARC_CW): 3, int(Kind.ARC_CCW): 2}
#: (letter, number, block) → the word as the program last spelled it before the block.
Spelled = Callable[[str, float, int], str]
_STOPS = (Kind.TOOL, Kind.PAUSE, Kind.MACHINE, Kind.END, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN)


def rewrite(
    program: Program,
    sequence: Sequence,
    orders: Many[ArrayLike],
    *,
    renumber: bool = False,
    longest: int = 255,
    check_cancelled: Heartbeat = ignore_heartbeat,
    obstacles: Obstacles | None = None,
) -> str:
    """Write the tasks of each section in the given order and return the text of the program.

    Parameters
    ----------
    orders
        For each section, a permutation of its tasks. ~k means that task k is reversed.
    renumber
        Whether to renumber the lines.
    longest
        Maximum length of a line with inserted words, in characters. A line that was already longer may keep its length.
    obstacles
        Rapids must pass over these obstacles, or around them if the tool cannot be raised.

    Raises
    ------
    PostError
        The program cannot be written in this order. For example, an order is invalid, a line gets too long, or no rapid
        leads past an obstacle. Renumbering fails if the program jumps to a line number. The blocks after a section may
        also depend on a state of its last task that no word can restore.
    """
    permutations: list[NDArray[np.int64]] = []
    for number, (section, order) in enumerate(zip(sequence.sections, orders, strict=True)):
        with _naming_section(number):
            permutations.append(checked_order(section, order))
    same = not sequence.dropped and obstacles is None and all((p == np.arange(len(p))).all() for p in permutations)
    if same and not renumber:
        return "".join(program.lines)
    lines = [(line, False) for line in program.lines]
    if not same:
        lines = _Rewriter(program, sequence, longest, check_cancelled, obstacles).lines(permutations)
    return "".join(renumbered(lines, longest) if renumber else (text for text, _ in lines))


@contextmanager
def _naming_section(number: int) -> Iterator[None]:
    try:
        yield
    except PostError as problem:
        raise PostError(str(problem), section=number) from None


class _Rewriter:
    def __init__(
        self,
        program: Program,
        sequence: Sequence,
        longest: int,
        check_cancelled: Heartbeat,
        obstacles: Obstacles | None = None,
    ) -> None:
        self.program, self.sequence, self.longest, self.check_cancelled = program, sequence, longest, check_cancelled
        self.obstacles = obstacles
        self.reader = BlockReader(program, beam=sequence.process == ProgramKind.LASER)
        self.beam = sequence.process in BEAMS
        self.task_lines = TaskLines(program, sequence)
        self.original = OriginalPositions(program)
        self.out: list[tuple[str, bool]] = []
        self.end = line_ending(program.lines)
        self.have = Modal()
        self.place = [math.nan] * 3
        #: Initial height of the active cycle series, mm.
        self.initial = math.nan
        #: Fields of `Modal` that the new program has already stated. All other fields still have the machine's initial
        #: state.
        self.stated: set[str] = set()

    def lines(self, orders: Many[NDArray[np.int64]]) -> list[tuple[str, bool]]:
        """Return the lines of the new program. The flag of a line is True if the line was inserted."""
        done = 0
        self._copy_lines(self.task_lines.head)
        for item in self.sequence.items:
            if isinstance(item, FixedBlocks):
                if done:
                    with _naming_section(done - 1):
                        self._restore_state(item)
                self._write_fixed_blocks(item)
                continue
            if not done:
                self._set_state_of_original(item.pieces[0].begin)
            with _naming_section(done):
                self._write_section(item, orders[done])
            done += 1
        self._copy_lines(self.task_lines.tail)
        # The last line of the original may lack a line ending, and is no longer the last line if its piece has moved.
        ends = ("\n", "\r")
        before = [(text if text.endswith(ends) else text + self.end, new) for text, new in self.out[:-1]]
        return [*before, *self.out[-1:]]

    def _copy_lines(self, lines: Many[str]) -> None:
        self.out.extend((line, False) for line in lines)

    def _write_block(self, *words: str) -> None:
        self.out.append((" ".join(words) + self.end, True))

    def _write_rapid(self, x: float | None = None, y: float | None = None, z: float | None = None) -> None:
        """Write a new rapid. If a canned cycle is active, G80 is written first."""
        if self.have.cycle is not None:
            self._write_block("G80")
        axes = [(letter, v) for letter, v in zip("XYZ", (x, y, z), strict=True) if v is not None]
        self._write_block("G0", *(letter + format_length(v, self.have.unit) for letter, v in axes))
        for letter, v in axes:
            self.place["XYZ".index(letter)] = v
        self.have = replace(self.have, motion=0, cycle=None, cycle_words=())

    def _set_state_of_original(self, block: int) -> None:
        self.have = self.program.modal(block)
        self.stated = self.reader.fields_set_in_blocks(0, block)
        self.place = self.original.position_before(block)
        self.initial = self.original.initial_height_before(block)

    # -- pieces that move --------------------------------------------------------------------------------------------

    def _write_section(self, section: Section, order: NDArray[np.int64]) -> None:
        """Write the tasks of a section in the given order.

        At the new first task, the tool arrives no lower than at the first task of the original program.
        """
        pieces = section.pieces
        entry = self.original.crossing_height(pieces[0])
        entry = section.clearance if math.isnan(entry) else max(section.clearance, entry)
        follows = self.original.follows_work(pieces[0].begin)
        floor = entry
        restated = self._restated_fields(section) if order[0] else frozenset()
        for place, number in enumerate(order.tolist()):
            index, turned = (~number, True) if number < 0 else (number, False)
            height = max(floor, entry) if index == 0 and follows else floor
            self._write_task(pieces[index], height, turned, restated if not place else frozenset())
            # The original may have retracted before it left its last piece.
            floor = section.clearance
            if index == len(pieces) - 1:
                floor = max(floor, self.original.departure_height(pieces[-1]))

    def _restated_fields(self, section: Section) -> frozenset[str]:
        pieces = section.pieces
        return frozenset({"feed"} | (_RESTATED & self.reader.fields_set_in_blocks(pieces[0].begin, pieces[-1].end)))

    def _write_task(self, piece: ProgramTask, floor: float, turned: bool, restated: frozenset[str]) -> None:
        """Write a task. The tool arrives at the height `floor` (mm) or higher.

        The fields in `restated` are written even if they are already active.
        """
        self.check_cancelled()
        program = self.program
        block, row = self.original.arrival_block_and_row(piece)
        entry = piece.exit if turned else piece.entry
        modal_use = self.reader.modal_use(piece.begin, piece.end)
        floor = self._height_past_obstacles(entry, floor, program.modal(piece.begin).tool)
        if program.path.kind[row] == Kind.DRILL and block == piece.begin:
            self._arrive_drilling(piece, row, floor)
        else:
            self._write_arrival(piece, block, floor, entry)
        front, back = self._missing_words(modal_use, program.modal(piece.begin), piece.begin, restated)
        stated = self._letters(block)
        axes = [
            letter + format_length(value, program.modal(block).unit)
            for letter, value, now in zip("XY", entry, self.place, strict=False)
            if letter not in stated and not abs(value - now) < _TOLERANCE
        ]
        lines = list(self.task_lines.block_lines(piece.begin, piece.end))
        leaves = program.modal(piece.end)
        if turned:
            lines, leaves = self._reversed_lines(piece, lines)
        arrival = self.task_lines.first_block_in(piece.begin, block)
        begin = self.task_lines.first_block_in(piece.begin, piece.begin)
        lengths = [len(line.rstrip("\r\n")) for line in lines]
        if axes:
            lines[arrival : arrival + 1] = insert_words_within(lines[arrival], [], axes, self.longest, lengths[arrival])
        lines[begin : begin + 1] = insert_words_within(lines[begin], front, back, self.longest, lengths[begin])
        self._copy_lines(lines)
        self._track_task(piece)
        self._set_fields(modal_use.sets, leaves)
        self.place[:2] = piece.entry if turned else self.place[:2]

    def _height_past_obstacles(self, to: tuple[float, float], floor: float, tool: int | None) -> float:
        """Return the height at which a rapid to `to` clears all obstacles, mm.

        If no height clears the obstacles, write rapids around them and return `floor`.
        """
        obstacles, here = self.obstacles, (self.place[0], self.place[1])
        over = -math.inf if obstacles is None else obstacles.min_rapid_height(here, to, tool)
        if obstacles is None or over < math.inf:
            return max(floor, over)
        turns = obstacles.route_around(here, to, tool)
        if turns is None:
            raise PostError("there is no path to X{:.3f} Y{:.3f} around the --keep-out zones", to[0], to[1])
        for x, y in turns:
            self._write_rapid(x, y)
        return floor

    def _reversed_lines(self, piece: ProgramTask, lines: list[str]) -> tuple[list[str], Modal]:
        stroke = find_reversible_cut(self.program, piece.begin, piece.end)
        if stroke is None:
            raise PostError("line {}: the cut there cannot be reversed", piece.line)
        offset = int(self.program.line[piece.begin]) - 1 - self.task_lines.first_block_in(piece.begin, piece.begin)
        return ReversedCut(self.program, self.reader, stroke, lines, offset, self._word_text).write()

    def _letters(self, block: int) -> dict[str, str]:
        words = self.reader.words(block)
        return {} if words is None else words.letters

    def _write_arrival(self, piece: ProgramTask, arrival: int, floor: float, entry: tuple[float, float]) -> None:
        z, original = self.place[2], self.original.position_before(piece.begin)[2]
        matters = depends_on_height(self.reader, range(piece.begin, piece.end))
        level = max(floor, original) if matters and not math.isnan(original) else floor
        if _is_below(z, level):
            self._write_rapid(z=level)
        lowest = min((v for v in map(self._stated_z, range(piece.begin, arrival + 1)) if v is not None), default=level)
        down = matters and _is_below(original, self.place[2])
        if _is_below(lowest, floor) or down:
            self._write_rapid(*entry)
        if down:
            self._write_rapid(z=original)

    def _stated_z(self, block: int) -> float | None:
        """Return the height that a block before the cut states, mm, or None if it states no height."""
        if "Z" not in self._letters(block):
            return None
        return float(self.program.path.end[int(self.program.first[block + 1]) - 1, 2])

    def _arrive_drilling(self, piece: ProgramTask, row: int, floor: float) -> None:
        path = self.program.path
        if _is_below(max(self.place[2], path.cycles[int(path.ref[row])].r_plane), floor):
            self._write_rapid(z=floor)
        risen = self.original.heights_of_first_return(range(row, int(self.program.first[piece.end])))
        initial = self.initial if self.have.cycle is not None else self.place[2]
        if risen is not None and abs((initial if initial >= risen[1] else risen[1]) - risen[0]) > _TOLERANCE:
            # The height is never below the R plane of the first hole.
            wanted = max(risen[0], path.cycles[int(path.ref[row])].r_plane)
            if _is_below(wanted, self.place[2]):
                self._write_rapid(*piece.entry)
            if abs(self.place[2] - wanted) > _TOLERANCE or self.have.cycle is not None:
                self._write_rapid(z=wanted)
        if self.have.cycle is None:
            self.initial = self.place[2]

    def _track_task(self, piece: ProgramTask) -> None:
        program, path = self.program, self.program.path
        height = self.place[2]
        for block in range(piece.begin, piece.end):
            states_z = "Z" in self._letters(block)
            for row in range(int(program.first[block]), int(program.first[block + 1])):
                if path.kind[row] == Kind.DRILL:
                    height = float(path.end[row, 2])
                elif path.kind[row] in MOTIONS:
                    height = float(path.end[row, 2]) if states_z else height
                    # The initial height of a following series of cycles.
                    self.initial = height
        x, y, _ = self.original.position_before(piece.end)
        self.place = [x, y, height]
        self.stated |= self.reader.fields_set_in_blocks(piece.begin, piece.end)

    def _set_fields(self, fields: frozenset[str], modal: Modal) -> None:
        self.have = replace_fields(self.have, fields, modal)

    # -- words -------------------------------------------------------------------------------------------------------

    def _missing_words(
        self, modal_use: ModalUse, need: Modal, block: int, restated: frozenset[str] = frozenset()
    ) -> tuple[list[str], list[str]]:
        """Return the words that a block lacks: G words for its start, and other words for its end.

        The fields in `restated` are stated even if they are already active.
        """
        have, relies = self.have, modal_use.inherited
        front: list[str] = []
        back: list[str] = []
        # State every field that the original states earlier, even if its value is the initial state of the machine.
        known = {field for field in relies if self.reader.first_blocks_by_field.get(field, block) < block}
        unstated = known - self.stated
        again = known & restated
        word_of = {
            "incremental": "G91" if need.incremental else "G90",
            "plane": f"G{need.plane}",
            "absolute_centres": "G90.1" if need.absolute_centres else "G91.1",
            "to_initial": "G98" if need.to_initial else "G99",
            "feed_mode": f"G{need.feed_mode}",
        }
        for field, word in word_of.items():
            if field in unstated | again or (field in relies and getattr(have, field) != getattr(need, field)):
                front.append(word)
                self.stated.add(field)
        if "motion" in relies:
            if need.cycle is not None:
                stated = self._letters(block)
                words = [(w, v) for w, v in need.cycle_words if w not in stated]
                if have.cycle != need.cycle or not dict(have.cycle_words).items() >= set(words):
                    # A block that states its cycle may still use words from earlier blocks of the cycle.
                    front += (
                        [] if "motion" in self.reader.fields_set_in_blocks(block, block + 1) else [f"G{need.cycle}"]
                    )
                    back += [self._word_text(w, v, block) for w, v in words]
            elif need.motion is not None and have.motion != need.motion:
                front.append(f"G{need.motion}")
        if "feed" in relies and need.feed and (have.feed != need.feed or "feed" in again):
            back.append(self._word_text("F", need.feed, block))
        # Laser and torch programs state the power where the beam is switched on.
        if "rpm" in relies and (have.rpm != need.rpm or ("rpm" in again and not self.beam)):
            back.append(self._word_text("S", need.rpm, block))
        return front, back

    def _word_text(self, letter: str, value: float, block: int) -> str:
        """Spell a word as the program last spelled it before the block. A new word is formatted from its value."""
        if letter == "F" and value in self.program.feed_words:
            return self.program.feed_words[value]
        blocks, texts = self.reader.blocks_by_letter.get(letter, ([], []))
        at = bisect_right(blocks, block - 1) - 1
        if at >= 0 and _NUMBER.fullmatch(texts[at]) and float(texts[at]) == value:
            return letter + texts[at]
        return letter + format_value(value)

    # -- fixed blocks ------------------------------------------------------------------------------------------------

    def _write_fixed_blocks(self, kept: FixedBlocks) -> None:
        """Write fixed blocks. If a rapid would hit an obstacle, insert rapids over or around the obstacle first."""
        lines, done = self.task_lines.block_lines(kept.begin, kept.end), 0
        if self.obstacles is None:
            self._copy_lines(lines)
            self._track_fixed_blocks(kept)
            return
        have = self.have
        for block in range(kept.begin, kept.end):
            rows = range(int(self.program.first[block]), int(self.program.first[block + 1]))
            if rows and block not in self.program.fixed and self._hits_obstacle(block, rows[0]):
                here = self.task_lines.first_block_in(kept.begin, block)
                self._copy_lines(lines[done:here])
                done = here
                self.have = self.program.modal(block)
                x, y, _ = self.program.path.end[rows[0]].tolist()
                self._move_past_obstacles(x, y, down="Z" not in self._letters(block))
                self.have = have
            self._track_fixed_blocks(FixedBlocks(block, block + 1))
        self._copy_lines(lines[done:])

    def _hits_obstacle(self, block: int, row: int) -> bool:
        """Return whether a rapid in a fixed block, starting at the current position, crosses an obstacle too low.

        The result is False in an active cycle series and with incremental coordinates, because an inserted rapid would
        change the motion there.
        """
        obstacles, path, modal = self.obstacles, self.program.path, self.program.modal(block)
        if obstacles is None or path.kind[row] not in (Kind.RAPID, Kind.DRILL) or modal.cycle or modal.incremental:
            return False
        x, y, z = path.end[row].tolist()
        if math.isnan(x) or math.isnan(y):
            return False
        drills = path.kind[row] == Kind.DRILL
        level = max(self.place[2], path.cycles[int(path.ref[row])].r_plane) if drills else min(self.place[2], z)
        # An unknown height follows a move in machine coordinates, where the tool is retracted. A laser has no height.
        over = obstacles.min_rapid_height((self.place[0], self.place[1]), (x, y), modal.tool)
        return _is_below(level, over) or over == math.inf

    def _move_past_obstacles(self, x: float, y: float, *, down: bool) -> None:
        """Move over or around all obstacles to a point. If `down` is set, return to the previous height afterwards."""
        height = self.place[2]
        level = self._height_past_obstacles((x, y), -math.inf, self.have.tool)
        if level > height:
            self._write_rapid(z=level)
        self._write_rapid(x, y)
        if down and self.place[2] > height:
            self._write_rapid(z=height)

    def _restore_state(self, kept: FixedBlocks) -> None:
        program, blocks = self.program, range(kept.begin, kept.end)
        original = self.original.position_before(kept.begin)
        if _is_below(self.place[2], original[2]):
            self._rapid_to(z=original[2])
        goes = next_position(self.reader, blocks, min(original[2], self.place[2]))
        away = not all(
            abs(a - b) < _TOLERANCE or math.isnan(b) for a, b in zip(self.place[:2], original[:2], strict=True)
        )
        if goes == HERE and away:
            self._rapid_to(*original[:2])
        if _is_below(original[2], self.place[2]) and depends_on_height(self.reader, blocks):
            self._rapid_to(z=original[2])
        risen = self.original.heights_of_first_return(
            range(int(program.first[kept.begin]), int(program.first[kept.end]))
        )
        initial = self.initial if self.have.cycle is not None else self.place[2]
        if risen is not None and _is_below(max(initial, risen[1]), risen[0]):
            # In the original, the cycles retract to this initial height.
            self._rapid_to(z=risen[0])
        modal_use = self.reader.modal_use(kept.begin, kept.end)
        need = program.modal(kept.begin)
        if "motion" in modal_use.inherited and need.cycle is not None and not self._same_series(need, kept.begin):
            raise PostError("line {} continues a drilling cycle, which has changed", program.line[kept.begin])
        if self.have.cycle is not None and need.cycle is None and self._ends_cycle(modal_use, need, kept):
            self._write_block("G80")
            self.have = replace(self.have, cycle=None, cycle_words=())
        words = [w for part in self._missing_words(modal_use, need, kept.begin) for w in part]
        if not _ARCS.isdisjoint(words):
            line = program.line[kept.begin]
            raise PostError("line {} continues an arc, but a block must not contain G2 or G3 alone", line)
        if words:
            self._write_block(*words)
        self._set_fields(modal_use.inherited, need)
        self._set_fields(modal_use.sets, program.modal(kept.end))
        self.have = replace_fields(program.modal(kept.end), INHERITED, self.have)
        self.stated |= self.reader.fields_set_in_blocks(kept.begin, kept.end)

    def _rapid_to(self, x: float = math.nan, y: float = math.nan, z: float = math.nan) -> None:
        if not math.isnan(x) and not math.isnan(y) and self.obstacles is not None:
            self._move_past_obstacles(x, y, down=True)
        elif not all(map(math.isnan, (x, y, z))):
            self._write_rapid(*(None if math.isnan(v) else v for v in (x, y, z)))

    def _ends_cycle(self, modal_use: ModalUse, need: Modal, kept: FixedBlocks) -> bool:
        kinds = {kind for block in range(kept.begin, kept.end) for kind in self.reader.kinds(block)}
        alone = {Kind.MACHINE, Kind.SHIFT, Kind.FOREIGN}
        return not kinds.isdisjoint(alone) or ("motion" in modal_use.inherited and need.motion is None)

    def _same_series(self, need: Modal, block: int) -> bool:
        have = self.have
        same = have.cycle == need.cycle and dict(have.cycle_words) == dict(need.cycle_words)
        initial = self.original.initial_height_before(block)
        return same and (not need.to_initial or abs(initial - self.initial) < _TOLERANCE)

    def _track_fixed_blocks(self, kept: FixedBlocks) -> None:
        program, path = self.program, self.program.path
        low, high = int(program.first[kept.begin]), int(program.first[kept.end])
        place = self.original.position_before(kept.end)
        kinds = path.kind[low:high]
        elsewhere = np.isin(kinds, [Kind.MACHINE, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN]).any()
        letters = {letter for b in range(kept.begin, kept.end) for letter in self._letters(b)}
        opaque = any(self._has_hidden_effect(b) for b in range(kept.begin, kept.end))
        for axis, letter in enumerate("XYZ"):
            if elsewhere or opaque or letter in letters or (axis == 2 and (kinds == Kind.DRILL).any()):
                self.place[axis] = place[axis]
        self.initial = self.original.initial_height_before(kept.end)

    def _has_hidden_effect(self, block: int) -> bool:
        words = self.reader.words(block)
        return words is None or (block in self.program.fixed and not words.empty)


def _is_below(height: float, other: float) -> bool:
    return height < other - _TOLERANCE


class TaskLines:
    """Assigns each line of a program to a task.

    Comments directly above the first block of a task belong to that task. A blank line ends these comments, so comments
    above it do not belong to the task. The first task gets as many lines above it as the second task. Comments farther
    up belong to the section.
    """

    def __init__(self, program: Program, sequence: Sequence) -> None:
        self._lines = tuple(program.lines)
        self._line = program.text_line.tolist()
        self._cut: dict[int, int] = {}
        for section in sequence.sections:
            self._divide_lines(section)

    @property
    def head(self) -> tuple[str, ...]:
        """The lines before the first task."""
        return self._lines[: self._line_count_before(0)]

    @property
    def tail(self) -> tuple[str, ...]:
        """The lines after the last block."""
        return self._lines[self._line[-1] :] if self._line else self._lines

    def block_lines(self, begin: int, end: int) -> tuple[str, ...]:
        """Return the lines of a half-open range of blocks."""
        return self._lines[self._line_count_before(begin) : self._line_count_before(end)]

    def first_block_in(self, begin: int, block: int) -> int:
        """Return the index of a block's line among the lines of its task. The first block of the task is `begin`."""
        return int(self._line[block]) - 1 - self._line_count_before(begin)

    def _line_count_before(self, block: int) -> int:
        """Count the lines before a block, or before the task that starts with this block."""
        if block in self._cut:
            return self._cut[block]
        return int(self._line[block - 1]) if block else 0

    def _divide_lines(self, section: Section) -> None:
        pieces = section.pieces
        for number, piece in enumerate(pieces):
            if number and pieces[number - 1].end == piece.begin:
                self._cut[piece.begin] = self._first_line_of_follower(piece.begin)
        for number, piece in enumerate(pieces):
            if piece.begin in self._cut:
                continue
            follower = pieces[number + 1] if number + 1 < len(pieces) else None
            alike = follower is not None and follower.begin == piece.end
            above = self._line[follower.begin] - 1 - self._cut[follower.begin] if alike and follower else 0
            low, high = self._line[piece.begin - 1] if piece.begin else 0, self._line[piece.begin] - 1
            self._cut[piece.begin] = max(low, high - above)

    def _first_line_of_follower(self, block: int) -> int:
        low, high = int(self._line[block - 1]), int(self._line[block]) - 1
        blank = [n for n in range(low, high) if not self._lines[n].strip()]
        if blank and any(self._lines[n].strip() for n in range(blank[0], high)):
            return blank[0]
        return low


def checked_order(section: Section, order: ArrayLike) -> NDArray[np.int64]:
    """Convert an order of tasks to an array, where ~k means that task k is reversed.

    Raises
    ------
    PostError
        The order is not a permutation, violates a precedence, or reverses a task that is not reversible.
    """
    given = np.asarray(order, dtype=np.int64)
    chosen = np.where(given < 0, ~given, given)
    if chosen.shape != (len(section.pieces),) or not np.array_equal(np.sort(chosen), np.arange(len(chosen))):
        raise PostError(
            "line {}: the order does not contain each of the {} tasks once", section.pieces[0].line, len(section.pieces)
        )
    fixed = [section.pieces[k].line for k in chosen[given < 0].tolist() if not section.pieces[k].reversible]
    if fixed:
        raise PostError("line {}: the cut there cannot be reversed", fixed[0])
    place = np.empty_like(chosen)
    place[chosen] = np.arange(len(chosen))
    for before, after in section.precedence.tolist():
        if place[before] > place[after]:
            one, other = section.pieces[before].line, section.pieces[after].line
            raise PostError("the task at line {} would come before line {}, which must come first", other, one)
    return given


# -- reversed cuts ---------------------------------------------------------------------------------------------------


class ReversedCut:
    """Writes the lines of an open cut in reverse, using the words and numbers of its own lines.

    Each block leads back to the point where it started. Arcs change direction but keep their centre. Coordinates are
    copied as text.

    Parameters
    ----------
    lines
        All lines of the cut, including comments.
    offset
        Number of lines in the program before the cut.
    spelled
        Function that writes a feed or a speed the way the program spells it.
    """

    def __init__(
        self,
        program: Program,
        reader: BlockReader,
        stroke: ReversibleCut,
        lines: list[str],
        offset: int,
        spelled: Spelled,
    ) -> None:
        self.program, self.reader, self.stroke, self.spelled = program, reader, stroke, spelled
        self.lines, self.offset = lines, offset
        self.unit = program.modal(stroke.body).unit
        #: Modal values that are active in the new lines. None means that no earlier word sets the value.
        modal = program.modal(stroke.body)
        known = reader.modal_use(stroke.begin, stroke.body).sets | reader.modal_use(stroke.begin, stroke.end).inherited
        self.motion = modal.motion if "motion" in known else None
        self.feed = modal.feed if "feed" in known else None
        self.rpm = modal.rpm if "rpm" in known else None

    def write(self) -> tuple[list[str], Modal]:
        """Return the reversed lines, and the modal state after them."""
        new = [*self._lead_lines(), *self._body_lines(), *self._tail_lines()]
        # The last line of a file may lack a line ending; after reversal it may no longer be last.
        end = line_ending(self.program.lines)
        new = [line if line.endswith(("\n", "\r")) else line + end for line in new]
        return new, replace(self.program.modal(self.stroke.end), motion=self.motion)

    def _count_lines_through(self, block: int) -> int:
        return int(self.program.line[block]) - self.offset

    def _line_of_block(self, block: int) -> int:
        return self._count_lines_through(block) - 1

    def _lead_lines(self) -> list[str]:
        """Return the lines before the cut, adapted so that they lead to the former end of the cut."""
        lines = self.lines[: self._count_lines_through(self.stroke.body - 1)]
        for block in range(self.stroke.begin, self.stroke.body):
            lines[self._line_of_block(block)] = replace_words(
                lines[self._line_of_block(block)], self._xy_texts(len(self.stroke.rows))
            )
        return lines

    def _body_lines(self) -> list[str]:
        """Return the lines of the cut, last block first. Comments above a block move along with the block."""
        stroke = self.stroke
        found: list[str] = []
        for block in range(stroke.tail - 1, stroke.body - 1, -1):
            found += self.lines[self._count_lines_through(block - 1) : self._line_of_block(block)]
            found.append(self._reversed_line(block))
        return found

    def _tail_lines(self) -> list[str]:
        """Return the lines after the cut, adapted so that they retract at the former start of the cut."""
        lines = self.lines[self._count_lines_through(self.stroke.tail - 1) :]
        begin = self._count_lines_through(self.stroke.tail - 1)
        for block in range(self.stroke.tail, self.stroke.end):
            at = self._line_of_block(block) - begin
            modal_use, need = self.reader.modal_use(block, block + 1), self.program.modal(block)
            # Feed and speed need no words: a reversible cut has the same values at both ends.
            front = [f"G{need.motion}"] if "motion" in modal_use.inherited and need.motion != self.motion else []
            lines[at] = insert_words(replace_words(lines[at], self._xy_texts(0)), front, [])
            if "motion" in modal_use.sets:
                self.motion = self.program.modal(block + 1).motion
        return lines

    # -- words -------------------------------------------------------------------------------------------------------

    def _xy_texts(self, place: int) -> dict[str, str]:
        texts = self.stroke.places[place]
        # An axis without text does not move in its block: its position is the same before and after.
        at = self.program.path.before[self.stroke.rows[max(place - 1, 0)]]
        return {
            letter: format_length(float(value), self.unit) if text is None else text
            for letter, text, value in zip("XY", texts, at, strict=False)
        }

    def _reversed_line(self, block: int) -> str:
        number = block - self.stroke.body
        line, row = self.lines[self._line_of_block(block)], self.stroke.rows[number]
        words = self.reader.words(block)
        assert words is not None  # reversible cuts have only plain words
        letters, need = words.letters, self.program.modal(block + 1)
        motion = _BACK[int(self.program.path.kind[row])]
        texts = []
        if "motion" in words.states or motion != self.motion:
            texts.append(self._motion_word(line, motion))
        # An axis missing from the line does not move, in either direction.
        back = self._xy_texts(number)
        texts += [letter + back[letter] for letter in "XY" if letter in letters]
        texts += [f"Z{letters['Z']}"] if "Z" in letters else []
        texts += self._centre_words(letters, number, need)
        if "F" in letters or need.feed != self.feed:
            texts.append(self.spelled("F", need.feed, block + 1))
        if "S" in letters or (need.spindle and need.rpm != self.rpm):
            texts.append(self.spelled("S", need.rpm, block + 1))
        self.motion, self.feed, self.rpm = motion, need.feed, need.rpm
        return replace_all_words(line, texts)

    def _motion_word(self, line: str, motion: int) -> str:
        """Return G1, G2 or G3. The word gets a leading zero if the original line uses one."""
        return f"G0{motion}" if re.search(r"[Gg]0[123](?![0-9])", code_without_comments(line)) else f"G{motion}"

    def _centre_words(self, letters: dict[str, str], number: int, need: Modal) -> list[str]:
        """Return the words for the centre of an arc, relative to the new start point of the arc."""
        if "R" in letters:
            return [f"R{letters['R']}"]
        if need.absolute_centres:
            return [letter + letters[letter] for letter in "IJ" if letter in letters]
        found = []
        old, new = self._xy_texts(number), self._xy_texts(number + 1)
        for letter, axis in (("I", "X"), ("J", "Y")):
            if letter in letters or old[axis] != new[axis]:
                shift = Decimal(old[axis]) - Decimal(new[axis]) + Decimal(letters.get(letter, "0"))
                found.append(letter + _decimal(shift))
        return found if {"I", "J"} & letters.keys() else []


def _decimal(value: Decimal) -> str:
    """Format a number with a decimal point, without an exponent and without rounding."""
    text = f"{value:f}"
    if "." not in text:
        return text + ".0"
    text = text.rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text


# -- positions in the original program -------------------------------------------------------------------------------


class OriginalPositions:
    """Tool positions in the original program. `before` is the position before every row, float64[n, 3], mm."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.before = program.path.before

    def position_before(self, block: int) -> list[float]:
        """Return the tool position before a block, or at the end of the program, mm."""
        return list(self.program.path.place_before(int(self.program.first[block])))

    def initial_height_before(self, block: int) -> float:
        """Return the initial height of the canned cycle that is active before a block, mm.

        If no cycle is active, return the current height.
        """
        if self.program.modal(block).cycle is None:
            return self.position_before(block)[2]
        row = int(self.program.first[block])
        kinds = self.program.path.kind
        while row > 0 and (kinds[row - 1] == Kind.DRILL or kinds[row - 1] not in MOTIONS):
            row -= 1
        return float(self.before[row, 2]) if row < len(kinds) else math.nan

    def follows_work(self, block: int) -> bool:
        """Return whether the program has worked between the last stop or tool change and this block.

        A cut counts as work. A dwell counts if it follows a sideways rapid.
        """
        kinds = self.program.path.kind
        row = int(self.program.first[block]) - 1
        waited = False
        while row >= 0 and kinds[row] not in _STOPS:
            waited |= bool(kinds[row] == Kind.DWELL)
            if kinds[row] in MOTIONS and (kinds[row] != Kind.RAPID or (waited and not self.is_without_xy(row))):
                return True
            row -= 1
        return False

    def departure_height(self, piece: ProgramTask) -> float:
        """Return the height of the travel move after a task, mm, or −∞ if no travel move follows.

        The result is capped at the approach height of the task, because the original may retract higher before a stop.
        """
        path, first = self.program.path, self.program.first
        row = int(first[piece.end])
        if row < len(path) and path.kind[row] == Kind.DRILL:
            return float(max(self.before[row, 2], path.cycles[int(path.ref[row])].r_plane))
        ways = [
            r for r in range(int(first[piece.begin]), row) if path.kind[r] == Kind.RAPID and not self.is_without_xy(r)
        ]
        top = -math.inf
        while row < len(path) and (
            path.kind[row] not in MOTIONS or (path.kind[row] == Kind.RAPID and self.is_without_xy(row))
        ):
            top = max(top, float(path.end[row, 2])) if path.kind[row] == Kind.RAPID else top
            if path.kind[row] in _STOPS:
                break
            row += 1
        return min(top, float(path.end[ways[-1], 2])) if ways else -math.inf

    def crossing_height(self, piece: ProgramTask) -> float:
        """Return the lowest height at which the original program moves to the start of a task, mm."""
        row = self.arrival_block_and_row(piece)[1]
        z0, z1 = float(self.before[row, 2]), float(self.program.path.end[row, 2])
        path = self.program.path
        return max(z0, path.cycles[int(path.ref[row])].r_plane) if path.kind[row] == Kind.DRILL else min(z0, z1)

    def arrival_block_and_row(self, piece: ProgramTask) -> tuple[int, int]:
        """Return the block and the row of the move to the start of a task."""
        path, first = self.program.path, self.program.first
        for block in range(piece.begin, piece.end):
            for row in range(int(first[block]), int(first[block + 1])):
                x, y = path.end[row, :2].tolist()
                if path.kind[row] in MOTIONS and (x, y) == piece.entry and not self.is_without_xy(row):
                    return block, row
        raise PostError("line {}: the move to the start of this task is missing", piece.line)

    def is_without_xy(self, row: int) -> bool:
        """Return whether a row moves in neither X nor Y."""
        return bool((np.abs(self.program.path.end[row, :2] - self.before[row, :2]) < _TOLERANCE).all())

    def heights_of_first_return(self, rows: range) -> tuple[float, float] | None:
        """Return the retract height and the R plane of the first hole with G98 in a series, mm.

        Return None if the series has no such hole.
        """
        path = self.program.path
        for row in rows:
            if path.kind[row] == Kind.DRILL:
                cycle = path.cycles[int(path.ref[row])]
                if cycle.to_initial:
                    return float(path.end[row, 2]), cycle.r_plane
            elif path.kind[row] in MOTIONS:
                return None
        return None
