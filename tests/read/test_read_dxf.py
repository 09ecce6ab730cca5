"""DXF: recognition of holes, and their placement by blocks."""

from __future__ import annotations

import math

import pytest
from ezdxf.math import Matrix44, Vec3

from leafcut.errors import ReadError
from leafcut.model.contour import is_annotation_layer
from leafcut.model.issue import Severity
from leafcut.model.part import Hole
from leafcut.options import ReadOptions
from leafcut.read import read
from leafcut.read.filter_holes import holes_on_part_layers


def places(part, digits=6):
    """Return (x, y, diameter) of every hole, in order."""
    return [(round(h.x, digits), round(h.y, digits), round(h.diameter, digits)) for h in part.holes]


def codes(part):
    """Return the issue codes of a part, sorted."""
    return sorted(issue.code for issue in part.issues)


def issue(part, code):
    """Return the only issue with a code."""
    (found,) = [i for i in part.issues if i.code == code]
    return found


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2007", "R2010", "R2013", "R2018"])
@pytest.mark.parametrize("fmt", ["asc", "bin"])
def test_circles_of_every_version_text_or_binary_are_holes_in_drawing_order(draw, version, fmt):
    def build(doc, space):
        doc.layers.add("HOLES")
        space.add_circle((30, 5), 2, dxfattribs={"layer": "HOLES"})
        space.add_circle((10, 20), 1.5)

    part = read(draw(build, version=version, fmt=fmt))
    assert places(part) == [(30, 5, 4), (10, 20, 3)]
    assert [h.layer for h in part.holes] == ["HOLES", "0"]
    assert all(int(h.handle, 16) > 0 for h in part.holes)
    assert part.format == "dxf"
    # The header of R12 has no units.
    assert codes(part) == (["L102"] if version == "R12" else [])


@pytest.mark.parametrize(
    "code, mm", [(1, 25.4), (2, 304.8), (4, 1.0), (5, 10.0), (6, 1000.0), (9, 0.0254), (10, 914.4), (14, 100.0)]
)
def test_insunits_scale_coordinates_and_diameters(draw, code, mm):
    part = read(draw(lambda doc, space: space.add_circle((2, 3), 0.25), units=code))
    assert places(part) == [(round(2 * mm, 6), round(3 * mm, 6), round(0.5 * mm, 6))]
    assert not part.issues


def test_a_drawing_in_inch_and_the_same_in_mm_give_the_same_numbers(draw):
    points = [(0.1 * i, 0.37 * i) for i in range(1, 30)]
    inch = read(draw(lambda d, s: [s.add_circle(p, 0.125) for p in points], units=1))
    metric = read(draw(lambda d, s: [s.add_circle((x * 25.4, y * 25.4), 3.175) for x, y in points], units=4))
    assert [(h.x, h.y, h.diameter) for h in inch.holes] == [(h.x, h.y, h.diameter) for h in metric.holes]


@pytest.mark.parametrize("code", [None, 0, 20, 77])
def test_unknown_units_are_taken_as_mm_and_reported_with_the_size(hand_drawn, code):
    circle = "0\nCIRCLE\n8\n0\n10\n{}\n20\n{}\n40\n1\n"
    part = read(hand_drawn(circle.format(0, 0) + circle.format(8, 3), insunits=code))
    assert places(part) == [(0, 0, 2), (8, 3, 2)]
    assert "8 × 3 mm" in issue(part, "L102").message
    assert issue(part, "L102").severity is Severity.WARNING


def test_the_units_option_overrides_the_drawing(draw):
    part = read(draw(lambda d, s: s.add_circle((1, 1), 0.5), units=4), ReadOptions(units="in"))
    assert places(part) == [(25.4, 25.4, 25.4)]
    assert part.units == "in"
    assert not part.issues


def test_two_arcs_close_a_circle_and_one_does_not(draw):
    def build(doc, space):
        space.add_arc((5, 5), 2, 30, 210)
        space.add_circle((50, 50), 1)
        space.add_arc((5.0000001, 5), 2, 210, 30)
        space.add_arc((20, 5), 2, 0, 180)

    part = read(draw(build))
    assert places(part) == [(5, 5, 4), (50, 50, 2)]
    assert codes(part) == ["L201", "L303"]


def test_arcs_that_overlap_or_come_in_any_number_close_a_circle(draw):
    def build(doc, space):
        for start in (0, 90, 180, 270):
            space.add_arc((5, 5), 2, start, start + 95)
        for start in (270, 0, 180, 90):
            space.add_arc((15, 5), 3, start - 10, start + 80)

    assert places(read(draw(build))) == [(5, 5, 4), (15, 5, 6)]


