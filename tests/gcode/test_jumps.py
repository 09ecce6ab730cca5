"""Statements of Fanuc macros: the next line of each, the lines that may be undecided, and the refusals."""

from __future__ import annotations

import pytest

from leafcut.gcode.expressions import ProgramParameters
from leafcut.gcode.jumps import (
    Jumps,
    UndecidedJump,
    board_command,
    code_without_spaces,
    has_statements,
    parse_statement,
    sends_data,
)
from leafcut.gcode.words import BlockError


def step(text: str, line: int, **numbered: float) -> tuple[int, str]:
    """Return the next line after a statement, and the block to run first; lines are separated by ` / `."""
    lines = text.split(" / ")
    parameters = ProgramParameters(numbered={int(name[1:]): value for name, value in numbered.items()}, fanuc=True)
    statement = parse_statement(lines[line])
    assert statement is not None
    return Jumps(lines, parameters).execute_statement(statement, line)


LOOPS = "WHILE [#1 LT 3] DO 1 / X1 / DO2 / X2 / END 2 / END1 / X3"
TWO = "O1 / N10 X1 / GOTO 10 / N20 / O2 / N10 X2 / GOTO 20 / N10 X3"


@pytest.mark.parametrize(
    ("text", "line", "expected"),
    [
        ("X1 / GOTO 20 / X2 / N20 X3", 1, (3, "")),
        ("N20 X1 / GOTO 20", 1, (0, "")),
        ("N20 / GOTO 20 / N20 / N20", 1, (2, "")),
        ("N20 / N20 / GOTO 20", 2, (0, "")),
        ("GOTO #1 / N5", 0, (1, "")),
        ("goto [#1 + 1] / n6", 0, (1, "")),
        ("GOTO 5.2 / N5", 0, (1, "")),
        (TWO, 2, (1, "")),
        # N20 is only in the other program.
        (TWO, 6, (3, "")),
        ("(a) /N5 X1 / GOTO 5", 1, (0, "")),
        ("N0005 / GOTO 5", 1, (0, "")),
        ("IF [#1 EQ 5] GOTO 7 / X1 / N7", 0, (2, "")),
        ("IF [#1 NE 5] GOTO 7 / X1 / N7", 0, (1, "")),
        ("IF [#1 EQ 5] THEN #2=3 (a)", 0, (1, "#2=3")),
        ("if[#1ne5]then#2=3", 0, (1, "")),
        (LOOPS, 0, (6, "")),
        (LOOPS, 2, (3, "")),
        (LOOPS, 4, (2, "")),
        (LOOPS, 5, (0, "")),
        ("WHILE [#1 EQ 5] DO1 / X1 / END1", 0, (1, "")),
        ("DO1 / END1 / DO1 / END1", 3, (2, "")),
        ("DO1 / DO1 / END1 / END1", 3, (0, "")),
    ],
)
def test_the_next_line_of_a_statement(text: str, line: int, expected: tuple[int, str]) -> None:
    """#1 is 5."""
    assert step(text, line, _1=5.0) == expected


