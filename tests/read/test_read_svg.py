"""SVG as contours: shapes, transforms, units, uses, layers, and what strangers may put into a file."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
import shapely

from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import read, read_contours, svg
from leafcut.read.format import expansion_budget

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
INKSCAPE = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '


@pytest.fixture
def draw(text_file):
    """Return a function that writes an SVG of 100 × 50 mm, one user unit a mm."""

    def write(body, attributes='width="100mm" height="50mm" viewBox="0 0 100 50"'):
        return text_file("drawing.svg", f"{HEAD}{INKSCAPE}{attributes}>{body}</svg>")

    return write


def codes(part) -> list[str]:
    return sorted(issue.code for issue in part.issues)


def only(path, **options):
    (contour,) = read_contours(path, ReadOptions(**options)).contours
    return contour


def test_y_points_up_and_the_drawing_is_not_mirrored(draw):
    path = only(draw('<polygon points="0,0 10,0 0 20"/>')).path
    assert [tuple(v[:2]) for v in path.vertices] == [(0, 50), (10, 50), (0, 30)]
    assert path.closed


@pytest.mark.parametrize(
    "body, length, area",
    [
        ('<line x1="1" y1="2" x2="4" y2="6"/>', 5, 0),
        ('<rect x="5" y="5" width="20" height="10"/>', 60, 200),
        ('<rect width="20" height="10" rx="2"/>', 44 + 4 * math.pi, 200 - 16 + 4 * math.pi),
        ('<circle cx="20" cy="20" r="5"/>', 10 * math.pi, 25 * math.pi),
        ('<polyline points="0 0,3 4 3,14"/>', 15, 0),
        ('<path d="M0 0h10v5H0z"/>', 30, 50),
        ('<path d="m10 10 a5 5 0 0 1 10 0 z"/>', 10 + 5 * math.pi, 12.5 * math.pi),
        ('<path d="M0,0 a10,10 0 1 0 10,10"/>', 15 * math.pi, 0),
        ('<path d="M0 0 10 0 10 10 0 0z"/>', 20 + 10 * math.sqrt(2), 50),
        ('<rect width="10%" height="10%"/>', 30, 50),
        ('<rect width="1in" height="10" transform="translate(2,3)"/>', 2 * (96 + 10), 960),
    ],
)
def test_shapes_have_the_length_and_area_of_the_hand_calculation(draw, body, length, area):
    path = only(draw(body)).path
    assert path.length == pytest.approx(length, abs=1e-6)
    assert abs(path.area) == pytest.approx(area, abs=1e-6)


def test_ellipses_and_bezier_curves_are_arcs_within_the_tolerance(draw):
    ellipse = only(draw('<ellipse cx="50" cy="25" rx="40" ry="15"/>')).path
    t = np.linspace(0, math.tau, 500)
    exact = shapely.points(50 + 40 * np.cos(t), 25 + 15 * np.sin(t))
    assert shapely.distance(shapely.LineString(ellipse.flattened(0.0005)), exact).max() <= 0.011
    curve = only(draw('<path d="M0 0 C 0 20 40 20 40 0 S 80 -20 80 0 Q 90 20 95 10"/>')).path
    t = np.linspace(0, 1, 300)[:, None]
    control = np.array([(0, 50), (0, 30), (40, 30), (40, 50)])
    cubic = (1 - t) ** 3 * control[0] + 3 * t * (1 - t) ** 2 * control[1] + 3 * t**2 * (1 - t) * control[2]
    cubic = cubic + t**3 * control[3]
    assert shapely.distance(shapely.LineString(curve.flattened(0.0005)), shapely.points(cubic)).max() <= 0.011
    assert curve.end == pytest.approx((95, 40))
    assert curve.n_segments < 60


def test_transforms_are_applied_from_the_inside_out(draw):
    group = '<g transform="translate(10 20) rotate(90)"><line x2="5" transform="scale(2)"/></g>'
    path = only(draw(group)).path
    assert path.start == pytest.approx((10, 30)) and path.end == pytest.approx((10, 20))
    turned = only(draw('<line x1="10" y1="10" x2="20" y2="10" transform="rotate(180 10 10) skewX(0)"/>')).path
    assert turned.end == pytest.approx((0, 40))
    matrix = only(draw('<line x2="1" y2="1" transform="matrix(1,0,0,2,3,4)"/>')).path
    assert matrix.end == pytest.approx((4, 44))


def test_a_mirrored_circle_stays_round_and_a_squashed_one_is_an_ellipse(draw):
    # On the screen a circle runs clockwise; y points up here, and a mirror turns it round again.
    assert only(draw('<circle r="5" transform="scale(-1,1)"/>')).path.area == pytest.approx(25 * math.pi)
    assert only(draw('<circle r="5" transform="scale(2,1)"/>')).path.area == pytest.approx(-50 * math.pi, abs=0.2)


def test_the_size_of_the_page_decides_the_scale(draw):
    body = '<line x2="96"/>'
    assert only(draw(body, 'width="10in" height="5in" viewBox="0 0 960 480"')).path.length == pytest.approx(25.4)
    assert only(draw(body, 'width="10cm" height="10cm" viewBox="0 0 200 100"')).path.length == pytest.approx(48)
    pixels = read_contours(draw(body, 'width="960" height="480"'))
    assert pixels.contours[0].path.length == pytest.approx(25.4)
    assert codes(pixels) == ["L102"]
    assert only(draw(body, 'width="960" height="480"'), units="mm").path.length == pytest.approx(96)
    assert only(draw(body, 'viewBox="0 0 960 480"'), units="in").path.length == pytest.approx(96 * 25.4)


def test_a_use_draws_what_it_names_where_it_says(draw):
    body = """<defs><circle id="c" r="1"/><g id="two"><use href="#c"/><use xlink:href="#c" x="10"/></g></defs>
        <symbol id="s" viewBox="0 0 2 2"><rect width="2" height="2"/></symbol>
        <use href="#two" y="20"/><use href="#s" x="50" width="20" height="20"/>"""
    part = read_contours(draw(body))
    assert [c.path.extents for c in part.contours] == [
        pytest.approx((-1, 29, 1, 31)),
        pytest.approx((9, 29, 11, 31)),
        pytest.approx((50, 30, 70, 50)),
    ]


def test_a_nested_drawing_has_its_own_corner_and_view_box(draw):
    """A box of 4 × 2 in a place of 20 × 20 at 10, 5: `none` scales by 5 and 10, `meet` by 5, `slice` by 10."""
    nested = '<svg x="10" y="5" width="20" height="20" viewBox="1 1 4 2"{}><path d="M1 1H5V3H1z"/></svg>'
    extents = {
        ' preserveAspectRatio="none"': (10, 25, 30, 45),
        "": (10, 30, 30, 40),
        ' preserveAspectRatio="xMinYMin"': (10, 35, 30, 45),
        ' preserveAspectRatio="xMidYMax meet"': (10, 25, 30, 35),
        ' preserveAspectRatio="xMinYMid slice"': (10, 25, 50, 45),
        ' preserveAspectRatio="xMaxYMid slice"': (-10, 25, 30, 45),
    }
    for words, expected in extents.items():
        assert only(draw(nested.format(words))).path.extents == pytest.approx(expected), words
    plain = only(draw('<svg x="25%" y="20%"><rect width="4" height="2"/></svg>')).path
    assert plain.extents == pytest.approx((25, 38, 29, 40))


def test_shapes_without_size_draw_nothing_and_moves_begin_new_contours(draw):
    part = read_contours(draw('<rect width="0" height="5"/><rect width="4" height="0"/><path d="M0 0h3M9 9h5v1z"/>'))
    assert [(c.path.length, c.path.closed) for c in part.contours] == [
        (3, False),
        (pytest.approx(6 + math.sqrt(26)), True),
    ]


def test_the_layer_is_the_inkscape_layer_else_the_class_else_the_colour(draw):
    body = """<style>.engrave { stroke: blue } /* .gone{display:none} */ .gone { display:none }</style>
        <g inkscape:groupmode="layer" inkscape:label="Outer cut"><line x2="1" class="x"/></g>
        <g class="engrave"><line x2="2"/></g><line x2="3" stroke="red"/><line x2="4" style="stroke:#0f0"/>
        <line x2="5"/><line x2="6" class="gone"/>"""
    path = draw(body)
    part = read_contours(path)
    assert [(c.layer, c.path.length) for c in part.contours] == [
        ("Outer cut", 1),
        ("engrave", 2),
        ("red", 3),
        ("#0f0", 4),
        ("", 5),
    ]
    assert codes(part) == ["L204"]
    assert [c.path.length for c in read_contours(path, ReadOptions(layers=("outer*", "red"))).contours] == [1, 3]


def test_text_and_pictures_are_said_and_not_cut(draw):
    part = read_contours(draw('<line x2="1"/><text>abc</text><image href="file:///etc/passwd"/>'))
    assert len(part.contours) == 1
    assert codes(part) == ["L210"]


def test_a_clipped_shape_is_cut_whole_and_said(draw):
    body = '<clipPath id="k"><rect width="1" height="1"/></clipPath><circle r="5" clip-path="url(#k)"/>'
    part = read_contours(draw(body))
    assert len(part.contours) == 1 and codes(part) == ["L215"]


def test_what_is_not_shown_is_left_out(draw):
    body = '<g style="display:none"><circle r="9"/></g><circle r="8" visibility="hidden"/><line x2="1"/>'
    part = read_contours(draw(body))
    assert [c.path.length for c in part.contours] == [1] and codes(part) == ["L204"]


@pytest.mark.parametrize(
    "element",
    [
        '<path d="M0 0 L5"/>',
        '<path d="M0 0 L"/>',
        '<path d="M0 0 L5 5 foo"/>',
        '<path d="L5 5"/>',
        '<path d="M0 0 L1e400 0"/>',
        '<path d="M0 0 L1e9 0"/>',
        '<polygon points="1 2 3"/>',
        '<circle r="5em"/>',
        '<line x2="9" transform="turn(9)"/>',
        '<line x2="9" transform="rotate(1,2)"/>',
        '<line x2="9" transform="scale(nan)"/>',
    ],
)
def test_numbers_that_cannot_be_understood_are_skipped_and_reported(draw, element):
    part = read_contours(draw(f'<line x2="1"/>{element}'))
    assert "Error" not in part.issues[0].message
    assert [c.path.length for c in part.contours] == [1]
    assert codes(part) == ["L203"]


@pytest.mark.parametrize(
    "text, words",
    [
        ("<svg", "not well-formed"),
        ("<html/>", "this is not an SVG drawing: its root is <html>"),
        (f'{HEAD} viewBox="0 0 5"><line x2="1"/></svg>', "size of the drawing.*a view box needs four numbers"),
        (f"{HEAD}/>", "there is nothing to cut: the drawing is empty"),
        (f'{HEAD} width="5em"/>', "size of the drawing"),
        (f'{HEAD} viewBox="0 0 0 0"/>', "size of the drawing"),
        (f'<!DOCTYPE svg [<!ENTITY a "b">]>{HEAD}/>', "refused: the file has an entity declaration"),
        (f'<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/passwd">]>{HEAD}>&a;</svg>', "refused"),
    ],
)
def test_what_is_no_drawing_is_refused_in_one_line(text_file, text, words):
    with pytest.raises(ReadError, match=words) as caught:
        read_contours(text_file("bad.svg", text))
    assert "\n" not in str(caught.value)


def test_uses_of_other_files_or_of_themselves_are_reported_and_not_followed(draw):
    body = '<line x2="1"/><use href="other.svg#a"/><g id="me"><use href="#me"/></g><use href="#nobody"/>'
    part = read_contours(draw(body))
    assert len(part.contours) == 1
    assert set(codes(part)) == {"L206"}
    assert sum(issue.missing.count for issue in part.issues) == 3


def test_uses_that_multiply_are_refused(draw, monkeypatch):
    monkeypatch.setattr("leafcut.read.svg.expansion_budget", functools.partial(expansion_budget, free=5000))
    levels = "".join(f'<g id="l{k}"><use href="#l{k + 1}"/><use href="#l{k + 1}"/></g>' for k in range(30))
    body = f'<defs>{levels}<circle id="l30" r="1"/></defs><use href="#l0"/>'
    with pytest.raises(ReadError, match=r"expand to more than [5-9],"):
        read_contours(draw(body))


def test_groups_nested_without_end_are_refused(draw):
    with pytest.raises(ReadError, match="deep"):
        read_contours(draw("<g>" * 5000 + '<line x2="1"/>' + "</g>" * 5000))


def test_hostile_numbers_and_styles_do_not_stall_the_reader(draw):
    """What would make an expression turn back again and again: read in a moment."""
    body = f'<style>{"a" * 200_000}{"/*" * 100_000}</style><polygon points="{"11 " * 40_000}x"/>'
    body += f'<line x2="1" transform="{" " * 200_000}(" /><line x2="2"/>'
    assert [c.path.length for c in read_contours(draw(body)).contours] == [2]


def test_for_drilling_an_svg_is_refused_with_its_reason(draw):
    with pytest.raises(ReadError, match="for cutting from sheet and for pockets only"):
        read(draw('<circle r="1"/>'))


@pytest.mark.parametrize("data", ["M0 0L1 1", "M0 0?"])
def test_an_element_that_is_used_many_times_is_read_once(draw, data, monkeypatch):
    """A drawing of some kilobytes would take hours: each copy would read the same long texts again."""
    calls = []

    def counted(module, name):
        of_svg = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *arguments: calls.append(name) or of_svg(*arguments))

    for module, name in ((svg, "shape_subpaths"), (svg, "parse_transform"), (svg._Walk, "_resolve_style")):
        counted(module, name)
    uses = ['<use href="#a"/>' * 50, '<use href="#b"/>' * 50]
    body = f'<defs><path id="a" d="{data}" transform="scale(1)"/><g id="b">{uses[0]}</g></defs>{uses[1]}<line x2="9"/>'
    part = read_contours(draw(body))
    assert len(part.contours) == (1 if "?" in data else 2501)
    # The line, the path, and once each element: 100 uses, path, group, definitions, line.
    assert (calls.count("shape_subpaths"), calls.count("parse_transform"), calls.count("_resolve_style")) == (2, 1, 103)


def test_pieces_without_length_count_as_segments(draw, monkeypatch):
    """Nothing else ends a drawing of copies of a curve whose points are all the same."""
    monkeypatch.setattr(svg, "MAX_SEGMENTS", 1000)
    curves, uses = "C0 0 0 0 0 0 " * 100, '<use href="#a"/>' * 20
    with pytest.raises(ReadError, match="more than 1,000,000 lines and arcs"):
        read_contours(draw(f'<defs><path id="a" d="M0 0{curves}L1 1"/></defs>{uses}'))


def test_only_rules_that_matter_are_kept_for_each_class(draw):
    rules = "".join(f"p{k}:1;" for k in range(200))
    path = draw(f'<style>.a{{{rules}stroke:red}}</style><rect class="a" width="5" height="5"/>')
    walk = svg._Walk("a", None, None, None, None, None)
    walk.index_elements(svg._parse_root(svg.Source(str(path), path.read_bytes())))
    assert walk._rules == {"a": {"stroke": "red"}}


@pytest.mark.parametrize("body", ['<rect width="{}" height="5"/>', '<svg viewBox="0 0 5 {}"><line x2="5"/></svg>'])
def test_a_length_of_very_many_digits_is_none(draw, body):
    part = read_contours(draw(f'<line x2="9"/>{body.format("0" * 300 + "5")}'))
    assert [issue.code for issue in part.issues] == ["L203"]
