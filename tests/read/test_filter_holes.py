"""Doubled holes and circles with one centre, against brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.model.contour import layer_filter
from leafcut.model.part import Hole
from leafcut.options import ReadOptions
from leafcut.read.dxf_shapes import bulge_arc
from leafcut.read.filter_holes import MERGE_TOLERANCE, ArcPiece, anchors_of_points, join_arcs_to_circles, select_holes


def brute(points, tolerance):
    """Return the first earlier anchor within the tolerance of every point, by trying all."""
    found = []
    for i, (x, y, w) in enumerate(points):
        near = [
            j
            for j in range(i)
            if found[j] == j
            and math.hypot(x - points[j][0], y - points[j][1]) <= tolerance
            and abs(w - points[j][2]) <= tolerance
        ]
        found.append(near[0] if near else i)
    return found


#: Numbers around the borders of a grid of 0.01 mm.
near_borders = st.integers(-6, 6).map(lambda i: i * 0.005) | st.floats(-0.03, 0.03)


@settings(max_examples=settings().max_examples * 5)
@given(st.lists(st.tuples(near_borders, near_borders, near_borders), max_size=25), st.sampled_from([0.0, 0.004, 0.01]))
def test_anchors_are_those_of_brute_force_whatever_the_cells(points, tolerance):
    assert anchors_of_points(np.array(points).reshape(-1, 3), tolerance) == brute(points, tolerance)


@pytest.mark.parametrize("shift", [0.0, 0.0025, 0.005, 0.00999, -0.005, 123456.789])
def test_merging_does_not_depend_on_where_the_grid_lies(shift):
    holes = [Hole(shift, shift, 5), Hole(shift + 0.0099, shift, 5), Hole(shift + 0.0102, shift, 5)]
    kept, issues = select_holes(holes, ReadOptions())
    assert kept == (holes[0], holes[2])
    assert [i.code for i in issues] == ["L301"]


@settings(max_examples=settings().max_examples * 5)
@given(
    st.lists(st.tuples(near_borders, near_borders, st.sampled_from([0.0, 1.0, 1.005, 2.0])), min_size=1, max_size=20),
    st.sampled_from(["smallest", "largest", "all"]),
)
def test_what_is_kept_is_a_part_of_the_drawing_in_its_order_without_doubles(rows, rule):
    holes = [Hole(x, y, d, handle=str(i)) for i, (x, y, d) in enumerate(rows)]
    options = ReadOptions(concentric=rule)
    kept, _ = select_holes(holes, options)
    numbers = [int(h.handle) for h in kept]
    assert kept
    assert numbers == sorted(set(numbers))
    for i, a in enumerate(kept):
        for b in kept[:i]:
            # A distance that rounds to the tolerance may count as either.
            near = math.hypot(a.x - b.x, a.y - b.y) <= MERGE_TOLERANCE * (1.0 - 1e-9)
            same = abs(a.diameter - b.diameter) <= MERGE_TOLERANCE
            assert not (near and (same or rule != "all"))


def test_a_point_near_to_the_circle_that_stays_is_its_centre_mark_also_where_another_circle_went():
    holes = [Hole(0.0, 0.0, 2.0), Hole(0.005, 0.0, 1.0), Hole(0.0117, 0.0, 0.0)]
    kept, issues = select_holes(holes, ReadOptions(concentric="smallest"))
    assert kept == (holes[1],)
    assert [i.code for i in issues] == ["L302", "L302"]


def test_layer_patterns_know_wildcards_and_no_other_magic():
    choose = layer_filter(("HOLES*", "t?", "[x]"))
    assert [choose(n) for n in ("holes_6", "T1", "T12", "x")] == [True, True, False, True]
    assert layer_filter(())("anything")


@settings(max_examples=settings().max_examples * 5)
@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(0.05, 5), st.booleans())
def test_a_bulged_segment_is_an_arc_through_both_ends_that_rises_by_bulge_times_half_the_chord(dx, dy, size, clockwise):
    """The definition of bulge: sagitta over half chord."""
    chord = math.hypot(dx, dy)
    if chord < 1e-3:
        return
    bulge = -size if clockwise else size
    x, y, radius, start, sweep = bulge_arc(1, 2, 1 + dx, 2 + dy, bulge)
    ends = [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in (start, start + sweep)]
    expected = [(1, 2), (1 + dx, 2 + dy)]
    if clockwise:
        expected.reverse()
    assert np.allclose(ends, expected, atol=1e-6 * (1 + radius))
    assert radius * (1 - math.cos(sweep / 2)) == pytest.approx(size * chord / 2, rel=1e-6)


@settings(max_examples=settings().max_examples * 5)
@given(
    st.lists(st.floats(0, 360), min_size=1, max_size=6, unique=True),
    st.floats(-360, 360),
    st.randoms(use_true_random=False),
)
def test_pieces_that_cut_a_circle_anywhere_close_it_and_one_less_does_not(cuts, turn, draw):
    cuts = sorted({round(math.radians(c), 2) % math.tau for c in cuts})
    spans = [(a, (b - a) % math.tau or math.tau) for a, b in zip(cuts, cuts[1:] + cuts[:1], strict=True)]
    pieces = [ArcPiece(3, 4, 5, a + math.radians(turn), sweep, i) for i, (a, sweep) in enumerate(spans)]
    draw.shuffle(pieces)
    circles, used = join_arcs_to_circles(pieces)
    assert circles == pieces[:1]
    assert used == {p.entity for p in pieces}
    if min(p.sweep for p in pieces) > 0.01:
        assert join_arcs_to_circles(pieces[1:]) == ([], set())


@pytest.mark.parametrize(("rule", "diameter"), [("smallest", 4), ("largest", 8)])
def test_of_circles_at_different_heights_the_hole_starts_at_the_highest(rule, diameter):
    """To start at its own height would be a rapid into the material above it."""
    kept, issues = select_holes(
        [Hole(0, 0, 4, z=-2), Hole(0, 0, 8, z=1), Hole(9, 9, 5, z=-3)], ReadOptions(concentric=rule)
    )
    assert [(h.diameter, h.z) for h in kept] == [(diameter, 1), (5, -3)]
    assert [i.code for i in issues] == (["L406", "L302"] if rule == "smallest" else ["L302"])
    if rule == "smallest":
        assert "starts at the highest" in str(issues[0]) and "0" in issues[0].place
