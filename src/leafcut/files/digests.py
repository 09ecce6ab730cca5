"""Add a header to a file with the command that wrote it, and with a digest that detects later edits."""

from __future__ import annotations

import hashlib
import re

_DIGITS = 16
#: Header line with a placeholder digest of zeros; `sign_program` replaces the zeros.
DIGEST_LINE = f"leafcut digest {'0' * _DIGITS}"
_FIRST_LINE = re.compile(r"\bleafcut \d[\w.+]* ([a-z][\w-]*)", re.IGNORECASE)
#: The first lines of the header of a program. The source and the part name the input, so they do not name the machine.
_MACHINE = re.compile(
    rf"{_FIRST_LINE.pattern}[^\n]*\n[^\n]*\bsource: [^\n]*\n(?:[^\n]*\bpart: [^\n]*\n)?[^\n]*\bmachine: "
    r"(?P<machine>[^\n]+?)\s*\)?\s*$",
    re.IGNORECASE | re.MULTILINE,
)
_PLACE = re.compile(rf"(leafcut digest )([0-9]{{{_DIGITS}}})", re.IGNORECASE)
#: Number of characters at the start of a file that are searched for the digest line.
_HEADER = 20_000


def fill_in_digest(text: str) -> str:
    """Fill in the digest of a program. A text without a digest line is returned unchanged."""
    place = _PLACE.search(text, 0, _HEADER)
    if place is None:
        return text
    start, end = place.span(2)
    empty = f"{text[:start]}{'0' * _DIGITS}{text[end:]}"
    return f"{text[:start]}{_digest(empty)}{text[end:]}"


def is_unchanged(text: str) -> bool:
    """Return whether the text has a digest that matches its content."""
    return _PLACE.search(text, 0, _HEADER) is not None and fill_in_digest(text) == text


def header_line(version: str, command: str) -> str:
    """Return the first line of a header."""
    return f"leafcut {version} {command}"


def command_in_header(text: str) -> str:
    """Return the command in the header, in lower case, or "" if the header has no command."""
    place = _FIRST_LINE.search(text, 0, _HEADER)
    return place[1].lower() if place else ""


def machine_in_header(text: str) -> str:
    """Return the machine that the header of a program names, or "" if leafcut did not write the header."""
    place = _MACHINE.search(text, 0, _HEADER)
    return place["machine"] if place else ""


def _digest(text: str) -> str:
    # Decimal digits, because some controllers reject lower-case letters in comments.
    number = int.from_bytes(hashlib.sha256(text.encode("utf-8", "surrogateescape")).digest()[:8], "big")
    return f"{number % 10**_DIGITS:0{_DIGITS}d}"
