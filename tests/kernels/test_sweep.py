"""A move through a height field: every number of its result against all cells by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.kernels.sweep import (
    CellRows,
    ToolShape,
    covered_range_in_row,
    cut_moves,
    lowest_tool_height,
    tool_surface_height,
)
from plain_python import plain_python

ROWS, COLUMNS, CELL = 22, 26, 0.5
X, Y = -6.0, -5.0

#: Cylinder, ball, bull nose, cone with a flat tip, and cone with a round one.
SHAPES = {
    "cylinder": ToolShape(2.0, 2.0, 0.0, 2.0, 0.0, 0.0),
    "ball": ToolShape(2.0, 0.0, 2.0, 2.0, 2.0, 0.0),
    "bull nose": ToolShape(2.0, 1.2, 0.8, 2.0, 0.8, 0.0),
    "cone": ToolShape(2.0, 0.5, 0.0, 0.5, 0.0, 1.5),
}

MOVES = [
    (-2.0, 1.0, 0.5, 3.0, 1.0, 0.5),
    (3.0, -1.0, 1.5, -1.5, 2.0, 1.5),
    (-3.0, -2.0, 2.0, 2.0, 1.5, 0.2),
    (0.3, 2.0, 0.0, 0.3, -3.0, 1.5),
    (1.1, 0.7, 2.5, 1.1, 0.7, 0.4),
    (-5.5, -4.5, 1.0, -7.5, -6.0, 1.0),
    (6.0, 5.0, 1.2, 9.0, 5.0, 0.8),
]


def underside(shape: ToolShape, r: np.ndarray) -> np.ndarray:
    """Return the height of a tool's surface over its tip at distances from its axis."""
    out = np.clip(r - shape.flat, 0.0, shape.corner)
    round_ = shape.corner - np.sqrt(np.maximum(shape.corner**2 - out**2, 0.0))
    return np.where(r <= shape.reach, round_, shape.rise + shape.slope * (r - shape.reach))


