"""What foreign programs may hold that cannot be meant: one clear line with its place, soon, and never a crash."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import OptionError, ReadError
from leafcut.gcode import canned, interpreter
from leafcut.gcode import control_flow as flow
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program

HEAD = "G21 G90 G17 F100\nG0 X0 Y0 Z10\n"

#: The lines after the header, the number of the faulty line (from 1), and the message.
FAULTS = [
    ("G1 X5 ?", 3, "unexpected character '?'"),
    ("G1 X5\nG1 X", 4, "'X' is a letter without a number"),
    ("G1 5", 3, "number without a letter"),
    ("D1231230213", 3, "the number of D is out of range: 1,000,000,000 or more; correct or delete this word"),
    ("#1=2000000000\nG1 X#1", 4, "the number of X is out of range"),
    ("#1=3\nWHILE [#1 GT 0] DO1", 4, "a loop (WHILE … DO) has no END"),
    ("N5 while[#1 gt 0]do 1", 3, "a loop (WHILE … DO) has no END"),
    ("GOTO 10", 3, "no such line"),
    ("IF [1 GT 0] GOTO 10", 3, "no such line"),
    ("IF [1 GT 0] G1 X5", 3, "needs its GOTO or THEN"),
    ("DO 1", 3, "a loop (WHILE … DO) has no END"),
    ("END1", 3, "END has no WHILE … DO before it"),
    ("G1 X5 (go", 3, "not closed"),
    ("G1 X1 X2", 3, "X is given twice"),
    ("G1 G2 X1", 3, "G1 and G2 exclude each other"),
    ("M3 M5", 3, "exclude each other"),
    ("G2 X10 Y0 I4", 3, "does not end on its circle: its radius is 4.0000 mm at the start and 6.0000 mm at the end"),
    ("G2 X10 Y0 R2", 3, "too small to reach"),
    ("G2 X10", 3, "an arc needs I and J, or R"),
    ("F0\nG1 X5", 4, "the cut has no feed"),
    ("G93\nG1 X5", 4, "needs its own F"),
    (
        "G1 X2 A5\nG93\nG1 X5 F2",
        5,
        (
            "a cut in inverse time (G93) needs a known length, but line 3 moves the rotary axis A, and leafcut does "
            "not read programs with four or five axes"
        ),
    ),
    ("G80\nX5", 4, "without G0, G1"),
    ("G81 X1 Z-1", 3, "lacks R"),
    ("G82 X1 Z-1 R1", 3, "needs its dwell"),
    ("G83 X1 Z-1 R1", 3, "needs a peck"),
    ("G81 X1 Z5 R1", 3, "drills upwards"),
    ("G81 X1 Z-1 R1\nG20 X1", 4, "units changed inside a cycle"),
    ("G20 F5", 3, "the block changes the units and sets F"),
    ("G92", 3, "no axis word"),
    ("G10 L2 X1", 3, "needs P"),
    ("G52", 3, "G52 has no axis word"),
    ("G92 X1 G1", 3, "only one set of axis words"),
    ("M98 P1\nM2\nO1\nG1 X1", 5, "has no end (M99)"),
    ("O5\nO6", 3, "another program starts"),
    ("o1 sub\no1 call", 3, "is not closed"),
    ("o1 if [1]\nG1 X1", 3, "'if' is not closed"),
    ("o1 repeat [3]\nG1 X1", 3, "'repeat' is not closed"),
    ("o1 endif", 3, "has no matching start"),
    ("o1 while [1\no1 endwhile", 3, "']' is missing"),
    ("o1 jump", 3, "'jump' is a letter without a number"),
    ("o<a> jump", 3, "not an O-word of LinuxCNC"),
    ("o#1 call", 3, "number is computed"),
    ("o1 call extra\no1 sub\no1 endsub", 3, "after 'call'"),
    ("#1", 3, "'=' is expected"),
    ("# 4mm square outline", 3, "if # starts a comment, put it in ( )"),
    ("#<_x>=3", 3, "cannot be set"),
    ("G1 X#<depth>", 3, "#<depth> is used"),
    ("G1 X[1/0]", 3, "/ of 1 and 0 has no value"),
    ("G1 X5000000000", 3, "out of range"),
    ("G1 X[2**40]", 3, "out of range"),
    ("T1.5 M6", 3, "whole number"),
    ("G4", 3, "G4 needs its time"),
    ("<html>", 3, "unexpected character '<'"),
    ("Heidenhain L X+10 R0 FMAX", 3, "'Heidenhain L' is a letter without a number"),
    ("\x00\x01", 3, "unexpected character"),
    ("Grüße", 3, "is a letter without a number"),
]


@pytest.mark.parametrize("lines, line, part", FAULTS)
def test_what_cannot_be_meant_is_refused_with_its_line(lines: str, line: int, part: str) -> None:
    """File, line and what is wrong, in one line."""
    with pytest.raises(ReadError) as caught:
        interpret_program(HEAD + lines + "\nG0 X1\n", load_dialect("linuxcnc"), "part.nc")
    said = str(caught.value)
    assert said.startswith(f"part.nc:{line}: ") and part in said
    assert "\n" not in said and len(said) < 250


@pytest.mark.parametrize(
    "text", ["Dear reader,\nthis is a letter.", "{\n}", "1,2,3\n", "  0\nSECTION\n", "M48\nMETRIC\n"]
)
def test_a_text_that_is_no_program_is_refused_at_its_first_such_line(text: str) -> None:
    """A letter, JSON, a table, a drawing, a drill file."""
    with pytest.raises(ReadError) as caught:
        interpret_program(text, load_dialect("linuxcnc"), "x.txt", units="mm")
    assert caught.value.line in (1, 2)


def test_an_unknown_unit_is_an_error_of_the_option() -> None:
    """Not of the file."""
    with pytest.raises(OptionError, match="unknown unit"):
        interpret_program("M2", load_dialect("linuxcnc"), units="furlong")


@pytest.mark.parametrize(
    "lines",
    [
        "#1=0\no1 while [1]\n#1=[#1+1]\no1 endwhile",
        "#1=0\no1 do\n#1=[#1+1]\no1 while [1]",
        "o1 repeat [99999999]\nG1 X1\no1 endrepeat",
        "o2 sub\n#31=[#31+1]\no2 endsub\n#31=0\no1 while [1]\no2 call\no1 endwhile",
        "#1=0\nN1 G1 X1\n#1=[#1+1]\nGOTO 1",
        "M97 P5 L9999\nM2\nN5 M97 P6 L9999\nM99\nN6 G91 G1 X1\nM99",
        "M98 P1 L9999\nM2\nO1\nM98 P2 L9999\nM99\nO2\nG91 G1 X1\nM99",
    ],
)
def test_an_endless_loop_is_refused(monkeypatch: pytest.MonkeyPatch, lines: str) -> None:
    """Whatever turns round: blocks that are run again are counted."""
    monkeypatch.setattr(flow, "MAX_REPEATED", 2_000)
    with pytest.raises(ReadError, match="endless"):
        interpret_program(HEAD + lines, load_dialect("linuxcnc"))


@pytest.mark.parametrize(
    "lines",
    [
        "o1 while [1]\no1 endwhile",
        "o1 do\nG1 X1\no1 while [1]",
        "#3=0\no1 while [#3 LT 3]\nG91 G1 X1\nG90\no1 endwhile",
        "o1 while [1]\nG1 X1\no1 continue\no1 endwhile",
        "o2 sub\no2 endsub\no1 while [1]\no2 call\no1 endwhile",
        "N1 G1 X1\nGOTO 1",
        "WHILE [1 EQ 1] DO 1\nG1 X1\nEND 1",
        "DO 2\nG1 X1\nEND 2",
    ],
)
def test_a_loop_in_which_no_parameter_changes_is_refused_at_once(lines: str) -> None:
    """Only parameters decide how a program continues. If they are unchanged after an iteration, the loop never ends."""
    with pytest.raises(ReadError, match=r"program:\d+: this loop is endless: no parameter changes"):
        interpret_program(HEAD + lines, load_dialect("linuxcnc"))


@pytest.mark.parametrize(
    "lines",
    [
        "#1=0\no1 while [#1 LT 3]\nG1 X#1\n#1=[#1+1]\no1 endwhile",
        "o1 sub\n#9=0\no2 while [#9 LT 2]\nG1 X#9\n#9=[#9+1]\no2 endwhile\no1 endsub\no1 call\no1 call",
        "o1 repeat [3]\n#1=0\no2 while [#1 EQ 0]\nG1 X1\n#1=1\no2 endwhile\no1 endrepeat",
        "G91\no1 while [#5420 LT 3]\nG1 X1\no1 endwhile\nG90",
        "o1 sub\no2 while [1]\nG1 X2\no1 return\no2 endwhile\no1 endsub\no1 call\no1 call",
    ],
)
def test_a_loop_that_ends_is_run_to_its_end(lines: str) -> None:
    program = interpret_program(f"{HEAD}{lines}\nG1 X77", load_dialect("linuxcnc"))
    assert program.path.extents[1][0] == pytest.approx(77.0)


def test_short_blocks_of_an_endless_loop_count_for_more_than_their_letters(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block takes its time however short it is: of short ones a quarter of a million ends a loop, not six."""
    monkeypatch.setattr(flow, "MAX_REPEATED", 24_000)
    with pytest.raises(ReadError, match="more than 1,001 blocks"):
        interpret_program(f"{HEAD}#1=0\no1 while [1]\n#1=[#1+1]\no1 endwhile", load_dialect("linuxcnc"))


