"""A nest that cannot be cut is found out, whatever made it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, NestPart, Placement
from leafcut.verify.nest import check_nest


def square(side: float) -> Contour:
    return Contour(Polyline.of_points([(0, 0), (side, 0), (side, side), (0, side)], closed=True))


#: A square of 100 with a hole of radius 30 in its middle, and a disc of radius 20.
FRAME = NestPart("frame", (square(100), Contour(Polyline.circle(50, 50, 30))))
DISC = NestPart("disc", (Contour(Polyline.circle(0, 0, 20)),))
#: The disc lies in the middle of the hole: 10 mm of scrap all round it.
RIGHT = Nest((FRAME, DISC), 120, 120, (Layout((Placement(0, 0.0, 10, 10), Placement(1, 0.0, 60, 60))),), (0, 0))


def moved(place: Placement, which: int) -> Nest:
    placements = list(RIGHT.layouts[0].placements)
    placements[which] = place
    return replace(RIGHT, layouts=(Layout(tuple(placements)),))


def test_a_right_nest_has_no_faults() -> None:
    assert check_nest(RIGHT, 9.98, 10.0) == []


@pytest.mark.parametrize(
    ("nest", "words"),
    [
        (moved(Placement(1, 0.0, 60.05, 60), 1), "apart"),
        (moved(Placement(1, 0.0, 15, 60), 1), "apart"),
        (moved(Placement(0, 0.0, 10.01, 10), 0), "reaches from"),
        (moved(Placement(0, 0.3, 40, 10), 0), "not allowed"),
        (replace(RIGHT, layouts=(Layout(RIGHT.layouts[0].placements[:1]),)), "expected"),
        (replace(RIGHT, layouts=(Layout(RIGHT.layouts[0].placements, 2),)), "expected"),
    ],
    ids=["near the edge of the hole", "overlapping", "in the margin", "turned", "missing", "too many"],
)
def test_a_wrong_nest_is_found_out(nest: Nest, words: str) -> None:
    faults = check_nest(nest, 9.98, 10.0)
    assert any(words in line for line in faults)


def test_two_straight_parts_may_be_just_the_spacing_apart() -> None:
    part = NestPart("plate", (square(40), Contour(Polyline.circle(20, 20, 5))), quantity=2)
    for gap, faults in ((5.0, 0), (4.99, 1)):
        both = (Placement(0, 0.0, 10, 10), Placement(0, 0.0, 50 + gap, 10))
        assert len(check_nest(Nest((part,), 200, 60, (Layout(both),), (0,)), 5.0, 10.0)) == faults
