"""Changes that the proof once called the same work, or would by a small slip: each for ever."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from golden_differences import check_golden
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.certificate import Certificate
from leafcut.processes.program.proof.certificate import certify
from rs274_moves import run_rs274


class Fault(NamedTuple):
    """A program with lines separated by `` / ``; a part of it that is replaced once, and its replacement."""

    name: str
    dialect: str
    text: str
    old: str
    new: str


HOLE = "G0 X1 Y2 / G0 Z1 / G1 Z-1 F100 / G0 Z5"
HEAD = "G21 G90 G17 G40 G94 / S900 M3 / G0 Z5"
SWITCHED = "G21 G90 G17 G40 G80 G94 / T1 M6 / G43 H1 / S900 M3 / M8 / G0 X0. Y0. Z5. / G1 Z-1. F100."
SAFE = "G21 G90 G17 G40 G94 G80 G49 / S900 M3 / G0 Z5 / G0 X1 Y2 / G1 Z-1 F100 / G2 X5 I2 J0 / G0 Z5 / M5 / M2"
FANUC = "G21 G90 G17 G40 G94 / T1 M6 / S900 M3 / G0 Z5."
FANUC_HOLE = "G0 X1. Y2. / G0 Z1. / G1 Z-1. F100. / G0 Z5."


#: A beam that has just cut with its power on.
LIT = "G21 G90 / M3 S0 / G0 X0 Y0 / G1 X9 F900 S500"
#: A hole of 9 mm, and programs with stops before it.
X11 = "G0 X11 Y2 / G1 Z-9 F100 / G0 Z5"
STOPS = f"{HEAD} / {HOLE} / M0 / G0 Z7 / G0 Z20 / G0 X50 Y50 Z20 / M0 / {X11} / M2"
DEEP = f"{HEAD} / {HOLE} / G0 X5 / G0 X6 / M0 / G0 Z9 / {X11} / G0 X9 / Z20 / X8 / M2"
#: Text of a rapid down and up again, and its replacement.
DOWN = (
    ("as the program begins", "G0 Z5", "G0 Z-3 / G0 Z5"),
    ("on the way to the first hole", "G0 X1 Y2", "G0 X3 Y2 / Z-3 / Z5 / G0 X1 Y2"),
    ("over a hole deeper than the hole", "G0 X5", "Z-3 / Z5 / G0 X5"),
    ("on the way to a stop", "G0 X6", "Z-3 / Z5 / G0 X6"),
    ("on a slant on the way to a stop", "G0 X6", "X7 Z-3 / X5 Z5 / G0 X6"),
    ("at a stop", "M0", "Z-3 / Z5 / M0"),
    ("behind a stop", "M0", "M0 / G0 Z-3"),
    ("on the way from a stop", "G0 X11", "G0 X7 / Z-3 / Z9 / G0 X11"),
    ("on the way to the end", "Z20", "Z-3 / Z20"),
    ("at the end", "X8", "X8 / Z-3 / Z20"),
)


def after(head: str, block: str, hole: str = HOLE, end: str = "M2") -> str:
    """Return a program with a block between two holes."""
    return f"{head} / {hole} / {block} / {hole.replace('X1', 'X11')} / {end}"


def lcnc(name: str, block: str, old: str, new: str, head: str = HEAD) -> Fault:
    return Fault(name, "linuxcnc", after(head, block), old, new)


def haas(name: str, block: str, old: str, new: str, end: str = "M30", head: str = FANUC) -> Fault:
    return Fault(name, "haas", after(head, block, FANUC_HOLE, end), old, new)


#: Another hole, with its position changed.
OTHER_HOLE = FANUC_HOLE.replace("X1", "X5")
LATER = (f"N10 {FANUC_HOLE} / {OTHER_HOLE}", f"{FANUC_HOLE} / N10 {OTHER_HOLE}")
SWAPPED = (f"N10 {FANUC_HOLE} / N11", f"N11 {FANUC_HOLE} / N10")
S_LASER = "S500 / G1 X10 F900 / S0 / G0 X50 Y50 / S800 / G1 X60 / S0"
O200 = "o200 sub / G1 X9 F100 / o200 endsub"
SUB = "M30 / O100 / G1 X#24 F100. / G91 G0 Z2. / G90 / M99"

#: What LinuxCNC refuses, though what is meant is clear.
REFUSED = [
    lcnc("G1 without a feed in the safe-start line", "M8", "G90 G17", "G90 G17 G1"),
    lcnc("G1 for the plane", "M8", "G21 G90 G17 G40", "G21 G90 G1 G40"),
    lcnc("G1 alone before any feed", "M8", "S900 M3", "S900 M3\nG1"),
    lcnc("a number behind a word", "M8", "S900 M3", "S900 M3 N5"),
    lcnc("a program's number behind a word", "M8", "G40 G94", "G40 G94 O100"),
    lcnc("M3 twice in a block", "M8", "S900 M3", "S900 M3 M3"),
    lcnc("M8 twice in a block", "M8", "M8", "M8 M8"),
    lcnc("an unknown word beside the end", "M8", "M2", "M2 G15"),
    lcnc("G94 again, which forgets F", "G1 Z0 F200 / X9 / G0 Z5", "F200\nX9", "F200\nG94\nX9"),
    lcnc("G94 again before a cycle", "G0 X5 / F150 / G81 X9 Z-2 R1 / G80", "F150\n", "F150\nG94\n"),
    lcnc("G1 without F in inverse time", "G93 / G1 X9 F2 / G94 F100 / G0 Z5", "F2\n", "F2\nG1\n"),
    *(
        lcnc(
            f"{word} under radius compensation", "G41.1 D3 / G1 X30 F100 / X60 / G40 / G0 Z5", "X60\n", f"X60\n{word}\n"
        )
        for word in ("G49", "G54", "G98")
    ),
    lcnc("G0 beside G28", "G28 Z20 / G0 Z5", "G28 Z20", "G0 G28 Z20"),
    lcnc("P of a cycle that has none", "G81 X9 Z-2 R1 F100 / G80", "R1 F100", "R1 P0 F100"),
    lcnc("Q of a cycle that has none", "G81 X9 Z-2 R1 F100 / G80", "R1 F100", "R1 Q0 F100"),
]

VERIFY_FAULTS = [
    # A parameter that supplies a word is compared as text.
    lcnc("G92 by a parameter", "#6=12 / G92 X#6", "#6=12", "#6=13"),
    lcnc("G92 by a parameter of a parameter", "#5=1 / #6=[#5+11] / G92 X#6", "#5=1", "#5=2"),
    lcnc("rotary by a parameter", "#3=0 / G0 A[#3+90]", "#3=0", "#3=1"),
    lcnc("rotary before a cycle", "#3=0 / G0 A[#3+90] / G81 X5 Y5 Z-2 R1 F100 / G80", "#3=0", "#3=15"),
    lcnc("rotary in a sub", "o1 sub / G0 A#1 / o1 endsub / o1 call [90]", "[90]", "[91]"),
    lcnc("rotary in a loop", "#1=0 / o2 repeat [3] / #1=[#1+30] / G0 A#1 / o2 endrepeat", "+30", "+31"),
    lcnc("feed of a rotary cut", "#2=100 / G1 X5 A90 F#2", "#2=100", "#2=200"),
    lcnc("G10 L1", "#1=5 / G10 L1 P1 Z#1", "#1=5", "#1=6"),
    lcnc("G10 L2", "#1=5 / G10 L2 P1 X#1", "#1=5", "#1=6"),
    lcnc("G10 L2 of another offset", "#1=5 / G10 L2 P3 X#1", "#1=5", "#1=6"),
    lcnc("number of the offset", "#1=3 / G10 L2 P#1 X5", "#1=3", "#1=4"),
    lcnc("G10 L2 R", "#1=5 / G10 L2 P1 R#1", "#1=5", "#1=6"),
    lcnc("G10 L10", "#1=5 / G10 L10 P1 Z#1", "#1=5", "#1=6"),
    lcnc("G10 L11", "#1=5 / G10 L11 P1 Z#1", "#1=5", "#1=6"),
    lcnc("G10 L20", "#1=5 / G10 L20 P1 X#1", "#1=5", "#1=6"),
    lcnc("G10 L20 from another place", "G0 X0 Y0 / G10 L20 P1 X5", "G0 X0 Y0", "G0 X1 Y0"),
    lcnc("G92 from another place", "G0 X0 Y0 / G92 X5", "G0 X0 Y0", "G0 X1 Y0"),
    lcnc("G28.1 from another place", "G0 X0 Y0 / G28.1 / G0 X2 Y2", "G0 X0 Y0", "G0 X1 Y0"),
    lcnc("G52", "#1=5 / G52 X#1", "#1=5", "#1=6"),
    lcnc("G54 to G59.3 by value", "#1=1 / G[54+#1]", "#1=1", "#1=2"),
    lcnc("G59.x by value", "#1=0.1 / G[59+#1]", "#1=0.1", "#1=0.2"),
    lcnc("G43.1", "#1=5 / G43.1 Z#1", "#1=5", "#1=6"),
    lcnc("H by a parameter", "#1=5 / G43 H#1", "#1=5", "#1=6"),
    lcnc("G33.1 K", "#1=1.5 / G33.1 Z-3 K#1", "#1=1.5", "#1=1.25"),
    lcnc("G33", "#1=1.5 / G33 Z-3 K#1", "#1=1.5", "#1=1.25"),
    lcnc("probe depth", "#1=-5 / G38.2 Z#1 F50", "#1=-5", "#1=-6"),
    lcnc("probe feed", "#1=50 / G38.2 Z-5 F#1", "#1=50", "#1=60"),
    lcnc("probe kind", "G38.2 Z-5 F50", "G38.2", "G38.3"),
    lcnc("M68", "#1=5 / M68 E0 Q#1", "#1=5", "#1=6"),
    lcnc("M62", "#1=0 / M62 P#1", "#1=0", "#1=1"),
    lcnc("user M code", "#1=0 / M101 P#1", "#1=0", "#1=1"),
    lcnc("what a user M code may read", "#200=1 / M101", "#200=1", "#200=2"),
    lcnc("block that may be skipped", "#1=5 / /G0 Z[#1+10]", "#1=5", "#1=6"),
    lcnc("parameter set in such a block", "/#1=5 / G0 A#1", "/#1=5", "/#1=6"),
    lcnc("EQ at 5e-5", "#1=1 / o1 if [#1 EQ 1.00005] / G1 X5 Z-2 F100 / o1 endif", "#1=1\n", "#1=1.0002\n"),
    lcnc("message", "(MSG, turn the part)", "turn", "leave"),
    lcnc("message gone", "(MSG, turn the part)", "(MSG, turn the part)", "(turn the part)"),
    lcnc("record of a parameter", "#1=5 / (PRINT, #1)", "#1=5", "#1=6"),
    # Active words in a block that is not understood.
    lcnc("S of G33.1", "S500 / G33.1 Z-3 K1.5 / S900", "S500", "S600"),
    lcnc("S of G76", "S500 / G76 P1 Z-9 I-1 J0.2 K1 R1.5 Q29.5 H3 E1 L0 / S900", "S500", "S600"),
    lcnc("H of a rotary cut", "G43 H1 / G0 A90 Z5 / G43 H2 / G0 Z5", "H1", "H2"),
    lcnc("D of a rotary cut", "G41 D1 / G1 X3 A90 F100 / G40", "D1", "D2"),
    lcnc("G64 P of a rotary cut", "G64 P0.1 / G1 X3 A90 F100 / G64 P0.05", "P0.1", "P0.2"),
    lcnc("F of a rotary cut", "F100 / G1 X3 A90 / F50", "F100", "F110"),
    lcnc("coolant of a rotary cut", "M8 / G1 X3 A90 F100 / M9", "M8", "M7"),
    lcnc("tool of a rotary cut", "T3 M6 / G1 X3 A90 F100 / T4 M6", "T3", "T5"),
    haas("S of a rotated pattern", "S500 / G68 X0. Y0. R30. / G1 X3. F100. / G69 / S900", "S500", "S600"),
    haas("angle of G68", "#1=30. / G68 X0. Y0. R#1 / G1 X3. F100. / G69", "#1=30.", "#1=31."),
    haas("factor of G51", "#1=2. / G51 X0. Y0. P#1 / G1 X3. F100. / G50", "#1=2.", "#1=3."),
    haas("G154", "#1=5 / G154 P#1", "#1=5", "#1=6"),
    haas("G12", "#1=3. / G12 I#1 F100. Z-1. D1", "#1=3.", "#1=4."),
    haas("S of G12", "S500 / G12 I3. F100. Z-1. D1 / S900", "S500", "S600"),
    haas("S of G70", "S500 / G70 I5. J0. L6 / S900", "S500", "S600"),
    haas("D with its point", "G65 P9001 A5.", "A5.", "A5"),
    # Macros.
    haas("moves after G66", "G66 P9010 A5. / G0 X30. / G0 X40. / G67", "X30.", "X31."),
    haas("moves after G66.1", "G66.1 P9010 A5. / G0 X30. / G0 X40. / G67", "X30.", "X31."),
    haas("argument of G66", "#1=5. / G66 P9010 A#1 / G0 X30. / G67", "#1=5.", "#1=6."),
    haas("text called by G65", "G65 P100 X5.", "Z2.", "Z3.", SUB),
    haas("text called by G66", "G66 P100 X5. / G0 X30. / G67", "Z2.", "Z3.", SUB),
    haas("text called by G150", "G150 P100 X5. Y5. Z-5. R1. Q1. I2. D1 G41", "Z2.", "Z3.", SUB),
    haas("text called by a computed M98", "M98 P#500", "Z2.", "Z3.", SUB),
    haas("text called by a computed G65", "#1=100 / G65 P#1", "Z2.", "Z3.", SUB),
    haas("text called by a computed M97", "M97 P#500", "Z2.", "Z3.", SUB.replace("O100", "N100")),
    Fault("text called by a Fagor", "fagor8055",
          "G71 G90 G17 / S900 M3 / (CALL 10) / G0 X1 Y2 Z5 / G1 Z-1 F100 / G0 Z5 / M30 / (SUB 10) / G1 X9 F100 / (RET)",
          "X9", "X8"),
    lcnc("sub that is called on a condition", f"{O200} / o1 if [#501] / o200 call / o1 endif", "X9", "X8"),
    lcnc("sub that is called in a loop", f"{O200} / o1 while [#501] / o200 call / o1 endwhile", "X9", "X8"),
    # Where a jump leads to that only the machine decides on.
    haas("goal of a jump back", f"N10 {FANUC_HOLE} / {OTHER_HOLE} / IF [#500 EQ 1] GOTO 10", *LATER),
    haas("goal of a jump that is computed", f"N10 {FANUC_HOLE} / N11 {OTHER_HOLE} / GOTO #500", *SWAPPED),
    haas("goal from which all begins again", f"N10 {FANUC_HOLE} / {OTHER_HOLE}", *LATER, "M99 P10"),
    haas("text called by what G65 calls", "G65 P50 X5.", "Z2.", "Z3.", SUB + " / O50 / G65 P100 X1. / M99"),
    haas("parameter of a macro in the control", "#101=5. / G65 P9001", "#101=5.", "#101=6."),
    # Ends.
    Fault("M30 made M99", "haas", after(FANUC, "M8", FANUC_HOLE, "M30"), "M30", "M99"),
    Fault("M30 made M99 in LinuxCNC", "linuxcnc", after(HEAD, "M8", HOLE, "M30"), "M30", "M99"),
    Fault("M30 made M2", "linuxcnc", after(HEAD, "M8", HOLE, "M30"), "M30", "M2"),
    Fault("G28 made G30", "linuxcnc", after(HEAD, "G28 Z5"), "G28", "G30"),
    Fault("another reference point", "haas", after(FANUC, "G30 P2 Z5.", FANUC_HOLE), "P2", "P3"),
    # A lone carriage return: LinuxCNC reads on in the same line.
    Fault("end of a comment", "linuxcnc", after(HEAD, "; go / G0 X3 / G1 Z-2 F100 / G0 Z5"), "; go\n", "; go\r"),
    Fault("end of a line", "linuxcnc", after(HEAD, "G1 Z-2 F50 / X9 / G0 Z5"), "F50\n", "F50\r"),
    Fault("end of a line elsewhere", "mach3", after(HEAD, "G1 Z-2 F50 / X9 / G0 Z5"), "F50\n", "F50\r"),
    # A height that is not known is not up.
    Fault("first moves swapped", "linuxcnc", f"G21 G90 / S900 M3 / G0 Z10 / G0 X0 Y0 / {HOLE} / M2",
          "G0 Z10\nG0 X0 Y0\n", "G0 X0 Y0\nG0 Z10\n"),
    Fault("first moves in one", "linuxcnc", f"G21 G90 / S900 M3 / G0 Z10 / G0 X0 Y0 / {HOLE} / M2",
          "G0 Z10\nG0 X0 Y0\n", "G0 X0 Y0 Z10\n"),
    Fault("first rise gone", "linuxcnc", f"G21 G90 / S900 M3 / G0 Z10 / G0 X0 Y0 / {HOLE} / M2", "G0 Z10\n", ""),
    Fault("length offset off for the middle of the way to a stop", "linuxcnc",
          f"{HEAD} / G43 H1 / G0 Z5 / {HOLE} / X50 / X55 / G0 Z5 / X60 / M0 / G43 H1 / G0 Z5 / G0 X11 Y2 / G1 Z-1 / "
          "G0 Z5 / M2", "X55", "G49 / X55"),
    # Rapids down beside the work, into what another cut is as deep in.
    *(Fault(f"rapid down {name}", "linuxcnc", DEEP, old, new) for name, old, new in DOWN),
    Fault("rapid down between two stops", "linuxcnc", STOPS, "G0 Z7", "G0 Z-2"),
    Fault("way between two stops begins lower", "linuxcnc", STOPS, "G0 Z20\n", "G0 Z6\n"),
    Fault("rapid down and up amid the way between two stops", "linuxcnc", STOPS,
          "G0 X50", "G0 X9 / Z-2 / Z20 / G0 X50"),
    Fault("low way there and back before a stop", "linuxcnc",
          f"{HEAD} / G0 X1 Y2 / G1 Z-1 F100 / Z1 / G0 X3 / G1 Z-1 / G0 Z5 / X6 / G1 Z-1 / Z1 / M0 / G0 Z5 / {X11} / M2",
          "M0", "G0 X9 / X6 / M0"),
    Fault("way from a stop begins lower", "linuxcnc", DEEP, "G0 Z9 / G0 X11 Y2", "G0 Z6 / G0 X11 Y2 Z9"),
    Fault("length offset off for the beginning of the way from a stop", "linuxcnc",
          f"{HEAD} / G43 H1 / G0 Z5 / {HOLE} / M0 / G0 X10 / G43 H1 / G0 Z5 / {X11} / M2", "G0 X10", "G49 / G0 X10"),
    Fault("rise on a slant in a series of LinuxCNC", "linuxcnc",
          "G21 G90 G17 / S900 M3 / G0 Z20 / G99 G81 X1 Y2 Z-3 R2 F100 / G0 Z10 / G99 G81 X20 Y2 Z-3 R10 / G80 / G0 Z20",
          "G0 Z10\nG99 G81", "G99 G81"),
    # The safe-start line.
    *(Fault(f"{word} deleted", "linuxcnc", SAFE, f" {word}", "") for word in ("G90", "G17", "G40", "G94", "G49")),
    Fault("G90 after the first move", "linuxcnc", "G21 / G90 / G0 Z5 / S900 M3 / " + HOLE, "G90\nG0 Z5", "G0 Z5\nG90"),
    Fault("G69 deleted", "haas", after("G69 / " + FANUC, "M8", FANUC_HOLE, "M30"), "G69\n", ""),
    Fault("rise gone before another work offset", "linuxcnc",
          f"{HEAD} / {HOLE} / #1=1.5 / G33 Z5 K#1 / G0 Z20 / G10 L2 P2 X5 / G55 / {HOLE} / M2", "K#1\nG0 Z20", "K#1"),
    lcnc("dwell in the cut", "G93 / G0 Z2 / G1 X45 A30 F6 / G94 / G0 Z20 / G4 P0.26",
         "G0 Z20\nG4 P0.26", "G4 P0.26\nG0 Z20"),
    lcnc("G49 after G43.1", "G43.1 Z5 / G0 Z20 / G49 / G0 Z20", "G49\n", ""),
    Fault("rapid down after G49", "linuxcnc", f"{HEAD} / G43 H1 / G0 Z20 / {HOLE} / G49 / G0 Z20 / G0 Z20 / M2",
          "G49\nG0 Z20\n", "G49\nG0 Z0\n"),
    Fault("length offset left on at the end", "linuxcnc", f"{HEAD} / G43 H1 / G0 Z20 / {HOLE} / G49 / G0 Z20 / M2",
          "G49\n", ""),
    lcnc("compensation twice, refused by LinuxCNC", "G41.1 D3 / G0 X20 / G40", "G41.1 D3\n", "G41.1 D3 / G41.1 D3\n"),
    *REFUSED,
    lcnc("plane of a compensated cut", "G18 / G41.1 D3 / G0 X20 / G1 Y40 F100 / G40 / G17", "G18", "G17"),
    lcnc("compensation before the origin moves", "G92 X5 / G0 X9 / G92.1 / G41.1 D3 / G0 X20 / G1 Y40 F100 / G40",
         "G92.1\nG41.1 D3", "G41.1 D3\nG92.1"),
    lcnc("G50, which LinuxCNC does not have", "G81 X3 Y3 Z-1 R1 F100 / G80", "G80", "G50"),
    lcnc("G71, which is no unit of LinuxCNC", "G61 / G0 X3", "G61", "G71"),
    lcnc("rapid down between two barriers", "G38.3 Z-3 F50 / G0 Z20 / G91 / G90 / G38.3 Z-3 F50", "Z20", "Z-5"),
    Fault("spindle not started again after the tool change", "haas",
          f"{FANUC} / {FANUC_HOLE} / T2 M6 / S800 M3 / {FANUC_HOLE.replace('X1', 'X11')} / M30",
          "T2 M6\nS800 M3\n", "S800 M3\nT2 M6\n"),
    Fault("power of a beam left on for a rapid", "linuxcnc", f"G21 G90 / M3 S0 / G0 X0 Y0 / {S_LASER} / M5 / M2",
          "S0\nG0 X50", "G0 X50"),
    Fault("power of a beam left on at Mach3", "mach3", f"G21 G90 / M3 S0 / G0 X0 Y0 / {S_LASER} / M5 / M2",
          "S0\nG0 X50", "G0 X50"),
    Fault("beam on for the second way to a cut", "linuxcnc", f"{LIT} / G0 X50 / S0 / X60 / G1 X70 S500 / M5 / M2",
          "S0\nX60", "X60"),
    Fault("beam on for the first way from a cut", "linuxcnc",
          f"{LIT} / S0 / G0 X40 / S500 / X60 / G1 X70 / M5 / M2", "S0\nG0 X40", "G0 X40"),
    Fault("beam on for the way to the end", "linuxcnc", f"{LIT} / S0 / G0 X0 / M5 / M2", "S0\nG0 X0\nM5", "G0 X0\nM5"),
    Fault("beam on amid the way between two cuts", "linuxcnc",
          f"{LIT} / S0 / G0 X50 / X55 / X60 / G1 X70 S500 / M5 / M2", "X55\n", "S500\nX55\nS0\n"),
    Fault("a laser's constant power for one that follows the speed", "grbl-laser",
          "G21 G90 / M4 S0 / G0 X1 / G1 X9 S500 F900 / M5 / M2", "M4", "M3"),
    # A switch-off that acts after the motion of its block on Haas and Fanuc, and before the next one.
    Fault("spindle off before its last cut", "haas", f"{SWITCHED} / G1 X5. M5 / G0 Z5. / M30",
          "G1 X5. M5", "M5 / G1 X5."),
    Fault("coolant off before its last cut", "haas", f"{SWITCHED} / G1 X5. M9 / G0 Z5. / M30",
          "G1 X5. M9", "M9 / G1 X5."),
    Fault("tool changed by hand before its last cut", "grbl", f"{SWITCHED} / T2 / G1 X5. M0 / G0 Z5. / M30",
          "G1 X5. M0", "M0 / G1 X5."),
    # A tool's length that is taken again after the table has changed.
    lcnc("G43 after G10 L1", "G43 H1 / G0 Z5 / G10 L1 P1 Z3 / G43 H1 / G0 Z5", "P1 Z3\nG43 H1", "P1 Z3"),
]  # fmt: skip


def certified(dialect_name: str, original: str, new: str) -> Certificate:
    words = load_dialect(dialect_name)
    return certify(interpret_program(original, words), interpret_program(new, words))


@pytest.mark.hazard
@pytest.mark.parametrize("fault", VERIFY_FAULTS, ids=lambda fault: fault.name)
def test_what_is_not_the_same_work_is_never_called_so(fault: Fault) -> None:
    original = fault.text.replace(" / ", "\n") + "\n"
    assert certified(fault.dialect, original, original).same
    new = original.replace(fault.old.replace(" / ", "\n"), fault.new.replace(" / ", "\n"), 1)
    assert new != original
    try:
        found = certified(fault.dialect, original, new)
    except LeafcutError:
        return
    assert not found.same
    check_golden("differences.toml", "faults", fault.name, found.differences)


def test_unknown_blocks_that_may_change_the_length_offset_are_the_same_on_other_lines() -> None:
    calls = "M98 P7 / G90 G94 G17 G40 G54 / G0 X1 Y1 Z5 / G1 Z-1 F100 / G0 Z5 / M98 P8 / G90 G54 G40 / G0 X2 Y1 Z5"
    original = f"{HEAD} / X0 Y0 / {calls} / G1 Z-1 F100 / G0 Z9 / M30".replace(" / ", "\n") + "\n"
    assert certified("mach3", original, f"(one)\n(two)\n{original}").same
    assert not certified("mach3", original, original.replace("M98 P8", "G43 H1\nM98 P8")).same


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("M0", "G0 Z9 / Z5 / M0"),
        ("M0", "M0 / G0 Z9 / Z5"),
        ("G0 X5", "Z7 / Z-1 / Z5 / G0 X5"),
        ("G0 X6", "Z9 / Z5 / G0 X6"),
        ("G0 X11", "G0 X7 / Z20 / Z9 / G0 X11"),
        ("Z20", "Z20 / Z15 / Z20"),
    ],
)
def test_rapids_down_that_are_no_lower_than_before_are_the_same_work(old: str, new: str) -> None:
    """The tool stops at Z5, leaves the stop at 9, and ends at 20; the first hole is 1 deep."""
    original = DEEP.replace(" / ", "\n") + "\n"
    assert certified("linuxcnc", original, original.replace(old, new.replace(" / ", "\n"), 1)).same


@pytest.mark.parametrize("fault", REFUSED, ids=lambda fault: fault.name)
def test_linuxcnc_refuses_what_is_said_to_be_refused(rs274: str, tmp_path: Path, fault: Fault) -> None:
    """And runs the program that it was made from."""
    original = fault.text.replace(" / ", "\n") + "\n"
    assert run_rs274(rs274, original, tmp_path)[0] == 0
    assert run_rs274(rs274, original.replace(fault.old, fault.new, 1), tmp_path)[0] != 0
