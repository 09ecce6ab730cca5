"""Passes that touch nowhere, and whose order has meaning to a mill all the same: a change of it is no same work."""

from __future__ import annotations

import random

import numpy as np
import pytest

from leafcut.gcode.tool_comments import smallest_diameter_in_comments
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of, some_order

HEAD = "G21 G90 G17 / {}T1 M6 / S1000 M3 / G0 Z5 / "
FOOT = " / G0 Z20 / M5 / M2"
LASER = "G21 G90 / G0 X-9 Y-9 / "


def same(cuts: list[str], order: list[int], comment: str = "", head: str = HEAD, foot: str = FOOT) -> bool:
    """Return whether cuts, and the same in another order, are the same work."""
    head = head.format(comment)
    texts = [head + " / ".join(parts) + foot for parts in (cuts, [cuts[k] for k in order])]
    return certify(*map(program_of, texts)).same


def line(y: float, z: float = -1, x0: float = 0, x1: float = 60) -> str:
    return f"G0 X{x0} Y{y} / G1 Z{z} F100 / X{x1} / G0 Z5"


def circle(x: float, y: float, radius: float, z: float) -> str:
    return f"G0 X{x + radius} Y{y} / G1 Z{z} F100 / G2 X{x + radius} Y{y} I{-radius} J0 F300 / G0 Z5"


FINISHING = [line(0.5), line(50.5), line(50), line(0)]
LEVELS = [line(0, -1), line(20, -1), line(2, -2), line(22, -2)]
ROWS = [line(y) for y in (0, 20, 40, 55)]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "cuts, order",
    [
        (FINISHING, [2, 3, 0, 1]),
        (FINISHING, [3, 0, 1, 2]),
        ([circle(0, 0, 10, -1), "G0 X14 Y0 / G1 Z-1 F100 / X10.6 / Y0.1 / G3 X0 Y10.6 I-10.6 J-0.1 / G0 Z5"], [1, 0]),
        (LEVELS, [2, 0, 1, 3]),
        (LEVELS, [2, 3, 0, 1]),
        ([line(0, -2), line(2, -1)], [1, 0]),
        ([circle(0, 0, 10, -1), circle(22, 0, 10, -3)], [1, 0]),
        (ROWS, [0, 2, 1, 3]),
        (ROWS, [3, 2, 1, 0]),
    ],
)
def test_a_pass_that_is_made_before_the_one_it_relies_on_is_caught(cuts: list[str], order: list[int]) -> None:
    assert not same(cuts, order)
    assert same(cuts, list(range(len(cuts))))


CARVED = [f"G0 X0 Y{y} / G1 Z-1 F100 / X20 Z-{y + 2} / X40 Z-1 / X60 Z0.5 / G0 Z5" for y in (0, 2)]
HOLES = ["G0 X0 Y0 / G1 Z-1 F50 / G0 Z5", "G0 X6 Y0 / G1 Z-2 F50 / G0 Z5", "G99 G81 X3 Y0 Z-4 R1 F50 / G80 / G0 Z5"]
ENGRAVED = ["G0 X0 Y0 / G1 Z-0.1 F50 / X3 Y5 / X6 Y0 / G0 Z5", "G0 X1.5 Y3.2 / G1 Z-0.1 F50 / X4.5 / G0 Z5"]


@pytest.mark.parametrize(
    "cuts, order",
    [
        (FINISHING, [1, 0, 2, 3]),
        (FINISHING, [0, 3, 1, 2]),
        (LEVELS, [0, 2, 1, 3]),
        ([line(0, -1), line(13, -2)], [1, 0]),
        ([line(0), line(4)], [1, 0]),
        ([line(0), line(0, x0=60.5, x1=120)], [1, 0]),
        ([line(y) for y in (0, 40, 20, 55)], [0, 2, 1, 3]),
        ([circle(0, 0, 10, -1), circle(20.5, 0, 10, -1)], [1, 0]),
        (HOLES, [2, 0, 1]),
        (HOLES, [1, 2, 0]),
        (CARVED, [1, 0]),
        ([ENGRAVED[0], ENGRAVED[1].replace("X1.5", "X21.5").replace("X4.5", "X24.5")], [1, 0]),
    ],
)
def test_an_order_that_no_tool_feels_is_the_same_work(cuts: list[str], order: list[int]) -> None:
    assert same(cuts, order)


