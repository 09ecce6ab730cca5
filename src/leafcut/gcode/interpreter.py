"""The interpreter: text of a program in, `Toolpath` out.

One block after the other: its words are sorted into modal groups, then carried out in the order of RS274/NGC table 8
(feed mode, F, S, T, tool change, spindle, coolant, dwell, plane, units, offsets, distance mode, motion, stop). Every
word must be understood; one that is not is an error that names it, with file and line.

    interpret("G21\\nG0 Z5\\nG81 X1 Y2 Z-3 R1 F100\\nM2", dialect("linuxcnc"))
"""

from __future__ import annotations

from collections.abc import Mapping

from leafcut.errors import OptionError, ReadError
from leafcut.gcode.canned import end_cycle, run_cycle, start_cycle
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.klartext import interpret_klartext
from leafcut.gcode.modal import PAUSE, SortedBlock, sort_words
from leafcut.gcode.motion import run_arc, run_home, run_machine, run_probe, run_straight
from leafcut.gcode.origin import run_shift
from leafcut.gcode.sinumerik import call_cycle, drill_call, end_call, sinumerik_block
from leafcut.gcode.state import AXES, InterpreterState, unit_of, whole
from leafcut.gcode.torch import leave_outputs, material_block, run_outputs, say_power, spindle_number
from leafcut.gcode.words import Block, BlockError, Word, lines
from leafcut.model.toolpath import SPEED_ALONE, UNKNOWN, Toolpath
from leafcut.units import MM_PER_UNIT

_SHIFTS = (920, 921)
#: G38.2 as a motion.
_PROBE = 38


def interpret(
    text: str,
    dialect: Dialect,
    file: str = "program",
    *,
    units: str | None = None,
    left_over: bool = False,
    material_feeds: Mapping[int, float] | None = None,
) -> Toolpath:
    """Return the motions and commands of a program.

    Positions are NaN until the program moves their axis. Text after the end of the program is not looked at. G28 and
    G30 are taken to end at machine zero.

    Parameters
    ----------
    text
        The program.
    dialect
        How to read it (`gcode.dialects.dialect`).
    file
        Its name, for messages.
    units
        "mm" or "in" for a program that does not state them before its first length; None: that is an error.
    left_over
        True: start with what another program may have left active (G1, G18, G91, G95, G99), so that a program which
        does not state its own modes comes out wrong. False: start as a control is when it is switched on.
    material_feeds
        Feeds of the controller's table of materials, mm/s, by number: M190 selects the number, and the F word of the
        dialect takes its feed. Selecting any other number is refused. None: any may be selected, no feed be taken.

    Raises
    ------
    ReadError
        A word or a block cannot be understood, with its line; or the end is missing where the controller asks for it.
    """
    if units is not None and units not in MM_PER_UNIT:
        raise OptionError(f"unknown unit '{units}'; use mm or in")
    if dialect.language == "klartext":
        return interpret_klartext(text, file)
    state = InterpreterState(dialect, unit=None if units is None else MM_PER_UNIT[units])
    state.material_feeds = material_feeds
    if left_over:
        state.motion, state.plane, state.incremental, state.to_initial = 1, 18, True, False
        # A control without G94 has no other feed mode that could be left over.
        state.feed_mode = 95 if 940 in dialect.g_codes else 94
        state.offset_on = dialect.length_offset == "edge"
        leave_outputs(state)
    reader = Reader(state)
    siemens = dialect.language == "sinumerik"
    for number, line in lines(text):
        if not line or line.isspace():
            continue
        try:
            # Here a later reader of foreign programs can keep a block that is not understood, word for word.
            reader.run(sinumerik_block(line, number) if siemens else material_block(state, line, number))
        except BlockError as problem:
            raise ReadError(file, str(problem), number) from None
        if reader.ended:
            break
    reader.check_end(file)
    return reader.state.path.build()


