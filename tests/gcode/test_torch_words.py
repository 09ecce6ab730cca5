"""Words of a torch: outputs that darken it, hold its height and lower its feed; which spindle marks."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from leafcut.errors import PostError, ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.gcode.torch import convert_torch_path_for_controller
from leafcut.model.toolpath import Arc, Kind, Toolpath, ToolpathBuilder
from rs274_moves import run_rs274

HEAD = "G21 G17 G90 G91.1 G94\nM52 P1\nM65 P2\nM65 P3\nM68 E3 Q0\nF1200\n"


def rows(text: str, words: str = "qtplasmac") -> list[tuple[str, float, int]]:
    """Kind, value and ref of every row but the end."""
    path = interpret_own_program(HEAD + text + "\nM2", load_dialect(words), left_over=True)
    return [(m.kind.name, round(m.value, 6), m.ref) for m in path][4:-1]


def test_an_output_lowers_the_feed_in_percent_until_it_says_all() -> None:
    feeds = [v for kind, v, _ in rows("G0 X0 Y0\nM67 E3 Q60\nG1 X1\nX2\nM67 E3 Q100\nX3") if kind == "FEED"]
    assert feeds == [12.0, 12.0, 20.0]


@pytest.mark.parametrize("percent", ["0", "9", "101"])
def test_a_part_of_the_feed_that_the_controller_does_not_take_is_all_of_it(percent: str) -> None:
    assert ("FEED", 20.0, 0) in rows(f"G0 X0 Y0\nM67 E3 Q{percent}\nG1 X1")


def test_the_feed_is_lowered_only_while_the_controller_listens() -> None:
    assert ("FEED", 20.0, 0) in rows("G0 X0 Y0\nM67 E3 Q60\nM52 P0\nG1 X1")
    assert ("FEED", 20.0, 0) in rows("G0 X0 Y0\nM67 E1 Q60\nG1 X1")


def test_outputs_darken_the_torch_and_hold_its_height() -> None:
    """M62 sets an output and M63 resets it; an unused output has no effect."""
    text = "G0 X0 Y0\nM3 $0 S1\nM62 P2\nM62 P3\nM62 P3\nM62 P1\nG1 X1\nM63 P3\nM63 P2\nM5 $0"
    expected = [("SPINDLE", 1.0, 0), ("HEIGHT", 0.0, 0), ("TORCH", 0.0, 0), ("FEED", 20.0, 0)]
    assert rows(text)[1:] == [*expected, ("TORCH", 1.0, 0), ("HEIGHT", 1.0, 0), ("SPINDLE", 0.0, 0)]


def test_a_program_that_does_not_reset_the_outputs_starts_with_what_another_left() -> None:
    path = interpret_own_program(
        "G21 G90 G94 F600\nG0 X0 Y0\nM3 $0 S1\nG1 X1\nM2", load_dialect("qtplasmac"), left_over=True
    )
    assert [(m.kind, m.value) for m in path][:2] == [(Kind.TORCH, 0.0), (Kind.HEIGHT, 0.0)]


def test_the_spindle_that_marks_is_told_apart() -> None:
    assert rows("M3 $1 S1\nM5 $1") == [("SPINDLE", 1.0, 1), ("SPINDLE", 0.0, 1)]


def test_the_power_of_a_beam_is_said_without_a_stop() -> None:
    """S0 keeps the beam dark while the head moves on; another power than before is the beam at that power."""
    path = interpret_own_program("G21 G90 G94 F600\nM4 S800\nS0\nS800\nS300\nM5\nM30", load_dialect("grbl-laser"))
    assert [(m.kind.name, m.value) for m in path][:-1] == [
        ("SPINDLE", 800.0),
        ("TORCH", 0.0),
        ("TORCH", 1.0),
        ("SPINDLE", 300.0),
        ("SPINDLE", 0.0),
    ]


@pytest.mark.parametrize(
    "text, message",
    [
        ("M62", "M62 needs P"),
        ("M67 E3", "M67 needs Q"),
        ("M67 Q50", "M67 needs E"),
        ("M66 L3", "M66 needs P or E"),
        ("M190", "M190 needs P"),
        ("M62 P2 P3", "P is given twice"),
        ("M62 M63 P3", "exclude each other"),
        ("M3 $9 S1", r"\$9 must be a whole number"),
        ("G41.1", "G41.1 needs D"),
    ],
)
def test_a_word_that_lacks_something_is_refused(text: str, message: str) -> None:
    with pytest.raises(ReadError, match=message):
        rows(text)


@pytest.mark.parametrize("words", ["linuxcnc", "fanuc", "grbl"])
def test_a_mill_knows_no_outputs(words: str) -> None:
    with pytest.raises(ReadError, match="M62 is not understood"):
        interpret_own_program("G21 G90\nM62 P3\nM2", load_dialect(words))


def test_a_foreign_program_keeps_such_blocks_where_they_are() -> None:
    """The effect of the outputs on the feed is known, but the blocks stay word for word."""
    text = "G21 G90 G94\nM52 P1\nG0 X0 Y0\nM3 $0 S1\nM67 E3 Q60\nG1 X9 F1200\nM67 E3 Q100\nX12\nM5 $-1\nM3 $1 S1\nM2"
    program = interpret_program(text, load_dialect("qtplasmac"))
    assert [m.value for m in program.path if m.kind is Kind.FEED] == [12.0, 20.0]
    kept = {int(program.line[b]): reason for b, reason in program.fixed.items()}
    assert kept.keys() == {2, 5, 7, 10}
    assert "another spindle" in kept[10]


def test_a_feed_from_the_machines_own_table_is_not_known() -> None:
    text = "G21 G90\nF#<_hal[plasmac.cut-feed-rate]>\nG0 X0 Y0\nG1 X5\nX6 F300\nM2"
    program = interpret_program(text, load_dialect("qtplasmac"))
    moves = program.path.kind[program.path.kind <= Kind.FOREIGN].tolist()
    assert moves == [Kind.RAPID, Kind.FOREIGN, Kind.FEED, Kind.END]


def cut_with_a_dark_end() -> Toolpath:
    """Down, a pierce, an arc whose end is made with the torch dark, and up."""
    b = ToolpathBuilder()
    b.blending(640, 0.1)
    b.rapid(z=10.0)
    b.rapid(0.0, 0.0)
    b.rapid(z=3.8)
    b.spindle(900.0)
    b.dwell(0.5)
    b.feed(z=1.5, feed=20.0)
    b.height_control(False)
    b.arc(False, (10.0, 0.0, 1.5), Arc((5.0, 0.0, 1.5)), feed=20.0)
    b.torch(False)
    b.feed(10.0, 4.0, feed=20.0)
    b.torch(True)
    b.height_control(True)
    b.spindle(0.0)
    b.rapid(z=10.0)
    b.end()
    return b.build()


def told(words: str, path: Toolpath) -> list[str]:
    """Return the kinds of rows of a program."""
    return [m.kind.name for m in convert_torch_path_for_controller(path, load_dialect(words))]


def test_a_controller_is_told_only_what_is_its_programs() -> None:
    lit = ["SPINDLE", "HEIGHT", "ARC_CCW", "TORCH", "FEED", "TORCH", "HEIGHT", "SPINDLE", "END"]
    assert told("qtplasmac", cut_with_a_dark_end()) == ["BLENDING", "RAPID", *lit]
    laser = [kind for kind in lit if kind != "HEIGHT"]
    assert told("grbl-laser", cut_with_a_dark_end()) == ["RAPID", *laser]
    assert told("fanuc-laser", cut_with_a_dark_end()) == ["BLENDING", "RAPID", laser[0], "DWELL", *laser[1:]]
    same = convert_torch_path_for_controller(cut_with_a_dark_end(), load_dialect("linuxcnc"))
    assert len(same) == len(cut_with_a_dark_end())


def test_a_controller_that_cannot_darken_the_torch_puts_it_out_at_the_end() -> None:
    path = cut_with_a_dark_end()
    with pytest.raises(PostError, match="cannot switch the torch off during a cut"):
        convert_torch_path_for_controller(path, load_dialect("plasma"))
    rows = [m for m in path if m.kind is not Kind.TORCH or m.value == 0.0]
    arcs = path.arcs
    ends = convert_torch_path_for_controller(Toolpath.of_motions(rows), load_dialect("plasma"))
    kinds = [m.kind.name for m in ends]
    assert kinds[7:] == ["ARC_CCW", "SPINDLE", "FEED", "RAPID", "END"]
    assert arcs[0].center == (5.0, 0.0, 1.5)


def test_linuxcnc_hears_the_same_words(rs274: str, tmp_path: Path) -> None:
    """Every output and spindle word in its order, as rs274 prints it; alone it has one spindle, and no M190."""
    text = (
        HEAD + "M66 P3 L3 Q1\nG64 P0.1\nG0 X0 Y0\nM3 $0 S1\nM62 P2\nM67 E3 Q60\nG1 X1\nM62 P3\nG1 X2\nM63 P3\nM63 P2\n"
        "M67 E3 Q100\nM5 $0\nG0 X5\nM65 P2\nM65 P3\nM68 E3 Q0\nM2\n"
    )
    status, output = run_rs274(rs274, text, tmp_path)
    assert status == 0, output
    heard = re.findall(r"(\w*(?:MOTION_OUTPUT|SPINDLE_CLOCKWISE|SPINDLE_TURNING|ADAPTIVE)\w*)\(([^)]*)\)", output)
    bits = {"SET_MOTION_OUTPUT_BIT": 0.0, "CLEAR_MOTION_OUTPUT_BIT": 1.0}
    theirs: list[tuple[str, float, int]] = []
    for name, arguments in heard:
        if name in bits:
            theirs.append(({2: "HEIGHT", 3: "TORCH"}[int(arguments)], bits[name], 0))
        elif name.startswith("START_SPINDLE"):
            theirs.append(("SPINDLE", 1.0, int(arguments)))
        elif name.startswith("STOP_SPINDLE"):
            theirs.append(("SPINDLE", 0.0, int(arguments)))
    ours = [(m.kind.name, m.value, m.ref) for m in interpret_own_program(text, load_dialect("qtplasmac"))]
    switched = [row for row in ours if row[0] in ("HEIGHT", "TORCH", "SPINDLE")]
    assert theirs[: len(switched)] == switched
    assert ("SET_MOTION_OUTPUT_VALUE", "3,60.000000") in heard
    assert "ENABLE_ADAPTIVE_FEED" in output


@pytest.mark.parametrize(("units", "kerf"), [("G21", 1.5), ("G20", 38.1)])
def test_compensation_is_a_row_for_each_width_and_one_for_its_end(units: str, kerf: float) -> None:
    """G40 alone adds none; the D of G41.1 is the width of the kerf in the program's units."""
    path = interpret_own_program(
        f"{units} G17 G90 G91.1 G94 G40\nF100\nG0 X0 Y0 Z1\nG40\nG41.1 D1.5\nG41.1 D1.5\nG42.1 D1.5\nG40\nG40\nM2",
        load_dialect("qtplasmac"),
    )
    found = [(m.ref, round(m.value, 9)) for m in path if m.kind is Kind.RADIUS]
    assert found == [(41, kerf), (41, kerf), (42, kerf), (40, 0.0)]


