"""The proof of a rewritten program: every single change of the work is caught, and an allowed order is none."""

from __future__ import annotations

import hashlib
import json
import random
import re
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from golden_differences import check_golden
from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.certificate import Certificate
from leafcut.model.machine import Machine
from leafcut.processes.program.proof.certificate import certify, proof_lines

LINUXCNC = load_dialect("linuxcnc")


def program(text: str) -> Program:
    return interpret_program(text, LINUXCNC)


def certified(original: str, new: str) -> Certificate:
    return certify(program(original), program(new))


#: Every program: head, pieces whose order is free, foot.
Pieces = tuple[str, list[str], str]

CYCLES: Pieces = (
    "G21 G90 G17 G94 G54\nT1 M6\nG43 H1\nS3000 M3\nM8\nG0 Z20\nG98\n",
    [
        f"G0 X{x} Y{y}\n{cycle}\nG80\n"
        for x, y, cycle in (
            (10, 10, "G81 Z-5 R2 F120"),
            (30, 10, "G82 Z-1 R2 P0.5 F120"),
            (30, 40, "G83 Z-12 R2 Q4 F90"),
            (10, 40, "G81 Z-5 R2 F120"),
        )
    ],
    "G0 Z20\nM9\nM5\nM30\n",
)

PECKS: Pieces = (
    "%\nG21 G90 G17\nT2 M6\nS4000 M3\nG0 Z10\nM8\n",
    [f"G0 X{x} Y5\nG0 Z1\nG1 Z-2 F100\nG0 Z1\nG0 Z-1.5\nG1 Z-4\nG4 P0.2\nG0 Z10\n" for x in (5, 15, 25, 35)],
    "M9\nM5\nM2\n%\n",
)

SQUARE = "G0 X{0} Y{1}\nG0 Z1\nG1 Z-1 F100\nG1 X{2} F300\nG1 Y{3}\nG2 X{0} Y{3} I-{4} J0\nG1 Y{1}\nG0 Z5\n"
CONTOURS: Pieces = (
    "G21 G90 G17 G40 G64 P0.01\nT3 M6\nG43 H3\nS9000 M3\nG0 Z5\n",
    [SQUARE.format(x, y, x + 10, y + 10, 5) for x, y in ((0, 0), (20, 0), (0, 30), (20, 30))],
    "G0 X0 Y0\nM5\nM30\n",
)

LASER: Pieces = (
    "G21 G90\nG0 X0 Y0\n",
    [
        f"G0 X{x} Y0\nM3 S{power}\nG1 X{x + 5} F1500\nG1 Y5\nG1 X{x} Y0\nM5\n"
        for x, power in ((10, 800), (20, 800), (30, 250), (40, 800))
    ],
    "G0 X0 Y0\nM2\n",
)

PLASMA: Pieces = (
    "G21 G90 G40\nG0 Z20\n",
    [f"G0 X{x} Y0\nG0 Z3.8\nM3\nG4 P0.6\nG1 Z1.5 F1000\nG3 X{x} Y0 I4 J0 F2400\nM5\nG0 Z20\n" for x in (0, 12, 24, 36)],
    "M5\nM30\n",
)

INCH: Pieces = (
    "G20 G90 G17\nT1 M6\nS2500 M3\nG0 Z0.5\n",
    [f"G0 X{x} Y0.25\nG1 Z-0.125 F4.5\nG1 X{x + 0.25:.4f} F9\nG0 Z0.5\n" for x in (0.5, 1.0625, 1.75, 2.375)],
    "M5\nM30\n",
)

#: Cuts with G1 travel in the air, a pause, and an inner cut before the outer one.
STAGES: Pieces = (
    "G21 G90 G17\nT1 M6\nS8000 M3\nG0 Z5\n",
    [
        "G0 X5 Y5\nG1 Z-1 F100\nG2 X5 Y5 I2 J0 F300\nG0 Z5\n"
        "G0 X0 Y0\nG1 Z-1 F100\nG1 X20 F300\nG1 Y20\nG1 X0\nG1 Y0\nG0 Z5\n",
        "G0 X50 Y0\nG1 Z-1 F100\nG1 X60 F300\nG0 Z5\nG0 X50 Y0\nG1 Z-2 F100\nG1 X60 F300\nG0 Z5\n",
    ],
    "M0\nG55\nG0 X70 Y0\nG0 Z1\nG1 Z-1 F100\nG1 X80 F300\nG0 Z5\nT2 M6\nM3 S7000\nG0 X90 Y0\nG0 Z1\nG1 Z-3 F60\n"
    "G0 Z5\nM5\nM30\n",
)

