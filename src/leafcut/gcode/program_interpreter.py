"""Reader of programs from any CAM system. It converts a text to a `Program`, with the modal state before every block.

`control_flow` and `jumps` choose the next line, `expressions` evaluates its numbers, and `interpreter` executes it.
Plain lines (G0 to G3, coordinates, F and S in ordinary modes) skip these steps.
"""

from __future__ import annotations

import io
import math
import re
from array import array
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from leafcut.errors import OptionError, ReadError
from leafcut.gcode.active_comments import (
    ControllerSetting,
    active_or_displayed_comments,
    controller_settings,
    is_active_comment,
)
from leafcut.gcode.block_description import (
    BlockDescription,
    RangeDigests,
    describe_block,
    digest_of_callable_text,
    may_read_parameters,
    significant_text,
)
from leafcut.gcode.control_flow import Control, Flow, parse_o_word
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.expressions import BlockReading, ProgramParameters, read_block, words_without_evaluation
from leafcut.gcode.interpreter import Interpreter
from leafcut.gcode.jumps import JumpStatement, UndecidedJump, board_command, has_statements, parse_statement, sends_data
from leafcut.gcode.material import MaterialFeeds
from leafcut.gcode.motion import check_radii
from leafcut.gcode.policy import Policy
from leafcut.gcode.program import Lines, Modal, Program
from leafcut.gcode.state import InterpreterState, ModalValues
from leafcut.gcode.torch import set_speed
from leafcut.gcode.words import (
    Block,
    BlockError,
    Word,
    has_nested_comment,
    parse_words,
    remove_word,
    split_line,
)
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.toolpath import STILL, Arc, Kind
from leafcut.units import MM_PER_UNIT, SECONDS_PER_MINUTE

#: Spaces, and filler characters that old editors and tape punches leave at the end of a file.
_FILLING = " \t\f\x1a\0"
#: Maximum number of title lines above the first percent sign.
_MOST_TITLE = 200
#: Reasons for keeping control-flow blocks and repeated blocks in place.
_DIRECTS = Message("the block controls a loop, a condition or a subprogram")
_LOOPED = Message("the block is in a loop or a subprogram")
CALLED = frozenset((_DIRECTS, _LOOPED))
_OBEYED = Message("the controller takes settings from the block")
_COMPUTED = Message("the numbers in the block come from parameters or expressions")
_NESTED = Message("a comment is inside a comment: controllers differ in where it ends")
_SENDS = Message("the block sends a record")
_GOAL = Message("a jump leads here")
_PIERCED = Message("the controller only pierces there (#<pierce-only>=1)")
_AGAIN = Message("the block may be run again")
#: Mask of the line number. It makes the reader call `on_progress` every 4,096 lines.
_LINES_BETWEEN_CHECKS = 0xFFF
_MAYBE = Message("only the machine knows whether the block is run")
#: Indices in `InterpreterState.modal_values`.
_MOTION, _FEED, _SPEED = ([f.name for f in fields(Modal)].index(name) for name in ("motion", "feed", "rpm"))

_SHORT_NUMBER = r"([+-]?(?:[0-9]{1,8}+(?:\.[0-9]{0,20}+)?|\.[0-9]{1,20}+))"


def _plain_line_pattern(coordinate: str) -> re.Pattern[str]:
    """Build the pattern of a plain line.

    Its groups are G, X, Y, Z, I, J, S, F and S, because S may come before or after F.
    """
    letters = [(letter, coordinate) for letter in "XYZIJ"] + [(letter, _SHORT_NUMBER) for letter in "SFS"]
    words = "".join(rf"(?:[{letter}{letter.lower()}][ \t]*+{number}[ \t]*+)?+" for letter, number in letters)
    start = r"[ \t]*+(?:[Nn][ \t]*+[0-9]{1,8}+[ \t]*+)?+(?:[Gg][ \t]*+0?([0-3])(?![0-9.])[ \t]*+)?+"
    return re.compile(rf"{start}{words}[\r\n]*+")


