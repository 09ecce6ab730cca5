"""Cuts that can run in either direction: their blocks and points, worked out by hand."""

from __future__ import annotations

import pytest

from leafcut.gcode.reversible_cut import find_reversible_cut
from rewriting import program_of

HEAD = "G21 G90 G17 G94 / T1 M6 / S1000 M3 / G0 X9 Y9 Z5"


@pytest.mark.parametrize(
    ("blocks", "cut"),
    [
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / Y5 / G0 Z5", (2, 4, "0 0, 5 0, 5 5")),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / G2 X9 I2 / G3 X5 R2 / G0 Z5", (2, 5, "0 0, 5 0, 9 0, 5 0")),
        ("G0 X0 / Y0 / G1 Z-1 F50 / X5 / G0 Z5", None),
        ("G1 Z-1 F50 / X5 / G0 Z5", (1, 2, "? ?, 5 ?")),
        ("X5 F50 / Y5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 Z-2 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / Z-2 / X0 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 (X5) / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 (out) / G0 Z5", (2, 3, "0 0, 5 0")),
        ("G0 X0 Y0 (X0) / G1 Z-1 F50 / X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / G0 Z5 (X0)", (2, 3, "0 0, 5 0")),
        ("G0 X0 Y0 / G1 Z-1 F50 / G91 X5 / G90 G0 Z5", None),
        ("G0 X0 Y0 / G91 G1 Z-1 F50 / G90 X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / M8 / X6 / G0 Z5", None),
        ("G0 X0 Y0 / M8 / G1 Z-1 F50 / X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / G4 P1 / X5 / G4 P2 / G0 Z5", (3, 4, "0 0, 5 0")),
        ("G4 P1 / G0 X0 Y0 / G1 Z-1 F50 / X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 S500 / X6 / G0 Z5", (2, 4, "0 0, 5 0, 6 0")),
        ("G0 X0 Y0 S500 / G1 Z-1 F50 / X5 / X6 / M5 / G0 Z5", (2, 4, "0 0, 5 0, 6 0")),
        ("G0 X0 Y0 / G1 Z-1 F50 / G18 X5 / G17 G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / G2 X0 Y0 I2 P2 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / G2 X0 Y0 I2 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / G90.1 G2 X4 I2 J0 / G91.1 G0 Z5", None),
        ("G90.1 G0 X0 Y0 / G1 Z-1 F50 / G2 X4 I2 J0 / G0 Z5", (2, 3, "0 0, 4 0")),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / G0 X8 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / G1 Z5 / G0 X8", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / G1 Z2 / G0 Z5", (2, 3, "0 0, 5 0")),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / G0 Z2 / G1 Z5", None),
        ("G1 Z4 F50 / G0 X0 Y0 / G1 Z-1 / X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / /X5 / X6 / G0 Z5", None),
        ("G20 G0 X0 Y0 / G1 Z-1 F50 / X.5 / Y.25 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / G95 X5 F.1 / G94 G0 Z5", None),
        ("G93 / G0 X0 Y0 / G1 Z-1 F50 / X5 F3 / G0 Z5", None),
        ("N1 G0 X0 Y0 / N2 G1 Z-1 F50 / N3 X5 / N4 G0 Z5", (2, 3, "0 0, 5 0")),
        ("G0 X0 Y0 / G1 Z-1 F50 / A5 / X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / X5 / X6 / G0 Z5", None),
        ("G0 X0 Y0 / G81 Z-1 R1 F50 / G80 / G1 X5 / G0 Z5", None),
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 / G53 G0 Z0", None),
    ],
)
def test_a_cut_is_reversible_if_all_its_blocks_are_plain_and_level(
    blocks: str, cut: tuple[int, int, str] | None
) -> None:
    """The first block of the cut, the first after it, and the points; a coordinate without a word is `?`. The lead has
    to move to its start, and the tail to leave its end. Remarks with positions, other modes in the cut, cuts at two
    heights, full turns written without an end, and dwells elsewhere than at its ends forbid it."""
    program = program_of(f"{HEAD} / {blocks} / M2")
    lines = range(5, 5 + len(blocks.split(" / ")))
    mine = [block for block in range(program.n_blocks) if int(program.line[block]) in lines]
    found = find_reversible_cut(program, mine[0], mine[-1] + 1)
    if cut is None:
        assert found is None
    else:
        assert found is not None and (found.begin, found.end) == (mine[0], mine[-1] + 1)
        points = ", ".join(" ".join(text or "?" for text in place) for place in found.places)
        assert (found.body - mine[0], found.tail - mine[0], points) == cut
        assert [int(program.row_block[row]) for row in found.rows] == list(range(found.body, found.tail))
