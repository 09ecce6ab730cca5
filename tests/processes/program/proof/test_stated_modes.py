"""The words of a safe-start line: which work relies on each, and where a program must state it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from leafcut.gcode.program import Program
from leafcut.model.difference import Difference
from leafcut.processes.program.proof.certificate import find_lost_modes
from leafcut.processes.program.proof.program_work import read_work
from rewriting import program_of

#: Mode → its words (_ for a blank), the letters of the lines of `WORK` that rely on it, and whether few controllers
#: know it.
MODES: dict[str, tuple[str, str, bool]] = {
    "the distance mode (G90, G91)": ("G90 G91 G090 g9_0", "RFAD", False),
    "the plane (G17)": ("G17 G18 G19", "AD", False),
    "radius compensation off (G40)": ("G40 G41 G42 G41.1 G42.1", "RFAD", False),
    "the feed mode (G94)": ("G93 G94 G95", "FAD", False),
    "the arc distance mode (G91.1)": ("G90.1 G91.1", "A", False),
    "the return of cycles (G98, G99)": ("G98 G99", "D", False),
    "the length offset (G43, G49)": ("G43 G44 G49 G43.1 G49.2", "RFAD", False),
    "the work offset (G54)": ("G54 G55 G59 G54.1 G59.9 G154 G110 G119 G120 G129", "RFAD", False),
    "constant surface speed off (G97)": ("G96 G97", "FAD", False),
    "rotation off (G69)": ("G68 G69 G68.2 G69.1", "RFAD", True),
    "scaling off (G50)": ("G50 G51", "RFAD", True),
    "mirroring off (G50.1)": ("G50.1 G51.1", "RFAD", True),
    "polar coordinates off (G15)": ("G15 G16", "RFAD", True),
    "macro calls off (G67)": ("G66 G67 G66.1 G67.1", "RFAD", True),
    "the shift of the origin (G92.1)": ("G92 G92.1 G92.2 G92.3", "RFAD", True),
}
#: Lines 2 to 6: a rapid, a feed move, an arc, a rapid and a hole.
WORK = "G21 / G0 X0 Y0 Z5 / G1 Z-1 F100 / G2 X10 Y0 I5 J0 / G0 Z5 / G81 X20 Y0 Z-1 R1 / G80 / M2"
LETTERS = dict(enumerate("RFARD", 2))
#: Words of no mode, or of the modes that all programs state again.
OTHERS = "G0 G00 G1 G2 G3 G4 G10 G20 G21 G28 G53 G64 G80 G81 G900 G171 G940 G17.5 G9"


def with_words(program: Program, line: int, words: str) -> Program:
    """Return a program with words in the text of a line; 0 for none."""
    return replace(program, lines=[f"{text} {words}" if k == line else text for k, text in enumerate(program.lines, 1)])


def stated(original: Program, new: Program) -> list[Difference]:
    works = tuple(read_work(program, written_out=False, beam=False) for program in (original, new))
    return list(find_lost_modes((original, new), works, np.arange(len(works[0].features)), {}))  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", MODES)
def test_a_mode_is_stated_before_the_first_line_that_relies_on_it(mode: str) -> None:
    words, letters, rare = MODES[mode]
    program = program_of(WORK)
    first = next(line for line, letter in LETTERS.items() if letter in letters)
    for word in [word.replace("_", " ") for word in words.split()]:
        (gone,) = stated(with_words(program, 1, word), program)
        reason = f"states this mode before line {first}, which relies on it; the"
        text = f"{mode}: the original {reason} new program does not"
        assert gone == Difference("not stated", first, first, text), word
        added = stated(program, with_words(program, 1, word))
        text = f"{mode}: the new program {reason} original does not"
        assert added == [Difference("newly stated", first, first, text)] * rare, word


def cuts_before(line: int, letters: str) -> int:
    """Return the cuts that rely on a mode before its word in a line; 0 if it comes before all such lines."""
    first = next(number for number, letter in LETTERS.items() if letter in letters)
    if line <= first:
        return 0
    return sum(letter in letters and letter != "R" for number, letter in LETTERS.items() if number < line)


@pytest.mark.parametrize("mode", MODES)
def test_no_more_cuts_come_before_a_word_than_in_the_original(mode: str) -> None:
    words, letters, rare = MODES[mode]
    program, word = program_of(WORK), words.split()[0]
    first = next(line for line, letter in LETTERS.items() if letter in letters)
    for was in (1, 3, 5, 8):
        for now in (1, 3, 5, 8):
            found = [one.what for one in stated(with_words(program, was, word), with_words(program, now, word))]
            late = (now > first >= was) or cuts_before(now, letters) > cuts_before(was, letters)
            newly = rare and was > first >= now
            assert found == ["not stated"] * late + ["newly stated"] * newly, (was, now)


@pytest.mark.parametrize("word", [*OTHERS.split(), "M17", "(G17)", "G 1 7 9"])
def test_another_word_states_no_mode(word: str) -> None:
    program = program_of(WORK)
    assert stated(with_words(program, 1, word), program) == []


@pytest.mark.parametrize("mode", MODES)
def test_an_unknown_block_may_rely_on_every_mode(mode: str) -> None:
    program = program_of(f"G21 / M199 / {WORK.removeprefix('G21 / ')}")
    word = MODES[mode][0].split()[0]
    (gone,) = stated(with_words(program, 1, word), program)
    assert (gone.what, gone.original, gone.new) == ("not stated", 2, 2) and gone.text.startswith(mode)
