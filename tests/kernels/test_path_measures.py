"""Neighbouring passes and the engaged edge, found by kernels, against looking at all places."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.kernels.engagement import EdgePath, ToolEdge, measure_engagement
from leafcut.kernels.step_over import Reaches, find_smallest_touching_discs
from leafcut.material.bands import sort_into_bands
from leafcut.material.engagement import engagement_along_path
from leafcut.material.tool_steps import steps_along_path
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.plan.coverage_points import CoveragePoints
from plain_python import plain_python


@pytest.mark.parametrize("spread", [(10.0, 10.0), (40.0, 0.0), (0.0, 40.0), (1e-3, 60.0)])
def test_the_neighbour_of_a_place_is_that_of_the_smallest_disc_beside_it(spread: tuple[float, float]) -> None:
    random = np.random.default_rng(3)
    others = random.uniform(0.0, 1.0, (120, 2)) * spread
    places = random.uniform(-0.1, 1.1, (60, 2)) * spread
    angle = random.uniform(0.0, math.tau, 60)
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    height, row, radius = np.zeros(60), np.zeros(60, np.int64), np.zeros(60)
    x, y, nx, ny = np.concatenate([places, normal], axis=1).T.copy()
    find_smallest_touching_discs(
        sort_into_bands(others, 0.3), x, y, nx, ny, Reaches(0.2, 5.0), 1e-9, height, row, radius
    )
    for i in range(60):
        away = others - places[i]
        over = away @ normal[i]
        with np.errstate(divide="ignore"):
            radii = np.where(over > 0.0, (away**2).sum(axis=1) / (2.0 * over), np.inf)
        best = int(np.argmin(radii))
        if radii[best] > 2.5:
            assert height[i] == 0.0
        else:
            assert (row[i], height[i], radius[i]) == (best, pytest.approx(over[best]), pytest.approx(radii[best]))


def test_of_equal_discs_the_highest_point_counts_and_of_equal_points_the_last() -> None:
    """Places of a grid, each of them twice, around places between them; the first reach is a fifth of the spacing."""
    grid = np.array([(i, j) for i in range(9) for j in range(7)], dtype=float)
    others = np.concatenate([grid, grid])
    places = grid[16:45:3] + np.array([0.5, 0.0])
    normal = np.tile([(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (0.6, 0.8)], (len(places), 1))[: len(places)]
    n = len(places)
    height, row, radius = np.zeros(n), np.zeros(n, np.int64), np.zeros(n)
    x, y, nx, ny = np.concatenate([places, normal], axis=1).T.copy()
    find_smallest_touching_discs(
        sort_into_bands(others, 0.7), x, y, nx, ny, Reaches(0.2, 30.0), 1e-9, height, row, radius
    )
    for i in range(n):
        away = others - places[i]
        over = away @ normal[i]
        with np.errstate(divide="ignore"):
            radii = np.where(over > 1e-12, (away**2).sum(axis=1) / (2.0 * over), np.inf)
        if radii.min() == math.inf:
            assert height[i] == 0.0
            continue
        smallest = np.flatnonzero(radii <= radii.min() * (1.0 + 1e-9))
        highest = smallest[over[smallest] >= over[smallest].max() - 1e-12]
        assert height[i] == pytest.approx(over[highest[-1]])
        assert radius[i] == pytest.approx(radii.min())
        assert others[row[i]].tolist() in others[highest].tolist()
        assert row[i] >= len(grid)


def test_the_engaged_edge_is_the_part_of_the_half_circle_ahead_that_earlier_places_leave() -> None:
    rules = PocketRules(tool_diameter=4.0, step_over=2.4)
    corners = np.random.default_rng(8).uniform(0.0, 9.0, (6, 2))
    way = steps_along_path(PocketPath("test", (PocketPiece(Polyline.of_points(corners)),)), rules)
    found = engagement_along_path(way, rules)
    edge = rules.radius - rules.tolerance
    for i in range(0, len(way), 9):
        if not np.isfinite(way.back[i, 0]):
            assert found.angle[i] == pytest.approx(math.pi)
            continue
        angles = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 1801)
        ahead = math.atan2(way.ahead[i, 1], way.ahead[i, 0])
        rim = way.xy[i] + edge * np.column_stack([np.cos(ahead + angles), np.sin(ahead + angles)])
        away = np.hypot(*(rim[:, None] - way.xy[None, :i]).transpose(2, 0, 1))
        station = np.cumsum(way.step)
        recent = station[i] - station[:i] < 2.0 * math.sqrt(2.0 * rules.radius * rules.tolerance)
        free = (away >= np.where(recent, edge, rules.radius) - 1e-9).all(axis=1)
        free &= rim @ way.back[i] >= way.xy[i] @ way.back[i]
        assert found.angle[i] == pytest.approx(free.mean() * math.pi, abs=0.02)
        assert found.width[i] == pytest.approx(rules.radius * (free * np.cos(angles)).mean() * math.pi, abs=0.05)
        nearest = math.cos(abs(angles[free]).min(initial=0.5 * math.pi)) if found.angle[i] > 0.0 else 0.0
        assert found.chip[i] == pytest.approx(nearest, abs=0.02)


def test_the_places_near_a_piece_of_a_way_are_all_that_it_is_no_further_from_than_their_limits() -> None:
    random = np.random.default_rng(4)
    places, way = random.uniform(0.0, 9.0, (150, 2)), random.uniform(0.0, 9.0, (20, 2))
    way[7] = way[6]
    limits, pieces = random.uniform(0.1, 2.0, 150), np.flatnonzero(np.arange(19) % 3 > 0)
    piece, place = CoveragePoints(places, limits, pieces).pairs_within_limit(way)
    assert np.array_equal(piece, np.sort(piece))
    lines = shapely.linestrings(np.stack([way[pieces], way[pieces + 1]], axis=1))
    away = shapely.distance(lines[:, None], shapely.points(places))
    expected = {(int(pieces[i]), int(k)) for i, k in np.argwhere(away <= limits)}
    assert set(zip(piece.tolist(), place.tolist(), strict=True)) == expected and len(piece) == len(expected)
    assert [len(part) for part in CoveragePoints(places[:0], limits[:0], pieces).pairs_within_limit(way)] == [0, 0]


def merged(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the parts of −π/2 … π/2 that no interval covers."""
    left, to = [], -0.5 * math.pi
    for low, high in sorted(intervals):
        if low > to:
            left.append((to, min(low, 0.5 * math.pi)))
        to = max(to, high)
    return [(a, b) for a, b in [*left, (to, 0.5 * math.pi)] if b > a]


