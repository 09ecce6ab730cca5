"""Words that depend on the state of the controller: offsets, machine moves, cycles, feeds of rapids, and refusals."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from leafcut.errors import PostError
from leafcut.gcode.dialects import load_dialect
from leafcut.model.toolpath import Arc, DrillCycle, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.writer import write_program

NAN = math.nan
G81 = DrillCycle("G81", 2.0, -5.0)
Moves = Callable[[ToolpathBuilder], object]


def lines_of(name: str, moves: Moves, options: PostOptions | None = None, **given: Any) -> list[str]:
    """Return the lines between the preamble and the end."""
    builder = ToolpathBuilder()
    moves(builder)
    builder.end()
    words = load_dialect(name)
    lines = write_program(builder.build(), words, options or PostOptions(), **given).splitlines()
    first = next(number for number, line in enumerate(lines) if words.preamble[-1] in line)
    return lines[first + 1 : lines.index(words.end_word) if words.end_word else None]


def run(*steps: tuple[Any, ...]) -> Moves:
    """Return the calls of a builder; a step is a method, its arguments, and a dictionary of named arguments."""

    def moves(b: ToolpathBuilder) -> None:
        for name, *args in steps:
            named = args.pop() if args and isinstance(args[-1], dict) else {}
            getattr(b, name)(*args, **named)

    return moves


FEED = {"feed": 1.0}
HIGH = ("rapid", None, None, 9.0)


@pytest.mark.parametrize(
    ("name", "steps", "lines"),
    [
        # A row for the length offset is combined with the next move in Z, or cancels the offset.
        ("linuxcnc", [("offset", 3), HIGH, ("offset", 0), HIGH], ["G0 G43 H3 Z9", "G49", "Z9"]),
        ("fagor8055", [("offset", 3), HIGH, ("offset", 0)], ["G0 G43 D3 Z9", "G44"]),
        ("grbl", [("offset", 3), HIGH, ("offset", 0)], ["G0 Z9", "G49"]),
        # After a machine move the height is unknown: Z and the axis that moved are stated again.
        (
            "linuxcnc",
            [HIGH, ("rapid", 1.0, 2.0), ("machine", None, None, 0.0), ("rapid", 1.0, 2.0, NAN), HIGH],
            ["G0 Z9", "X1 Y2", "G53 G0 Z0", "X1 Y2", "Z9"],
        ),
        (
            "linuxcnc",
            [HIGH, ("rapid", 1.0, 2.0), ("machine", 0.0), ("rapid", 1.0, 2.0, 9.0), ("feed", 1.0, 3.0, FEED)],
            ["G0 Z9", "X1 Y2", "G53 G0 X0", "X1", "G1 Y3 F60"],
        ),
        ("fanuc", [("machine", None, None, 0.0), ("tool", 2)], ["G91 G28 Z0.", "G90", "(T2)", "T2 M6"]),
        ("fanuc", [HIGH, ("machine", 0.0, 0.0, -1.0)], ["G0 Z9.", "G53 G0 X0. Y0. Z-1."]),
        ("haas", [("machine", None, None, 0.0)], ["G53 G0 Z0."]),
        # At machine height, the new tool may travel before its length is known.
        (
            "haas",
            [("machine", None, None, 0.0), ("tool", 2), ("rapid", 1.0, 2.0), HIGH, ("rapid", 3.0)],
            ["G53 G0 Z0.", "(T2)", "T2 M6", "G0 X1. Y2.", "G43 H2 Z9.", "X3."],
        ),
        ("siemens", [("machine", None, None, 0.0), HIGH], ["G0 SUPA Z0 D0", "Z9"]),
        ("siemens", [("tool", 2), HIGH, ("offset", 0), HIGH], ["; T2", 'T="2"', "M6", "G0 D1 Z9", "D0", "Z9"]),
        ("masso", [HIGH, ("machine", 0.0, None, 0.0)], ["G0 Z9", "G91 G28 X0 Z0", "G90"]),
        # A rapid of a dialect whose G0 states its feed, and the tool of a printer.
        (
            "marlin",
            [HIGH, ("rapid", 1.0), ("feed", 2.0, FEED), ("rapid", 3.0), ("tool", 2)],
            ["G0 Z9 F3000", "G0 X1", "G1 X2 F60", "G0 X3 F3000", "; T2", "M0 T2"],
        ),
        ("grbl", [HIGH, ("tool", 2)], ["G0 Z9", "(T2)", "T2", "M0"]),
        ("rrf", [HIGH, ("tool", 2)], ["G0 Z9", "; T2", "T2", "M226"]),
        # A full circle in a controller that needs an end, in each plane; two units of the last decimal are no circle.
        (
            "grbl",
            [HIGH, ("rapid", 0.0, 0.0), ("arc", True, (0.0, 0.0, 9.0), Arc((5.0, 0.0, 9.0)), FEED)],
            ["G0 Z9", "X0 Y0", "G2 X0 Y0 I5 J0 F60"],
        ),
        (
            "grbl",
            [HIGH, ("rapid", 0.0, 0.0), ("arc", False, (0.0, 0.0, 9.0), Arc((5.0, 0.0, 9.0), 18), FEED)],
            ["G0 Z9", "X0 Y0", "G18 G3 X0 Z9 I5 K0 F60"],
        ),
        (
            "grbl",
            [HIGH, ("rapid", 0.0, 0.0), ("arc", False, (0.0, 4.0, 9.0), Arc((0.0, 2.0, 9.0), 19), FEED)],
            ["G0 Z9", "X0 Y0", "G19 G3 Y4 J2 K0 F60"],
        ),
        (
            "linuxcnc",
            [HIGH, ("rapid", 0.0, 0.0), ("arc", True, (0.0, 0.002, 9.0), Arc((5.0, 0.001, 9.0)), FEED)],
            ["G0 Z9", "X0 Y0", "G2 Y0.002 I5 J0.001 F60"],
        ),
        # After an arc in another plane, a cycle needs G17.
        (
            "linuxcnc",
            [
                HIGH,
                ("rapid", 0.0, 0.0),
                ("arc", False, (2.0, 0.0, 9.0), Arc((1.0, 0.0, 9.0), 18), FEED),
                ("drill", 5.0, 5.0, G81, FEED),
            ],
            ["G0 Z9", "X0 Y0", "G18 G3 X2 I1 K0 F60", "G17 G99 G81 X5 Y5 Z-5 R2", "G80"],
        ),
        # Blending with and without a tolerance, and exact stops.
        (
            "linuxcnc",
            [HIGH, ("blending", 640, 0.1), ("blending", 640), ("blending", 610), ("blending", 611)],
            ["G0 Z9", "G64 P0.1", "G64", "G61", "G61"],
        ),
        ("mach3", [HIGH, ("blending", 640)], ["G0 Z9", "G64"]),
        ("linuxcnc", [HIGH, ("pause",), ("pause", True)], ["G0 Z9", "M0", "M1"]),
        ("rrf", [HIGH, ("pause",)], ["G0 Z9", "M226"]),
        ("linuxcnc", [HIGH, ("coolant", 1), ("coolant", 3), ("coolant", 0)], ["G0 Z9", "M7", "M7 M8", "M9"]),
        ("linuxcnc", [("spindle", 1234.6), ("spindle", -800.0), ("spindle", 0.0)], ["S1235 M3", "S800 M4", "M5"]),
    ],
)  # fmt: skip
def test_rows_are_written_with_the_words_of_the_controller(name: str, steps: list[Any], lines: list[str]) -> None:
    assert lines_of(name, run(*steps), rapid_velocity=50.0) == lines


@pytest.mark.parametrize(
    ("name", "steps", "message"),
    [
        ("linuxcnc", [HIGH, ("rapid", NAN, NAN, NAN)], "a move goes to an unknown position"),
        ("linuxcnc", [HIGH, ("machine",)], "a move in machine coordinates has no target"),
        ("linuxcnc", [("machine",)], "the first move, in machine coordinates, must be in Z only"),
        ("linuxcnc", [("machine", 0.0, None, 0.0)], "the first move, in machine coordinates, must be in Z only"),
        (
            "marlin",
            [("machine", None, None, 0.0)],
            "marlin has no moves in machine coordinates; remove tool_change.position from the machine's profile",
        ),
        (
            "haas",
            [("machine", None, None, 0.0), ("tool", 2), ("rapid", 1.0, 2.0, 9.0)],
            "the first move in Z after a change of tool must be in Z only",
        ),
        (
            "linuxcnc",
            [HIGH, ("rapid", 0.0, 0.0), ("machine", None, None, 0.0), ("drill", 1.0, 1.0, G81, FEED)],
            "a hole is drilled while the position of the tool is unknown",
        ),
        (
            "linuxcnc",
            [HIGH, ("rapid", 0.0, 0.0), ("arc", True, (NAN, 0.0, 9.0), Arc((5.0, 0.0, 9.0)), FEED)],
            "the arc starts at an unknown position",
        ),
        (
            "linuxcnc",
            [HIGH, ("rapid", 0.0, 0.0), ("arc", True, (0.0015, 0.0, 9.0), Arc((5.0, 0.0, 9.0)), FEED)],
            "the ends of an arc are less than two units of the last decimal place apart",
        ),
        ("rrf", [HIGH, ("pause", True)], "rrf has no optional stop (M1)"),
        (
            "linuxcnc",
            [HIGH, ("drill", 1.0, 1.0, G81, FEED), ("drill", 2.0, 1.0, DrillCycle("G84", 2.0, -5.0, True), FEED)],
            "after a tapped hole, the tool does not return to the R plane or the initial plane",
        ),
    ],
)
def test_moves_that_would_surprise_are_refused_with_one_line(name: str, steps: list[Any], message: str) -> None:
    with pytest.raises(PostError) as refused:
        lines_of(name, run(*steps))
    assert str(refused.value) == message