#: Matches a plain line, the most common kind: G0 to G3, coordinates, feed and speed, such as `G1X12.5Y3.F600`.
_PLAIN_LINE = _plain_line_pattern(_SHORT_NUMBER)
#: The same pattern for controllers that require a decimal point in a coordinate.
_PLAIN_LINE_WITH_POINTS = _plain_line_pattern(r"([+-]?(?:[0-9]{1,8}+\.[0-9]{0,20}+|\.[0-9]{1,20}+))")


def interpret_program(
    text: str,
    dialect: Dialect,
    file: str = "program",
    *,
    units: str | None = None,
    on_progress: Heartbeat = ignore_heartbeat,
    material_feed: float | None = None,
) -> Program:
    """Return the motions and modal states of a program from any CAM system, block by block.

    A block is a line with words, O-words or messages. Blank lines and plain comments are not blocks. After the end of
    the program (M2, M30, a closing percent sign), only called subprograms are read. If a valid block is not understood,
    it becomes a row of kind `Kind.FOREIGN`, and `Program.fixed` contains the reason. Blocks with block delete are
    executed. No other file is opened.

    Parameters
    ----------
    units
        "mm" or "in" for a program that does not state its units before the first length. With None, such a program is
        an error.
    on_progress
        Called with the fraction of processed lines.
    material_feed
        Feed for materials in the controller's table that the program does not define, mm/s. With None, their feed is
        unknown.

    Raises
    ------
    ReadError
        A block is invalid (a letter without a number, an arc that does not end on its circle, a cut without a feed, a
        missing subprogram …), or loops run too many blocks. The message names the line.
    """
    if units is not None and units not in MM_PER_UNIT:
        raise OptionError("unknown unit '{}'; use mm or in", units)
    default_unit = None if units is None else MM_PER_UNIT[units]
    policy = Policy()
    state = InterpreterState(dialect=dialect, policy=policy, default_unit=default_unit)
    return _ProgramReader(text, state, policy, file, on_progress, material_feed).interpret()


def split_lines(text: str, dialect: Dialect, file: str) -> tuple[str, ...]:
    """Split a text into lines the way its controller does. The lines keep their line ends."""
    if "\r" in text and "\n" not in text.rstrip() and dialect.line_ends == "lf" and "\r" in text.rstrip():
        reason = Message(
            "the lines end in a carriage return alone, so the controller reads them as a single line; save the "
            "file with LF line ends"
        )
        raise ReadError(file, reason, 1)
    lines = tuple(io.StringIO(text, newline="\n" if dialect.line_ends == "lf" else ""))
    if not dialect.line_ends and any(line.endswith("\r") for line in lines[:-1]) and "\n" in text:
        number = next(k for k, line in enumerate(lines, 1) if line.endswith("\r"))
        reason = Message(
            "the line contains a lone carriage return, and it depends on the controller whether that ends the "
            "line; save the file with LF line ends"
        )
        raise ReadError(file, reason, number)
    return lines


def _first_program_line(lines: tuple[str, ...]) -> int:
    """Return the index of the first line of the program.

    If a title precedes the first percent sign, the title is skipped.
    """
    percent = next((at for at, line in enumerate(lines[:_MOST_TITLE]) if line.lstrip(_FILLING).startswith("%")), 0)
    words = False
    for line in lines[:percent]:
        readable = _is_readable(line)
        if readable:
            return 0
        words |= readable is None
    return percent if words and any(_is_readable(line) for line in lines[percent + 1 :]) else 0


def _is_readable(line: str) -> bool | None:
    try:
        body, _ = split_line(line.strip(_FILLING + "\r\n"), nested=True)
        if set("#[") & set(body) or parse_o_word(line) is not None or parse_statement(line) is not None:
            return True
        return bool(parse_words(body)) and body != "%"
    except BlockError:
        return None


