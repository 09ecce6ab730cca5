"""The subset of Siemens blocks that leafcut writes: each cycle with its values, each refusal with its text."""

from __future__ import annotations

import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.gcode.sinumerik import parse_block
from leafcut.gcode.words import BlockError
from leafcut.model.toolpath import DrillCycle, Kind

HEAD = 'G710\nG17 G90 G40\nG94 G54\nT="1"\nM6\nG0 D1 Z{}\nX1 Y2\nF120\n'


def hole(call: str, height: float = 20.0, unit: str = "G710") -> tuple[DrillCycle, tuple[float, float, float], float]:
    """Return the cycle, the end and the feed of one called hole at X5."""
    text = HEAD.format(f"{height:g}").replace("G710", unit) + f"MCALL {call}\nG0 X5\nMCALL\nM30\n"
    path = interpret_own_program(text, load_dialect("siemens"))
    (drill,) = (motion for motion in path if motion.kind is Kind.DRILL)
    return path.cycles[drill.ref], drill.end, drill.value


@pytest.mark.parametrize(
    ("call", "cycle"),
    [
        ("CYCLE81(2,2,0,-5)", DrillCycle("G81", 2.0, -5.0)),
        ("cycle81 ( 20 , 1, 1.5 , -5 )", DrillCycle("G81", 2.5, -5.0, True)),
        ("CYCLE81(2,2,0,-5) ; a note", DrillCycle("G81", 2.0, -5.0)),
        ("CYCLE81(2,2,0,1.999)", DrillCycle("G81", 2.0, 1.999)),
        ("CYCLE82(2,2,0,-5,,0.25)", DrillCycle("G82", 2.0, -5.0, dwell=0.25)),
        ("CYCLE82(20,2,0,-5,,0)", DrillCycle("G82", 2.0, -5.0, True)),
        ("CYCLE83(2,2,0,-10,,-1,,0,0,0,1,1)", DrillCycle("G83", 2.0, -10.0, peck=3.0)),
        ("CYCLE83(20,2,0,-10,,1.5,,0,0,0,1,0)", DrillCycle("G73", 2.0, -10.0, True, 0.5)),
    ],
)
def test_a_called_cycle_has_its_planes_peck_and_dwell(call: str, cycle: DrillCycle) -> None:
    assert hole(call) == (cycle, (5.0, 2.0, 20.0 if cycle.to_initial else cycle.r_plane), 2.0)


