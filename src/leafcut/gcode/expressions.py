"""Parameters and expressions of LinuxCNC: `#1=[#<depth>/2]`, `X[#1+SIN[30]]`.

Some values are known only to the machine: offsets, pins, and parameters that another program set. These values, and all
values computed from them, are `UNKNOWN`. Source: LinuxCNC, G-code overview (numbered and named parameters, expressions,
functions).
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from leafcut.gcode.words import (
    MAX_NUMBER,
    NUMBER,
    Block,
    BlockError,
    Word,
    out_of_range_message,
    parse_block,
    parse_words,
    raise_unreadable_text,
    split_line,
)
from leafcut.message import Message

#: LinuxCNC 2.9 compares numbers with this tolerance (confirmed with rs274: 9e-5 is equal to 0, 11e-5 is not).
EQUAL = 1e-4
#: Maximum depth of nested brackets.
MAX_DEPTH = 40
#: Number of parameters that are local to a subroutine: #1 to #30.
ARGUMENTS = 30
#: The machine's own parameters start here: probe results, offsets, positions.
FIRST_OF_MACHINE = 5000
#: On Fanuc and Haas, the machine's own parameters start here: inputs, offsets, alarms, the clock.
FIRST_OF_FANUC = 1000

#: A value that only the machine knows.
UNKNOWN = math.nan
#: A parameter number that is unknown when the program is read.
ANY_NUMBER = -1

_SPECIAL = re.compile(r"[#\[\]=<>*$@^/]")
#: Letters of positions, feeds, speeds and times. Their numbers may be computed.
_MAY_BE_COMPUTED = frozenset("XYZIJKRFSQP")
_SPACE = re.compile(r"[ \t]*")
_NUMBER = re.compile(NUMBER)
_NAME = re.compile(r"<((?:_(?:hal|ini)\[[^<>\[\]#]*\][^<>\[\]#]*)|[^<>\[\]#]*)>", re.IGNORECASE)
_LETTERS = re.compile(r"[A-Za-z]+")
_OPERATOR = re.compile(r"\*\*|[*/+-]|MOD|EQ|NE|GT|GE|LT|LE|AND|OR|XOR", re.IGNORECASE)
_WORD_LETTER = re.compile(r"[A-Za-z$@^]")
_LEVELS = {
    **dict.fromkeys(("AND", "OR", "XOR"), 1),
    **dict.fromkeys(("EQ", "NE", "GT", "GE", "LT", "LE"), 2),
    **dict.fromkeys(("+", "-"), 3),
    **dict.fromkeys(("*", "/", "MOD"), 4),
    "**": 5,
}


@dataclass
class ProgramParameters:
    """The parameters of a program.

    Most parameters are set by the program itself. `known` returns the few parameters that follow from the modal state.
    All other parameters are `UNKNOWN`. As an exception, it is an error to read a local name that the program has not
    set.
    """

    known: Callable[[str], float | None] = lambda _: None
    numbered: dict[int, float] = field(default_factory=dict)
    shared: dict[str, float] = field(default_factory=dict)
    local: dict[str, float] = field(default_factory=dict)
    inside: bool = False
    #: Whether the program read a parameter that it had not set. The value may differ if the block moves.
    asked: bool = False
    #: Number of reads of parameters that the program had not set.
    asks: int = 0
    #: Whether the controller is a Fanuc. A value may then be an expression without brackets, and machine parameters
    #: start at #1000.
    fanuc: bool = False

    @property
    def first_machine_parameter(self) -> int:
        """The number of the first parameter that belongs to the machine."""
        return FIRST_OF_FANUC if self.fanuc else FIRST_OF_MACHINE

    def numbered_value(self, number: int) -> float:
        """Return the value of parameter #`number`."""
        value = self.numbered.get(number)
        if value is None:
            self.asked = True
            self.asks += 1
            value = 0.0 if self.inside and 0 < number <= ARGUMENTS else self.known(str(number))
        return UNKNOWN if value is None else value

    def named_value(self, name: str) -> float:
        """Return the value of parameter #<`name`>."""
        value = self._find_named_value(name)
        if value is None and not name.startswith("_"):
            raise BlockError("#<{}> is used, but the program does not set it before", name)
        return UNKNOWN if value is None else value

    def exists(self, name: str) -> float:
        """Return 1 if parameter #<name> has a value, 0 if not, and `UNKNOWN` if another program may have set it."""
        if self._find_named_value(name) is not None:
            return 1.0
        return UNKNOWN if name.startswith("_") else 0.0

    def _find_named_value(self, name: str) -> float | None:
        value = (self.shared if name.startswith("_") else self.local).get(name)
        if value is not None:
            return value
        self.asked = True
        self.asks += 1
        return self.known(name)

    def digest(self) -> str:
        """Return a digest of the values of all parameters."""
        values = [sorted(part.items()) for part in (self.numbered, self.shared, self.local)]
        return hashlib.sha256(repr(values).encode()).hexdigest()[:16] if any(values) else ""

    def set_parameter(self, key: int | str, value: float) -> None:
        """Set a parameter by its number or its name."""
        if key == ANY_NUMBER:
            self.forget_values(names=False)
        elif isinstance(key, int):
            if key < self.first_machine_parameter:
                self.numbered[key] = value
        else:
            (self.shared if key.startswith("_") else self.local)[key] = value

    def forget_values(self, names: bool = True) -> None:
        """Mark all numbered parameters as unknown. With `names`, mark the named parameters as well."""
        self.numbered = dict.fromkeys(range(1, ARGUMENTS + 1), UNKNOWN)
        if names:
            self.shared.clear()
            self.local = dict.fromkeys(self.local, UNKNOWN)


