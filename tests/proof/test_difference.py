"""Text of differences."""

from __future__ import annotations

import math

import pytest

from leafcut.model.difference import Difference
from leafcut.model.toolpath import Arc, DrillCycle, Kind, ToolpathBuilder
from leafcut.proof.difference import describe_motion, limit_differences, position_text, start_and_end_texts

NAN = math.nan


@pytest.mark.parametrize(
    "where, words",
    [
        ((1.0, 2.5, -3.0), "X1.000 Y2.500 Z-3.000"),
        ((1.0, 2.5), "X1.000 Y2.500"),
        ((1.0, 2.5, NAN), "X1.000 Y2.500 and an unknown Z"),
        ((NAN, 2.5, NAN), "Y2.500 and an unknown X and Z"),
        ((NAN, NAN, NAN), "an unknown position"),
        ((NAN, NAN), "an unknown position"),
    ],
)
def test_a_place_that_is_not_known_is_told_in_words(where: tuple[float, ...], words: str) -> None:
    assert position_text(*where) == words


def test_each_row_is_described_in_words() -> None:
    builder = ToolpathBuilder()
    builder.tool(3)
    builder.offset(2)
    builder.spindle(-1200.5)
    builder.rapid(1.0, 2.0, 3.0)
    builder.feed(4.0, feed=1.0)
    builder.machine(z=0.0)
    builder.radius(41, 2.5)
    builder.radius(40)
    builder.blending(611)
    builder.torch(True)
    builder.height_control(False)
    builder.pause()
    builder.pause(optional=True)
    builder.pause()
    builder.machine(x=1.0, y=2.5)
    builder.set_place(Kind.MACHINE, (NAN, NAN, NAN), 0)
    builder.set_place(Kind.SHIFT, (1.0, NAN, 3.0), 0)
    builder.set_place(Kind.FRAME, (NAN, NAN, NAN), 540)
    builder.set_place(Kind.FRAME, (NAN, NAN, NAN), 591)
    builder.set_place(Kind.FOREIGN, (1.0, 1.0, 1.0), 4)
    builder.rapid(1.0, 2.0, 3.0)
    builder.arc(True, (3.0, 2.0, 3.0), Arc((2.0, 2.0, 3.0)), feed=1.0)
    builder.arc(False, (5.0, 2.0, 3.0), Arc((4.0, 2.0, 3.0)), feed=1.0)
    builder.drill(5.0, 6.0, DrillCycle("G81", 2.0, -5.0), feed=1.0)
    builder.end_cycles()
    builder.probe(-1.0, feed=1.0)
    builder.dwell(0.25)
    builder.coolant(2)
    builder.torch(False)
    builder.height_control(True)
    builder.end()
    assert [describe_motion(row) for row in builder.build()] == [
        "change to tool 3",
        "length offset 2",
        "spindle speed -1200.5 rpm",
        "rapid to X1.000 Y2.000 Z3.000",
        "feed to X4.000 Y2.000 Z3.000",
        "rapid in machine coordinates to Z0.000",
        "radius compensation G41 D2.5",
        "radius compensation G40",
        "blending G61.1",
        "torch on",
        "height control off",
        "pause M0",
        "pause M1",
        "pause M0",
        "rapid in machine coordinates to X1.000 Y2.500",
        "rapid in machine coordinates to an unknown position",
        "shift of the origin that puts the tool at X1.000 Z3.000 and an unknown Y",
        "work offset G54",
        "work offset G59.1",
        "block that is not understood, number 4",
        "rapid to X1.000 Y2.000 Z3.000",
        "arc clockwise to X3.000 Y2.000 Z3.000",
        "arc counter-clockwise to X5.000 Y2.000 Z3.000",
        "drilling cycle to X5.000 Y6.000 Z2.000",
        "probe to X5.000 Y6.000 Z-1.000",
        "dwell of 0.25 s",
        "coolant 2",
        "torch off",
        "height control on",
        "end of program",
    ]


def test_a_move_has_the_position_before_it_as_its_start() -> None:
    builder = ToolpathBuilder()
    builder.rapid(1.0, 2.0)
    builder.rapid(z=3.0)
    path = builder.build()
    assert start_and_end_texts(path, 0) == ("an unknown position", "X1.000 Y2.000 and an unknown Z")
    assert start_and_end_texts(path, 1) == ("X1.000 Y2.000 and an unknown Z", "X1.000 Y2.000 Z3.000")


@pytest.mark.parametrize(
    ("n", "count", "more"), [(50, None, 0), (51, None, 1), (70, None, 20), (50, 50, 0), (50, 90, 40), (3, 3, 0)]
)
def test_fifty_differences_are_listed_and_the_others_counted(n: int, count: int | None, more: int) -> None:
    given = [Difference("feed", k, k, "") for k in range(n)]
    rest = [Difference("and more", 0, 0, f"{more} more differences")] if more else []
    assert limit_differences(given, count) == given[: min(n, 50)] + rest
