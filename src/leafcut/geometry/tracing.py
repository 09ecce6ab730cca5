"""Trace the outline of a region in a picture with subpixel accuracy: level lines, then lines and arcs through them.

A level line crosses between pixels at a position interpolated from the brightness (marching squares; Lorensen and
Cline, "Marching cubes", SIGGRAPH 1987, in two dimensions). Without shades between dark and bright, the wall may be
anywhere between two pixel centres, and a straight wall looks like stairs.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Points
from leafcut.geometry.best_fit import best_fit
from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Polyline

#: A line with fewer points, around a pixel or two, is used unchanged.
FEW_POINTS = 10
#: A crossing closer than this to the middle between two pixels indicates an edge without shades, pixels.
UNSHADED = 0.1
#: Standard deviation of the distance between wall and crossing, pixels: without shades, uniform over one pixel; with
#: shades, that of an anti-aliased edge.
NOISE_OF_STEPS, NOISE_OF_SHADES = 0.29, 0.1
#: Maximum distance of accepted lines and arcs from the level line, pixels.
FARTHEST = 1.0
#: Maximum share of outliers among the points of a line: points off by more than this multiple of their noise.
MAX_OUTLIERS, OUTLIER = 0.03, 3.0
#: Tolerance of arcs fitted to a smoothed line, pixels.
FIT_TOLERANCE = 0.15
#: Rounds of smoothing and its two weights: Taubin, "A signal processing approach to fair surface design", SIGGRAPH
#: 1995, section 3: forwards and slightly more backwards, so that stairs vanish and circles keep their size.
ROUNDS = 40
FORTH, BACK = 0.5, -0.53
#: Maximum shift of a level line from its crossings by smoothing, pixels.
MAX_SHIFT = 0.5


def level_lines(height: NDArray[np.float32]) -> list[Points]:
    """Return the closed lines between values below 0 and others, float64[n, 2], the first point not repeated.

    Coordinates are pixels from the upper left corner of the picture, x right and y down; outside, all values are 1.
    """
    import contourpy

    padded = np.pad(height.astype(np.float64), 1, constant_values=1.0)
    lines = contourpy.contour_generator(z=padded, name="serial", line_type=contourpy.LineType.ChunkCombinedOffset)
    points, offsets = lines.lines(0.0)
    rings = []
    for chunk, starts in zip(points, offsets, strict=True):
        if chunk is None or starts is None:
            continue
        # The centre of the first pixel is half a pixel from the corner, and one pixel was added.
        moved = chunk - 0.5
        rings += [moved[a : b - 1] for a, b in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True) if b - a > 3]
    return rings


def fitted_outline(line: Points) -> Polyline:
    """Return lines and arcs along a level line, within `FARTHEST` of it; all lengths in pixels."""
    if len(line) < FEW_POINTS:
        return smoothed_outline(line)
    middle = line - 0.5
    # A crossing in the middle between two pixels only shows that the wall is somewhere between them.
    shift = np.abs(np.abs(middle - np.round(middle)) - 0.5).min(axis=1)
    noise = np.where(shift < UNSHADED, NOISE_OF_STEPS, NOISE_OF_SHADES)
    path = best_fit(line, noise)
    if path is not None:
        ring = shapely.LinearRing(path.flattened(0.01)) if path.n_segments > 1 else None
        if ring is not None and ring.is_simple:
            off = shapely.distance(shapely.points(line), ring)
            # Near corners a level line is rounder than the wall.
            if off.max() <= FARTHEST and float((off > OUTLIER * noise).mean()) <= MAX_OUTLIERS:
                return path
    return smoothed_outline(line)


def smoothed_outline(line: Points) -> Polyline:
    """Return arcs along a smoothed level line: faster than `fitted_outline`, but with rounder corners."""
    if len(line) < FEW_POINTS:
        return Polyline.of_points(line, closed=True)
    return fit_arcs(_smoothed(line), FIT_TOLERANCE, closed=True)


def _smoothed(line: Points) -> Points:
    """Return a level line without stairs; each point moves only between its two pixels."""
    # A point between two pixels of a row moves in x, a point between two pixels of a column in y.
    middle = line - 0.5
    in_row = np.abs(middle[:, 1] - np.round(middle[:, 1])) <= np.abs(middle[:, 0] - np.round(middle[:, 0]))
    movable = np.column_stack([in_row, ~in_row])
    moved = line
    for _ in range(ROUNDS):
        for weight in (FORTH, BACK):
            moved = moved + weight * movable * (0.5 * (np.roll(moved, 1, axis=0) + np.roll(moved, -1, axis=0)) - moved)
        moved = np.clip(moved, line - MAX_SHIFT, line + MAX_SHIFT)
    return moved
