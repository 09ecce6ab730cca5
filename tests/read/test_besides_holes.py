"""Other contents of a drilling drawing: the outline is named, slots are missing work."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut.errors import ReadError
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read import read

HOLES = ((10, 10), (50, 10), (90, 10))


def drawn(tmp_path: Path, draw: Any) -> Part:
    """Return the part of a plate of 100 x 60 mm with three holes, and what else is drawn."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    rectangle(space, 0, 0, 100, 60)
    for place in HOLES:
        space.add_circle(place, 3)
    draw(document, space)
    document.saveas(tmp_path / "plate.dxf")
    return read(tmp_path / "plate.dxf")


def rectangle(space: Any, x0: float, y0: float, x1: float, y1: float) -> None:
    space.add_lwpolyline([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], close=True)


def missing(part: Part) -> list[tuple[str, int, list[tuple[float, float]]]]:
    return [(i.missing.what, i.missing.count, list(i.missing.where)) for i in part.issues if i.missing]


@pytest.mark.hazard
def test_the_outline_around_all_holes_is_named_and_is_not_missing(tmp_path: Path) -> None:
    part = drawn(tmp_path, lambda document, space: None)
    assert missing(part) == []
    assert [i.message for i in part.issues] == ["the outline around all holes, 100 × 60 mm, is not cut"]


def test_frames_around_the_plate_are_no_missing_work_and_boxes_beside_it_are_notes(tmp_path: Path) -> None:
    def frame(document: Any, space: Any) -> None:
        rectangle(space, -50, -50, 250, 150)
        rectangle(space, 150, -40, 240, -10)

    part = drawn(tmp_path, frame)
    assert missing(part) == [] == list(part.besides)
    assert [i.message for i in part.issues] == [
        "2 outlines around all holes, the innermost 100 × 60 mm, are not cut",
        "1 contour beside the outline will not be cut",
    ]


@pytest.mark.hazard
def test_a_circle_around_holes_or_contours_is_an_outline_and_is_not_drilled(draw: Any) -> None:
    """The edge of a flange surrounds its bolt holes, but not neighbouring holes; a disc has two windows."""

    def plate(document: Any, space: Any) -> None:
        space.add_circle((100, 0), 30, dxfattribs={"layer": "EDGE"})
        for angle in (0, 90, 180, 270):
            space.add_circle((100 + 20 * math.cos(math.radians(angle)), 20 * math.sin(math.radians(angle))), 3)
        space.add_circle((200, 0), 3)
        space.add_circle((0, 0), 20)
        rectangle(space, -15, -2, -5, 2)
        rectangle(space, 5, -2, 15, 2)

    path = draw(plate)
    part = read(path)
    assert sorted(hole.x for hole in part.holes) == pytest.approx([80, 100, 100, 120, 200])
    assert [(what, sorted(where)) for what, _, where in missing(part)] == [("circle", [(0, 0), (100, 0)])]
    assert any(
        "2 circles will not be drilled, because a circle that encloses other holes" in i.message for i in part.issues
    )
    assert [issue.message for issue in part.besides] == [
        "2 contours will not be machined, because only round holes are drilled; mill them with leafcut part or "
        "leafcut pocket"
    ]
    assert [hole.diameter for hole in read(path, ReadOptions(layers=("EDGE",))).holes] == [60]


@pytest.mark.hazard
@pytest.mark.parametrize("corners", [4, 6])
def test_a_hole_with_a_contour_drawn_in_it_is_drilled(draw: Any, corners: int) -> None:
    def plate(document: Any, space: Any) -> None:
        for x in (0, 40):
            space.add_circle((x, 0), 4)
        around = [(math.cos(k * math.tau / corners), math.sin(k * math.tau / corners)) for k in range(corners)]
        space.add_lwpolyline(around, close=True)
        rectangle(space, 42, -1, 43, 1)

    part = read(draw(plate))
    assert [(hole.x, hole.diameter) for hole in part.holes] == [(0, 8), (40, 8)]
    assert missing(part) == []


@pytest.mark.hazard
@pytest.mark.parametrize(("concentric", "left"), [("smallest", [6]), ("largest", [10]), ("all", [6, 10])])
def test_a_pilot_somewhat_beside_the_centre_of_its_counterbore_is_a_step(
    draw: Any, concentric: Any, left: list[float]
) -> None:
    path = draw(lambda d, s: [s.add_circle((0, 0), 5), s.add_circle((0.02, 0), 3)])
    part = read(path, ReadOptions(concentric=concentric))
    assert sorted(hole.diameter for hole in part.holes) == left
    assert [what for what, _, _ in missing(part)] == ([] if concentric == "all" else ["circle"])


@pytest.mark.hazard
def test_holes_around_the_centre_of_a_disc_are_no_steps_of_it(draw: Any) -> None:
    path = draw(lambda d, s: [s.add_circle((0, 0), 200), *(s.add_circle((x, 0), 3) for x in (-8, 8))])
    for concentric in ("smallest", "largest"):
        assert [hole.diameter for hole in read(path, ReadOptions(concentric=concentric)).holes] == [6, 6]


def test_a_round_edge_of_a_plate_is_named_and_is_not_missing(draw: Any) -> None:
    def flange(document: Any, space: Any) -> None:
        space.add_circle((0, 0), 30)
        for x in (-20, 20):
            space.add_circle((x, 0), 3)

    part = read(draw(flange))
    assert [hole.diameter for hole in part.holes] == [6, 6]
    assert [(i.message, i.missing) for i in part.issues] == [
        ("the outline around all holes, 60 × 60 mm, is not cut", None)
    ]