class Reader:
    """Carries out block after block."""

    def __init__(self, state: InterpreterState) -> None:
        self.state = state
        self.ended = False
        self._by_word = False
        self._percents = 0
        self._blocks = 0
        dialect = state.dialect
        self._g, self._m = dialect.g_codes, dialect.m_codes
        self._separate = dialect.groups == "fanuc"
        #: What M words do to the spindle: a beam may be lit by M4, which turns other spindles backwards.
        self._turning = {3: 1, 4: -1, 5: 0}
        if dialect.torch is not None:
            self._turning[dialect.torch.on_code] = 1

    def run(self, block: Block) -> None:
        """Carry out one block."""
        if block.percent is not None:
            self._percent(block.percent)
            return
        if block.call is not None:
            self._call(block)
            return
        if not block.words:
            return
        if block.deleted:
            raise BlockError("'/': whether the block is run depends on a switch of the machine")
        state = self.state
        state.line = block.line
        if state.dialect.one_command:
            _check_one_command(block, state.dialect.tool_change == "pause")
        words = sort_words(block, self._g, self._m, self._separate)
        letters = words.letters
        letters.pop("N", None)
        if "O" in letters:
            self._program_number(whole(letters.pop("O")))
        self._blocks += 1
        self._settings(words)
        self._tool_words(words)
        run_outputs(state, words)
        off_last = state.dialect.off_after_motion
        self._switches(words, off=None if not off_last else False)
        self._modes(words)
        self._offsets(words)
        self._motion(words)
        if letters:
            raise BlockError(f"{next(iter(letters.values()))} has no meaning in this block")
        if off_last:
            self._switches(words, off=True)
        self._stop(words.m.get("stop"))

    def _call(self, block: Block) -> None:
        self.state.line = block.line
        self._blocks += 1
        name, arguments = block.call or ("", ())
        if name:
            call_cycle(self.state, name, arguments)
        else:
            end_call(self.state)

    def check_end(self, file: str) -> None:
        """End the program where its text ends, or refuse one that does not end as its controller asks for."""
        required = self.state.dialect.end_required
        if not self.state.dialect.end_word and not self.ended:
            self.state.path.end(line=self.state.line)
        if self._by_word or not required or (required == "percent" and self.ended):
            return
        raise ReadError(file, f"the program has no end; {self.state.dialect.end_word} is missing")

    def _percent(self, rest: str) -> None:
        if self._blocks == 0 and self._percents == 0:
            if rest and self.state.dialect.percent != "title":
                raise BlockError("only '%' may stand on its line")
            self._percents = 1
        else:
            self.ended = True

    def _program_number(self, number: int) -> None:
        if self._blocks:
            raise BlockError(f"O{number}: a second program or a subprogram is not understood")

    def _settings(self, words: SortedBlock) -> None:
        """Units, feed mode, F and S."""
        state, letters = self.state, words.letters
        units = words.g.get("units")
        if units is not None:
            unit = unit_of(units)
            if state.unit not in (None, unit) and "F" in letters:
                raise BlockError("a change of units in the block of an F: which of them F is in is not certain")
            state.know_unit(unit)
        mode = words.g.get("feed mode")
        if mode is not None and mode // 10 != state.feed_mode:
            # What F meant before means nothing now.
            state.feed_mode, state.feed = mode // 10, 0.0
        dwells = words.g.get("non-modal") == 40 and state.dialect.dwell_letter == "F"
        if "F" in letters and state.feed_mode != 93 and not dwells:
            state.set_feed(letters.pop("F"))
        if "S" in letters:
            word = letters.pop("S")
            if word.value < 0.0:
                raise BlockError(f"{word} is negative")
            state.rpm = word.value
            if state.spindle and "spindle" not in words.m and not say_power(state):
                state.path.spindle(state.spindle * state.rpm, line=state.line, number=SPEED_ALONE)

    def _tool_words(self, words: SortedBlock) -> None:
        state, letters = self.state, words.letters
        if "T" in letters:
            state.pending_tool = whole(letters.pop("T"), 99_999)
        if "tool change" in words.m:
            if state.pending_tool is None:
                raise BlockError("M6 without a T before it")
            self._change_tool(state.pending_tool)
        if state.dialect.length_offset == "edge" and "D" in letters:
            self._edge(letters.pop("D"))
        if state.dialect.length_offset == "D" and "D" in letters:
            state.offset_number = whole(letters.pop("D"), 99_999)
            if state.offset_on and words.g.get("length") is None:
                state.path.offset(state.offset_number, line=state.line)

    def _edge(self, word: Word) -> None:
        """Take the lengths of the tool's first edge, or none."""
        number = whole(word, 1)
        if number and self.state.tool is None:
            raise BlockError(f"{word} before a tool was called")
        self.state.path.offset(self.state.tool or 0 if number else 0, line=self.state.line)
        self.state.offset_on = bool(number)

    def _change_tool(self, number: int) -> None:
        state = self.state
        if state.cycle is not None:
            raise BlockError("a tool change inside a canned cycle; G80 is missing before it")
        state.path.tool(number, line=state.line)
        state.tool = number
        state.pending_tool = None if state.dialect.changes_by_hand else number

    def _switches(self, words: SortedBlock, off: bool | None) -> None:
        """Spindle and coolant: all of them, or only those that switch off (True), or on (False)."""
        state = self.state
        torch = state.dialect.torch
        for code in words.m.get("spindle", ())[:1]:
            if off is None or off == (code == 5):
                number = spindle_number(words.letters)
                state.spindle = self._turning[code]
                state.path.spindle(state.spindle * state.rpm, line=state.line, number=number)
                state.dark &= torch is None or not torch.power
        coolant = words.m.get("coolant")
        if coolant and (off is None or off == (9 in coolant)):
            for code in coolant:
                state.coolant = 0 if code == 9 else state.coolant | (1 if code == 7 else 2)
            state.path.coolant(state.coolant, line=state.line)

    def _modes(self, words: SortedBlock) -> None:
        """Dwell, plane, distance, arc distance, retract: all that a motion of this block already obeys."""
        state, g = self.state, words.g
        if g.get("non-modal") == 40:
            state.path.dwell(self._dwell_seconds(words.letters), line=state.line)
        if "plane" in g:
            state.plane = g["plane"] // 10
        if "distance" in g:
            state.incremental = g["distance"] == 910
        if "arc distance" in g:
            state.absolute_centres = g["arc distance"] == 901
        if "retract" in g:
            state.to_initial = g["retract"] == 980
        self._compensation(g.get("radius"), words.letters)
        if g.get("path") == 640:
            # A toolpath without such a row is one that ends its moves where they end (G61).
            tolerance = words.letters.pop("P", None)
            words.letters.pop("Q", None)
            state.path.blending(640, 0.0 if tolerance is None else state.length(tolerance), line=state.line)
            state.rounds = True
        elif "path" in g and state.rounds:
            state.path.blending(g["path"], line=state.line)
            state.rounds = False

    def _compensation(self, code: int | None, letters: dict[str, Word]) -> None:
        """Radius compensation, where a torch keeps half of its kerf away."""
        state = self.state
        if code is None or (code == 400 and state.radius == 40):
            return
        torch = state.dialect.torch
        if code != 400 and (torch is None or not torch.compensation):
            raise BlockError("radius compensation (G41, G42) is not understood")
        register = 0.0
        if code != 400:
            if "D" not in letters:
                raise BlockError(f"G{code / 10:g} needs D")
            word = letters.pop("D")
            register = state.length(word) if code in (411, 421) else float(whole(word, 9_999))
        state.radius = code // 10
        state.path.radius(state.radius, register, line=state.line)

    def _dwell_seconds(self, letters: dict[str, Word]) -> float:
        dialect = self.state.dialect
        word = letters.pop(dialect.dwell_letter, None)
        if word is not None:
            return self.state.dwell(word)
        if dialect.dwell_x and "X" in letters:
            word = letters.pop("X")
            if "." not in word.text or word.value < 0.0:
                raise BlockError(f"{word}: seconds with a decimal point are expected")
            return word.value
        raise BlockError(f"G4 needs its time, {dialect.dwell_letter}")

    def _offsets(self, words: SortedBlock) -> None:
        """Tool length and work offset."""
        state, g = self.state, words.g
        length = g.get("length")
        if length == 430:
            state.path.offset(self._offset_number(words.letters), line=state.line)
            state.offset_on = True
            torch = state.dialect.torch
            if torch is not None and torch.mark_tool is not None:
                # Where the tool is in X and Y the controller's table knows alone.
                state.path.position[:2] = [UNKNOWN, UNKNOWN]
        elif length is not None:
            if state.dialect.length_offset_off not in (f"G{length // 10}", ""):
                raise BlockError(f"G{length // 10} is not understood")
            state.path.offset(0, line=state.line)
            state.offset_on = False
        if g.get("offset", 540) != 540:
            raise BlockError(f"G{g['offset'] / 10:g}: another work offset than G54 is not understood")

    def _offset_number(self, letters: dict[str, Word]) -> int:
        state = self.state
        if state.dialect.length_offset == "H" and "H" in letters:
            return whole(letters.pop("H"), 99_999)
        number = state.offset_number if state.dialect.length_offset == "D" else state.tool
        if number is None:
            raise BlockError(f"G43 without {state.dialect.length_offset or 'H'}, and no tool was called")
        return number

    def _motion(self, words: SortedBlock) -> None:
        self._choose_motion(words.g)
        self._move(words)

    def _move(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        if state.call is not None:
            drill_call(state, words)
            return
        special = g.get("non-modal")
        moving = not letters.keys().isdisjoint(AXES)
        if special == 530 and state.dialect.length_offset == "edge" and state.offset_on:
            raise BlockError("a move to machine coordinates with a length offset on; D0 is missing")
        if special in (280, 300, 530):
            if state.cycle is not None or (special != 530 and "motion" in g):
                raise BlockError(f"G{special // 10} with another motion active; G80 is missing before it")
            (run_machine if special == 530 else run_home)(state, letters)
        elif special in _SHIFTS:
            if "motion" in g:
                raise BlockError(f"G{special / 10:g} and a motion in one block, and only one set of axes")
            run_shift(state, special, letters)
        elif state.cycle is not None:
            if moving or "cycle" in g:
                run_cycle(state, letters)
        elif state.motion is not None and (
            moving or (state.motion >= 2 and ("motion" in g or not letters.keys().isdisjoint("IJKR")))
        ):
            run = run_straight if state.motion < 2 else run_arc if state.motion < _PROBE else run_probe
            run(state, letters)
        elif moving:
            axis = next(a for a in AXES if a in letters)
            raise BlockError(f"{letters[axis]} without G0, G1 or another motion")

    def _choose_motion(self, g: dict[str, int]) -> None:
        state = self.state
        if "motion" in g:
            if state.cycle is not None:
                end_cycle(state)
            state.motion = g["motion"] // 10
        cycle = g.get("cycle")
        if cycle == 800:
            end_cycle(state)
            if not self._separate:
                state.motion = None
        elif cycle is not None:
            start_cycle(state, cycle // 10)

    def _stop(self, codes: list[int] | None) -> None:
        if not codes:
            return
        state, code = self.state, codes[0]
        pauses = state.dialect.stop_word == f"M{PAUSE}"
        if code in (2, 30) or (pauses and code in (0, 1)):
            state.path.end(line=state.line)
            self.ended = self._by_word = True
        elif code == (PAUSE if pauses else 0) and state.dialect.changes_by_hand and state.pending_tool is not None:
            self._change_tool(state.pending_tool)
        else:
            state.path.pause(optional=code == 1, line=state.line)


def _check_one_command(block: Block, tool_alone: bool) -> None:
    """Refuse a block of a firmware that obeys the first command of it alone; T may be one."""
    if tool_alone and [word.letter for word in block.words] == ["T"]:
        return
    commands = [word for word in block.words if word.letter in "GM"]
    if len(commands) != 1 or block.words[0] != commands[0]:
        raise BlockError("each block must be one G or M word, followed by its other words")
