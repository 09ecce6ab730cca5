"""Words that rotate, scale, mirror or wrap all later moves: positions are unknown until the word that ends them."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.gcode.dialects import dialect
from leafcut.gcode.program_interpreter import interpret_program

#: Block that starts a transformation → the word that ends it, by the manuals of Fanuc and Haas.
ENDED_BY = {
    "G16": "G15",  # polar coordinates
    "G51 X0. Y0. P2": "G50",  # scaling
    "G51.1 X0.": "G50.1",  # mirror image
    "G66 P9000": "G67",  # macro at every move
    "G66.1 P9000": "G67",
    "G68 X0. Y0. R30.": "G69",  # rotation
    "G68.2 X0. Y0. Z0. I0. J0. K30.": "G69",  # tilted working plane
    "G12.1": "G13.1",  # polar interpolation
    "G112": "G113",
    "G7": "G8",  # diameter mode of lathes
}


def is_known_after(start: str, end: str, words: str) -> bool:
    """Return whether a move to X2 Y2 Z7 ends at a known place after both blocks."""
    text = f"G21 G90 G17\nG0 X0. Y0. Z5.\n{start}\nG0 X1. Y1. Z6.\n{end}\nG0 X2. Y2. Z7.\nM30\n"
    end_of_move = interpret_program(text, dialect(words)).path.end[-2]
    assert np.isnan(end_of_move).all() or end_of_move.tolist() == [2.0, 2.0, 7.0]
    return not np.isnan(end_of_move).any()


@pytest.mark.hazard
@pytest.mark.parametrize("start", ENDED_BY)
@pytest.mark.parametrize("words", ["fanuc", "linuxcnc"])
def test_positions_are_unknown_until_the_word_that_ends_a_transformation(start: str, words: str) -> None:
    known = {end for end in {*ENDED_BY.values(), ""} if is_known_after(start, end, words)}
    assert known == {ENDED_BY[start]}


@pytest.mark.hazard
def test_the_end_of_a_scaling_leaves_a_rotation_active() -> None:
    both = "G68 X0. Y0. R30.\nG51 X0. Y0. P2"
    assert not is_known_after(both, "G50", "fanuc") and not is_known_after(both, "G69", "fanuc")
    assert is_known_after(both, "G50\nG69", "fanuc")