def test_lengths_of_a_cycle_are_in_the_unit_of_the_program() -> None:
    cycle, end, feed = hole("CYCLE83(2,1,0,-1,,0.5,,0,0,0,1,1)", 2.0, "G700")
    assert cycle == DrillCycle("G83", 25.4, -25.4, True, 12.7)
    assert end == (127.0, 50.8, 50.8) and feed == 50.8


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "MCALL CYCLE81(2,2,0,-5)\nMCALL CYCLE81(2,2,0,-5)",
            "MCALL within MCALL; an MCALL without a cycle is missing before it",
        ),
        ("MCALL CYCLE81(2,2,0,-5,)", "CYCLE81 with 5 arguments: leafcut reads only its own Siemens programs"),
        ("MCALL CYCLE82(2,2,0,-5,,1,)", "CYCLE82 with 7 arguments: leafcut reads only its own Siemens programs"),
        (
            "MCALL CYCLE83(2,2,0,-10,,-1,,0,0,0,1,1,)",
            "CYCLE83 with 13 arguments: leafcut reads only its own Siemens programs",
        ),
        ("G18\nMCALL CYCLE81(2,2,0,-5)", "CYCLE81 is understood only in the XY plane (G17) with G90"),
        ("G91\nMCALL CYCLE81(2,2,0,-5)", "CYCLE81 is understood only in the XY plane (G17) with G90"),
        ("MCALL CYCLE81(2,2.5,-0.5,-5)", "CYCLE81: SDIS must not be negative"),
        *(
            (
                f"MCALL CYCLE81({arguments})",
                "CYCLE81: RTP and the tool must be at the reference plane or above it, and DP below it",
            )
            for arguments in ("21,21,0,-5", "1,2,0,-5", "2,2,0,2", "2,2,0,3", "20,20,0.001,0")
        ),
        ("MCALL CYCLE81(3,2,0,-5)", "CYCLE81: RTP is neither the reference plane nor the height of the tool"),
        ("MCALL CYCLE81(,2,0,-5)", "CYCLE81 needs RTP, a number"),
        ("MCALL CYCLE81(2,a,0,-5)", "CYCLE81 needs RFP, a number"),
        ("MCALL CYCLE81(2,2,,-5)", "CYCLE81 needs SDIS, a number"),
        ("MCALL CYCLE81(2,2,0)", "CYCLE81 needs DP, a number"),
        ("MCALL CYCLE82(2,2,0,-5)", "CYCLE82 needs DTB, a number"),
        (
            "MCALL CYCLE82(2,2,0,-5,,-1)",
            "CYCLE82: a negative dwell is a number of revolutions, which leafcut does not read",
        ),
        ("MCALL CYCLE83(2,2,0,-5,1,-1,,0,0,0,1,1)", "CYCLE83: DPR must be empty"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,1,0,0,0,1,1)", "CYCLE83: FDPR must be empty"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,,1,0,0,1,1)", "CYCLE83: DAM must be 0"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,,0,1,0,1,1)", "CYCLE83: DTB must be 0"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,,0,0,1,1,1)", "CYCLE83: DTS must be 0"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,,0,0,0,0.5,1)", "CYCLE83: FRF must be 1"),
        ("MCALL CYCLE83(2,2,0,-5,,2,,0,0,0,1,1)", "CYCLE83: FDEP must be below the reference plane"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,,0,0,0,1,2)", "CYCLE83: VARI must be 0 or 1"),
        ("MCALL CYCLE83(2,2,0,-5,,-1,,0,0,0,1)", "CYCLE83: VARI must be 0 or 1"),
        *(
            (
                f"MCALL CYCLE81(2,2,0,-5)\n{block}",
                ("while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may "
                    "follow MCALL"),
            )
            for block in ("G0", "M8", "X5 M8", "G0 X5 Z5", "F100", "G90 X5", "G4 F1")
        ),
        ("MCALL CYCLE81(2,2,0,-5)\nG1 X5", "a hole must be approached with G0"),
        (
            "G0 SUPA X0 D0\nD1 Z20\nMCALL CYCLE81(2,2,0,-5)\nY5",
            "the position of the hole is unknown, because X and Y are not both given",
        ),
        ("X1 R5", "R is a parameter of Siemens controls; the radius of an arc is CR="),
        ("G2 X4 r -2", "R is a parameter of Siemens controls; the radius of an arc is CR="),
        ("X=5", "'X=5' is not understood: leafcut reads only Siemens programs that it wrote itself"),
        ('MSG("é a long text that is shortened")', None),
        ('T="DRILL"', "'T=\"DRILL\"' is not understood: leafcut reads only Siemens programs that it wrote itself"),
        (
            "MCALL CYCLE84(1)",
            "'MCALL CYCLE84(1)' is not understood: leafcut reads only Siemens programs that it wrote itself",
        ),
    ],
)  # fmt: skip
def test_a_block_that_leafcut_does_not_write_is_refused(lines: str, message: str | None) -> None:
    with pytest.raises(ReadError) as refused:
        interpret_own_program(HEAD.format(20) + lines + "\nMCALL\nM30\n", load_dialect("siemens"), "plate.mpf")
    shown = (
        "'MSG(\"  a long text that is sho' is not understood: leafcut reads only Siemens programs that it wrote itself"
    )
    number = 8 + lines.count("\n") + 1
    assert str(refused.value) == f"plate.mpf:{number}: {message or shown}"


def test_a_block_has_its_words_and_its_comment() -> None:
    for line, words, comments in (
        ("N10 G0 X1 ; a note ", ["N10", "G0", "X1"], ("a note",)),
        ("G0 SUPA Z0 D0", ["G0", "G53", "Z0", "D0"], ()),
        ("supa Z0 ;", ["G53", "Z0"], ()),
        ("G2 X5 cr = 2.5", ["G2", "X5", "R2.5"], ()),
        ('t = "12345"', ["T12345"], ()),
        ("; only a note", [], ("only a note",)),
    ):
        block = parse_block(line, 7)
        assert (block.line, [str(word) for word in block.words], block.comments) == (7, words, comments)
    with pytest.raises(BlockError):
        parse_block('T="123456"', 1)


def test_a_call_without_a_cycle_ends_the_cycle_in_any_spelling() -> None:
    lines = ["MCALL CYCLE81(2,2,0,-5)", "G0 X5", "N5 mcall ; end", "G0 X9", "M30"]
    path = interpret_own_program(HEAD.format(20) + "\n".join(lines) + "\n", load_dialect("siemens"))
    assert [motion.end[0] for motion in path if motion.kind is Kind.DRILL] == [5.0]
