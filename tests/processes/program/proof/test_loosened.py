"""The proof names what is made after a part came free and was made before; orders are changed by hand."""

from __future__ import annotations

import pytest

from cut_free import BORES, OUTLINES, SKINS, SLOTS, TABBED, bore, outline, text_of
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of


def differences(cuts: list[str], new: list[str]) -> list[str]:
    assert sorted(cuts) == sorted(new)
    return [d.what for d in certify(program_of(text_of(cuts)), program_of(text_of(new))).differences]


WORK = [*BORES[:2], *SLOTS[:2]]
FREES = "part detached too early"


@pytest.mark.hazard
@pytest.mark.parametrize("other", [BORES[4], SLOTS[2], bore(120, 20, 6)])
def test_work_on_another_part_made_after_a_part_is_free_is_caught(other: str) -> None:
    rest = [*OUTLINES[:1], *OUTLINES[2:]]
    assert differences([other, OUTLINES[1], *rest], [OUTLINES[1], other, *rest]) == [FREES]
    assert differences([OUTLINES[1], other, *rest], [other, OUTLINES[1], *rest]) == []


def test_two_parts_may_come_free_in_either_order() -> None:
    assert differences([*WORK, *OUTLINES], [*WORK, *OUTLINES[::-1]]) == []
    assert differences([*WORK, *OUTLINES], [*WORK[::-1], *OUTLINES]) == []


@pytest.mark.hazard
def test_what_hangs_on_by_tabs_or_by_a_skin_is_not_free() -> None:
    assert differences([*BORES[4:], *TABBED[:2]], [*TABBED[:2], *BORES[4:]]) == []
    deep = [outline(200, 0)]
    thick = [outline(x, 0, z=-5.0) for x in (0, 50)]
    assert differences([*SLOTS[4:], *thick, *deep], [*thick, *SLOTS[4:], *deep]) == []


def test_finishing_a_skin_before_another_part_has_its_holes_is_caught() -> None:
    cuts = [*SKINS[:2], *BORES[:4], *OUTLINES[:2]]
    early = [*SKINS[:2], *BORES[:2], OUTLINES[0], *BORES[2:4], OUTLINES[1]]
    assert set(differences(cuts, early)) == {FREES}


def test_the_two_lines_and_places_are_named() -> None:
    cuts = [SLOTS[1], OUTLINES[2]]
    found = certify(program_of(text_of(cuts)), program_of(text_of(cuts[::-1]))).differences[0]
    assert str(found).startswith(
        "part detached too early: X20.000 Y60.000 Z-2.000 (line 6) was cut before the part whose"
    )
    assert "(original line 6, line " in str(found)
