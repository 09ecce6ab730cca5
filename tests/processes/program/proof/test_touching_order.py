"""Order: touching cuts and closed cuts, against the same asked of every pair with finely divided lines."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from leafcut.model.toolpath import Arc, Kind, Toolpath, ToolpathBuilder, arc_radius_start_sweep, plane_axes
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.order_rules import touching_in_new_order
from leafcut.processes.program.proof.order_thresholds import FREE
from leafcut.processes.program.proof.outlines import lines_starting_inside, outlines_of, task_lines
from leafcut.processes.program.proof.traces import traces_of
from rewriting import features_in

TOUCH = 0.05
PARTS = 151


def scribble(seed: int, n: int = 60, size: float = 20.0) -> Toolpath:
    """Return a path of lines, arcs, full circles, helices and spirals in all planes, and holes, anywhere."""
    rng, builder = np.random.default_rng(seed), ToolpathBuilder()
    for _ in range(n):
        x, y, z = rng.uniform(0, size, 3).tolist()
        builder.rapid(x, y, z)
        what = rng.integers(6)
        if what < 2:
            dx, dy = rng.normal(0, 4, 2).tolist()
            builder.feed(x + dx, y + dy, z, feed=1.0)
        elif what == 2:
            builder.feed(z=z - 1, feed=1.0)
        else:
            plane = int(rng.choice([17, 17, 18, 19]))
            first, second, normal = plane_axes(plane)
            radius, start = float(rng.uniform(0.5, 6)), float(rng.uniform(0, math.tau))
            sweep = float(rng.choice([math.tau, rng.uniform(0.1, 6)]))
            clockwise = bool(rng.integers(2))
            stop = start - sweep if clockwise else start + sweep
            center, end = [x, y, z], [x, y, z]
            for axis, turn in ((first, math.cos), (second, math.sin)):
                center[axis] -= radius * turn(start)
                end[axis] = center[axis] + radius * turn(stop)
            end[normal] += float(rng.choice([0.0, 2.0]))
            arc = Arc((center[0], center[1], center[2]), plane, int(rng.choice([1, 1, 2])))
            builder.arc(clockwise, (end[0], end[1], end[2]), arc, feed=1.0)
    return builder.build()


def cuts_of(path: Toolpath) -> Features:
    return features_in(path, (path.kind >= Kind.FEED) & (path.kind <= Kind.DRILL))


def inside(features: Features, run: np.ndarray) -> list[int]:
    """Return the runs that start inside an outline of another run."""
    lines = list(task_lines(features, traces_of(features), run, FREE.sagitta))
    found = lines_starting_inside(lines, outlines_of(lines, None, FREE))
    return sorted(k for outline, inner in found for k in inner.tolist() if k not in outline.owners)


def line_of(path: Toolpath, row: int) -> np.ndarray:
    """Return a cut as a line of many parts, seen from above."""
    begin, end = path.before[row], path.end[row]
    s = np.linspace(0, 1, PARTS)[:, None]
    line = begin + s * (end - begin)
    if path.kind[row] != Kind.FEED:
        arc = path.arcs[int(path.ref[row])]
        first, second, _ = plane_axes(arc.plane)
        radius, start, sweep = arc_radius_start_sweep(path, row)
        line[:, first] = arc.center[first] + radius * np.cos(start + s[:, 0] * sweep)
        line[:, second] = arc.center[second] + radius * np.sin(start + s[:, 0] * sweep)
    return line[:, :2]


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the distance of two lines; 0 where any two parts cross."""
    ends = [line[None, :] if k else line[:, None] for k, line in enumerate((one, other))]
    nearest = np.hypot(*np.moveaxis(ends[0] - ends[1], -1, 0)).min()
    a, b, c, d = one[:-1, None], one[1:, None], other[None, :-1], other[None, 1:]

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        u, v = q - p, r - p
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    crossing = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    return 0.0 if crossing.any() else float(nearest)


