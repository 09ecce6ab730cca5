"""New moves across areas that the original avoided are reported: counted by brute force, point by point."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from leafcut import api
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.issue import Severity
from leafcut.processes.program.proof.avoided_areas import NEAR, find_avoided_areas
from leafcut.processes.registry import report_of
from leafcut.report.json_answer import program_as_json

FAST = {"iterations": 1, "threads": 1, "preset": "fast"}
YS = (10, 170, 50, 130, 90)
HEAD = "(T1 D=6. end mill)\nG21 G90 G17 G94\nT1 M6\nS5000 M3\nG0 Z20\nG0 X10 Y10\nG0 Z5\n"
END = "G0 Z20\nG0 X0 Y0\nM5\nM30\n"


def slot(x: float, y: float) -> str:
    return f"G0 X{x} Y{y}\nG1 Z-2 F200\nG1 X{x + 4} F600\nG0 Z5\n"


#: A bar of 20 mm between two columns of slots, x 30 to 50 and y 0 to 200: the program goes around its far end at Z5.
AROUND = "".join(slot(10, y) for y in YS) + "G0 X10 Y220\nG0 X60 Y220\n" + "".join(slot(60, y) for y in YS[::-1])
BAR = (30.0, 0.0, 50.0, 200.0)


def moves(text: str) -> list[tuple[int, str, tuple[float, ...], tuple[float, ...]]]:
    """Return (line, G word, start, end) of every move, read word by word."""
    place, found = (math.nan,) * 3, []
    for number, line in enumerate(text.splitlines(), 1):
        words = dict(re.findall(r"([XYZ])(-?[0-9.]+)", line))
        if line.startswith(("G0 ", "G1 ")) and words:
            end = tuple(float(words.get(axis, now)) for axis, now in zip("XYZ", place, strict=True))
            found.append((number, line[:2], place, end))
            place = end
    return found


def points(begin: tuple[float, ...], end: tuple[float, ...]) -> list[tuple[float, float]]:
    """Return places along a move, 0.5 mm apart."""
    if math.isnan(begin[0]):
        return [(end[0], end[1])]
    count = max(1, math.ceil(math.dist(begin[:2], end[:2]) / 0.5))
    return [tuple(a + (b - a) * k / count for a, b in zip(begin[:2], end[:2], strict=True)) for k in range(count + 1)]


def lines_avoided(original: str, new: str) -> list[int]:
    """Return the lines of rapids with a point that is 5 mm or more from all that the original passed as low."""
    visited = []
    for _, _, begin, end in moves(original):
        z = max(begin[2], end[2]) if begin[:2] != end[:2] else min(begin[2], end[2])
        visited += [(p, z) for p in points(begin, end) if not math.isnan(p[0])]
    found = []
    for line, word, begin, end in moves(new):
        if word == "G0" and begin[:2] != end[:2] and not math.isnan(begin[0]):
            low = min(begin[2], end[2])
            near = [p for p, z in visited if z <= low + 1e-3]
            if any(min(math.dist(p, q) for q in near) > NEAR for p in points(begin, end)):
                found.append(line)
    return found


def crosses_bar(begin: tuple[float, ...], end: tuple[float, ...]) -> bool:
    return any(BAR[0] < x < BAR[2] and BAR[1] < y < BAR[3] for x, y in points(begin, end))


@pytest.fixture
def bar(tmp_path: Path) -> Path:
    path = tmp_path / "bar.nc"
    path.write_text(HEAD + AROUND + END)
    return path


@pytest.mark.hazard
def test_new_moves_across_avoided_areas_are_counted_with_their_first_line(bar: Path, tmp_path: Path) -> None:
    """In the summary, in JSON and in the header; on 0.2.0 the bar was crossed without a word."""
    out = tmp_path / "new.nc"
    found = api.optimize(bar, out, **FAST)
    new = out.read_text()
    lines = lines_avoided(bar.read_text(), new)
    low = [line for line, _, a, b in moves(new) if min(a[2], b[2]) < 20 and crosses_bar(a, b)]
    assert low and set(low) <= set(lines)
    avoided = found.detail.avoided
    lowest = min(min(a[2], b[2]) for line, _, a, b in moves(new) if line in lines)
    assert lowest < 20.0
    assert (avoided.moves, avoided.line, avoided.below, avoided.lowest) == (len(lines), lines[0], 20.0, lowest)
    words = f"{len(lines)} new moves cross areas at Z{lowest:g} or higher that the original avoided below Z20"
    (issue,) = (i for i in found.issues if i.code == "L515")
    assert issue.severity is Severity.WARNING
    assert issue.message == f"{words}; name clamps with --keep-out (first: line {lines[0]} of the new program)"
    head = [f"(leafcut: {words})", f"(leafcut: name clamps with --keep-out, first: line {lines[0]})"]
    assert new.splitlines()[:2] == head
    shown = {"moves": len(lines), "line": lines[0], "below": 20.0, "lowest": lowest}
    assert program_as_json(report_of(found))["avoided_areas"] == shown


@pytest.mark.hazard
def test_lower_retracts_are_new_moves_too(bar: Path) -> None:
    """Between the slots the original was at Z5; with --low-retracts the new program crosses there lower."""
    found = api.optimize(bar, low_retracts=True, workpiece="0,0,-10,100,230,0", **FAST)
    lines = lines_avoided(bar.read_text(), found.text)
    assert (found.detail.avoided.moves, found.detail.avoided.line) == (len(lines), lines[0])
    assert len(lines) > 2


def test_slanting_rapids_that_stay_are_not_new() -> None:
    text = HEAD + "G0 X80 Y10 Z20\nG0 X10 Y90 Z5\nG1 Z-2 F200\nG1 X14 F600\nG0 X90 Y90 Z30\n" + END
    assert avoided(text, text) == 0
    assert avoided(text, text.replace("X90 Y90 Z30", "X14 Y90 Z30\nG0 X90 Y90 Z3")) > 0


def test_a_program_in_its_own_order_crosses_nothing_new(bar: Path) -> None:
    found = api.optimize(bar, algorithm="none", **FAST)
    assert found.detail.avoided.moves == 0
    assert "L515" not in {i.code for i in found.issues}


def test_with_named_zones_the_report_is_a_note(bar: Path) -> None:
    found = api.optimize(bar, keep_out="30 0 50 200 3", **FAST)
    (issue,) = (i for i in found.issues if i.code == "L515")
    assert issue.severity is Severity.NOTE


@pytest.mark.hazard
def test_verify_notes_new_moves_across_avoided_areas(bar: Path, tmp_path: Path) -> None:
    out = tmp_path / "new.nc"
    found = api.optimize(bar, out, **FAST)
    proof = api.verify(bar, out)
    assert proof.same
    assert any("2 new moves cross areas at Z" in note and "avoided below Z20" in note for note in proof.notes)
    assert any(f"line {found.detail.avoided.line}" in note for note in proof.notes)


def avoided(original: str, new: str, words: str = "linuxcnc") -> int:
    return find_avoided_areas(*(interpret_program(text, load_dialect(words)) for text in (original, new))).moves


@pytest.mark.hazard
@pytest.mark.parametrize(
    "original, new, count",
    [
        # The same position at the same height, in the opposite direction, and 4 mm beside it.
        ("G0 Z5\nG0 X0 Y0\nG0 X100", "G0 Z5\nG0 X100 Y0\nG0 X0", 0),
        ("G0 Z5\nG0 X0 Y0\nG0 X100", "G0 Z5\nG0 X0 Y4\nG0 X100", 0),
        ("G0 Z5\nG0 X0 Y0\nG0 X100", "G0 Z5\nG0 X0 Y6\nG0 X100", 1),
        # Lower than before, and higher.
        ("G0 Z5\nG0 X0 Y0\nG0 X100", "G0 Z1\nG0 X0 Y0\nG0 X100", 1),
        ("G0 Z5\nG0 X0 Y0\nG0 X100", "G0 Z9\nG0 X0 Y0\nG0 X100", 0),
        # A slope vouches for its highest place; a plunge for its own.
        ("G0 Z5\nG0 X0 Y0\nG0 X100 Z9", "G0 Z5\nG0 X0 Y0\nG0 X100", 1),
        ("G0 Z5\nG0 X0 Y0\nG0 Z-1\nG0 Z5\nG0 X4\nG0 Z-1\nG0 Z5", "G0 Z1\nG0 X0 Y0\nG0 X4", 0),
        # A cut vouches, an arc along its way alone.
        ("G0 Z5\nG0 X0 Y0\nG1 X100 F100", "G0 Z5\nG0 X0 Y0\nG0 X100", 0),
        ("G0 Z5\nG0 X0 Y0\nG2 X100 I50 F100", "G0 Z5\nG0 X0 Y0\nG0 X100", 1),
        ("G0 Z5\nG0 X0 Y0\nG2 X100 I50 F100", "G0 Z5\nG0 X48 Y50\nG0 X52", 0),
        # Holes of a cycle: travel at the R plane, the hole itself below.
        ("G0 Z5\nG99 G81 X0 Y0 Z-3 R2 F100\nX90\nG80\nG0 Z5", "G0 Z2\nG0 X0 Y0\nG0 X90", 0),
        ("G0 Z5\nG99 G81 X0 Y0 Z-3 R2 F100\nX90\nG80\nG0 Z5", "G0 Z1\nG0 X0 Y0\nG0 X90", 1),
        # Another work offset is another place.
        ("G0 Z5\nG0 X0 Y0\nG0 X100", "G55\nG0 Z5\nG0 X0 Y0\nG0 X100", 1),
        # A beam that never moves Z.
        ("G0 X0 Y0\nG0 X100", "G0 X0 Y0\nG0 X100 Y90", 1),
        ("G0 X0 Y0\nG0 X100", "G0 X100 Y0\nG0 X0", 0),
    ],
)
def test_an_area_is_avoided_where_the_original_never_was_as_low(original: str, new: str, count: int) -> None:
    assert avoided(f"G21 G90 G17\n{original}\nM2\n", f"G21 G90 G17\n{new}\nM2\n") == count
