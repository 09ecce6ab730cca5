"""Digest in the header of a program or drawing: shows whether it was changed since leafcut wrote it."""

from __future__ import annotations

import hashlib
import re

_DIGITS = 16
#: Line of a header; `signed` fills in the digits.
DIGEST_LINE = f"leafcut digest {'0' * _DIGITS}"
_PLACE = re.compile(rf"(leafcut digest )([0-9]{{{_DIGITS}}})", re.IGNORECASE)
#: The digest is within this many characters from the start.
_HEADER = 20_000


def signed(text: str) -> str:
    """Return a program with its digest in the header; unchanged without a digest line."""
    place = _PLACE.search(text, 0, _HEADER)
    if place is None:
        return text
    start, end = place.span(2)
    empty = f"{text[:start]}{'0' * _DIGITS}{text[end:]}"
    return f"{text[:start]}{_digest(empty)}{text[end:]}"


def is_unchanged(text: str) -> bool:
    """Return whether a program or drawing has a digest and is unchanged since leafcut wrote it."""
    return _PLACE.search(text, 0, _HEADER) is not None and signed(text) == text


def _digest(text: str) -> str:
    # Decimal digits, because some controllers reject lower-case letters in comments.
    number = int.from_bytes(hashlib.sha256(text.encode("utf-8", "surrogateescape")).digest()[:8], "big")
    return f"{number % 10**_DIGITS:0{_DIGITS}d}"