def field(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a rough height field float32[rows, columns], and the middles of its cells."""
    heights = np.random.default_rng(seed).uniform(0.0, 3.0, (ROWS, COLUMNS)).astype(np.float32)
    row, column = np.indices(heights.shape)
    return heights, X + CELL * column, Y + CELL * row


@pytest.mark.parametrize("first, last", [(0, ROWS), (7, 14)])
@pytest.mark.parametrize("inset", [0.0, 0.3])
@pytest.mark.parametrize("kind", SHAPES)
def test_a_move_lowers_the_cells_under_it_and_counts_what_it_has_removed(
    kind: str, inset: float, first: int, last: int
) -> None:
    """The tool is held at 401 places of the move; between them it is lower by less than the tolerance."""
    shape, film, share = SHAPES[kind], 0.2, np.linspace(0.0, 1.0, 401)
    count = 0
    for k, move in enumerate(MOVES):
        heights, x, y = field(k)
        before = heights.astype(float)
        lowered = before.astype(np.float32) if inset else np.zeros((0, 0), dtype=np.float32)
        lowest = np.full(heights.shape, math.inf)
        for t in share:
            px, py, pz = (move[a] + t * (move[a + 3] - move[a]) for a in range(3))
            r = np.hypot(x - px, y - py)
            under = r <= shape.radius - inset
            # A rapid is narrower: its surface is that of the tool, moved inwards.
            lowest[under] = np.minimum(lowest, pz + underside(shape, np.minimum(r + inset, shape.radius)))[under]
        lowest[:first], lowest[last:] = math.inf, math.inf
        result = np.zeros((1, 9))
        cells = CellRows(heights, lowered, first, last, X, Y, CELL)
        with plain_python():
            total = cut_moves(
                cells,
                shape,
                np.array([move]),
                np.array([0]),
                np.array([inset]),
                -1.0,
                film,
                9.0,
                np.zeros((0, 8)),
                result,
            )
        after = heights.astype(float)
        sure = np.isfinite(lowest)
        wanted = np.minimum(before, lowest)[sure]
        if inset and move[2] != move[5] and move[:2] != move[3:5]:
            # The deepest place of a sloped rapid is found for the whole tool: not all of the narrower one is removed.
            assert (after[sure] >= wanted - 0.02).all()
        else:
            assert after[sure] == pytest.approx(wanted, abs=0.02)
        # Beside the path, cells that the tool just touches may count or not.
        assert (after != before)[~sure].sum() <= 4
        removed = before - after
        cut = removed > film
        count += int(cut.sum())
        assert result[0, 0] == pytest.approx(removed.sum(), abs=1e-4)
        assert total == result[0, 1] == cut.sum()
        assert result[0, 2] == pytest.approx(removed.max() if cut.any() else 0.0, abs=1e-5)
        length = math.dist(move[:2], move[3:5])
        ux, uy = ((move[3] - move[0]) / length, (move[4] - move[1]) / length) if length else (1.0, 0.0)
        left = (y - move[1]) * ux - (x - move[0]) * uy
        assert result[0, 3] == pytest.approx(left[cut].min(initial=math.inf))
        assert result[0, 4] == pytest.approx(left[cut].max(initial=-math.inf))
        assert result[0, 5] == -math.inf
        assert result[0, 6:].tolist() == [0.0, 0.0, 0.0]
        if inset:
            assert np.array_equal(lowered, heights)
    assert count > 20


@pytest.mark.parametrize("kind", SHAPES)
def test_material_over_a_wider_tool_is_measured_at_the_nearest_point_of_the_path(kind: str) -> None:
    shape, margin = SHAPES[kind], 0.7
    for k, move in enumerate(MOVES):
        heights, x, y = field(k)
        dx, dy = move[3] - move[0], move[4] - move[1]
        length2 = dx * dx + dy * dy
        share = np.clip(((x - move[0]) * dx + (y - move[1]) * dy) / length2, 0.0, 1.0) if length2 else 0.0 * x
        distance = np.hypot(x - move[0] - share * dx, y - move[1] - share * dy)
        over = heights - min(move[2], move[5]) - underside(shape, np.clip(distance - margin, 0.0, shape.radius))
        over[distance > shape.radius + margin] = -math.inf
        over[:3], over[18:] = -math.inf, -math.inf
        result = np.zeros((1, 9))
        cells = CellRows(heights, np.zeros((0, 0), dtype=np.float32), 3, 18, X, Y, CELL)
        with plain_python():
            cut_moves(
                cells, shape, np.array([move]), np.array([0]), np.zeros(1), margin, 0.2, 9.0, np.zeros((0, 8)), result
            )
        assert result[0, 5] == pytest.approx(over.max(), abs=1e-6)


def test_the_underside_of_a_tool_is_flat_then_round_then_a_cone() -> None:
    distances = np.linspace(0.0, 2.0, 41)
    for shape in [*SHAPES.values(), ToolShape(2.0, 0.4, 0.6, 0.8, 0.2, 0.7)]:
        with plain_python():
            found = [tool_surface_height(shape, r) for r in distances.tolist()]
        assert found == pytest.approx(underside(shape, distances).tolist())


def test_the_stretch_of_a_row_is_that_of_the_disc_at_many_places() -> None:
    rng, share = np.random.default_rng(5), np.linspace(0.0, 1.0, 2001)
    missed = 0
    for dx, dy in [(3.0, 0.0), (0.0, 0.0), (0.0, -2.0), *rng.uniform(-4, 4, (12, 2)).tolist()]:
        for y in rng.uniform(-4.0, 4.0, 6).tolist():
            with plain_python():
                low, high = covered_range_in_row(y, dx, dy, 1.3)
            away = y - share * dy
            inside = abs(away) <= 1.3
            if not inside.any():
                missed += 1
                assert low > high
                continue
            half = np.sqrt(1.3**2 - away[inside] ** 2)
            assert low == pytest.approx((share[inside] * dx - half).min(), abs=0.01)
            assert high == pytest.approx((share[inside] * dx + half).max(), abs=0.01)
    assert missed > 5


#: Also a cone whose round tip has a flat.
TIPS = [*SHAPES.values(), ToolShape(2.0, 0.4, 0.6, 0.76, 0.12, 0.75), ToolShape(2.0, 0.0, 0.5, 0.4, 0.2, 4 / 3)]


def lowest(shape: ToolShape, along: float, d: float, length: float, grade: float) -> float:
    """Return the lowest height over a point, by a search in thirds: it is convex in the position on the path."""

    def height(w: float) -> float:
        return grade * (along + w) + float(underside(shape, np.array(min(math.hypot(d, w), shape.radius))))

    farthest = math.sqrt(max(shape.radius**2 - d * d, 0.0))
    low, high = max(-along, -farthest), min(length - along, farthest)
    if low > high:
        low = high = min(max(0.0, -along), length - along)
    for _ in range(60):
        third = (high - low) / 3.0
        if height(low + third) < height(high - third):
            high -= third
        else:
            low += third
    return height(0.5 * (low + high))


@pytest.mark.parametrize("shape", TIPS, ids=range(len(TIPS)))
def test_the_lowest_height_over_a_point_is_the_minimum_along_the_path(shape: ToolShape) -> None:
    """Rising and falling paths, from nearly level to steep; points before, beside and behind them."""
    rng = np.random.default_rng(7)
    for k in range(60):
        length = float(rng.uniform(0.05, 6.0))
        grade = float(rng.choice([-1.0, 1.0])) * (0.03, 0.3, 0.65, 1.2, 1.8, 20.0)[k % 6]
        d = float(rng.uniform(-1.0, 1.0)) * shape.radius * (1.0 if k % 3 else 0.2)
        along = float(rng.uniform(-0.6, 0.6)) * shape.radius + float(rng.uniform(0.0, length))
        wanted = lowest(shape, along, d, length, grade)
        with plain_python():
            found = lowest_tool_height(shape, 0.0, along, d, length, grade, math.inf)
            early = lowest_tool_height(shape, 0.0, along, d, length, grade, wanted - 0.1)
        reached = math.hypot(d, min(max(along, 0.0), length) - along) <= shape.radius
        assert found == pytest.approx(wanted, abs=1e-7) or not reached
        assert wanted - 0.1 <= early <= wanted + 1e-7 or not reached


@pytest.mark.parametrize("shape", TIPS, ids=range(len(TIPS)))
def test_on_a_level_or_vertical_path_the_nearest_position_is_the_lowest(shape: ToolShape) -> None:
    """A margin moves the point away from the axis, at most to the edge of the tool."""
    for along, d, length, away in (
        (1.0, 0.3, 4.0, 0.3),
        (-0.8, 0.6, 4.0, 1.0),
        (4.4, -0.3, 4.0, 0.5),
        (0.3, -0.4, 0.0, 0.5),
        (4.0, 0.0, 4.0, 0.0),
    ):
        for margin in (0.0, 0.7, 3.0):
            with plain_python():
                found = lowest_tool_height(shape, margin, along, d, length, 0.0, math.inf)
            assert found == pytest.approx(float(underside(shape, np.array(min(away + margin, shape.radius)))))


#: Underside of a part above the flutes, as a surface above its lower end: a shank of the tool's radius, a wider one,
#: a holder with a flat and a cone, and one that is narrower than a cell.
BODIES = {
    "shank": (2.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.4, 0.0),
    "wide": (3.1, 3.1, 0.0, 3.1, 0.0, 0.0, 0.6, 0.0),
    "holder": (4.0, 1.5, 0.0, 1.5, 0.0, 0.5, 0.3, 1.0),
    "needle": (0.5, 0.5, 0.0, 0.5, 0.0, 0.0, 0.1, 0.0),
}


def met(body: tuple[float, ...], move: tuple[float, ...], point: tuple[float, float], h: float) -> float:
    """Return the depth of a part in a cell, at 1001 positions of the move up to that at which the tool's edge cuts it.

    The part is narrower by a cell; where the tool's edge reaches the cell, the part counts up to there.
    """
    shape, above, inner = ToolShape(*body[:6]), body[6], body[0] - CELL
    share = np.linspace(0.0, 1.0, 1001)
    x, y, z = (move[a] + share * (move[a + 3] - move[a]) for a in range(3))
    r = np.hypot(point[0] - x, point[1] - y)
    if inner <= 0.0 or r[0] <= 2.0:
        return 0.0
    cut = np.flatnonzero(r <= 2.0)
    last = cut[0] if len(cut) else len(r) - 1
    inside = r[: last + 1] <= inner
    inside[last] |= bool(len(cut))
    length = math.dist(move[:2], move[3:5])
    if len(cut) and length:
        ux, uy = (move[3] - move[0]) / length, (move[4] - move[1]) / length
        inside &= abs((point[1] - move[1]) * ux - (point[0] - move[0]) * uy) <= inner
    over = z[: last + 1] + above + underside(shape, np.minimum(r[: last + 1] + CELL, shape.radius))
    return h - float(over[inside].min(initial=math.inf))


@pytest.mark.parametrize("kind", BODIES)
def test_parts_above_the_flutes_meet_material_that_their_tool_has_not_cut(kind: str) -> None:
    body, film, touched = BODIES[kind], 0.25, 0
    level_or_straight = [m for m in MOVES if kind != "holder" or m[2] == m[5] or m[:2] == m[3:5]]
    for k, move in enumerate(level_or_straight):
        heights, x, y = field(k)
        depths = np.array(
            [met(body, move, (a, b), float(h)) for a, b, h in zip(x.flat, y.flat, heights.flat, strict=True)]
        )
        depths = depths.reshape(heights.shape)
        depths[:2], depths[20:] = -math.inf, -math.inf
        cells = CellRows(heights, np.zeros((0, 0), dtype=np.float32), 2, 20, X, Y, CELL)
        result = np.zeros((1, 9))
        with plain_python():
            cut_moves(
                cells,
                SHAPES["cylinder"],
                np.array([move]),
                np.array([0]),
                np.zeros(1),
                -1.0,
                film,
                9.0,
                np.array([body]),
                result,
            )
        deepest = float(depths.max(initial=0.0, where=depths > film))
        touched += deepest > 0.0
        column, other = (7, 6) if body[7] else (6, 7)
        assert result[0, column] == pytest.approx(deepest, abs=0.02)
        assert result[0, other] == 0.0
        count = int((depths > film).sum())
        if kind == "shank":
            assert abs(result[0, 8] - count) <= 0.05 * count
        else:
            assert result[0, 8] == (math.inf if kind == "wide" and count else 0.0)
    assert touched >= (0 if kind == "needle" else 2)