def turned(features: Features, rank: np.ndarray, tolerance: float = 0.002) -> list[list[int]]:
    """Return the pairs of touching features whose order is changed."""
    pairs, proved = touching_in_new_order(features, traces_of(features), rank, tolerance)
    assert proved
    return pairs.tolist()


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
def test_touching_pairs_in_changed_order_are_those_of_finely_divided_lines(seed: int) -> None:
    """Vertices of the divided lines are up to 0.6 mm apart, so pairs up to 0.7 mm apart are left out."""
    path = scribble(seed, n=30, size=16.0)
    features = cuts_of(path)
    rank = np.random.default_rng(seed).permutation(30)
    lines = [line_of(path, row) for row in features.row.tolist()]
    found, checked = turned(features, rank, TOUCH), 0
    for one, other in itertools.combinations(range(len(lines)), 2):
        distance = apart(lines[one], lines[other])
        if 0 < distance <= 0.7:
            continue
        assert ([one, other] in found) == (distance == 0 and rank[one] > rank[other]), (one, other)
        checked += 1
    assert checked > 200


def test_order_that_is_kept_is_not_looked_at() -> None:
    assert not turned(cuts_of(scribble(1)), np.arange(60))


def test_parallel_lines_in_any_direction_may_change_places_and_one_that_crosses_them_may_not() -> None:
    for angle in (0.0, 0.3, 1.0, math.pi / 2, 2.5):
        along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        builder = ToolpathBuilder()
        for k in range(500):
            begin, end = 0.1 * k * across, 0.1 * k * across + 80 * along
            builder.rapid(*begin.tolist(), 0.0)
            builder.feed(*end.tolist(), 0.0, feed=1.0)
        builder.rapid(*(40 * along - across).tolist())
        builder.feed(*(40 * along + 10.05 * across).tolist(), feed=1.0)
        rank = np.append(np.random.default_rng(3).permutation(500), 500)
        features = cuts_of(builder.build())
        assert not turned(features, rank)
        rank = np.append(np.arange(1, 501), 0)
        assert sorted({one for one, _ in turned(features, rank)}) == list(range(101))


def test_a_thousand_cuts_at_one_place_are_soon_told() -> None:
    builder = ToolpathBuilder()
    for k in range(1000):
        builder.rapid(1.0, 1.0, 5.0)
        builder.feed(z=-0.01 * k, feed=1.0)
    assert len(turned(cuts_of(builder.build()), np.arange(1000)[::-1].copy())) >= 50


def test_what_is_inside_a_closed_cut_is_what_a_walk_around_shows() -> None:
    """The sum of the angles under which a place sees the outline is a full turn inside, nothing outside."""
    rng = np.random.default_rng(11)
    for _ in range(20):
        n = int(rng.integers(5, 40))
        angle = np.sort(rng.uniform(0, math.tau, n))
        radius = rng.uniform(2, 10, n)
        outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]) + 20
        spots = rng.uniform(8, 32, (40, 2))
        builder = ToolpathBuilder()
        for x, y in spots.tolist():
            builder.rapid(x, y, 5.0)
            builder.feed(z=-1.0, feed=1.0)
        builder.rapid(*outline[0].tolist(), 5.0)
        for x, y in [*outline[1:].tolist(), outline[0].tolist()]:
            builder.feed(x, y, feed=1.0)
        features = cuts_of(builder.build())
        run = np.minimum(np.arange(len(features)), 40)
        seen = np.arctan2(*(np.vstack([outline, outline[:1]])[:, None] - spots)[..., ::-1].transpose(2, 0, 1))
        turn = ((np.diff(seen, axis=0) + math.pi) % math.tau - math.pi).sum(axis=0)
        assert inside(features, run) == np.flatnonzero(np.abs(turn) > 1).tolist()


def test_inside_a_full_circle_is_inside_up_to_the_circle() -> None:
    builder = ToolpathBuilder()
    distances = (0.0, 9.9, 9.99, 10.01, 10.1)
    for distance in distances:
        builder.rapid(distance * math.cos(0.4), distance * math.sin(0.4), 5.0)
        builder.feed(z=-1.0, feed=1.0)
    builder.rapid(10.0, 0.0)
    builder.arc(True, (10.0, 0.0, -1.0), Arc((0.0, 0.0, 0.0)), feed=1.0)
    features = cuts_of(builder.build())
    assert inside(features, np.arange(6)) == [0, 1, 2]
