"""Split a line of G-code into words, such as `N10 g0x1.5 Y-.5 (over the hole) ; go`. Spaces and case do not matter."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, NoReturn

from leafcut.errors import LeafcutError
from leafcut.message import Message

#: Maximum line length, characters. The limit of RS274/NGC is 256.
MAX_LINE = 10_000
#: Maximum absolute value of a number, in any unit.
MAX_NUMBER = 1e9

#: Matches a number. The possessive `++` keeps the time linear for a line of a thousand digits.
NUMBER = r"[+-]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)"
_WORD = re.compile(rf"[ \t]*([A-Za-z$])[ \t]*({NUMBER})")
COMMENT = re.compile(r"\([^()]*\)|;.*")
_IN_PARENTHESES = re.compile(r"\([^()]*\)")


class BlockError(LeafcutError):
    """Raised if a block is invalid or unsupported. The caller adds the file and the line."""


class UnclearBlock(BlockError):
    """Raised if a block is valid but the program does not determine its effect. Such a block can be kept unchanged."""


class Word(NamedTuple):
    """A word: an upper-case letter, its number, and the number as written. Some rules depend on the decimal point."""

    letter: str
    value: float
    text: str

    def __str__(self) -> str:
        return f"{self.letter}{self.text}"


@dataclass(frozen=True, slots=True)
class Block:
    """A line of G-code with its words, comments and marks.

    Attributes
    ----------
    percent
        Text after a leading percent sign, or None.
    deleted
        Whether the line starts with a slash. The machine skips such a line if its block-delete switch is on.
    """

    line: int
    words: tuple[Word, ...]
    comments: tuple[str, ...] = ()
    percent: str | None = None
    deleted: bool = False


def numbered_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the number (from 1) and the text of each line. Any kind of line end is accepted."""
    return enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1)


def parse_block(line: str, number: int = 0) -> Block:
    """Parse a line of G-code.

    Raises
    ------
    BlockError
        A comment is unclosed or nested, a letter has no number, a number is out of range, or a character is invalid.
    """
    body, comments = split_line(line)
    if body.startswith("%"):
        return Block(number, (), comments, percent=body[1:].strip())
    deleted = body.startswith("/")
    if deleted:
        body = body[1:]
    return Block(number, parse_words(body), comments, deleted=deleted)


def parse_plain_block(line: str) -> Block | None:
    """Parse a line that only contains comments and words with plain numbers. For any other line, return None."""
    try:
        return parse_block(line.rstrip("\r\n"))
    except BlockError:
        return None


def split_line(line: str, nested: bool = False) -> tuple[str, tuple[str, ...]]:
    """Split a line into its code, without leading and trailing spaces, and its comments.

    `nested` allows nested comments.

    Raises
    ------
    BlockError
        The line is too long, or a comment is unclosed or wrongly nested.
    """
    if len(line) > MAX_LINE:
        raise BlockError("the line has {} characters; this is not G-code", len(line))
    body, comments = line, tuple[str, ...]()
    if "(" in line or ")" in line or ";" in line:
        body, comments = _split_off_comments(_flatten_comments(line) if nested else line)
    return body.strip(), comments


def remove_word(line: str, word: str) -> str | None:
    """Remove a word from a line. Return None if `word` is empty, or only occurs in comments."""
    at = line.find(word) if word else -1
    while at >= 0:
        before = _IN_PARENTHESES.sub("", _flatten_comments(line[:at]))
        if "(" not in before and ";" not in before:
            return f"{line[:at]} {line[at + len(word) :]}"
        at = line.find(word, at + 1)
    return None


def has_nested_comment(line: str) -> bool:
    """Return whether a comment in a line contains another comment."""
    return _flatten_comments(line) != line


def _flatten_comments(line: str) -> str:
    """Replace the parentheses inside comments with spaces, up to the first semicolon outside of comments."""
    if line.count("(") < 2:
        return line
    depth, letters = 0, list(line)
    for at, letter in enumerate(line):
        if letter == ";" and not depth:
            break
        if letter == "(":
            depth += 1
            letters[at] = letter if depth == 1 else " "
        elif letter == ")" and depth:
            depth -= 1
            letters[at] = letter if depth == 0 else " "
    return "".join(letters)


def _split_off_comments(line: str) -> tuple[str, tuple[str, ...]]:
    """Return a line without its comments, and the comments. A semicolon inside parentheses is plain text."""
    comments: list[str] = []

    def collect_comment(match: re.Match[str]) -> str:
        comments.append(match.group().lstrip("(;").removesuffix(")").strip())
        return " "

    body = COMMENT.sub(collect_comment, line)
    if "(" in body:
        raise BlockError(
            "a comment contains another comment" if ")" in body else "a comment is not closed: ')' is missing"
        )
    if ")" in body:
        raise BlockError("')' without '(' before it")
    return body, tuple(comments)


def parse_words(body: str) -> tuple[Word, ...]:
    """Parse the words of a line without comments and marks. A leading colon means O, as in the ISO code of Fanuc."""
    words = []
    if body[:1] == ":" and body[1:2].isdigit():
        body = f"O{body[1:]}"
    position, end = 0, len(body)
    match = _WORD.match
    while position < end:
        found = match(body, position)
        if found is None:
            raise_unreadable_text(body, position)
        letter, text = found.groups()
        value = float(text)
        if not -MAX_NUMBER < value < MAX_NUMBER:
            raise BlockError(out_of_range_message(letter))
        words.append(Word(letter.upper(), value, text))
        position = found.end()
    return tuple(words)


def out_of_range_message(letter: str) -> Message:
    """Return the message for a number that is too large for any machine."""
    fault = Message("the number of {} is out of range: {:,.0f} or more", letter.upper(), MAX_NUMBER)
    return Message("{}; correct or delete this word, or post the program again", fault)


def raise_unreadable_text(body: str, position: int) -> NoReturn:
    """Raise a `BlockError` that shows the text at `position`, which is not a word."""
    rest = body[position:].lstrip(" \t")
    first = rest[:1]
    if first in "#[]=<>*":
        raise BlockError("'{}': parameters and expressions are not understood", first)
    if first.isascii() and first.isalpha():
        raise BlockError("'{}' is a letter without a number", _printable_start(rest))
    if first in "0123456789.+-":
        raise BlockError("'{}' is a number without a letter", _printable_start(rest))
    raise BlockError("unexpected character {!a}", first)


def _printable_start(text: str) -> str:
    return re.sub(r"[^\x21-\x7e]+", " ", text[:12]).strip()
