"""A nest that cannot be cut is found out, whatever made it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.nest import Layout, Nest, NestPart, Placement, Stock
from leafcut.nesting.proof import check_nest


def square(side: float) -> Contour:
    return Contour(Polyline.of_points([(0, 0), (side, 0), (side, side), (0, side)], closed=True))


#: A square of 100 with a hole of radius 30 in its middle, and a disc of radius 20.
FRAME = NestPart("frame", (square(100), Contour(Polyline.circle(50, 50, 30))))
DISC = NestPart("disc", (Contour(Polyline.circle(0, 0, 20)),))
#: The disc lies in the middle of the hole: 10 mm of scrap all round it.
RIGHT = Nest(
    (FRAME, DISC), (Stock(120, 120),), (Layout((Placement(0, 0.0, 10, 10), Placement(1, 0.0, 60, 60))),), (0, 0)
)


def moved(place: Placement, which: int) -> Nest:
    placements = list(RIGHT.layouts[0].placements)
    placements[which] = place
    return replace(RIGHT, layouts=(Layout(tuple(placements)),))


@pytest.mark.hazard
def test_a_right_nest_has_no_faults() -> None:
    assert check_nest(RIGHT, 9.98, 10.0) == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "nest, words",
    [
        (moved(Placement(1, 0.0, 60.05, 60), 1), "apart"),
        (moved(Placement(1, 0.0, 15, 60), 1), "apart"),
        (moved(Placement(0, 0.0, 10.01, 10), 0), "extends from"),
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
        assert len(check_nest(Nest((part,), (Stock(200, 60),), (Layout(both),), (0,)), 5.0, 10.0)) == faults


@pytest.mark.parametrize("gap, faults", [(0.2, 0), (0.21, 1), (0.19, 1), (5.0, 0)])
def test_parts_may_be_as_near_as_the_kerf_only_along_a_common_edge(gap: float, faults: int) -> None:
    part = NestPart("plate", (square(40),), quantity=3)
    places = (Placement(0, 0.0, 10, 10), Placement(0, 0.0, 50 + gap, 10), Placement(0, 0.0, 150, 10))
    nest = Nest((part,), (Stock(300, 60),), (Layout(places),), (0,))
    assert len(check_nest(nest, 5.0, 10.0, kerf=0.2)) == faults
    assert len(check_nest(nest, 5.0, 10.0)) == (gap < 5.0)


def test_two_blocks_a_kerf_apart_at_a_corner_are_too_near() -> None:
    part = NestPart("plate", (square(40),), quantity=2)
    places = (Placement(0, 0.0, 10, 10), Placement(0, 0.0, 50.12, 50.16))
    assert len(check_nest(Nest((part,), (Stock(300, 120),), (Layout(places),), (0,)), 5.0, 10.0, kerf=0.2)) == 1
