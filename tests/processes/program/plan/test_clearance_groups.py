"""Crossing heights are never mixed: tasks that move as one cross lower within the group, and none is lost."""

from __future__ import annotations

import random

import pytest

from leafcut.processes.program.plan.resequencing import group_by_height

APART = [(10.0 * k, 0.0) for k in range(40)]


def members(group: tuple[list[int], int, float]) -> list[range]:
    firsts, end, _ = group
    return [range(a, b) for a, b in zip(firsts, [*firsts[1:], end], strict=True)]


def test_at_one_height_every_piece_moves_by_itself() -> None:
    assert group_by_height([5.0] * 3, APART[:4]) == [([0, 1, 2, 3], 4, 5.0)]
    assert group_by_height([], APART[:1]) == []


def test_a_program_is_divided_at_its_highest_crossing_where_that_leaves_more_free() -> None:
    """Four and four pieces with one crossing at 20 between: three free moves on either side, against one."""
    groups = group_by_height([5, 5, 5, 20, 5, 5, 5], APART[:8])
    assert groups == [([0, 1, 2, 3], 4, 5.0), ([4, 5, 6, 7], 8, 5.0)]


def test_passes_at_one_place_between_high_crossings_move_as_one() -> None:
    """Three pockets of three levels each: the levels start at the same position and cannot be moved."""
    places = [(100.0 * (k // 3), 0.0) for k in range(9)]
    assert group_by_height([5, 5, 20, 5, 5, 20, 5, 5], places) == [([0, 3, 6], 9, 20.0)]


@pytest.mark.parametrize("seed", range(60))
def test_whatever_the_heights_none_of_the_pieces_is_lost_and_no_member_crosses_as_high_within(seed: int) -> None:
    dice = random.Random(seed)
    n = dice.randint(2, 25)
    heights = [float(dice.choice((2, 5, 5, 10, 30))) for _ in range(n - 1)]
    places = [(float(dice.randint(0, 4)), 0.0) for _ in range(n)]
    seen: list[int] = []
    for group in group_by_height(heights, places):
        firsts, end, clearance = group
        assert len(firsts) >= 2
        assert {heights[first - 1] for first in firsts[1:]} == {clearance}
        for own in members(group):
            assert all(heights[i] < clearance for i in own[:-1])
        seen += range(firsts[0], end)
    assert len(seen) == len(set(seen))
    # Tasks in no group are alone between two crossings where the program was divided.
    for alone in set(range(n)) - set(seen):
        beside = [heights[i] for i in (alone - 1, alone) if 0 <= i < n - 1]
        assert beside