PROGRAMS: dict[str, Pieces] = {
    "cycles": CYCLES, "pecks": PECKS, "contours": CONTOURS, "laser": LASER, "plasma": PLASMA, "inch": INCH,
    "stages": STAGES,
}  # fmt: skip


def written(pieces: Pieces, order: list[int] | None = None) -> str:
    head, parts, foot = pieces
    return head + "".join(parts if order is None else [parts[i] for i in order]) + foot


#: Program, regular expression to replace (first match), replacement, and a word that the proof must report.
MUTATIONS = [
    ("cycles", r"Z-5 R2", "Z-5.1 R2", "depth -5 became -5.1"),
    ("cycles", r"F120", "F125", "feed in mm/min 120 became 125"),
    ("cycles", r"Q4", "Q3", "peck 4 became 3"),
    ("cycles", r"P0\.5", "P0.4", "dwell 0.5 became 0.4"),
    ("cycles", r"R2 P", "R1.5 P", "R plane 2 was lowered to 1.5"),
    ("cycles", r"R2 P", "R2.5 P", "R plane 2 was raised to 2.5"),
    ("cycles", r"G98", "G99", "retract 20 was lowered to 2"),
    ("cycles", r"G82 Z-1 R2 P0.5", "G81 Z-1 R2", "G82 became G81"),
    ("cycles", r"G0 X30 Y10\n.*\nG80\n", "", "is missing"),
    ("cycles", r"(G0 X30 Y10\n.*\nG80\n)", r"\1\1", "is new"),
    ("cycles", r"S3000", "S3001", "speed 3000 became 3001"),
    ("cycles", r"M3\n", "M4\n", "M3 became M4"),
    ("cycles", r"M8\n", "", "coolant M8 became M9"),
    ("cycles", r"M8\n", "M7\n", "coolant M8 became M7"),
    ("cycles", r"M9\n", "", "at 'end of program M30': coolant M9 became M8"),
    ("cycles", r"G54", "G55", "'"),
    ("cycles", r"T1", "T4", "'change to tool 1' became 'change to tool 4'"),
    ("cycles", r"H1", "H2", "length offset 1 became 2"),
    ("cycles", r"X30 Y40", "X30.003 Y40", "X30.000 Y40.000"),
    ("cycles", r"M30", "M0\nM30", "is new"),
    ("cycles", r"G0 Z20\nM9", "G0 Z10\nM9", ""),
    ("pecks", r"Z-4", "Z-4.1", "depth -4 became -4.1"),
    ("pecks", r"G1 Z-4\n", "G1 Z-4 F99\n", "feed in mm/min 100 became 99"),
    ("pecks", r"G0 Z1\nG0 Z-1.5", "G0 Z0.5\nG0 Z-1.5", "at Z0.500 instead of Z1.000"),
    ("pecks", r"G0 Z1\nG0 Z-1.5", "G0 Z1\nG0 Z-1.7\nG0 Z-1.5", "goes down over"),
    ("pecks", r"G0 Z-1.5", "G0 Z-1.6", "start"),
    ("pecks", r"G4 P0.2\n", "", "dwell at X5.000 Y5.000 Z-4.000 with tool 2 is missing"),
    ("pecks", r"P0.2\nG0 Z10", "P0.2\nG0 Z5", "leaves X5.000 Y5.000 at Z5.000 instead of Z10.000"),
    ("pecks", r"G0 X25 Y5\nG0 Z1\n(.*\n){6}", "", "is missing"),
    ("contours", r"Z-1 F100", "Z-1.01 F100", "depth -1 became -1.01"),
    ("contours", r"F300", "F301", "feed in mm/min 300 became 301"),
    ("contours", r"G2 (.*)", r"G3 \1", "clockwise arc became counter-clockwise arc"),
    ("contours", r"I-5 J0", "I-5 J-0.003", ""),
    ("contours", r"I-5 J0", "I-5 J0\nG1 X0.1\nG1 X0", ""),
    ("contours", r"G64 P0.01", "G64 P0.1", "blending tolerance 0.01 became 0.1"),
    ("contours", r"G64 P0.01", "G64 P0.01 Q0.1", "tolerance of short moves 0.01 became 0.1"),
    ("contours", r"G64 P0.01", "G61", "blending G64 became G61"),
    ("contours", r"G0 X20 Y0\nG0 Z1", "G0 Z3\nG0 X20 Y0\nG0 Z1", "leaves X0.000 Y0.000 at Z3.000 instead of Z5.000"),
    ("contours", r"G0 Z5\nG0 X20 Y0", "G0 Z4\nG0 X20 Y0", "at Z4.000 instead of Z5.000"),
    ("contours", r"G0 Z5\nG0 X20 Y0", "G0 Z5\nG0 X9 Z4\nG0 Z5\nG0 X20 Y0", "at Z4.000"),
    ("contours", r"G1 Y10\n", "G1 Y5\nG1 Y4\nG1 Y10\n", ""),
    ("contours", r"G1 Y10\n", "G1 Y5 X10.01\nG1 X10 Y10\n", ""),
    ("contours", r"G1 Y10\n", "G1 Y5 F299\nG1 Y10 F300\n", ""),
    ("contours", r"G1 Y10\n", "G1 Y10\nG0 Z5\nG0 Z-1\n", "without a rapid"),
    ("contours", r"G0 X0 Y0\nM5", "G0 X1 Y0\nM5", "does not return to its original position"),
    ("contours", r"T3", "T2", "'change to tool 3' became 'change to tool 2'"),
    ("contours", r"H3", "H1", "length offset"),
    ("laser", r"S250", "S260", "power 250 became 260"),
    ("laser", r"M3 S800", "M4 S800", "M3 became M4"),
    ("laser", r"F1500", "F1400", "feed"),
    ("laser", r"M5\nG0 X20", "G0 X20", "beam on"),
    ("laser", r"G0 X20 Y0\nM3 S800", "M3 S800\nG0 X20 Y0", "beam on"),
    ("laser", r"M5\nM2|M5\nG0 X0 Y0\nM2", "G0 X0 Y0\nM2", ""),
    ("laser", r"G1 Y5\n", "G1 Y5.1\n", ""),
    ("plasma", r"G4 P0.6\n", "", "dwell at X0.000 Y0.000 Z3.800 with tool 0 is missing"),
    ("plasma", r"G4 P0.6", "G4 P0.5", "dwell 0.6 became 0.5"),
    ("plasma", r"M3\nG4 P0.6\n", "G4 P0.6\nM3\n", "direction of the spindle M3 became M5"),
    ("plasma", r"G0 Z3.8\nM3", "G0 Z3\nM3", ""),
    ("plasma", r"I4 J0", "I3.9 J0", ""),
    ("plasma", r"G3 X12", "G2 X12", "became clockwise arc"),
    ("plasma", r"M5\nG0 Z20\nG0 X12", "M5\nG0 Z10\nG0 X12", "at Z10.000 instead of Z20.000"),
    ("inch", r"Z-0.125", "Z-0.126", "depth"),
    ("inch", r"F4.5", "F4.6", "feed in mm/min 114.3 became 116.84"),
    ("inch", r"S2500", "S2400", "speed"),
    ("inch", r"G20", "G21", ""),
    ("inch", r"G0 Z0.5\nG0 X1.0625", "G0 Z0.4\nG0 X1.0625", "lower"),
    ("stages", r"M0\n", "", "pause M0' is missing"),
    ("stages", r"M0\n", "M1\n", "'pause M0' became 'pause M1'"),
    ("stages", r"G55\n", "", "is missing"),
    ("stages", r"G55", "G56", ""),
    ("stages", r"T2 M6", "T3 M6", "became 'change to tool 3'"),
    ("stages", r"S7000", "S7001", "speed"),
    ("stages", r"(M0\n)(G55\n)", r"\2\1", "moved in the order"),
    ("stages", r"G1 Z-3 F60", "G1 Z-3 F60\nG4 P1", "is new"),
]


