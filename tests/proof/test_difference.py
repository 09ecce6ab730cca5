"""Text of differences."""

from __future__ import annotations

import math

import pytest

from leafcut.model.toolpath import ToolpathBuilder
from leafcut.proof.difference import describe, place

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
    assert place(*where) == words


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
    builder.pause(1)
    builder.end()
    assert [describe(row) for row in builder.build()] == [
        "change to tool 3",
        "length offset 2",
        "spindle at rpm -1200.5",
        "rapid to X1.000 Y2.000 Z3.000",
        "feed to X4.000 Y2.000 Z3.000",
        "rapid in machine coordinates to Z0.000",
        "radius compensation G41 D2.5",
        "radius compensation G40",
        "blending G61.1",
        "torch on",
        "height control off",
        "pause M1",
        "end of program",
    ]