def test_arcs_with_a_gap_are_no_hole_however_often_they_are_drawn(draw):
    def build(doc, space):
        for _ in range(3):
            space.add_arc((5, 5), 2, 0, 180)
            space.add_arc((5, 5), 2, 185, 360)

    with pytest.raises(ReadError, match="no holes: 6 ARC"):
        read(draw(build))


def test_one_arc_of_360_degrees_is_a_hole(draw):
    assert places(read(draw(lambda d, s: s.add_arc((5, 5), 2, 0, 360)))) == [(5, 5, 4)]


def test_polylines_with_bulges_close_a_circle_also_in_pieces(draw):
    def build(doc, space):
        space.add_lwpolyline([(0, 0, 1), (4, 0, 1)], format="xyb", close=True)
        space.add_polyline2d([(10, 0, -1), (14, 0, -1)], format="xyb", close=True)
        space.add_lwpolyline([(20, 0, 1), (24, 0, 1), (20, 0, 0)], format="xyb")
        space.add_lwpolyline([(30, 0, 1), (34, 0, 0)], format="xyb")
        space.add_lwpolyline([(34, 0, 1), (30, 0, 0)], format="xyb")
        quarter = math.tan(math.pi / 8)
        space.add_lwpolyline(
            [(42, 0, quarter), (40, 2, quarter), (38, 0, quarter), (40, -2, quarter)], format="xyb", close=True
        )

    part = read(draw(build))
    assert places(part) == [(2, 0, 4), (12, 0, 4), (22, 0, 4), (32, 0, 4), (40, 0, 4)]
    assert codes(part) == ["L303"]


def test_a_slot_outline_and_a_rectangle_are_counted_by_kind_and_are_no_holes(draw):
    def build(doc, space):
        space.add_circle((50, 50), 1)
        for x in (0, 30):
            space.add_lwpolyline([(x, 0, 0), (x + 10, 0, 1), (x + 10, 4, 0), (x, 4, 1)], format="xyb", close=True)
        space.add_line((0, 0), (1, 1))
        space.add_spline([(0, 0), (1, 1), (2, 0), (5, 5)])

    part = read(draw(build))
    assert places(part) == [(50, 50, 2)]
    found = sorted((i.severity, i.message) for i in part.issues)
    assert found == [
        (Severity.MISSING, "2 slots will not be milled, because only round holes are drilled"),
        (Severity.NOTE, "ignored 1 LINE, which cannot be a hole"),
        (Severity.NOTE, "ignored 1 SPLINE, which cannot be a hole"),
    ]


def test_a_circular_ellipse_is_a_hole_and_another_is_not(draw):
    def build(doc, space):
        space.add_ellipse((5, 6), major_axis=(0, 2), ratio=1.0)
        space.add_ellipse((15, 6), major_axis=(2, 0), ratio=0.5)

    part = read(draw(build))
    assert places(part) == [(5, 6, 4)]
    assert codes(part) == ["L207"]


def test_points_are_holes_without_diameter(draw):
    part = read(draw(lambda d, s: [s.add_point((1, 2)), s.add_point((3, 4))]))
    assert places(part) == [(1, 2, 0), (3, 4, 0)]
    assert not part.issues


def test_points_beside_circles_are_reported_and_centre_marks_and_defpoints_are_not_drilled(draw):
    def build(doc, space):
        space.add_point((5, 5))
        space.add_circle((5, 5), 2)
        space.add_point((9, 9))
        space.add_point((7, 7), dxfattribs={"layer": "Defpoints"})

    part = read(draw(build))
    assert places(part) == [(5, 5, 4), (9, 9, 0)]
    assert codes(part) == ["L201", "L302", "L405"]


def test_inserts_are_scaled_turned_and_nested_as_ezdxf_explodes_them(draw):
    """Independent: ezdxf's own explosion of the same blocks."""
    expected = []

    def build(doc, space):
        inner = doc.blocks.new("INNER", base_point=(1, 1))
        inner.add_circle((3, 2), 1)
        inner.add_arc((0, 0), 0.5, 0, 180)
        inner.add_arc((0, 0), 0.5, 180, 360)
        outer = doc.blocks.new("OUTER")
        outer.add_blockref("INNER", (10, 0), dxfattribs={"rotation": 30, "xscale": 2, "yscale": -2, "zscale": 2})
        outer.add_circle((0, 5), 2)
        space.add_blockref(
            "OUTER", (100, 50), dxfattribs={"rotation": -70, "xscale": -1.5, "yscale": 1.5, "zscale": 1.5}
        )
        space.add_blockref("OUTER", (-20, 5))
        for top in space.query("INSERT"):
            for entity in top.virtual_entities():
                parts = entity.virtual_entities() if entity.dxftype() == "INSERT" else [entity]
                for e in parts:
                    center = e.ocs().to_wcs(e.dxf.center)
                    expected.append((round(center.x, 6), round(center.y, 6), round(2 * e.dxf.radius, 6)))

    part = read(draw(build))
    assert len(part.holes) == 6
    assert sorted(places(part)) == sorted(set(expected))


