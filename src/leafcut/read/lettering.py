"""Letters as single strokes for engraving: the Hershey font "Roman Simplex", identical on every machine.

Source of the strokes: A. V. Hershey, Calligraphy for Computers, NWL Report 2101 (1967), from the package Hershey-Fonts.
Accents, and the characters that a drawing writes as %%c, %%d and %%p, are composed here.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.message import Message

LetterLines = list[NDArray[np.float64]]

#: Base line and cap height, in font units; y points down.
_FOOT, _CAPITAL = 9.0, 21.0
#: Height of a lower-case letter above the base line.
_SMALL = 14.0
#: Accent strokes: x from the middle of the letter, y from its edge.
_ACCENTS: dict[str, list[list[tuple[float, float]]]] = {
    "\u0300": [[(-3, 6), (1, 3)]],
    "\u0301": [[(3, 6), (-1, 3)]],
    "\u0302": [[(-4, 3), (0, 6), (4, 3)]],
    "\u0303": [[(-5, 3), (-2, 5), (2, 3), (5, 5)]],
    "\u0308": [[(-4, 3), (-4, 4)], [(4, 3), (4, 4)]],
    "\u030a": [[(0, 2), (2, 4), (0, 6), (-2, 4), (0, 2)]],
    "\u030c": [[(-4, 6), (0, 3), (4, 6)]],
    "\u0327": [[(1, 0), (-1, -3), (2, -4), (0, -6), (-3, -6)]],
}
#: Letters composed of the strokes of two others.
_COMPOSITES = {"Ø": "O/", "ø": "o/", "±": "+_", "⌀": "O/", "∅": "O/"}
_SUBSTITUTES = {
    "–": "-",
    "—": "-",
    "−": "-",
    "’": "'",
    "‘": "'",
    "“": '"',
    "”": '"',
    "\u00a0": " ",
    "\t": " ",
    "ı": "i",
}


def letter_strokes(text: str) -> tuple[LetterLines, float]:
    """Return a line of text as strokes, float64[n, 2], and the width of the line. Coordinates are relative to the left
    end of the base line; the cap height is 1.

    Raises
    ------
    ValueError
        The font has no strokes for a letter; the message names the letter.
    """
    strokes: LetterLines = []
    x = 0.0
    for letter in unicodedata.normalize("NFC", text):
        lines, width = _letter(_SUBSTITUTES.get(letter, letter))
        strokes += [_shift(line, x) for line in lines]
        x += width
    return strokes, x


def _letter(letter: str) -> tuple[LetterLines, float]:
    if letter == "°":
        ring, width = _letter("o")
        return [_shift(0.5 * line, 0.0, 0.5) for line in ring], 0.6 * width
    if letter in _COMPOSITES:
        parts = [_letter(part) for part in _COMPOSITES[letter]]
        widest = max(width for _, width in parts)
        return [_shift(line, 0.5 * (widest - width)) for lines, width in parts for line in lines], widest
    base, *marks = list(unicodedata.normalize("NFD", letter))
    glyph = _font().get(base)
    if glyph is None or any(mark not in _ACCENTS for mark in marks):
        raise ValueError(Message("no strokes for '{}'", letter))
    left = glyph.left_offset
    strokes = [[(x - left, _FOOT - y) for x, y in stroke] for stroke in glyph.strokes]
    if base == "i" and marks:
        strokes = strokes[1:]  # the accent replaces the dot
    strokes += _accent_strokes(marks, 0.5 * glyph.char_width, _SMALL if base.islower() else _CAPITAL)
    return [np.array(stroke, dtype=np.float64) / _CAPITAL for stroke in strokes], glyph.char_width / _CAPITAL


def _shift(line: NDArray[np.float64], x: float, y: float = 0.0) -> NDArray[np.float64]:
    moved: NDArray[np.float64] = line + np.array([x, y])
    return moved


def _accent_strokes(marks: list[str], middle: float, head: float) -> Iterator[list[tuple[float, float]]]:
    for mark in marks:
        edge = 0.0 if mark == "\u0327" else head
        for stroke in _ACCENTS[mark]:
            yield [(middle + x, edge + y) for x, y in stroke]


@cache
def _font() -> dict[str, Any]:
    from HersheyFonts import HersheyFonts

    font = HersheyFonts()
    font.load_default_font("futural")
    return dict(font.all_glyphs)
