"""Blocks that LinuxCNC rejects although their meaning is clear: the verdicts of rs274, LinuxCNC 2.9."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from rs274_moves import run_rs274

#: Lines, separated by ` / `; the last one is rejected, or none.
REJECTED = [
    "G1 X1 G1",
    "G1 X1 G0",
    "M3 S100 M3",
    "M7 M7",
    "G1 N5 X1",
    "N5 N6 G1 X1",
    "G1 X1 O5",
    "G41 D1 / G41 D1",
    "G41 D1 / G42 D1",
    "G41.1 D1 / G41 D2",
    "G41 D1 / G1 X5 / G55",
    "G41 D1 / G1 X5 / G54",
    "G41 D1 / G1 X5 / G43 H1",
    "G41 D1 / G1 X5 / G49",
    "G41 D1 / G1 X5 / G98",
    "G41 D1 / G1 X5 / G99",
    "G41 D1 / G1 X5 / G18",
    "G42 D1 / G1 X5 / G19",
    "G41.1 D1 / G1 X5 / G55",
    "G41 D1 G55",
    "G41.1 D1 L5",
    "G41.1 D1 L0",
    "G15",
    "G50",
    "G69",
    "G94 / G1 X1",
    "G95 / G1 X1",
    "G94 / G80 / X1",
    "G94 / G1",
    "G93 / G1 X1",
    "G93 / G1 X1 F5 / X2",
    "G93 / G81 X1 Z-1 R1",
    "G93 / G81 X1 Z-1 R1 F5",
    "G94 / G81 X1 Z-1 R1",
    "G94 / G1 A5",
    "G94 / G1 U5",
    "G0 G28 X1",
    "G1 G28 X1",
    "G0 G30 X1",
    "G81 X1 Z-1 R1 P1",
    "G81 X1 Z-1 R1 Q1",
    "G82 X1 Z-1 R1 P1 Q1",
    "G83 X1 Z-1 R1 Q1 P1",
    "G73 X1 Z-1 R1 Q1 P1",
    "G85 X1 Z-1 R1 P1",
    "G85 X1 Z-1 R1 Q1",
    "G86 X1 Z-1 R1 P1 Q1",
    "M3 S100 / G84 X1 Z-1 R1 Q1",
    "G81 X1 Z-1 R1 / X2 P1",
    "G81 X1 Z-1 R1 / X2 Q1",
    "G5.3",
    "G1 X1 / G5.3",
    "G5.2 X1 Y1 P1 L3 / X1 Y2 P1 / X2 Y2 P1 / G5.3 / G5.3",
    "M7 M8",
    "G41.1",
    "G42.1",
    "G41 D1.5",
    "G41 D1 / G1 X500 / G53 G0 X1",
    "G41 D0 / G1 X500 / G28",
    "G41 D0 / G1 X500 / G30 X5",
    "T1 / G41 D0 / G1 X500 / M6",
    "G41 D0 / G1 X500 / G92 X1",
    "G41 D0 / G1 X500 / G52 X1",
    "G41 D0 / G1 X500 / G10 L2 P1 X1",
    "G41 D0 / G1 X500 / G10 L20 P1 X1",
    "G41 D0 / G1 X500 / G81 X600 Z-1 R1",
    "G41 D0 / G1 X500 / G61",
    "M3 S100 / G86 X1 Z-1 R1",
    "M3 S100 / G89 X1 Z-1 R1",
    "M5 / G86 X1 Z-1 R1 P1",
    "M5 / G84 X1 Z-1 R1",
    "M4 S100 / G84 X1 Z-1 R1",
    "G10 L2 P10 X1",
    "G10 L20 P10 X1",
]
ACCEPTED = [
    "N5 G1 X1",
    "G41 D1 / G40",
    "G40",
    "G40 G55",
    "G55",
    "G8",
    "G7",
    "G94 F50 / G1 X1",
    "G95 F1 M3 S100 / G1 X1 / G94 F100 / G1 X2",
    "G94 / G0 X1",
    "G94 / G1 X1 F5 / X2",
    "G94 / F5 / G1 X2",
    "G94 / X1",
    "G93 / G1 X1 F5",
    "G93 / G1 F5 X1 / X2 F5",
    "G93 / G0 X1",
    "G93 / X5",
    "G94 / G81 X1 Z-1 R1 F5",
    "G94 / G81 X1 Z-1 R1 F5 / X2",
    "G94 / G0 X1 / Y1",
    "G28 X1",
    "G28",
    "G0 G4 P1",
    "G2 X1 Y0 I.5 P1",
    "G82 X1 Z-1 R1 P1",
    "G83 X1 Z-1 R1 Q1",
    "G73 X1 Z-1 R1 Q1",
    "G85 X1 Z-1 R1",
    "M3 S100 / G89 X1 Z-1 R1 P1",
    "M3 S100 / G84 X1 Z-1 R1 P1",
    "G82 X1 Z-1 R1 P1 / X2 P2",
    "G80",
    "G64 P1",
    "G64 P1 Q1",
    "G64 P.1 / X1",
    "G4 P1",
    "G10 L2 P1 X0",
    "M62 P1",
    "M66 P0 L0",
    "M66 P0 L3 Q1",
    "G81 X1 Z-1 R1 / G4 P1",
    "G81 X1 Z-1 R1 / M62 P1",
    "G81 X1 Z-1 R1 / G64 P1",
    "G5.2 X1 Y1 P1 L3 / X1 Y2 P1 / X2 Y2 P1 / G5.3 / G1 X3",
    "G5.2 X1 Y1 P1 L3 / X1 Y2 P1 / X2 Y2 P1 / G1 X3",
    "M7 / M8",
    "G41 D0 / G1 X500 / G53 G0 X1",
    "G41 D1 / G1 X500",
    "G41 D0 / G1 X500 / G92.1",
    "G41 D0 / G1 X500 / G91",
    "G41 D0 / G1 X500 / G4 P1",
    "G41 D0 / G1 X500 / M3 S100",
    "G41 D0 / G1 X500 / G20",
    "M3 S100 / G86 X1 Z-1 R1 P1 / X2",
    "M3 S0 / G84 X1 Z-1 R1",
    "G84 X1 Z-1 R1 M3 S100",
    "G10 L2 P9 X1",
]


def text_of(lines: str) -> str:
    """Return a program with these lines."""
    return "G21 G90 G17 F100\nG0 Z10\nG0 X0 Y0\n" + lines.replace(" / ", "\n") + "\nM2\n"


def is_rejected(lines: str, name: str = "linuxcnc") -> bool:
    """Return whether the reader refuses the lines, or marks one as refused by LinuxCNC."""
    try:
        program = interpret_program(text_of(lines), load_dialect(name))
    except ReadError:
        return True
    return any("refused by LinuxCNC" in said.text for said in program.descriptions.values())


@pytest.mark.parametrize("lines", REJECTED)
def test_a_block_that_linuxcnc_rejects_is_rejected(lines: str) -> None:
    assert is_rejected(lines)


@pytest.mark.parametrize("lines", ACCEPTED)
def test_a_block_that_linuxcnc_accepts_is_accepted(lines: str) -> None:
    assert not is_rejected(lines)


@pytest.mark.parametrize("name", ["plasma", "qtplasmac"])
def test_the_plasma_dialects_run_on_linuxcnc(name: str) -> None:
    assert is_rejected("G55 G55", name) and not is_rejected("G55", name)


@pytest.mark.parametrize("name", ["mach3", "grbl"])
def test_other_controllers_have_their_own_rules(name: str) -> None:
    assert not is_rejected("G1 X1. N5 G1", name)


@pytest.mark.parametrize("lines", [*REJECTED, *ACCEPTED])
def test_the_verdicts_are_those_of_linuxcnc(rs274: str, tmp_path: Path, lines: str) -> None:
    status, _ = run_rs274(rs274, text_of(lines), tmp_path)
    assert status == (lines in REJECTED)
