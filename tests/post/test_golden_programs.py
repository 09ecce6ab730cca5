"""Golden programs: one toolpath in every dialect and both units, as text, and read back row by row.

After a change that is meant: LEAFCUT_WRITE_GOLDEN=1 pytest tests/post/test_golden_programs.py, and look at the diff.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from toolpaths import MILLING, assert_same_rows, two_tools, units_of

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind
from leafcut.options import PostOptions
from leafcut.post.words import NumberFormat
from leafcut.post.writer import write_program
from rs274_moves import assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274

GOLDEN = Path(__file__).parents[1] / "golden"
CASES = [(name, units) for name in MILLING for units in units_of(name)]


def program(name: str, units: str) -> str:
    """Write the hand-made toolpath."""
    header = ["two tools", "T1 drill Ø3 mm (carbide)", "T2 mill 6 mm"]
    return write_program(
        two_tools(name),
        load_dialect(name),
        PostOptions(output_units=units),
        header,
        tool_names={1: "drill 3 mm", 2: "mill 6 mm"},
        rapid_velocity=50.0,
    )


@pytest.mark.parametrize("name, units", CASES)
def test_a_program_is_the_golden_one(name: str, units: str) -> None:
    """Byte by byte: a change of a post is seen in a diff of programs."""
    file = GOLDEN / f"two_tools_{name}_{units}{load_dialect(name).extension}"
    text = program(name, units)
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        file.write_bytes(text.encode("ascii"))
    assert file.read_bytes() == text.encode("ascii")


@pytest.mark.parametrize("name, units", CASES)
def test_a_golden_program_reads_back_as_its_toolpath(name: str, units: str) -> None:
    """Every row is there again, within half of the last decimal; the length offset follows the tool."""
    profile = load_dialect(name)
    file = GOLDEN / f"two_tools_{name}_{units}{profile.extension}"
    read = interpret_own_program(file.read_text(encoding="ascii"), profile, file.name)
    meant = two_tools(name)
    numbers = NumberFormat(units == "inch", profile.decimals_inch if units == "inch" else profile.decimals_mm, False)
    if {c.name for c in meant.cycles} <= set(profile.cycles):
        assert_same_rows(read, meant, numbers.resolution)
    assert_same_rows(expand_cycles(read), expand_cycles(meant), numbers.resolution, pecks=5)
    tools = [m.ref for m in read if m.kind is Kind.TOOL]
    offsets = [m.ref for m in read if m.kind is Kind.OFFSET and m.ref]
    # A Fagor uses D with the tool while G43 is active, and the program repeats it.
    assert tools == [1, 2] and list(dict.fromkeys(offsets)) == ([1, 2] if profile.length_offset else [])


@pytest.mark.parametrize("units", ["mm", "inch"])
@pytest.mark.parametrize("name", ["linuxcnc", "grbl", "mach3"])
def test_linuxcnc_runs_a_golden_program_as_meant(rs274: str, tmp_path: Path, name: str, units: str) -> None:
    """rs274 accepts programs in RS274/NGC words, and its moves agree with the toolpath."""
    text = (GOLDEN / f"two_tools_{name}_{units}{load_dialect(name).extension}").read_text(encoding="ascii")
    status, output = run_rs274(rs274, text, tmp_path)
    assert status == 0, output[-300:]
    step = 0.001 if units == "mm" else 0.00254
    by_hand = load_dialect(name).tool_change == "pause"
    theirs = moves_of_rs274(output)
    for path, tolerance in (
        (interpret_own_program(text, load_dialect(name)), step / 5 if units == "mm" else step),
        (two_tools(name), 3 * step),
    ):
        # To rs274 a change by hand is a pause.
        ours = [m for m in moves_of_toolpath(path) if not (by_hand and m[0] == "tool")]
        assert_same_moves(ours, theirs, tolerance)
