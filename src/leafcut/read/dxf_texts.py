"""Convert TEXT and MTEXT of a DXF drawing to engraving strokes, with position, height, rotation, width and slant.

Letters are single strokes of the Hershey font "Roman Simplex", so they look identical on every machine. Source of the
strokes: A. V. Hershey, Calligraphy for Computers, NWL Report 2101 (1967), from the package Hershey-Fonts. This module
composes accents, and the characters that a drawing writes as %%c, %%d and %%p.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import printable
from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.read.dxf_strokes import DxfStroke, Letters, straight_polyline

#: Maximum number of letters of an engraving.
MOST_LETTERS = 2_000
#: Descender length, relative to the cap height.
_BELOW = 7.0 / 21.0
#: Line spacing of an MTEXT at factor 1, relative to the cap height (DXF reference, MTEXT, group 44).
_PITCH = 5.0 / 3.0
_BACKWARDS, _UPSIDE_DOWN = 2, 4

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
#: Letters that combine the strokes of two other letters.
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


def text_to_stroke(entity: Any) -> DxfStroke | None:
    """Convert a TEXT or MTEXT to strokes in the coordinates of its layout or block. Return None for other entities.

    If the font has no strokes for a letter, the text becomes a single point. The name of that point explains the
    problem.
    """
    kind = entity.dxftype()
    if kind not in ("TEXT", "MTEXT"):
        return None
    layer, handle = entity.dxf.get("layer", "0"), entity.dxf.get("handle") or ""
    try:
        lines = _text_lines(entity) if kind == "TEXT" else _mtext_lines(entity)
        problem = ""
    except ValueError as reason:
        lines, problem = [np.array([entity.dxf.insert.xyz, entity.dxf.insert.xyz])], str(reason)
    strokes = tuple(
        DxfStroke(kind, straight_polyline(line, closed=False), layer, handle, problem, "text") for line in lines
    )
    return DxfStroke(kind, Letters(strokes), layer, handle, problem, "text")


def _text_strokes(text: str) -> tuple[list[Floats], float]:
    if len(text) > MOST_LETTERS:
        raise ValueError(Message("a text of {:,} letters", len(text)))
    try:
        return text_line_strokes(text)
    except ValueError as problem:
        raise ValueError(f"'{printable(text)}': {problem}") from None


def _text_lines(entity: Any) -> list[Floats]:
    dxf = entity.dxf
    lines, width = _text_strokes(entity.plain_text())
    height, stretch = float(dxf.get("height", 1.0)), float(dxf.get("width", 1.0))
    turn, slant = math.radians(dxf.get("rotation", 0.0)), math.tan(math.radians(dxf.get("oblique", 0.0)))
    align, first, second = entity.get_placement()
    origin, name = np.array(first.xyz), align.name
    if name in ("ALIGNED", "FIT"):
        step = np.array(second.xyz) - origin
        turn, span = math.atan2(step[1], step[0]), math.hypot(step[0], step[1])
        if width > 0.0 and name == "ALIGNED":
            height = span / (width * stretch)
        elif width > 0.0:
            stretch = span / (width * height)
    left = -0.5 if name in ("CENTER", "MIDDLE") or name.endswith("_CENTER") else -1.0 if name.endswith("RIGHT") else 0.0
    low = -1.0 if name.startswith("TOP") else -0.5 if name.startswith("MIDDLE") else 0.0
    low = _BELOW if name.startswith("BOTTOM") else low
    flags = int(dxf.get("text_generation_flag", 0))
    signs = (-1.0 if flags & _BACKWARDS else 1.0, -1.0 if flags & _UPSIDE_DOWN else 1.0)
    strokes = []
    for line in lines:
        x = (line[:, 0] + left * width) * stretch + slant * line[:, 1]
        strokes.append(_rotated(np.column_stack([signs[0] * x, signs[1] * (line[:, 1] + low)]) * height, turn))
    ocs = entity.ocs()
    return [np.array([ocs.to_wcs((x + origin[0], y + origin[1], origin[2])) for x, y in line]) for line in strokes]


def _mtext_lines(entity: Any) -> list[Floats]:
    dxf = entity.dxf
    height, wrap_width = float(dxf.get("char_height", 1.0)), float(dxf.get("width", 0.0))
    rows = [
        row
        for line in entity.plain_text(split=True)
        for row in _wrap_line(line, wrap_width / height if height else 0.0)
    ]
    pitch = _PITCH * float(dxf.get("line_spacing_factor", 1.0))
    total_height = 1.0 + pitch * (len(rows) - 1)
    attachment = int(dxf.get("attachment_point", 1)) - 1
    top = (0.0, 0.5 * total_height, total_height)[attachment // 3 % 3]
    across = (0.0, -0.5, -1.0)[attachment % 3]
    turn, origin = math.radians(entity.get_rotation()), np.array(dxf.insert.xyz)
    # An MTEXT seen from below is mirrored.
    side = -1.0 if dxf.get("extrusion") is not None and dxf.extrusion.z < 0.0 else 1.0
    strokes = []
    for number, row in enumerate(rows):
        lines, width = _text_strokes(row)
        shift = (across * width, top - 1.0 - number * pitch)
        strokes += [_rotated((line + shift) * height, turn) for line in lines]
    return [
        np.column_stack([side * line[:, 0] + origin[0], line[:, 1] + origin[1], np.full(len(line), origin[2])])
        for line in strokes
    ]


def _wrap_line(line: str, max_width: float) -> list[str]:
    """Wrap a line of text at `max_width`, which is a multiple of the cap height. A width of 0 disables wrapping."""
    if not max_width > 0.0:
        return [line]
    rows: list[list[str]] = []
    width = 0.0
    for word in line.split(" "):
        extended = width + _text_strokes(f" {word}")[1]
        if rows and extended <= max_width:
            rows[-1].append(word)
            width = extended
        else:
            rows.append([word])
            width = _text_strokes(word)[1]
    return [" ".join(row) for row in rows]


def _rotated(points: Floats, angle: float) -> Floats:
    cos, sin = math.cos(angle), math.sin(angle)
    turned: Floats = points @ np.array([[cos, sin], [-sin, cos]])
    return turned


def text_line_strokes(text: str) -> tuple[LetterLines, float]:
    """Convert a line of text to strokes, float64[n, 2], and return them with the width of the line.

    The origin is the left end of the base line, and the cap height is 1.

    Raises
    ------
    ValueError
        The font has no strokes for a letter; the message names the letter.
    """
    strokes: LetterLines = []
    x = 0.0
    for letter in unicodedata.normalize("NFC", text):
        lines, width = _letter_strokes(_SUBSTITUTES.get(letter, letter))
        strokes += [line + np.array([x, 0.0]) for line in lines]
        x += width
    return strokes, x


def _letter_strokes(letter: str) -> tuple[LetterLines, float]:
    if letter == "°":
        ring, width = _letter_strokes("o")
        return [0.5 * line + np.array([0.0, 0.5]) for line in ring], 0.6 * width
    if letter in _COMPOSITES:
        parts = [_letter_strokes(part) for part in _COMPOSITES[letter]]
        widest = max(width for _, width in parts)
        return [line + np.array([0.5 * (widest - width), 0.0]) for lines, width in parts for line in lines], widest
    base, *marks = list(unicodedata.normalize("NFD", letter))
    glyph = _stroke_font().get(base)
    if glyph is None or any(mark not in _ACCENTS for mark in marks):
        raise ValueError(Message("no strokes for '{}'", letter))
    left = glyph.left_offset
    strokes = [[(x - left, _FOOT - y) for x, y in stroke] for stroke in glyph.strokes]
    if base == "i" and marks:
        strokes = strokes[1:]  # the accent replaces the dot
    strokes += _accent_strokes(marks, 0.5 * glyph.char_width, _SMALL if base.islower() else _CAPITAL)
    return [np.array(stroke, dtype=np.float64) / _CAPITAL for stroke in strokes], glyph.char_width / _CAPITAL


def _accent_strokes(marks: list[str], middle: float, head: float) -> Iterator[list[tuple[float, float]]]:
    for mark in marks:
        edge = 0.0 if mark == "\u0327" else head
        for stroke in _ACCENTS[mark]:
            yield [(middle + x, edge + y) for x, y in stroke]


@cache
def _stroke_font() -> dict[str, Any]:
    from HersheyFonts import HersheyFonts

    font = HersheyFonts()
    font.load_default_font("futural")
    return dict(font.all_glyphs)
