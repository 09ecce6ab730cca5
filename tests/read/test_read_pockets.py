"""Pockets from drawings: layers or depth say what is left standing, lines are joined, arcs stay arcs."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import shapely

from leafcut.errors import ReadError
from leafcut.geometry.regions import region_with_islands
from leafcut.model.part import Part
from leafcut.model.pocket import Pocket
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read import formats, read_contours, read_pockets

Draw = Callable[..., Path]
Write = Callable[[str, str], Path]

SEVEN = (
    "p1_rect_rounded",
    "p2_circle",
    "p3_fleur",
    "p4_star",
    "p5_islands3",
    "p6_islands6",
    "p7_islands11",
)


def shape_of(pocket: Pocket) -> Any:
    return region_with_islands(pocket.outline, pocket.islands, 0.001)


def square(size: float, x: float = 0.0, y: float = 0.0) -> list[tuple[float, float]]:
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]


def refusal(path: Path, **options: Any) -> str:
    """Return the one-line message of a refusal."""
    with pytest.raises(ReadError) as caught:
        read_pockets(path, ReadOptions(), PocketDrawingOptions(**options))
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(str(path))
    return text


def codes(part: Part) -> list[str]:
    return [issue.code for issue in part.issues]


@pytest.mark.parametrize("name", SEVEN)
def test_the_drawing_and_the_text_of_a_pocket_are_the_same_region(name: str, data: Path) -> None:
    truth = shapely.from_wkt((data / "pockets" / f"{name}.wkt").read_text())
    for kind in ("wkt", "dxf"):
        (pocket,) = read_pockets(data / "pockets" / f"{name}.{kind}").pockets
        shape = shape_of(pocket)
        assert len(pocket.islands) == len(truth.interiors)
        assert abs(pocket.area - truth.area) <= 1e-6 * truth.area
        assert shape.boundary.hausdorff_distance(truth.boundary) <= 0.01
        assert pocket.name == name


def test_walls_run_counter_clockwise_and_islands_clockwise(text_file: Write) -> None:
    text = "POLYGON ((0 0, 0 50, 50 50, 50 0, 0 0), (10 10, 20 10, 20 20, 10 20, 10 10))"
    (pocket,) = read_pockets(text_file("a.wkt", text)).pockets
    assert pocket.outline.area == 2500.0
    assert pocket.islands[0].area == -100.0
    assert pocket.area == 2400.0


def nested(_: Any, space: Any) -> None:
    """Draw four squares inside each other, in no order."""
    for depth in (3, 0, 2, 1):
        space.add_lwpolyline(square(100 - 20 * depth, 10 * depth, 10 * depth), close=True)


def plate(_: Any, space: Any) -> None:
    """Draw a plate of 120 × 80 mm with a recess of 30 × 20 mm, a boss in it, and four holes."""
    space.add_lwpolyline([(0, 0), (120, 0), (120, 80), (0, 80)], close=True)
    space.add_lwpolyline([(20, 30), (50, 30), (50, 50), (20, 50)], close=True)
    space.add_circle((35, 40), 4)
    for x, y in ((10, 10), (110, 10), (110, 70), (10, 70)):
        space.add_circle((x, y), 3)


def test_outline_pocket_takes_the_outermost_as_pocket_down_to_a_pocket_in_an_island(draw: Draw) -> None:
    part = read_pockets(draw(nested), None, PocketDrawingOptions(outline="pocket"))
    outer, inner = sorted(part.pockets, key=lambda p: -p.area)
    assert (outer.area, inner.area) == (100.0**2 - 80.0**2, 60.0**2 - 40.0**2)
    assert {outer.name, inner.name} == {"1", "2"}
    assert part.edge == ()


def test_outline_edge_takes_the_outermost_as_the_edge_of_the_part_and_mills_inside_it(draw: Draw) -> None:
    part = read_pockets(draw(nested), None, PocketDrawingOptions(outline="edge"))
    outer, inner = sorted(part.pockets, key=lambda p: -p.area)
    assert (outer.area, inner.area) == (80.0**2 - 60.0**2, 40.0**2)
    assert [(one.path.area, one.kind) for one in part.edge] == [(100.0**2, "sheet")]


@pytest.mark.hazard
def test_outlines_inside_each_other_are_refused_with_both_readings_and_their_sizes(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline([(0, 0), (120, 0), (120, 80), (0, 80)], close=True)
        for x in range(5):
            space.add_circle((20 * x + 20, 40), 4 + x)

    # Only the largest pocket is named: of radius 8.
    assert refusal(draw(build)).endswith(
        ".dxf: 1 pocket (120 × 80 mm) with 5 islands, or 1 plate (120 × 80 mm) with 5 pockets (at most "
        "16 × 16 mm): choose --outline pocket or --outline edge"
    )
    # The boss in a recess is a second pocket of the negative, and an island of the plate.
    assert refusal(draw(plate)).endswith(
        ".dxf: 2 pockets (at most 120 × 80 mm) with 5 islands, or 1 plate (120 × 80 mm) with 5 pockets (at most "
        "30 × 20 mm): choose --outline pocket or --outline edge"
    )


@pytest.mark.hazard
def test_the_pockets_of_a_plate_and_its_negative_share_no_area(draw: Draw) -> None:
    drawing = draw(plate)
    regions = []
    for outline in ("edge", "pocket"):
        part = read_pockets(drawing, None, PocketDrawingOptions(outline=outline))
        regions.append(shapely.union_all([shape_of(pocket) for pocket in part.pockets]))
    in_plate, negative = regions
    assert in_plate.area == pytest.approx(600.0 + 4 * math.pi * 9 - math.pi * 16, rel=1e-3)
    assert in_plate.intersection(negative).area <= 1e-6
    assert in_plate.area + negative.area == pytest.approx(120 * 80, rel=1e-3)


def test_the_refusal_counts_plates_and_names_layers_where_the_drawing_has_several(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        for x in (0.0, 200.0):
            space.add_lwpolyline(square(100 + x / 10, x, 0), close=True, dxfattribs={"layer": "OUTLINE"})
        space.add_lwpolyline(square(10, 20, 20), close=True, dxfattribs={"layer": "CUTOUT"})

    text = refusal(draw(build))
    assert "2 pockets (at most 120 × 120 mm) with 1 island, or 2 plates (at most 120 × 120 mm) with 1 pocket" in text
    assert text.endswith(
        "1 pocket (10 × 10 mm): choose --outline pocket or --outline edge; or name the layers of the pockets with "
        "--pocket-layers (OUTLINE, CUTOUT)"
    )


def test_closed_outlines_side_by_side_are_pockets_without_a_question_and_no_plates(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(50), close=True)
        space.add_lwpolyline(square(20, 60, 0), close=True)

    drawing = draw(build)
    assert [pocket.area for pocket in read_pockets(drawing).pockets] == [2500.0, 400.0]
    assert "no outline read as a pocket lies inside another" in refusal(drawing, outline="edge")


@pytest.mark.hazard
def test_layers_that_say_what_is_a_pocket_leave_nothing_to_outline_edge(data: Path) -> None:
    drawing = data / "pockets" / "p5_islands3.dxf"
    (asked,) = read_pockets(drawing, None, PocketDrawingOptions(outline="pocket")).pockets
    (unasked,) = read_pockets(drawing).pockets
    assert shape_of(asked).equals(shape_of(unasked))
    assert "layers already distinguish" in refusal(drawing, outline="edge")


@pytest.mark.hazard
def test_a_pocket_at_the_edge_of_its_plate_is_reported(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(50), close=True)
        space.add_lwpolyline(square(10, 0, 20), close=True)

    part = read_pockets(draw(build), None, PocketDrawingOptions(outline="edge"))
    assert [pocket.area for pocket in part.pockets] == [100.0]
    assert [str(i) for i in part.issues if i.code == "L423"] == [
        "L423 no wall remains at the edge of the plate for 1 pocket (at (0, 20))"
    ]


@pytest.mark.hazard
@pytest.mark.parametrize("name", ["deepnestport_1", "deepnestport_3", "deepnestport_10", "deepnestport_11"])
def test_real_plates_without_layers_are_never_milled_as_their_negative(name: str, data: Path) -> None:
    drawing = data / "dxf" / f"{name}.dxf"
    assert "choose --outline pocket or --outline edge" in refusal(drawing)
    part = read_pockets(drawing, None, PocketDrawingOptions(outline="edge"))
    (edge,) = part.edge
    # The plates are mostly material; their negative would be more than half of the box.
    assert sum(pocket.area for pocket in part.pockets) < 0.5 * edge.path.area


def test_lines_and_arcs_are_joined_and_arcs_stay_arcs(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_line((0, 0), (40, 0))
        space.add_arc((40, 10), 10, -90, 90)
        space.add_line((40, 20.02), (0, 20))
        space.add_arc((0, 10), 10, 90, 270)
        space.add_circle((20, 10), 3)

    part = read_pockets(draw(build), None, PocketDrawingOptions(outline="pocket"))
    (pocket,) = part.pockets
    assert pocket.outline.n_segments == 4
    assert (pocket.outline.bulges != 0.0).sum() == 2
    assert pocket.area == pytest.approx(800.0 + 91.0 * math.pi, abs=0.5)
    assert pocket.islands[0].area == pytest.approx(-9.0 * math.pi)
    assert "L311" in codes(part)


def test_layers_named_pocket_and_island_say_what_is_what_and_the_rest_is_left_out(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(200, -50, -50), close=True, dxfattribs={"layer": "STOCK"})
        space.add_lwpolyline(square(50), close=True, dxfattribs={"layer": "pocket_1"})
        space.add_lwpolyline(square(10, 20, 20), close=True, dxfattribs={"layer": "Islands"})

    part = read_pockets(draw(build))
    (pocket,) = part.pockets
    assert pocket.area == 2400.0
    assert pocket.layer == "pocket_1"
    assert {"L421", "L211"} <= set(codes(part))


def test_the_user_says_which_layers_are_pockets_and_islands(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(50), close=True, dxfattribs={"layer": "A"})
        space.add_lwpolyline(square(10, 20, 20), close=True, dxfattribs={"layer": "B"})
        space.add_lwpolyline(square(4, 2, 2), close=True, dxfattribs={"layer": "C"})

    path = draw(build)
    options = PocketDrawingOptions(pocket_layers=("a",), island_layers=("b",))
    part = read_pockets(path, pocket_options=options)
    assert part.pockets[0].area == 2400.0
    assert "L421" not in codes(part)
    only_islands = read_pockets(path, pocket_options=PocketDrawingOptions(island_layers=("B", "C")))
    assert only_islands.pockets[0].area == 2384.0
    assert "there are lines on A, B, C" in refusal(path, pocket_layers=("X*",))


def test_an_svg_drawing_gives_pockets(text_file: Write) -> None:
    text = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60">'
        '<rect x="5" y="5" width="50" height="50"/><circle cx="30" cy="30" r="10"/></svg>'
    )
    assert "1 pocket (50 × 50 mm) with 1 island" in refusal(text_file("a.svg", text))
    (pocket,) = read_pockets(text_file("a.svg", text), None, PocketDrawingOptions(outline="pocket")).pockets
    assert pocket.area == pytest.approx(2500.0 - 100.0 * math.pi, rel=1e-6)


def test_several_polygons_one_after_the_other_are_several_pockets(text_file: Write) -> None:
    text = (
        "SRID=0;POLYGON ((0 0, 10 0, 10 10, 0 10, 0 0))\n"
        "multipolygon (((20 0, 30 0, 30 10, 20 10, 20 0)), EMPTY, ((40 0, 44 0, 44 4, 40 0)));\n"
        "GEOMETRYCOLLECTION (POINT (1 1), POLYGON EMPTY, POLYGON Z ((60 0 -3, 70 0 -3, 70 10 -3, 60 0 -3)))\n"
    )
    part = read_pockets(text_file("a.wkt", text))
    assert [p.area for p in part.pockets] == [100.0, 100.0, 8.0, 50.0]
    assert [p.name for p in part.pockets] == ["1", "2", "3", "4"]
    assert "L210" in codes(part)
    assert "L202" not in codes(part)


def test_a_text_is_known_by_its_content_and_measured_in_the_units_said(text_file: Write) -> None:
    path = text_file("region.txt", "  polygon((0 0,1 0,1 1,0 1,0 0))")
    part = read_pockets(path, ReadOptions(units="in"))
    assert part.format == "wkt"
    assert part.pockets[0].area == pytest.approx(25.4**2)
    assert "L102" not in codes(part)
    assert "L102" in codes(read_pockets(path))


def test_corners_of_different_heights_are_said(text_file: Write) -> None:
    part = read_pockets(text_file("a.wkt", "POLYGON Z ((0 0 0, 9 0 0, 9 9 -1, 0 0 0))"))
    assert part.pockets[0].area == 40.5
    assert "L202" in codes(part)


@pytest.mark.parametrize(
    "text, words",
    [
        ("POLYGON ((0 0, 10 0, 10 10", "a.wkt:1: this is not well-known text (WKT)"),
        ("\n\nPOLYGON ((0 0, 10 0, 10 10, 0 0))\nPOLYGON ((a b))", "a.wkt:4: this is not well-known text (WKT)"),
        ("POLYGON ((0 0, 10 0, 10 10, 0 0)))", "a.wkt:1: this is not well-known text (WKT)"),
        ("POLYGON ((0 0, 10 0, 10 10, 0 0)) and more", "this is not well-known text (WKT)"),
        ("POLYGON ((0 0, 10 0, 10 10))", "do not form a closed linestring"),
        ("POLYGON ((0 0, 10 0, nan 10, 0 0))", "a coordinate is not a number"),
        ("POLYGON ((0 0, 10 0, 10 1e999, 0 0))", "a coordinate is not a number"),
        ("POLYGON ((0 0, 10 0, 10 1e9, 0 0))", "1e+09 mm is out of range"),
        ("POLYGON ((0 0, 10 0, 0 0))", "a ring has 3 points"),
        ("POLYGON ((0 0, 5 0, 10 0, 0 0))", "encloses no area"),
        ("POLYGON EMPTY", "contains empty geometries"),
        ("LINESTRING (0 0, 10 0)", "contains LINESTRING; POLYGON or MULTIPOLYGON was expected"),
        ("CURVEPOLYGON (CIRCULARSTRING (0 0, 1 1, 2 0, 1 -1, 0 0))", "Nonlinear geometry types"),
        ("GEOMETRYCOLLECTION " + "(GEOMETRYCOLLECTION " * 50 + "EMPTY" + ")" * 50, "nested more than 20 deep"),
        ("POLYGON " + "(" * 60, "nested more than 20 deep"),
        ("POLYGON ((0 0, 10 10, 10 0, 0 10, 0 0))", "crosses or touches itself at (5, 5)"),
        ("POLYGON ((0 0, 20 0, 20 20, 0 20, 0 0), (5 0, 9 0, 9 5, 5 5, 5 0))", "touches a wall, at ("),
        (
            "POLYGON ((0 0, 20 0, 20 20, 0 20, 0 0), (5 5, 9 5, 9 9, 5 9, 5 5), (9 5, 12 5, 12 9, 9 9, 9 5))",
            "touches another island, at (9",
        ),
        ("POLYGON ((0 0, 20 0, 20 20, 0 20, 0 0), (30 5, 39 5, 39 9, 30 5))", "lies in no pocket"),
        ("POLYGON ((0 0, 20 0, 20 20, 0 20, 0 0), (15 5, 29 5, 29 9, 15 5))", "overlap, at ("),
        ("POLYGON ((0 0, 20 0, 20 20, 0 0), (0 0, 20 0, 20 20, 0 0))", "coincide"),
        (
            "POLYGON ((0 0, 90 0, 90 90, 0 90, 0 0), (5 5, 80 5, 80 80, 5 80, 5 5), (9 9, 70 9, 70 70, 9 9))",
            "lies in another island",
        ),
        (
            "MULTIPOLYGON (((0 0, 20 0, 20 20, 0 20, 0 0)), ((5 5, 9 5, 9 9, 5 5)))",
            "lies directly in another pocket",
        ),
        ("MULTIPOLYGON (((0 0, 9 0, 9 9, 0 0)), ((5 0, 15 0, 15 9, 5 0)))", "overlap"),
    ],
)
def test_a_text_that_is_no_region_is_refused_in_one_line_with_the_place(
    text: str, words: str, text_file: Write
) -> None:
    assert words in refusal(text_file("a.wkt", text))


def test_a_huge_text_is_refused(text_file: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("leafcut.read.wkt.MAX_BYTES", 20)
    assert "split it" in refusal(text_file("a.wkt", "POLYGON ((0 0, 10 0, 10 10, 0 0))"))
    monkeypatch.setattr("leafcut.read.wkt.MAX_BYTES", 1000)
    monkeypatch.setattr("leafcut.read.wkt.MAX_SEGMENTS", 3)
    assert "lines and arcs" in refusal(text_file("a.wkt", "POLYGON ((0 0, 10 0, 10 10, 0 0))"))


def test_an_open_outline_is_refused_with_both_ends_and_may_be_dropped(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(50), close=True)
        space.add_lwpolyline([(10, 10), (20, 10), (20, 20)])

    path = draw(build)
    text = refusal(path)
    assert "1 open path, at (10, 10); the first ends at (20, 20)" in text
    assert "--join-tolerance" not in text
    part = read_pockets(path, joining=SheetOptions(open_paths="drop"))
    assert part.pockets[0].area == 2500.0
    assert "L212" in codes(part)


@pytest.mark.hazard
@pytest.mark.parametrize("gap", [0.3, 0.7, 3.2])
def test_an_open_pocket_is_never_advised_a_join_tolerance_above_half_a_millimetre(gap: float, draw: Draw) -> None:
    path = draw(lambda _, space: space.add_lwpolyline([(0, 0), (50, 0), (50, 50), (0, 50), (0, gap)]))
    text = refusal(path)
    assert f"the nearest end is {gap:g} mm away" in text
    assert ("--join-tolerance 0.301 closes it" in text) == (gap < 0.5)
    assert text.count("--join-tolerance") == (gap < 0.5)


@pytest.mark.parametrize(
    "layer, outline, words",
    [
        ("ISLAND", square(10, 100, 0), "the island that starts at (100, 0) on layer ISLAND lies in no pocket"),
        ("ISLAND", square(10, 40, 20), "touches a wall, at (50, "),
        ("ISLAND", square(10, 45, 20), "overlap"),
        ("ISLAND", [(10, 10), (20, 20), (20, 10), (10, 20)], "crosses or touches itself at (15, 15)"),
        ("ISLAND", square(50), "coincide"),
        ("POCKET", square(10, 30, 30), "lies directly in another pocket; draw it on an island layer"),
    ],
)
def test_islands_that_cannot_be_are_refused_with_their_place(
    layer: str, outline: list[tuple[float, float]], words: str, draw: Draw
) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(50), close=True, dxfattribs={"layer": "POCKET"})
        space.add_lwpolyline(square(5, 5, 5), close=True, dxfattribs={"layer": "ISLAND"})
        space.add_lwpolyline(outline, close=True, dxfattribs={"layer": layer})

    assert words in refusal(draw(build))


def test_pockets_that_touch_from_outside_are_two_pockets_and_said(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_lwpolyline(square(50), close=True)
        space.add_lwpolyline(square(50, 50, 0), close=True)
        space.add_lwpolyline(square(50), close=True)

    part = read_pockets(draw(build))
    assert len(part.pockets) == 2
    assert {"L312", "L423"} <= set(codes(part))


def test_a_drawing_without_lines_and_a_format_without_pockets_are_refused(draw: Draw, text_file: Write) -> None:
    assert "nothing to cut" in refusal(draw(lambda _, space: space.add_text("hello")))
    with pytest.raises(ReadError, match="csv has no pockets; use dxf"):
        read_pockets(text_file("a.csv", "x,y\n1,2\n3,4\n"))
    with pytest.raises(ReadError, match="has no contours to cut"):
        read_contours(text_file("a.wkt", "POLYGON ((0 0, 10 0, 10 10, 0 0))"))


def test_strict_refuses_a_drawing_that_needed_repair(draw: Draw) -> None:
    def build(_: Any, space: Any) -> None:
        for _ in range(2):
            space.add_lwpolyline(square(50), close=True)

    with pytest.raises(ReadError, match="--strict"):
        read_pockets(draw(build), ReadOptions(strict=True))


def test_every_format_says_what_it_is_read_for() -> None:
    for format_ in formats():
        assert bool({"cut", "part"} & set(format_.processes)) == (format_.contours is not None)
        assert ("pocket" in format_.processes) == (format_.pockets is not None)
