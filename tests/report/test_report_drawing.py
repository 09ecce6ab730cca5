"""Drawings of paths."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.part import Slot
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.registry import report_of
from leafcut.report.drawing import MAX_NUMBERS, build_scene, tool_css_class, toolpath_svg
from leafcut.report.frame import Frame
from leafcut.report.labels import Surroundings, label_positions
from leafcut.report.page import path_svg
from leafcut.report.svg import STEPS, dots_path_data, segments_path_data, tick_label, ticks

NUMBER = re.compile(r"-?\d+")


def dots_of(data: str) -> list[tuple[float, float]]:
    """Return the dots of path data as a browser reads it: relative moves, each with a line of no length."""
    x = y = 0
    found = []
    for move in data.split("m")[1:]:
        assert move.endswith("h0")
        dx, dy = (int(n) for n in NUMBER.findall(move.removesuffix("h0")))
        x, y = x + dx, y + dy
        found.append((x / STEPS, y / STEPS))
    return found


def lines_of(data: str) -> list[list[tuple[float, float]]]:
    """Return the corners of each line of path data as a browser reads it."""
    lines = []
    for line in data.split("M")[1:]:
        start, _, rest = line.partition("l")
        numbers = [int(n) for n in NUMBER.findall(start) + NUMBER.findall(rest)]
        steps = np.cumsum(np.array(numbers).reshape(-1, 2), axis=0)
        lines.append([(x / STEPS, y / STEPS) for x, y in steps.tolist()])
    return lines


def paths(svg: str, word: str) -> list[str]:
    """Return the data of all path elements that have the class `word`, or whose group has it."""
    found = []

    def walk(element, inside):
        classes = element.get("class", "").split()
        inside = inside or word in classes
        if inside and element.tag.endswith("path"):
            found.append(element.get("d"))
        for child in element:
            walk(child, inside)

    walk(ET.fromstring(svg), False)
    return found


def test_every_hole_is_drawn_once_at_its_place(every_outcome):
    for name, outcome in every_outcome.items():
        frame = build_scene(outcome).frame
        dots = [d for data in paths(path_svg(report_of(outcome), "after"), "hole") for d in dots_of(data)]
        seen = np.array([(x / frame.scale + frame.low[0], frame.high[1] - y / frame.scale) for x, y in dots])
        assert len(seen) == len(outcome.part.holes), name
        if len(seen):
            apart = np.hypot(*(seen[:, None] - outcome.part.hole_xy[None]).transpose(2, 0, 1))
            assert len(set(apart.argmin(axis=0))) == len(seen), name
            assert apart.min(axis=0).max() < 1.0 / STEPS / frame.scale, name


@pytest.mark.parametrize("which", ["before", "after"])
def test_the_path_goes_from_hole_to_hole_in_the_order_of_the_toolpath(outcome_of, which):
    points = [(10.0, 10.0), (200.0, 30.0), (40.0, 150.0)]
    outcome = outcome_of(points)
    frame = build_scene(outcome).frame
    (line,) = lines_of(paths(path_svg(report_of(outcome), which), "rapid")[0])
    corners = [(x / frame.scale + frame.low[0], frame.high[1] - y / frame.scale) for x, y in line]
    order = points if which == "before" else points[::-1]
    assert np.allclose(corners, [(0.0, 0.0), *order], atol=1.0 / STEPS / frame.scale)


def test_y_points_up_and_a_millimetre_is_as_long_in_x_as_in_y():
    frame = Frame.around_corners((0.0, 0.0), (100.0, 50.0))
    (x0, y0), (x1, y1), (x2, y2) = frame.to_user_units(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])).tolist()
    assert y2 < y0 == y1
    assert x0 == x2 < x1
    assert np.isclose(x1 - x0, y0 - y2)


def test_holes_are_drawn_to_scale(outcome_of):
    """A hole of 20 mm, 100 mm from a hole of 2 mm, is drawn a fifth as wide as their distance."""
    tenth = [(0.0, 0.0)]
    outcome = outcome_of([(100.0, 0.0)], *[[] for _ in range(8)], tenth)
    scene = build_scene(outcome)
    large = max(scene.dots, key=lambda d: d.size)
    apart = abs(large.points[0, 0] - min(scene.dots, key=lambda d: d.size).points[0, 0])
    assert large.size == pytest.approx(0.2 * apart)


def texts(svg: str) -> list[str]:
    return [e.text or "" for e in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]


def numbers_of(svg: str) -> list[str]:
    root = ET.fromstring(svg)
    groups = [g for g in root.iter() if g.get("class") == "number"]
    return [t.text or "" for g in groups for t in g]


def test_few_stops_are_numbered_from_one_in_order(outcome_of):
    points = [(20.0 * (i % 10), 20.0 * (i // 10)) for i in range(MAX_NUMBERS)]
    numbers = numbers_of(path_svg(report_of(outcome_of(points)), "after"))
    assert sorted(map(int, numbers)) == list(range(1, MAX_NUMBERS + 1))


def test_many_stops_have_a_ramp_and_a_start_and_an_end_instead(outcome_of):
    points = [(20.0 * (i % 10), 20.0 * (i // 10)) for i in range(MAX_NUMBERS + 1)]
    svg = path_svg(report_of(outcome_of(points)), "after")
    assert numbers_of(svg) == []
    assert {"start", "end"} <= set(texts(svg))
    assert len(paths(svg, "r0")) == len(paths(svg, "r23")) == 1


def test_a_hole_that_two_tools_visit_carries_both_numbers(outcome_of):
    outcome = outcome_of([(0.0, 0.0), (50.0, 50.0)], [(0.0, 0.0)])
    assert sorted(numbers_of(path_svg(report_of(outcome), "before"))) == ["1/3", "2"]


def test_tools_have_colours_of_their_own_and_one_tool_has_none(outcome_of):
    """A slot has its rim, its inside and the cut along it in its tool's colour."""
    several = path_svg(report_of(outcome_of([(0, 0)], [(20, 0)], slots=[Slot((0, 9), (20, 9), 3.0)])), "after")
    assert [len(paths(several, c)) for c in ("t0", "t1", "t2")] == [1, 1, 3]
    assert paths(path_svg(report_of(outcome_of([(0, 0)])), "after"), "t0") == []


