"""Place the numbers of holes. A number must not cover holes or other numbers, and should not cover paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

#: Width of a digit and height of a capital letter, in font sizes. The values suit common sans-serif fonts.
DIGIT_WIDTH = 0.56
CAP_HEIGHT = 0.72

#: Penalties for a number that lies outside the drawing, or that covers another number, a hole, or a line.
_OUTSIDE = _ON_NUMBER = 1000.0
_ON_HOLE = 60.0
_ON_LINE = 4.0
_WORST_ACCEPTED = 999.0
_GAP = 1.2

#: Directions from a hole to its number (y down), in order of preference.
_DIRECTIONS = ((1, -1), (-1, -1), (1, 1), (-1, 1), (1, 0), (-1, 0), (0, -1), (0, 1))
_DIAGONAL = 0.72


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Objects that numbers should not cover, in user units (y down).

    Attributes
    ----------
    holes
        x, y and radius of each hole, float64[n, 3].
    lines
        Segments, float64[m, 2, 2].
    size
        Width and height of the drawing.
    """

    holes: NDArray[np.float64]
    lines: NDArray[np.float64]
    size: tuple[float, float]


def label_positions(
    stops: NDArray[np.float64], words: list[str], font: float, around: Surroundings
) -> list[tuple[float, float] | None]:
    """Find a position for each number, user units.

    The result is None if the number would cover another number everywhere.

    A row of `stops`, float64[n, 4], contains x, y, the radius to keep clear, and the radius of the hole. A number may
    be inside a large hole.
    """
    segments: Any = shapely.linestrings(around.lines)
    lines = shapely.STRtree(segments)
    placed: list[NDArray[np.float64]] = []
    centres: list[tuple[float, float] | None] = []
    for (x, y, free, hole), word in zip(stops.tolist(), words, strict=True):
        half = np.array([DIGIT_WIDTH * font * len(word), CAP_HEIGHT * font]) / 2 + (1.6, 0.6)
        candidates = _candidate_positions((x, y), free, hole, half)
        costs = _position_costs(candidates, half, (x, y), around, lines, placed)
        best = int(np.argmin(costs))
        if costs[best] > _WORST_ACCEPTED:
            centres.append(None)
            continue
        centre = candidates[best]
        placed.append(np.concatenate([centre - half, centre + half]))
        centres.append((float(centre[0]), float(centre[1])))
    return centres


def _candidate_positions(
    centre: tuple[float, float], free: float, hole: float, half: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return possible centres for a hole number, float64[k, 2], best first.

    If the hole is large enough, the first position is inside the hole. The others are around the hole.
    """
    (x, y), reach = centre, free + _GAP
    around = []
    for dx, dy in _DIRECTIONS:
        out = reach * (_DIAGONAL if dx and dy else 1.0)
        around.append((x + dx * (out + half[0]), y + dy * (out + half[1])))
    inside = [(x, y)] if np.hypot(*half) < hole - 1 else []
    return np.array(inside + around)


def _position_costs(
    candidates: NDArray[np.float64],
    half: NDArray[np.float64],
    own_place: tuple[float, float],
    around: Surroundings,
    lines: shapely.STRtree,
    placed: list[NDArray[np.float64]],
) -> NDArray[np.float64]:
    costs = np.arange(len(candidates), dtype=np.float64) * 0.1
    inside = len(candidates) > len(_DIRECTIONS)
    other_holes = np.abs(around.holes[:, :2] - own_place).sum(axis=1) > 1e-6
    for number, centre in enumerate(candidates):
        low, high = centre - half, centre + half
        if (low < 0).any() or (high > around.size).any():
            costs[number] += _OUTSIDE
        if placed:
            boxes = np.array(placed)
            costs[number] += _ON_NUMBER * ((boxes[:, :2] < high) & (boxes[:, 2:] > low)).all(axis=1).sum()
        nearest = np.clip(around.holes[:, :2], low, high)
        covered = np.hypot(*(around.holes[:, :2] - nearest).T) < around.holes[:, 2] + 0.5
        costs[number] += _ON_HOLE * (covered & other_holes).sum()
        if number or not inside:
            costs[number] += _ON_LINE * len(lines.query(shapely.box(*low, *high), predicate="intersects"))
    return costs
