"""Features as columns: each value of a program with all kinds of work, worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.features import (
    AMOUNT,
    EXACT,
    HEIGHT,
    PLACE,
    Features,
    feature_kind_name,
    first_block_with_units,
    is_uniform,
)
from leafcut.processes.program.proof.program_work import read_work
from rewriting import program_of

NAN = math.nan


def features(text: str, beam: bool = False) -> Features:
    return read_work(program_of(text), written_out=False, beam=beam).features


#: Lines 10 to 13 cut and wait, 15 and 16 drill, 18 to 21 are compensated, 22 and 23 are arcs, 30 cuts with the other
#: direction.
TEXT = (
    "M3 S900 / G4 P1 / G21 G90 G17 G40 G94 / T3 M6 / S1000 M3 / M8 / G43 H3 / G64 P0.05 Q0.02 / G0 X0 Y0 Z5 / "
    "G1 Z-1 F60 / X10 F600 / G2 X14 Y0 I2 J0 / G4 P0.5 / G0 Z5 / G83 X20 Y1 Z-6 R1 Q2 F120 / "
    "G99 G82 X30 Z-3 R2 P0.25 / G80 / G1 G41 D2 X40 F300 / G0 X41 / G40 / G0 X42 / G3 X42 Y5 J2 P3 F90 / "
    "G18 G2 X46 Z2 I2 K0 / G53 G0 Z0 / G4 P2 / M4 S500 / G4 P3 / G55 / G95 / G1 X50 F0.12 / T4 M6 / M9 / M2"
)
COLUMNS: dict[str, list[float]] = {
    "x": [0, 10, 14, 14, 20, 30, 40, 41, 42, 42, 46, 50],
    "y": [0, 0, 0, 0, 1, 1, 1, 1, 1, 5, 5, NAN],
    "depth": [-1, -1, -1, -1, -6, -3, 2, 2, 2, 2, 2, NAN],
    "start x": [0, 0, 10, 14, 20, 30, 30, 40, 41, 42, 42, NAN],
    "start y": [0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 5, NAN],
    "start z": [5, -1, -1, -1, 0, 0, 2, 2, 2, 2, 2, NAN],
    "retract": [0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 0, 0],
    "r_plane": [0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 0, 0],
    "peck": [0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0],
    "dwell": [0, 0, 0, 0.5, 0, 0.25, 0, 0, 0, 0, 0, 0],
    "centre x": [0, 0, 12, 0, 0, 0, 0, 0, 0, 42, 44, 0],
    "centre y": [0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 5, 0],
    "centre z": [0, 0, -1, 0, 0, 0, 0, 0, 0, 2, 2, 0],
    "plane": [0, 0, 17, 0, 0, 0, 17, 17, 0, 17, 18, 0],
    "turns": [0, 0, 1, 0, 0, 0, 0, 0, 0, 3, 1, 0],
    # mm/min and, in the last line, 0.12 mm at 500 turns a minute.
    "feed": [1, 10, 10, 0, 2, 2, 5, 0, 0, 1.5, 1.5, 1],
    "tool": [3] * 12,
    "coolant": [2] * 12,
    "length": [3] * 12,
    "frame": [540] * 11 + [550],
    "radius": [40, 40, 40, 40, 40, 40, 41, 41, 40, 40, 40, 40],
    "register": [0, 0, 0, 0, 0, 0, 2, 2, 0, 0, 0, 0],
    "blending": [640] * 12,
    "tolerance": [0.05] * 12,
    "joining": [0.02] * 12,
    "feed_mode": [94] * 11 + [95],
    "spindle": [1] * 11 + [-1],
    "speed": [1000] * 11 + [-500],
    # The move in machine coordinates may cancel the length offset.
    "stated": [7] * 11 + [3],
    "obeyed": [0] * 12,
    "table": [0] * 12,
}
NAMES = [
    "cut", "cut", "clockwise arc", "dwell", "G83", "G82", "cut", "rapid under radius compensation",
    "rapid under radius compensation", "counter-clockwise arc", "clockwise arc", "cut",
]  # fmt: skip


def test_each_column_has_the_values_of_the_program() -> None:
    found = features(TEXT)
    assert set(COLUMNS) | {"kind"} == {*EXACT, *PLACE, *AMOUNT, *HEIGHT}
    for name, values in COLUMNS.items():
        np.testing.assert_allclose(found.of(name), values, rtol=1e-12, atol=1e-12, err_msg=name)
    assert [feature_kind_name(kind) for kind in found.kind.tolist()] == NAMES
    assert found.line.tolist() == [10, 11, 12, 13, 15, 16, 18, 19, 21, 22, 23, 30]
    assert found.group.tolist() == [0] * 12
    picked = found.pick(np.array([10, 4]))
    assert picked.several(("x", "retract", "plane", "peck")).tolist() == [[46, 0, 18, 0], [20, 1, 0, 2]]
    assert found.of("centre x", slice(2, 4)).tolist() == [12, 0] and len(picked) == 2


def stated(text: str) -> list[int]:
    found: list[int] = features(text).of("stated").tolist()
    return found


def test_units_a_spindle_start_and_a_length_offset_are_stated() -> None:
    """1 for units, 2 for a spindle started since the tool change, 4 for a length offset that nothing cancels."""
    text = (
        "G21 / M3 S900 / G0 X0 / G1 X1 F9 / T1 M6 / X2 / M3 / X3 / G43 H1 / X4 / T2 M6 / X5 / G43 H2 / X6 / S800 / "
        "X7 / G53 G0 Z0 / G1 X8 / G49 / X9 / M5 / X10 / M2"
    )
    assert stated(text) == [7, 5, 7, 7, 1, 5, 5, 1, 5, 7]
    assert stated(text.replace("M3 / X3", "M4 / X3")) == stated(text)


def test_a_block_that_may_change_the_tool_table_makes_another_length_offset() -> None:
    text = "G21 / G43 H2 / G0 X0 Y0 Z0 / G1 X1 F9 / G10 L1 P2 Z5 / X2 / G43 H2 / X3 / G10 L1 P2 Z6 / G43 H2 / X4 / M2"
    found = features(text)
    assert found.of("length").tolist() == [2, 2, 2, 2] and found.of("table").tolist() == [0, 0, 1, 2]


@pytest.mark.parametrize(
    ("text", "block"),
    [
        ("G90 / G21 / G21", 1), ("G90 G20", 0), ("g 071 / G1", 0), ("(G21) / G70", 1), ("G210 / G1", 2),
        ("G2 / G7", 2),
        ("G90G21X1", 0), ("N21 / ;G21 / X2", 3), ("G21.1", 1), ("G020", 0), ("G2 1 X5", 0), ("G2 X1 / g 0 2 0", 1),
    ],
)  # fmt: skip
def test_the_first_block_with_units(text: str, block: int) -> None:
    lines = text.split(" / ")
    program = program_of(" / ".join(["G21 G0 X1"] * len(lines)))
    found = replace(program, lines=lines)
    assert first_block_with_units(found) == block


def test_a_length_offset_that_a_block_may_have_changed_is_no_register() -> None:
    """The number counts such blocks, so that it does not depend on the lines between them."""
    text = "G21 / G43 H2 / M98 P7 / G90 G0 X0 Y0 Z0 / G1 X1 F9 / G43 H2 / X2 / M98 P8 / G90 / G1 X3 F9 / M2"
    for shifted in (text, f"(a comment) / (another) / {text}"):
        assert features(shifted).of("length").tolist() == [-1, 2, -2]


@pytest.mark.parametrize(
    ("cuts", "uniform"),
    [
        ("X1", True), ("X1 / X2 / X3", True), ("F5 / X1 / F9 / X2 / X3", False), ("X1 / X2 / F5 / X3", False),
        ("X1 / F5 / X2 / F9 / X3", True), ("G2 X1 Y1 I1 / G1 X2 / X3", False), ("X1 / X2 / G2 X3 Y1 I1", False),
        ("G2 X1 Y1 I1 / G1 X2 / G2 X3 Y2 I1", True), ("X1 / G2 X2 Y1 I1 / G1 X3", True), ("X1 / X2", True),
        ("X1 / F5 / X2", False), ("X1 / G2 X2 Y1 I1", False), ("G2 X1 Y1 I1 / G3 X2 Y2 I1", True),
    ],
)  # fmt: skip
def test_cuts_are_uniform_without_a_lead_in_and_a_lead_out(cuts: str, uniform: bool) -> None:
    found = features(f"G21 G90 G17 / G0 X0 Y0 Z-1 / G1 F9 / {cuts} / M2")
    assert is_uniform(found) is uniform


def test_a_dark_move_of_a_beam_is_no_feature() -> None:
    text = "G21 / G0 X0 Y0 / G1 X1 F9 / M3 S9 / X2 / M5 / X3 / G0 X4 / M2"
    assert features(text, beam=True).of("x").tolist() == [2]
    assert features(text).of("x").tolist() == [1, 2, 3]
    work = read_work(program_of(text), written_out=False, beam=True)
    assert work.path.kind[work.travel].tolist() == [Kind.RAPID, Kind.FEED, Kind.FEED, Kind.RAPID]


def test_settings_of_the_controller_before_a_cut_are_counted() -> None:
    text = "G21 / (o=0, kw=1.5) / M3 $0 S1 / G0 X0 Y0 / G1 X1 F60 / #<holes>=2 / X2 / #<holes>=3 / X3 / M5 / M2"
    found = read_work(program_of(text, "qtplasmac"), written_out=False, beam=False).features
    assert found.of("obeyed").tolist() == [1, 2, 3]


@pytest.mark.parametrize(("word", "name", "before", "after"), [("M5", "spindle", 1, 0), ("M9", "coolant", 2, 0)])
def test_a_word_that_acts_after_the_motion_of_its_block_leaves_the_motion_alone(
    word: str, name: str, before: int, after: int
) -> None:
    """Haas and Fanuc switch off at the end of a block, LinuxCNC at its start."""
    text = f"G21 G90 / M3 S900 / M8 / G0 X0 Y0 Z0 / G1 X1. F9. / X2. {word} / X3. / M2"
    for dialect, states in (("haas", [before, before, after]), ("linuxcnc", [before, after, after])):
        found = read_work(program_of(text, dialect), written_out=False, beam=False).features
        assert found.of(name).tolist() == states
