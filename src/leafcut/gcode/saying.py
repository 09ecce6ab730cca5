"""What a block says, in values: for blocks that a proof must compare though their doing is not known.

    A[#3+90]        A93.
    G65 P100 A5.    G65 P100. A5. and the text behind the end of the program, where O100 may be
    (MSG, turn it)  itself, and the comments behind it

Two such blocks are the same only if all that they read is: their words by value, the parameters that a macro of the
controller may read, the text that they call, their messages.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import Block, Word, split_line

#: A comment that stops the program with an error. Source: LinuxCNC 2.9, `convert_comment`; seen with rs274.
_STOP = re.compile(r"abort[ \t]*,", re.IGNORECASE)
#: Comments that run something, write a record, or show a text, of any controller: a program may be read in the wrong
#: dialect. docs/programs.md lists the controllers and sources.
_ACTION = re.compile(
    r"(?:debug|print|log|logopen|logappend|py|pyrun|axis|preview)[ \t]*,"
    r"|(?:msg|logclose|probeopen|probeclose|pyreload)(?![a-z0-9_])|\{",
    re.IGNORECASE,
)
#: Words of Fanuc and Haas that show the comment of their line to a person: alarm, stop, question.
_PROMPT = re.compile(r"#[ \t]*300[06][ \t]*=|M[ \t]*0*109(?![0-9.])", re.IGNORECASE)
#: M words of LinuxCNC that call no macro: what they do is not known here, but what they read is in their words.
_PLAIN_M = frozenset({19, *range(48, 54), 60, 61, *range(62, 69), 190})
_END = re.compile(r"M0*(?:2|30|99)(?![0-9.])")
_SUB = re.compile(r"O([0-9]+|<[^<>]*>)(SUB|ENDSUB)")
_COMMENT = re.compile(r"\([^()]*\)|;.*")
_NUMBER = re.compile(r"^(/?)N[0-9]+")


def is_obeyed(comment: str) -> bool:
    """Return whether some controller acts on a comment, given without its parentheses or semicolon."""
    return bool(_STOP.match(comment) or _ACTION.match(comment))


def may_stop(comments: Iterable[str]) -> bool:
    """Return whether one of these comments may stop the program."""
    return any(_STOP.match(comment) for comment in comments)


def obeyed_among(comments: Sequence[str]) -> list[str]:
    """Return the comments of a block from the first that a controller acts on.

    Those behind it count, too: of several comments in a block LinuxCNC obeys the last one only.
    """
    first = next((at for at, comment in enumerate(comments) if is_obeyed(comment)), len(comments))
    return list(comments[first:])


def shown_comments(line: str, dialect: Dialect) -> list[str]:
    """Return the comments of a line that its controller acts on, or shows beside an alarm, a stop or a question."""
    if "(" not in line and ";" not in line:
        return []
    comments = split_line(line, nested=True)[1]
    return list(comments) if dialect.groups == "fanuc" and _PROMPT.search(line) else obeyed_among(comments)


def say(block: Block, obeyed: Sequence[str], parameters: str | None, called: str, dialect: Dialect) -> str:
    """Return what a block says: its words by value, what is obeyed, and digests of what else it reads.

    `parameters` are those that a macro or a message may read, None where there is none.
    Where a number without a decimal point may be in other units than one with it, these are two.
    """
    points = dialect.groups == "fanuc"
    words = [
        f"{w.letter}{_number(w.value)}" + ("." if points and "." in w.text else "")
        for w in block.words
        if w.letter not in "NO"
    ]
    said = ["/"] * block.deleted + words + [" ".join(text.split()) for text in obeyed]
    said += [f"[parameters {parameters}]"] * (parameters is not None) + [f"[calls {called}]"] * bool(called)
    return " ".join(said)


#: What stands in brackets behind the words, and what is meant by it.
_READS = {
    "parameters": "a parameter that it may read has another value",
    "calls": "the text of a subprogram that it may call has changed",
    "again": "what it may run once more has changed",
}
_DIGEST = re.compile(r" ?\[(parameters|calls|again) ([^\]]*)\]")


def in_words(said: str) -> str:
    """Return what a block says as a person may read it: without the digests of what else it reads."""
    return _DIGEST.sub("", said)


def reads_differently(one: str, other: str) -> list[str]:
    """Return what else two blocks read that is not the same, in words; they say what they say in `say`'s words."""
    left, right = (dict(_DIGEST.findall(said)) for said in (one, other))
    return [words for name, words in _READS.items() if left.get(name) != right.get(name)]


def may_read_parameters(unknown: Iterable[Word], obeyed: Sequence[str], dialect: Dialect) -> bool:
    """Return whether a block may read parameters that are not in its words: in a macro, or in its message."""
    plain_m = _PLAIN_M if dialect.groups == "rs274" else ()
    macro = any(w.letter != "M" or w.value not in plain_m for w in unknown)
    return macro or any("#" in text or "%" in text or text[:2].lower() == "py" for text in obeyed)


def _number(value: float) -> str:
    # To nine digits behind the point: what is nearer no machine tells apart, and sums are never exact.
    return f"{round(value, 9) + 0.0:.12g}"


def text_behind(lines: Sequence[str], dialect: Dialect) -> str:
    """Return a digest of the text behind the end of a program and of its subroutines (o… sub), "" where there is none.

    Whatever a block calls that is not understood stands there, be its number said, computed or the controller's own.
    """
    kept, ended, began, sub = [], False, False, ""
    for line in lines:
        text = as_read(line, dialect)
        word = _SUB.match(text)
        if word is not None and not sub and word.group(2) == "SUB":
            sub = word.group(1)
        if (ended or sub) and text not in ("", "%"):
            kept.append(text)
        if word is not None and word.group(1) == sub and word.group(2) == "ENDSUB":
            sub = ""
        ended = ended or (began and text.startswith("%")) or (not sub and _END.search(text) is not None)
        began = began or bool(text)
    return hashlib.sha256("\n".join(kept).encode()).hexdigest()[:16] if kept else ""


class Stretches:
    """Tells stretches of lines apart, each at once, however many and long they are.

    A number is kept of all lines up to each one, made of those before it (Rabin and Karp 1987); a line goes into it as
    the digest of its text, and one that says nothing not at all.
    """

    _BASE, _PRIME = 0x1E3779B97F4A7C15F39CC0605CEDC835, 2**127 - 1

    def __init__(self, texts: Iterable[str]) -> None:
        self._upto, self._count = [0], [0]
        for text in texts:
            own = int.from_bytes(hashlib.sha256(text.encode()).digest()[:15], "big")
            last = self._upto[-1]
            self._upto.append((last * self._BASE + own) % self._PRIME if text else last)
            self._count.append(self._count[-1] + bool(text))

    def between(self, first: int, last: int) -> str:
        """Return what no other stretch has than the one from one line to another, both with it."""
        count = self._count[last + 1] - self._count[first]
        value = self._upto[last + 1] - self._upto[first] * pow(self._BASE, count, self._PRIME)
        return f"{count}:{value % self._PRIME:032x}"


def as_read(line: str, dialect: Dialect) -> str:
    """Return a line as far as it means anything to its controller: to a Fagor statements in parentheses do."""
    return "".join(line.split()).upper() if dialect.cycle_words == "fagor" else plain(line)


def plain(line: str) -> str:
    """Return a line as far as it means anything: no number, no comment, no spaces, letters large."""
    return _NUMBER.sub(r"\1", "".join(_COMMENT.sub("", line).split()).upper())
