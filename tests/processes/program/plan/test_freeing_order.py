"""What frees a part comes after all work that was before it: pairs and stages, by brute force over the definition."""

from __future__ import annotations

import random

import pytest

from leafcut.model.sequence import ProgramTask
from leafcut.processes.program.plan import precedence
from leafcut.processes.program.plan.precedence import detaching_stages, work_before_detaching


def piece(may: bool = False, detaches: bool = False, bottom: float = -6.0) -> ProgramTask:
    return ProgramTask(0, 1, "cut", (0, 0), (0, 0), 5, 5, bottom, 1, may_detach=may or detaches, detaches=detaches)


WORK, PART = piece(), piece(detaches=True)


def pairs(pieces: list[ProgramTask]) -> set[tuple[int, int]]:
    return set(map(tuple, work_before_detaching(pieces).tolist()))


def stage_of(pieces: list[ProgramTask]) -> list[int]:
    edges = detaching_stages(pieces)
    return [sum(edge <= k for edge in edges) for k in range(len(pieces))]


def held(pieces: list[ProgramTask], a: int, b: int) -> bool:
    """Return whether a stays before b by its stage or by pairs, one after the other."""
    stages, known = stage_of(pieces), {a}
    for one, other in sorted(pairs(pieces)):
        if one in known:
            known.add(other)
    return stages[a] < stages[b] or b in known


def test_work_stays_before_what_frees_a_part_and_parts_of_one_depth_change_places() -> None:
    """Both outlines come last anyway: they are a stage of their own, in which they are free."""
    assert (detaching_stages([WORK, WORK, PART, PART]), pairs([WORK, WORK, PART, PART])) == ([2], set())


def test_between_work_each_outline_waits_for_all_that_was_before_it_and_not_for_the_other() -> None:
    assert detaching_stages([WORK, PART, WORK, PART, WORK]) == []
    assert pairs([WORK, PART, WORK, PART, WORK]) == {(0, 1), (0, 3), (2, 3)}


def test_a_first_level_of_an_outline_stays_before_the_last_one_that_frees_the_part() -> None:
    first = piece(bottom=-3.0)
    assert held([first, PART, WORK], 0, 1)


def test_without_parts_that_come_free_nothing_is_held() -> None:
    assert (detaching_stages([WORK] * 4), pairs([WORK] * 4), len(work_before_detaching([]))) == ([], set(), 0)


def random_work(dice: random.Random) -> list[ProgramTask]:
    kinds = [(False, False), (False, False), (True, False), (True, True)]
    return [piece(*dice.choice(kinds), bottom=dice.choice((-6.0, -6.2, -5.0))) for _ in range(dice.randint(1, 12))]


@pytest.mark.parametrize("seed", range(80))
def test_all_work_is_before_every_later_piece_that_may_detach_a_part_but_for_parts_as_deep(seed: int) -> None:
    pieces = random_work(random.Random(seed))
    for b, later in enumerate(pieces):
        for a in range(b):
            alike = pieces[a].detaches and pieces[a].bottom <= later.bottom + 0.01
            if later.may_detach and not alike:
                assert held(pieces, a, b), (a, b)


@pytest.mark.parametrize("seed", range(40))
def test_where_pairs_would_be_too_many_parts_come_free_in_their_old_order_and_nothing_else_is_lost(seed: int) -> None:
    pieces = random_work(random.Random(seed))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(precedence, "_MOST_PAIRS", 0)
        for b, later in enumerate(pieces):
            if later.may_detach:
                same = [a for a in range(b) if stage_of(pieces)[a] == stage_of(pieces)[b]]
                assert all(held(pieces, a, b) for a in same)
