"""A drawing becomes a sheet: parts, holes, marks, and every reason to refuse or to warn, by drawings of a few lines."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import LeafcutError, PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Severity
from leafcut.model.part import Part
from leafcut.model.sheet import Sheet
from leafcut.options import SheetOptions
from leafcut.processes.contours import prepare_sheet
from leafcut.read import read_contours


def line(*points: tuple[float, float], layer: str = "") -> Contour:
    return Contour(Polyline.of_points(points), layer=layer)


def box(x: float, y: float, w: float, h: float, layer: str = "", part: int = 0) -> Contour:
    corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
    return Contour(Polyline.of_points(corners, closed=True), layer=layer, part=part)


def disc(x: float, y: float, r: float, layer: str = "") -> Contour:
    return Contour(Polyline.circle(x, y, r, clockwise=True), layer=layer)


def sheet(*contours: Contour, concentric: str = "smallest", **options: object) -> Sheet:
    return prepare_sheet(Part("test", contours=contours), SheetOptions(**options), concentric)


def codes(found: Sheet) -> list[str]:
    return sorted(issue.code for issue in found.issues)


def refusal(*contours: Contour, **options: object) -> str:
    with pytest.raises(PlanError) as caught:
        sheet(*contours, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_outlines_holes_and_parts_in_holes_have_their_depth_parent_and_part() -> None:
    found = sheet(disc(50, 50, 5), box(0, 0, 100, 100), disc(50, 50, 30), box(200, 0, 10, 10), disc(50, 50, 10))
    assert [(c.depth, c.parent, c.part) for c in found.contours] == [
        (3, 4, 3),
        (0, -1, 1),
        (1, 1, 1),
        (0, -1, 2),
        (2, 2, 3),
    ]
    assert [c.is_hole for c in found.contours] == [True, False, True, False, False]
    assert found.n_parts == 3
    assert all(c.path.area > 0 and c.part == c.part for c in found.contours)
    assert found.issues == () and found.outline is None


def test_marks_belong_to_the_part_they_lie_in() -> None:
    found = sheet(
        box(0, 0, 100, 100),
        line((10, 10), (20, 10), layer="Marking"),
        disc(50, 50, 20),
        line((45, 50), (55, 50), layer="MARK 2"),
        line((200, 0), (210, 0), layer="mark"),
    )
    assert [(c.kind, c.depth, c.parent, c.part) for c in found.contours] == [
        ("cut", 0, -1, 1),
        ("mark", 0, 0, 1),
        ("cut", 1, 0, 1),
        ("mark", 1, 2, 1),
        ("mark", 0, -1, 0),
    ]
    assert codes(found) == ["L421"]


def test_a_source_that_numbers_its_parts_is_believed_where_it_fits_the_nesting() -> None:
    good = sheet(box(0, 0, 10, 10, part=7), box(2, 2, 3, 3, part=7), box(20, 0, 9, 9, part=3))
    assert [c.part for c in good.contours] == [7, 7, 3]
    bad = sheet(box(0, 0, 10, 10, part=7), box(2, 2, 3, 3, part=8), box(20, 0, 9, 9, part=3))
    assert [c.part for c in bad.contours] == [1, 1, 2]


def test_layers_are_kinds_by_pattern() -> None:
    drawing = (box(0, 0, 9, 9, "Cut A"), box(20, 0, 9, 9, "Text"), box(1, 1, 2, 2, "Dots"), box(-5, -5, 50, 50, "rim"))
    found = sheet(*drawing, cut_layers="cut*", mark_layers="dots", sheet_layers="RIM")
    assert [(c.layer, c.kind) for c in found.contours] == [("Cut A", "cut"), ("Dots", "mark")]
    assert found.outline is not None and found.outline.area == 2500
    assert codes(found) == ["L211"]
    ignored = sheet(*drawing, ignore_layers="text,dots,rim")
    assert [c.layer for c in ignored.contours] == ["Cut A"]


def test_a_layer_named_as_a_sheet_is_the_sheet_only_where_it_lies_round_all_else() -> None:
    found = sheet(box(0, 0, 100, 50, "SHEET1"), box(5, 5, 10, 10), box(30, 5, 10, 10))
    assert found.n_parts == 2 and found.outline is not None and codes(found) == ["L421"]
    beside = sheet(box(0, 0, 100, 50, "Plate"), box(5, 5, 10, 10, "Plate"), box(300, 5, 10, 10))
    assert beside.outline is None and beside.n_parts == 2 and len(beside.contours) == 3
    alone = sheet(box(0, 0, 100, 50, "PLATE"), disc(20, 20, 5, "PLATE"))
    assert alone.outline is None and len(alone.contours) == 2


def test_a_part_that_crosses_a_layer_named_as_a_sheet_lies_beyond_its_edge() -> None:
    with pytest.raises(PlanError, match=r"1 contour beyond the edge of the sheet: part 1, at \(80, 20\)"):
        sheet(box(0, 0, 100, 100, "SHEET"), box(80, 20, 50, 50))
    notched = line((0, 0), (100, 0), (100, 20), (20, 20), (20, 100), (0, 100), (0, 0), layer="PLATE")
    assert sheet(notched, box(40, 40, 30, 30)).outline is None  # beside it, not across


@pytest.mark.parametrize(
    "beyond",
    [
        [box(150, 5, 10, 10)],
        [box(150, 0, 100, 50, "SHEET")],
        [box(150, 0, 100, 50, "SHEET"), box(155, 5, 10, 10)],
        [line((50, -5), (50, 55), layer="TRIM")],
        [line((150, 5), (160, 5), layer="MARK")],
    ],
)
def test_what_is_named_a_sheet_and_lies_round_some_of_the_parts_is_not_cut_as_a_part_round_holes(beyond) -> None:
    """Parts in it would be cut as its holes: on the wrong side of every line."""
    drawing = [box(0, 0, 100, 50, "SHEET"), box(5, 5, 10, 10), disc(10, 10, 2), *beyond]
    text = refusal(*drawing, open_paths="cut")
    assert "the name of layer SHEET indicates the edge of a sheet, and an outline on it encloses parts, but " in text
    assert "but leaves 1 contour outside, at" in text or "but is only one of several paths, at" in text
    named = sheet(*drawing, open_paths="cut", cut_layers="*")
    assert named.outline is None and len(named.contours) == len(drawing)


@pytest.mark.hazard
def test_an_outline_on_a_layer_named_as_a_frame_around_parts_is_refused_unless_options_settle_it() -> None:
    """As a part it would make holes of the parts in it: cut on the wrong side of their lines."""
    drawing = [box(0, 0, 420, 297, "BORDER"), box(50, 50, 200, 100, "0"), disc(100, 100, 20, "0")]
    text = refusal(*drawing)
    assert "the name of layer BORDER indicates a drawing frame" in text and "--ignore-layers" in text
    assert sheet(*drawing, ignore_layers="BORDER").n_parts == 1
    assert sheet(*drawing, cut_layers="BORDER,0").n_parts == 2
    assert sheet(*(replace(c, layer="FRAME") for c in drawing)).n_parts == 2
    assert "BORDER" in refusal(drawing[0], box(20, 50, 9, 9), box(50, 50, 9, 9))
    assert "BORDER" in refusal(drawing[0], box(20, 50, 9, 9), box(300, 5, 90, 40, "TITLE"))


@pytest.mark.hazard
def test_an_outline_on_a_layer_named_as_a_frame_around_one_window_is_cut_and_reported() -> None:
    window = sheet(box(0, 0, 100, 50, "FRAME"), box(10, 10, 80, 30))
    assert window.n_parts == 1 and codes(window) == ["L422"]
    assert "FRAME" in window.issues[0].message and "--ignore-layers" in window.issues[0].message


def test_a_part_on_a_layer_with_more_than_a_frame_in_its_name_is_cut() -> None:
    assert sheet(box(0, 0, 100, 50, "FRAME_OUT"), disc(20, 20, 5), disc(60, 20, 5)).n_parts == 1


def test_an_open_cut_from_edge_to_edge_of_the_sheet_leaves_it_the_sheet() -> None:
    found = sheet(box(0, 0, 100, 50, "SHEET"), box(5, 5, 9, 9), line((50, 0), (50, 50)), open_paths="cut")
    assert found.outline is not None and found.n_parts == 1


def test_a_drawing_with_nothing_but_marks_by_name_is_cut() -> None:
    assert [c.kind for c in sheet(box(0, 0, 9, 9, "MARK")).contours] == ["cut"]


@pytest.mark.parametrize(
    "code, contours, options",
    [
        ("L211", [box(0, 0, 9, 9), box(20, 0, 9, 9, "x")], {"ignore_layers": "x"}),
        ("L212", [box(0, 0, 9, 9), line((20, 0), (30, 0))], {"open_paths": "drop"}),
        ("L213", [box(0, 0, 9, 9), disc(5, 5, 0.1)], {}),
        ("L311", [line((0, 0), (9, 0)), line((9.04, 0), (9, 9), (0, 0))], {}),
        ("L312", [box(0, 0, 9, 9), line((2, 0), (7, 0))], {}),
        ("L312", [box(0, 0, 9, 9), box(0, 0, 9, 9)], {}),
        ("L313", [box(0, 0, 9, 9), line((2, 2), (2, 2))], {}),
        ("L314", [line((0, 0), (9, 0)), line((9, 0), (9, 9), (0, 0)), line((9, 0), (20, 0))], {"open_paths": "cut"}),
        ("L421", [box(0, 0, 9, 9), line((2, 2), (3, 3), layer="SCRIBE")], {}),
        ("L422", [box(0, 0, 99, 99), box(9, 9, 9, 9), box(10, 10, 3, 3)], {}),
        ("L422", [box(0, 0, 99, 99, "outer"), box(9, 9, 9, 9), box(29, 9, 9, 9)], {}),
        (
            "L422",
            [box(0, 0, 99, 99), box(9, 9, 9, 9), box(10, 10, 3, 3), box(50, 9, 9, 9), disc(55, 13, 2), disc(150, 5, 3)],
            {},
        ),
        ("L423", [box(0, 0, 9, 9), box(9, 0, 9, 9)], {}),
        ("L424", [box(0, 0, 9, 9), line((20, 0), (30, 0))], {"open_paths": "cut"}),
        ("L424", [box(0, 0, 9, 9), line((20, 0), (30, 0))], {"open_paths": "mark"}),
    ],
)
def test_what_was_mended_or_assumed_is_said(code: str, contours: list[Contour], options: dict[str, str]) -> None:
    assert code in codes(sheet(*contours, **options))


@pytest.mark.parametrize("contours, words", [
        ([line((0, 0), (9, 0), (9, 9))], "the layers to cut contain 1 open path: from (0, 0) to (9, 9)"),
        ([line((0, 0), (9, 0), (9, 9), (0, 0.2), layer="A")], "0.2 mm apart on layer A"),
        ([Contour(Polyline.of_points([(0, 0), (10, 10), (10, 0), (0, 10)], True))], "self-intersections, at (5, 5)"),
        ([Contour(Polyline.of_points([(0, 0), (10, 0)], True))], "with no area, such as a line drawn back and forth"),
        ([box(0, 0, 9, 9), box(5, 5, 9, 9)], "the outline that starts at (0, 0) and the outline that starts at (5, 5)"),
        ([box(0, 0, 9, 9, "A"), disc(9, 5, 2, "B")], "--cut-layers"),
        ([], "nothing is left to cut"),
        ([line((1, 1), (1, 1))], "nothing is left to cut"),
    ])  # fmt: skip
def test_what_cannot_be_cut_is_refused_with_its_place(contours: list[Contour], words: str) -> None:
    assert words in refusal(*contours)


def test_what_lies_beyond_the_sheet_is_refused_with_its_part() -> None:
    rim = box(0, 0, 100, 50, "S")
    assert "part 2, at (95, 5)" in refusal(rim, box(5, 5, 9, 9), box(95, 5, 9, 9), sheet_layers="S")
    assert "mark, at (150, 5)" in refusal(
        rim, box(5, 5, 9, 9), line((150, 5), (160, 5), layer="mark"), sheet_layers="S"
    )
    assert sheet(rim, box(0, 0, 9, 9), sheet_layers="S").n_parts == 1


def test_two_sheets_or_an_open_one_are_refused() -> None:
    part = box(5, 5, 9, 9)
    assert "contains 2 closed and 0 open" in refusal(
        part, box(0, 0, 50, 50, "S"), box(60, 0, 50, 50, "S"), sheet_layers="S"
    )
    assert "contains 0 closed and 1 open" in refusal(part, line((0, 0), (50, 0), (50, 50), layer="S"), sheet_layers="S")


def test_lines_that_outlines_share_and_nobody_can_tell_apart_are_refused() -> None:
    lines = [
        line(a, b)
        for x in range(4)
        for y in range(4)
        for a, b in [
            ((x, y), (x + 1, y)),
            ((x + 1, y), (x + 1, y + 1)),
            ((x + 1, y + 1), (x, y + 1)),
            ((x, y + 1), (x, y)),
        ]
    ]
    for seed in range(5):
        shuffled = random.Random(seed).sample(lines, len(lines))
        try:
            found = sheet(*shuffled)
        except PlanError as problem:
            assert "\n" not in str(problem)
        else:
            assert found.n_parts == 16 and {round(c.path.area, 6) for c in found.contours} == {1}


def nest(draw: random.Random, n: int) -> list[Contour]:
    """Return n plates in rows, each with up to three holes, some with a disc inside a hole, in any order."""
    found = []
    for k in range(n):
        x, y = 70.0 * (k % 10), 70.0 * (k // 10)
        found.append(box(x, y, 60, 60))
        for i in range(draw.randrange(4)):
            cx, cy = x + 15 + 30 * (i % 2), y + 15 + 30 * (i // 2)
            found.append(disc(cx, cy, 12))
            if draw.random() < 0.5:
                found.append(disc(cx, cy, 8))
    draw.shuffle(found)
    return found


def test_a_nest_drawn_as_loose_lines_and_arcs_in_any_order_is_the_nest_again(tmp_path: Path) -> None:
    draw = random.Random(5)
    contours = nest(draw, 40)
    document = ezdxf.new(units=4)
    space = document.modelspace()
    strokes = [s for c in contours for s in c.path.segments()]
    draw.shuffle(strokes)
    for s in strokes:
        if s.is_arc:
            angles = [math.degrees(math.atan2(p[1] - s.center[1], p[0] - s.center[0])) for p in (s.start, s.end)]
            space.add_arc(s.center, s.radius, *angles, is_counter_clockwise=s.bulge > 0)
        else:
            space.add_line(*((s.start, s.end) if draw.random() < 0.5 else (s.end, s.start)))
    document.saveas(tmp_path / "nest.dxf")
    loose, whole = (
        prepare_sheet(part, concentric="all")
        for part in (read_contours(tmp_path / "nest.dxf"), Part("test", contours=tuple(contours)))
    )
    assert loose.issues == ()

    def summary(found: Sheet) -> list[tuple[float, ...]]:
        return sorted((c.depth, c.path.area, *np.round(c.path.extents, 6)) for c in found.contours)

    for ours, theirs in zip(summary(loose), summary(whole), strict=True):
        assert ours == pytest.approx(theirs, abs=1e-5)
    assert loose.n_parts == whole.n_parts


#: Strokes on a small grid, so that ends, lines and whole outlines often fall on each other.
strokes = st.lists(
    st.tuples(
        st.lists(
            st.tuples(st.integers(0, 4), st.integers(0, 4), st.sampled_from([0.0, 0.0, 0.0, 1.0, -0.5])),
            min_size=2,
            max_size=5,
        ),
        st.booleans(),
        st.sampled_from(["", "A", "MARK"]),
    ),
    min_size=1,
    max_size=15,
)


@given(strokes, st.sampled_from(["refuse", "cut", "mark", "drop"]))
def test_whatever_is_drawn_outlines_are_simple_and_apart_or_one_line_says_why_not(
    rows: list[tuple[list[tuple[float, float, float]], bool, str]], open_paths: str
) -> None:
    contours = [Contour(Polyline(np.array(v, dtype=float), closed), layer=layer) for v, closed, layer in rows]
    try:
        found = sheet(*contours, open_paths=open_paths)
    except PlanError as problem:
        assert "\n" not in str(problem)
        return
    outlines = [c for c in found.contours if c.kind == "cut" and c.path.closed]
    shapes = [shapely.Polygon(c.path.flattened(0.001)) for c in outlines]
    assert all(s.is_valid for s in shapes)
    for k, shape in enumerate(shapes):
        for other in shapes[:k]:
            shared = shape.intersection(other).area
            assert min(shared, abs(shared - min(shape.area, other.area))) <= 0.02 * (shape.length + other.length)


def test_depths_and_areas_are_those_of_shapely() -> None:
    found = sheet(*nest(random.Random(9), 30))
    shapes = [shapely.Polygon(c.path.flattened(0.001)) for c in found.contours]
    for c, shape in zip(found.contours, shapes, strict=True):
        holders = [k for k, other in enumerate(shapes) if other.contains_properly(shape)]
        assert c.depth == len(holders)
        assert c.parent == min(holders, key=lambda k: shapes[k].area, default=-1)
        assert c.path.area == pytest.approx(shape.area, rel=1e-3)


#: Real drawings: numbers of parts, holes and marks, or the refusal. Each was checked by eye.
REAL = {
    "camotics_buildbotics_logo": "4 pairs of overlapping outlines",  # artwork on layers over each other
    "camotics_lampshade_side": (1, 21),
    "deepnestport_1": (1, 1),
    "deepnestport_3": (1, 1),
    "deepnestport_4": (1, 0),
    "deepnestport_6": (1, 7),
    "deepnestport_10": (1, 4),
    "deepnestport_11": (1, 4),
    "dxfjs_array-rotated": (6, 0),
    "dxfjs_arrayed-holes": (1, 14),
    "dxfjs_blocks1": "4 pairs of overlapping outlines",  # shapes drawn across each other
    "dxfjs_closedlwpolylinebug": (1, 0),
    "dxfjs_issue21": (1, 2),
    "dxfjs_issue39": "choose what is cut with --cut-layers",  # pockets across the outline, on a layer of their own
    "dxfjs_issue42": (1, 14),
    "dxfjs_issue53": (1, 15),
    "dxfjs_openscad_export": (5, 5),
    "dxfjs_splines": "2 open paths",
    "ezdxf_edgeminer_polylines": "2 open paths",
    "ezdxf_forms": (23, 17),
}


@pytest.mark.parametrize("name", REAL)
def test_real_drawings_are_sheets_or_refused_with_their_reason(data: Path, name: str) -> None:
    expected = REAL[name]
    try:
        found = prepare_sheet(read_contours(data / "dxf" / f"{name}.dxf"))
    except LeafcutError as problem:
        assert isinstance(expected, str) and expected in str(problem)
    else:
        assert (found.n_parts, sum(c.is_hole for c in found.contours)) == expected


def test_every_real_drawing_is_in_the_table(data: Path) -> None:
    assert {p.stem for p in (data / "dxf").glob("*.dxf")} == set(REAL)


@pytest.mark.parametrize(
    "name, counts, size",
    [
        ("8877_01.DBS.JSON", (16, 15), 8000 * 2000),
        ("test1.dbs.json", (21, 2), 2000 * 1000),
        ("E1X_6_01.dbs.json", (8, 8), 700 * 300),
    ],
)
def test_real_sheets_of_a_cam_are_read_with_their_edge(
    data: Path, name: str, counts: tuple[int, int], size: int
) -> None:
    found = prepare_sheet(read_contours(data / "nesting" / "sirius_sheets" / name))
    assert (found.n_parts, sum(c.is_hole for c in found.contours)) == counts
    assert found.outline is not None and found.outline.area == pytest.approx(size)


def diameters(found: Sheet) -> list[float]:
    """Return the diameters of the round contours of a sheet, with a minus sign for holes."""
    circles = [c for c in found.contours if c.path.n_segments == 2]
    return sorted(c.path.length / math.pi * (-1 if c.is_hole else 1) for c in circles)


@pytest.mark.hazard
def test_of_two_circles_of_a_countersunk_hole_the_smaller_is_cut_as_a_hole_and_the_larger_is_reported() -> None:
    plate = [box(0, 0, 60, 60), disc(15, 15, 2), disc(15, 15, 1), disc(45, 15, 2), disc(45, 15, 1), disc(30, 45, 3)]
    found = sheet(*plate)
    assert diameters(found) == pytest.approx([-6, -2, -2])
    assert {(c.depth, c.part) for c in found.contours} == {(0, 1), (1, 1)}
    (told,) = [issue for issue in found.issues if issue.code == "L302"]
    assert told.severity is Severity.MISSING
    assert told.message.startswith(
        "the program does not cut 2 circles around a hole with the same centre, because countersinks"
    )
    assert told.place == "at (15, 15), (45, 15)"


def test_concentric_says_which_circle_of_a_bore_is_cut() -> None:
    plate = [box(0, 0, 60, 60), disc(30, 30, 5), disc(30, 30, 3)]
    assert diameters(sheet(*plate)) == pytest.approx([-6])
    assert diameters(sheet(*plate, concentric="largest")) == pytest.approx([-10])
    whole = sheet(*plate, concentric="all")
    assert diameters(whole) == pytest.approx([-10, 6]) and whole.n_parts == 2 and "L302" not in codes(whole)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("radii", "kept"),
    [
        ((6, 4, 2.5), [-5]),  # a counterbore, a countersink and the hole
        ((24, 12, 8), [-48, -16, 24]),  # wider than the head of a screw: a ring in a hole
    ],
)
def test_a_stepped_bore_is_one_hole_and_a_ring_in_a_wide_hole_is_a_part(
    radii: tuple[float, ...], kept: list[float]
) -> None:
    assert diameters(sheet(box(0, 0, 60, 60), *(disc(30, 30, r) for r in radii))) == pytest.approx(kept)


@pytest.mark.hazard
def test_rings_a_washer_with_a_countersink_and_parts_in_holes_keep_their_circles() -> None:
    washer = [disc(20, 20, 10)]
    assert diameters(sheet(*washer, disc(20, 20, 3))) == pytest.approx([-6, 20])
    assert diameters(sheet(*washer, disc(20, 20, 5), disc(20, 20, 3))) == pytest.approx([-6, 20])
    rings = [disc(20, 20, r) for r in (18, 14, 13, 9, 8, 4)]
    assert diameters(sheet(*rings)) == pytest.approx([-28, -18, -8, 16, 26, 36])
    # Beside the centre, with something else in the hole, or with something in the disc: a part in a hole.
    plate = box(0, 0, 60, 60)
    assert sheet(plate, disc(30, 30, 20), disc(32, 30, 5)).n_parts == 2
    assert sheet(plate, disc(30, 30, 20), disc(30, 30, 5), box(38, 28, 4, 4)).n_parts == 3
    assert sheet(plate, disc(30, 30, 20), disc(30, 30, 5), box(29, 29, 2, 2)).n_parts == 2


def test_a_circle_of_a_bore_that_is_drawn_in_chords_counts_as_a_circle() -> None:
    corners = [(30 + 4 * math.cos(a), 30 + 4 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 37)[:-1]]
    chords = Contour(Polyline.of_points(corners, closed=True))
    assert diameters(sheet(box(0, 0, 60, 60), chords, disc(30, 30, 2))) == pytest.approx([-4])


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("holes", "pieces"),
    [
        ([box(0, 20, 60, 5)], 2),  # from edge to edge
        ([box(10, 10, 20, 20), box(30, 10, 20, 20)], 1),  # side by side: a wider window
        # Four bars around a square, which falls out.
        ([box(10, 10, 30, 5), box(40, 10, 5, 30), box(15, 40, 30, 5), box(10, 15, 5, 30)], 2),
        ([disc(30, 10, 10), disc(30, 30, 10), disc(30, 50, 10)], 2),
        ([disc(30, 10, 10), disc(30, 30, 10), disc(30, 49, 9)], 1),
    ],
)
def test_a_part_that_its_touching_holes_divide_is_refused_with_the_size_of_the_smallest_piece(
    holes: list[Contour], pieces: int
) -> None:
    """By shapely: the pieces of the plate without its holes."""
    plate = box(0, 0, 60, 60)
    outline, *cut = (shapely.Polygon(c.path.flattened(0.001)) for c in (plate, *holes))
    left = shapely.difference(outline, shapely.union_all(cut)).buffer(-0.02)
    assert len(shapely.get_parts(left)) == pieces
    if pieces == 1:
        assert "L423" in codes(sheet(plate, *holes))
        return
    text = refusal(plate, *holes)
    assert "the part with the outline that starts at (0, 0)" in text
    assert f"falls into {pieces} pieces" in text and "move them apart" in text
    x0, y0, x1, y1 = min(shapely.get_parts(left), key=lambda piece: piece.area).bounds
    width, height = (float(word) for word in text.partition("smallest ")[2].partition(" mm")[0].split(" × "))
    assert (width, height) == pytest.approx((x1 - x0, y1 - y0), abs=0.6)


@pytest.mark.hazard
def test_no_message_proposes_a_join_tolerance_above_half_a_millimetre() -> None:
    """The ends of two crossed centre marks, 3.2 mm apart, would be joined into a diamond."""
    marks = line((8, 10), (12.54, 10)), line((10.27, 7.73), (10.27, 12.27))
    assert math.dist(marks[0].path.start, marks[1].path.start) == pytest.approx(3.21, abs=0.01)
    text = refusal(box(0, 0, 20, 20), *marks)
    assert "--join-tolerance" not in text and "draw the missing line there" in text
    for gap in (0.1, 0.499, 0.501, 0.6, 4.9):
        text = refusal(line((0, 0), (20, 0), (20, 20), (0, 20), (0, gap)))
        assert ("--join-tolerance" in text) == (gap < 0.5)


def test_an_open_path_names_the_nearest_end_and_the_tolerance_that_closes_it() -> None:
    """Two halves of a square, 0.25 and 0.3 mm apart: the proposed tolerance joins one pair of ends, then the other."""
    halves = line((0, 0), (10, 0), (10, 10)), line((9.7, 10), (0, 10), (0, 0.25))
    first = refusal(*halves)
    assert "the nearest end is 0.25 mm away at (0, 0.25): --join-tolerance 0.251 closes it" in first
    assert "the nearest end is 0.3 mm away at (10, 10)" in refusal(*halves, join_tolerance=0.251)
    assert "--join-tolerance 0.301 closes it" in refusal(*halves, join_tolerance=0.251)
    assert len(sheet(*halves, join_tolerance=0.301).contours) == 1
    assert "draw the missing line there" in refusal(line((0, 0), (10, 0), (10, 10)))
