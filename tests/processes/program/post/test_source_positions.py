"""Positions of the tool in an original program, compared with a reading by hand."""

from __future__ import annotations

import pytest

from leafcut.processes.program.post.rewriter import OriginalPositions
from rewriting import program_of


def test_the_initial_height_of_a_cycle_is_that_before_its_first_hole() -> None:
    """With G99 the tool is at R1 between the holes, but the next G98 returns to Z5."""
    text = "G21 G90 / G0 X0 Y0 Z5 / G99 G81 X1 Y1 Z-1 R1 F100 / X2 / X3 / G80 / G0 Z9 / M2"
    original = OriginalPositions(program_of(text))
    assert [original.position_before(block)[2] for block in (2, 3, 4, 7)] == [5.0, 1.0, 1.0, 9.0]
    assert [original.initial_height_before(block) for block in (2, 3, 4, 5, 7)] == [5.0, 5.0, 5.0, 5.0, 9.0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G0 X5 / M0", False),
        ("G1 Z-1 F100 / G0 Z5 / M0", True),
        ("G1 Z-1 F100 / G0 Z5 / M0 / G0 X9 / M0", False),
        ("G0 X5 / G4 P1 / M0", True),
        ("G4 P1 / G0 X5 / M0", False),
    ],
)
def test_work_since_the_last_stop_is_a_cut_or_a_dwell_after_a_sideways_move(text: str, expected: bool) -> None:
    program = program_of(f"G21 G90 / G0 X0 Y0 Z5 / T1 M6 / {text}")
    assert OriginalPositions(program).follows_work(program.n_blocks - 1) is expected
