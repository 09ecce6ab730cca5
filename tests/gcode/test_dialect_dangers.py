"""What breaks tools where controllers differ: planes, returns, dwells, calls that go on, units, commands in a line."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.errors import LeafcutError, OptionError, PostError, ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.toolpath import DrillCycle, Kind, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.writer import write_program
from leafcut.proof.program import interpret_written_program

NEW = ("centroid", "edingcnc", "marlin", "masso", "rrf", "siemens", "siemens-iso", "uccnc")


def holes(*cycles: DrillCycle, feeds: tuple[float, ...] = (2.0,)) -> Toolpath:
    """One hole of each cycle in a row, from 10 mm; each with its own feed where several are given."""
    b = ToolpathBuilder()
    b.rapid(z=30.0)
    b.tool(1)
    b.spindle(1000.0)
    b.rapid(z=10.0)
    for number, cycle in enumerate(cycles):
        b.drill(5.0 * number, 1.0, cycle, feed=feeds[number % len(feeds)])
    b.rapid(z=30.0)
    b.spindle(0.0)
    b.end()
    return b.build()


def text_of(name: str, path: Toolpath) -> str:
    return write_program(path, load_dialect(name), PostOptions(), rapid_velocity=50.0)


def lines_of(name: str, *cycles: DrillCycle, feeds: tuple[float, ...] = (2.0,)) -> list[str]:
    return [line for line in text_of(name, holes(*cycles, feeds=feeds)).splitlines() if not line.startswith(("(", ";"))]


SIEMENS_HEAD = 'G710\nG17 G90 G40\nG94 G54\nG0 Z30\nT="1"\nM6\nS1000 M3\nG0 D1 Z10\nX0 Y0\n'


def siemens(text: str) -> Toolpath:
    return interpret_written_program(SIEMENS_HEAD + text + "\nM30\n", load_dialect("siemens"))


@pytest.mark.parametrize(
    "name, words",
    [
        ("centroid", "P0.25"), ("edingcnc", "G4 P0.25"), ("marlin", "G4 P250"), ("masso", "G4 P250"),
        ("rrf", "G4 P250"),
        ("siemens", ",0.25)"), ("siemens-iso", "P250"), ("uccnc", "P250"),
    ],
)  # fmt: skip
def test_a_dwell_at_the_bottom_is_in_the_unit_of_its_controller(name: str, words: str) -> None:
    """Seconds or milliseconds: a thousandth of the dwell, or a thousandfold."""
    text = text_of(name, holes(DrillCycle("G82", 2.0, -3.0, dwell=0.25)))
    assert words in text
    dwells = [m.value for m in interpret_own_program(text, load_dialect(name)) if m.kind is Kind.DWELL]
    cycles = [c.dwell for c in interpret_own_program(text, load_dialect(name)).cycles]
    assert max([*dwells, *cycles]) == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["marlin", "masso", "edingcnc", "rrf"])
def test_a_cycle_whose_words_are_not_certain_is_written_in_plain_moves(name: str) -> None:
    assert not any("G82" in line for line in lines_of(name, DrillCycle("G82", 2.0, -3.0, dwell=0.25)))


@pytest.mark.parametrize("name", NEW)
def test_tapping_is_refused(name: str) -> None:
    with pytest.raises(PostError, match="no tapping cycle"):
        text_of(name, holes(DrillCycle("G84", 2.0, -3.0)))


def test_siemens_says_where_the_tool_goes_after_a_hole_in_each_call() -> None:
    """G99 is RTP at the reference plane, G98 RTP at the height before; DP is absolute, and DPR stays empty."""
    at_r, at_initial = (DrillCycle("G81", 2.0, -3.0, to_initial=high) for high in (False, True))
    assert "MCALL CYCLE81(2,2,0,-3)" in lines_of("siemens", at_r)
    assert "MCALL CYCLE81(10,2,0,-3)" in lines_of("siemens", at_initial)


def test_a_call_of_siemens_is_closed_before_anything_else_even_a_feed() -> None:
    """Under MCALL a block with F alone drills, too: another feed is another call."""
    cycle = DrillCycle("G81", 2.0, -3.0)
    lines = lines_of("siemens", cycle, cycle, cycle, feeds=(2.0, 2.0, 3.0))
    start = lines.index("F120")
    assert lines[start : start + 11] == [
        "F120",
        "MCALL CYCLE81(2,2,0,-3)",
        "G0 X0 Y1",
        "X5",
        "MCALL",
        "F180",
        "MCALL CYCLE81(2,2,0,-3)",
        "G0 X10 Y1",
        "MCALL",
        "G0 Z30",
        "M5",
    ]


def test_a_hole_of_siemens_has_the_line_of_its_place() -> None:
    """The proof and the messages name the line of the hole, not the line of the MCALL."""
    lines = lines_of("siemens", *[DrillCycle("G81", 2.0, -3.0)] * 3)
    path = interpret_own_program("\n".join(lines), load_dialect("siemens"))
    call = next(number for number, line in enumerate(lines, 1) if line.startswith("MCALL CYCLE81"))
    assert path.line[path.kind == Kind.DRILL].tolist() == [call + 1, call + 2, call + 3]


@pytest.mark.parametrize(
    "text, words",
    [
        (
            "MCALL CYCLE81(10,2,0,-3)\nF100\nG0 X1\nMCALL",
            (
                "while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may follow "
                "MCALL"
            ),
        ),
        (
            "F100\nMCALL CYCLE81(10,2,0,-3)\nG0 X1\nZ20\nMCALL",
            (
                "while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may follow "
                "MCALL"
            ),
        ),
        (
            "F100\nMCALL CYCLE81(10,2,0,-3)\nG0 X1",
            (
                "while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may follow "
                "MCALL"
            ),
        ),
        ("F100\nMCALL CYCLE81(10,2,0,-3)\nG1 X1\nMCALL", "approached with G0"),
        (
            "F100\nMCALL CYCLE81(10,2,0,-3)\nG64 X1\nMCALL",
            (
                "while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may follow "
                "MCALL"
            ),
        ),
        (
            "F100\nMCALL CYCLE81(10,2,0,-3)\nG40 X1\nMCALL",
            (
                "while a cycle is modal (MCALL), this block would drill a hole, too; only hole positions may follow "
                "MCALL"
            ),
        ),
        ("F100\nMCALL CYCLE81(10,2,0,-3)\nMCALL CYCLE81(10,2,0,-4)", "MCALL within MCALL"),
        ("F100\nMCALL CYCLE81(5,2,0,-3)\nG0 X1\nMCALL", "RTP is neither"),
        ("F100\nMCALL CYCLE81(1,2,0,-3)\nG0 X1\nMCALL", "RTP and the tool must be at"),
        ("F100\nMCALL CYCLE81(10,2,0,3)\nG0 X1\nMCALL", "and DP below it"),
        ("F100\nMCALL CYCLE81(10,2,0,-3,5)\nG0 X1\nMCALL", "CYCLE81 with 5 arguments"),
        ("F100\nMCALL CYCLE81(10,2,,-3)\nG0 X1\nMCALL", "CYCLE81 needs SDIS"),
        ("F100\nMCALL CYCLE82(10,2,0,-3,,-5)\nG0 X1\nMCALL", "number of revolutions"),
        ("F100\nMCALL CYCLE83(10,2,0,-9,,-1,,2,0,0,1,1)\nG0 X1\nMCALL", "DAM must be 0"),
        ("F100\nMCALL CYCLE83(10,2,0,-9,,-1,,0,0,0,1,2)\nG0 X1\nMCALL", "VARI must be 0 or 1"),
        ("MCALL CYCLE84(10,2,0,-9)", "that it wrote itself"),
        ("F100\nG91\nMCALL CYCLE81(10,2,0,-3)", "understood only in the XY plane (G17) with G90"),
        ("F100\nMCALL CYCLE81(10,2,-1,-3)", "CYCLE81: SDIS must not be negative"),
        ("F100\nMCALL CYCLE83(10,2,0,-9,,3,,0,0,0,1,1)", "FDEP must be below the reference plane"),
        ("X=R1", "R is a parameter"),
        ("G0 X=5", "that it wrote itself"),
        ("G0 SUPA Z0", "D0 is missing"),
        ("D2", "D2 must be a whole number from 0 to 1"),
        ("G81 X1 Z-3 R2", "R is a parameter"),
    ],
)
def test_what_siemens_would_do_otherwise_is_refused(text: str, words: str) -> None:
    with pytest.raises(ReadError, match=re.escape(words)) as caught:
        siemens(text)
    assert "\n" not in str(caught.value)


def test_the_clearance_of_siemens_counts_from_the_reference_plane() -> None:
    path = siemens("F100\nMCALL CYCLE83(10,0,2,-9,,-1,,0,0,0,1,1)\nG0 X1\nMCALL")
    assert path.cycles == (DrillCycle("G83", 2.0, -9.0, True, 3.0),)


def test_a_radius_of_siemens_is_read() -> None:
    arc = next(m for m in siemens("F100\nG1 Z-1\nG2 X4 Y0 CR=2") if m.kind is Kind.ARC_CW)
    assert arc.end == (4.0, 0.0, -1.0)


def test_feeds_of_siemens_are_in_the_unit_of_its_lengths() -> None:
    """G700, not G70: under G70 a metric machine takes F as mm/min."""
    text = write_program(holes(DrillCycle("G81", 2.0, -3.0)), load_dialect("siemens"), PostOptions(output_units="inch"))
    assert "G700" in text.split() and "G70" not in text.split() and "F4.7244" in text.split()


def test_marlin_gets_one_command_a_line_and_none_that_it_takes_for_something_else() -> None:
    """It obeys the first command of a line alone; T changes extruders, M30 deletes a file, G28 homes into the work."""
    text = text_of("marlin", holes(DrillCycle("G83", 2.0, -9.0, peck=3.0), DrillCycle("G82", 2.0, -3.0, dwell=0.25)))
    for line in text.splitlines():
        if not line.startswith(";"):
            assert re.fullmatch(r"(G[0-9]+|M[0-9]+)( [A-Z][-+]?[0-9.]+)*", line), line
            assert not re.match(r"(T|M2\b|M30|M6\b|G28|G8|G20)", line), line


def test_a_cut_of_marlin_has_its_own_feed_behind_every_rapid() -> None:
    """F of G0 holds for G1, too: a cut without its own would run at the speed of rapids."""
    lines = lines_of("marlin", DrillCycle("G83", 2.0, -9.0, peck=3.0))
    for before, line in pairwise(lines):
        if before.startswith("G0") and line.startswith("G1"):
            assert "F120" in line
    assert "G0 Z30 F3000" in lines


@pytest.mark.parametrize(
    "line, words",
    [
        ("G0 X1 M5", "a single G or M word"),
        ("X1", "a single G or M word"),
        ("S100 M3", "a single G or M word"),
        ("G20", "G20"),
    ],
)
def test_a_line_of_which_marlin_would_obey_a_part_is_no_program_of_it(line: str, words: str) -> None:
    with pytest.raises(ReadError, match=words):
        interpret_own_program(f"G21\nG90\nG0 Z5\nG0 X0 Y0\n{line}\n", load_dialect("marlin"))


@pytest.mark.parametrize("option", [{"output_units": "inch"}, {"line_numbers": True}])
def test_marlin_has_neither_inches_nor_numbered_lines(option: dict[str, Any]) -> None:
    with pytest.raises(PostError, match="leave it out"):
        write_program(holes(DrillCycle("G81", 2.0, -3.0)), load_dialect("marlin"), PostOptions(**option))


def test_a_length_of_centroid_without_a_point_is_refused() -> None:
    """Parameters 245 and 246 would read it as thousandths."""
    with pytest.raises(ReadError, match="decimal point"):
        interpret_own_program("G21\nG90\nG0 Z5\n", load_dialect("centroid"))


FAST: dict[str, Any] = {"process": "drill", "thickness": 5, "algorithm": "nn", "bound": False}


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    file = tmp_path / "plate.csv"
    file.write_text("x,y,diameter\n10,10,5\n40,10,5\n40,40,8\n10,40,8\n25,25,5\n")
    return file


@pytest.mark.parametrize("name", ["siemens", "marlin"])
def test_a_drawing_is_drilled_verified_and_its_program_is_not_reordered(plate: Path, name: str) -> None:
    outcome = leafcut.optimize(plate, dialect=name, **FAST)
    assert outcome.verified
    program = plate.with_suffix(load_dialect(name).extension)
    program.write_text(outcome.text)
    other = plate.with_name("other" + load_dialect(name).extension)
    other.write_text(leafcut.optimize(plate, dialect=name, start_point="45,45", **FAST).text)
    moved = plate.with_name("moved" + load_dialect(name).extension)
    moved.write_text(re.sub(r"X40 Y10\b", "X41 Y10", outcome.text))
    assert leafcut.verify(program, other, dialect=name).same
    assert not leafcut.verify(program, moved, dialect=name).same
    with pytest.raises(OptionError, match="does not reorder"):
        leafcut.optimize(program, dialect=name)


def test_a_siemens_program_of_others_is_refused_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "foreign.mpf"
    file.write_text('N10 T="DRILL" D1\nN20 M6\nN30 MCALL HOLES2(0,0,20,0,0,6)\n')
    for name in (None, "siemens"):
        with pytest.raises(LeafcutError) as caught:
            leafcut.simulate(file, dialect=name)
        assert "\n" not in str(caught.value)


def test_a_stop_for_reprapfirmware_is_none_that_ends_its_job() -> None:
    """M0, M1 and M2 end a job there: the person who changes the tool goes on after M226."""
    b = ToolpathBuilder()
    b.rapid(z=30.0)
    b.tool(1)
    b.spindle(1000.0)
    b.pause()
    b.rapid(z=40.0)
    b.spindle(0.0)
    b.end()
    text = text_of("rrf", b.build())
    lines = [line for line in text.splitlines() if not line.startswith(";")]
    assert lines[lines.index("T1") + 1] == "M226" and lines.count("M226") == 2
    assert not any(re.match(r"M(0|1|2|30|6)\b", line) for line in lines)
    read = interpret_own_program(text, load_dialect("rrf"))
    assert [m.kind for m in read if m.kind in (Kind.TOOL, Kind.PAUSE)] == [Kind.TOOL, Kind.PAUSE]
    for word in ("M0", "M1", "M2", "S1000 M3", "X1", "G0 G17 X1"):
        with pytest.raises(ReadError):
            interpret_own_program(f"G21\nG17\nG90\nG0 Z5\n{word}\nG0 X1\n", load_dialect("rrf"))
    b = ToolpathBuilder()
    b.pause(optional=True)
    b.end()
    with pytest.raises(PostError, match="no optional stop"):
        text_of("rrf", b.build())
