"""Canned cycles with words that they need, and with those that they do not: every hole counts, in every dialect."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.certificate import certify
from rs274_moves import PRINTED, assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274

CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85", "G86", "G89")
WORDS = ("", "P500", "Q2.", "P500 Q2.", "Q2. P500 L2", "S90", "L2")


def program(cycle: str, words: str, name: str) -> Program:
    """Three holes; with L, the first is drilled again. Required words of the cycle are added."""
    needed = {"G82": "P500", "G83": "Q2.", "G73": "Q2."}.get(cycle, "")
    words = words if needed[:1] in words else f"{words} {needed}"
    if name == "linuxcnc":
        words = words.replace("P500", "P.5")
    text = (
        f"G21 G90 G17 G94 F100.\nM3 S100\nG0 X0. Y0. Z10.\nG99 {cycle} X1. Y1. Z-5. R1. {words}\nX2.\nX3.\nG80\nM30\n"
    )
    return interpret_program(text, load_dialect(name))


@pytest.mark.parametrize("name", ["linuxcnc", "fanuc", "haas", "mach3", "mach4"])
@pytest.mark.parametrize("cycle", CYCLES)
def test_every_hole_counts_whatever_words_the_first_one_has(cycle: str, name: str) -> None:
    """Four of five were left out where a word was of no use to its cycle; down 6 mm from R at each, by hand."""
    for words in WORDS:
        found = program(cycle, words, name).path
        holes = 4 if "L2" in words else 3
        assert (found.kind == Kind.DRILL).sum() == holes, words
        assert Kind.FOREIGN not in found.kind, words
        moves = expand_cycles(found)
        down = moves.kind == Kind.FEED
        assert moves.end[down, 2].min() == -5.0
        assert sum(z == -5.0 for z in moves.end[down, 2]) == holes


def test_what_linuxcnc_takes_is_drilled_as_there(rs274: str, tmp_path: Path) -> None:
    """Every cycle with every set of words that rs274 does not refuse."""
    taken = 0
    for cycle in CYCLES:
        for words in WORDS:
            ours = program(cycle, words, "linuxcnc")
            status, output = run_rs274(rs274, "".join(ours.lines), tmp_path)
            if status == 0:
                taken += 1
                assert_same_moves(moves_of_toolpath(ours.path), moves_of_rs274(output), PRINTED["mm"])
    assert taken >= 20


@pytest.mark.parametrize("words, changed", [("P500", "P600"), ("Q2.", "Q3."), ("P500 Q2.", "P500"), ("", "Q1.")])
def test_a_word_of_no_use_to_its_cycle_counts_in_the_proof(words: str, changed: str) -> None:
    """Some controls dwell, or peck, where others do not."""
    one, other = (program("G85", said, "haas") for said in (words, changed))
    assert not certify(one, other).same


@pytest.mark.parametrize(
    "first, dialect_name",
    [
        ("G83 X1. Y1. Z-5. R1. I3. J1. K1.", "haas"),
        ("G83 X1. Y1. Z-5. R1.", "fanuc"),
        ("G83 X1. Y1. Z-5. R1. Q2000", "fanuc"),
        ("G81 X1. Y1. Z-5. R1. E1.", "haas"),
    ],
)
def test_a_cycle_whose_words_are_not_understood_is_kept_until_the_next_one_is_called(
    first: str, dialect_name: str
) -> None:
    """Its holes too, which take those words from it."""
    text = f"G21 G90 G17 G94 F100.\nG0 X0. Y0. Z10.\nG99 {first}\nX2. Y1.\nG81 X3. Y1. Z-1. R1.\nX4.\nG80\nM30\n"
    path = interpret_program(text, load_dialect(dialect_name)).path
    assert path.line[path.kind == Kind.FOREIGN].tolist() == [3, 4]
    assert path.line[path.kind == Kind.DRILL].tolist() == [5, 6]
