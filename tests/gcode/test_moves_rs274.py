"""The interpreter against LinuxCNC's own, with both policies: the same moves from the same text."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind, Toolpath
from rs274_moves import PRINTED, RECORDED, assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274

START = "G21 G90 G17 F100\nG0 Z10\nG0 X0 Y0\n"

#: Programs that both policies read.
PLAIN = {
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
    "inverse time": "G93 G1 X10 F2 / G1 Y10 Z3 F0.5 / G94 G1 X0 F100",
    "machine coordinates": "G53 G0 Z0 / G0 X5 / Z3 / G91 G28 Z5 / G90 G28 X3 Y3 / G0 Z5 X1 / G28",
    "tools and dwells": "T1 M6 / G43 H1 Z7 / M3 S1000 / G4 P1.5 / G1 X5 / G49 / T2 M6 / G43 H2 / G0 Z9 / M9 / M5",
    "words crammed": "n10g0x1y.5 / g1x2.y+3.f50 / N20 G00X0Y0(hole; one)Z1 ; go / X5 (a) Y6 (b)",
    "plain lines of all kinds": "G1X5Y5 / X6.5 / Y-.5Z+3. / G0X1 / G00 X2 Y2 / G01 Z-1 F50 / G3 X4 Y2 I1 J0 F70"
    " / G2 X2 I-1 / G1 F20 / X9 / N20 X10 Y10 / G1 X11 (a) / x12 ; b",
    "inches": "G20 / G0 X1 Y1 Z.5 / G1 Z-.1 F5 / X2 / G2 X2 Y1 I.5 J0 / G0 Z.5 / G99 G83 X3 Y2 Z-.5 R.1 Q.2"
    " / G80 / G21 G0 X5 / G1 X6 F100",
    "series that begins high": "G99 G81 X5 Z-3 R2 / X9 R6 / G98 X12 / G99 X15 R2 / G98 X18 R8 / X20 R4 / G99 X22"
    " / X25 R12 / X27 R3 / G98 X30 R2 / X33 R7 / G99 X35 R1 / G82 X38 R4 Z-2 P0.1 / G80 / G99 G83 X40 R6 Z-2 Q1"
    " / G98 X42",
    "series that begins low": "G0 Z3 / G99 G81 X5 Z-3 R2 / X9 R6 / X12 R4 / G98 X15 R5 / X17 R2 / G80 / G98 G82 X20 Z-3"
    " R9 P0.1 / X25 R7 / G99 X28 R3 / X30 R8 / G0 Z1 / G98 G85 X33 Z-1 R4 / X35 R2",
    "corners": "G61 / G1 X1 / G61.1 / X2 / G64 / X3 / G64 P0.1 / X4 / G64 P0.1 Q0.05 / X5",
    "messages": "(MSG,hello) / G1 X1 (debug,#1) / (print,x) / X2",
    "words apart": "g1 x 1.5 / N10 X +3 Y.5 / t1m6 / X4.",
}
#: Programs that only the policy for foreign programs reads.
FOREIGN = {
    "cycles": "G98 G81 X1 Y1 Z-3 R2 / X2 / Y2 Z-4 / G99 X3 R3 / G82 X4 Z-2 R1 P0.5 / X5 P0.2 / G80 / G0 Z8"
    " / G83 X5 Y5 R1 Z-10 Q3 / X6 Q4 / G73 X7 Y7 Z-9 R0.5 Q2.2 / G85 X3 Z-2 R0.5 / G80 G0 Z9"
    " / G91 G81 X1 Y1 R-1 Z-3 L3 / G90 G80",
    "bore and ream": "M3 S100 / G86 X1 Y1 R2 Z-1 P0.5 / X2 / G89 X3 R1 Z-2 P0.25 / Y3 / G85 X4 R1 Z-3 / G84 X5 R1 Z-3",
    "origins": "G0 X1 Y1 / G92 X10 / X11 Y2 / X10 / G92.1 / X3 Y3 Z3 / G52 X5 Y5 / X1 Y1 / G52 X0 Y0 / X2 Y2"
    " / G10 L20 P1 X7 Y7 / X8 Y8 / G10 L2 P1 X0 Y0 / X1 Y1 Z1 / G10 L2 P3 X5 / X2 / G55 / X3 Y3 Z3 / G59.3 / X4 Y4 Z4"
    " / G54 / X1 Y1 Z1 / G92 X2 Y2 Z2 / G92.2 / X1 Y1 Z1 / G92.3 / X4 Y4 Z4",
    "lengths by value": "G43.1 Z3 / G0 Z5 / X4 / G49 / Z6 / X1",
    "radius compensation": "G41.1 D0 / G1 X2 Y2 / X5 / G40 / X6 / G42.1 D0 / G1 X7 Y7 / G2 X9 I1 / G40 G1 X10",
    "switches and pallets": "M48 / M49 / M50 P0 / M51 P1 / M52 P1 / M53 P1 / G1 X3 / M60 / M1 / M62 P1 / X4"
    " / M63 P1 / M64 P1 / M65 P1 / X5 / M19 R30 / M67 E0 Q1 / M68 E1 Q2 / X6 / M61 Q3 / X7",
    "spindles": "M3 S100 $0 / G1 X1 / S200 $0 / M5 $0 / X2 / G96 D2000 S30 / X3 / G97 S100 / X4",
    "subprograms": "M98 P100 L2 / G1 X1 / M98 P0200 / G1 X2 / M2 / O100 / G91 G1 Y1 / G90 / M99 / O200 / G1 X7"
    " / M98 P100 / M99",
    "subroutines": "o100 sub / #5=[#1+#2] / G1 X#5 Y#1 / o100 endsub / o<go> sub / o101 if [#1 GT 2]"
    " / o<go> return [7] / o101 endif / G1 X#1 / o<go> endsub [3] / #5=1 / o100 call [1] [2] / G1 X#5"
    " / o<go> call [1] / G1 X[#<_value>+20] / o<go> call [3] / G1 X[#<_value>+20] Y#<_value_returned>",
    "conditions": "o1 if [1 GT 2] / G1 X1 / o1 elseif [2 EQ 2] / X2 / o1 else / X3 / o1 endif / o2 if [0] / X4"
    " / o2 else / X5 / o2 endif / o3 if [1] / X6 / o3 elseif [1] / X7 / o3 endif / o4 if [0] / X8 / o4 endif / X9",
    "loops": "#1=0 / o5 do / #1=[#1+1] / G1 Y#1 / o5 while [#1 LT 3] / #1=0 / o1 while [#1 LT 5] / #1=[#1+1]"
    " / o2 if [#1 EQ 2] / o1 continue / o2 endif / o3 if [#1 EQ 4] / o1 break / o3 endif / G1 X#1 / o1 endwhile"
    " / o6 repeat [3] / #1=[#1+1] / G1 Z#1 / o6 endrepeat / o7 repeat [0] / G1 X99 / o7 endrepeat / o8 repeat [2.6]"
    " / #1=[#1+1] / G1 X#1 / o8 endrepeat",
    "loops in subroutines": "o<one> sub / o3 if [#1 GT 1] / o<one> call [#1-1] / o3 endif / #100=[#100+1]"
    " / G1 X#100 / o2 repeat [#1] / Y#100 / Y0 / o2 endrepeat / o<one> endsub / #100=0 / o<one> call [3] / G1 Y5",
    "names": "#<a b>=3 / #<_All>=4 / #<i>=[#<AB>+1] / G1 X#<ab> Y#<_all> / X#<i>"
    " / Y[EXISTS[#<ab>]] X[exists[#<no>]] / #1=5 #2=[#<i>*2] / X#1 Y#2 / #3=6 / ##3=9 / X#[2*3] / X-#1 Y+#2"
    " / Xsin[30] Yatan[1]/[1] / X#5420 Y#<_y> / X#<_metric> Y#<_absolute>",
    "assignment after the block": "#1=3 / #1=5 G1 X#1 / X#1 / #1=7 #1=8 / X#1",
    "deleted": "/G1 X1 / X2 / /N30 X3 / Y5",
    "stop of a cycle": "G81 X1 Y1 R1 Z-1 / G0 X5 / G81 X6 R1 Z-1 / G1 X7 F50 / G80 / G0 X8",
    "reference points": "G53 G0 Z0 / G0 X5 Y5 / Z3 / G91 G28 Z5 / G90 G28 X3 Y3 / G0 Z5 X1 Y1 / G28"
    " / G0 X1 Y1 Z1 / G30 Z6 / G0 Z4 / G28.1 / G30.1",
}
PROGRAMS = PLAIN | FOREIGN


def text_of(name: str) -> str:
    """Return a program with its start and end."""
    return START + PROGRAMS[name].replace(" / ", "\n") + "\nM2\n"


def paths_of(text: str, *, plain: bool, name: str = "program") -> list[Toolpath]:
    """Return the path of a program, and that of the strict policy if it is plain."""
    path = interpret_program(text, load_dialect("linuxcnc"), name).path
    return [path, interpret_own_program(text, load_dialect("linuxcnc"), name)] if plain else [path]


@pytest.mark.parametrize("name", PROGRAMS)
def test_every_construct_makes_the_same_moves_as_in_linuxcnc(name: str) -> None:
    """Ends, centres, turns, feeds and dwells agree with rs274 to the printed decimals."""
    for path in paths_of(text_of(name), plain=name in PLAIN):
        ours = moves_of_toolpath(path)
        assert len(ours) > 2
        assert_same_moves(ours, RECORDED[name], PRINTED["inch" if "G20" in PROGRAMS[name] else "mm"])


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_recorded_moves_are_those_of_linuxcnc(rs274: str, tmp_path: Path, name: str) -> None:
    status, output = run_rs274(rs274, text_of(name), tmp_path)
    assert status == 0, output[-300:]
    assert [list(move) for move in moves_of_rs274(output)] == RECORDED[name]


#: Blocks after `START`, and whether LinuxCNC accepts them.
BLOCKS = {
    "G18 / G41 D0": True, "G18 G41 D0": True, "G41 D0 / G18": False, "G19 G42 D0": False, "G43 H1 G41 D0": False,
    "G55 G41 D0": False, "G98 G41 D0": False, "G41 D0 / G40 G18": False,
    "G61 P1": False, "G61.1 P1": False, "G64 P1": True, "G64 Q1": True, "G61 Q1": False, "G54 P1": False, "P1": False,
    "G1 X1 P1": False, "G1 X1 Q1": False, "G1 X1 / X2 P1": False, "M3 S1 P1": False, "M3 S1 Q1": False, "G90 P1": False,
    "G2 X1 Y1 I.5 J.5 P1": True, "G2 X1 Y1 I.5 J.5 / P2": False, "G2 X1 Y1 I.5 J.5 / X2 Y2 I.5 J.5 P1": True,
    "G82 X1 Z-1 R1 P1 / P2": False, "G82 X1 Z-1 R1 P1 / X2 P2": True, "G81 X1 Z-1 R1 P1": False,
    "G83 X1 Z-1 R1 Q1 / X2 Q.5": True, "G83 X1 Z-1 R1 Q1 / Q.5": False, "G4 P1": True, "G10 L20 P1 X0": True,
    "M64 P1": True, "M64 P1 G1 X1": True, "M62 P1 Q1": False, "M68 E1 Q1": True, "M52 P1": True, "G92 X1 P1": False,
    "M50 P1": True, "M51 P0": True, "M53 P1": True, "M19 R30 Q1": True, "M19 R30 P1": True,
    "M67 E0 Q1": True, "T1 M6 / M61 Q1": True,
}  # fmt: skip


def accepted(text: str) -> bool:
    """Return whether leafcut sees no block that LinuxCNC refuses."""
    program = interpret_program(f"{START}{text.replace(' / ', chr(10))}\nM2\n", load_dialect("linuxcnc"))
    return not any("refused by LinuxCNC" in said.text for said in program.descriptions.values())


@pytest.mark.parametrize("text", BLOCKS)
def test_blocks_that_linuxcnc_refuses_are_known(text: str) -> None:
    assert accepted(text) == BLOCKS[text]


def test_the_recorded_refusals_are_those_of_linuxcnc(rs274: str, tmp_path: Path) -> None:
    texts = {text: f"{START}{text.replace(' / ', chr(10))}\nM2\n" for text in BLOCKS}
    assert {text: run_rs274(rs274, whole, tmp_path)[0] == 0 for text, whole in texts.items()} == BLOCKS


def test_what_linuxcnc_refuses_we_refuse(rs274: str, tmp_path: Path) -> None:
    """Blocks that rs274 stops at are errors here, too."""
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
        text = f"{START}{line}\nM2\n"
        status, _ = run_rs274(rs274, text, tmp_path)
        assert status == 1, line
        with pytest.raises(ReadError):
            interpret_own_program(text, load_dialect("linuxcnc"))


#: What rs274 takes, with a table of all tools. lcnc_cam_nisley has a tool table of its own for G41.
PLAIN_FILES = [
    "camotics_buildbotics.gcode",
    "camotics_scorpion.nc",
    "cncjs_jsdc_laser.gcode",
    "gsender_kb35.nc",
    "lcnc_test_12mmflat.ngc",
    "pcb2gcode_easysdr_drill.ngc",
    "pcb2gcode_easysdr_outline.ngc",
    "pcb2gcode_multivibrator_drill.ngc",
    "pcb2gcode_project_controller_milldrill.ngc",
    "pcb2gcode_slots_drill_metric.ngc",
    "ugs_enclosure_cambam.nc",
]
FOREIGN_FILES = [
    "bcnc_sample.gcode",
    "camotics_genes_encoder.ngc",
    "camotics_heart_cutout.ngc",
    "lcnc_bezel.ngc",
    "ugs_serial_stress.gcode",
]


@pytest.mark.parametrize("name", PLAIN_FILES + FOREIGN_FILES)
def test_real_programs_make_the_same_moves_as_in_linuxcnc(rs274: str, tmp_path: Path, data: Path, name: str) -> None:
    """Programs of other CAMs: every move ends where rs274 ends it; those without an end get one for rs274."""
    text = (data / "gcode" / name).read_text(encoding="utf-8", errors="replace")
    paths = paths_of(text, plain=name in PLAIN_FILES, name=name)
    ended = Kind.END in paths[0].kind or "%" in text
    status, output = run_rs274(rs274, text if ended else text + "\nM2\n", tmp_path)
    assert status == 0, output[-300:]
    theirs, tolerance = moves_of_rs274(output), PRINTED["inch" if "CANON_UNITS_INCHES" in output else "mm"]
    for path in paths:
        assert_same_moves(moves_of_toolpath(path), theirs, tolerance)


def test_a_line_that_a_test_has_broken_on_purpose_is_refused(data: Path) -> None:
    """With its place."""
    name = "gsender_invalid_gcode.nc"
    text = (data / "gcode" / name).read_text(encoding="utf-8", errors="replace")
    with pytest.raises(ReadError, match=re.escape(f"{name}:200: the number of D is out of range")):
        interpret_program(text, load_dialect("linuxcnc"), name)


@pytest.mark.parametrize("name", ["lcnc_plasmac_pipe.ngc", "lcnc_plasmac_ramp_pierce.ngc"])
def test_real_programs_with_pins_of_the_machine_are_read_and_what_hangs_on_them_is_kept(data: Path, name: str) -> None:
    """Blocks with numbers that only the machine knows are barriers, and their positions are unknown."""
    text = (data / "gcode" / name).read_text(encoding="utf-8", errors="replace")
    program = interpret_program(text, load_dialect("qtplasmac"), name)
    hidden = [b for b, line in enumerate(program.line.tolist()) if "_hal[" in program.lines[line - 1]]
    assert hidden and all(b in program.fixed for b in hidden)


@pytest.mark.parametrize("name", ["lcnc_cam_nisley.ngc", "cncjs_helical_thread.gcode"])
def test_real_programs_that_rs274_cannot_judge_are_read(data: Path, name: str) -> None:
    """Radius compensation with a custom tool table, and a program that starts at the current position of the tool."""
    text = (data / "gcode" / name).read_text(encoding="utf-8", errors="replace")
    program = interpret_program(text, load_dialect("linuxcnc"), name)
    assert program.n_blocks > 10
    assert Kind.RADIUS in program.path.kind
