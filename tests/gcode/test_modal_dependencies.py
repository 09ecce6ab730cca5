"""What blocks take from those before them: the height of the tool."""

from __future__ import annotations

import pytest

from leafcut.gcode.modal_dependencies import BlockReader, height_matters
from rewriting import program_of

HEAD = "G21 G90 G17 / T1 M6 / S1000 M3 / G0 X0 Y0 Z5"


@pytest.mark.parametrize(
    ("blocks", "matters"),
    [
        ("G1 X5 F100", True),
        ("(a comment) /  / G1 X5 F100", True),
        ("G0 Z2 / G1 X5 F100", False),
        ("G0 X5 / G1 Z-1 F100", True),
        ("G0 X5 / G0 Z2", False),
        ("G0 X5 Z2 / G1 Z-1 F100", False),
        ("G0 X5", False),
        ("M8 / G4 P1", False),
        ("G91 G0 Z2", True),
        ("G53 G0 Z0 / G1 X5 F100", False),
        ("G53 G0 X0 / G1 X5 F100", True),
        ("G98 G81 X1 Y1 Z-1 R1 F100", True),
        ("G99 G81 X1 Y1 Z-1 R1 F100", False),
        ("G99 G81 X1 Y1 Z-1 R1 F100 / G98 X2", True),
        ("G99 G81 X1 Y1 Z-1 R1 F100 / G80 / G1 X2", False),
        ("G92 X0", True),
        ("M100", True),
        ("/G0 Z9 / G1 X5 F100", True),
    ],
)
def test_the_height_before_matters_until_a_block_says_its_own(blocks: str, matters: bool) -> None:
    """G98 returns to the height before the cycle, G99 to R; what may be skipped or is not understood may use it."""
    program = program_of(f"{HEAD} / {blocks} / M2")
    lines = range(5, 5 + len(blocks.split(" / ")))
    mine = [block for block in range(program.n_blocks) if int(program.line[block]) in lines]
    assert height_matters(BlockReader(program), mine) == matters
