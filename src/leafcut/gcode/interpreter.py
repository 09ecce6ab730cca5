"""Interpreter of G-code blocks.

It executes the words of a block in the order of RS274/NGC, table 8: feed mode, F, S, T, tool change, spindle, coolant,
dwell, plane, units, offsets, distance mode, motion, stop.

In leafcut's own programs, an unsupported block is an error. In programs from other CAM systems, such a block becomes a
FOREIGN row, and the axes that it may move are unknown until they are programmed again. `policy` defines these
differences.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

from leafcut.errors import ReadError
from leafcut.gcode.active_comments import may_stop_program, select_active_comments
from leafcut.gcode.canned import activate_cycle, drill_cycle_holes, end_cycle
from leafcut.gcode.motion import (
    changes_origin,
    run_arc,
    run_machine_move,
    run_origin_change,
    run_probe,
    run_reference_return,
    run_straight,
)
from leafcut.gcode.policy import Policy
from leafcut.gcode.state import AXES, InterpreterState, ModalValues, axes_in_block, parse_whole_number, unit_for_code
from leafcut.gcode.torch import (
    parse_block_with_material_feed,
    run_output_words,
    set_feed_output,
    set_speed,
    take_spindle_number,
)
from leafcut.gcode.word_groups import (
    ENDS_TRANSFORM,
    NO_MOTION,
    OTHER_AXES,
    PAUSE,
    TRANSFORMS,
    SortedBlock,
    sort_words,
)
from leafcut.gcode.words import Block, BlockError, UnclearBlock, Word
from leafcut.message import Message
from leafcut.model.cycles import PECKING
from leafcut.model.toolpath import STILL, UNKNOWN, Kind

#: G38.2 as a motion.
_PROBE = 38
_SET_OFFSETS = 100
_MACRO, _END_OF_CYCLE = 65.0, 80.0
_PROBES = (382, 383, 384, 385)
#: M words that may call another program. M72 restores stored modes, and M73 restores them at the end of a call.
_CALLS = frozenset({197, 198, 72})
_JUMPS_ON_SIGNAL = 96
_RESTORES_LATER = 73
#: Matches statements in parentheses on Fagor controls: actions, jumps and messages.
_FAGOR_STATEMENT = re.compile(r"P[ \t]*[0-9]+[ \t]*=|(?:CALL|PCALL|MCALL|PROBE|DIGIT|ERROR|OPEN|WRITE|DGWZ)\b", re.I)
_FAGOR_JUMP = re.compile(r"(?:GOTO|RPT|IF|SUB|RET|WHILE|ENDIF|ENDWHILE)\b", re.I)
_FAGOR_MESSAGE = re.compile(r"MSG\b", re.I)
#: If a block with an unknown number has only these groups and letters, it can be interpreted in part.
_CLEAR_GROUPS = frozenset(
    {"motion", "cycle", "plane", "distance", "arc distance", "feed mode", "units", "retract", "radius", "path",
     "length", "offset", "non-modal"}
)  # fmt: skip
_CLEAR_LETTERS = frozenset("ABCDFHIJKLPQRSUVWXYZ")
_OF_MACHINE = Message("only the machine knows the numbers in the block")
_MESSAGE = Message("the block shows a message or writes a record")
_ALL = (True, True, True)
_NONE = (False, False, False)
#: Maximum number of rows. A longer program must have an error in a repeat count, and would exhaust the memory.
MAX_ROWS = 10_000_000


def _is_probe(words: SortedBlock) -> bool:
    """Return whether a block moves until a probe trips: G38.2 to G38.5, or G31 on Fanuc and Mach."""
    return words.g.get("motion") in _PROBES or any(str(w) == "G31" for w in words.unknown)


class Interpreter:
    """Executes blocks one at a time.

    A block at the start of a subprogram may have a program number. Before such a block, the caller must set `begins`
    and then call `run`. All other attributes describe the last block.

    Attributes
    ----------
    reason
        Why the block must stay in its position, or ``""``.
    unclear
        Reasons why the block is not fully understood, each with the axes that are unknown afterwards.
    unknown, obeyed
        Unsupported words, and comments that the controller acts on.
    named
        The word that states the kind of a stop or of a reference point.
    opaque
        The word that may have changed any state of the machine, or ``""``.
    call, label, returns
        The subprogram that the block calls (M98) and the number of runs; the N number that the block calls (M97) or
        returns to (M99 P); whether the block ends a subprogram (M99).
    jumps, restores
        Whether the block jumps to an unknown line, and whether the end of the subprogram restores the modes (M73).
    during_motion
        The number of rows and the modal values before the words that act after the motion; None if the block has no
        such words.
    """

    def __init__(self, state: InterpreterState, policy: Policy) -> None:
        self.state, self.policy = state, policy
        self.ended = self.begins = False
        self._by_word = False
        self._percents = self._blocks = 0
        dialect = state.dialect
        self._separate = dialect.groups == "fanuc"
        self._g, self._m = self.policy.supported_codes(dialect)
        self._turning = self.policy.spindle_directions(dialect)
        self._reset_block_results()

    def _reset_block_results(self) -> None:
        self.reason = self.named = self.opaque = ""
        self.unclear: list[tuple[str, tuple[bool, bool, bool]]] = []
        self.unknown: tuple[Word, ...] = ()
        self.obeyed: list[str] = []
        self.call: tuple[int | None, int] | None = None
        self.label: int | None = None
        self.returns = self.jumps = self.restores = self.refused = False
        self.during_motion: tuple[int, ModalValues] | None = None

    def run_line(self, line: str, number: int) -> None:
        """Parse and execute one line."""
        self.run(parse_block_with_material_feed(self.state, line, number))

    def run(self, block: Block) -> None:
        """Execute one block."""
        state = self.state
        self._reset_block_results()
        if block.percent is not None:
            self._run_percent(block.percent)
            return
        state.line = block.line
        if block.comments or block.deleted:
            self._record_active_comments(block)
        if not block.words:
            return
        if block.deleted:
            self.policy.handle_unknown(
                Message("'/' (block delete): execution of this block depends on the machine's block-delete switch")
            )
        if state.dialect.one_command and not _is_one_command(block, state.dialect.tool_change == "pause"):
            self.policy.handle_unknown(Message("each block must contain a single G or M word, and start with it"))
        self._run_words(block)

    def _run_words(self, block: Block) -> None:
        state = self.state
        without_value = {word.letter for word in block.words if math.isnan(word.value)}
        codes = {word.value: word for word in block.words if word.letter == "G"}
        if _MACRO in codes:
            self.policy.handle_unknown(Message("{} is not understood", codes[_MACRO]))
            # The remaining words are macro arguments.
            self._blocks, self.opaque = self._blocks + 1, str(codes[_MACRO])
            return
        known = block
        if without_value:
            known = replace(block, words=tuple(w for w in block.words if not math.isnan(w.value)))
        words = self._sort_words(known, ends_cycle=_END_OF_CYCLE in codes)
        words.letters.pop("N", None)
        if "O" in words.letters:
            self._check_program_number(parse_whole_number(words.letters.pop("O")))
        self._blocks += 1
        if words.unknown:
            self._run_subprogram_calls(words)
        self.refused = self.policy.is_refused(state, block, words)
        self.unknown = tuple(words.unknown)
        if without_value:
            self.reason = _OF_MACHINE
            if without_value != {"F"}:
                self._run_with_unknown_values(words, without_value)
                return
            state.unknown_modes.add("feed")
        self._execute_words(words)

    def _execute_words(self, words: SortedBlock) -> None:
        state, off_last = self.state, self.state.dialect.off_after_motion
        self._run_settings(words)
        self._run_tool_words(words)
        if words.m or "$" in words.letters:
            run_output_words(state, words)
            self._run_switches(words, off=False if off_last else None)
        self._run_modes(words)
        self._execute_or_keep(words)
        if words.m:
            self._switch_off_and_stop(words)
        if self.returns:
            self.named = "M99"
        if len(state.path) > MAX_ROWS:
            raise BlockError("the program has more than {:,} moves", MAX_ROWS)

    def _switch_off_and_stop(self, words: SortedBlock) -> None:
        state = self.state
        during = len(state.path), state.modal_values()
        if state.dialect.off_after_motion:
            self._run_switches(words, off=True)
        stops = words.m.get("stop", [])
        self._run_stop(stops)
        if during[1] != state.modal_values():
            self.during_motion = during
        self.named = next((f"M{code}" for code in stops if code > 1), self.named)

    def _sort_words(self, block: Block, *, ends_cycle: bool) -> SortedBlock:
        # G80 with G0 to G3 occurs in the safe start line of most posts, and is unambiguous.
        words = sort_words(block, self._g, self._m, self._separate or ends_cycle)
        for word in words.unknown:
            self.policy.handle_unknown(Message("{} is not understood", word))
        if ends_cycle and not self._separate and "motion" in words.g:
            self.policy.handle_unknown(
                Message("{}{:g} and {}{:g} exclude each other in one block", "G", words.g["motion"] / 10, "G", 80)
            )
        return words

    # -- start and end of the program ----------------------------------------------------------------------------------

    def finish_interpretation(self, file: str) -> None:
        """End the program at the end of its text. If the controller requires an end word, its absence is an error."""
        required = self.state.dialect.end_required
        if not self.state.dialect.end_word and not self.ended:
            self.state.path.end(line=self.state.line)
        if self._by_word or not required or (required == "percent" and self.ended):
            return
        raise ReadError(file, Message("the program has no end; {} is missing", self.state.dialect.end_word))

    def _run_percent(self, rest: str) -> None:
        if self._blocks or self._percents:
            self.ended = True
        elif rest and self.state.dialect.percent != "title":
            self.policy.handle_unknown(Message("only '%' may stand on its line"))
        self._percents = 1

    def _check_program_number(self, number: int) -> None:
        if self._blocks and not self.begins:
            raise BlockError("O{}: another program starts before the end of the first", number)

    # -- comments, subprograms and blocks that are kept ----------------------------------------------------------------

    def _record_active_comments(self, block: Block) -> None:
        self.obeyed = select_active_comments(block.comments)
        if block.deleted:
            self.reason = Message("the block-delete switch may skip the block")
        if self.obeyed:
            self.reason = (
                Message("the comment in the block may stop the program") if may_stop_program(self.obeyed) else _MESSAGE
            )
        if not block.comments or self.state.dialect.cycle_words != "fagor":
            return
        for comment in block.comments:
            if _FAGOR_JUMP.match(comment):
                self.jumps = True
            elif _FAGOR_STATEMENT.match(comment):
                self.opaque = f"({comment[:20]})"
            elif _FAGOR_MESSAGE.match(comment):
                self.reason = _MESSAGE

    def _run_subprogram_calls(self, words: SortedBlock) -> None:
        unknown, letters = words.unknown, words.letters
        for word in list(unknown):
            if word.letter != "M":
                continue
            if word.value in _CALLS:
                self.opaque = str(word)
            elif word.value == _JUMPS_ON_SIGNAL:
                self.jumps = True
            elif word.value == _RESTORES_LATER:
                self.restores = True
            elif word.value in (97, 98):
                times = parse_whole_number(letters.pop("L"), 9_999) if "L" in letters else 1
                number = parse_whole_number(letters.pop("P")) if "P" in letters else None
                if word.value == 98:
                    self.call = (number, times)
                else:
                    self.call, self.label = (None, times), number
                    self.jumps |= number is None
                unknown.remove(word)
            elif word.value in (99, 47):
                self.label = parse_whole_number(letters.pop("P")) if "P" in letters else None
                self.returns = True
                unknown.remove(word)

    def _run_with_unknown_values(self, words: SortedBlock, unknown: set[str]) -> None:
        """Execute a block in which the values of the letters `unknown` are unknown. The block becomes a FOREIGN row."""
        state, g = self.state, words.g
        named = axes_in_block({**words.letters, **dict.fromkeys(unknown, Word("", 0.0, ""))})
        clear = unknown <= _CLEAR_LETTERS and g.keys() <= _CLEAR_GROUPS and not words.unknown
        if self.opaque or not clear or "tool change" in words.m or g.get("non-modal", 40) not in (40, 530, 280, 300):
            self.opaque = self.opaque or _OF_MACHINE
            return
        if "F" in unknown:
            state.unknown_modes.add("feed")
        if "S" in unknown:
            state.unknown_modes.add("speed")
        g.pop("path", None)
        if g.get("non-modal") == 40:
            g.pop("non-modal")
        self._run_settings(words)
        self._run_tool_words(words)
        self._run_switches(words, off=None)
        self._run_modes(words)
        self._set_motion_mode(g)
        if state.cycle is not None:
            end_cycle(state)
            state.motion, state.unknown_motion = None, Message("a canned cycle whose numbers only the machine knows")
        if "offset" in g:
            state.select_work_offset(g["offset"])
        if "length" in g or (unknown & set("HD")):
            state.forget_length()
            named = (*named[:2], True)
            state.offset_on = True
        place = tuple(UNKNOWN if gone else p for p, gone in zip(state.path.position, named, strict=True))
        state.path.set_place(Kind.FOREIGN, (place[0], place[1], place[2]), 0, state.line)
        if any(named):
            state.path.initial_plane = None
        self._run_stop(words.m.get("stop"))

    def forget_all(self, cause: str) -> None:
        """Add a FOREIGN row, and mark the position and the modes as unknown."""
        state = self.state
        state.forget_position_and_modes(cause)
        state.path.set_place(Kind.FOREIGN, (UNKNOWN, UNKNOWN, UNKNOWN), 1, state.line)

    def _record_unclear(self, reason: str, lost: tuple[bool, bool, bool]) -> None:
        self.policy.handle_unknown(reason)
        self.unclear.append((reason, lost))

    def _execute_or_keep(self, words: SortedBlock) -> None:
        """Execute offsets and motion. If any part of them is unclear, a single FOREIGN row replaces them."""
        state, path = self.state, self.state.path
        named = axes_in_block(words.letters)
        rows, arcs, place = len(path), len(path.arcs), tuple(path.position)
        probing = state.feed_rate if named[2] and _is_probe(words) and state.feed_mode == 94 else 0.0
        try:
            if words.unknown:
                self._record_unknown_words(words, named)
            self._run_offsets(words)
            self._set_motion_mode(words.g)
            self._move_or_keep(words)
        except UnclearBlock as problem:
            self._record_unclear(str(problem), _ALL if state.cycle is not None else named)
        if words.letters and not words.unknown and not self.unclear and not self.opaque:
            self._record_unclear(Message("{} has no meaning in this block", next(iter(words.letters.values()))), named)
        if not self.unclear:
            return
        path.cut_back(rows, arcs)
        state.length_row = -1
        lost = [any(axes[axis] for _, axes in self.unclear) for axis in range(3)]
        after = [UNKNOWN if gone else p for p, gone in zip(place, lost, strict=True)]
        if any(lost):
            path.initial_plane = None
        stays = not any(lost) and not any(named) and not words.g
        path.set_place(Kind.FOREIGN, (after[0], after[1], after[2]), STILL if stays else 0, state.line, probing)
        if words.g.get("length") == 432:
            state.set_dynamic_length()
        self.reason = self.unclear[0][0]

    def _record_unknown_words(self, words: SortedBlock, named: tuple[bool, bool, bool]) -> None:
        state = self.state
        for word in words.unknown:
            if word.letter == "M":
                self._record_unclear(Message("{} is not understood", word), named)
                if word.value == 61 and "Q" in words.letters:
                    state.tool = parse_whole_number(words.letters["Q"], 99_999)
                self._run_feed_output(word, words.letters)
                continue
            code = round(word.value * 10)
            if code in ENDS_TRANSFORM and not any(named):
                left = frozenset(active for active in state.transforms if TRANSFORMS[active] != code)
                if left != state.transforms:
                    state.transforms = left
                    state.move_origin(_ALL)
                continue
            if code in TRANSFORMS:
                state.transforms |= {code}
            state.shift += 1
            if any(named) or code not in NO_MOTION:
                state.unknown_motion = str(word)
            self._record_unclear(
                Message("{} is not understood", word), named if str(word) == "G31" and any(named) else _ALL
            )

    def _run_feed_output(self, word: Word, letters: dict[str, Word]) -> None:
        """Apply the analog output that reduces the feed of a torch. The block itself must always stay."""
        state = self.state
        if state.dialect.torch is not None and word.value == 52:
            state.adaptive = "P" not in letters or letters["P"].value != 0.0
        elif word.value in (67, 68) and {"E", "Q"} <= letters.keys():
            set_feed_output(state, parse_whole_number(letters["E"]), letters["Q"].value)

    # -- feed, speed, tool, spindle, coolant ---------------------------------------------------------------------------

    def _run_settings(self, words: SortedBlock) -> None:
        state, letters, g = self.state, words.letters, words.g
        unit_before, mode_before, feed = state.unit, state.feed_mode, letters.get("F")
        if "units" in g:
            unit = unit_for_code(g["units"])
            if state.unit not in (None, unit) and feed is not None:
                raise BlockError("the block changes the units and sets F: the unit of F is ambiguous")
            state.unit = unit
        state.feed_mode = g.get("feed mode", 10 * state.feed_mode) // 10
        if state.feed_mode != mode_before:
            # The last F has no meaning in another mode.
            state.feed = 0.0
        elif unit_before is not None and state.unit is not None and unit_before != state.unit:
            state.feed *= unit_before / state.unit
        if feed is not None:
            dwells = g.get("non-modal") == 40 and state.dialect.dwell_letter == "F"
            if state.feed_mode == 93:
                state.feed = feed.value
            elif not dwells:
                state.set_feed(letters.pop("F"))
        if "S" in letters:
            self._set_spindle_speed(letters.pop("S"), "spindle" in words.m)
        if "speed" in g:
            state.surface = g["speed"] == 960
            if state.surface:
                letters.pop("D", None)
                self._record_unclear(Message("constant surface speed (G96) is not understood"), _NONE)

    def _set_spindle_speed(self, word: Word, starts: bool) -> None:
        state = self.state
        state.unknown_modes.discard("speed")
        if word.value < 0.0:
            raise BlockError("{} is negative", word)
        if starts:
            state.rpm = word.value
        else:
            set_speed(state, word.value)

    def _run_tool_words(self, words: SortedBlock) -> None:
        state, letters = self.state, words.letters
        by_d = state.dialect.length_offset == "D"
        if by_d and "T" in letters:
            _split_fagor_tool_word(letters)
        if "T" in letters:
            state.next_tool = parse_whole_number(letters.pop("T"), 99_999)
        if "tool change" in words.m and state.next_tool is not None:
            self._change_tool(state.next_tool)
        elif "tool change" in words.m:
            self._record_unclear(Message("M6 has no T word before it"), _NONE)
            state.tool = None
            del words.m["tool change"]
        if state.dialect.length_offset == "edge" and "D" in letters:
            self._select_cutting_edge(letters.pop("D"))
        if by_d and "D" in letters:
            state.offset_number = parse_whole_number(letters.pop("D"), 99_999)
            if state.offset_on and words.g.get("length") is None:
                self._change_active_length(state.offset_number)

    def _change_active_length(self, number: int) -> None:
        state = self.state
        state.path.offset(number, line=state.line)
        if number != state.length:
            state.length = number
            self.policy.forget_height(state)

    def _select_cutting_edge(self, word: Word) -> None:
        """Select the length offset of the tool's first cutting edge (D1), or cancel it (D0)."""
        number = parse_whole_number(word, 1)
        if number and self.state.tool is None:
            raise BlockError("{} comes before the first tool call", word)
        self.state.path.offset(self.state.tool or 0 if number else 0, line=self.state.line)
        self.state.offset_on = bool(number)

    def _change_tool(self, number: int) -> None:
        state = self.state
        if state.cycle is not None:
            self.policy.handle_unknown(Message("the tool is changed inside a canned cycle; G80 is missing before it"))
        state.path.tool(number, line=state.line)
        state.tool = number
        state.next_tool = None if state.dialect.changes_by_hand else number

    def _run_switches(self, words: SortedBlock, off: bool | None) -> None:
        """Execute the words that switch devices on or off.

        `off` selects the words: True for switching off, False for switching on, and None for both.
        """
        state = self.state
        other = words.letters.get("$")
        if "spindle" in words.m and "speed" in state.unknown_modes and 5 not in words.m["spindle"]:
            self._record_unclear(Message("the spindle speed is unknown"), _NONE)
            state.spindle = self._turning[words.m.pop("spindle")[0]]
            words.letters.pop("$", None)
        torch = state.dialect.torch
        for code in words.m.get("spindle", ())[:1]:
            if off is None or off == (code == 5):
                number = take_spindle_number(words.letters)
                state.spindle = self._turning[code]
                state.path.spindle(state.spindle * state.rpm, line=state.line, number=number)
                state.dark &= torch is None or not torch.power
        coolant = words.m.get("coolant")
        if coolant and (off is None or off == (9 in coolant)):
            for code in coolant:
                state.coolant = 0 if code == 9 else state.coolant | (1 if code == 7 else 2)
            state.path.coolant(state.coolant, line=state.line)
        if other is not None and not self.policy.is_known_spindle(other.value):
            self._record_unclear(Message("{}: another spindle is not understood", other), _NONE)

    # -- modes ---------------------------------------------------------------------------------------------------------

    def _run_modes(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        radius = path = None
        if state.call is None:  # with a called cycle, a block is only a place
            radius, path = g.pop("radius", None), g.pop("path", None)
        state.unknown_modes -= g.keys()
        if g.get("non-modal") == 40 and not self._states_dwell_time(letters):
            g.pop("non-modal")
        if g.get("non-modal") == 40:
            state.path.dwell(self._dwell_seconds(letters), line=state.line)
        if "plane" in g:
            state.plane = g["plane"] // 10
        if "distance" in g:
            state.incremental = g["distance"] == 910
        if "arc distance" in g:
            state.absolute_centres = g["arc distance"] == 901
        if "retract" in g:
            state.to_initial = g["retract"] == 980
        if radius is not None:
            self._run_compensation(radius, letters)
        if path is not None:
            self._run_path_control(path, letters)

    def _run_path_control(self, code: int, letters: dict[str, Word]) -> None:
        """Execute G61, G61.1 or G64.

        In G64, P is the corner tolerance, and Q is the tolerance for short moves, which defaults to P. Source:
        LinuxCNC, G64; confirmed with rs274.
        """
        state = self.state
        given = [letters.pop(letter, None) if code == 640 else None for letter in "PQ"]
        tolerance = 0.0 if given[0] is None else state.mm(given[0])
        joining = tolerance if given[1] is None else state.mm(given[1])
        if self.policy.adds_blending_row(state, (code, tolerance, joining)):
            state.blending, state.tolerance, state.joining = code, tolerance, joining
            state.path.blending(code, tolerance, joining, line=state.line)

    def _run_compensation(self, code: int, letters: dict[str, Word]) -> None:
        """Apply cutter compensation. If the mode changes or D is given, add a RADIUS row."""
        state, mode = self.state, code // 10
        word = letters.pop("D", None) if mode != 40 else None
        register = 0.0 if mode == 40 else self.policy.compensation_register(state, code, word)
        if code in (411, 421):
            letters.pop("L", None)
        if mode != state.radius or word is not None:
            state.radius, state.register = mode, register
            state.path.radius(mode, register, line=state.line)

    def _dwell_seconds(self, letters: dict[str, Word]) -> float:
        letter = self.state.dialect.dwell_letter
        if letter not in letters:
            raise BlockError("G4 needs its time, {}", letter)
        return self.state.dwell_seconds(letters.pop(letter))

    def _states_dwell_time(self, letters: dict[str, Word]) -> bool:
        """Return whether a dwell states its time in the form that its controller expects. If not, remove its words.

        Fanuc, Haas and Mach also accept a time in seconds in X or U. A number without a decimal point may be in
        thousandths.
        """
        dialect = self.state.dialect
        given = [letter for letter in "PXUFSK" if letter in letters]
        if not given:
            return True
        if dialect.dwell_letter in given:
            word = letters[dialect.dwell_letter]
            if dialect.dwell_unit not in ("ms", "cs") or "." not in word.text:
                return True
        word = letters.pop(dialect.dwell_letter if dialect.dwell_letter in given else given[0])
        if word.letter in "XU" and "." in word.text and word.value >= 0.0 and dialect.groups == "fanuc":
            self.state.path.dwell(word.value, line=self.state.line)
        else:
            self._record_unclear(Message("the duration of the dwell with {} is unknown", word), _NONE)
        return False

    # -- offsets -------------------------------------------------------------------------------------------------------

    def _run_offsets(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        length = g.get("length")
        if length == 430:
            state.select_length_offset(self._offset_number(letters))
            self.policy.forget_xy_position(state)
        elif length == 490 or (length is not None and state.dialect.length_offset_off == f"G{length // 10}"):
            state.select_length_offset(0)
        elif length == 431:
            self.policy.handle_unknown(Message("{} is not understood", "G43.1"))
            # The length is in the block: with Z, or with K in LinuxCNC before 2.4.
            for letter in ("X", "Y", "Z", "I", "J", "K"):
                letters.pop(letter, None)
            state.move_origin(_ALL)
            state.set_dynamic_length()
        elif length is not None:
            state.shift += 1
            letters.pop("H", None)
            self._record_unclear(Message("G{:g} is not understood", length / 10), (False, False, True))
        if "offset" in g:
            state.select_work_offset(g["offset"])

    def _offset_number(self, letters: dict[str, Word]) -> int:
        state, stated_by = self.state, self.state.dialect.length_offset
        if "H" in letters:
            if stated_by != "H":
                self.policy.handle_unknown(Message("{} has no meaning in this block", letters["H"]))
            return parse_whole_number(letters.pop("H"), 99_999)
        number = state.offset_number if stated_by == "D" else state.tool
        if number is None:
            raise UnclearBlock("G43 has no {}, and no tool was called", stated_by or "H")
        return number

    # -- motion --------------------------------------------------------------------------------------------------------

    def _set_motion_mode(self, g: dict[str, int]) -> None:
        state = self.state
        motion, cycle = g.get("motion"), g.get("cycle")
        if motion is None and cycle is None:
            return
        number = cycle if cycle not in (None, 800) else motion
        if number is not None and not self.policy.is_known_motion(number):
            end_cycle(state)
            state.motion, state.unknown_motion = None, f"G{number / 10:g}"
            state.cycle_words = ()
            return
        before = state.cycle
        if cycle == 800 or (state.cycle is not None and motion is not None):
            end_cycle(state)
        if motion is not None or (cycle == 800 and not self._separate):
            state.motion = None if motion is None else motion // 10
        if cycle not in (None, 800):
            activate_cycle(state, cycle // 10)
        if self._separate and cycle == 800 and state.motion is None:
            state.unknown_motion = state.unknown_motion or Message("the motion mode before the cycle")
        else:
            state.unknown_motion = ""
        if state.cycle is None or (state.cycle != before and not self._separate):
            state.cycle_words = ()

    def _move(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        moving = not letters.keys().isdisjoint(AXES)
        if g.get("non-modal") == 530:
            if state.dialect.length_offset == "edge" and state.offset_on:
                raise BlockError("the tool moves in machine coordinates while a length offset is active; D0 is missing")
            if state.cycle is not None:
                raise BlockError("G{} is used while another motion is active; G80 is missing before it", 53)
            run_machine_move(state, letters)
        elif state.cycle is not None:
            if moving or "cycle" in g:
                drill_cycle_holes(state, letters)
        elif state.motion is not None and (
            moving or (state.motion >= 2 and ("motion" in g or not letters.keys().isdisjoint("IJKR")))
        ):
            run = run_straight if state.motion < 2 else run_arc if state.motion < _PROBE else run_probe
            run(state, letters)
        elif moving:
            axis = next(a for a in AXES if a in letters)
            raise BlockError("{} is given without G0, G1 or another motion", letters[axis])

    def _move_or_keep(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        moving = not letters.keys().isdisjoint(AXES)
        special = g.get("non-modal")
        if special is not None and changes_origin(special):
            self._check_one_motion(special, g, moving and g.get("motion") != 0)
            if special == _SET_OFFSETS:
                self.policy.handle_unknown(Message("G10 changes stored offsets, which no program of leafcut does"))
            run_origin_change(state, special, letters)
            return
        self._check_move_is_supported(special, words, moving)
        if special in (280, 300):
            if state.cycle is not None or g.get("motion", 0) != 0:
                raise BlockError("G28 or G30 is used while another motion is active; G80 is missing before it")
            self._check_one_motion(special, g, False)
            self.named = " ".join([f"G{special // 10}", *(str(letters.pop(p)) for p in "P" if p in letters)])
            run_reference_return(state, letters)
            return
        if special == 530 and self._separate and state.motion is None:
            state.motion = 0
        if state.cycle is not None:
            self._drill_or_keep(words)
        else:
            self._move(words)
        if state.cycle == 84 and state.cycle_values.dwell is None and state.last_dwell and not self._separate:
            self.reason = Message("the tapping cycle repeats the dwell of an earlier cycle")

    def _check_one_motion(self, special: int, g: dict[str, int], both_move: bool) -> None:
        message = Message(
            "G{:g} and a motion are in the same block, which has only one set of axis words", special / 10
        )
        if "motion" in g and both_move:
            raise BlockError(message)
        if "motion" in g:
            self.policy.handle_unknown(message)

    def _check_move_is_supported(self, special: int | None, words: SortedBlock, moving: bool) -> None:
        """Check that the axes, the kind of motion and the modes of a move are supported.

        Raises
        ------
        UnclearBlock
            They are not supported.
        """
        state, g, letters = self.state, words.g, words.letters
        if not letters.keys().isdisjoint(OTHER_AXES):
            other = next(letter for letter in OTHER_AXES if letter in letters)
            if other in "ABC" and state.rotary is None:
                state.rotary = state.line, other
            raise UnclearBlock("the axis {} is not understood", other)
        if state.transforms and moving:
            raise UnclearBlock("G{:g} is active, which is not understood", max(state.transforms) / 10)
        # G28 and G30 move at rapid, regardless of the active motion.
        home = special in (280, 300) and "motion" not in g
        if state.unknown_motion and not home and (moving or "motion" in g or g.get("cycle", 800) != 800):
            raise UnclearBlock("{} is not understood", state.unknown_motion)
        if state.unknown_modes and moving:
            self._check_modes_known()
        if special == 530 and not moving:
            raise UnclearBlock("G53 has no axis word")
        repeat = None if state.cycle is None else letters.get(state.dialect.repeat_letter)
        if (
            special not in (280, 300)
            and repeat is not None
            and repeat.value == 0.0
            and ("X" in letters or "Y" in letters)
        ):
            raise UnclearBlock(
                "{}: it is unknown whether the tool moves to a position where nothing is drilled", repeat
            )

    def _check_modes_known(self) -> None:
        """Check that all modes which affect the active motion are known.

        Raises
        ------
        UnclearBlock
            A mode is unknown.
        """
        state = self.state
        needed = {"distance": "G90 or G91"}
        if state.cycle is not None:
            needed |= {"plane": "G17, G18 or G19", "retract": "G98 or G99"}
        elif state.motion is not None and state.motion >= 2:
            needed |= {"plane": "G17, G18 or G19"}
        for name, words in needed.items():
            if name in state.unknown_modes:
                raise UnclearBlock("it is unknown whether {} is active", words)

    def _drill_or_keep(self, words: SortedBlock) -> None:
        """Drill a hole of a canned cycle.

        If the hole is unclear, all following holes of the cycle are unclear as well.
        """
        state, letters, fagor = self.state, words.letters, self.state.dialect.cycle_words == "fagor"
        repeat = state.dialect.repeat_letter
        for letter in "ZIKB" if fagor else "RZPQ":
            if letter in letters and letter != repeat:
                state.cycle_words = tuple({**dict(state.cycle_words), letter: letters[letter].value}.items())
        spare = {repeat, "K" if fagor else "", "I" if fagor else ""}
        other = next((w for w in "IJKDE" if w in letters and w not in spare), None)
        try:
            if other is not None and state.dialect.groups == "fanuc":
                raise UnclearBlock("G{} with {} is not understood", state.cycle, letters[other])
            self._move(words)
        except UnclearBlock:
            name = f"G{state.cycle}"
            if other is not None or (name in PECKING and state.cycle_values.peck is None):
                end_cycle(state)
                state.motion, state.unknown_motion = None, name
            raise

    def _run_stop(self, codes: list[int] | None) -> None:
        if not codes:
            return
        state, code = self.state, codes[0]
        pauses = state.dialect.stop_word == f"M{PAUSE}"
        if code in (2, 30) or (pauses and code in (0, 1)):
            state.path.end(line=state.line)
            self.ended = self._by_word = True
        elif code == (PAUSE if pauses else 0) and state.dialect.changes_by_hand and state.next_tool is not None:
            self._change_tool(state.next_tool)
        else:
            state.path.pause(optional=code == 1, line=state.line)


def _split_fagor_tool_word(letters: dict[str, Word]) -> None:
    """Convert a T word of a Fagor, such as T5.2, to T5 D2. Source: Fagor 8055, programming manual, 5.6.4."""
    tool, point, offset = letters["T"].text.partition(".")
    if point and offset.isdecimal() and tool.isdecimal():
        letters["T"] = Word("T", float(tool), tool)
        letters.setdefault("D", Word("D", float(offset), offset))


def _is_one_command(block: Block, tool_alone: bool) -> bool:
    """Return whether a block contains a single command. With `tool_alone`, T counts as a command.

    Some firmware only executes the first command of a block.
    """
    if tool_alone and [word.letter for word in block.words] == ["T"]:
        return True
    commands = [word for word in block.words if word.letter in "GM"]
    return len(commands) == 1 and block.words[0] == commands[0]
