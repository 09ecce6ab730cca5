"""Holes and strokes that are missing side by side: one difference, with its lines, number and places."""

from __future__ import annotations

import pytest

from leafcut.model.difference import Difference
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

HEAD = "G21 G90 G17 G40 G94 / T1 M6 / S900 M3 / G0 Z5 / G99 G81 X0 Y0 Z-1 R1 F60"
#: Places from line 6, and strokes of four lines each from line 5.
HOLES = [f"X{10 * k} Y{k}" for k in range(1, 8)]
STROKES = [f"G0 X{10 * k} Y0 / G1 Z-1 F60 / Y{k} / G0 Z5" for k in range(1, 8)]


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (1, "G81 at X10.000 Y1.000 Z-1.000 with tool 1 is"),
        (2, "2 holes at X10.000 Y1.000 Z-1.000 and X20.000 Y2.000 Z-1.000 with tool 1 are"),
        (3, "3 holes at X10.000 Y1.000 Z-1.000, X20.000 Y2.000 Z-1.000 and X30.000 Y3.000 Z-1.000 with tool 1 are"),
        (4, "4 holes, the first G81 at X10.000 Y1.000 Z-1.000, with tool 1 are"),
        (6, "6 holes, the first G81 at X10.000 Y1.000 Z-1.000, with tool 1 are"),
    ],
)
def test_missing_and_added_holes_of_a_series_are_one_difference(count: int, text: str) -> None:
    whole, part = (program_of(" / ".join([HEAD, *some, "G80", "M5", "M2"])) for some in (HOLES, HOLES[count:]))
    lines = [(6 + k, 0) for k in range(count)]
    gone = Difference("missing hole", *lines[0], f"{text} missing", tuple(lines[1:]))
    assert list(certify(whole, part).differences) == [gone]
    added = Difference("extra hole", 0, 6, f"{text} new", tuple((0, line) for line, _ in lines[1:]))
    assert list(certify(part, whole).differences) == [added]


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (1, "2 cuts from X10.000 Y0.000 Z5.000 to X10.000 Y1.000 Z-1.000 with tool 1 are missing"),
        (2, "4 cuts, the first at X10.000 Y0.000 Z-1.000, with tool 1 are missing"),
        (4, "8 cuts, the first at X10.000 Y0.000 Z-1.000, with tool 1 are missing"),
    ],
)
def test_missing_strokes_are_one_difference(count: int, text: str) -> None:
    head = HEAD.rpartition(" / ")[0]
    whole, part = (program_of(" / ".join([head, *some, "M5", "M2"])) for some in (STROKES, STROKES[count:]))
    lines = [(line + 4 * k, 0) for k in range(count) for line in (6, 7)]
    (found,) = certify(whole, part).differences
    assert found == Difference("missing cut", *lines[0], text, tuple(lines[1:]))
