"""The interpreter of foreign programs: text in, `Program` out, with what was active before every block.

Where `interpreter` reads back our own output and takes no word that it does not understand, this one reads what any
other CAM has written. Plain lines go the quick way (`quick`), all others through `blocks`; `flow` says which line comes
next.

    interpret_program("G21\\nG90 G0 Z5\\nX1 Y2\\nG1 Z-1 F100\\nG0 Z5\\nM2", dialect("linuxcnc")).path
"""

from __future__ import annotations

import io

from leafcut.errors import OptionError, ReadError
from leafcut.gcode.blocks import BlockRunner
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.expressions import Parameters, read_block
from leafcut.gcode.flow import Control, Flow, control_of
from leafcut.gcode.foreign_state import ForeignState
from leafcut.gcode.obeyed import obeyed_lines
from leafcut.gcode.program import Program
from leafcut.gcode.quick import QuickWay
from leafcut.gcode.record import Record
from leafcut.gcode.saying import called_text, may_read_parameters, say
from leafcut.gcode.words import Block, BlockError
from leafcut.model.look import Look, unseen
from leafcut.units import MM_PER_UNIT

#: Spaces, and what old editors and tape punches leave at the end of a file.
_FILLING = " \t\f\x1a\0"
_DIRECTS = "it directs a loop, a condition or a subprogram"
_LOOPED = "it is run from a loop or a subprogram"
_OBEYED = "the controller takes settings from it"
_COMPUTED = "its numbers come from parameters or expressions"


def interpret_program(
    text: str, dialect: Dialect, file: str = "program", *, units: str | None = None, look: Look = unseen
) -> Program:
    """Return what a program of any CAM does, block by block.

    Blocks are lines with words, O-words or messages; blank lines and plain comments are none. What stands after the end
    (M2, M30, a closing percent sign) belongs to the program only as far as subprograms there are called. A block that
    makes sense but is not understood becomes a row `Kind.FOREIGN`, and `Program.fixed` says why. Blocks with a slash
    are run. No other file is opened.

    Parameters
    ----------
    text
        The program, with its line ends as they are in the file.
    dialect
        How to read it (`gcode.dialects.dialect`).
    file
        Its name, for messages.
    units
        "mm" or "in" for a program that does not state them before its first length; None: that is an error.
    look
        Called as it goes on.

    Raises
    ------
    ReadError
        What stands there cannot be meant (a letter without a number, an arc that does not end on its circle, a cut
        without a feed, a subprogram that is not there …), or it comes to more blocks than can be run; with its line.
    """
    if units is not None and units not in MM_PER_UNIT:
        raise OptionError(f"unknown unit '{units}'; use mm or in")
    state = ForeignState(dialect, unit=None if units is None else MM_PER_UNIT[units])
    return _Run(text, state, file, look).program()


def _lines_of(text: str, dialect: Dialect, file: str) -> tuple[str, ...]:
    """Return the lines of a text with their ends, as its controller parts them."""
    if "\r" in text and "\n" not in text.rstrip() and dialect.line_ends == "lf" and "\r" in text.rstrip():
        reason = "its lines end in a carriage return alone, and the controller takes them for one line; save it with LF"
        raise ReadError(file, reason, 1)
    lines = tuple(io.StringIO(text, newline="\n" if dialect.line_ends == "lf" else ""))
    if not dialect.line_ends and any(line.endswith("\r") for line in lines[:-1]) and "\n" in text:
        number = next(k for k, line in enumerate(lines, 1) if line.endswith("\r"))
        reason = "a carriage return alone: whether it ends the line differs between controllers; save it with LF"
        raise ReadError(file, reason, number)
    return lines


class _Run:
    """One program on its way through."""

    def __init__(self, text: str, state: ForeignState, file: str, look: Look) -> None:
        self.file, self.look = file, look
        self.lines = _lines_of(text, state.dialect, file)
        self.state = state
        self.runner = BlockRunner(state)
        self.record = Record(state, obeyed=obeyed_lines(self.lines, state.dialect))
        self.obeyed = {said.line for said in self.record.obeyed}
        self.parameters = Parameters(state.known_value)
        self.flow = Flow(self.lines, self.parameters)
        self.ended = False

    def program(self) -> Program:
        quick, flow, n = QuickWay(self.lines, self.state, self.record, self.look), self.flow, len(self.lines)
        at = 0
        while at < n and not self.ended:
            self.look()
            if not flow.looped(at) and quick.open():
                at = quick.run(at)
                if at == n:
                    break
            at = self._step(at)
        if flow.calls and not self.ended:
            start = flow.calls[-1].start
            raise ReadError(self.file, "the subprogram that begins here has no end (M99)", start + 1)
        return self.record.program(self.lines, at if self.ended and not flow.calls else n)

    def _step(self, at: int) -> int:
        """Run the line `at` (from 0); return the one that comes next, or the number of lines done when it ends all."""
        line = self.lines[at].rstrip("\r\n").replace("\r", " ")
        if not line.strip(_FILLING):
            return at + 1
        try:
            self.flow.count(at)
            control = control_of(line) if "o" in line or "O" in line else None
            return self._words(line, at) if control is None else self._obey(control, at)
        except BlockError as problem:
            raise ReadError(self.file, str(problem), at + 1) from None

    def _obey(self, control: Control, at: int) -> int:
        self.state.line = at + 1
        after = self.flow.obey(control, at)
        self.record.add(at + 1, len(self.state.path), _DIRECTS)
        return after

    def _words(self, line: str, at: int) -> int:
        state, runner, flow = self.state, self.runner, self.flow
        block, settings, computed = read_block(line, at + 1, self.parameters)
        rows, shift, looped = len(state.path), state.shift, flow.looped(at)
        runner.begins = bool(flow.calls) and flow.calls[-1].start == at
        runner.run(block)
        after = at + 1
        if runner.returns:
            back = flow.leave_program()
            if back is None:
                state.path.end(line=at + 1)
                self.ended = True
            else:
                after = back
        elif runner.call is not None:
            after = flow.call_program(*runner.call, at)
        if block.deleted or runner.obeyed or runner.unclear or state.shift != shift:
            self._say(block, line)
        elif runner.named and not (runner.returns and flow.calls):
            self.record.say(runner.named)
        for key, value in settings:
            self.parameters.put(key, value)
        reason = runner.reason or (_LOOPED if looped else _DIRECTS if runner.call else _COMPUTED if computed else "")
        if at + 1 in self.obeyed:
            reason = _OBEYED
        if block.words or settings or reason:
            self.record.add(at + 1, rows, reason)
        self.ended |= runner.ended
        return after

    def _say(self, block: Block, line: str) -> None:
        """Note what a block says whose doing is not known, or that shows a message."""
        dialect, unknown, obeyed = self.state.dialect, self.runner.unknown, self.runner.obeyed
        read = may_read_parameters(unknown, obeyed, dialect)
        called = called_text(self.lines, line) if unknown else ""
        self.record.say(say(block, obeyed, self.parameters.digest() if read else None, called, dialect))
