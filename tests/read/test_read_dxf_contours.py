"""DXF as contours: every kind of stroke, where blocks put it, against ezdxf's own flattening."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import dxf_strokes, read, read_contours

#: Maximum distance between a curve and its arcs, mm, including the chords used to measure it.
NEAR = 0.013


def codes(part) -> list[str]:
    return sorted(issue.code for issue in part.issues)


def chords_of(part) -> list[np.ndarray]:
    return [c.path.flattened(0.001) for c in part.contours]


def drawn(build, draw) -> list[np.ndarray]:
    """Return ezdxf's own reading of the entities, with blocks and polylines exploded, in very short chords."""
    lines = []

    def collect(document, space):
        build(document, space)
        waiting = list(space)
        while waiting:
            entity = waiting.pop()
            kind = entity.dxftype()
            if kind == "INSERT":
                for insert in entity.multi_insert() if entity.mcount > 1 else [entity]:
                    waiting.extend(insert.virtual_entities())
            elif kind in ("LWPOLYLINE", "POLYLINE"):
                waiting.extend(entity.virtual_entities())
            else:
                points = [entity.dxf.start, entity.dxf.end] if kind == "LINE" else entity.flattening(0.001)
                lines.append(np.array([(p.x, p.y) for p in points]))

    draw(collect)
    return lines


def apart(first: list[np.ndarray], second: list[np.ndarray]) -> float:
    """Return the maximum distance between the points and midpoints of each drawing and the lines of the other."""
    worst = 0.0
    for one, other in ((first, second), (second, first)):
        target = shapely.MultiLineString(other)
        shapely.prepare(target)
        dense = np.concatenate([p for line in one for p in (line, 0.5 * (line[1:] + line[:-1]))])
        worst = max(worst, float(shapely.distance(target, shapely.points(dense)).max()))
    return worst


def spline(space):
    space.add_open_spline([(0, 0), (10, 30), (30, -20), (40, 20), (60, 0)])


def bulged(space):
    space.add_lwpolyline([(0, 0, 0.5), (10, 0, -1.5), (10, 10, 0), (0, 10, 1)], format="xyb", close=True)