@pytest.mark.hazard
@pytest.mark.parametrize("name, old, new, words", MUTATIONS)
def test_every_single_change_is_caught_and_said(name: str, old: str, new: str, words: str) -> None:
    original = written(PROGRAMS[name])
    mutated, n = re.subn(old, new, original, count=1)
    assert n == 1 and mutated != original
    certificate = certified(original, mutated)
    assert not certificate.same
    texts = [str(d) for d in certificate.differences]
    assert any(words in text for text in texts), texts
    assert all("\n" not in text for text in texts)
    check_golden("differences.toml", name, f"{old} → {new}", certificate.differences)


@pytest.mark.parametrize("after_next", [False, True])
@pytest.mark.parametrize("number", range(len(written(PROGRAMS["stages"]).splitlines())))
def test_the_differences_of_a_program_with_a_lost_or_moved_line_are_the_golden_ones(
    number: int, after_next: bool
) -> None:
    original = written(PROGRAMS["stages"])
    lines = original.splitlines(keepends=True)
    line = lines.pop(number)
    if after_next:
        lines.insert(number + 1, line)
    found: Iterable[object]
    try:
        found = certified(original, "".join(lines)).differences
    except ReadError as problem:
        found = [problem]
    what = f"line {number + 1} {'after the next' if after_next else 'lost'}"
    check_golden("differences.toml", "stages", what, found)


