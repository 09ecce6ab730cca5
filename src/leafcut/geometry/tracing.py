"""From a picture of a region to its outline, more exact than its pixels: level lines, then lines and arcs through them.

A level line crosses from pixel to pixel where the brightness says (marching squares; Lorensen and Cline, "Marching
cubes", SIGGRAPH 1987, in two dimensions). Where a picture has no shades between dark and bright, the wall lies anywhere
between the middles of two pixels, and a straight wall looks like stairs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.fitting import fit_arcs
from leafcut.geometry.polyline import Points, Polyline

#: Rounds of smoothing, and its two weights: Taubin, "A signal processing approach to fair surface design", SIGGRAPH
#: 1995, section 3: forth and a little more back, so that stairs go and circles keep their size.
ROUNDS = 40
FORTH, BACK = 0.5, -0.53
#: A level line is smoothed within this of where it crosses from one pixel to the next, pixels.
HALF = 0.5


def level_lines(grey: NDArray[np.float32], level: float, outside: float) -> list[Points]:
    """Return the closed lines between what is darker than a level and what is not, float64[n, 2], first not repeated.

    Coordinates are pixels from the upper left corner of the picture, x right and y down; beyond its edge all is
    `outside`.
    """
    import contourpy

    padded = np.pad(grey.astype(np.float64), 1, constant_values=outside)
    lines = contourpy.contour_generator(z=padded, name="serial", line_type=contourpy.LineType.ChunkCombinedOffset)
    points, offsets = lines.lines(level)
    found = []
    for chunk, starts in zip(points, offsets, strict=True):
        if chunk is None or starts is None:
            continue
        # The middle of the first pixel is half a pixel from the corner, and one pixel was added.
        moved = chunk - 0.5
        found += [moved[a : b - 1] for a, b in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True) if b - a > 3]
    return found


def fitted_outline(line: Points, tolerance: float) -> Polyline:
    """Return lines and arcs along a level line; all lengths in pixels."""
    return fit_arcs(_smoothed(line), tolerance, closed=True)


def _smoothed(line: Points) -> Points:
    """Return a level line without stairs; every point stays on its way from pixel to pixel."""
    # A point lies between two pixels side by side, and moves in x, or one above the other, and moves in y.
    middle = line - 0.5
    in_row = np.abs(middle[:, 1] - np.round(middle[:, 1])) <= np.abs(middle[:, 0] - np.round(middle[:, 0]))
    free = np.column_stack([in_row, ~in_row])
    at = line
    for _ in range(ROUNDS):
        for weight in (FORTH, BACK):
            at = at + weight * free * (0.5 * (np.roll(at, 1, axis=0) + np.roll(at, -1, axis=0)) - at)
        at = np.clip(at, line - HALF, line + HALF)
    return at
