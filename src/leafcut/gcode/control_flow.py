"""Execute control flow: the O-words of LinuxCNC (subroutines, conditions, loops), and M98 with M99.

    o100 sub … o100 endsub    o100 call [1] [2]    o1 if [#1 GT 0] … o1 elseif [] … o1 else … o1 endif
    o2 while [] … o2 endwhile    o2 do … o2 while []    o2 repeat [3] … o2 endrepeat    break, continue, return

Only the text of the program is used, and no file is opened. Source: LinuxCNC, O codes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from leafcut.gcode.expressions import ARGUMENTS, ProgramParameters, Scanner
from leafcut.gcode.jumps import Jumps, UndecidedJump
from leafcut.gcode.words import BlockError, split_line

#: Maximum depth of nested subroutines. LinuxCNC has ten levels, including the program itself.
MAX_CALLS = 9
#: Maximum number of characters that loops and subprograms may execute: in total, or per character of the program,
#: whichever is more. A block counts as at least `LEAST` characters. Reaching the limit takes a few seconds. A loop that
#: runs even longer is treated as endless.
MAX_REPEATED, REPEATED_PER_LETTER, LEAST = 6_000_000, 24, 24

_OPENING = r"(?:[ \t]|\([^()]*\))*+/?[ \t]*+(?:[nN][ \t]*+[0-9]++[ \t]*+)?[oO][ \t]*+"
_CONTROL = re.compile(_OPENING + r"(<[^<>]*>|[0-9]++)[ \t]*+([A-Za-z]++)")
_COMPUTED = re.compile(_OPENING + r"[#\[]")
_LABEL = re.compile(_OPENING + r"([0-9]++)")
_PARTS = {
    "endsub": ("sub",),
    "return": ("sub",),
    "elseif": ("if",),
    "else": ("if",),
    "endif": ("if",),
    "endwhile": ("while",),
    "endrepeat": ("repeat",),
    "break": ("while", "repeat", "do"),
    "continue": ("while", "repeat", "do"),
}
_CLOSING = ("endsub", "endif", "endwhile", "endrepeat")
_KEYWORDS = {*_PARTS, "sub", "if", "while", "do", "repeat", "call"}


@dataclass(frozen=True, slots=True)
class Control:
    """An O-word with its label, its keyword, and the rest of its line."""

    label: str
    keyword: str
    rest: str


def parse_o_word(line: str) -> Control | None:
    """Return the O-word of a line, or None.

    Raises
    ------
    BlockError
        The keyword is unknown, or the label is computed.
    """
    found = _CONTROL.match(line)
    if found is None:
        if _COMPUTED.match(line):
            raise BlockError("an O-word whose number is computed is not understood")
        return None
    label, keyword = re.sub(r"\s+", "", found.group(1)).lower(), found.group(2).lower()
    if keyword not in _KEYWORDS:
        if label.startswith("<"):
            raise BlockError("o{} {}: this is not an O-word of LinuxCNC", label, keyword)
        return None  # "O100G0X1": a program number followed by words.
    return Control(label.lstrip("0") or "0", keyword, split_line(line[found.end() :])[0])


@dataclass(slots=True)
class Construct:
    """A control structure (sub, if, while, do or repeat). `parts` contains its keywords with their lines, from 0."""

    kind: str
    parts: list[tuple[int, str]]

    @property
    def first(self) -> int:
        """The line of the opening keyword."""
        return self.parts[0][0]

    def closing_line(self) -> int:
        """Return the line of the closing keyword.

        Raises
        ------
        BlockError
            The closing keyword is missing.
        """
        line, keyword = self.parts[-1]
        if keyword not in _CLOSING and not (self.kind == "do" and keyword == "while"):
            raise BlockError("'{}' is not closed", self.kind)
        return line

    def next_branch(self, line: int) -> tuple[int, str]:
        """Return the line and the keyword of the next branch of an `if` after `line`."""
        self.closing_line()
        return next((at, keyword) for at, keyword in self.parts if at > line)


@dataclass(slots=True)
class SubprogramCall:
    """An active call of a subprogram.

    It stores the first line, the return line, the remaining repeats, and the parameters to restore.
    """

    start: int
    back: int
    again: int
    construct: Construct | None
    numbered: dict[int, float] = field(default_factory=dict)
    local: dict[str, float] = field(default_factory=dict)
    counters: dict[int, int] = field(default_factory=dict)


class Flow:
    """Executes the O-words of a program. Lines are counted from 0."""

    def __init__(self, lines: Sequence[str], parameters: ProgramParameters) -> None:
        self.parameters = parameters
        self.jumps = Jumps(lines, parameters)
        self.calls: list[SubprogramCall] = []
        self.repeated = 0
        self._letters, self._most = 0, max(MAX_REPEATED, REPEATED_PER_LETTER * sum(map(len, lines)))
        self._lines = lines
        self._counters: dict[int, int] = {}
        #: Parameters and calls at the start of the last iteration of each loop. The key is the line of the loop.
        self._iterations: dict[int, tuple[object, ...]] = {}
        self._deciding = -1
        self._broken = False
        self._of_line: dict[int, Construct] | None = None
        self._subs: dict[str, Construct] = {}
        self._labels: dict[int, int] | None = None
        self._looped = bytearray()

    def is_repeated(self, line: int) -> bool:
        """Return whether a line runs in a loop or in a subprogram."""
        return bool(self.calls) or (line < len(self._looped) and self._looped[line] == 1)

    def count_repeated_block(self, line: int) -> None:
        """Count a block that runs in a loop or subprogram.

        Raises
        ------
        BlockError
            The program exceeds the maximum number of repeated blocks.
        """
        if not self.is_repeated(line):
            return
        self.repeated += 1
        self._letters += max(len(self._lines[line]), LEAST)
        if self._letters > self._most:
            raise BlockError("loops and subprograms run more than {:,} blocks; is this loop endless?", self.repeated)

    def execute_o_word(self, control: Control, line: int) -> int:
        """Execute the O-word on `line` and return the next line."""
        if self._of_line is None:
            self._find_constructs()
        scanner = Scanner(control.rest, self.parameters)
        if control.keyword == "call":
            after = self._execute_call(control.label, scanner, line)
        else:
            construct = self._of_line.get(line) if self._of_line else None
            if construct is None:
                raise BlockError("'o{} {}' has no matching start before it", control.label, control.keyword)
            after = getattr(self, f"_obey_{control.keyword}")(construct, scanner, line)
        if not scanner.at_end():
            raise BlockError("unexpected '{}' after '{}'", control.rest[scanner.position :][:12], control.keyword)
        return int(after)

    def mark_repeated(self, line: int, goal: int) -> None:
        """Mark the lines from `goal` to `line` as repeated."""
        if self._of_line is None:
            self._find_constructs()
        self._looped[goal : line + 1] = b"\1" * (line + 1 - goal)

    def call_subprogram_at_line(self, number: int, times: int, line: int) -> int | None:
        """Start the subprogram at line N`number` (M97), and run it `times` times.

        Return the first line of the subprogram, or None if it does not exist.
        """
        start = self.jumps.find_label(number, line)
        if start is None:
            return None
        return self._start_subprogram(start, times, line)

    def call_numbered_program(self, number: int, times: int, line: int) -> int | None:
        """Start the subprogram O`number` (M98), and run it `times` times. P30012 calls O12 three times.

        Return the first line of the subprogram, or None if it does not exist.
        """
        if self._labels is None:
            self._labels = {}
            for at, text in enumerate(self._lines):
                found = _LABEL.match(text)
                if found and parse_o_word(text) is None:
                    self._labels.setdefault(int(found.group(1)), at)
        start = self._labels.get(number)
        if start is None and number > 9_999 and times == 1:
            times, number = divmod(number, 10_000)
            start = self._labels.get(number)
        return None if start is None else self._start_subprogram(start, times, line)

    def _start_subprogram(self, start: int, times: int, line: int) -> int:
        if times == 0:
            return line + 1
        self._enter_subprogram(SubprogramCall(start, line + 1, times - 1, None))
        return start

    def return_from_program(self) -> int | None:
        """End a run of the subprogram that M98 started (M99). Return the next line, or None in the main program."""
        if not self.calls:
            return None
        call = self.calls[-1]
        if call.construct is not None:
            raise BlockError("M99 is used inside a subroutine that ends with endsub")
        if call.again:
            call.again -= 1
            return call.start
        self.calls.pop()
        return call.back

    def _enter_subprogram(self, call: SubprogramCall) -> None:
        if len(self.calls) >= MAX_CALLS:
            raise BlockError("subprogram calls are nested more than {} deep; does a subprogram call itself?", MAX_CALLS)
        self.calls.append(call)
        self.parameters.inside = any(c.construct is not None for c in self.calls)

    # Structure of the program.

    def _find_constructs(self) -> None:
        self._of_line = {}
        self._looped = bytearray(len(self._lines))
        open_ones: dict[str, Construct] = {}
        for at, text in enumerate(self._lines):
            if "o" not in text and "O" not in text:
                continue
            try:
                control = parse_o_word(text)
            except BlockError:
                continue  # An error is raised when the line is executed.
            if control is not None and control.keyword != "call":
                self._add_to_construct(control, at, open_ones)

    def _add_to_construct(self, control: Control, at: int, open_ones: dict[str, Construct]) -> None:
        assert self._of_line is not None
        label, keyword = control.label, control.keyword
        opened = open_ones.get(label)
        ends_do = keyword == "while" and opened is not None and opened.kind == "do"
        if keyword in _PARTS or ends_do:
            if opened is None or not (ends_do or opened.kind in _PARTS[keyword]):
                return
            opened.parts.append((at, keyword))
        else:
            opened = open_ones[label] = Construct(keyword, [(at, keyword)])
            if keyword == "sub":
                self._subs.setdefault(label, opened)
        self._of_line[at] = opened
        if keyword in _CLOSING or ends_do:
            del open_ones[label]
            if opened.kind not in ("sub", "if"):
                self._looped[opened.first : at + 1] = b"\1" * (at + 1 - opened.first)

    # Subroutines.

    def _execute_call(self, label: str, scanner: Scanner, line: int) -> int:
        construct = self._subs.get(label)
        if construct is None:
            raise UndecidedJump(line)
        construct.closing_line()
        arguments = []
        while scanner.peek() == "[":
            arguments.append(scanner.parse_expression())
        if len(arguments) > ARGUMENTS:
            raise BlockError("a subroutine takes at most {} arguments", ARGUMENTS)
        parameters = self.parameters
        call = SubprogramCall(construct.first, line + 1, 0, construct, local=parameters.local, counters=self._counters)
        call.numbered = {n: v for n, v in parameters.numbered.items() if n <= ARGUMENTS}
        self._enter_subprogram(call)
        for number in range(1, ARGUMENTS + 1):
            parameters.numbered[number] = arguments[number - 1] if number <= len(arguments) else 0.0
        parameters.local, self._counters = {}, {}
        return construct.first + 1

    def _obey_sub(self, construct: Construct, _scanner: Scanner, _line: int) -> int:
        return construct.closing_line()

    _obey_else = _obey_continue = _obey_sub

    def _obey_endsub(self, construct: Construct, scanner: Scanner, line: int) -> int:
        if not self.calls:
            scanner.position = len(scanner.text)
            return line + 1
        return self._obey_return(construct, scanner, line)

    def _obey_return(self, construct: Construct, scanner: Scanner, _line: int) -> int:
        if not self.calls or self.calls[-1].construct is not construct:
            raise BlockError("this block ends a subroutine that is not running")
        value = None if scanner.at_end() else scanner.parse_value()
        call, parameters = self.calls.pop(), self.parameters
        for number in range(1, ARGUMENTS + 1):
            parameters.numbered.pop(number, None)
        parameters.numbered.update(call.numbered)
        parameters.local, self._counters = call.local, call.counters
        parameters.inside = any(c.construct is not None for c in self.calls)
        parameters.shared["_value_returned"] = float(value is not None)
        parameters.shared["_value"] = value or 0.0
        return call.back

    # Conditions. After a branch, the next part of its `if` jumps to the end.

    def _obey_if(self, construct: Construct, scanner: Scanner, line: int) -> int:
        return self._execute_branch(construct, scanner.parse_expression(), line)

    def _execute_branch(self, construct: Construct, condition: float, line: int) -> int:
        if math.isnan(condition):
            raise self.jumps.undecided_jump(line, construct.closing_line())
        after, keyword = construct.next_branch(line)
        if condition:
            return line + 1
        if keyword == "elseif":
            # This is not the end of an executed branch: the condition of the elseif decides.
            self._deciding = after
            return after
        return after + 1 if keyword == "else" else after

    def _obey_elseif(self, construct: Construct, scanner: Scanner, line: int) -> int:
        if self._deciding == line:
            self._deciding = -1
            return self._execute_branch(construct, scanner.parse_expression(), line)
        scanner.position = len(scanner.text)
        return construct.closing_line()

    def _obey_endif(self, _construct: Construct, _scanner: Scanner, line: int) -> int:
        return line + 1

    # Loops.

    def _obey_while(self, construct: Construct, scanner: Scanner, line: int) -> int:
        end, condition = construct.closing_line(), scanner.parse_expression()
        if math.isnan(condition):
            raise self.jumps.undecided_jump(line, end, construct.first)
        if not condition:
            return line + 1 if construct.kind == "do" else end + 1
        self.start_iteration(line)
        return (construct.first if construct.kind == "do" else line) + 1

    def start_iteration(self, line: int) -> None:
        """Start the next iteration of a loop.

        Raises
        ------
        BlockError
            The loop is endless: no parameter or call has changed since the last iteration.
        """
        own = self.parameters
        calls = [(c.back, c.again, dict(c.numbered), dict(c.local), dict(c.counters)) for c in self.calls]
        now = own.asks, dict(self._counters), dict(own.numbered), dict(own.shared), dict(own.local), calls
        if self._iterations.get(line) == now:
            raise BlockError("this loop is endless: no parameter changes between its iterations")
        self._iterations[line] = now

    def _obey_endwhile(self, construct: Construct, _scanner: Scanner, _line: int) -> int:
        return construct.first

    def _obey_do(self, construct: Construct, _scanner: Scanner, line: int) -> int:
        construct.closing_line()
        if self._broken:
            raise BlockError("a 'do' follows a 'break' out of a 'while', and LinuxCNC 2.9 runs such a loop only once")
        return line + 1

    def _obey_repeat(self, construct: Construct, scanner: Scanner, line: int) -> int:
        end = construct.closing_line()
        value = scanner.parse_expression()
        if math.isnan(value):
            raise self.jumps.undecided_jump(line, end, construct.first)
        times = round(value)
        if times <= 0:
            return end + 1
        self._counters[construct.first] = times
        return line + 1

    def _obey_endrepeat(self, construct: Construct, _scanner: Scanner, line: int) -> int:
        left = self._counters.get(construct.first, 0) - 1
        self._counters[construct.first] = left
        return construct.first + 1 if left > 0 else line + 1

    def _obey_break(self, construct: Construct, _scanner: Scanner, _line: int) -> int:
        self._broken |= construct.kind == "while"
        return construct.closing_line() + 1