@pytest.mark.parametrize(
    "old, new",
    [
        (r"G1 Y10\n", "G1 Y5\nG1 Y10\n"),
        (r"G1 Y10\n", "G1 Y3\nG1 X10.0005 Y5\nG1 X10 Y7.1\nG1 Y10\n"),
        (r"G1 Y10\n", "G1 Y10\nG1 Y10\n"),
        (r"Z-1 F100", "Z-0.4 F100\nG1 Z-1"),
    ],
)
def test_a_line_divided_into_others_is_the_same_work(old: str, new: str) -> None:
    """The tool goes the same way at the same feed; in the other direction it is the same rule."""
    original = written(PROGRAMS["contours"])
    divided, n = re.subn(old, new, original, count=1)
    assert n == 1
    assert certified(original, divided).same
    assert certified(divided, original).same


@pytest.mark.parametrize("head, foot", [("G41 D1", "G40"), ("G93", "G94")])
def test_a_line_divided_where_each_move_counts_is_another_work(head: str, foot: str) -> None:
    """Radius compensation depends on the moves beside, and in inverse time each move takes the time of its F."""
    whole = f"G21 G90 T1 M6\nS1 M3\nG0 X0 Y0 Z0\n{head}\nG1 X10 F2\nX30 F2\nY30 F2\n{foot}\nM5\nM2\n"
    assert certified(whole, whole).same
    assert not certified(whole, whole.replace("X30 F2", "X20 F2\nX30 F2")).same


@pytest.mark.parametrize("mode", ["G61", "G61.1"])
def test_a_line_divided_by_exact_stops_is_another_work(mode: str) -> None:
    """The tool stands at the end of each move: it leaves a mark, and a beam burns."""
    whole = f"G21 G90 T1 M6\nS1 M3\nG0 X0 Y0 Z0\n{mode}\nG1 X10 F2\nX30\nM5\nM2\n"
    assert certified(whole, whole).same
    assert not certified(whole, whole.replace("X30", "X20\nX30")).same


@pytest.mark.parametrize("divided", ["G1 X20\nX30", "G1 X10\nX30"])
def test_the_first_move_after_radius_compensation_is_not_divided(divided: str) -> None:
    """The tool leaves the contour along the whole length of that move, so its end determines the cut."""
    whole = "G21 G90 T1 M6\nS1 M3\nG0 X0 Y0 Z0\nG41 D1\nG1 X5 Y5 F2\nX10 Y0\nG40\nG1 X30\nM5\nM2\n"
    other = whole.replace("G1 X30", divided)
    assert not certified(whole, other).same
    assert not certified(other, whole).same


def moved(name: str, what: str, to: str) -> tuple[str, str]:
    """Return a program, and the same program with a part of it (a regular expression) moved before another."""
    original = written(PROGRAMS[name])
    found = re.search(what, original)
    assert found
    rest = original[: found.start()] + original[found.end() :]
    where = re.search(to, rest)
    assert where
    return original, rest[: where.start()] + found.group() + rest[where.start() :]


