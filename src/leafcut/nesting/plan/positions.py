"""Find a position for a piece inside a region of any shape, such as a hole in a part or a remnant."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from leafcut.nesting.plan.pieces import CHORD, NestPiece, chord_polygon

#: Rotations to try for a part that may be rotated freely, rad.
FREE_ANGLES = tuple(math.radians(k) for k in range(0, 360, 15))
#: The spacing is multiplied by this factor, because rounded corners consist of chords.
ROUND_CORNER = 1.002
#: Additional clearance for the chords of arcs in both outlines, mm.
SLACK = 4.0 * CHORD
#: Number of grid positions per axis. It is odd, so that the grid includes the middle.
GRID_SIZE = 15
#: Maximum number of corners of the region, and of the piece, that are matched with each other.
REGION_CORNERS, PIECE_CORNERS = 300, 16
#: Number of positions tested at a time.
_CHUNK = 128
#: A piece that touches an edge may overlap it by this rounding error, mm.
_ROUNDING = 1e-6

#: Rotation (rad), translation (mm), and the polygon of the placed piece.
PiecePosition = tuple[float, float, float, "Polygon"]


def buffer_distance(spacing: float) -> float:
    """Return how far a polygon must be enlarged to guarantee a spacing in spite of chord errors, mm."""
    return ROUND_CORNER * spacing + SLACK


def find_position(
    piece: NestPiece, region: BaseGeometry, angles: Iterable[float], *, quick: bool = False
) -> PiecePosition | None:
    """Return the leftmost position of a piece inside a region, or None if the piece does not fit.

    If several positions are equally far left, the lowest one is returned. Candidate positions lie on a grid, or place a
    corner of the piece on a corner of the region. With `quick`, only the grid is tried, and the search ends at the
    first rotation that fits.
    """
    if region.is_empty:
        return None
    corners = np.zeros((0, 2)) if quick else _sample_evenly(shapely.get_coordinates(region), REGION_CORNERS)
    grown = region.buffer(_ROUNDING, join_style="mitre")
    shapely.prepare(grown)
    best: PiecePosition | None = None
    for angle in angles:
        ring = np.asarray(chord_polygon(piece.path.turned(angle)).exterior.coords)
        for x, y, polygon in _fitting_positions(ring, corners, region, grown):
            if best is None or _leftmost_lowest_key(polygon) < _leftmost_lowest_key(best[3]):
                best = (angle, x, y, polygon)
            break
        if quick and best is not None:
            break
    return best


def _leftmost_lowest_key(polygon: Polygon) -> tuple[float, float]:
    _, y0, x1, y1 = polygon.bounds
    return (round(x1, 6), round(y0 + y1, 6))


def _fitting_positions(
    ring: NDArray[np.float64], corners: NDArray[np.float64], region: BaseGeometry, grown: Any
) -> Iterator[tuple[float, float, Polygon]]:
    """Yield the positions at which a rotated piece fits, from left to right and from bottom to top.

    Each position comes with the polygon of the moved piece.

    Parameters
    ----------
    ring
        Outline of the piece, float64[n, 2], mm.
    grown
        The region, enlarged by a rounding tolerance.
    """
    left, low, right, high = region.bounds
    (x0, y0), (x1, y1) = ring.min(axis=0), ring.max(axis=0)
    if x1 - x0 > right - left + _ROUNDING or y1 - y0 > high - low + _ROUNDING:
        return
    xs, ys = np.linspace(left - x0, right - x1, GRID_SIZE), np.linspace(low - y0, high - y1, GRID_SIZE)
    grid = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
    piece_corners = _sample_evenly(
        np.vstack([ring[:-1], [(x0, y0), (x0, y1), (x1, y0), (x1, y1)]])[::-1], PIECE_CORNERS
    )
    touching = (corners[:, None, :] - piece_corners[None, :, :]).reshape(-1, 2)
    moves = np.concatenate([grid, touching])
    inside = (moves >= (left - x0 - _ROUNDING, low - y0 - _ROUNDING)) & (
        moves <= (right - x1 + _ROUNDING, high - y1 + _ROUNDING)
    )
    moves = np.unique(np.round(moves[inside.all(axis=1)], 6), axis=0)
    for k in range(0, len(moves), _CHUNK):
        chunk = moves[k : k + _CHUNK]
        polygons = shapely.polygons(ring[None, :, :] + chunk[:, None, :])
        for index in np.flatnonzero(shapely.covers(grown, polygons)):
            yield float(chunk[index, 0]), float(chunk[index, 1]), polygons[index]


def _sample_evenly(points: NDArray[np.float64], limit: int) -> NDArray[np.float64]:
    if len(points) <= limit:
        return points
    return points[np.linspace(0, len(points) - 1, limit).astype(np.int64)]
