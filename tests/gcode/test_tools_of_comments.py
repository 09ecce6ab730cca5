"""Tools of comments: diameter, kind, angle, corner and number, each case worked by hand."""

from __future__ import annotations

import math

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.gcode.tool_comments import (
    comment_start,
    convert_size_to_mm,
    first_size_in_other_unit,
    smallest_diameter_in_comments,
    tool_diameter_in_comments,
    tool_in_comments,
)
from leafcut.model.tool import Tool, ToolKind

MM_HEAD, INCH_HEAD = "G21 G90\n", "G20 G90\n"


def program_of(text: str) -> Program:
    return interpret_program(text, load_dialect("linuxcnc"))


def at_cut(text: str, cut: str = "G1 Z-1 F60") -> tuple[Program, int]:
    """Return a program and the block of a line."""
    program = program_of(text)
    line = next(number for number, said in enumerate(text.splitlines(), 1) if said.startswith(cut))
    return program, program.line.tolist().index(line)


def width(comment: str, head: str = MM_HEAD) -> float:
    """Return the width of tool 1 from a comment before its change."""
    return tool_diameter_in_comments(*at_cut(f"{head}{comment}\nT1 M6\nM3 S900\nG0 X0 Y0 Z5\nG1 Z-1 F60\nM2\n"))


@pytest.mark.parametrize(
    ("comment", "expected"),
    [
        ("(diameter 6 mm)", 6.0),
        ("(Diameter: 6.5)", 6.5),
        ("(DIAMETER = 6.)", 6.0),
        ("(dia 6)", 6.0),
        ("(Dia. .25 inch)", 6.35),
        ("(drill size 1/4 in)", 6.35),
        ("(bit size 3mm)", 3.0),
        ('(D=0.5")', 12.7),
        ("(D = 6)", 6.0),
        ("(Ø 8)", 8.0),
        ("(AD=6)", 0.0),
        ("(drill bit 5 mm)", 5.0),
        ('(drill, 1/8")', 3.175),
        ("(drill {3 inch})", 76.2),
        ("(drill 3 mm depth)", 0.0),
        ("(seedrill 3 mm)", 0.0),
        ("(T1 | 6. carbide DRILL | H1)", 6.0),
        ("(T1 | 6. carbide twist DRILL | H1)", 6.0),
        ("(T1 | 6 mm twist-drill | H1)", 6.0),
        ("(T1 : 3)", 3.0),
        ("(end mill {6 mm})", 6.0),
        ("(EndMill{6})", 6.0),
        ("(ball-nose {1/4 inch})", 6.35),
        ("(1/2 FLAT ENDMILL)", 0.5),
        ("(6mm flat end mill)", 6.0),
        ("(6 mm 2 flute end mill)", 0.0),
        ("(2 flutes end mill)", 0.0),
        ("(60 deg v-bit)", 0.0),
        ("(90° V-bit)", 0.0),
        ("(3 v-bit)", 3.0),
        ("(6.35 cutter)", 6.35),
        ("(10 face mill)", 10.0),
        ("(4 slot-mill)", 4.0),
        ("(8 bull nose)", 8.0),
        ("(5 router bit)", 5.0),
        ("(#6 end mill)", 0.0),
        ("(T6 end mill)", 0.0),
        ("; 6 mm end mill", 6.0),
        ("(T1 D=6) (T2 D=8)", 6.0),
        ("(1 = 6 mm end mill)", 6.0),
        ("(2 = 6 mm end mill)", 0.0),
        ("(no tool here)", 0.0),
        ("(6 mm)", 0.0),
        ("(D=1/0)", 1.0),
    ],
)
def test_a_width_is_read_in_each_usual_form(comment: str, expected: float) -> None:
    assert width(comment) == pytest.approx(expected)


def test_a_number_without_a_unit_is_in_the_unit_of_the_program() -> None:
    assert width("(D=0.25)", INCH_HEAD) == pytest.approx(6.35)
    assert width("(D=6 mm)", INCH_HEAD) == 6.0
    assert width("(1/2 FLAT ENDMILL)", INCH_HEAD) == pytest.approx(12.7)