class _UnknownParameters(ProgramParameters):
    def numbered_value(self, number: int) -> float:
        return UNKNOWN

    def named_value(self, name: str) -> float:
        return UNKNOWN

    def exists(self, name: str) -> float:
        return UNKNOWN


Setting = tuple[int | str, float]


class BlockReading(NamedTuple):
    """A block with the parameters that it sets. It also records computed numbers and settings of machine parameters."""

    block: Block
    settings: list[Setting]
    computed: bool = False
    of_machine: bool = False

    @property
    def has_unknown(self) -> bool:
        """Whether any number in the block, or any parameter that it sets, is unknown."""
        values = [word.value for word in self.block.words] + [value for _, value in self.settings]
        return self.of_machine or (self.computed and any(map(math.isnan, values)))


def read_block(line: str, number: int, parameters: ProgramParameters) -> BlockReading:
    """Parse the block and the parameter settings of a line. The value of a word may be `UNKNOWN`.

    Raises
    ------
    BlockError
        The line is invalid as in `words.parse_block`, or an expression has no value.
    """
    if _SPECIAL.search(line) is None and line.count("(") < 2:
        return BlockReading(parse_block(line, number), [])
    body, comments = split_line(line, nested=True)
    if body.startswith("%"):
        return BlockReading(Block(number, (), comments, percent=body[1:].strip()), [])
    deleted = body.startswith("/")
    if deleted:
        # Controls have up to nine block-delete switches: /1 … /9.
        body = body[1:].lstrip(" \t").lstrip("123456789") if body[1:2].isdigit() else body[1:]
    if _SPECIAL.search(body) is None:
        return BlockReading(Block(number, parse_words(body), comments, deleted=deleted), [])
    scanner = Scanner(body, parameters)
    words: list[Word] = []
    settings: list[Setting] = []
    while not scanner.at_end():
        if scanner.peek() == "#":
            settings.append(scanner.parse_setting())
        else:
            words.append(scanner.parse_word())
    block = Block(number, tuple(words), comments, deleted=deleted)
    return BlockReading(block, settings, scanner.computed, scanner.of_machine)


def words_without_evaluation(line: str) -> tuple[Word, ...] | None:
    """Return the words of a line with their numbers as text. The value of a word with an expression is NaN.

    Return None if the line sets a parameter, has an error, or computes a number other than a length, feed, speed or
    time.
    """
    try:
        body, _ = split_line(line)
        scanner = Scanner(body, _UnknownParameters())
        words: list[Word] = []
        while not scanner.at_end():
            if scanner.peek() == "#":
                return None
            begin, scanner.computed = scanner.position + 1, False
            word = scanner.parse_word()
            if scanner.computed and word.letter not in _MAY_BE_COMPUTED:
                return None
            words.append(Word(word.letter, word.value, body[begin : scanner.position].strip()))
    except BlockError:
        return None
    return tuple(words)


