"""What blocks take from those before them: modes, the position, and the height of the tool."""

from __future__ import annotations

import pytest

from leafcut.gcode.modal_dependencies import HERE, INHERITED, BlockReader, depends_on_height, next_position
from leafcut.gcode.program import Program
from rewriting import program_of

HEAD = "G21 G90 G17 / T1 M6 / S1000 M3 / G0 X0 Y0 Z5"


def blocks_of(blocks: str) -> tuple[Program, list[int]]:
    """Return a program with these blocks after `HEAD`, and their numbers."""
    program = program_of(f"{HEAD} / {blocks} / M2")
    lines = range(5, 5 + len(blocks.split(" / ")))
    return program, [block for block in range(program.n_blocks) if int(program.line[block]) in lines]


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
    program, mine = blocks_of(blocks)
    assert depends_on_height(BlockReader(program), mine) == matters


@pytest.mark.parametrize(
    ("blocks", "relies", "sets"),
    [
        ("G1 X5 F100", "feed_mode incremental rpm", "feed feed_mode incremental motion rpm"),
        ("M5 / G1 X5 F100", "feed_mode incremental", "feed feed_mode incremental motion"),
        ("X5", "incremental motion", "incremental motion"),
        ("G90 G0 X5", "", "incremental motion"),
        ("G2 X5 Y0 I2.5 F100", "absolute_centres feed_mode incremental plane rpm",
         "absolute_centres feed feed_mode incremental motion plane rpm"),
        ("G17 G91.1 G90 G94 S900 G3 X5 Y0 I2.5 F100", "",
         "absolute_centres feed feed_mode incremental motion plane rpm"),
        ("G81 X1 Y1 Z-1 R1 F100", "feed_mode incremental plane rpm to_initial",
         "feed feed_mode incremental motion plane rpm to_initial"),
        ("G99 G17 G82 X1 Y1 Z-1 R1 P1 F100 / X2", "feed_mode incremental rpm",
         "feed feed_mode incremental motion plane rpm to_initial"),
        ("M3 S500", "", "rpm"),
        ("M4", "rpm", "rpm"),
        ("M5", "", ""),
        ("M8 / G4 P1", "", ""),
        ("G53 G0 Z0", "", "motion"),
        ("M62 P1", "", ""),
        ("M72", " ".join(sorted(INHERITED)), " ".join(sorted(INHERITED))),
        ("G1 X5 F100 / (a remark) / X6", "feed_mode incremental rpm", "feed feed_mode incremental motion rpm"),
        ("G95", "", "feed_mode"),
        ("G93", "", "feed_mode"),
        ("G18", "", "plane"),
        ("G91", "", "incremental"),
        ("G90.1", "", "absolute_centres"),
        ("G98", "", "to_initial"),
        ("G80", "", "motion"),
        ("G38.2 Z-5 F100", "absolute_centres feed feed_mode incremental motion plane rpm to_initial",
         "absolute_centres feed feed_mode incremental motion plane rpm to_initial"),
        ("G1 X5 F100 / G38.2 Z-5", "absolute_centres feed_mode incremental plane rpm to_initial",
         "absolute_centres feed feed_mode incremental motion plane rpm to_initial"),
        ("/G0 X5", "absolute_centres feed feed_mode incremental motion plane rpm to_initial",
         "absolute_centres feed feed_mode incremental motion plane rpm to_initial"),
    ],
)  # fmt: skip
def test_a_block_relies_on_the_modes_that_it_uses_and_does_not_state(blocks: str, relies: str, sets: str) -> None:
    """A cut uses the motion, G90 or G91, the feed and its mode, and the speed of a turning spindle; an arc also the
    plane and the kind of its centre; a hole also the plane and G98 or G99. An unknown block may use and set all."""
    program, mine = blocks_of(blocks)
    found = BlockReader(program).modal_use(mine[0], mine[-1] + 1)
    assert (" ".join(sorted(found.inherited)), " ".join(sorted(found.sets))) == (relies, sets)


def test_a_hole_without_its_cycle_words_relies_on_the_cycle() -> None:
    program, mine = blocks_of("G81 X1 Y1 Z-1 R1 F100 / X2")
    found = BlockReader(program).modal_use(mine[1], mine[1] + 1)
    assert found.inherited == found.sets == INHERITED - {"absolute_centres"}


def test_the_first_blocks_that_state_modes_and_letters() -> None:
    program, mine = blocks_of("G1 X5 F100 / F200 S900 / G81 X1 Y1 Z-1 R1 / X2 R2")
    reader, first = BlockReader(program), mine[0]
    assert reader.first_blocks_by_field == {
        "incremental": 0,
        "plane": 0,
        "rpm": 2,
        "motion": 3,
        "feed": first,
    }
    assert reader.blocks_by_letter == {
        "S": ([2, first + 1], ["1000", "900"]),
        "F": ([first, first + 1], ["100", "200"]),
        "X": ([first + 2, first + 3], ["1", "2"]),
        "Y": ([first + 2], ["1"]),
        "Z": ([first + 2], ["-1"]),
        "R": ([first + 2, first + 3], ["1", "2"]),
    }
    assert reader.fields_set_in_blocks(first, first + 3) == {"motion", "feed", "rpm"}


@pytest.mark.parametrize(
    ("blocks", "place"),
    [
        ("G0 X5 Y6", (5.0, 6.0)),
        ("G0 X5", HERE),
        ("G0 X5 / G0 Y6", (5.0, 6.0)),
        ("M8", None),
        ("(a remark) /  / M8", None),
        ("G1 X5 Y6 F100", HERE),
        ("G2 X5 Y0 I2.5 F100", HERE),
        ("G0 Z9 / G0 X5 Y6", (5.0, 6.0)),
        ("G0 Z2 / G0 X5 Y6", (5.0, 6.0)),
        ("G0 Z1.99 / G0 X5 Y6", HERE),
        ("G4 P1 / G0 X5 Y6", HERE),
        ("G4 P1", HERE),
        ("M0 / G4 P1 / G0 X5 Y6", (5.0, 6.0)),
        ("G4 P1 / M0 / G0 X5 Y6", (5.0, 6.0)),
        ("T2 M6 / G0 X5 Y6", (5.0, 6.0)),
        ("G53 G0 X0 Y0", None),
        ("G53 G0 Z0 / G0 X5 Y6", (5.0, 6.0)),
        ("G53 G0 X0 / G0 X5 Y6", (5.0, 6.0)),
        ("G91 G0 X5 Y6", HERE),
        ("G81 X5 Y6 Z-1 R1 F100", (5.0, 6.0)),
        ("G81 X5 Z-1 R1 F100", HERE),
        ("M100", HERE),
        ("G55 / G0 X5 Y6", HERE),
        ("G92 X0 / G0 X5 Y6", HERE),
        ("/G0 X5 Y6", HERE),
    ],
)
def test_the_next_place_is_that_of_the_first_move_that_states_both_coordinates(
    blocks: str, place: tuple[float, float] | str | None
) -> None:
    """A cut, a dwell amid cuts, a low move and an unknown block happen at the place before them."""
    program, mine = blocks_of(blocks)
    assert next_position(BlockReader(program), mine, clearance=2.0) == place