@pytest.mark.parametrize(
    ("comment", "tool"),
    [
        ("(T1 D=6 flat end mill)", Tool(1, 6.0, ToolKind.END_MILL, point_angle=math.pi)),
        ("(T1 D=6 CR=1.5 bull nose)", Tool(1, 6.0, ToolKind.END_MILL, point_angle=math.pi, corner_radius=1.5)),
        ("(T1 D=6 CR=9 bull nose)", Tool(1, 6.0, ToolKind.END_MILL, point_angle=math.pi, corner_radius=3.0)),
        ("(T1 D=6 CR=3 ball end mill)", Tool(1, 6.0, ToolKind.BALL_MILL, point_angle=math.pi)),
        ("(T1 D=6 ballnose)", Tool(1, 6.0, ToolKind.BALL_MILL, point_angle=math.pi)),
        ("(T1 D=6 v-bit 60 deg)", Tool(1, 6.0, ToolKind.V_BIT, point_angle=math.radians(60))),
        ("(T1 D=6 v bit 90°)", Tool(1, 6.0, ToolKind.V_BIT, point_angle=math.radians(90))),
        ("(T1 D=6 vcarve 30.5deg)", Tool(1, 6.0, ToolKind.V_BIT, point_angle=math.radians(30.5))),
        ("(T1 D=6 chamfer mill 90 deg)", Tool(1, 6.0, ToolKind.V_BIT, point_angle=math.radians(90))),
        ("(T1 D=6 countersink 82 deg)", Tool(1, 6.0, ToolKind.V_BIT, point_angle=math.radians(82))),
        ("(T1 D=6 engraver 20 deg)", Tool(1, 6.0, ToolKind.V_BIT, point_angle=math.radians(20))),
        ("(T1 D=6 v-bit)", None),
        ("(T1 D=6 v-bit 180 deg)", None),
        ("(T1 D=6 v-bit 0 deg)", None),
        ("(T1 D=6 drill)", Tool(1, 6.0, ToolKind.DRILL, point_angle=math.radians(118))),
        ("(T1 D=6 drill TAPER=140deg)", Tool(1, 6.0, ToolKind.DRILL, point_angle=math.radians(140))),
        ("(T1 D=6 end mill for chamfer)", Tool(1, 6.0, ToolKind.END_MILL, point_angle=math.pi)),
        ("(T1 D=6 end mill 45 deg)", Tool(1, 6.0, ToolKind.END_MILL, point_angle=math.pi)),
        ("(T1 D=6)", Tool(1, 6.0, ToolKind.END_MILL, point_angle=math.pi)),
        ("(a remark)", None),
    ],
)
def test_a_tool_has_the_kind_angle_and_corner_of_its_comment(comment: str, tool: Tool | None) -> None:
    assert tool_in_comments(*at_cut(f"{MM_HEAD}{comment}\nT1 M6\nG0 X0 Y0 Z5\nG1 Z-1 F60\nM2\n")) == tool


def test_a_corner_is_in_the_unit_of_the_program_and_a_tool_without_a_number_is_zero() -> None:
    found = tool_in_comments(*at_cut(f"{INCH_HEAD}(D=0.5 CR=0.1 end mill)\nG0 X0 Y0 Z5\nG1 Z-1 F60\nM2\n"))
    assert found is not None and (found.number, found.diameter) == (0, 12.7)
    assert found.corner_radius == pytest.approx(2.54)


def test_the_nearest_comment_about_the_tool_counts() -> None:
    """Above the cut, from 20 lines before the change; a comment that names the tool also among the first lines."""
    cut = "G0 X0 Y0 Z5\nG1 Z-1 F60\nM2\n"
    blank = "(-)\n"
    # The last one before the cut counts; after the cut, none.
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}(T1 D=6)\nT1 M6\n(T1 D=8)\n{cut}(T1 D=9)\n")) == 8.0
    # A comment of another tool does not count, but one without a number does.
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}(T1 D=6)\n(T2 D=7)\nT1 M6\n{cut}")) == 6.0
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}(T1 D=6)\n(D=8)\n(T2 D=7)\nT1 M6\n{cut}")) == 8.0
    # Before any tool change, each comment counts.
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}(D=8)\n(T2 D=7)\n{cut}")) == 7.0
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}(T2 D=7)\n(D=8)\n{cut}")) == 8.0
    # A list at the top of the program, in its first 200 lines.
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}{blank * 198}(T1 D=6)\n{blank * 90}T1 M6\n{cut}")) == 6.0
    assert tool_diameter_in_comments(*at_cut(f"{MM_HEAD}{blank * 199}(T1 D=6)\n{blank * 90}T1 M6\n{cut}")) == 0.0
    # Up to 20 lines from the tool change upwards, even far below the top.
    first = f"{MM_HEAD}{blank * 300}T2 M6\n"
    assert tool_diameter_in_comments(*at_cut(f"{first}{blank * 5}(T1 D=6)\n{blank * 18}T1 M6\n{cut}")) == 6.0
    assert tool_diameter_in_comments(*at_cut(f"{first}{blank * 5}(T1 D=6)\n{blank * 19}T1 M6\n{cut}")) == 0.0