def test_a_contour_in_the_only_hole_is_no_outline(draw: Any) -> None:
    part = read(draw(lambda d, s: [s.add_circle((0, 0), 4), rectangle(s, -1, -1, 1, 1)]))
    assert [hole.diameter for hole in part.holes] == [8]
    assert part.issues == ()
    assert [issue.message for issue in part.besides] == [
        "1 contour will not be machined, because only round holes are drilled; mill them with leafcut part or "
        "leafcut pocket"
    ]


def test_circles_with_one_centre_are_steps_of_a_hole_and_no_outline(draw: Any) -> None:
    path = draw(lambda d, s: [s.add_circle((0, 0), radius) for radius in (5, 3)])
    assert len(read(path, ReadOptions(concentric="all")).holes) == 2


def test_a_drawing_of_outlines_only_has_no_holes_and_says_why(draw: Any) -> None:
    def disc(document: Any, space: Any) -> None:
        space.add_circle((0, 0), 20)
        rectangle(space, -15, -2, -5, 2)
        rectangle(space, 5, -2, 15, 2)

    with pytest.raises(ReadError, match=r"no holes: .*1 circle will not be drilled, because a circle that encloses"):
        read(draw(disc))


def straight_slot(document: Any, space: Any) -> None:
    space.add_line((20, 30), (40, 30))
    space.add_line((20, 36), (40, 36))
    space.add_arc((20, 33), 3, 90, 270)
    space.add_arc((40, 33), 3, 270, 90)


def curved_slot_in_a_block(document: Any, space: Any) -> None:
    block = document.blocks.new("SLOT")
    block.add_arc((0, 0), 20, 0, 90)
    block.add_arc((0, 0), 16, 0, 90)
    block.add_arc((18, 0), 2, 180, 360)
    block.add_arc((0, 18), 2, 90, 270)
    space.add_blockref("SLOT", (60, 25))


def polygon(n: int, radius: float = 4.0, other: float | None = None) -> list[tuple[float, float]]:
    """Return n corners around (30, 40), on a circle or on an ellipse with another half axis."""
    angles = [k * math.tau / n for k in range(n)]
    return [(30 + radius * math.cos(a), 40 + (other or radius) * math.sin(a)) for a in angles]


def oval_in_chords(document: Any, space: Any) -> None:
    space.add_lwpolyline(polygon(36, 4.0, 3.9), close=True)


def leaning_circle(document: Any, space: Any) -> None:
    space.add_circle((30, 40), 3, dxfattribs={"extrusion": (1, 0, 0)})


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("draw", "what"),
    [
        (straight_slot, "slot"),
        (curved_slot_in_a_block, "slot"),
        (oval_in_chords, "hole"),
        (leaning_circle, "hole"),
    ],
)
def test_a_skipped_slot_or_circle_is_missing_work(tmp_path: Path, draw: Any, what: str) -> None:
    found = missing(drawn(tmp_path, draw))
    assert [(kind, count) for kind, count, _ in found] == [(what, 1)]


@pytest.mark.parametrize("as_lines", [False, True])
@pytest.mark.parametrize("n", [12, 36, 100])
def test_a_polygon_with_its_corners_on_a_circle_is_a_hole(tmp_path: Path, n: int, as_lines: bool) -> None:
    """The hole is the circle through the corners, as OpenSCAD draws them; the summary names it."""

    def draw(document: Any, space: Any) -> None:
        corners = polygon(n)
        if as_lines:
            for k in range(n):
                space.add_line(corners[k - 1], corners[k])
        else:
            space.add_lwpolyline(corners, close=True)

    part = drawn(tmp_path, draw)
    assert [(h.x, h.y, h.diameter) for h in part.holes[3:]] == [pytest.approx((30, 40, 8))]
    assert missing(part) == []
    (issue,) = (i for i in part.issues if i.code == "L405")
    assert "with corners on a circle as round holes (Ø8)" in issue.message


@pytest.mark.parametrize(
    "corners",
    [
        polygon(8),
        polygon(36, 4.0, 3.95),
        polygon(36)[:30],
        [polygon(13)[5 * k % 13] for k in range(13)],
    ],
    ids=["octagon", "oval", "flat side", "star"],
)
def test_other_polygons_are_no_holes(tmp_path: Path, corners: list[tuple[float, float]]) -> None:
    part = drawn(tmp_path, lambda document, space: space.add_lwpolyline(corners, close=True))
    assert len(part.holes) == 3


def test_a_plate_drawn_as_a_polygon_around_its_holes_is_the_outline(tmp_path: Path) -> None:
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    space.add_lwpolyline(polygon(48, 50.0), close=True)
    for x in (10, 50):
        space.add_circle((x, 40), 3)
    document.saveas(tmp_path / "disc.dxf")
    assert len(read(tmp_path / "disc.dxf").holes) == 2


@pytest.mark.parametrize("size", [(20, 6), (20, 19), (60, 3), (5, 5)])
def test_a_rectangle_is_no_slot(tmp_path: Path, size: tuple[float, float]) -> None:
    part = drawn(tmp_path, lambda document, space: rectangle(space, 20, 30, 20 + size[0], 30 + size[1]))
    assert missing(part) == []
    (other,) = part.besides
    assert other.missing
    assert other.missing.where == ((20 + size[0] / 2, 30 + size[1] / 2),)


@pytest.mark.parametrize(("length", "width"), [(8, 6), (12, 6), (60, 3)])
def test_a_slot_is_one_whatever_its_length(tmp_path: Path, length: float, width: float) -> None:
    along = length - width

    def slot(document: Any, space: Any) -> None:
        rows = [(20, 30, 0), (20 + along, 30, 1), (20 + along, 30 + width, 0), (20, 30 + width, 1)]
        space.add_lwpolyline(rows, format="xyb", close=True)

    assert missing(drawn(tmp_path, slot)) == [("slot", 1, [(20 + along / 2, 30 + width / 2)])]
