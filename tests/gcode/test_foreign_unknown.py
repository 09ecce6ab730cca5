"""Parts of a program that depend on the machine are understood, or kept with everything that depends on them."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.certificate import certify

HEAD = "G21 G90 G17 G94 G40 G80 F100.\nG0 X0. Y0. Z10.\n"


def run(text: str, words: str = "haas", units: str | None = None) -> Program:
    """Interpret a program."""
    return interpret_program(text, load_dialect(words), "part.nc", units=units)


def places(program: Program) -> list[tuple[float, float]]:
    """Return the ends of the feed moves, (x, y)."""
    return [(x, y) for x, y, _ in program.path.end[program.path.kind == Kind.FEED].tolist()]


def kept(program: Program) -> list[int]:
    """Return the lines of its blocks that are not understood."""
    return sorted({int(line) for line in program.path.line[program.path.kind == Kind.FOREIGN]})


@pytest.mark.parametrize(
    "text, found",
    [
        ("#1=0\nWHILE[#1LT3]DO1\nG1X[#1*10.]\n#1=#1+1\nEND1\nG1X99.", [0, 10, 20, 99]),
        ("#1=0\nwhile [#1 lt 3] do 1\ng1 x[#1*10.]\n#1=#1+1\nend 1\ng1 x99.", [0, 10, 20, 99]),
        ("#1=1\nN5 G1 X[#1]\n#1=#1*2\nIF [#1 LE 4] GOTO 5\nG1 X9.", [1, 2, 4, 9]),
        ("#101=7\nIF[#101EQ7]THEN#102=3\nG1X#102\nIF[#101NE7]THEN#102=4\nX[#102+1]", [3, 4]),
        ("GOTO 30\nG1 X1.\nN30 G1 X2.", [2]),
        ("G1 X1.\nM97 P1000 L2\nG1 X5.\nM30\nN1000 G1 X2.\nX3.\nM99", [1, 2, 3, 2, 3, 5]),
        ("M98 P30100\nG1 X5.\nM30\nO100\nG1 X2.\nM99", [2, 2, 2, 5]),
        ("M98 P100\nG1 X1.\nN7 X2.\nM30\nO100\nG1 X8.\nM99 P7", [8, 2]),
        ("#1=0\nWHILE[#1LT2]DO1\n#2=0\nWHILE[#2LT2]DO2\nG1X[#1*10.+#2]\n#2=#2+1\nEND2\n#1=#1+1\nEND1", [0, 1, 10, 11]),
    ],
)
def test_macros_of_fanuc_and_haas_run_as_written_out_by_hand(text: str, found: list[float]) -> None:
    """Loops, conditions, jumps and calls of lines with numbers that the program itself sets."""
    program = run(HEAD + text + "\n")
    assert [x for x, _ in places(program)] == found and not kept(program)


def test_a_line_that_a_jump_leads_to_stays_and_so_does_what_is_run_again() -> None:
    """Elsewhere the jump would lead to other text."""
    program = run(HEAD + "#1=1\nGOTO 20\nN20 G1 X5.\nN30 G1 X6.\nIF[#1EQ2]GOTO30\nG1 X7.\n")
    assert {int(program.line[b]) for b in program.fixed} == {3, 4, 5, 6, 7}


@pytest.mark.parametrize(
    "text, lines",
    [
        ("IF[#500EQ1]GOTO50\nG1 X5.\nX6.\nN50 G1 X7.", [3, 4, 5, 6]),
        ("WHILE[#500LT3]DO1\nG1 X5.\nEND1\nG1 X7.", [3, 4, 5, 6]),
        ("IF[#3003EQ1]THEN#1=2.\nG1 X#1", [3, 4]),
        ("o1 if [#5070 EQ 0]\nM2\no1 endif\nG1 X7.", [3, 4, 5, 6]),
        ("M98 P9001\nG1 X7.", [3, 4]),
        ("o<probe> call [1]\nG1 X7.", [3, 4]),
        ("G65 P9010 A1. I2. I3.\nG1 X7.", [3, 4]),
        ("#5221=4.\nG1 X7.", [3, 4]),
        ("G66 P9010 A5.\nG0 X7. Y7. Z7.\nG67\nG90 G1 X8. Y1. Z1. F9.", [3, 4]),
        ("M70\nG91\nM72\nG1 X7.", [3, 5, 6]),
    ],
)
def test_what_is_not_known_after_a_call_or_a_condition_is_not_taken_for_known(text: str, lines: list[int]) -> None:
    """A move in a mode that may have changed is kept unchanged until the program sets the mode again."""
    program = run(HEAD + text + "\n", "linuxcnc" if "o" in text else "haas")
    assert kept(program) == lines
    last = int(np.flatnonzero(program.path.kind == Kind.FOREIGN)[-1])
    assert "G67" in text or np.isnan(program.path.end[last]).all()


def test_a_jump_that_nobody_can_follow_leaves_all_text_behind_it_as_it_is() -> None:
    """Computed, or out of text that may not be run: where the program goes on is not known."""
    for jump in ("GOTO #500", "IF[#500EQ1]GOTO60\nIF[#501EQ1]GOTO5\nN60 G1 X1."):
        program = run(HEAD + f"N5 G1 X3.\n{jump}\nG90 G1 X4. Y4. Z4. F50.\nM30\nO77\nG1 X9.\nM99\n")
        text = [k for k, line in enumerate(program.lines, 1) if k > 3 and line.strip()]
        assert kept(program) == text
        assert program.last_line == len(program.lines)
        assert {int(program.line[b]) for b in program.fixed} >= {3, *text}


#: Actions of a called program, in any order.
DEEDS = [
    "G91", "G90", "G18", "G19", "G0", "G3", "G0 X50. Y-20. Z3.", "G81 X1. Y1. Z-1. R2. F40.", "G98", "G99", "F7.",
    "G41 D1", "S500 M3", "G52 X3. Y4.", "G92 X1.", "T5 M6", "G43 H7", "G55", "#101=77.", "G17", "G2", "G53 G0 Z0.",
]  # fmt: skip
AFTER = [
    "X4. Y4.", "G0 X5. Y5.", "G1 X6. Z-1.", "X7.", "G90", "G1 X8. F60.", "Y9.", "Z2.", "G17 G2 X10. Y9. I1.",
    "G3 X8. Y9. I-1. J0.", "G40", "G0 Z15.", "G99 G81 X3. Y3. Z-2. R2.", "X9. Y1.", "G80", "G0 X1. Y1. Z1.", "G1 X#101",
    "G98 G82 X5. Y5. Z-1. R1. P200", "G94", "S900", "G1 X2. Y2. F30.",
]  # fmt: skip


def test_what_is_understood_after_a_call_is_the_same_whatever_the_called_program_does() -> None:
    """With random bodies: every move that is not kept ends at the same position, as far as the position is known."""
    chance = random.Random(4)
    understood = 0
    for _ in range(300):
        after = "\n".join(["G80", *chance.choices(AFTER, k=14)])
        body = "\n".join(chance.choices(DEEDS, k=5))
        text = HEAD + "#101=3.\nM98 P9001\n" + after + "\nM30\n"
        try:
            unknown, known = run(text), run(text + f"O9001\n{body}\nM99\n")
        except ReadError:  # an arc that ends beside its circle, a cycle without its planes
            continue
        rows = _rows(unknown), _rows(known)
        for line, moves in rows[0].items():
            if line <= 5 or line in kept(unknown):
                continue
            understood += len(moves)
            assert len(moves) == len(rows[1].get(line, [])), (text, body, line)
            for one, other in zip(moves, rows[1][line], strict=True):
                assert one[0] == other[0] and one[2] == other[2], (text, body, line)
                told = np.isfinite(one[1])
                # The origin is unknown, too: positions are those of the program.
                assert np.allclose(one[1][told], other[1][told]), (text, body, line)
    assert understood > 60


def _rows(program: Program) -> dict[int, list[tuple[int, np.ndarray, float]]]:
    path, found = program.path, dict[int, list[tuple[int, np.ndarray, float]]]()
    for row in np.flatnonzero(path.kind <= Kind.DRILL).tolist():
        found.setdefault(int(path.line[row]), []).append((int(path.kind[row]), path.end[row], float(path.value[row])))
    return found


@pytest.mark.parametrize(
    "lines, found",
    [
        ("G1 X#100\nG1 X5. Y5.", [3]),
        ("G1 X5. F#100\nX6.\nG1 X7. F10.", [3, 4]),
        ("S#100 M3\nG1 X5.\nG95\nG1 X6. F.1\nS10\nX7.", [3, 6]),
        ("G4 P#100\nG1 X5.", [3]),
        ("G43 H#100 Z20.\nG0 X1.\nZ5.\nG1 X2.", [3]),
        ("G81 X1. Y1. Z#100 R2.\nX2.\nG80\nG1 X3. Y1. Z1.", [3, 4]),
        ("DPRNT[X#100[53]*Y#101[53]]\nPOPEN\nG1 X2.", [3, 4]),
        ("G4 X5\nG1 X2.", [3]),
        ("G31 Z-10. F50.\nG92 Z0.\nG0 Z4.\nG1 X3. F80.", [3]),
    ],
)
def test_a_number_that_only_the_machine_knows_makes_a_barrier_of_its_block(lines: str, found: list[int]) -> None:
    """And of those that take it from there."""
    assert kept(run(HEAD + lines + "\n")) == found


def test_a_dwell_may_say_its_seconds_in_x() -> None:
    """G4 X1.0 as at Fanuc: a second, and no move."""
    for words in ("haas", "fanuc"):
        program = run(HEAD + "G4 X1.0\nG1 X2.\n", words)
        assert program.path.value[program.path.kind == Kind.DWELL].tolist() == [1.0]
        assert places(program) == [(2.0, 0.0)]


def test_units_that_a_program_does_not_state_are_those_of_the_reader_and_that_is_told() -> None:
    """Only if a length or a feed needs them; a feed may precede G20 or G21."""
    assert places(run("G90 G0 X1 Y1\nG1 X2 F60\n", "grbl", "in")) == [(50.8, 25.4)]
    assert run("G90 G0 X1 Y1\n", "grbl", "mm").assumed_units
    for text in ("G90\nG21\nG0 X1 Y1\n", "F60\nG21 G90 G0 X1 Y1\nG1 X2\n", "G0 X0\nG20 F5\nX1\n"):
        assert not run(text, "grbl", "mm").assumed_units
    program = run("F10\nG20 G90 G0 X1 Y1\nG1 X2\n", "grbl", "mm")
    assert program.path.value[program.path.kind == Kind.FEED] == pytest.approx(254.0 / 60.0)


def test_remarks_inside_remarks_are_one_and_their_block_stays() -> None:
    """Controllers differ in where such a remark ends."""
    program = run(HEAD + "(TOOL 1 (1/2) FLAT)\nG1 X5. (deep (2.)) \nG1 X6.\n")
    assert places(program) == [(5.0, 0.0), (6.0, 0.0)]
    assert [int(program.line[b]) for b in program.fixed] == [3, 4]


def test_what_stands_above_the_percent_sign_and_is_no_block_is_none_of_the_program() -> None:
    """A title that a sender or a person has left there; blocks above it are the program, and the sign is its end."""
    assert places(run("PROGRAM FOR PART 7\nTOOLS: 2\n%\n" + HEAD + "G1 X5.\n%\n")) == [(5.0, 0.0)]
    assert places(run(HEAD + "G1 X5.\n%\n")) == [(5.0, 0.0)]
    for wrong in (HEAD + "G1 X5.\nfoo bar\nM30\n%\n", "foo bar\n%\n", HEAD + "foo bar\n%\n"):
        with pytest.raises(ReadError, match="'foo bar' is a letter without a number"):
            run(wrong)


def test_a_program_of_a_fagor_as_schools_write_it() -> None:
    """T1.1 is tool 1 with offset 1; the feed precedes the units, and one number precedes another."""
    text = "%THESIS,MX,\nN10 F200 S1000 M3\nN20 G71 G90 G17\nN30 T1.1 M6\nN40 N45 G43 G0 X0 Y0 Z20\n"
    program = run(text + "N50 G81 G99 X10 Y10 Z2 I-5\nN60 X20\nN70 G80\nN80 M30\n", "fagor8055", "mm")
    drilled = program.path.kind == Kind.DRILL
    assert program.path.end[drilled, 0].tolist() == [10.0, 20.0] and not program.assumed_units
    assert program.path.value[drilled] == pytest.approx(200.0 / 60.0)
    last = replace(program.modal(program.n_blocks))
    assert (last.tool, last.length) == (1, 1)


def test_a_number_given_twice_and_a_move_after_g80_without_g0() -> None:
    """The move after G80 is the rapid from before the cycle; two blocks N80 are two blocks; the feed is in inches."""
    text = "%PLATE,MX,\nN10 G17 G90 F10 G70\nN20 T1.1\nN30 M6\nN40 S1200 M3\nN50 G0 X1 Y1 Z1\n"
    text += "N60 G81 G99 X1 Y1 Z0.1 I-0.25\nN70 X4\nN80 X2 Y3\nN80 X5 Y4\nN100 G80\nN110 X0 Y0\nN120 M30\n"
    path = run(text, "fagor8055", "mm").path
    drilled = path.kind == Kind.DRILL
    expected = 25.4 * np.array([[1.0, 1.0], [4.0, 1.0], [2.0, 3.0], [5.0, 4.0]])
    assert path.end[drilled, :2] == pytest.approx(expected)
    assert path.value[drilled] == pytest.approx(254.0 / 60.0)
    home = np.flatnonzero(path.line == 12)
    assert path.kind[home].tolist() == [Kind.RAPID]
    assert path.end[home[-1], :2].tolist() == [0.0, 0.0]


def test_statements_of_a_fagor_stand_in_parentheses_and_are_no_remarks() -> None:
    """An assignment may change any state of the machine; a jump leaves the text unchanged."""
    head = "G71 G90 G17\nG0 X0 Y0 Z5 F100\n"
    assert kept(run(head + "(P1=5)\nG1 X5\n", "fagor8055")) == [3, 4]
    assert kept(run(head + "G1 X5\n(RPT N1,N2)N3\nG90 G1 X6 Y6 Z6 F10\n", "fagor8055")) == [4, 5]
    assert not kept(run(head + '(MSG "CHANGE")\nG1 X5\n', "fagor8055"))


ENDING = "\nG90 G17 G40 G0 X9. Y9. Z9.\nM30\n"


@pytest.mark.parametrize(
    "text, changed",
    [
        ("G1 X#100", "G1 X#101"),
        ("G1 X#[#1+100]", "#1=2\nG1 X#[#1+100]"),
        ("F#100\nG1 X5.", "F#101\nG1 X5."),
        ("#5=#100\nG1 X#5", "#5=#101\nG1 X#5"),
        ("#5=7.\nM98 P9001", "#5=8.\nM98 P9001"),
        ("M98 P9001", "F7.\nM98 P9001"),
        ("M98 P9001", "G91\nM98 P9001"),
        ("M98 P9001", "M98 P9002"),
        ("M98 P9001", "M98 P9001 L2"),
        ("IF[#500EQ1]GOTO5\nG1 X1.\nN5", "IF[#501EQ1]GOTO5\nG1 X1.\nN5"),
        ("IF[#500EQ1]GOTO5\nG1 X1.\nN5", "IF[#500EQ1]GOTO5\nG1 X2.\nN5"),
        ("GOTO #500\nG1 X1.\nN5", "GOTO #500\nG1 X2.\nN5"),
        ("DPRNT[X#100[53]]", "DPRNT[X#101[53]]"),
        ("#1=2.\nDPRNT[X#1[53]]", "#1=3.\nDPRNT[X#1[53]]"),
        ("#5221=4.", "#5221=5."),
        ("S#100 M3", "S#101 M3"),
        ("G4 X#100", "G4 X#101"),
    ],
)
def test_what_only_the_machine_knows_is_the_same_only_where_all_that_it_reads_is(text: str, changed: str) -> None:
    """The values are unknown, so the proof compares the text and the preceding settings."""
    one, other = (run(HEAD + said + ENDING) for said in (text, changed))
    assert certify(one, run(HEAD + text + ENDING)).same
    assert not certify(one, other).same


def test_statements_of_a_fagor_count_in_the_proof() -> None:
    """They stand where others have remarks."""
    head, end = "G71 G90 G17\nG0 X0 Y0 Z5 F100\n", "\nG90 G0 X1 Y1 Z1\nM30\n"
    for text, changed in (("(P1=5)", "(P1=6)"), ("(RPT N1,N2)N3", "(RPT N1,N2)N4"), ("(CALL 7)", "(CALL 8)")):
        one, other = (run(head + said + end, "fagor8055") for said in (text, changed))
        assert not certify(one, other).same


@pytest.mark.parametrize("words", ["haas", "fanuc"])
def test_a_move_home_before_the_first_motion_is_known(words: str) -> None:
    """It is a rapid, whatever motion mode is active at power-on: most posts write it first."""
    program = run("G21 G90 G17 G94 G40 G80\nG28 G91 Z0.\nG90\nG0 X5. Y5.\n", words)
    assert not kept(program)
    assert Kind.MACHINE in program.path.kind.tolist()
