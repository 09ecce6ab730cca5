"""An outline in several cuts with tabs: work inside it before its last cut must not come after it."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest

from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of, some_order

MILL = "G21 G90 G17 / T1 M6 / S1000 M3 / G0 Z5 / "
BEAM = "G21 G90 / G0 Z5 / "
FOOT = " / G0 Z20 / M5 / M2"

Point = tuple[float, float]


def cut(points: list[Point], z: float = -1, *, beam: bool = False) -> str:
    (x, y), *others = points
    on, off = ("M3", "M5") if beam else (f"G1 Z{z} F100", "G0 Z5")
    return f"G0 X{x} Y{y} / {on} / " + " / ".join(f"G1 X{a} Y{b} F100" for a, b in others) + f" / {off}"


def square(gap: float, depths: tuple[float, ...] = (-1,), *, beam: bool = False) -> list[str]:
    """Return a square of 40 in four parts, tabs of `gap` in the middle of its sides, at several depths."""
    h = gap / 2
    parts: list[list[Point]] = [
        [(20 + h, 0), (40, 0), (40, 20 - h)], [(40, 20 + h), (40, 40), (20 + h, 40)],
        [(20 - h, 40), (0, 40), (0, 20 + h)], [(0, 20 - h), (0, 0), (20 - h, 0)],
    ]  # fmt: skip
    return [cut(points, z, beam=beam) for points in parts for z in depths]


HOLE, OUTSIDE = "G0 X20 Y20 / G1 Z-3 F100 / G0 Z5", "G0 X90 Y20 / G1 Z-3 F100 / G0 Z5"
#: A square in one cut, with one tab.
HOOK = cut([(6, 0), (40, 0), (40, 40), (0, 40), (0, 0), (1, 0)])


def differences(cuts: list[str], order: list[int], head: str = MILL) -> list[str]:
    texts = [head + " / ".join(parts) + FOOT for parts in (cuts, [cuts[k] for k in order])]
    return [d.what for d in certify(*map(program_of, texts)).differences]


@pytest.mark.hazard
@pytest.mark.parametrize("outer", [square(8), square(11.9), square(6, (-1, -2)), [HOOK]])
def test_a_hole_moved_behind_the_last_part_of_its_outline_is_caught(outer: list[str]) -> None:
    n = len(outer)
    assert differences([HOLE, OUTSIDE, *outer], [1, *range(2, n + 2), 0]) == ["inner after outer"]
    assert differences([HOLE, OUTSIDE, *outer], [0, *range(2, n + 2), 1]) == []
    assert differences([*outer, OUTSIDE, HOLE], [n + 1, *range(n + 1)]) == ["inner before outer"]
    assert differences([*outer, OUTSIDE, HOLE], [n, *range(n), n + 1]) == []


def test_before_the_last_part_of_it_nothing_is_free_yet() -> None:
    assert differences([HOLE, *square(8)], [1, 2, 3, 0, 4]) == []
    assert differences([HOLE, *square(8)], [4, 3, 0, 2, 1]) == []


def test_a_part_cut_from_its_other_end_closes_the_outline_all_the_same() -> None:
    parts = square(8)
    parts[1] = cut([(24, 40), (40, 40), (40, 24)])
    assert differences([HOLE, *parts], [4, 2, 3, 1, 0]) == ["inner after outer"]


@pytest.mark.parametrize("outer", [square(12.5), square(8)[:3], [cut([(12, 0), (40, 0), (40, 40), (0, 40), (0, 9)])]])
def test_cuts_that_leave_more_than_tabs_enclose_nothing(outer: list[str]) -> None:
    assert differences([HOLE, *outer], [*range(1, len(outer) + 1), 0]) == []


@pytest.mark.parametrize("gap, found", [(1.0, ["inner after outer"]), (4.0, [])])
def test_tabs_of_a_beam_are_narrower(gap: float, found: list[str]) -> None:
    inner = cut([(18, 20), (22, 20)], beam=True)
    cuts = [inner, *square(gap, beam=True)]
    assert differences(cuts, [1, 2, 3, 4, 0], BEAM) == found


@pytest.mark.parametrize("beam", [False, True])
def test_what_is_caught_the_planner_keeps_as_well(beam: bool) -> None:
    cuts = [cut([(18, 20), (22, 20)], beam=beam), *square(2, beam=beam)]
    program = program_of((BEAM if beam else MILL) + " / ".join(cuts) + FOOT)
    pairs = find_sequence(program, process="laser" if beam else "mill").sections[0].precedence.tolist()
    assert {(0, k) for k in range(1, 5)} <= {(a, b) for a, b in pairs}


@pytest.mark.parametrize("seed", range(20))
def test_every_order_that_keeps_what_the_planner_keeps_is_the_same_work(seed: int) -> None:
    """Squares in parts of any length, gaps of any width, some at two depths or turned, and holes anywhere."""
    rng = random.Random(seed)
    cuts = [f"G0 X{rng.uniform(0, 90):.1f} Y{rng.uniform(0, 60):.1f} / G1 Z-9 F100 / G0 Z5" for _ in range(12)]
    for x, y in ((0, 0), (45, 0), (10, 10), (0, 45)):
        size, gap = rng.choice((10, 25, 40)), rng.choice((0.04, 2, 5, 11, 14))
        corners = [(x, y), (x + size, y), (x + size, y + size), (x, y + size), (x, y)]
        for (x0, y0), (x1, y1) in pairwise(corners):
            part = gap / 2 / size
            ends = [(x0 + part * (x1 - x0), y0 + part * (y1 - y0)), (x1 - part * (x1 - x0), y1 - part * (y1 - y0))]
            ends = ends if rng.random() < 0.8 else ends[::-1]
            cuts += [cut(ends, z) for z in rng.choice(((-9,), (-9, -9)))]
    rng.shuffle(cuts)
    # What frees a part, where all of a section comes before it, is a section of its own.
    sections = find_sequence(program_of(MILL + " / ".join(cuts) + FOOT), process="mill").sections
    assert sum(len(section.pieces) for section in sections) == len(cuts)
    order: list[int] = []
    for section in sections:
        order += (len(order) + some_order(section, rng)).tolist()
    assert differences(cuts, order) == []


@pytest.mark.parametrize("number, found", [(10, ["inner after outer"]), (80, [])])
def test_many_strokes_that_hang_together_with_an_outline_are_a_filling(number: int, found: list[str]) -> None:
    strokes = [cut([(5, -0.02), (5, -12)])]
    strokes += [cut([(5 + k / 10, -12), (5.07 + k / 10, -12)]) for k in range(number)]
    cuts = [HOLE, *strokes, *square(8)]
    assert differences(cuts, [*range(1, len(cuts)), 0]) == found
