"""Any planned toolpath, written and read back, is the same toolpath: the rule that every program rests on."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toolpaths import MILLING, assert_same_rows, planned, units_of

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.words import NumberFormat
from leafcut.post.writer import write_program
from rs274_moves import assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274

CYCLES = ("G81", "G82", "G83", "G73", "G85")


@pytest.mark.parametrize("name", MILLING)
@given(data=st.data(), inch=st.booleans(), numbered=st.booleans())
def test_a_program_reads_back_as_its_toolpath(name: str, data: st.DataObject, inch: bool, numbered: bool) -> None:
    """In every dialect, unit and style: the same moves, within half of the last decimal."""
    profile = load_dialect(name)
    inch, numbered = inch and "inch" in units_of(name), numbered and profile.line_numbers
    path = data.draw(planned(CYCLES, profile.has_machine_moves, "M1" in profile.m_words.split()))
    options = PostOptions(output_units="inch" if inch else "mm", line_numbers=numbered)
    text = write_program(path, profile, options, ["any"])
    read = interpret_own_program(text, profile)
    numbers = NumberFormat(inch, profile.decimals_inch if inch else profile.decimals_mm, False)
    dwell_step = 0.01 if profile.dwell_unit == "cs" else 0.001
    assert_same_rows(expand_cycles(read), expand_cycles(path), numbers.resolution, pecks=26, dwell_step=dwell_step)
    assert max(len(line) for line in text.splitlines()) <= profile.max_line
    if set(CYCLES) <= set(profile.cycles) and not any(c.to_initial for c in path.cycles):
        assert_same_rows(read, path, numbers.resolution, dwell_step=dwell_step)


@pytest.mark.parametrize("name", MILLING)
def test_a_hole_where_the_tool_stands_already_reads_back(name: str) -> None:
    b = ToolpathBuilder()
    b.rapid(z=3.0)
    b.tool(1)
    b.spindle(50.0)
    b.rapid(z=3.0)
    b.rapid(0.0, 0.0)
    b.drill(0.0, 0.0, DrillCycle("G81", 0.5, -1.5), feed=1.0)
    b.rapid(z=60.0)
    b.spindle(0.0)
    b.end()
    path = b.build()
    read = interpret_own_program(write_program(path, load_dialect(name), PostOptions(), ["any"]), load_dialect(name))
    assert_same_rows(expand_cycles(read), expand_cycles(path), 0.001)


@settings(max_examples=25)  # each example starts rs274
@given(path=planned((*CYCLES, "G84")), inch=st.booleans())
def test_linuxcnc_reads_any_program_as_we_do(rs274: str, tmp_path: Path, path: Toolpath, inch: bool) -> None:
    """Any planned toolpath in LinuxCNC's words: rs274 accepts it, and its moves are ours."""
    text = write_program(path, load_dialect("linuxcnc"), PostOptions(output_units="inch" if inch else "mm"))
    status, output = run_rs274(rs274, text, tmp_path)
    assert status == 0, output[-300:]
    ours = moves_of_toolpath(interpret_own_program(text, load_dialect("linuxcnc")))
    assert_same_moves(ours, moves_of_rs274(output), 2e-4 if not inch else 2.6e-3)
