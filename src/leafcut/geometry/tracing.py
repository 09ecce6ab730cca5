"""Trace the outline of a region in a picture with subpixel accuracy: trace level lines, then fit lines and arcs.

A level line passes between two pixels at a position that is interpolated from their brightness (marching squares, the
two-dimensional form of Lorensen and Cline, "Marching cubes", SIGGRAPH 1987). If a picture has no shades between dark
and bright, the exact position of an edge between two pixel centres is unknown. A straight edge then becomes a
staircase.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Points
from leafcut.geometry.best_fit import fit_outline
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline

#: Minimum number of points for smoothing. A shorter line surrounds just a pixel or two and is not changed.
FEW_POINTS = 10
#: Maximum distance of a crossing from the midpoint between two pixels at an edge without shades, pixels.
UNSHADED = 0.1
#: Standard deviation of the distance between the wall and a crossing, pixels, without and with shades. Without shades,
#: the distance is uniformly distributed over one pixel. With shades, the edge is anti-aliased.
NOISE_OF_STEPS, NOISE_OF_SHADES = 0.29, 0.1
#: Maximum distance of accepted lines and arcs from the level line, pixels.
FARTHEST = 1.0
#: Maximum share of outliers among the points of a line, and minimum distance of an outlier in multiples of its noise.
MAX_OUTLIERS, OUTLIER = 0.03, 3.0
#: Tolerance of arcs fitted to a smoothed line, pixels.
FIT_TOLERANCE = 0.15
#: Number of smoothing rounds, and both weights. Each round moves the points forwards and then slightly farther
#: backwards. Stairs therefore vanish, while circles keep their size. Source: Taubin, "A signal processing approach to
#: fair surface design", SIGGRAPH 1995, section 3.
ROUNDS = 40
FORTH, BACK = 0.5, -0.53
#: Maximum distance by which smoothing moves a level line away from its crossings, pixels.
MAX_SHIFT = 0.5


def trace_level_lines(height: NDArray[np.float32]) -> list[Points]:
    """Return the closed lines that separate negative values from all other values, float64[n, 2].

    The first point of a line is not repeated at its end. Coordinates are in pixels from the upper left corner of the
    picture, with x to the right and y down. Outside the picture, all values are treated as 1.
    """
    import contourpy

    padded = np.pad(height.astype(np.float64), 1, constant_values=1.0)
    lines = contourpy.contour_generator(z=padded, name="serial", line_type=contourpy.LineType.ChunkCombinedOffset)
    points, offsets = lines.lines(0.0)
    rings = []
    for chunk, starts in zip(points, offsets, strict=True):
        if chunk is None or starts is None:
            continue
        # The centre of the first pixel is half a pixel from the corner, and a border of one pixel was added.
        moved = chunk - 0.5
        rings += [moved[a : b - 1] for a, b in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True) if b - a > 3]
    return rings


def fit_traced_outline(line: Points) -> Polyline:
    """Fit lines and arcs to a level line. They stay within `FARTHEST` of the line. All lengths are in pixels."""
    if len(line) < FEW_POINTS:
        return smooth_outline(line)
    middle = line - 0.5
    # A crossing midway between two pixels shows only that the wall is somewhere between them.
    shift = np.abs(np.abs(middle - np.round(middle)) - 0.5).min(axis=1)
    noise = np.where(shift < UNSHADED, NOISE_OF_STEPS, NOISE_OF_SHADES)
    path = fit_outline(line, noise)
    if path is not None:
        ring = shapely.LinearRing(path.flattened(0.01)) if path.n_segments > 1 else None
        if ring is not None and ring.is_simple:
            off = shapely.distance(shapely.points(line), ring)
            # Near corners, a level line is rounder than the wall.
            if off.max() <= FARTHEST and float((off > OUTLIER * noise).mean()) <= MAX_OUTLIERS:
                return path
    return smooth_outline(line)


def smooth_outline(line: Points) -> Polyline:
    """Fit arcs to a smoothed level line. This is faster than `fit_traced_outline`, but it rounds corners more."""
    if len(line) < FEW_POINTS:
        return Polyline.of_points(line, closed=True)
    return fit_arcs(_smoothed(line), FIT_TOLERANCE, closed=True)


def _smoothed(line: Points) -> Points:
    """Remove the stairs from a level line. Each point stays between its two pixels."""
    # A point between two pixels of a row moves in x; a point between two pixels of a column moves in y.
    middle = line - 0.5
    in_row = np.abs(middle[:, 1] - np.round(middle[:, 1])) <= np.abs(middle[:, 0] - np.round(middle[:, 0]))
    movable = np.column_stack([in_row, ~in_row])
    moved = line
    for _ in range(ROUNDS):
        for weight in (FORTH, BACK):
            moved = moved + weight * movable * (0.5 * (np.roll(moved, 1, axis=0) + np.roll(moved, -1, axis=0)) - moved)
        moved = np.clip(moved, line - MAX_SHIFT, line + MAX_SHIFT)
    return moved
