"""Operations of the CAM are kept apart: what its comments mark, and what they only name."""

from __future__ import annotations

import pytest

from leafcut.processes.program.plan.resequencing import find_sequence
from rewriting import program_of, rewritten

HEAD = "G21 G90 / T1 M6 / S1000 M3 / G0 Z5 / "
FOOT = " / G0 Z20 / M5 / M2"


def line(x: int) -> str:
    return f"G0 X{x} Y0 / G1 Z-1 F100 / Y9 / G0 Z5"


def lines(*places: int) -> str:
    return " / ".join(line(x) for x in places)


def sizes(body: str, **options: object) -> list[int]:
    sequence = find_sequence(program_of(HEAD + body + FOOT), **options)  # type: ignore[arg-type]
    return [len(section.pieces) for section in sequence.sections]


FUSION = f"(2D CONTOUR1) / {lines(0, 20)} / (SLOT2) / {lines(40, 60, 80)}"
#: By name: a body and how many pieces its sections have.
MARKED = {
    "operations": (FUSION, [2, 3]),
    "with numbers of lines and semicolons": (f"; 2D CONTOUR / {lines(0, 20)} / N90 ; SLOT / {lines(40, 60)}", [2, 2]),
    "the same operation three times": (
        " / ".join(f"(2D POCKET{k}) / {lines(*range(90 * k, 90 * k + 60, 20))}" for k in (1, 2, 3)), [3, 3, 3],
    ),
    "named pieces": (" / ".join(f"(Start cutting path id: path{x}) / {line(x)}" for x in (0, 20, 40, 60)), [4]),
    "pieces with names of their own": (f"(left) / {line(0)} / (middle) / {line(20)} / (right) / {line(40)}", [3]),
    "a border behind named pieces": (f"(left) / {line(0)} / (right) / {line(20)} / (border) / {lines(40, 60)}", [2, 2]),
    "a line of dashes": (f"{lines(0, 20)} / (------) / {lines(40, 60)}", [4]),
    "no comment": (lines(0, 20, 40), [3]),
    "a comment before the way up is still between": (
        f"{line(0)} / {line(20).removesuffix(' / G0 Z5')} / (SLOT) / G0 Z5 / {lines(40, 60)}", [2, 2],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MARKED)
def test_operations_are_kept_apart_and_pieces_with_names_are_not(name: str) -> None:
    body, expected = MARKED[name]
    assert sizes(body) == expected
    assert sizes(body, mix_operations=True) == [sum(expected)]


def test_a_comment_stays_with_its_operation() -> None:
    new = rewritten(HEAD + FUSION + FOOT, [0, 1], [2, 1, 0])
    places = ["(2D CONTOUR1)", "X20 Y0", "(SLOT2)", "X80 Y0", "X60 Y0", "X40 Y0"]
    assert sorted(places, key=new.index) == places


def test_operations_of_a_beam_are_mixed() -> None:
    body = f"(layer 1) / {lines(0, 20)} / (layer 2) / {lines(40, 60)}"
    assert len(sizes(body, process="laser")) == 1