#: Commands of GRBL that only unlock, check or report. Source: GRBL 1.1, "Commands".
_REPORTS = ("$X", "$G", "$I", "$N", "$#", "$$")
#: Settings of GRBL that change neither position nor modes: maximum rates, accelerations and travel of X, Y and Z, and
#: the speeds of full and least spindle power while the spindle is off. Laser mode ($32) is not included, because it
#: decides whether the beam is on in rapids. Source: GRBL 1.1, settings.c, settings_store_global_setting.
_LIMITS = re.compile(r"\s*\$1[123][012]=[0-9.]+\s*")
_SPINDLE_RANGE = re.compile(r"\s*\$3[01]=[0-9.]+\s*")
#: Millimetres per unit that a G word selects. A block may select the unit for its own feed.
_UNIT_OF = {20.0: MM_PER_UNIT["in"], 21.0: MM_PER_UNIT["mm"]}


@dataclass
class _BlockRecord:
    """Records the blocks read up to now in columns. `current` is the index of the active modal state."""

    state: InterpreterState
    line: array[int] = field(default_factory=lambda: array("i"))
    first: array[int] = field(default_factory=lambda: array("i"))
    before: array[int] = field(default_factory=lambda: array("i"))
    fixed: dict[int, str] = field(default_factory=dict)
    obeyed: tuple[ControllerSetting, ...] = ()
    descriptions: dict[int, BlockDescription] = field(default_factory=dict)
    current: int = 0
    calls: list[tuple[int, int]] = field(default_factory=list)
    switched_off: dict[int, tuple[int, int]] = field(default_factory=dict)
    _numbers: dict[ModalValues, int] = field(default_factory=dict)
    _plain: dict[tuple[int, float, float], int] = field(default_factory=dict)
    _called: int = 0

    def __post_init__(self) -> None:
        self.record_state()

    def record_state(self) -> None:
        self.current = self._number_of_values(self.state.modal_values())
        self._plain = {}

    def _number_of_values(self, values: ModalValues) -> int:
        return self._numbers.setdefault(values, len(self._numbers))

    def add(
        self, line: int, rows: int, reason: str, during_motion: tuple[int, tuple[object, ...]] | None = None
    ) -> None:
        """Add a block. See `Interpreter` for `during_motion`."""
        if reason:
            self.fixed[len(self.line)] = reason
        if during_motion is not None:
            self.switched_off[len(self.line)] = during_motion[0], self._number_of_values(during_motion[1])
        self.line.append(line)
        self.first.append(rows)
        self.before.append(self.current)
        self.record_state()

    def add_description(self, description: BlockDescription) -> None:
        self.descriptions[len(self.line)] = description

    def record_call_depth(self, before: int, after: int) -> None:
        if before == 0 and after:
            self._called = len(self.line) - 1
        elif before and after == 0:
            self.calls.append((self._called, len(self.line)))

    def number_of_state(self, motion: int, feed: float, speed: float) -> int:
        """Return the index of the current modal state with the given motion, feed and speed. A new state is added."""
        number = self._plain.get((motion, feed, speed))
        if number is None:
            values = list(self.state.modal_values())
            values[_MOTION], values[_FEED], values[_SPEED] = motion, feed, speed
            number = self._plain[motion, feed, speed] = self._number_of_values(tuple(values))
        return number

    def build_program(self, lines: tuple[str, ...], last_line: int, assumed: bool = False, title: int = 0) -> Program:
        path = self.state.path.build()
        return Program(
            Lines(lines),
            path,
            np.array(self.line, dtype=np.int32),
            np.array(self.first + array("i", [len(path)]), dtype=np.int32),
            np.array(self.before + array("i", [self.current]), dtype=np.int32),
            tuple(Modal(*values) for values in self._numbers),
            self._reasons_of_fixed_blocks(),
            last_line,
            self.obeyed,
            self.descriptions,
            assumed,
            dark_rapids=(torch := self.state.dialect.torch) is not None and torch.dark_rapids,
            title_lines=title,
            calls=tuple(self.calls),
            switched_off=self.switched_off,
        )

    def _reasons_of_fixed_blocks(self) -> dict[int, str]:
        """Return the reason for each fixed block.

        After a setting that turns cuts into pierces, all blocks are fixed.
        """
        start = next((setting.line for setting in self.obeyed if setting.pierces_only), None)
        if start is None:
            return self.fixed
        after = [block for block, line in enumerate(self.line) if line > start]
        return {**dict.fromkeys(after, _PIERCED), **self.fixed}


