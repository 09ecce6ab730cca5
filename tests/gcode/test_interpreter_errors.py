"""What cannot be understood: one clear line with file and line number, whatever the text."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import LeafcutError, ReadError
from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.gcode.own_program import interpret_own_program

HEAD = "G21 G90\nG0 X0 Y0 Z10\nF60\n"

CASES = [
    ("G5 X1", "G5 is not understood"),
    ("G0.5 X1", "G0.5 is not understood"),
    ("G81.0001 X1", "not understood"),
    ("M66", "M66 is not understood"),
    ("M-3", "M-3 is not understood"),
    ("G0 G1 X1", "G0 and G1 exclude each other"),
    ("G80 G81 X1", "G80 and G81 exclude each other"),
    ("G90 G91", "exclude each other"),
    ("M3 M5", "M3 and M5 exclude each other"),
    ("M8 M9", "M8 and M9 exclude each other"),
    ("X1 X2", "X is given twice: X1 and X2"),
    ("G0 A5", "axis A is not understood"),
    ("G1 X1 Q5", "Q5 has no meaning"),
    ("G81 X1 Z-1 R1 P1", "P1 has no meaning"),
    ("G80 X5", "X5 is given without G0"),
    ("G4", "G4 needs its time, P"),
    ("G4 P-1", "cannot be negative"),
    ("G1 X1 F0", "the cut has no feed"),
    ("G1 X1 F-5", "negative"),
    ("S-100 M3", "negative"),
    ("T1.5", "T1.5 must be a whole number"),
    ("T-1", "T-1 must be a whole number"),
    ("M6", "M6 has no T word before it"),
    ("G43", "G43 has no H"),
    ("G43 H-1", "H-1 must be a whole number"),
    ("G41 X1", "G41 is not understood"),
    ("G92 X0", "G92 is not understood"),
    ("G10 L2 P1 X0", "G10 is not understood"),
    ("G86 X1 Z-1 R1", "G86 is not understood"),
    ("G81 X1 R1", "the cycle lacks Z"),
    ("G81 X1 Z-1", "the cycle lacks R"),
    ("G81 X1 Z1 R-1", "drills upwards"),
    ("G83 X1 Z-1 R1", "needs a peck depth"),
    ("G83 X1 Z-1 R1 Q0", "needs a peck depth"),
    ("G83 X1 Z-100 R1 Q0.001", "Q is too small"),
    ("G82 X1 Z-1 R1", "G82 needs its dwell"),
    ("G81 X1 Z-1 R1 L0", "L0: it is unknown whether the tool moves"),
    ("G81 X1 Z-1 R1 L100000000", "L100000000 must be a whole number"),
    ("G18 G81 X1 Z-1 R1", "G17"),
    ("G93 G81 X1 Z-1 R1 F5", "inverse time"),
    ("G93 G1 X1", "needs its own F"),
    ("G95 G1 X1 F1", "running spindle"),
    ("G2 X10 Y0", "an arc needs I and J, or R"),
    ("G2", "an arc needs I and J, or R"),
    ("G2 X10 Y0 I5.1", "does not end on its circle"),
    ("G2 X10 Y0 R4", "too small"),
    ("G2 R5", "needs an end point"),
    ("G2 X0 Y0 R5", "cannot end where it starts"),
    ("G2 X1 I0 J0", "radius of 0"),
    ("G2 I5 P0", "number of turns"),
    ("G2 I5 P100000000", "number of turns"),
    ("G90.1 G2 X10 Y0 I5", "needs J"),
    ("G2 X10 Y0 I5 K1", "K1 has no meaning"),
    ("G53 G1 X1 F1", "G53 is understood with G0"),
    ("G91 G53 G0 X1", "cannot be incremental"),
    ("G0 G53", "G53 has no axis word"),
    ("G28 G0 X1", "G28 and a motion are in the same block"),
    ("/G0 X1", "block-delete switch"),
    ("O5", "another program starts"),
    ("o100 sub", "letter without a number"),
    ("#1=5", "parameters and expressions"),
    ("G0 X#1", "letter without a number"),
    ("G0 X1 (open", "not closed"),
    ("G20 F10", "changes the units"),
]


@pytest.mark.parametrize("line, reason", CASES)
def test_each_fault_is_named_with_its_line(line: str, reason: str) -> None:
    """The error is in line 4, and the one-line message names it."""
    with pytest.raises(ReadError, match=reason) as caught:
        interpret_own_program(HEAD + line + "\nM2\n", load_dialect("linuxcnc"), "part.ngc")
    assert str(caught.value).startswith("part.ngc:4: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text, name, reason",
    [
        ("G21\nG91\nG0 X1\nM2", "linuxcnc", "program:3: X1 is incremental"),
        ("G21\nG2 X1 Y1 R5 F5\nM2", "linuxcnc", "program:2: the arc starts at an unknown position"),
        ("G21 F9\nG0 Z1\nG99 G81 X1 Z-1 R1\nM2", "linuxcnc", "program:3: the position of the hole is unknown"),
        ("G21 F9\nG98 G81 X1 Y1 Z-1 R1\nM2", "linuxcnc", "program:2: G98 returns to an unknown height"),
        ("G21\nG93 G1 X1 F5\nM2", "linuxcnc", "program:2: a cut in inverse time (G93) needs a known length"),
        ("G17\nG0 X5\nM2", "linuxcnc", "program:2: X5 comes before the units are stated (G21 for mm)"),
        ("G21\nX5\nM2", "linuxcnc", "program:2: X5 is given without G0"),
        ("G21\nG0 X5\n", "linuxcnc", "program: the program has no end; M2 is missing"),
        ("%\nG21\nG0 X5.\n%", "haas", "program: the program has no end; M30 is missing"),
        ("G21\nG0 X5\nM30", "fanuc", "program:2: X5 has no decimal point"),
        ("G21\nG4 P0.5\nM30", "fanuc", "program:2: the duration of the dwell with P0.5 is unknown"),
        ("G21\nG4 X1\nM30", "fanuc", "program:2: the duration of the dwell with X1 is unknown"),
        ("G21\nG81 X1 Y1 Z-1 R1", "grbl", "program:2: G81 is not understood"),
        ("T1\nM6", "grbl", "program:2: M6 is not understood"),
        ("G21 G0 X0 Y0 Z5 F9\nG81 X1 Z-1 R1\nG91 X1", "mach3", "program:3: G90/G91 changed"),
        ("G21 G0 X0 Y0 Z5 F9\nG81 X1 Z-1 R1\nG20 X1", "mach3", "program:3: units changed"),
        ("G21 G0 X0 Y0 Z5 F9\nG81 X1 Z-1 R1\nT1 M6", "mach3", "program:3: the tool is changed inside"),
        (
            "G21 G0 X0 Y0 Z5 F9\nG81 X1 Z-1 R1\nG91 G28 Z0",
            "mach3",
            "program:3: G28 or G30 is used while another motion is active; G80 is missing",
        ),
        ("G21 G0 X0 Y0 Z5 F9\nG81 X1 Z-1 R1\nG83 X2 Q1", "mach3", "program:3: the cycle lacks R"),
        ("G71\nG0 X0 Y0 Z5 F9\nG81 X1 Z1", "fagor8055", "program:3: the cycle lacks I"),
        ("G71\nG0 X0 Y0 Z5 F9\nG85 X1 Z1 I-1 K5", "fagor8055", "program:3: G85 with a dwell"),
        ("G73 X1", "fagor8055", "program:1: G73 is not understood"),
        ("G21 G0 X1 (ok)\n%garbage", "grbl", None),
        ("%garbage\nG21", "grbl", "program:1: only '%'"),
    ],
)
def test_faults_of_order_and_of_dialect_are_named(text: str, name: str, reason: str | None) -> None:
    """A correct line of one controller may be unknown to another, or have another meaning."""
    if reason is None:
        assert len(interpret_own_program(text, load_dialect(name))) == 1
        return
    with pytest.raises(ReadError) as caught:
        interpret_own_program(text, load_dialect(name))
    assert str(caught.value).startswith(reason)


@pytest.mark.parametrize(
    "text",
    [
        "X" * 5_000_000,
        "(" * 2_000_000,
        "1" * 3_000_000,
        "G1" * 4_000,
        "(a" * 4_000,
        "\0" * 9_000,
        ";" * 9_000,
        "%" * 9_000,
    ],
)
def test_monstrous_lines_are_refused_or_read_at_once(text: str) -> None:
    """Megabytes on one line, comments never closed, a thousand words: no hang and no traceback."""
    try:
        interpret_own_program("G21\n" + text, load_dialect("mach3"))
    except LeafcutError as problem:
        assert len(str(problem)) < 300


WORDS = st.sampled_from(
    [
        "G0",
        "G1",
        "G2",
        "G3",
        "G4",
        "G17",
        "G18",
        "G19",
        "G20",
        "G21",
        "G28",
        "G40",
        "G43",
        "G49",
        "G53",
        "G54",
        "G61",
        "G64",
        "G73",
        "G80",
        "G81",
        "G82",
        "G83",
        "G84",
        "G85",
        "G90",
        "G91",
        "G90.1",
        "G91.1",
        "G93",
        "G94",
        "G95",
        "G98",
        "G99",
        "M0",
        "M1",
        "M2",
        "M3",
        "M5",
        "M6",
        "M8",
        "M9",
        "X1",
        "X-2.",
        "Y3",
        "Y.5",
        "Z1",
        "Z-1",
        "Z10",
        "R2",
        "R5",
        "I1",
        "J-1",
        "K2",
        "Q1",
        "P1",
        "P0.5",
        "L2",
        "F100",
        "S500",
        "T1",
        "H1",
        "D1",
        "N5",
        "O1",
        "(hi)",
        "(",
        ")",
        ";",
        "%",
        "/",
        "#1",
        "E",
    ]
)


@settings(max_examples=settings().max_examples * 5)
@given(
    st.lists(st.lists(WORDS, max_size=6).map(" ".join), max_size=12).map("\n".join),
    st.sampled_from(dialect_names()),
)
def test_any_mixture_of_words_is_read_or_refused(text: str, name: str) -> None:
    """The only exception is LeafcutError with a one-line message."""
    try:
        interpret_own_program(text, load_dialect(name))
    except LeafcutError as problem:
        assert "\n" not in str(problem)


@settings(max_examples=settings().max_examples * 5)
@given(st.text(), st.sampled_from(dialect_names()))
def test_any_text_is_read_or_refused(text: str, name: str) -> None:
    """Unicode, control characters, anything: only LeafcutError comes out."""
    try:
        interpret_own_program(text, load_dialect(name))
    except LeafcutError as problem:
        assert "\n" not in str(problem)
