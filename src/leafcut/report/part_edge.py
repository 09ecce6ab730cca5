"""Draw the edge of a plate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.polyline import Polyline
from leafcut.model.part import Part

#: Lines farther from the work than this share of its size, such as a drawing frame, do not affect the visible range.
_BEYOND = 1.0
_MIN_DISTANCE = 10.0
_TOLERANCE = 0.05


def edge_box_corners_near(part: Part, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the bounding box corners of all edge contours near the work, float64[k, 2], mm."""
    boxes = np.array([c.path.extents for c in part.edge]).reshape(-1, 2, 2)
    beyond = max(_BEYOND * float((high - low).max()), _MIN_DISTANCE)
    near = (boxes[:, 0] >= low - beyond).all(axis=1) & (boxes[:, 1] <= high + beyond).all(axis=1)
    return boxes[near].reshape(-1, 2)


def edge_segments(part: Part) -> NDArray[np.float64]:
    """Convert the edge of a part to straight segments, float64[k, 2, 2], mm."""
    return np.concatenate([np.zeros((0, 2, 2)), *(path_segments(contour.path) for contour in part.edge)])


def path_segments(path: Polyline) -> NDArray[np.float64]:
    """Convert a path to straight segments, float64[k, 2, 2], mm."""
    points = path.flattened(_TOLERANCE)
    if path.closed:
        points = np.vstack([points, points[:1]])
    return np.stack([points[:-1], points[1:]], axis=1)
