"""Reasons why tasks of a program stay: the reported reason is the only cause; without it they are unlocked."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from itertools import permutations
from typing import NamedTuple

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.sequence import StayGroup
from leafcut.processes.program.plan.fixed_tasks import PHRASES, _immovable_tasks, count_tasks, group_stay_reasons
from leafcut.processes.program.plan.precedence import ties_from_pairs
from leafcut.processes.program.plan.resequencing import find_sequence

HEAD = "G21 G90 G94 G17\nT1 M6 (T1 D=3. END MILL)\nS1000 M3\nG43 H1\nG0 Z5.\n"


def hole(x: float, y: float = 0.0) -> str:
    """Return a piece of work: a hole drilled by hand, at a place; three lines."""
    return f"G0 X{x:.1f} Y{y:.1f}\nG1 Z-1. F100.\nG0 Z5.\n"


def holes(*xs: float) -> str:
    return "".join(map(hole, xs))


def square(x: float, size: float = 10.0, z: float = -1.0) -> str:
    """Return a piece of work: a square; seven lines."""
    corners = "".join(f"X{x + a * size:.1f} Y{b * size:.1f}\n" for a, b in ((1, 0), (1, 1), (0, 1), (0, 0)))
    return f"G0 X{x:.1f} Y0.\nG1 Z{z:.1f} F100.\n{corners}G0 Z5.\n"


def line(x: float, y: float, length: float = 30.0, z: float = -1.0) -> str:
    """Return a piece of work: a line along X; four lines."""
    return f"G0 X{x:.1f} Y{y:.1f}\nG1 Z{z:.1f} F100.\nX{x + length:.1f}\nG0 Z5.\n"


class Case(NamedTuple):
    """A program in which `held` pieces stay for a reason, at a line and by a word; and the same without that."""

    reason: str
    held: int
    first_line: int
    word: str
    program: str
    without: str
    control: str = "linuxcnc"
    head: str = HEAD


SHRINKING = square(0) + square(20, 11, -1.2) + square(40, 9, -1.4)
UNTOLD = HEAD.replace(" (T1 D=3. END MILL)", "")
LASER = "G21 G90\nM5\nG0 X0. Y0.\n"


def burn(x: float) -> str:
    """Return a piece of a laser's work; four lines."""
    return f"G0 X{x:.1f} Y0.\nM3 S500\nG1 Y9. F900.\nM5\n"


FAR = "".join(f"{holes(x, x + 5, x + 9)}G0 Z20.\n" for x in (0, 30))
M8 = f"{holes(0, 9)}M8\n"
CASES = (
    Case("frees", 3, 6, "", SHRINKING, SHRINKING + line(0, 90, z=-9)),
    Case("touches", 3, 6, "", line(0, 0) + line(0, 1) + line(0, 2), line(0, 0) + line(0, 20) + line(0, 40)),
    Case("passes", 2, 6, "", line(0, 0, z=-2) + line(0, 9), line(0, 0) + line(0, 9), head=UNTOLD),
    Case("inside", 2, 6, "", square(0, 40) + hole(20, 20), square(0, 40) + hole(60, 20)),
    Case("operation", 1, 6, "", f"{hole(0)}(second operation)\n{holes(9, 20)}", holes(0, 9, 20)),
    Case("holds", 1, 13, "M8", f"{holes(0, 9)}G0 X20.\nM8\nG1 Z-1.\nG0 Z5.\n{holes(30, 60)}", holes(0, 9, 20, 30, 60)),
    Case("alone", 2, 9, "M8", f"{hole(0)}M8\n{hole(30)}", holes(0, 30)),
    Case("alone", 1, 12, "G12 I5.", f"{holes(0, 9)}G12 I5.\nG0 Z5.\n{hole(30)}M30\n",
         f"{holes(0, 9)}{hole(30)}M30\n", control="haas"),
    Case("only", 1, 6, "", hole(0), holes(0, 9)),
    Case("unknown-height", 1, 14, "", f"{holes(0, 9)}G49\nG43 H2\n{hole(20)}G0 Z5.\n{holes(30, 40)}",
         f"{holes(0, 9)}G49\nG43 H2\nG0 Z5.\n{hole(20)}G0 Z5.\n{holes(30, 40)}"),
    Case("low", 1, 12, "", f"{holes(0, 9)}G0 X20.\nG1 Z-1.\nG0 Z1.\nG4 P1\n",
         f"{holes(0, 9)}G0 X20.\nG1 Z-1.\nG0 Z5.\n"),
    Case("goes-on", 1, 15, "M8", f"{holes(0, 9, 20)}M8\nG0 Z20.\n{holes(70, 90)}",
         f"{holes(0, 9, 20)}M8\n{holes(70, 90)}"),
    Case("crossing", 1, 26, "", f"{FAR}{hole(50)}G0 Z20.\n{holes(60, 65, 70)}",
         f"{FAR.replace('G0 Z20.', '')}{hole(50)}{holes(60, 65, 70)}"),
    Case("relative", 1, 14, "", f"{M8}G91\nG0 X20.\nG1 Z-6.\nG0 Z6.\nG90\n{holes(50, 60)}",
         f"{M8}G0 X29.\nG91\nG1 Z-6.\nG0 Z6.\nG90\n{holes(50, 60)}"),
    Case("compensated", 1, 14, "", f"{M8}G41 D1\nG0 X20.\nG1 Z-6. F100.\nX30.\nG0 Z5.\nG40\n{holes(50, 60, 70)}",
         f"{M8}G0 X20.\nG1 Z-6. F100.\nX30.\nG0 Z5.\n{holes(50, 60, 70)}"),
    Case("unknown-modes", 1, 6, "$C", f"$C\nG90 G17\nG0 Z5.\n{holes(0, 9, 20)}",
         f"$C\nG90 G17 G40\nG0 Z5.\n{holes(0, 9, 20)}"),
    Case("lit", 1, 12, "", f"{burn(0)}{burn(10)}G0 X20. Y0.\nM3 S500\nG1 Y9. F900.\nM8\nM5\n",
         f"{burn(0)}{burn(10)}G0 X20. Y0.\nM3 S500\nG1 Y9. F900.\nM5\nM8\n", head=LASER),
)  # fmt: skip