FOUND = "G0 X1 Y2 Z10\nG38.2 Z-20 F600\nG92 Z-3\nG0 Z4\n"


def test_after_a_probe_the_height_is_what_g92_says() -> None:
    path = interpret_own_program(f"G21 G17 G90 G91.1 G94\n{FOUND}G92.1\nM2", load_dialect("plasma"))
    assert [m.kind for m in path][1:4] == [Kind.PROBE, Kind.SHIFT, Kind.RAPID]
    assert path[1].end == (1.0, 2.0, -20.0)
    assert path[1].value == 10.0
    assert path[2].end == (1.0, 2.0, -3.0)
    assert all(math.isnan(v) for v in path[4].end)
    before = path.before
    assert math.isnan(before[2, 2])
    assert before[3].tolist() == [1.0, 2.0, -3.0]
    assert math.isnan(path.before[2, 2])


@pytest.mark.parametrize(
    "text, words",
    [
        ("G0 Z5\nG38.2 X1 Z-3 F60", "straight down"),
        ("G0 Z5\nG38.2 F60", "straight down"),
        ("G38.2 Z-3 F60", "starts at an unknown height"),
        ("G0 Z5\nG38.2 Z7 F60", "not move downwards"),
        ("G0 Z5\nG38.2 Z-3", "the cut has no feed"),
        ("G0 Z5\nG92", "no axis word"),
        ("G92 G0 Z5", "one set of axis words"),
    ],
)
def test_a_probe_that_cannot_be_meant_is_refused(text: str, words: str) -> None:
    with pytest.raises(ReadError, match=words):
        interpret_own_program(f"G21 G17 G90 G94\n{text}\nM2", load_dialect("plasma"))


def test_a_foreign_probe_stays_where_it_is_and_has_its_feed() -> None:
    """G31 is what Mach3 and Fanuc have for it."""
    for word in ("G38.2", "G38.3", "G31"):
        program = interpret_program(f"G21 G90 G94\n{FOUND.replace('G38.2', word)}M2", load_dialect("plasma"))
        row = next(m for m in program.path if m.kind is Kind.FOREIGN)
        assert row.value == 10.0
        assert any(word in reason for reason in program.fixed.values())
