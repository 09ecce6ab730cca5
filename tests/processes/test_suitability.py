"""The suitability of a drawing for each kind of work, from its complete content, with the reason."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.part import Hole, Part
from leafcut.processes.registry import machine_can_do, process_names, rate_works, work
from leafcut.processes.suitability import HOLES_PER_OUTLINE, WholeDrawing
from leafcut.read import read_whole
from leafcut.read.machine import load_machine, machine_names
from shared_data import DATA

EXAMPLES = Path(__file__).parents[2] / "examples"
WORKS = ("drill", "cut", "nest", "pocket")


def square(x: float, y: float, size: float, layer: str = "") -> Contour:
    corners = [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]
    return Contour(Polyline.of_points(corners, closed=True), layer=layer)


def circle(x: float, y: float, diameter: float, layer: str = "", kind: str = "cut") -> Contour:
    return Contour(Polyline.circle(x, y, 0.5 * diameter), kind, layer)


def best(*contours: Contour, holes: tuple[Hole, ...] = ()) -> tuple[str, str]:
    """Return the likeliest kind of work, and the reason."""
    work, said = next(iter(rate_works(WORKS, WholeDrawing(Part("p", holes, contours=contours))).items()))
    return work, said.reason


@pytest.mark.parametrize(
    ("name", "work", "reason"),
    [
        ("bracket.dxf", "cut", "outlines"),
        ("sheet.dxf", "cut", "sheet_layers"),
        ("pocket.dxf", "pocket", "pocket_layers"),
        ("gusset.svg", "cut", "outlines"),
        ("plate_10.dxf", "drill", "holes"),
        ("board_200.dxf", "drill", "holes"),
    ],
)
def test_examples_suit_what_they_are_examples_of(name: str, work: str, reason: str) -> None:
    drawing = WholeDrawing(read_whole(EXAMPLES / name))
    found, said = next(iter(rate_works(WORKS, drawing).items()))
    assert (found, said.reason) == (work, reason)


@pytest.mark.skipif(not (DATA / "dxf").is_dir(), reason="the shared drawings are not here")
@pytest.mark.parametrize(
    ("name", "work"),
    [
        ("camotics_buildbotics_logo", "cut"),
        ("deepnestport_1", "cut"),
        ("deepnestport_10", "cut"),
        ("deepnestport_6", "cut"),
        ("dxfjs_arrayed-holes", "drill"),
        ("dxfjs_blocks1", "cut"),
        ("dxfjs_issue39", "pocket"),
        ("ezdxf_forms", "cut"),
    ],
)
def test_real_drawings_suit_what_they_are_of(name: str, work: str) -> None:
    drawing = WholeDrawing(read_whole(DATA / "dxf" / f"{name}.dxf"))
    assert next(iter(rate_works(WORKS, drawing))) == work


def test_one_outline_weighs_as_much_as_some_holes() -> None:
    """A plate has one edge around its holes: only with more of them it is drilled."""
    few = [circle(9 * k, 5, 3) for k in range(HOLES_PER_OUTLINE - 1)]
    many = [circle(9 * k, 5, 3) for k in range(HOLES_PER_OUTLINE + 1)]
    assert best(square(-5, -5, 100), *few)[0] == "cut"
    assert best(square(-5, -5, 100), *many) == ("drill", "holes")


def test_nothing_but_holes_or_points_is_drilled() -> None:
    assert best(circle(0, 0, 5), circle(9, 0, 5)) == ("drill", "only_holes")
    assert best(holes=(Hole(0, 0, 0), Hole(5, 0, 0))) == ("drill", "only_holes")


def test_holes_count_as_circles_do() -> None:
    """A reader may return circles as holes; wide holes are then outlines, too."""
    holes = tuple(Hole(9.0 * k, 5.0, 3.0) for k in range(HOLES_PER_OUTLINE + 1))
    assert best(square(-5, -5, 100), holes=holes) == ("drill", "holes")
    assert best(holes=tuple(Hole(200.0 * k, 0.0, 160.0) for k in range(20)))[0] == "cut"
    said = rate_works(WORKS, WholeDrawing(Part("p", (Hole(0, 0, 5), Hole(90, 0, 80), Hole(5, 5, 0)))))
    masks = {work: one.holes.tolist() for work, one in said.items() if one.holes is not None}
    assert masks["drill"] == [True, False, True] and masks["cut"] == [True, True, False]


def test_circles_too_wide_for_a_drill_are_outlines() -> None:
    assert best(*(circle(200 * k, 0, 160) for k in range(20)))[0] == "cut"


def test_lines_that_meet_are_one_outline_and_texts_are_none() -> None:
    corners = [(0, 0), (50, 0), (50, 50), (0, 50), (0, 0)]
    lines = [Contour(Polyline.of_points([a, b])) for a, b in pairwise(corners)]
    texts = [circle(k, 60, 2, kind="text") for k in range(40)]
    drawing = WholeDrawing(Part("p", contours=(*lines, circle(20, 20, 4), *texts)))
    assert (drawing.n_outlines, drawing.n_holes) == (1, 1)


def test_names_of_layers_outweigh_counts() -> None:
    holes = [circle(9 * k, 5, 3, "a") for k in range(50)]
    assert best(square(0, 0, 400, "Pocket"), *holes) == ("pocket", "pocket_layers")
    assert best(square(0, 0, 400, "SHEET"), square(5, 5, 50), *holes) == ("cut", "sheet_layers")
    assert best(circle(0, 0, 5, "Drill 5"), *(square(20 * k, 9, 10) for k in range(9))) == ("drill", "drill_layers")


def part_rating(*contours: Contour, holes: tuple[Hole, ...] = ()) -> float | None:
    """Return the suitability as a part, None if it is not rated."""
    rating = rate_works(("part",), WholeDrawing(Part("p", holes, contours=contours))).get("part")
    return None if rating is None else rating.score


def test_a_part_has_an_outline_around_holes_or_openings() -> None:
    corners = [(0, 0), (50, 0), (50, 50), (0, 50), (0.04, 0.04)]
    lines = [Contour(Polyline.of_points([a, b])) for a, b in pairwise(corners)]
    edge = square(0, 0, 50)
    assert part_rating(edge, square(20, 20, 9))
    assert part_rating(edge, circle(20, 20, 5))
    assert part_rating(edge, holes=(Hole(20, 20, 5),))
    assert part_rating(*lines, circle(20, 20, 5))
    assert part_rating(edge) is None and part_rating(*lines) is None
    assert part_rating(edge, square(60, 0, 9), circle(80, 0, 5)) is None  # beside each other
    assert part_rating(edge, circle(20, 20, 5, kind="text")) is None
    assert part_rating(*lines[:3], circle(20, 20, 5)) is None  # open
    assert part_rating(circle(0, 0, 5), circle(9, 0, 5)) is None


def test_a_part_is_rated_above_drilling_exactly_where_cutting_is_and_below_cutting() -> None:
    works = ("drill", "cut", "part")
    for number in range(1, 20):
        holes = [circle(9 * k, 5, 3) for k in range(number)]
        order = list(rate_works(works, WholeDrawing(Part("p", contours=(square(-5, -5, 300), *holes)))))
        assert order == (["cut", "part", "drill"] if number < HOLES_PER_OUTLINE else ["drill", "cut", "part"])


def test_what_is_worked_is_told_by_contour() -> None:
    part = Part("p", contours=(square(0, 0, 50, "POCKET"), circle(70, 70, 5, "h"), square(-9, -9, 99, "edge")))
    said = rate_works(WORKS, WholeDrawing(part))
    assert {work: one.contours.tolist() for work, one in said.items() if one.contours is not None} == {
        "pocket": [True, False, False],
        "drill": [False, True, False],
        "cut": [True, True, True],
    }


@pytest.mark.parametrize("name_of_work", [*process_names(), "nest"])
def test_every_process_has_a_machine_that_does_it(name_of_work: str) -> None:
    assert any(machine_can_do(name_of_work, load_machine(name).head) for name in machine_names())


def test_beams_and_torches_do_not_drill_and_spindles_do_not_cut_sheet() -> None:
    heads = {name: load_machine(name).head for name in machine_names()}
    assert not machine_can_do("drill", heads["laser-table"]) and machine_can_do("drill", heads["haas-vf2"])
    assert not machine_can_do("cut", heads["haas-vf2"]) and machine_can_do("cut", heads["water-table"])
    assert not machine_can_do("pocket", heads["plasma-table"])
    assert all(machine_can_do("simulate", head) for head in heads.values())


def test_drill_files_have_a_machine_for_circuit_boards() -> None:
    name = work("drill").usual_machine("excellon")
    assert name in machine_names() and load_machine(name).spindle_max_rpm >= 40_000
    assert work("drill").usual_machine("dxf") == "" == work("solve").usual_machine("excellon")