def test_more_tools_than_colours_differ_in_manner(outcome_of):
    groups = [[(20.0 * k, 0.0)] for k in range(20)]
    scene = build_scene(outcome_of(*groups))
    classes = [tool_css_class(scene, k) for k in range(20)]
    assert len(set(classes)) == 20
    assert (classes[3], classes[11]) == ("t3", "t3 again1")


def path_to(x, y):
    """Return a toolpath that cuts a line of 100 mm and parks the tool at a place."""
    path = ToolpathBuilder()
    path.rapid(0.0, 0.0, 5.0)
    path.feed(z=-1.0, feed=2.0)
    path.feed(100.0, 40.0, feed=5.0)
    path.rapid(z=5.0)
    path.rapid(x, y)
    return path.build()


def test_who_parks_far_away_does_not_make_the_part_small(outcome_of):
    far, near = (outcome_of(path_before=p, path_after=p) for p in (path_to(-5000.0, 0.0), path_to(-20.0, 0.0)))
    scene = build_scene(far)
    assert scene.extent == pytest.approx((100.0, 40.0))
    assert scene.frame.low[0] > -100.0
    assert scene.frame.low[0] < build_scene(near).frame.low[0] < -20.0
    assert 'clip-path="url(#window-after)"' in path_svg(report_of(far), "after")


def test_the_last_number_of_an_axis_stays_in_the_drawing():
    frame = Frame.around_corners((0.0, 0.0), (96.2, 96.2))
    for x, words in re.findall(r'<text x="([0-9.]+)"[^>]*text-anchor="middle"[^>]*>([0-9]+)</text>', frame.axes_svg()):
        assert float(x) + 3.5 * len(words) <= frame.size[0]


def test_a_slot_is_cut_and_its_shape_is_shown(outcome_of):
    outcome = outcome_of(slots=[Slot((0.0, 0.0), (20.0, 10.0), 3.0)])
    svg = path_svg(report_of(outcome), "after")
    (cut,), (shape,) = (lines_of(paths(svg, word)[0]) for word in ("cut", "slot"))
    assert cut == shape


def test_hostile_names_leave_the_drawing_well_formed(outcome_of):
    outcome = outcome_of([(0.0, 0.0)], part={"name": "</title><script>alert(1)</script>&\x00\x1b\udcff\"'"})
    root = ET.fromstring(path_svg(report_of(outcome), "after"))
    assert not [e for e in root.iter() if "script" in e.tag]