@pytest.mark.parametrize(
    ("text", "line", "last", "again"),
    [
        # A loop with an unknown condition may run again up to its end.
        ("WHILE [#9 LT 3] DO1 / X1 / END1 / X2", 0, 2, 0),
        ("IF [#9 EQ 1] THEN #2=3 / X2", 0, 0, None),
        ("IF [#9 EQ 1] GOTO 7 / X1 / N7 / X2", 0, 1, None),
        ("N7 / X1 / IF [#9 EQ 1] GOTO 7 / X2", 2, 2, 0),
        # A jump out of the undecided text: everything that follows, from the first goal before the statement.
        ("N3 / IF [#9 EQ 1] GOTO 7 / GOTO 3 / N7", 1, None, 0),
        ("N3 / IF [#9 EQ 1] GOTO 7 / M99 P3 / N7", 1, None, 0),
        ("N3 / IF [#9 EQ 1] GOTO 7 / M97 P3 / N7", 1, None, 0),
        ("IF [#9 EQ 1] GOTO 7 / M99 / N7", 0, None, None),
        ("IF [#9 EQ 1] GOTO 7 / M990 / N7", 0, 1, None),
        ("IF [#9 EQ 1] GOTO 7 / O5 RETURN / N7", 0, None, None),
        ("IF [#9 EQ 1] GOTO 7 / o<a> break / N7", 0, None, None),
        ("IF [#9 EQ 1] GOTO 7 / o<a> continue / N7", 0, None, None),
        ("IF [#9 EQ 1] GOTO 7 / GOTO #2 / N7", 0, None, 0),
        ("IF [#9 EQ 1] GOTO 7 / GOTO 7 / N7", 0, 1, None),
        ("IF [#9 EQ 1] GOTO 7 / (GOTO 99) / N7", 0, 1, None),
        ("N1 / GOTO #9 / N2 / GOTO 1", 1, None, 0),
        ("N1 / N2 / GOTO #9", 2, None, 0),
        ("GOTO #9 / N2 / GOTO 2", 0, None, 0),
    ],
)
def test_lines_whose_run_depends_on_the_machine(text: str, line: int, last: int | None, again: int | None) -> None:
    """#9 is known to the machine only."""
    with pytest.raises(UndecidedJump) as found:
        step(text, line)
    assert (found.value.last, found.value.again) == (last, again)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("GOTO 20 / N21", 0, "GOTO 20: the program has no such line"),
        ("GOTO 20 X1 / N20", 0, "GOTO 20 X1: the program has no such line"),
        ("GOTO [1+1111111111+2222222222]", 0, "GOTO [1+1111111111+222222: the program has no such line"),
        ("IF [1 EQ 1] X1", 0, "IF needs its GOTO or THEN"),
        ("WHILE [1 EQ 1] X1 / END1", 0, "a loop (WHILE … DO) has no END"),
        ("WHILE [1 EQ 1] DO1 / END2", 0, "a loop (WHILE … DO) has no END"),
        ("DO 3", 0, "a loop (WHILE … DO) has no END"),
        ("END1 / DO1", 0, "END has no WHILE … DO before it"),
        ("WHILE [1 EQ 1] X DO1 / END1", 0, "WHILE needs its DO 1"),
    ],
)
def test_a_statement_without_its_other_half_is_refused(text: str, line: int, message: str) -> None:
    with pytest.raises(BlockError) as refused:
        step(text, line)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("line", "statement"),
    [
        ("IF [#1 EQ 2] GOTO 5 (a)", ("IF", "[#1 EQ 2] GOTO 5")),
        ("n10 while [1] do1", ("WHILE", "[1] do1")),
        ("(x) /2 N5 GOTO 7", ("GOTO", "7")),
        ("/GOTO7", ("GOTO", "7")),
        ("DO 1", ("DO", "1")),
        ("END1", ("END", "1")),
        ("IF #1", None),
        ("END", None),
        ("DO X", None),
        ("X1 GOTO 5", None),
        ("G1 X5", None),
    ],
)
def test_a_line_is_a_statement_by_its_first_word(line: str, statement: tuple[str, str] | None) -> None:
    assert parse_statement(line) == statement


def test_lines_of_other_kinds() -> None:
    commands = {
        "$H": "$H", " $J=G91 X1": "$J=", "$132=300": "$132=", "$$": "$$", "$#": "$#", "$RST=*": "$RST=", "$0": "",
        "G0 X1 $0": "", "": "", "$N0=G20": "$N0=",
    }  # fmt: skip
    assert {line: board_command(line) for line in commands} == commands
    for line, output in (("DPRNT[X]", True), ("N5 popen", True), ("/BPRNT [a]", True), ("PCLOS", True)):
        assert sends_data(line) is output
    assert not sends_data("DPRNTS") and not sends_data("X1 DPRNT[X]")
    assert has_statements(["X1", "GOTO 5"]) and has_statements(["if [1] goto 5"]) and has_statements(["goto 5"])
    assert not has_statements(["X[1]"]) and not has_statements(["X1 GOTO 5"]) and not has_statements(["DO 1"])
    assert code_without_spaces("N5 G1 (a (b)) X 1 ; c") == "N5G1X1"
    assert code_without_spaces("G1 (a X1") == "G1(aX1"


def test_targets_of_jumps_are_known_by_their_lines() -> None:
    lines = ["N1", "N2 X1", "(a) N3", "GOTO 2", "M99 P4", "N4", "m 97 P5", "N5"]
    jumps = Jumps(lines, ProgramParameters())
    assert [line for line in range(8) if jumps.is_jump_target(line)] == [1, 5, 7]
    assert [jumps.line_number_text(line) for line in range(4)] == ["N1", "N2", "N3", ""]
    assert jumps.line_number_text(5) == "N4" and Jumps(["N007 X1"], ProgramParameters()).line_number_text(0) == "N7"
    # A computed target, or M99 alone, may lead to any numbered line.
    for jump in ("GOTO #1", "M99 P#1", "GOTO [1]"):
        anywhere = Jumps(["N1", "X1", "N3", jump], ProgramParameters())
        assert [line for line in range(4) if anywhere.is_jump_target(line)] == [0, 2]
    none = Jumps(["N1", "(GOTO 1)", "GOTO 9"], ProgramParameters())
    assert not any(map(none.is_jump_target, range(3)))
