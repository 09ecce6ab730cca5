"""Whole tables of the readers: the keys of profiles and libraries, and the letters that are engraved.

`tables/` has each table as text. The keys are those of the manual; the strokes were checked by eye in a drawing.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from leafcut.read.controllers.importing import KINDS
from leafcut.read.controllers.questions import QUESTIONS
from leafcut.read.lettering import letters
from leafcut.read.machine_keys import PROFILE_KEYS
from leafcut.read.tool_keys import HOLE_KEYS, TOOL_KEYS
from plain_text import number, text_of

TABLES = Path(__file__).parent / "tables"

#: One letter for each accent, each composed letter and each substitute, and letters of different heights.
LETTERS = "ag1ÀàÁáÂâÃãÄäÅåČčÇçìíïØø±⌀∅°–—−’‘“”\u00a0\tı"


def stroke_text(letter: str) -> str:
    """Return the strokes of a letter between two others, in units of the font: 21 to the height of a capital."""
    strokes, width = letters(f"I{letter}I")
    lines = [" ".join(f"{number(21 * x)},{number(21 * y)}" for x, y in stroke) for stroke in strokes]
    return f"{letter!a}: width {number(21 * width)}: {'; '.join(lines)}"


TEXTS: dict[str, Callable[[], list[str]]] = {
    "profile keys": lambda: [text_of(key) for key in PROFILE_KEYS],
    "tool keys": lambda: [text_of(key) for key in (*TOOL_KEYS, *HOLE_KEYS)],
    "questions": lambda: [text_of(question) for question in QUESTIONS],
    "kinds of settings": lambda: [f"{name}: {kind.name}, {kind.help}" for name, kind in KINDS.items()],
    "letters": lambda: [stroke_text(letter) for letter in LETTERS],
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_table_is_the_one_that_was_checked(name: str) -> None:
    assert TEXTS[name]() == (TABLES / f"{name}.txt").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("letter", ["я", "ĕ"])
def test_a_letter_without_strokes_is_named(letter: str) -> None:
    with pytest.raises(ValueError, match=f"^no strokes for '{letter}'$"):
        letters(f"a{letter}")