@pytest.mark.hazard
def test_an_inner_cut_after_its_outer_contour_is_caught() -> None:
    original, new = moved("stages", r"G0 X5 Y5\n(.*\n){3}", "G0 X50")
    (found,) = certified(original, new).differences
    assert found.what == "inner after outer"
    assert (found.original, found.new) == (6, 13)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "cut, what",
    [
        ("G0 X0 Y0\nM3\nG1 X1\nM5\n", "inner after outer"),
        ("G0 X6 Y0\nM3\nG1 X6 Y12\nM5\n", "order"),
    ],
)
def test_an_arc_of_a_program_without_z_is_judged_as_an_arc(cut: str, what: str) -> None:
    head, circle = "G21 G90\nF1000 S500\n", "G0 X10 Y0\nM3\nG2 X10 Y0 I-10 J0\nM5\n"
    assert what in [d.what for d in certified(head + cut + circle, head + circle + cut).differences]


@pytest.mark.hazard
@pytest.mark.parametrize("gap", [0.0, 0.03, 0.049, 0.06, 0.08, 0.1, 0.12, 0.5])
@pytest.mark.parametrize("halves", [False, True])
def test_an_outline_with_a_micro_joint_of_any_width_comes_after_its_holes(gap: float, halves: bool) -> None:
    head = "G21 G90\nF1000 S500\n"
    hole = "G0 X20 Y20\nM3\nG1 X25 Y20\nX25 Y25\nX20 Y25\nX20 Y20\nM5\n"
    turn = f"X50 Y{50 - gap}\nM5\nG0 X50 Y50\nM3\nG1 X0 Y50\n" if halves else "X50 Y50\nX0 Y50\n"
    outline = f"G0 X{gap} Y0\nM3\nG1 X50 Y0\n{turn}X0 Y0\nM5\n"
    assert "inner after outer" in [d.what for d in certified(head + hole + outline, head + outline + hole).differences]


@pytest.mark.hazard
@pytest.mark.parametrize("drift", [0.0, 0.001, 0.005, 0.009])
def test_a_plunge_that_drifts_by_rounding_hides_no_part_that_comes_free_too_early(drift: float) -> None:
    head, up = "G21 G90\nF1000\nM3 S500\nG0 Z5\n", "G0 Z5\n"
    drilled = f"G0 X90 Y90\nG1 X{90 + drift} Y90 Z-8\n{up}"
    part = f"G0 X0 Y0\nG1 Z-6\nX50\nY50\nX0\nY0\n{up}"
    other = f"G0 X70 Y70\nG1 Z-2\nX80\n{up}"
    found = certified(head + drilled + other + part, head + drilled + part + other).differences
    assert [d.what for d in found] == ["part detached too early"]


def test_an_inner_cut_may_not_move_behind_an_outer_one_with_a_lead_in_and_an_overcut_either() -> None:
    """The outer cut starts outside, does not meet its first corner, and crosses itself beyond its start."""
    head = "G21 G90\nM3 S1\n"
    inner = "G0 X5 Y5\nG1 X6 F100\n"
    outer = "G0 X3 Y-4\nG1 X3 Y0.2 F100\nX10 Y0\nY10\nX0\nY0\nX4 Y-0.1\nX4 Y-2\n"
    again = "G0 X30 Y5\nG1 X31 F100\n"
    assert certified(head + inner + outer + again, head + again + inner + outer).same
    found = certified(head + inner + outer, head + outer + inner).differences
    assert {d.what for d in found} == {"inner after outer"}


def test_a_finishing_pass_inside_its_roughing_stays_after_it_and_a_laser_may_cut_the_inside_first() -> None:
    rough = "G0 X-1 Y-1\nG0 Z-5\nG1 X11 F100\nY11\nX-1\nY-1\nG0 Z5\n"
    finish = "G0 X0 Y0\nG0 Z-5\nG1 X10 F100\nY10\nX0\nY0\nG0 Z5\n"
    milled = "G21 G90\nM3 S1\nG0 Z5\n"
    found = certified(milled + rough + finish, milled + finish + rough).differences
    assert {d.what for d in found} == {"inner before outer"}
    for head, on, off in (("G21 G90\n", "M3 S1\n", "M5\n"), ("G21 G90 G0 X-9 Y0\nM4 S1\n", "", "")):
        outer, inner = (re.sub(r"G0 Z-5\n", on, cut).replace("G0 Z5\n", off) for cut in (rough, finish))
        assert certified(head + outer + inner, head + inner + outer).same
        assert not certified(head + inner + outer, head + outer + inner).same