def test_an_arrayed_insert_turns_its_steps_but_does_not_scale_them(draw):
    """By hand: 2 columns 5 apart and 3 rows 7 apart, turned by 90°: columns go up, rows go left."""

    def build(doc, space):
        doc.blocks.new("HOLE").add_circle((0, 0), 1)
        attribs = {"rotation": 90, "xscale": 2, "yscale": 2, "zscale": 2}
        attribs |= {"column_count": 2, "column_spacing": 5, "row_count": 3, "row_spacing": 7}
        space.add_blockref("HOLE", (10, 20), dxfattribs=attribs)

    expected = [(10 - 7 * r, 20 + 5 * c, 4) for r in range(3) for c in range(2)]
    assert places(read(draw(build))) == expected


def test_mirrored_extrusion_turns_x_around(draw):
    """By hand: the OCS of extrusion (0, 0, -1) has its x axis along -x (DXF's arbitrary axis rule)."""

    def build(doc, space):
        down = {"extrusion": (0, 0, -1)}
        space.add_circle((10, 5), 1, dxfattribs=down)
        space.add_lwpolyline([(20, 0, 1), (24, 0, 1)], format="xyb", close=True, dxfattribs=down)
        doc.blocks.new("B").add_circle((3, 0), 2)
        space.add_blockref("B", (30, 0), dxfattribs=down)

    assert places(read(draw(build))) == [(-10, 5, 2), (-22, 0, 4), (-33, 0, 4)]


def test_a_block_scaled_unevenly_makes_no_hole_and_is_reported(draw):
    def build(doc, space):
        doc.blocks.new("B").add_circle((0, 0), 1)
        space.add_blockref("B", (0, 0))
        space.add_blockref("B", (10, 0), dxfattribs={"xscale": 2, "yscale": 1})

    part = read(draw(build))
    assert places(part) == [(0, 0, 2)]
    assert issue(part, "L207").severity is Severity.MISSING


def test_a_circle_out_of_the_plane_is_skipped_and_one_at_another_height_is_not(draw):
    def build(doc, space):
        space.add_circle((0, 0, 12), 1)
        space.add_circle((5, 5, 0), 1, dxfattribs={"extrusion": (1, 0, 0)})
        space.add_circle((9, 9, 0), 1).transform(Matrix44.x_rotate(0.3))

    part = read(draw(build))
    assert places(part) == [(0, 0, 2)]
    assert issue(part, "L202").message.startswith("2 circles")


def test_frozen_and_off_layers_hide_and_layer_0_of_a_block_takes_the_inserts_layer(draw):
    def build(doc, space):
        doc.layers.add("ON")
        doc.layers.add("OFF").off()
        doc.layers.add("FROZEN").freeze()
        block = doc.blocks.new("B")
        block.add_circle((0, 0), 1)
        block.add_circle((0, 5), 1, dxfattribs={"layer": "ON"})
        for x, layer in ((0, "ON"), (10, "off"), (20, "Frozen"), (30, "UNLISTED")):
            space.add_circle((x, 100), 1, dxfattribs={"layer": layer})
            space.add_blockref("B", (x, 0), dxfattribs={"layer": layer})

    part = read(draw(build))
    # Off hides only what is on that layer; frozen hides the whole insertion, as in AutoCAD.
    expected = [(0, 100, "ON"), (0, 0, "ON"), (0, 5, "ON"), (10, 5, "ON")]
    expected += [(30, 100, "UNLISTED"), (30, 0, "UNLISTED"), (30, 5, "ON")]
    assert [(h.x, h.y, h.layer) for h in part.holes] == expected
    assert codes(part) == ["L204"]


def test_layers_are_chosen_by_wildcards_in_upper_or_lower_case(draw):
    def build(doc, space):
        for i, layer in enumerate(("HOLES_6", "holes_8", "FRAME")):
            space.add_circle((10 * i, 0), 1, dxfattribs={"layer": layer})

    path = draw(build)
    assert [h.x for h in read(path, ReadOptions(layers=("Holes*",))).holes] == [0, 10]
    assert [h.x for h in read(path, ReadOptions(layers=("frame", "*_6"))).holes] == [0, 20]
    with pytest.raises(ReadError, match=r"layers that are off, frozen or not chosen: 1 on layer HOLES_6, 1 on"):
        read(path, ReadOptions(layers=("HOLE",)))