def test_the_engaged_edge_is_that_of_all_intervals_of_all_earlier_discs() -> None:
    """Two runs over each other: discs of the same run within 1.5 mm are a little smaller, and one at the same place
    covers nothing; of the other run, it covers all.
    """
    rng, n = np.random.default_rng(6), 90
    turn = np.cumsum(rng.uniform(-0.6, 0.6, n))
    step = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    xy = np.cumsum(0.5 * step, axis=0) % 6.0
    xy[30], xy[70] = xy[29], xy[20]
    ahead, back = step, np.concatenate([[(math.nan, math.nan)], step[:-1]])
    back[50] = math.nan
    run, station = np.repeat([0, 1], [50, 40]), 0.5 * np.arange(n)
    tool = ToolEdge(radius=1.6, edge=1.55, near=1.5, nothing=1e-6)
    columns = [np.ascontiguousarray(c) for c in (*xy.T, *ahead.T, *back.T)]
    angle, width, nearest = (np.zeros(n) for _ in range(3))
    scratch = np.zeros(2 * n + 2), np.zeros(2 * n + 2)
    path = EdgePath(*columns, run, station)
    with plain_python():
        measure_engagement(sort_into_bands(xy, 1.0), path, tool, *scratch, angle, width, nearest)
    for i in range(n):
        intervals = []
        direction = math.atan2(ahead[i, 1], ahead[i, 0])

        def cover(dx: float, dy: float, half: float, intervals: list = intervals, direction: float = direction) -> None:
            middle = math.atan2(dy, dx) - direction
            intervals += [(middle - half + k * math.tau, middle + half + k * math.tau) for k in (-2, -1, 0, 1, 2)]

        if math.isfinite(back[i, 0]):
            cover(-back[i, 0], -back[i, 1], 0.5 * math.pi)
        for j in range(i):
            away = xy[j] - xy[i]
            distance = float(np.hypot(*away))
            recent = run[i] == run[j] and station[i] - station[j] < 1.5
            if distance == 0.0:
                intervals += [] if recent else [(-4.0, 4.0)]
            elif distance < 3.2:
                disc = 1.55 if recent else 1.6
                cosine = (1.55**2 + distance**2 - disc**2) / (2.0 * 1.55 * distance)
                if cosine < 1.0:
                    cover(*away, math.acos(max(cosine, -1.0)))
        left = [(a, b) for a, b in merged(intervals) if b - a > 1e-9]
        assert angle[i] == pytest.approx(sum(b - a for a, b in left), abs=1e-6)
        assert width[i] == pytest.approx(sum(math.sin(b) - math.sin(a) for a, b in left), abs=1e-6)
        smallest = min((max(a, -b, 0.0) for a, b in left), default=0.5 * math.pi)
        assert nearest[i] == pytest.approx(smallest, abs=1e-6)
    assert (angle > 0.0).sum() > 20
    assert (angle == 0.0).sum() > 5