def test_what_lies_beside_a_loop_is_not_inside_it() -> None:
    """A cut that crosses itself at (10, 0): what lies beyond the crossing, between its two ends, is free."""
    loop = "G0 X0 Y-1 / G1 Z-1 F100 / X20 Y1 / X20 Y-1 / X0 Y1 / G0 Z5"
    head, foot = "G21 G90 / S1000 M3 / G0 Z5", "G0 Z20 / M5 / M2"
    for x, same in ((2, True), (18, False)):
        hole = f"G0 X{x} Y0 / G1 Z-1 F100 / G0 Z5"
        texts = [" / ".join([head, *parts, foot]).replace(" / ", "\n") for parts in ((loop, hole), (hole, loop))]
        assert certified(*texts).same is same


def test_an_open_cut_encloses_nothing() -> None:
    head = "G21 G90\nM3 S1\n"
    inner, hook = "G0 X5 Y5\nG1 X6 F100\n", "G0 X0 Y0\nG1 X10 F100\nY10\nX0\nY5\n"
    assert certified(head + inner + hook, head + hook + inner).same


def test_passes_of_different_depth_at_one_place_keep_their_order() -> None:
    original, new = moved("stages", r"G0 X50 Y0\nG1 Z-2 F100\nG1 X60 F300\nG0 Z5\n", r"G0 X50")
    certificate = certified(original, new)
    assert {d.what for d in certificate.differences} == {"order"}
    assert all(d.original and d.new for d in certificate.differences)


def test_cuts_that_cross_keep_their_order_and_cuts_that_only_come_near_need_not() -> None:
    head = "G21 G90\nM3 S1\nG0 Z1\n"
    slot = "G0 X{} Y{}\nG1 Z-1 F100\nG1 X{} Y{}\nG0 Z1\n"
    along, crossing, near = slot.format(0, 0, 10, 0), slot.format(5, -5, 5, 5), slot.format(5, 0.01, 5, 5)
    assert certified(head + along + near, head + near + along).same
    assert not certified(head + along + crossing, head + crossing + along).same


def test_a_hole_that_is_drilled_after_a_pause_instead_of_before_is_caught() -> None:
    head, parts, foot = CYCLES
    one = head + "".join(parts[:3]) + "G0 Z20\nM0\n" + parts[3] + foot
    other = head + "".join(parts[:2]) + "G0 Z20\nM0\n" + parts[3] + parts[2] + foot
    found = certified(one, other).differences
    assert [d.what for d in found] == ["moved hole"]
    assert (found[0].original, found[0].new) == (15, 20)


def test_two_holes_of_different_tools_at_one_place_keep_the_order_of_the_tools() -> None:
    head = "G21 G90 G98\nM3 S1000\nG0 Z5\n"
    hole = "T{} M6\nG0 X{} Y0\nG81 Z{} R1 F100\nG80\n"
    centre, drilled, again = hole.format(1, 0, -1), hole.format(2, 0, -5), hole.format(1, 9, -1)
    merged = hole.format(1, 9, -1) + "G0 X0 Y0\nG81 Z-1 R1 F100\nG80\n" + drilled
    assert certified(head + centre + drilled + again, head + merged).same
    wrong = drilled + centre + "G0 X9 Y0\nG81 Z-1 R1 F100\nG80\n"
    found = certified(head + centre + drilled + again, head + wrong).differences
    assert {d.what for d in found} == {"order"}


def test_only_whole_tool_changes_may_be_saved() -> None:
    head = "G21 G90\nM3 S1000\nG0 Z5\n"
    change = "G0 Z50\nM5\nT{} M6\nM0\nM3 S1000\nG4 P2\n"
    hole = "G0 X{} Y0\nG81 Z-1 R1 F100\nG80\nG0 Z50\n"
    foot = "G0 Z50\nM30\n"
    one, two = change.format(1), change.format(2)
    original = head + one + hole.format(0) + two + hole.format(9) + one + hole.format(18) + foot
    merged = head + one + hole.format(0) + hole.format(18) + two + hole.format(9) + foot
    certificate = certified(original, merged)
    assert certificate.same, certificate.differences
    assert (certificate.before.tool_changes, certificate.after.tool_changes) == (3, 2)
    for wrong in (
        merged.replace("M0\n", "", 1),
        merged.replace("P2", "P1", 1),
        merged.replace("Z50\nM5\nT2", "Z40\nM5\nT2"),
    ):
        assert wrong != merged
        assert not certified(original, wrong).same