def test_a_hundred_thousand_holes_fit_in_fifteen_megabytes(outcome_of):
    """Measured on a tenth of them: 1.5 MB for a page would be the limit, and a drawing is less than half a page."""
    points = [tuple(p) for p in np.random.default_rng(1).uniform(0, 600, (10_000, 2)).tolist()]
    scene = build_scene(outcome_of(points))
    assert (
        len(toolpath_svg(scene, "before", "", holes="=holes")) + len(toolpath_svg(scene, "after", "", holes="#holes"))
        < 1.4e6
    )


def test_diameters_of_every_size_do_not_make_a_path_each(outcome_of):
    rng = np.random.default_rng(2)
    groups = [[tuple(p)] for p in rng.uniform(0, 300, (100, 2)).tolist()]
    outcome = outcome_of(*groups)
    shapes = [d.size for d in build_scene(outcome).dots]
    assert sum(len(d.points) for d in build_scene(outcome).dots) == 100
    assert shapes == sorted(shapes, reverse=True)


@given(
    st.lists(st.tuples(*[st.floats(-500, 500) for _ in range(2)]), max_size=20).map(
        lambda p: np.array(p, dtype=np.float64).reshape(-1, 2)
    )
)
def test_path_data_says_the_points_it_was_given(points):
    assert np.allclose(np.array(dots_of(dots_path_data(points))).reshape(-1, 2), points, atol=0.51 / STEPS)
    segments = np.stack([points[:-1], points[1:]], axis=1) if len(points) > 1 else np.zeros((0, 2, 2))
    lines = lines_of(segments_path_data(segments))
    assert len(lines) == (1 if len(segments) else 0)
    if lines:
        assert np.allclose(lines[0], points, atol=0.51 / STEPS)


def test_numbers_never_cover_each_other():
    rng = np.random.default_rng(5)
    stops = np.column_stack([rng.uniform(0, 400, (110, 2)), np.full((110, 2), 3.0)])
    words = [str(i + 1) for i in range(110)]
    spots = label_positions(stops, words, 9.0, Surroundings(stops[:, :3], np.zeros((0, 2, 2)), (400.0, 400.0)))
    placed = [(s, w) for s, w in zip(spots, words, strict=True) if s]
    boxes = [(x, y, 0.56 * 9 * len(w) / 2, 0.72 * 9 / 2) for (x, y), w in placed]
    overlaps = [
        (p, q)
        for i, p in enumerate(boxes)
        for q in boxes[:i]
        if abs(p[0] - q[0]) < p[2] + q[2] and abs(p[1] - q[1]) < p[3] + q[3]
    ]
    assert overlaps == []
    assert len(placed) > 100


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_axes_have_a_readable_number_of_round_ticks(low, span):
    frame = Frame.around_corners((low, low), (low + span, low + span))
    numbers = [t for t in re.findall(r">([^<>]+)</text>", frame.axes_svg()) if t[0] in "0123456789−" and "mm" not in t]
    assert 6 <= len(numbers) <= 24
    assert max(Counter(numbers).values()) <= 2


def test_ticks_are_multiples_of_their_step():
    assert ticks(-0.3, 1.1, 0.5) == [0.0, 0.5, 1.0]
    assert [tick_label(v, 0.05) for v in (0.0, 0.05, -0.1)] == ["0", "0.05", "−0.10"]
    assert [tick_label(v, 20.0) for v in (0.0, 1200.0)] == ["0", "1200"]


def test_holes_of_which_nothing_says_how_wide_they_are_are_drawn_to_be_seen(outcome_of):
    """Only the positions are known for holes of a program: a few are drawn larger than many, without a note."""
    sizes = []
    for n in (4, 30):
        outcome = outcome_of([(20.0 * (i % n), 20.0 * (i // n)) for i in range(n * n)])
        holes = tuple(replace(h, diameter=0.0) for h in outcome.part.holes)
        tools = tuple(replace(o, tool=replace(o.tool, diameter=0.0)) for o in outcome.operations)
        scene = build_scene(replace(outcome, part=replace(outcome.part, holes=holes), operations=tools))
        assert scene.unsized
        assert not scene.enlarged
        sizes.append(scene.dots[0].size)
    assert 5.0 == sizes[0] > sizes[1] > 2.0


def test_heads_of_arrows_do_not_stand_upon_each_other(outcome_of):
    there_and_back = [(100.0 * (i % 2), 0.02 * i) for i in range(300)]
    (heads,) = paths(path_svg(report_of(outcome_of(there_and_back)), "after"), "arrow")
    assert 1 <= heads.count("M") < 4