def test_an_old_comment_counts_only_if_it_names_the_tool() -> None:
    text = f"{MM_HEAD}(T1 D=6)\nT1 M6\nG0 X0 Y0 Z5\nG1 Z-1 F60\nM2\n"
    program, block = at_cut(text)
    assert tool_in_comments(program, block, 5) is not None
    program, block = at_cut(text.replace("(T1 D=6)", "(D=6)").replace("T1 M6\n", ""))
    assert tool_in_comments(program, block, 1) is not None
    assert tool_in_comments(program, block, 2) is None


@pytest.mark.parametrize(
    ("comment", "narrowest"),
    [
        ("(D=6) (T2 D=4)", 4.0),
        ("(3 mm end mill)", 3.0),
        ("(end mill, 3 mm)", 3.0),
        ("(tool 5: 3 mm)", 3.0),
        ("(T5 = 3 mm drill)", 3.0),
        ("(3 flat end mill)", 3.0),
        ("(3 flat carbide end mill)", 3.0),
        ("(3 short flat carbide end mill)", math.inf),
        ("(end mill 1/4 inch)", 6.35),
        ("(D=0 end mill)", math.inf),
        ("(bit size 2)", 2.0),
        ("(step size 2, mill)", math.inf),
        ("(depth 3 mm end mill)", math.inf),
        ("(leave 0.5 mm for the end mill)", math.inf),
        ("(3 mm deep end mill)", math.inf),
        ("(end mill, 3 mm deep)", math.inf),
        ("(end mill, 3 mm stock)", math.inf),
        ("(end mill step 3 mm)", math.inf),
        ("(0.2 mm left by the mill)", math.inf),
        ("(3 mm)", math.inf),
        ("(a remark of 3 mm)", math.inf),
        ("; Ø 2.5", 2.5),
        ("(the diameter of 1 hole)", math.inf),
    ],
)
def test_the_narrowest_tool_of_a_program_is_no_depth_and_no_stock(comment: str, narrowest: float) -> None:
    assert smallest_diameter_in_comments(program_of(f"{MM_HEAD}{comment}\nG0 X1\nM2\n")) == pytest.approx(narrowest)


@pytest.mark.parametrize(
    ("lines", "unit", "found"),
    [
        (["G0 X1", "(drill 1/4 inch)", "(5 inch)"], "mm", (2, "1/4 inch")),
        (["(3 mm)", '; 0.5" bit'], "in", (0, "")),
        (["(3 mm)", '; 0.5" bit'], "mm", (0, "")),
        (['; 0.5" bit', "(3 mm)"], "mm", (0, "")),
        (["(2 inches)"], "mm", (1, "2 inches")),
        (["(2 INCH, 3 inch)"], "mm", (1, "2 INCH")),
        (["(2-inch)"], "mm", (1, "2-inch")),
        (["(2 inch)"], "in", (0, "")),
        (["(2 mmx)", "X2 inch"], "in", (0, "")),
        ([], "mm", (0, "")),
    ],
)
def test_sizes_in_another_unit_than_the_program_are_found(lines: list[str], unit: str, found: tuple[int, str]) -> None:
    assert first_size_in_other_unit(lines, unit) == found


def test_sizes_are_converted_to_millimetres() -> None:
    assert convert_size_to_mm("6.35", None, 1.0) == 6.35
    assert convert_size_to_mm("1/4", "inch", 1.0) == pytest.approx(6.35)
    assert convert_size_to_mm("1 / 4", '"', 1.0) == pytest.approx(6.35)
    assert convert_size_to_mm("0.5", "", 25.4) == pytest.approx(12.7)
    assert convert_size_to_mm("5", "MM", 25.4) == 5.0
    assert convert_size_to_mm("3/0", None, 1.0) == 3.0
    assert [comment_start(text) for text in ("G0 (a) ; b", "G0 ; b (a)", "(", "G0")] == [3, 3, 0, -1]