@pytest.mark.parametrize("lines", ["o1 sub\no1 call\no1 endsub\no1 call", "M98 P1\nM2\nO1\nM98 P1\nM99"])
def test_recursion_is_refused(lines: str) -> None:
    """At the depth at which LinuxCNC stops, too."""
    with pytest.raises(ReadError, match="more than 9 deep"):
        interpret_program(HEAD + lines, load_dialect("linuxcnc"))


def test_repeats_cannot_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thousand lines with L9999 come to ten million holes."""
    monkeypatch.setattr(interpreter, "MAX_ROWS", 50_000)
    text = HEAD + "G91 G81 X1 R-1 Z-1 L9999\n" + "X1 L9999\n" * 10
    with pytest.raises(ReadError, match=":8: the program has more than 50,000 moves"):
        interpret_program(text, load_dialect("linuxcnc"))


def test_holes_of_repeated_cycles_are_counted_before_they_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(canned, "MAX_REPEATED_HOLES", 100)
    text = HEAD + "G91 G81 X1 R-1 Z-1 L60\n" + "X1\n" * 60
    assert len(interpret_program(text, load_dialect("linuxcnc")).path) > 120
    with pytest.raises(ReadError, match=":4: repeated cycles drill more than 100 holes; split the program"):
        interpret_program(text.replace("X1\n", "X1 L41\n", 1), load_dialect("linuxcnc"))


@pytest.mark.parametrize(
    "piece", ["G1X1", "(", "((", "[", "X[1+", "#", "O1 sub ", "N1", " ", "1", "-", ";", "/", "%", "("]
)
def test_megabytes_on_one_line_are_refused_at_once(piece: str) -> None:
    """Whatever they are made of."""
    text = "G21\nX[" + piece * (1_000_000 // len(piece))
    with pytest.raises(ReadError) as caught:
        interpret_program(text, load_dialect("linuxcnc"))
    assert caught.value.line == 2


@pytest.mark.parametrize("piece", ["G1X1", "((", "[", "X[1+", "#", "O1", "N1 ", "1", "-", "/", "<", "o<", "(a)", "\t"])
def test_a_line_as_long_as_may_be_takes_no_more_than_linear_time(piece: str) -> None:
    """Ten thousand characters of anything; a pattern that backtracks would not come to an end."""
    for start in ("", "o1 if ", "N1 o<", "X[", "(", "#<"):
        line = (start + piece * 10_000)[:9_990]
        try:
            interpret_program(f"G21\n{line}\n", load_dialect("linuxcnc"))
        except ReadError as problem:
            assert len(str(problem)) < 300


TOKENS = (
    st.sampled_from(
        ["G0", "G1", "G2", "G81", "G92", "G43", "G10", "G91", "M98", "M99", "M6", "X", "Y1", "Z-1.", "I", "R2"]
    )
    | st.sampled_from(
        ["#1", "#<a>", "=", "[", "]", "+", "**", "SIN", "o1", "o<b>", "sub", "endsub", "call", "if", "while"]
    )
    | st.sampled_from(["do", "repeat", "endif", "endwhile", "endrepeat", "else", "break", "P1", "L2", "F9", "endsub"])
    | st.sampled_from(list("();/%.-1 \n\n\n\r"))
)


@given(
    st.lists(TOKENS, max_size=60).map("".join) | st.text(max_size=80),
    st.sampled_from(["linuxcnc", "fanuc", "fagor8055"]),
)
def test_any_text_is_read_or_refused(text: str, words: str) -> None:
    """Random words and random letters: a program, or one clear line."""
    _read_or_refuse(text, words)


def _read_or_refuse(text: str, words: str = "linuxcnc") -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flow, "MAX_REPEATED", 1_000)
        try:
            program = interpret_program(text, load_dialect(words), "f", units="mm")
        except ReadError as problem:
            said = str(problem)
            assert said.startswith("f:") and "\n" not in said and said.isprintable()
            assert problem.line is not None and problem.line >= 1
        else:
            assert program.first[-1] == len(program.path)


#: Characters of a file that are kept for a mutation.
KEPT = 6_000


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 4))])
def test_mutated_real_programs_are_read_or_refused(data: Path, seed: int) -> None:
    """Characters deleted, doubled, changed; lines deleted, doubled, swapped, cut off."""
    chance = random.Random(seed)
    for file in sorted((data / "gcode").glob("*.*")):
        text = file.read_text(encoding="utf-8", errors="replace")
        begin = chance.randrange(max(1, len(text) - KEPT))
        text = text[:300] + "\n" + text[begin : begin + KEPT]
        for _ in range(10):
            changed = text
            for _ in range(chance.randint(1, 3)):
                changed = _mutated(changed, chance)
            _read_or_refuse(changed)


def _mutated(text: str, chance: random.Random) -> str:
    kind = chance.randrange(7)
    at = chance.randrange(max(1, len(text)))
    if kind == 0:
        return text[:at] + text[at + chance.randint(1, 3) :]
    if kind == 1:
        return text[:at] + text[at : at + 5] + text[at:]
    if kind == 2:
        return text[:at] + chance.choice("XYZGMFORL#[]()%/;-.0123456789 \n\t$") + text[at + 1 :]
    if kind == 3:
        return text[:at]
    lines = text.splitlines(keepends=True) or [""]
    one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
    if kind == 4:
        del lines[one]
    elif kind == 5:
        lines.insert(other, lines[one])
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return "".join(lines)
