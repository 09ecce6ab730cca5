"""Parts detached by a mill stay after all work that preceded them; programs of sheets by hand."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from cut_free import BORES, OUTLINES, PARTS, SKINS, SLOTS, TABBED, bore, outline, slot, text_of
from leafcut.model.sequence import Sequence
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of, some_orders

BY_PART = [cut for k in range(6) for cut in (*BORES[2 * k : 2 * k + 2], SLOTS[k], OUTLINES[k])]
#: By name: the cuts, and which of them free a part.
SHEETS: dict[str, tuple[list[str], Callable[[str], bool]]] = {
    "all outlines last": ([*BORES, *SLOTS, *OUTLINES], OUTLINES.__contains__),
    "part by part": (BY_PART, OUTLINES.__contains__),
    "skins first": ([*SKINS, *BORES, *SLOTS, *OUTLINES], OUTLINES.__contains__),
    "tabs": ([*BORES, *TABBED, *SLOTS], lambda _: False),
    "one part early": ([OUTLINES[0], *BORES[2:], *OUTLINES[1:]], OUTLINES.__contains__),
    "frame around all": ([*BORES, *OUTLINES, outline(-10, -10, 170)], lambda c: c in OUTLINES or "170" in c),
}


def broken(cuts: list[str], frees: Callable[[str], bool], text: str) -> list[tuple[str, str]]:
    """Return the pairs (work, outline) whose order is reversed in the text of a new program, by brute force."""
    place = {cut: text.index(cut.replace(" / ", "\n")) for cut in cuts}
    return [
        (cut, after)
        for number, after in enumerate(cuts)
        if frees(after)
        for cut in cuts[:number]
        if place[cut] > place[after] and not frees(cut)
    ]


@pytest.mark.parametrize("seeds", [range(4), pytest.param(range(4, 10), marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", SHEETS)
def test_no_part_is_detached_before_earlier_work(name: str, seeds: range) -> None:
    """Brute force over the text judges random orders that the planner allows; the proof accepts each."""
    cuts, frees = SHEETS[name]
    program = program_of(text_of(cuts))
    sequence = find_sequence(program, process="mill")
    for seed in seeds:
        new = rewrite(program, sequence, some_orders(sequence, seed))
        assert broken(cuts, frees, new) == []
        assert certify(program, program_of(new)).same
    assert sum(len(section.pieces) for section in sequence.sections) == len(cuts)


def sections(cuts: list[str], **options: object) -> Sequence:
    return find_sequence(program_of(text_of(cuts)), process="mill", **options)  # type: ignore[arg-type]


def test_outlines_at_the_end_are_a_section_of_their_own() -> None:
    found = sections([*BORES, *OUTLINES]).sections
    assert [[c.detaches for c in s.pieces] for s in found] == [[False] * 12, [True] * 6]
    assert [len(s.precedence) for s in found] == [0, 0]
    assert found[0].end is None
    assert found[1].start is None


def test_with_tabs_nothing_comes_free() -> None:
    found = sections([*SLOTS, *TABBED, *SLOTS[:1]]).sections
    assert len(found) == 1
    assert not any(c.may_detach for c in found[0].pieces)


def test_a_bore_in_a_part_frees_no_part_and_a_part_in_a_frame_does() -> None:
    pieces = [c for s in sections([bore(20, 20), outline(0, 0), outline(-20, -20, 90)]).sections for c in s.pieces]
    assert [c.detaches for c in pieces] == [False, True, True]


def test_pairs_of_many_parts_stay_few() -> None:
    """If work and detaching cuts alternate so often that there would be millions of pairs, parts keep their order."""
    many = [cut for k in range(400) for cut in (slot(60 * k, 20), outline(60 * k, 0))]
    (section,) = sections(many).sections
    assert len(section.precedence) <= 3 * len(many)
    pairs = set(map(tuple, section.precedence.tolist()))
    assert {(k, k + 2) for k in range(1, 797, 2)} <= pairs


def test_a_tool_change_is_not_saved_where_a_part_would_come_free_first() -> None:
    """Outlines with T1 after bores with T2: joined to the slots of T1 they would come before the bores."""
    change = "G0 Z20 / T{0} M6 / S1000 M3 / G0 Z5"
    cuts = [*SLOTS, change.format(2), *BORES, change.format(1), *OUTLINES]
    assert "T2 M6" in text_of(cuts)
    assert [s.tool for s in sections(cuts, merge_tools=True).sections] == [1, 2, 1]
    tabbed = [*SLOTS, change.format(2), *BORES[:6], change.format(1), *[outline(x + 200, y) for x, y in PARTS]]
    assert [s.tool for s in sections(tabbed, merge_tools=True).sections] == [1, 2, 1]
    slots = [*SLOTS, change.format(2), *BORES, change.format(1), *[slot(x + 200, y) for x, y in PARTS]]
    assert [s.tool for s in sections(slots, merge_tools=True).sections] == [1, 2]
    assert sections(slots).mergeable == 1
    assert sections(cuts).mergeable == 0


def random_sheet(rng: random.Random) -> list[str]:
    """Return work on a sheet as no CAM would write it, at depths near the underside and far from it."""
    cuts = []
    for x, y in rng.sample(PARTS, 5):
        z = rng.choice((-6.2, -6.2, -5.9, -5.4, -3.0))
        cuts += [outline(x, y, rng.choice((40, 12)), z, rng.choice((None, None, 1.0, 0.1)))]
        cuts += [bore(x + rng.randint(5, 60), y + rng.randint(5, 35), rng.choice((2, 6)), rng.choice((-6.2, -6.9, -1)))]
        cuts += [slot(x + rng.randint(0, 30), y + rng.randint(0, 45), z=rng.choice((-2, -6.2)))]
    rng.shuffle(cuts)
    return cuts


@pytest.mark.parametrize("seed", range(25))
def test_whatever_the_planner_allows_the_proof_finds_to_be_the_same(seed: int) -> None:
    program = program_of(text_of(random_sheet(random.Random(seed))))
    sequence = find_sequence(program, process="mill")
    found = certify(program, program_of(rewrite(program, sequence, some_orders(sequence, seed))))
    assert [str(d) for d in found.differences] == []