@pytest.mark.hazard
@pytest.mark.parametrize("name", [name for name in PROGRAMS if name != "stages"])
@given(order=st.permutations(range(4)))
def test_pieces_in_any_order_are_the_same_work(name: str, order: list[int]) -> None:
    certificate = certified(written(PROGRAMS[name]), written(PROGRAMS[name], order))
    assert certificate.same, certificate.differences
    assert certificate.before == certificate.after


def test_independent_stages_may_be_turned_round_inside_and_not_across() -> None:
    assert certified(written(STAGES), written(STAGES, [1, 0])).same
    head, parts, foot = STAGES
    assert not certified(written(STAGES), head + parts[0] + foot.replace("M0\n", "M0\n" + parts[1])).same


def test_the_same_program_in_other_units_is_the_same_work() -> None:
    metric = written(INCH).replace("G20", "G21")
    metric = re.sub(r"(?<=[XYZF])-?[0-9.]+", lambda m: f"{float(m.group()) * 25.4:.6f}", metric)
    certificate = certified(written(INCH), metric)
    assert certificate.same, certificate.differences


def test_the_same_program_in_incremental_words_is_the_same_work() -> None:
    incremental = "G21 G90\nT2 M6\nS4000 M3\nG0 Z10\nM8\nG0 X5 Y5\nG91\n"
    hole = "G0 Z-9\nG1 Z-3 F100\nG0 Z3\nG0 Z-2.5\nG1 Z-2.5\nG4 P0.2\nG0 Z14\n"
    text = incremental + "G0 X10\n".join([hole] * 4) + "M9\nM5\nM2\n"
    certificate = certified(written(PECKS), text)
    assert certificate.same, certificate.differences


def test_cycles_written_out_as_moves_are_the_same_work() -> None:
    head, foot = "G21 G90\nS1 M3\nG0 Z20\n", "G0 Z20\nM30\n"
    cycles = head + "G0 X1 Y1\nG99 G81 Z-5 R2 F100\nX9 Y1\nG80\n" + foot
    moves = head + "".join(f"G0 X{x} Y1\nG0 Z2\nG1 Z-5 F100\nG0 Z2\n" for x in (9, 1)) + foot
    assert certified(cycles, moves).same
    assert not certified(cycles, moves.replace("Z-5", "Z-5.1", 1)).same


def test_where_units_were_stated_they_must_be() -> None:
    """Without G20 or G21 the machine takes the units it was left in."""
    text = written(PLASMA)
    bare = interpret_program(text.replace("G21 ", ""), LINUXCNC, units="mm")
    assert not certify(program(text), bare).same
    assert certify(bare, program(text)).same is False


@pytest.mark.hazard
def test_a_block_that_is_not_understood_keeps_its_words_place_and_modes() -> None:
    head = "G21 G90\nS1 M3\nG0 Z5\n"
    holes = [f"G0 X{x} Y0\nG1 Z-1 F100\nG0 Z5\n" for x in (1, 2, 3)]
    foot = "M68 E3 Q1\nG0 X9 Y0\nG1 Z-1 F100\nG0 Z5\nM30\n"
    original = head + "".join(holes) + "G0 X0 Y0\n" + foot
    assert certified(original, head + "".join(holes[::-1]) + "G0 X0 Y0\n" + foot).same
    for wrong in (
        original.replace("Q1", "Q2"),
        original.replace("G0 X0 Y0\n", ""),
        original.replace("M68 E3 Q1\n", ""),
    ):
        assert not certified(original, wrong).same


def test_a_block_that_may_be_skipped_stays_where_it_is() -> None:
    head, parts, foot = PECKS
    original = head + parts[0] + parts[1] + "/M1\n" + parts[2] + parts[3] + foot
    assert certified(original, head + parts[1] + parts[0] + "/M1\n" + parts[3] + parts[2] + foot).same
    for wrong in (original.replace("/M1", "M1"), head + parts[0] + "/M1\n" + "".join(parts[1:]) + foot):
        assert not certified(original, wrong).same


