"""The interpreter against LinuxCNC's own: the same moves from the same text."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.gcode.dialects import dialect
from leafcut.gcode.own_program import interpret
from rs274_moves import PRINTED, RECORDED, assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274
from shared_data import DATA

GCODE = DATA / "gcode"

START = "G21 G90 G17 F100\nG0 Z10\nG0 X0 Y0\n"

PROGRAMS = {
    "arcs with IJ": "G2 X10 Y0 I5 J0 / G3 X20 Y10 J10 / G3 X20 Y10 I-5 / G2 X25 Y5 I5 J0 / G1 X0 Y0",
    "arcs with R": "G2 X10 Y0 R5 / G2 X15 Y5 R5 / G3 X10 Y10 R-5 / G3 X12 Y18 R30 / G2 X0 Y0 R-15",
    "helices and turns": "G2 X0 Y0 Z5 I5 P3 / G3 X10 Y0 Z1 I5 P2 / G3 X10 Y0 Z2 I-5 J0",
    "arcs in XZ": "G18 G2 X10 Z10 I5 K0 / G3 X0 Z10 R5 / G2 X0 Z20 Y3 K5 / G3 X5 Z25 R-5",
    "arcs in YZ": "G19 G3 Y10 Z10 J5 K0 / G2 Y0 Z10 R7 / G2 X4 Y0 Z20 K5 / G3 Y4 Z24 R-4",
    "absolute centres": "G90.1 G2 X10 Y0 I5 J0 / G3 X0 Y0 I5 J0 / G91.1 G2 X10 Y0 I5",
    "incremental moves": "G91 G0 X5 / G1 Y5 Z-3 / X-2 / G2 X10 Y0 I5 / G90 X0 Y0 I-6.5 J-2.5 F80 / G1 X1",
    "planes of retract": "G99 G81 X10 Y0 Z-5 R2 / X20 / G80 / G98 G81 X30 Z-5 R3 / X40 Y5 / Z-6 / R1 X50",
    "start below R": "G0 Z-4 / G99 G81 X5 R2 Z-6 / X6 / G80 / G0 Z-4 / G98 G81 X7 R2 Z-6 / X8 / R5 X9",
    "repeats": "G91 G99 G81 X5 Y1 R-8 Z-4 L3 / X-3 L2 / G80 / G90 G0 Z10 / G98 G91 G82 X5 R-7 Z-4 P0.25 L2",
    "repeats in place": "G98 G83 X5 Y1 R2 Z-4 Q2.5 L2",
    "pecks": "G99 G83 X5 Y5 R1 Z-10 Q3 / X6 Q4 / Y6 Z-11 / G80 / G98 G73 X7 Y7 Z-9 R0.5 Q2.2 / G80",
    "exact pecks": "G99 G83 X5 Y5 R1 Z-8 Q3 / G73 X6 Y5 R1 Z-9 Q2.5 / G83 X7 Y5 R0 Z-1 Q5",
    "dwell, ream, tap": "G99 G82 X1 Y1 Z-1 R1 P0.5 / X2 / G85 X3 Z-2 R1 / S100 M3"
    " / G84 X4 Z-3 R1 / G80 / G0 Z9 / G99 G84 X5 Z-3 R2 P0.3",
    "inches": "G20 / G0 X1 Y1 Z.5 / G1 Z-.1 F5 / G2 X2 Y1 I.5 J0 / G0 Z.5 / G99 G83 X3 Y2 Z-.5 R.1 Q.2"
    " / G80 / G21 G0 X5",
    "inverse time": "G93 G1 X10 F2 / G1 Y10 Z3 F0.5 / G94 G1 X0 F100",
    "machine coordinates": "G53 G0 Z0 / G0 X5 / Z3 / G91 G28 Z5 / G90 G28 X3 Y3 / G0 Z5 X1 / G28",
    "tools and dwells": "T1 M6 / G43 H1 Z7 / M3 S1000 / G4 P1.5 / G1 X5 / G49 / T2 M6 / G43 H2 / G0 Z9 / M9 / M5",
    "words crammed": "n10g0x1y.5 / g1x2.y+3.f50 / N20 G00X0Y0(hole; one)Z1 ; go / X5 (a) Y6 (b)",
}


def text_of(name: str) -> str:
    """Return a program with its start and end."""
    return START + PROGRAMS[name].replace(" / ", "\n") + "\nM2\n"


@pytest.mark.parametrize("name", PROGRAMS)
def test_little_programs_make_the_same_moves_as_in_linuxcnc(name: str) -> None:
    """Ends, centres, turns, feeds and dwells agree with rs274 to the printed decimals."""
    ours = moves_of_toolpath(interpret(text_of(name), dialect("linuxcnc")))
    assert len(ours) > 2
    assert_same_moves(ours, RECORDED[f"own {name}"], PRINTED["inch" if "G20" in PROGRAMS[name] else "mm"])


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_recorded_moves_are_those_of_linuxcnc(rs274: str, tmp_path: Path, name: str) -> None:
    status, output = run_rs274(rs274, text_of(name), tmp_path)
    assert status == 0, output[-300:]
    assert [list(move) for move in moves_of_rs274(output)] == RECORDED[f"own {name}"]


#: Real programs that rs274 takes and that use no parameters.
FILES = [
    "camotics_buildbotics.gcode",
    "camotics_scorpion.nc",
    "cncjs_jsdc_laser.gcode",
    "gsender_kb35.nc",
    "lcnc_test_12mmflat.ngc",
    "pcb2gcode_easysdr_outline.ngc",
    "pcb2gcode_multivibrator_drill.ngc",
    "pcb2gcode_project_controller_milldrill.ngc",
    "pcb2gcode_slots_drill_metric.ngc",
    "pcb2gcode_easysdr_drill.ngc",
    "ugs_enclosure_cambam.nc",
]


@pytest.mark.skipif(not GCODE.is_dir(), reason="the shared data folder is not there")
@pytest.mark.parametrize("name", FILES)
def test_real_programs_make_the_same_moves_as_in_linuxcnc(rs274: str, tmp_path: Path, name: str) -> None:
    """Programs of other CAMs: every move ends where rs274 ends it."""
    text = (GCODE / name).read_text(encoding="utf-8", errors="replace")
    status, output = run_rs274(rs274, text, tmp_path)
    assert status == 0, output[-300:]
    ours = moves_of_toolpath(interpret(text, dialect("linuxcnc"), name))
    assert_same_moves(ours, moves_of_rs274(output), PRINTED["inch" if "CANON_UNITS_INCHES" in output else "mm"])


def test_what_linuxcnc_refuses_we_refuse(rs274: str, tmp_path: Path) -> None:
    """Blocks that rs274 stops at are errors here, too."""
    from leafcut.errors import ReadError

    for line in [
        "G1 X3 F0",
        "G81 X1 Z-1",
        "G82 X1 Z-1 R1",
        "G83 X1 Z-1 R1",
        "G81 X1 Z2 R1",
        "G81 X1 Z-1 R1 L0",
        "G2 X10 Y0 I5.1",
        "G2 X10.1 Y0 R5",
        "G2 X0 Y0 R5",
        "G80 X5",
        "M3 M4",
        "G0 G1 X1",
        "X1 X2",
        "G1 X5 P1",
        "G93 G1 X6",
        "G91 G53 G0 X1",
        "G90.1 G2 X10 Y0 I5",
    ]:
        text = f"G21 G90 G17 F100\nG0 Z10\nG0 X0 Y0\n{line}\nM2\n"
        status, _ = run_rs274(rs274, text, tmp_path)
        assert status == 1, line
        with pytest.raises(ReadError):
            interpret(text, dialect("linuxcnc"))