STROKES = {
    "line": lambda s: s.add_line((1, 2), (30, 4)),
    "circle": lambda s: s.add_circle((5, 6), 7),
    "arc": lambda s: s.add_arc((5, 6), 7, 200, 70),
    "long arc": lambda s: s.add_arc((5, 6), 7, 10, 359),
    "ellipse": lambda s: s.add_ellipse((5, 6), (20, 10), 0.4),
    "part of an ellipse": lambda s: s.add_ellipse((5, 6), (20, 10), 0.4, 1.0, 4.0),
    "polyline": bulged,
    "old polyline": lambda s: s.add_polyline2d([(0, 0, 0.5), (10, 0, -1.5), (10, 10, 0)], format="xyb"),
    "polyline in space": lambda s: s.add_polyline3d([(0, 0, 5), (10, 0, 5), (10, 10, 5)]),
    "spline": spline,
    "rational": lambda s: s.add_rational_spline([(0, 0), (5, 20), (15, 20), (20, 0)], [1, 3, 1, 2]),
}
PLACES = {
    "plain": {},
    "turned": {"rotation": 33, "xscale": 2, "yscale": 2},
    "mirrored": {"xscale": -1, "rotation": 10},
    "squashed": {"xscale": 2, "yscale": 0.7, "rotation": 20},
    "array": {"rotation": 30, "column_count": 3, "column_spacing": 50, "row_count": 2, "row_spacing": 70},
    "from behind": {"extrusion": (0, 0, -1)},
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("stroke", STROKES)
def test_every_stroke_is_where_ezdxf_draws_it(draw, stroke, place):
    def build(document, space):
        block = document.blocks.new("B")
        STROKES[stroke](block)
        space.add_blockref("B", (100, 50), dxfattribs=PLACES[place])

    assert apart(chords_of(read_contours(draw(build))), drawn(build, draw)) <= NEAR


def test_a_spline_through_points_is_the_one_of_ezdxf_and_a_block_scales_the_curve_and_not_the_points(draw):
    points = [(0, 0), (10, 5), (20, -5), (30, 3)]

    def build(document, space):
        document.blocks.new("B").add_spline(points)
        space.add_blockref("B", (0, 0), dxfattribs={"yscale": 2})

    (theirs,) = drawn(lambda d, s: s.add_spline(points), draw)
    assert apart(chords_of(read_contours(draw(build))), [theirs * (1, 2)]) <= NEAR


def test_curves_become_few_arcs(draw):
    part = read_contours(draw(lambda d, s: [spline(s), s.add_ellipse((0, 0), (20, 10), 0.4)]))
    assert all(c.path.n_segments < 50 for c in part.contours)
    assert part.contours[1].path.closed


def test_closed_is_what_the_drawing_closes(draw):
    part = read_contours(draw(lambda d, s: [bulged(s), s.add_circle((90, 0), 3), s.add_arc((0, 99), 3, 0, 90)]))
    assert [c.path.closed for c in part.contours] == [True, True, False]


def test_layers_and_handles_are_kept_and_hidden_layers_left_out(draw):
    def build(document, space):
        document.layers.add("Cut")
        document.layers.add("Off").off()
        space.add_line((0, 0), (1, 0), dxfattribs={"layer": "Cut"})
        space.add_line((0, 0), (2, 0), dxfattribs={"layer": "Off"})
        space.add_line((0, 0), (3, 0), dxfattribs={"layer": "Other"})

    path = draw(build)
    part = read_contours(path)
    assert [(c.layer, c.path.length) for c in part.contours] == [("Cut", 1), ("Other", 3)]
    assert all(c.handle for c in part.contours)
    assert codes(part) == ["L204"]
    assert [c.layer for c in read_contours(path, ReadOptions(layers=("cut",))).contours] == ["Cut"]


def test_units_are_those_of_the_drawing_or_of_the_user(draw):
    path = draw(lambda d, s: s.add_line((0, 0), (10, 0)), units=1)
    assert read_contours(path).contours[0].path.length == 254
    assert read_contours(path, ReadOptions(units="cm")).contours[0].path.length == 100
    unknown = read_contours(draw(lambda d, s: s.add_line((0, 0), (10, 5)), units=0))
    assert codes(unknown) == ["L102"] and "10 × 5 mm" in unknown.issues[0].message


def test_text_and_dimensions_are_said_and_not_cut(draw):
    def build(document, space):
        space.add_line((0, 0), (10, 0))
        space.add_text("abc")
        space.add_hatch().paths.add_polyline_path([(0, 0), (1, 0), (1, 1)])
        space.add_point((3, 3))

    part = read_contours(draw(build))
    assert [c.kind for c in part.contours] == ["cut", *["text"] * 5]
    assert codes(part) == ["L210"]
    assert part.issues[0].message == "the program does not cut 1 HATCH, 1 POINT"


def test_what_leans_out_of_the_plane_is_said(draw):
    def build(document, space):
        space.add_line((0, 0, 0), (10, 0, 8))
        space.add_circle((0, 0), 5, dxfattribs={"extrusion": (1, 0, 0)})

    part = read_contours(draw(build))
    assert [c.path.length for c in part.contours] == [10]
    assert codes(part) == ["L202", "L202"]


LINE = "0\nLINE\n8\nCUT\n10\n0\n20\n0\n11\n{}\n21\n0\n"


@pytest.mark.parametrize(
    "entity",
    [
        LINE.format("nan"),
        LINE.format("1e300"),
        LINE.format("2e6"),
        "0\nLINE\n8\n0\n10\n0\n20\n0\n",
        "0\nARC\n8\n0\n10\n1\n20\n1\n40\n1\n",
        "0\nCIRCLE\n8\n0\n10\n1\n20\n1\n40\n-1\n",
    ],
)
def test_impossible_or_missing_numbers_are_skipped_and_reported(hand_drawn, entity):
    part = read_contours(hand_drawn(LINE.format(5) + entity))
    assert [c.path.length for c in part.contours] == [5]
    assert codes(part) == ["L203"]


def test_a_spline_that_is_none_is_skipped_and_reported(draw):
    def build(document, space):
        space.add_line((0, 0), (5, 0))
        space.add_spline(degree=3)
        few = space.add_spline(degree=3)
        few.control_points, few.knots = [(0, 0), (5, 5), (9, 0)], [0, 0, 0, 0, 1, 1, 1, 1]
        falling = space.add_open_spline([(0, 0), (5, 5), (9, 0), (12, 3)])
        falling.knots = [0, 0, 0, 0, -1, 1, 1, 1]
        steep = space.add_open_spline([(k, k % 2) for k in range(60)], degree=40)
        assert steep.dxf.degree == 40

    part = read_contours(draw(build))
    assert [c.path.length for c in part.contours] == [5]
    assert set(codes(part)) == {"L203"}


def test_a_spline_through_very_many_points_is_skipped_before_its_control_points_are_sought(draw, monkeypatch):
    """They need a full matrix of all points: 20,000 of them were 6 GiB."""
    monkeypatch.setattr(dxf_strokes, "MAX_FIT_POINTS", 10)

    def build(document, space):
        space.add_line((0, 0), (5, 0))
        for count in (10, 11):
            space.add_spline([(k, k % 2) for k in range(count)])

    part = read_contours(draw(build))
    assert len(part.contours) == 2
    assert [issue.message for issue in part.issues if issue.code == "L203"] == [
        "skipped 1 SPLINE: more than 10 fit points and no control points"
    ]


def test_nothing_to_cut_says_what_was_found_instead(draw, hand_drawn):
    with pytest.raises(ReadError, match=r"there is nothing to cut: .*1 TEXT"):
        read_contours(draw(lambda d, s: s.add_text("abc")))
    with pytest.raises(ReadError, match=r"there is nothing to cut: the drawing is empty"):
        read_contours(hand_drawn(""))


def test_a_drawing_far_from_its_zero_is_refused_with_the_distance(draw):
    """A site plan in the coordinates of a country."""
    with pytest.raises(ReadError, match=r"skipped 1 LINE: more than 1 km from the drawing origin: move the drawing"):
        read_contours(draw(lambda d, s: s.add_line((1e7, 0), (1e7, 50))))


@pytest.mark.hazard
def test_a_drawing_that_is_too_small_as_a_whole_is_refused_unless_the_unit_is_given(draw):
    """A bridge in metres, a map in degrees: 0.1 to 1 mm."""

    def build(document, space):
        space.add_line((0, 0), (0.5, 0.2))
        space.add_circle((0, 0), 0.05)
        space.add_circle((0.5, 0.2), 0.05)

    path = draw(build)
    with pytest.raises(
        ReadError,
        match=r"the whole drawing is 0.6 × 0.3 mm, so its unit is probably wrong; .*--units",
    ):
        read_contours(path)
    with pytest.raises(ReadError, match=r"the whole drawing is 0.6 × 0.3 mm"):
        read(path)
    for units in ("mm", "in"):
        assert len(read_contours(path, ReadOptions(units=units)).contours) == 3
        assert len(read(path, ReadOptions(units=units)).holes) == 2


def test_more_lines_than_any_sheet_has_are_refused(hand_drawn, monkeypatch):

    monkeypatch.setattr(dxf_strokes, "MAX_SEGMENTS", 5)
    with pytest.raises(ReadError, match="lines and arcs"):
        read_contours(hand_drawn(LINE.format(5) * 6))


def test_drilling_reads_the_same_drawing_as_holes(draw):
    path = draw(lambda d, s: [s.add_circle((5, 6), 3), s.add_line((0, 0), (9, 9))])
    assert [h.diameter for h in read(path).holes] == [6] and read(path).contours == ()
    assert len(read_contours(path).contours) == 2 and read_contours(path).holes == ()


def test_a_format_without_contours_is_refused_by_name(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("x,y\n1,2\n")
    with pytest.raises(ReadError, match="csv has no contours to cut; use dxf"):
        read_contours(path)


def test_strict_refuses_a_drawing_that_needed_anything_skipped(hand_drawn):
    with pytest.raises(ReadError, match="--strict"):
        read_contours(hand_drawn(LINE.format(5) + LINE.format("nan")), ReadOptions(strict=True))


def test_a_part_of_a_circle_keeps_its_radius(draw):
    (contour,) = read_contours(draw(lambda d, s: s.add_arc((5, 6), 7, 350, 170))).contours
    radii = [s.radius for s in contour.path.segments()]
    assert radii == pytest.approx([7] * len(radii))
    assert contour.path.length == pytest.approx(7 * math.pi)
    assert np.abs(contour.path.bulges).max() <= 1.0


def test_a_contour_has_the_height_at_which_it_is_drawn_and_its_block_is_inserted(draw):
    """In a block at Z0.5 that is inserted at Z2, a line at Z1 is at 3.5; a rising line has height 0 and is reported."""

    def build(document, space):
        block = document.blocks.new("B", base_point=(0, 0, -0.5))
        block.add_line((0, 0, 1), (5, 0, 1))
        space.add_line((0, 9, -4), (5, 9, -4))
        space.add_lwpolyline([(0, 5), (5, 5), (5, 7)], dxfattribs={"elevation": 1.25})
        space.add_blockref("B", (1, 1, 2))
        space.add_line((0, 20, 1), (5, 20, 2))

    part = read_contours(draw(build))
    assert sorted((c.path.start[1], c.z) for c in part.contours) == [(1, 3.5), (5, 1.25), (9, -4), (20, 0)]


def test_lines_of_a_block_at_the_origin_are_those_drawn_in_model_space(draw) -> None:
    def lines(space) -> None:
        space.add_line((1, -0.0, 3), (30, 4, 3))
        space.add_line((0, 0, 0), (10, 0, 5))
        space.add_lwpolyline([(0, 0, 0), (5, 0, 0), (5, 5, 0.3)], format="xyb")

    def inserted(document, space) -> None:
        lines(document.blocks.new("B"))
        space.add_blockref("B", (0, 0))

    plain, block = (read_contours(draw(build)) for build in (lambda _, space: lines(space), inserted))
    for one, other in zip(plain.contours, block.contours, strict=True):
        assert one.path.vertices.tobytes() == other.path.vertices.tobytes() and one.z == other.z
        assert one.path.extents == other.path.extents
    assert codes(plain) == codes(block)