def test_under_radius_compensation_nothing_may_change_places() -> None:
    head = "G21 G90 G17\nT1 M6\nS1 M3\nG0 Z5\n"
    contour = "G0 X{0} Y0\nG41 D1\nG1 X{1} Y5 F100\nG1 Y15\nG1 X{2} Y20\nG40\nG0 X{2} Y25\nG0 Z5\n"
    one, other = contour.format(0, 5, 10), contour.format(50, 55, 60)
    original = head + one + other + "M30\n"
    assert certified(original, original).same
    for wrong in (original.replace("D1", "D2", 1), original.replace("G41", "G42", 1), original.replace("G40\n", "", 1)):
        assert not certified(original, wrong).same


def test_a_program_larger_than_the_original_or_than_the_machine_is_refused() -> None:
    original = written(PECKS)
    found = certified(original, original.replace("M9\n", "G0 Z30\nM9\n")).differences
    assert [d.what for d in found] == ["envelope"]
    assert found[0].original and found[0].new
    machine = Machine(
        "m", "", "linuxcnc", (1.0,) * 3, (1.0,) * 3, 1.0, (0.0,) * 3, (30.0, 99.0, 99.0), work_offset=(0, 0, 50)
    )
    found = certify(program(original), program(original), machine=machine).differences
    assert [d.what for d in found] == ["outside travel"]


def test_a_program_that_is_wrong_everywhere_makes_a_short_list() -> None:
    head = "G21 G90\nS1 M3\nG0 Z5\n"
    holes = [f"G0 X{x} Y0\nG1 Z-1 F100\nG0 Z5\n" for x in range(1000)]
    deeper = [hole.replace("Z-1", f"Z-{2 + k / 1000}") for k, hole in enumerate(holes)]
    certificate = certified(head + "".join(holes), head + "".join(deeper))
    assert len(certificate.differences) <= 60
    assert "more differences" in str(certificate.differences[-1])


def test_a_certificate_is_plain_data_and_two_lines_that_any_controller_takes() -> None:
    certificate = certified(written(CYCLES), written(CYCLES, [3, 1, 0, 2]))
    answer = json.loads(json.dumps(certificate.as_json()))
    assert answer["same"] is True and answer["differences"] == []
    assert answer["before"] == {"holes": 4, "cuts": 0, "dwells": 0, "stages": 1, "tool_changes": 1}
    digest = hashlib.sha256(written(CYCLES).encode()).hexdigest()
    assert answer["sha256"] == digest
    lines = proof_lines(certificate, "1.2.dev0", "a (very) odd; name\n%" + "x" * 200 + ".nc")
    assert len(lines) == 2
    assert lines[0].startswith("leafcut 1.2.dev0: same work as ")
    assert all(re.fullmatch(r"[A-Za-z0-9 :._+=,-]{1,80}", line) for line in lines)
    assert digest[:12] in lines[1] and "4 holes" in lines[1]


def test_a_certificate_that_refuses_says_so_everywhere() -> None:
    certificate = certified(written(CYCLES), written(CYCLES, [0, 1, 2]))
    answer = certificate.as_json()
    assert answer["same"] is False
    assert answer["differences"][0]["original"] > 0
    assert "NOT" in proof_lines(certificate, "1.2", "x.nc")[0]


def test_many_pieces_shuffled_are_the_same_and_two_of_them_exchanged_on_one_place_are_not() -> None:
    rng = random.Random(5)
    head, foot = "G21 G90\nS1 M3\nG0 Z5\n", "M30\n"
    pieces = [
        f"G0 X{x} Y{y}\nG1 Z-1 F100\nG3 X{x} Y{y} I2 J0\nG1 Z-2\nG3 X{x} Y{y} I2 J0\nG0 Z5\n"
        for x in range(0, 100, 10)
        for y in range(0, 100, 10)
    ]
    shuffled = pieces.copy()
    rng.shuffle(shuffled)
    assert certified(head + "".join(pieces) + foot, head + "".join(shuffled) + foot).same
    deep = shuffled[17].replace("G1 Z-1 F100", "G1 Z-2 F100").replace("G1 Z-2\n", "G1 Z-1\n")
    assert not certified(
        head + "".join(pieces) + foot, head + "".join(shuffled).replace(shuffled[17], deep) + foot
    ).same
