"""The rows of a program by process: cuts, travel moves, and the beam."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.model.kinds import ProgramKind
from leafcut.model.toolpath import Kind
from leafcut.processes.program.plan.program_rows import beam_off_rows, read_rows
from rewriting import program_of

MILLED = "G21 G90 G17 G94 / S1000 M3 / G0 X0 Y0 Z5 / G1 Z-2 F100 / X10 / Z-3 / X20 / G0 Z5 / X50 / M5 / M2"
LIT = "G21 G90 G94 / M5 / G0 X0 Y0 / M3 S500 / G1 X10 F100 / M5 / G1 X20 / M3 S500 / G1 X30 / M5 / M2"


def places(text: str, process: str, name: str) -> list[float]:
    """Return the X where the rows end of which something holds, for a tool or a beam."""
    program = program_of(text)
    rows = read_rows(program, process)
    return program.path.end[np.flatnonzero(getattr(rows, name)), 0].tolist()


def test_of_a_mill_feeds_cut_and_rapids_across_are_ways() -> None:
    assert places(MILLED, ProgramKind.MILL, "cut") == [0.0, 10.0, 10.0, 20.0]
    assert places(MILLED, ProgramKind.MILL, "travel")[1:] == [50.0]
    rows = read_rows(program_of(MILLED), ProgramKind.MILL)
    assert not rows.beam.any()
    assert np.nanmin(rows.deepest) == -3.0


def test_a_plunge_alone_does_not_count_as_how_deep_is_cut_sideways() -> None:
    rows = read_rows(program_of(MILLED.replace("Z-3 / X20", "X20 / Z-3")), ProgramKind.MILL)
    assert np.nanmin(rows.deepest) == -2.0


def test_of_a_beam_only_what_is_lit_cuts_and_a_feed_in_the_dark_is_a_way() -> None:
    assert places(LIT, ProgramKind.LASER, "cut") == [10.0, 30.0]
    assert places(LIT, ProgramKind.LASER, "travel")[-1] == 20.0
    program = program_of(LIT)
    dark = beam_off_rows(program, ProgramKind.LASER)
    assert program.path.end[dark, 0].tolist() == [20.0]
    assert (program.path.kind[dark] == Kind.FEED).all()


@pytest.mark.parametrize("process", [ProgramKind.MILL, ProgramKind.DRILL])
def test_of_a_tool_no_row_is_dark(process: str) -> None:
    assert not beam_off_rows(program_of(LIT), process).any()