@pytest.mark.hazard
def test_circles_on_layers_of_frames_and_dimensions_are_drilled_only_where_layers_choose_them(draw):
    def build(doc, space):
        for i, layer in enumerate(("PART", "border", "Title block", "DIM", "SCHRIFTFELD")):
            space.add_circle((10 * i, 0), 1, dxfattribs={"layer": layer})
        space.add_circle((40, 20), 1, dxfattribs={"layer": "border"})

    path = draw(build)
    part = read(path)
    assert [h.x for h in part.holes] == [0]
    (left,) = [issue for issue in part.issues if issue.code == "L204"]
    assert left.severity is Severity.WARNING
    assert "2 on layer border, 1 on layer Title block" in left.message
    assert "--layers" in left.message
    assert len(read(path, ReadOptions(layers=("*",))).holes) == 6
    frame = draw(lambda d, s: s.add_circle((0, 0), 1, dxfattribs={"layer": "border"}))
    with pytest.raises(ReadError, match=r"no holes: .*1 on layer border; choose the layers to drill with --layers"):
        read(frame)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "layer", ["DIMPLES", "Frame holes", "TEXTURE", "DIMPLE PLATE", "FRAME_OUT", "A3", "Рама TEXT", ""]
)
def test_holes_on_layers_with_other_words_in_their_names_are_drilled(layer):
    assert not is_annotation_layer(layer)
    assert holes_on_part_layers([Hole(0, 0, 5, layer)], ReadOptions()) == ([Hole(0, 0, 5, layer)], [])


@pytest.mark.parametrize(
    "layer", ["DIM_2", "dims", "TITLE-BLOCK", "Drawing frame A3", "Texts", "Bemaßung", "Cajetín", "$TEXT"]
)
def test_layers_of_frames_dimensions_and_texts_are_known_by_all_of_their_words(layer):
    assert is_annotation_layer(layer)


def test_diameters_are_chosen_by_their_limits_inclusive(draw):
    path = draw(lambda d, s: [s.add_circle((10 * i, 0), i / 8) for i in (1, 2, 3)], units=1)  # Ø 6.35, 12.7, 19.05
    part = read(path, ReadOptions(min_diameter=6.36, max_diameter=12.7))
    assert [h.diameter for h in part.holes] == [12.7]
    assert codes(part) == ["L205"]
    assert len(read(path, ReadOptions(min_diameter=6.35, max_diameter="0.75in")).holes) == 3


def test_paper_space_and_invisible_entities_are_left_out(draw):
    def build(doc, space):
        space.add_circle((1, 1), 1)
        space.add_circle((5, 5), 1, dxfattribs={"invisible": 1})
        doc.layout("Layout1").add_circle((9, 9), 1)

    assert places(read(draw(build))) == [(1, 1, 2)]


def test_doubled_holes_are_drilled_once_and_reported(draw):
    def build(doc, space):
        for x in (5, 20, 5.004, 5, 40):
            space.add_circle((x, 0), 2)

    part = read(draw(build))
    assert places(part) == [(5, 0, 4), (20, 0, 4), (40, 0, 4)]
    assert issue(part, "L301").message.startswith("merged 2 holes")
    assert "(5.004, 0)" in issue(part, "L301").place


@pytest.mark.parametrize("rule, diameters", [("smallest", [4, 6]), ("largest", [10, 6]), ("all", [10, 4, 6])])
def test_of_circles_with_one_centre_the_chosen_one_is_drilled(draw, rule, diameters):
    def build(doc, space):
        for x, radius in ((0, 5), (0, 2), (20, 3)):
            space.add_circle((x, 0), radius)

    part = read(draw(build), ReadOptions(concentric=rule))
    assert [h.diameter for h in part.holes] == diameters
    assert codes(part) == ([] if rule == "all" else ["L302"])


def test_strict_refuses_what_was_repaired_but_not_what_was_merely_noted(draw):
    noted = draw(lambda d, s: [s.add_circle((0, 0), 1), s.add_line((0, 0), (1, 1))])
    assert len(read(noted, ReadOptions(strict=True)).holes) == 1
    doubled = draw(lambda d, s: [s.add_circle((0, 0), 1), s.add_circle((0, 0), 1)])
    with pytest.raises(ReadError, match="--strict: L301"):
        read(doubled, ReadOptions(strict=True))


def test_vectors_of_ezdxf_and_ours_agree_on_a_tilted_but_flat_block(draw):
    """A block flipped over by extrusion (0, 0, -1) and turned lands where ezdxf puts it."""
    expected = []

    def build(doc, space):
        doc.blocks.new("B").add_circle((3, 1), 2)
        insert = space.add_blockref("B", (30, 4), dxfattribs={"extrusion": (0, 0, -1), "rotation": 25})
        expected.append(insert.matrix44().transform(Vec3(3, 1)))

    (hole,) = read(draw(build)).holes
    assert (hole.x, hole.y) == pytest.approx((expected[0].x, expected[0].y))
