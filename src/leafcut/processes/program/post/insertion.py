"""Insert words into the lines of an existing program, following the style of each line, and renumber lines."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from leafcut.errors import PostError
from leafcut.gcode.words import COMMENT, NUMBER

_FRONT = re.compile(r"[ \t]*/?[ \t]*(?:[Nn][ \t]*[0-9]+(?:\.[0-9]+)?)?[ \t]*")
_NUMBER = re.compile(r"([ \t]*+/?[ \t]*+[Nn][ \t]*+)([0-9]+)(?![0-9.])")
_LETTER = re.compile(r"[A-Za-z]")
_WORD = re.compile(rf"([A-Za-z])[ \t]*({NUMBER})")
_JUMP = re.compile(r"GOTO|M\s*97(?![0-9])|M\s*99\s*P", re.IGNORECASE)
#: Modal words that may be written in a separate block, because they cause no motion there.
_STANDS_ALONE = frozenset(("G17", "G18", "G19", "G90", "G91", "G90.1", "G91.1", "G98", "G99"))
#: Largest line number in RS274/NGC.
_LAST_NUMBER = 99_999


def line_ending(lines: Sequence[str]) -> str:
    """Return the line ending of a program."""
    first = next(iter(lines), "")
    return first[len(first.rstrip("\r\n")) :] or "\n"


def code_without_comments(line: str) -> str:
    """Return a line without its line ending. Each comment is replaced by spaces."""
    return COMMENT.sub(lambda m: " " * len(m.group()), line.rstrip("\r\n"))


def _word_range(line: str) -> tuple[int, int, str]:
    """Return the start and the end of the words in a line, and the separator between the words."""
    code = code_without_comments(line)
    begin = _FRONT.match(code)
    assert begin is not None  # the pattern also matches an empty string
    start, stop = begin.end(), len(code.rstrip())
    body = code[start:stop]
    return start, stop, "" if len(_LETTER.findall(body)) > 1 and not re.search(r"[ \t]", body) else " "


def insert_words(line: str, front: Sequence[str], back: Sequence[str]) -> str:
    """Insert G words before the first word of a line, and other words after its last word.

    >>> insert_words("N10 X5 (here)", ["G81"], ["Z-3.0"])
    'N10 G81 X5 Z-3.0 (here)'
    """
    if not front and not back:
        return line
    start, stop, space = _word_range(line)
    text = space.join([*front, line[start:stop], *back])
    return line[:start] + text + line[stop:]


def insert_words_within(line: str, front: Sequence[str], back: Sequence[str], longest: int, was: int) -> list[str]:
    """Insert words into a line, or into two lines if a single line would be too long for the controller.

    In that case, the modal words of the line move to a block before it. Motion words must stay with their coordinates.
    `longest` is the maximum length of a line without its line ending. The length of the original line, `was`, is always
    permitted.

    >>> insert_words_within("X5 (a hole)", ["G99", "G81"], ["Z-3.0", "F100"], 24, 11)
    ['G99 F100', 'G81 X5 Z-3.0 (a hole)']

    Raises
    ------
    PostError
        The line is too long even without its modal words.
    """
    most = max(longest, was)
    whole = insert_words(line, front, back)
    if len(whole.rstrip("\r\n")) <= most:
        return [whole]
    alone = [w for w in (*front, *back) if w[0] in "FS" or w in _STANDS_ALONE]
    rest = insert_words(line, *([w for w in words if w not in alone] for words in (front, back)))
    if len(rest.rstrip("\r\n")) > most:
        raise PostError(
            "'{}' would be longer than the {} characters that the controller accepts", line.strip()[:40], longest
        )
    end = line[len(line.rstrip("\r\n")) :] or "\n"
    return [" ".join(alone) + end, rest]


def replace_words(line: str, texts: Mapping[str, str]) -> str:
    """Replace the numbers after the letters in `texts`. Letters that the line does not contain are ignored.

    >>> replace_words("G0 X5.Y-2 (X5)", {"X": "7.5", "Z": "1"})
    'G0 X7.5Y-2 (X5)'
    """
    code = code_without_comments(line)
    for match in reversed(list(_WORD.finditer(code))):
        text = texts.get(match.group(1).upper())
        if text is not None:
            line = line[: match.start(2)] + text + line[match.end(2) :]
    return line


def replace_all_words(line: str, words: Sequence[str]) -> str:
    """Replace all words of a line, but keep its line number, comments and style.

    >>> replace_all_words("N10 G1X5Y2 (here)", ["G1", "X0", "Y1"])
    'N10 G1X0Y1 (here)'
    """
    start, stop, space = _word_range(line)
    inside = [match.group() for match in COMMENT.finditer(line, start, max(stop, start))]
    text = space.join(words)
    text = text.lower() if code_without_comments(line)[start:stop].islower() else text
    return line[:start] + " ".join([text, *inside]) + line[max(stop, start) :]


def format_value(value: float) -> str:
    """Format a number so that any controller accepts it: with a decimal point and without an exponent."""
    text = f"{round(value, 6) + 0.0:.6f}".rstrip("0")
    return text + "0" if text.endswith(".") else text


def format_length(mm: float, unit: float | None) -> str:
    """Format a length, given in mm, in program units. The unit is `unit` mm long, or 1 mm if it is None.

    >>> format_length(-25.4, 25.4)
    '-1.0'
    """
    return format_value(mm / (unit or 1.0))


def renumbered(lines: Sequence[tuple[str, bool]], longest: int) -> list[str]:
    """Renumber the lines of a program. The first line number and the step come from the program itself.

    `lines` contains pairs of a text and a flag for inserted lines. Inserted lines get a number. Original lines that had
    no number stay without one.

    Raises
    ------
    PostError
        The program jumps to a line number or has too many lines, or a line would be longer than `longest` characters.
    """
    found = [m for m in (_NUMBER.match(text) for text, _ in lines) if m]
    if not found:
        return [text for text, _ in lines]
    for text, _ in lines:
        if _JUMP.search(code_without_comments(text)):
            raise PostError("'{}' jumps to a line by its number; leave out --line-numbers", text.strip()[:40])
    numbers = sorted(int(m.group(2)) for m in found[:2])
    step = max(numbers[-1] - numbers[0], 1) if len(numbers) > 1 else 10
    count = sum(1 for text, new in lines if new or _NUMBER.match(text))
    first, step = (numbers[0], step) if numbers[0] + step * count <= _LAST_NUMBER else (1, 1)
    if count > _LAST_NUMBER:
        raise PostError(
            "the program has {} numbered lines, more than the N-numbers that exist; leave out --line-numbers", count
        )
    width = len(found[0].group(2)) if found[0].group(2).startswith("0") else 0
    result = []
    number = first
    for text, new in lines:
        match = _NUMBER.match(text)
        digits = f"{number:0{width}d}"
        if match:
            result.append(match.group(1) + digits + text[match.end() :])
        else:
            result.append(f"N{digits} {text}" if new else text)
        if len(result[-1].rstrip("\r\n")) > max(longest, len(text.rstrip("\r\n"))):
            raise PostError(
                "with its number, line {} is longer than {} characters; leave out --line-numbers", len(result), longest
            )
        number += step if match or new else 0
    return result
