"""Words that rotate, scale, mirror or wrap all later moves: positions are unknown until the word that ends them."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
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
    end_of_move = interpret_program(text, load_dialect(words)).path.end[-2]
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


#: Words that the reader does not know, by the manuals of Fanuc, Haas, Siemens and Okuma: limits, accuracy, offsets …
NO_MOTION = "G8 G9 G11 G22 G22.1 G23 G23.1 G25 G26 G35 G36 G37 G48 G60 G62 G63 G103 G153 G154 G187 G188 " + " ".join(
    f"G{number}" for number in range(110, 130) if number not in (112, 113)
)
#: Words that select a motion, or whose effect on motion nobody knows.
MOTIONS = "G6 G12 G13 G34 G77 G77.1 G109 G130 G131 G152 G155 G186 G189 G104"


@pytest.mark.parametrize("words", ["haas", "mach3"])
def test_only_a_word_that_may_select_a_motion_leaves_later_moves_unknown(words: str) -> None:
    for group, known in ((NO_MOTION, True), (MOTIONS, False)):
        for word in group.split():
            text = f"G21 G90 G17\nG0 X0. Y0. Z5.\n{word}\nX2. Y2. Z7.\nM30\n"
            end = interpret_program(text, load_dialect(words)).path.end[-2]
            assert (end.tolist() == [2.0, 2.0, 7.0]) is known, word
            # With an axis, any unknown word may move it in its own way.
            text = f"G21 G90 G17\nG0 X0. Y0. Z5.\n{word} X1.\nX2. Y2. Z7.\nM30\n"
            assert np.isnan(interpret_program(text, load_dialect(words)).path.end[-2]).all(), word
