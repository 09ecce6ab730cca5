"""Execute the conditions, loops and jumps of Fanuc and Haas (custom macro), which have no O-words.

    IF [#1 GT 3] GOTO 20    IF [#1 EQ 0] THEN #2=5    WHILE [#1 LT 5] DO 1 … END 1    GOTO 20

A jump leads to line N20 of the same program. The controller searches for this line forward from the jump, and then from
the top. Source: Fanuc 30i user's manual (B-63944EN), custom macro: repetition and branching; Haas mill operator's
manual, macros.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from leafcut.gcode.expressions import ProgramParameters, Scanner
from leafcut.gcode.words import BlockError, split_line

_OPENING = r"(?:[ \t]|\([^()]*\))*+/?[1-9]?[ \t]*+(?:[nN][ \t]*+[0-9]++[ \t]*+)?"
_STATEMENT = re.compile(
    _OPENING + r"(IF(?=[ \t]*\[)|WHILE(?=[ \t]*\[)|GOTO|DO(?=[ \t]*[0-9])|END(?=[ \t]*[0-9]))", re.IGNORECASE
)
#: Matches GRBL commands such as ``$H``, ``$J=…``, ``$132=300`` and ``$$``, but not LinuxCNC words such as ``$0``.
_BOARD = re.compile(r"\s*(\$(?:[A-Za-z]+[0-9]*=?|[0-9]+=|[$#]))")
_OUTPUT = re.compile(_OPENING + r"(?:DPRNT|BPRNT|POPEN|PCLOS)(?![A-Za-z])", re.IGNORECASE)
_LABEL = re.compile(r"(?:[ \t]|\([^()]*\))*+/?[1-9]?[ \t]*+[nN][ \t]*+([0-9]{1,18})(?![0-9])")
_PROGRAM = re.compile(r"[ \t]*[oO:][ \t]*[0-9]")
_MAY_JUMP = re.compile(r"GOTO|M[ \t]*9[79]", re.IGNORECASE)
_GOAL = re.compile(r"(?:GOTO|M97P|M99P)([0-9]{1,18}(?![0-9]))?", re.IGNORECASE)
#: Matches words that may leave a range of text: returns, loop exits, and GOTO with a computed target.
_LEAVES = re.compile(r"M99(?![0-9])|O(?:[0-9]+|<[^<>]*>)(?:RETURN|BREAK|CONTINUE)|GOTO(?![0-9])", re.IGNORECASE)
_AFTER_IF = re.compile(r"[ \t]*(GOTO|THEN)[ \t]*", re.IGNORECASE)
_AFTER_WHILE = re.compile(r"[ \t]*DO[ \t]*([0-9]{1,9})[ \t]*$", re.IGNORECASE)


class UndecidedJump(Exception):
    """Raised if the next line depends on a value that only the machine knows.

    Attributes
    ----------
    last
        The last line that may or may not be executed, from 0; None for the last line of the program.
    again
        The first line that may be repeated, or None.
    """

    def __init__(self, last: int | None, again: int | None = None) -> None:
        super().__init__()
        self.last, self.again = last, again


class JumpStatement(NamedTuple):
    """A statement IF, WHILE, GOTO, DO or END, and the rest of its line."""

    keyword: str
    rest: str


def parse_statement(line: str) -> JumpStatement | None:
    """Return the statement of a line, or None if the line consists of words."""
    found = _STATEMENT.match(line)
    if found is None:
        return None
    return JumpStatement(found.group(1).upper(), split_line(line[found.end() :], nested=True)[0])


def board_command(line: str) -> str:
    """Return the GRBL command in a line, such as ``$H`` or ``$J=``, or "" for a line of G-code."""
    found = _BOARD.match(line)
    return "" if found is None else found.group(1)


def sends_data(line: str) -> bool:
    """Return whether a line sends data to a printer or file (DPRNT, BPRNT, POPEN, PCLOS)."""
    return _OUTPUT.match(line) is not None


def has_statements(lines: Sequence[str]) -> bool:
    """Return whether a program contains macro statements."""
    return any("[" in line or "GOTO" in line.upper() for line in lines) and any(map(_STATEMENT.match, lines))


def code_without_spaces(line: str) -> str:
    """Remove comments and spaces from a line. Invalid comments are kept."""
    try:
        return "".join(split_line(line, nested=True)[0].split())
    except BlockError:
        return "".join(line.split())


class Jumps:
    """Executes the macro statements of a program. Lines are counted from 0."""

    def __init__(self, lines: Sequence[str], parameters: ProgramParameters) -> None:
        self._lines, self._parameters = lines, parameters
        self._labels: dict[int, list[int]] | None = None
        self._programs: list[int] = []
        self._goals: set[int] | None = None
        self._loops: dict[int, tuple[int, int]] | None = None

    def is_jump_target(self, line: int) -> bool:
        """Return whether a jump may lead to a line."""
        if self._goals is None:
            self._goals = self._find_targets()
        return line in self._goals

    def line_number_text(self, line: int) -> str:
        """Return the N word of a line, such as "N20", or "" if the line has no N word."""
        found = _LABEL.match(self._lines[line])
        return "" if found is None else f"N{int(found.group(1))}"

    def find_label(self, number: int, line: int) -> int | None:
        """Return the line N`number` that a jump from `line` leads to, or None if it does not exist."""
        if self._labels is None:
            self._labels = {}
            for at, text in enumerate(self._lines):
                found = _LABEL.match(text)
                if found is not None:
                    self._labels.setdefault(int(found.group(1)), []).append(at)
                elif _PROGRAM.match(text):
                    self._programs.append(at)
        places = self._labels.get(number, [])
        program = bisect_right(self._programs, line)
        first = self._programs[program - 1] if program else 0
        end = self._programs[program] if program < len(self._programs) else len(self._lines)
        mine = places[bisect_left(places, first) : bisect_left(places, end)] or places
        behind = bisect_right(mine, line)
        return mine[behind] if behind < len(mine) else mine[0] if mine else None

    def execute_statement(self, statement: JumpStatement, line: int) -> tuple[int, str]:
        """Execute the statement on `line`. Return the next line, and a block to execute before it.

        Raises
        ------
        UndecidedJump
            The next line is unknown.
        BlockError
            The statement is invalid.
        """
        keyword, rest = statement
        if keyword == "GOTO":
            return self._execute_goto(rest, line), ""
        if keyword == "IF":
            return self._execute_if(rest, line)
        found = self._all_loops().get(line)
        if keyword == "END":
            if found is None:
                raise BlockError("END has no WHILE … DO before it")
            return found[1], ""
        if found is None:
            raise BlockError("a loop (WHILE … DO) has no END")
        number, end = found
        if keyword == "DO":
            return line + 1, ""
        scanner = Scanner(rest, self._parameters)
        condition = scanner.parse_expression()
        if _AFTER_WHILE.match(rest, scanner.position) is None:
            raise BlockError("WHILE needs its DO {}", number)
        if math.isnan(condition):
            raise self.undecided_jump(line, end, again=line)
        return (line + 1 if condition else end + 1), ""

    def undecided_jump(self, line: int, last: int, again: int | None = None) -> UndecidedJump:
        """Create the exception for the lines up to `last`, which may or may not be executed.

        If these lines may jump elsewhere, the exception covers all following text.
        """
        inside = [code_without_spaces(self._lines[at]) for at in range(line, last + 1)]
        goals = [self._target_line(found, line) for text in inside for found in _GOAL.finditer(text)]
        away = any(goal is None or not line <= goal <= last + 1 for goal in goals)
        if away or any(map(_LEAVES.search, inside)):
            return self.undecided_jump_to_end(line)
        return UndecidedJump(last, again)

    def undecided_jump_to_end(self, line: int) -> UndecidedJump:
        """Create the exception for all text from a line on, which may or may not be executed.

        The exception also contains the first line that this text may jump back to.
        """
        goals = [
            self._target_line(found, at)
            for at in range(len(self._lines))
            for found in _GOAL.finditer(code_without_spaces(self._lines[at]))
        ]
        back = [0 if goal is None else goal for goal in goals]
        return UndecidedJump(None, min((goal for goal in back if goal <= line), default=None))

    def _target_line(self, found: re.Match[str], line: int) -> int | None:
        return None if found.group(1) is None else self.find_label(int(found.group(1)), line)

    def _execute_goto(self, rest: str, line: int) -> int:
        scanner = Scanner(rest, self._parameters)
        value = scanner.parse_value()
        if math.isnan(value):
            raise self.undecided_jump_to_end(line)
        goal = self.find_label(round(value), line)
        if goal is None or not scanner.at_end():
            raise BlockError("GOTO {}: the program has no such line", rest.strip()[:20])
        return goal

    def _execute_if(self, rest: str, line: int) -> tuple[int, str]:
        scanner = Scanner(rest, self._parameters)
        condition = scanner.parse_expression()
        clause = _AFTER_IF.match(rest, scanner.position)
        if clause is None:
            raise BlockError("IF needs its GOTO or THEN")
        consequence = rest[clause.end() :]
        if clause.group(1).upper() == "THEN":
            if math.isnan(condition):
                raise self.undecided_jump(line, line)
            return line + 1, consequence if condition else ""
        if not math.isnan(condition):
            return (self._execute_goto(consequence, line) if condition else line + 1), ""
        goal = self._execute_goto(consequence, line)
        if goal > line:
            raise self.undecided_jump(line, goal - 1)
        raise UndecidedJump(line, goal)

    # -- loops -------------------------------------------------------------------------------------------------------

    def _all_loops(self) -> dict[int, tuple[int, int]]:
        """Map the first and the last line of each loop to its number and the line at its other end."""
        if self._loops is None:
            self._loops = {}
            opened: dict[int, list[int]] = {}
            for at, line in enumerate(self._lines):
                keyword, rest = parse_statement(line) or ("", "")
                number = _loop_number(keyword, rest)
                if keyword in ("DO", "WHILE") and number is not None:
                    opened.setdefault(number, []).append(at)
                elif keyword == "END" and number is not None and opened.get(number):
                    begin = opened[number].pop()
                    self._loops[begin], self._loops[at] = (number, at), (number, begin)
        return self._loops

    def _find_targets(self) -> set[int]:
        found: set[int] = set()
        anywhere = False
        for at, line in enumerate(self._lines):
            if not _MAY_JUMP.search(line):
                continue
            for goal in _GOAL.finditer(code_without_spaces(line)):
                if goal.group(1) is None:
                    anywhere = True
                else:
                    place = self.find_label(int(goal.group(1)), at)
                    found.update(() if place is None else (place,))
        return found | {k for k, text in enumerate(self._lines) if _LABEL.match(text)} if anywhere else found


def _loop_number(keyword: str, rest: str) -> int | None:
    """Return the number of the loop that a statement DO, WHILE or END names, or None."""
    if keyword == "WHILE":
        found = re.search(r"DO[ \t]*([0-9]{1,9})[ \t]*$", rest, re.IGNORECASE)
    else:
        found = re.match(r"[ \t]*([0-9]{1,9})(?![0-9])", rest)
    return int(found.group(1)) if found else None
