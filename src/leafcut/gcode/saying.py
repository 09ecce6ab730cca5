"""What a block says, in values: for blocks that a proof must compare though their doing is not known.

    A[#3+90]        A93.
    G65 P100 A5.    G65 P100. A5. and the text of O100, and of what that calls
    (MSG, turn it)  itself

Two such blocks are the same only if all that they read is: their words by value, the parameters that a macro of the
controller may read, the text that they call, their messages.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.words import Block, Word

#: What LinuxCNC does not skip: messages, records, and Python behind a semicolon.
_MESSAGE = re.compile(
    r"(?:msg|debug|print|log|logopen|logappend|py)[ \t]*,|(?:logclose|probeclose)[ \t]*$|probeopen\b", re.IGNORECASE
)
#: M words of LinuxCNC that call no macro: what they do is not known here, but what they read is in their words.
_PLAIN_M = frozenset({19, *range(48, 54), 60, 61, *range(62, 69), 190})
_CALL = re.compile(r"(?:G0*(?:65|66|66\.1|150)(?![0-9.])|M0*(?:98|198)(?![0-9.])).*?P0*([0-9]{1,8})")
_LABEL = re.compile(r"[ \t]*[oO:][ \t]*0*([0-9]{1,8})(?![0-9.])")
_COMMENT = re.compile(r"\([^()]*\)|;.*")
_NUMBER = re.compile(r"^(/?)N[0-9]+")


def messages(comments: Iterable[str]) -> list[str]:
    """Return the comments that show a message or write a record."""
    return [comment for comment in comments if _MESSAGE.match(comment)]


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


def may_read_parameters(unknown: Iterable[Word], obeyed: Sequence[str], dialect: Dialect) -> bool:
    """Return whether a block may read parameters that are not in its words: in a macro, or in its message."""
    plain_m = _PLAIN_M if dialect.groups == "rs274" else ()
    macro = any(w.letter != "M" or w.value not in plain_m for w in unknown)
    return macro or any("#" in text or "%" in text or text[:2].lower() == "py" for text in obeyed)


def _number(value: float) -> str:
    # To nine digits behind the point: what is nearer no machine tells apart, and sums are never exact.
    return f"{round(value, 9) + 0.0:.12g}"


def called_text(lines: Sequence[str], line: str) -> str:
    """Return a digest of the subprograms of the file that a line calls (G65, G66, G150, M98), and of those they call.

    "" where it calls none, or none that is in the file.
    """
    wanted = [int(n) for n in _CALL.findall(plain(line))]
    if not wanted:
        return ""
    starts: dict[int, int] = {}
    for at, text in enumerate(lines):
        found = _LABEL.match(text)
        if found:
            starts.setdefault(int(found.group(1)), at)
    texts: dict[int, str] = {}
    while wanted:
        number = wanted.pop()
        if number in texts or number not in starts:
            continue
        texts[number] = text = _subprogram(lines, starts[number])
        wanted += [int(n) for n in _CALL.findall(text)]
    return hashlib.sha256(repr(sorted(texts.items())).encode()).hexdigest()[:16] if texts else ""


def _subprogram(lines: Sequence[str], start: int) -> str:
    """Return the text of a subprogram, from its label to the next one, as far as it means anything."""
    kept = [plain(lines[start])]
    for line in lines[start + 1 :]:
        text = plain(line)
        if text.startswith("%") or _LABEL.match(line):
            break
        if text:
            kept.append(text)
    return "\n".join(kept)


def plain(line: str) -> str:
    """Return a line as far as it means anything: no number, no comment, no spaces, letters large."""
    return _NUMBER.sub(r"\1", "".join(_COMMENT.sub("", line).split()).upper())