def staying(case: Case, body: str) -> tuple[tuple[StayGroup, ...], int]:
    """Return why pieces of a program stay, and how many pieces there are."""
    sequence = find_sequence(interpret_program(case.head + body, load_dialect(case.control)))
    return group_stay_reasons(sequence, {}, False), count_tasks(sequence)


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.reason)
def test_the_reason_that_is_given_is_the_one_cause_and_without_it_all_pieces_are_free(case: Case) -> None:
    groups, pieces = staying(case, case.program)
    assert [(g.reason, g.count, g.first_line, g.word) for g in groups] == [case[:4]]
    assert (f"{case.word} at line" if case.word else "line") + f" {case.first_line}" in groups[0].text
    assert pieces >= case.held
    free, without = staying(case, case.without)
    assert free == ()
    assert without >= 2


def test_every_reason_has_words_in_both_languages() -> None:
    for language in ("en", "es"):
        texts = tomllib.loads(files("leafcut.studio").joinpath(f"texts/{language}.toml").read_text("utf-8"))
        assert set(texts["stays"]) == {*PHRASES, "line"}


def test_what_only_several_causes_together_hold_says_all_of_them() -> None:
    """The circle surrounds the hole, and its operation precedes that of the hole."""
    both = square(0, 40) + "(a second operation)\n" + hole(20, 20) + hole(70, 70)
    groups, _ = staying(CASES[0], both)
    assert [(g.reason, g.count) for g in groups] == [("operation", 1)]
    groups, _ = staying(CASES[0], square(0, 40) + "(a second operation)\n" + hole(20, 20) + hole(9, 9))
    assert [(g.reason, g.count, g.first_line) for g in groups] == [("inside+operation", 1, 6)]
    assert "outline" in groups[0].text and "operations" in groups[0].text


def test_a_piece_is_held_where_it_has_the_same_place_in_every_order_that_the_pairs_allow() -> None:
    """Against all permutations of six pieces, for random pairs."""
    rng = np.random.default_rng(3)
    upper = np.argwhere(np.triu(np.ones((6, 6), dtype=bool), 1))
    for _ in range(40):
        pairs = upper[rng.random(len(upper)) < rng.random()]
        places: list[set[int]] = [set() for _ in range(6)]
        for order in permutations(range(6)):
            if all(order.index(a) < order.index(b) for a, b in pairs.tolist()):
                for piece in range(6):
                    places[piece].add(order.index(piece))
        held = _immovable_tasks([ties_from_pairs(pairs, 6)], 6)
        assert held.tolist() == [len(place) == 1 for place in places]
