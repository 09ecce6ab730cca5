"""The proof of new speeds and heights: which texts go the same way, and which do anything else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.errors import VerifyError
from leafcut.model.pace import PaceStretch
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.program.proof.new_speeds import _lowered_rows, changed_stretches, rows_changed_to_rapid
from rewriting import program_of

HEAD = "G21 G90 G17 / T1 M6 / S1000 M3 / G0 X0 Y0 Z5"
WORK = "G1 Z-1 F60 / X10 F600 / G2 X1010 Y0 I500 J0 / G4 P1 / G99 G81 X1020 Y0 Z-2 R1 F300 / G80 / G0 Z20"
FOOT = "M5 / M2"
TEXT = f"{HEAD} / {WORK} / {FOOT}"


def stretches(new: str) -> dict[int, tuple[PaceStretch, ...]]:
    return changed_stretches(program_of(TEXT).path, program_of(new).path)


def row_of(line: int) -> int:
    """Return the row of the path of the original that a line makes."""
    return int(np.flatnonzero(program_of(TEXT).path.line == line)[0])


def changed(old: str, new: str, text: str = TEXT) -> str:
    assert old in text
    return text.replace(old, new, 1)


def test_the_same_program_has_no_new_speeds() -> None:
    assert stretches(TEXT) == {}


@pytest.mark.parametrize(
    ("old", "new", "line", "parts"),
    [
        ("X10 F600 / G2", "X10 F660 / F600 G2", 6, [(1.0, 11.0)]),
        ("X10 F600", "X2.5 F300 / X10 F600", 6, [(0.25, 5.0), (1.0, 10.0)]),
        ("X10 F600", "G0 X4 / G1 X5 F600 / X10", 6, [(0.4, math.inf), (0.5, 10.0), (1.0, 10.0)]),
        ("G1 Z-1 F60 / X10", "G0 Z2 / G1 Z-1 F60 / X10", 5, [(0.5, math.inf), (1.0, 1.0)]),
        ("G2 X1010 Y0 I500 J0", "G0 X1010 Y0", 7, [(1.0, math.inf)]),
        ("G2 X1010 Y0 I500 J0", "G2 X1010 Y0 I500 J0 F900", 7, [(1.0, 15.0)]),
    ],
)
def test_new_speeds_are_found_with_their_shares(
    old: str, new: str, line: int, parts: list[tuple[float, float]]
) -> None:
    """300 mm/min are 5 mm/s; a rapid has no limit."""
    ((row, found),) = stretches(changed(old, new)).items()
    assert row == row_of(line)
    assert [one.until for one in found] == pytest.approx([until for until, _ in parts])
    assert [one.speed for one in found] == pytest.approx([speed for _, speed in parts])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("G0 Z20", "G0 X1020.001 Z20"),
        ("X10 F600", "X5 Y0.001 F600 / X10 Y0"),
        ("X10 F600", "X5 F600 / X4 / X10"),
        ("X10 F600", "X11 F600 / X10"),
        ("X10 F600", "X-1 F600 / X10"),
        ("G2 X1010", "G3 X1010"),
        ("I500 J0", "I500 J0.001"),
        ("I500 J0", "I500.001 J0"),
        ("G2 X1010 Y0 I500 J0", "G0 X1010 Y0.001"),
        ("P1", "P2"),
        ("G4 P1 / ", ""),
        ("Z-2 R1", "Z-2.1 R1"),
        ("Z-2 R1", "Z-2 R0.9"),
        ("T1 M6", "T2 M6"),
        ("S1000", "S1001"),
        ("G0 Z20", "G0 Z20.001"),
        ("M5 / M2", "M5 / G0 X0 / M2"),
    ],
)
def test_any_other_way_or_work_is_refused(old: str, new: str) -> None:
    with pytest.raises(VerifyError, match=r"^line \d+: the program with new speeds differs from line \d+"):
        stretches(changed(old, new))


def test_a_program_that_goes_on_or_stops_early_is_refused_with_the_place() -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=5.0, line=1)
    short = builder.build()
    builder.feed(z=1.0, feed=1.0, line=2)
    long = builder.build()
    with pytest.raises(VerifyError, match=r"^the end: .* differs from line 2 of the original"):
        changed_stretches(long, short)
    with pytest.raises(VerifyError, match=r"^line 2: the program with new speeds continues after the end"):
        changed_stretches(short, long)


def test_new_rapids_are_counted_in_rows_of_the_new_program() -> None:
    """The cut of line 6 has three parts, the second is a rapid; the arc is a rapid along its chord."""
    new = changed("G2 X1010 Y0 I500 J0", "G0 X1010 Y0", changed("X10 F600", "X4 F600 / G0 X5 / G1 X10"))
    after = program_of(new).path
    rows, chords = rows_changed_to_rapid(program_of(TEXT).path, stretches(new))
    assert after.end[rows, 0].tolist() == [5, 1010]
    assert after.end[chords, 0].tolist() == [1010]


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [("Y0 Z5", "Y0 Z3", 4), ("G0 Z20", "G0 Z19.999", 11), ("Z-2 R1", "Z-2 R0.5", 9)],
)
def test_a_lower_way_is_found_with_its_row(old: str, new: str, line: int) -> None:
    rows = _lowered_rows(program_of(TEXT).path, program_of(changed(old, new)).path)
    assert rows is not None and row_of(line) in rows


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Y0 Z5", "Y0 Z6"),
        ("X10 F600", "X10.001 F600"),
        ("X10 F600", "X10 F601"),
        ("I500 J0", "I500 J0.001"),
        ("I500 J0", "I500.001 J0"),
        ("Z-2 R1", "Z-2.1 R1"),
        ("Z-2 R1", "Z-2 R1.1"),
        ("G99 G81", "G98 G81"),
        ("G81 X1020 Y0 Z-2 R1 F300", "G82 X1020 Y0 Z-2 R1 P1 F300"),
        ("T1 M6", "T2 M6"),
        ("P1", "P2"),
        ("G4 P1 / ", ""),
    ],
)
def test_a_higher_or_another_way_is_no_lower_one(old: str, new: str) -> None:
    assert _lowered_rows(program_of(TEXT).path, program_of(changed(old, new)).path) is None