def test_a_tool_that_a_comment_says_to_be_narrow_reaches_no_farther() -> None:
    levels = [line(0, -1), line(2, -2)]
    assert same(levels, [1, 0], comment="(T1 D=1.5 - flat end mill) / ")
    assert not same(levels, [1, 0], comment="(T1 D=6 - flat end mill) / ")


@pytest.mark.parametrize("cut", ["G0 X0 Y{y} / M3 S300 / G1 X60 F900 / M5", "G0 X0 Y{y} S0 / M4 S300 / G1 X60 F900"])
def test_lines_of_a_laser_beside_each_other_are_free(cut: str) -> None:
    assert same([cut.format(y=y / 5) for y in range(4)], [2, 0, 3, 1], head=LASER, foot=" / M5 / M2")


@pytest.mark.parametrize(
    "text, width",
    [
        ("(T1 D=10. CR=0. - ZMIN=-8. - FLAT END MILL) / (T5 D=6.8 CR=0. - DRILL)", 6.8),
        ("(1 = End Mill {6 mm})", 6.0),
        ('(1/8" ENDMILL)', 3.175),
        ("( T1 |  8. FLAT ENDMILL | H1 )", 8.0),
        ("(X= 300, Y= 200, Z= 18)", np.inf),
        ("(ENDMILL)", np.inf),
        ("(ENDMILL, LEAVE 0.2 MM)", np.inf),
        ("(TOOL 1 - 6 MM FLAT ENDMILL LEAVE 0.2 MM)", 6.0),
        ("(0.2 MM STOCK FOR ENDMILL)", np.inf),
        ("(TOOL 3 DIAMETER: 8.0 MM, STEP SIZE 0.25 MM)", 8.0),
        ("(MILL 0.5 MM DEEP)", np.inf),
    ],
)
def test_the_narrowest_tool_is_what_comments_about_tools_say(text: str, width: float) -> None:
    assert smallest_diameter_in_comments(program_of(text + " / G21 G90 / G0 X0")) == pytest.approx(width)


@pytest.mark.parametrize("seed", range(25))
def test_every_order_that_keeps_what_the_planner_keeps_is_the_same_work(seed: int) -> None:
    """Lines, rings, hooks and holes anywhere at three depths, in random orders that keep the pairs of the planner."""
    rng = random.Random(seed)

    def cut() -> str:
        x, y, z = round(rng.uniform(0, 60), 1), round(rng.uniform(0, 60), 1), rng.choice((-1, -1, -2, -3))
        return rng.choice(
            (
                line(y, z, x, x + round(rng.uniform(2, 40), 1)),
                circle(x, y, round(rng.uniform(1, 8), 1), z),
                f"G0 X{x} Y{y} / G1 Z{z} F100 / X{x + 9} / Y{y + 9} / X{x + 0.6} / G0 Z5",
                f"G0 X{x} Y{y} / G1 Z{z} F100 / X{x + 9} Z{z / 2} / X{x + 15} / G0 Z5",
                f"G0 X{x} Y{y} / G1 Z{z} F100 / G0 Z5",
            )
        )

    comment = rng.choice(("", "(1/4 endmill) / ", "(T1 D=1.5) / "))
    cuts = [cut() for _ in range(24)]
    section = find_sequence(program_of(HEAD.format(comment) + " / ".join(cuts) + FOOT), process="mill").sections[0]
    assert len(section.pieces) == len(cuts)
    order = some_order(section, rng).tolist()
    assert order != sorted(order)
    assert same(cuts, order, comment)