class _ProgramReader:
    def __init__(
        self,
        text: str,
        state: InterpreterState,
        policy: Policy,
        file: str,
        on_progress: Heartbeat,
        material_feed: float | None,
    ) -> None:
        self.file, self.on_progress = file, on_progress
        self.lines = split_lines(text, state.dialect, file)
        self.state = state
        torch = state.dialect.torch
        self.feeds: MaterialFeeds | None = None
        if material_feed is not None and torch is not None and torch.material_feed:
            self.feeds = MaterialFeeds(self.lines, torch.material_feed, material_feed)
        self.runner = Interpreter(state, policy)
        self.record = _BlockRecord(state, obeyed=controller_settings(self.lines, state.dialect))
        self.obeyed = {setting.line for setting in self.record.obeyed}
        self.parameters = ProgramParameters(state.known_value)
        self.parameters.fanuc = state.dialect.groups == "fanuc" or has_statements(self.lines)
        self.flow = Flow(self.lines, self.parameters)
        self.ended = False
        self._title = _first_program_line(self.lines)
        #: Digest of the text that the program repeats endlessly (M99 P in the main program).
        self._endless = ""
        #: Text that may be repeated: number of blocks up to its end, and first line from 0.
        self._again: list[tuple[int, int]] = []
        #: Depths of the calls that restore the modes when they end (M73).
        self.restored: list[int] = []

    def interpret(self) -> Program:
        flow, n = self.flow, len(self.lines)
        at = self._title
        while at < n and not self.ended:
            self.on_progress(at / n)
            if self.state.takes_plain_lines and not flow.is_repeated(at):
                at = self._run_plain_lines(at)
                if at == n:
                    break
            at = self._run_line(at)
        if flow.calls and not self.ended:
            start = flow.calls[-1].start
            raise ReadError(self.file, "the subprogram that starts here has no end (M99)", start + 1)
        for block, line in enumerate(self.record.line):
            if flow.jumps.is_jump_target(line - 1):
                self.record.fixed.setdefault(block, _GOAL)
        self._keep_repeated_blocks_in_place()
        last = at if self.ended and not flow.calls else n
        self._check_after_percent(last)
        program = self.record.build_program(self.lines, last, self.state.assumed_units, self._title)
        return program if self.feeds is None else replace(program, feed_words=self.feeds.words)

    def _run_plain_lines(self, start: int) -> int:
        """Execute plain lines from line `start` on (counted from 0).

        Return the first line that `_run_line` must execute.
        """
        state, record, lines = self.state, self.record, self.lines
        path, arcs, feed = state.path, state.path.arcs, state.feed_rate
        unit, motion = state.unit or 1.0, state.motion or 0
        match = (_PLAIN_LINE_WITH_POINTS if state.dialect.point_required else _PLAIN_LINE).fullmatch
        add_row, add_line = path.rows.extend, record.line.append
        add_first, add_before = record.first.append, record.before.append
        flat = state.plane == 17 and not state.absolute_centres
        row = len(path)
        for number in range(start + 1, len(lines) + 1):
            if not number & _LINES_BETWEEN_CHECKS:
                self.on_progress(number / len(lines))
            found = match(lines[number - 1])
            if found is None or found.lastindex is None:
                return number - 1
            g, x, y, z, i, j, s, f, s_last = found.groups()
            code = motion if g is None else int(g)
            feed_now = feed if f is None else float(f) * unit / SECONDS_PER_MINUTE
            if (code and not feed_now > 0.0) or feed_now < 0.0 or (s is not None and s_last is not None):
                return number - 1
            s = s or s_last
            x0, y0, z0 = path.position
            x1 = x0 if x is None else float(x) * unit + 0.0
            y1 = y0 if y is None else float(y) * unit + 0.0
            z1 = z0 if z is None else float(z) * unit + 0.0
            arc = -1
            if code >= 2:
                if not flat or (i is None and j is None) or math.isnan(x0 + y0) or (s is not None and s[0] == "-"):
                    return number - 1
                u, v = x0 + float(i or 0.0) * unit, y0 + float(j or 0.0) * unit
                try:
                    check_radii(x0, y0, x1, y1, u, v)
                except BlockError:
                    return number - 1
                arc = len(arcs)
                arcs.append(Arc((u, v, z0)))
            elif i is not None or j is not None or (s is not None and s[0] == "-"):
                return number - 1
            add_line(number)
            add_first(row)
            add_before(record.current)
            if s is not None:
                state.line = number
                set_speed(state, float(s))
                row = len(path)
            if arc >= 0 or x is not None or y is not None or z is not None:
                add_row((code, x1, y1, z1, feed_now if code else 0.0, max(arc, 0), number))
                row += 1
                path.position = [x1, y1, z1]
                path.initial_plane = None
            if code != motion or f is not None or s is not None:
                state.motion = motion = code
                feed = feed_now
                if f is not None:
                    state.feed = float(f)
                record.current = record.number_of_state(code, state.feed, state.rpm)
        return len(lines)

    def _check_after_percent(self, last: int) -> None:
        """Refuse words after the final percent sign, because GRBL and Marlin ignore the sign and continue.

        Raises
        ------
        ReadError
            Such a word exists.
        """
        if not self.ended or not self.lines[last - 1].strip(_FILLING + "\r\n").startswith("%"):
            return
        for k in range(last, len(self.lines)):
            if self._has_effect(k) and not self.lines[k].strip(_FILLING).startswith("%"):
                reason = Message(
                    "the program continues after the percent sign in line {}, where some controllers end it; "
                    "remove the sign, or the lines after it",
                    last,
                )
                raise ReadError(self.file, reason, k + 1)

    def _keep_repeated_blocks_in_place(self) -> None:
        """Keep every block in place that a backward jump may repeat."""
        again, left = len(self.lines) + 1, sorted(self._again)
        for block in range(len(self.record.line) - 1, -1, -1):
            while left and left[-1][0] > block:
                again = min(again, left.pop()[1])
            if self.record.line[block] > again:
                self.record.fixed.setdefault(block, _AGAIN)

    def _run_line(self, at: int) -> int:
        """Execute the line `at`, counted from 0.

        Return the next line, or the number of lines at the end of the program.
        """
        line = self.lines[at].rstrip("\r\n").replace("\r", " ")
        if not line.strip(_FILLING):
            return at + 1
        try:
            self.flow.count_repeated_block(at)
            statement = parse_statement(line)
            if statement is not None:
                return self._run_statement(statement, at)
            command = board_command(line)
            if command:
                return self._keep_board_command(command, at)
            control = parse_o_word(line) if "o" in line or "O" in line else None
            return self._run_block(line, at) if control is None else self._run_o_word(control, at)
        except UndecidedJump as unknown:
            return self._keep_undecided_lines(at, unknown)
        except BlockError as problem:
            raise ReadError(self.file, str(problem), at + 1) from None

    def _keep_undecided_lines(self, at: int, unknown: UndecidedJump) -> int:
        """Fix the position of lines from `at` on that may or may not be executed. Return the next line."""
        if unknown.last is None:
            done = set(self.record.line)
            kept = [k for k in range(len(self.lines)) if k >= at or k + 1 not in done]
            self.ended = True
            self.flow.calls.clear()
        else:
            kept = list(range(at, unknown.last + 1))
        texts = {k: self._full_description(k) for k in kept if self._has_effect(k)}
        if unknown.again is not None and texts:
            first = min(texts)
            texts[first] = texts[first]._replace(again=self._repeated_digest(unknown.again, at))
        self.parameters.forget_values()
        for k, text in texts.items():
            self.state.line = k + 1
            rows = len(self.state.path)
            self.runner.forget_all(Message("line {}", at + 1))
            self.record.add_description(text)
            self.record.add(k + 1, rows, _MAYBE)
        if unknown.again is not None:
            self._again.append((len(self.record.line), unknown.again))
        return len(self.lines) if unknown.last is None else unknown.last + 1

    def _has_effect(self, at: int) -> bool:
        line = self.lines[at].strip(_FILLING + "\r\n")
        try:
            body, comments = split_line(line, nested=True)
        except BlockError:
            return True
        fagor = self.state.dialect.cycle_words == "fagor"
        return body not in ("", "%") or any(map(is_active_comment, comments)) or (fagor and bool(comments))

    def _run_statement(self, statement: JumpStatement, at: int) -> int:
        self.state.line = at + 1
        after, consequence = self.flow.jumps.execute_statement(statement, at)
        self._record_jump(at, after)
        if after <= at:
            self.flow.start_iteration(at)
        if consequence:
            return self._run_block(consequence, at)
        self.record.add(at + 1, len(self.state.path), _DIRECTS)
        return after

    def _record_jump(self, at: int, after: int) -> None:
        if after <= at:
            self.flow.mark_repeated(at, after)
            self.flow.count_repeated_block(at)

    def _run_o_word(self, control: Control, at: int) -> int:
        self.state.line, depth = at + 1, len(self.flow.calls)
        after = self.flow.execute_o_word(control, at)
        self.record.add(at + 1, len(self.state.path), _DIRECTS)
        self.record.record_call_depth(depth, len(self.flow.calls))
        return after

    def _keep_board_command(self, command: str, at: int) -> int:
        """Keep a firmware command such as ``$H`` at its line.

        After homing or jogging, the position of the tool is unknown. After most other commands, the state of the
        controller is unknown too.
        """
        state, text = self.state, self.lines[at]
        state.line, rows, path = at + 1, len(state.path), state.path
        harmless = _LIMITS.fullmatch(text) or (state.spindle == 0 and _SPINDLE_RANGE.fullmatch(text))
        if command in _REPORTS or harmless:
            x, y, z = path.position
            path.set_place(Kind.FOREIGN, (x, y, z), STILL, at + 1)
        elif command.startswith(("$H", "$J")):
            path.set_place(Kind.FOREIGN, (math.nan, math.nan, math.nan), 1, at + 1)
        else:
            self.runner.forget_all(command)
        self.record.add_description(self._full_description(at))
        self.record.add(at + 1, rows, Message("{} is a command of the controller board, not G-code", command))
        return at + 1

    def _run_block(self, line: str, at: int) -> int:
        state, runner, flow = self.state, self.runner, self.flow
        rows, shift, looped, depth = len(state.path), state.shift, flow.is_repeated(at), len(flow.calls)
        if sends_data(line):
            x, y, z = state.path.position
            state.path.set_place(Kind.FOREIGN, (x, y, z), 0, at + 1)
            self.record.add_description(self._full_description(at))
            self.record.add(at + 1, rows, _SENDS)
            return at + 1
        self.parameters.asked = False
        reading = self._read_block(line, at + 1)
        block, settings, of_machine = reading.block, reading.settings, reading.of_machine
        runner.begins = bool(flow.calls) and flow.calls[-1].start == at
        runner.run(block)
        if runner.jumps:
            raise UndecidedJump(None, 0)
        after = self._next_line(at)
        if reading.has_unknown or runner.opaque:
            self.record.add_description(self._full_description(at))
        elif block.deleted or runner.obeyed or runner.unclear or state.shift != shift:
            self._describe_block(block, line)
        elif runner.named and not (runner.returns and depth):
            self.record.add_description(BlockDescription(runner.named))
        if runner.refused or self._endless:
            known = self.record.descriptions.get(len(self.record.line), BlockDescription())
            text = f"{known.text} refused by LinuxCNC" if runner.refused else known.text
            self.record.add_description(known._replace(text=text, again=self._endless))
        for key, value in settings:
            self.parameters.set_parameter(key, value)
        if runner.opaque or of_machine:
            self.parameters.forget_values()
            runner.forget_all(runner.opaque or Message("a parameter of the machine"))
        reason = runner.reason or (
            _LOOPED if looped else _DIRECTS if runner.call else self._computed_reason(reading, line)
        )
        if runner.opaque or of_machine:
            reason = Message(
                "{} may change any state of the machine", runner.opaque or Message("a parameter of the machine")
            )
        elif not reason and "(" in line and has_nested_comment(line):
            reason = _NESTED
        if at + 1 in self.obeyed:
            reason = _OBEYED
        if block.words or settings or reason:
            self.record.add(at + 1, rows, reason, runner.during_motion)
            self.record.record_call_depth(depth, len(flow.calls))
        self.ended |= runner.ended
        return after

    def _read_block(self, line: str, number: int) -> BlockReading:
        """Parse the block of a line. Its feed may come from the controller's material table."""
        feeds = self.feeds
        rest = None if feeds is None else remove_word(line, feeds.word)
        if feeds is None or rest is None:
            return read_block(line, number, self.parameters)
        reading = read_block(rest, number, self.parameters)
        stated = {_UNIT_OF[w.value] for w in reading.block.words if w.letter == "G" and w.value in _UNIT_OF}
        unit = stated.pop() if len(stated) == 1 else self.state.unit or self.state.default_unit or 1.0
        feed = feeds.feed_at(number, unit)
        words = (*reading.block.words, Word("F", feed, f"{feed:.6f}"))
        return reading._replace(block=replace(reading.block, words=words))

    def _computed_reason(self, reading: BlockReading, line: str) -> str:
        """Return why a block with parameters must be fixed, or "" if none of its parameters can change."""
        stays = reading.computed and (
            reading.settings or self.parameters.asked or words_without_evaluation(line) is None
        )
        return _COMPUTED if stays else ""

    def _next_line(self, at: int) -> int:
        runner, flow, after = self.runner, self.flow, at + 1
        if runner.restores:
            self.restored.append(len(flow.calls))
        if runner.returns:
            back, to = flow.return_from_program(), runner.label
            if self.restored and self.restored[-1] > len(flow.calls):
                self.restored.pop()
                runner.opaque = "M73"
            goal = None if to is None else flow.jumps.find_label(to, at)
            if back is None and (goal is None or goal <= at):
                # The controller restarts from there; one pass covers the whole program.
                self.state.path.end(line=at + 1)
                if to is not None:
                    self._endless = self._repeated_digest(goal or 0, at)
                    self._again.append((len(self.record.line) + 1, goal or 0))
                self.ended = True
                return after
            goal = flow.jumps.find_label(to, at if back is None else back - 1) if to is not None else back
            if goal is None:
                raise BlockError("M99 P{}: the program has no block N{}", to, to)
            self._record_jump(at if back is None else back - 1, goal)
            return goal
        if runner.call is not None:
            number, times = runner.call
            begin = None
            if runner.label is not None:
                begin = flow.call_subprogram_at_line(runner.label, times, at)
            elif number is not None:
                begin = flow.call_numbered_program(number, times, at)
            if begin is not None:
                return begin
            runner.opaque = "M97" if runner.label is not None else f"M98 P{number}" if number is not None else "M98"
        return after

    def _repeated_digest(self, goal: int, line: int) -> str:
        return self._line_digests.digest_of_lines(goal, line)

    @cached_property
    def _line_digests(self) -> RangeDigests:
        return RangeDigests([self._significant_text(at) for at in range(len(self.lines))])

    @cached_property
    def _callable_text_digest(self) -> str:
        return digest_of_callable_text(self.lines, self.state.dialect)

    def _significant_text(self, at: int) -> str:
        """Return the significant text of a line. The line number is included if a jump may lead to it."""
        text = significant_text(self.lines[at], self.state.dialect)
        return self.flow.jumps.line_number_text(at) + text if self.flow.jumps.is_jump_target(at) else text

    def _full_description(self, at: int) -> BlockDescription:
        shown = active_or_displayed_comments(self.lines[at].rstrip("\r\n"), self.state.dialect)
        text = " ".join([self._significant_text(at), *shown])
        return BlockDescription(text, self.parameters.digest(), self._callable_text_digest)

    def _describe_block(self, block: Block, line: str) -> None:
        dialect, unknown = self.state.dialect, self.runner.unknown
        obeyed = active_or_displayed_comments(line, dialect)
        read = may_read_parameters(unknown, obeyed, dialect)
        called = self._callable_text_digest if unknown else ""
        self.record.add_description(
            describe_block(block, obeyed, self.parameters.digest() if read else None, called, dialect)
        )