class Scanner:
    """Parses a line.

    `computed` means that a value was not a plain number. `of_machine` means that the line sets a machine parameter.
    """

    def __init__(self, text: str, parameters: ProgramParameters) -> None:
        self.text = text
        self.position = 0
        self.parameters = parameters
        self.computed = self.of_machine = False
        self._depth = 0

    def peek(self) -> str:
        """Return the next character other than a space, or ""."""
        found = _SPACE.match(self.text, self.position)
        self.position = found.end() if found else self.position
        return self.text[self.position : self.position + 1]

    def at_end(self) -> bool:
        """Return whether only spaces remain."""
        return not self.peek()

    def parse_word(self) -> Word:
        """Parse a word: a letter and its value."""
        letter = self._consume(_WORD_LETTER)
        if letter is None:
            if self.peek() in "]=<>*":
                raise BlockError("unexpected character {!a}", self.peek())
            raise_unreadable_text(self.text, self.position)
        start = self.position - 1
        self.peek()
        plain = self._consume(_NUMBER)
        if plain is None and self.peek() not in ("#", "[", "+", "-") and self._peek_match(_LETTERS) not in _FUNCTIONS:
            raise_unreadable_text(self.text, start)
        value = float(plain) if plain is not None else self.parse_value()
        if not (-MAX_NUMBER < value < MAX_NUMBER or math.isnan(value)):
            raise BlockError(out_of_range_message(letter))
        return Word(letter.upper(), value, plain if plain is not None else _format_value(value))

    def parse_setting(self) -> Setting:
        """Parse a parameter setting, `#… = value`."""
        key = self._parse_parameter_key()
        if self.peek() != "=":
            found = self.text[self.position : self.position + 12]
            raise BlockError("'{}': '=' is expected after a parameter; if # starts a comment, put it in ( )", found)
        self.position += 1
        value = self._parse_binary_operations(1) if self.parameters.fanuc else self.parse_value()
        self.computed = True
        if isinstance(key, int) and key >= self.parameters.first_machine_parameter:
            self.of_machine = True
        elif isinstance(key, str) and (self.parameters.known(key) is not None or key.startswith(("_hal[", "_ini["))):
            raise BlockError("#<{}> cannot be set", key)
        return key, value

    def parse_value(self) -> float:
        """Parse a number, a parameter, an expression or a function."""
        sign = self.peek()
        plain = self._consume(_NUMBER)
        if plain is not None:
            number = float(plain)
            if number in (math.inf, -math.inf):
                raise BlockError("'{}' exceeds the number range of controllers", plain)
            return number
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise BlockError("an expression has more than {} nested brackets", MAX_DEPTH)
        try:
            if sign == "[":
                return self.parse_expression()
            if sign == "#":
                key = self._parse_parameter_key()
                self.computed = True
                return self.parameters.numbered_value(key) if isinstance(key, int) else self.parameters.named_value(key)
            if sign and sign in "+-":
                self.position += 1
                return -self.parse_value() if sign == "-" else self.parse_value()
            return self._parse_function()
        finally:
            self._depth -= 1

    def parse_expression(self) -> float:
        """Parse an expression in brackets, `[ … ]`."""
        if self.peek() != "[":
            raise BlockError("'[' is expected")
        self.position += 1
        self.computed = True
        value = self._parse_binary_operations(1)
        if self.peek() != "]":
            raise BlockError(
                "an expression is not closed: ']' is missing" if self.at_end() else self._unexpected_text_message()
            )
        self.position += 1
        return value

    def _parse_binary_operations(self, level: int) -> float:
        left = self.parse_value()
        while True:
            self.peek()
            found = _OPERATOR.match(self.text, self.position)
            if found is None or _LEVELS[found.group().upper()] < level:
                return left
            name = found.group().upper()
            self.position = found.end()
            left = _evaluate_function(_OPERATORS[name], name, left, self._parse_binary_operations(_LEVELS[name] + 1))

    def _parse_parameter_key(self) -> int | str:
        self.peek()
        self.position += 1
        if self.peek() == "<":
            return self._parse_parameter_name()
        value = self.parse_value()
        if math.isnan(value):
            return ANY_NUMBER
        number = round(value)
        if abs(value - number) > 1e-4 or not 0 <= number <= 99_999:
            raise BlockError("#{:g}: the number of a parameter must be a whole number", value)
        return number

    def _parse_parameter_name(self) -> str:
        found = _NAME.match(self.text, self.position)
        if found is None:
            raise BlockError("a parameter name is not closed: '>' is missing")
        self.position = found.end()
        return re.sub(r"\s+", "", found.group(1)).lower()

    def _parse_function(self) -> float:
        name = (self._consume(_LETTERS) or "").upper()
        if name not in _FUNCTIONS:
            self.position -= len(name)
            raise BlockError(self._unexpected_text_message())
        self.computed = True
        if name == "EXISTS":
            return self._parse_exists()
        argument = self.parse_expression()
        if name != "ATAN":
            return _evaluate_function(_FUNCTIONS[name], name, argument)
        if self.peek() != "/":
            raise BlockError("ATAN needs two arguments: ATAN[…]/[…]")
        self.position += 1
        return _evaluate_function(lambda y, x: math.degrees(math.atan2(y, x)), name, argument, self.parse_expression())

    def _parse_exists(self) -> float:
        inside = re.compile(r"[ \t]*\[[ \t]*#[ \t]*(?=<)").match(self.text, self.position)
        if inside is None:
            raise BlockError("EXISTS needs a name: EXISTS[#<name>]")
        self.position = inside.end()
        name = self._parse_parameter_name()
        if self.peek() != "]":
            raise BlockError("an expression is not closed: ']' is missing")
        self.position += 1
        return self.parameters.exists(name)

    def _consume(self, pattern: re.Pattern[str]) -> str | None:
        found = pattern.match(self.text, self.position)
        if found is None:
            return None
        self.position = found.end()
        return found.group()

    def _peek_match(self, pattern: re.Pattern[str]) -> str:
        found = pattern.match(self.text, self.position)
        return found.group().upper() if found else ""

    def _unexpected_text_message(self) -> Message:
        rest = self.text[self.position : self.position + 12]
        return (
            Message("a value is expected, not {!a}", rest)
            if rest
            else Message("a value is missing at the end of the line")
        )


