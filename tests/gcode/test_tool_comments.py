"""The diameter of a tool as comments of common CAM programs give it, and numbers that are none."""

from __future__ import annotations

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.gcode.tool_comments import tool_diameter_in_comments


@pytest.mark.parametrize(
    ("comment", "millimetres"),
    [
        ("(T1 D=6. CR=0. - flat end mill)", 6.0),
        ("(1 = Drill {3 mm})", 3.0),
        ("(Operation: Drill, T1: Drill, 5 mm)", 5.0),
        ("(TC: Drill 5mm)", 5.0),
        ("( T1 | 6. DRILL | H1 )", 6.0),
        ("( T1 | 1/8 DRILL | H1 )", 0.125),
        ("( T1 : 3.0 )", 3.0),
        ("(--min-diameter 6mm --max-diameter 9mm --tool-diameter 3mm)", 3.0),
        ("(--min-diameter 6mm --max-diameter 9mm)", 0.0),
        ("(Drill 1)", 0.0),
        ("(Drill 4)", 0.0),
        ("(Drill 5mm deep)", 0.0),
        ("( T2 : 3.0 )", 0.0),
    ],
)
def test_a_comment_tells_the_diameter_of_its_own_tool(comment: str, millimetres: float) -> None:
    """Numbers of operations, depths and other tools do not count; fractions have the units of the comment."""
    text = f"G21 G90\n{comment}\nT1 M6\nM3 S900\nG0 X0 Y0 Z5\nG1 Z-1 F60\nG0 Z5\nM2\n"
    program = interpret_program(text, load_dialect("linuxcnc"))
    block = int(next(k for k, line in enumerate(program.text_line.tolist()) if line == 6))
    assert tool_diameter_in_comments(program, block) == pytest.approx(millimetres)