def _format_value(value: float) -> str:
    """Format a computed value with the decimal point that some controllers require."""
    text = f"{value:.10g}"
    return text if "." in text else f"{text}."


def _evaluate_function(function: Callable[..., float], name: str, *arguments: float) -> float:
    if any(math.isnan(a) for a in arguments):
        return UNKNOWN
    try:
        value = function(*arguments)
    except (ValueError, ZeroDivisionError, OverflowError):
        value = math.nan
    if isinstance(value, complex) or not math.isfinite(value):
        raise BlockError("{} of {} has no value", name, " and ".join(f"{a:g}" for a in arguments))
    return value


def _positive_mod(a: float, b: float) -> float:
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0.0 else rest


_OPERATORS: dict[str, Callable[[float, float], float]] = {
    "**": math.pow,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "MOD": _positive_mod,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "EQ": lambda a, b: float(abs(a - b) < EQUAL),
    "NE": lambda a, b: float(abs(a - b) >= EQUAL),
    "GT": lambda a, b: float(a > b),
    "GE": lambda a, b: float(a >= b),
    "LT": lambda a, b: float(a < b),
    "LE": lambda a, b: float(a <= b),
    "AND": lambda a, b: float(a != 0.0 and b != 0.0),
    "OR": lambda a, b: float(a != 0.0 or b != 0.0),
    "XOR": lambda a, b: float((a != 0.0) != (b != 0.0)),
}

_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "ACOS": lambda a: math.degrees(math.acos(a)),
    "ASIN": lambda a: math.degrees(math.asin(a)),
    "ATAN": lambda a: a,
    "COS": lambda a: math.cos(math.radians(a)),
    "EXISTS": lambda a: a,
    "EXP": math.exp,
    "FIX": lambda a: float(math.floor(a)),
    "FUP": lambda a: float(math.ceil(a)),
    "LN": math.log,
    "ROUND": lambda a: math.copysign(math.floor(abs(a) + 0.5), a),
    "SIN": lambda a: math.sin(math.radians(a)),
    "SQRT": math.sqrt,
    "TAN": lambda a: math.tan(math.radians(a)),
}
