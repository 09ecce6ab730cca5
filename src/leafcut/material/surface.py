"""A mesh seen from above: safe heights for crossing it, and the upper and lower ends of its holes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats

#: Number of tiles along the longer side of a part. A tile takes 8 bytes, so all tiles together take half a megabyte.
#: Dogleg rapids need fewer tiles, because every tile in the box between two positions must be checked.
TILES, TILES_DOGLEG = 256, 64
#: Minimum size of a tile, mm, and maximum number of tiles within the radius of a tool. Both limit the run time.
FINEST_TILE, MOST_IN_REACH = 0.2, 24
#: Distance between the tool and the rim of a hole, mm, and number of points on the rim.
RIM, RIM_PLACES = 0.1, 24


class SafeTiles(NamedTuple):
    """Square tiles, each with the minimum height at which a tool may cross it.

    Attributes
    ----------
    heights
        Minimum heights, float64[rows, columns], mm, with rows by ascending y. Tiles without material have the height
        −∞.
    x, y
        Lower left corner of the first tile, mm.
    side
        Side length of a tile, mm.
    """

    heights: NDArray[np.float64]
    x: float
    y: float
    side: float


class HoleRims(NamedTuple):
    """The surface around several holes, float64[n] each, mm.

    Attributes
    ----------
    top
        Height of the highest point of the rim and the centre.
    lowest
        Height of the lowest point of the upper surface on the rim, or −∞ if some of the rim has no material below it.
    under
        Height of the lowest point of all triangles below the rim.
    """

    top: Floats
    lowest: Floats
    under: Floats


def build_safe_tiles(
    triangles: NDArray[np.float64],
    radius: float,
    above: float,
    max_tiles: int = TILES,
    bodies: Sequence[tuple[float, float]] = (),
) -> SafeTiles:
    """Return the minimum heights at which a tool tip may cross a surface.

    The heights are exact. Horizontally, obstacles are enlarged to whole tiles, which adds up to two tiles.

    Parameters
    ----------
    triangles
        float64[n, 3, 3], mm.
    radius
        Tool radius including lateral clearance, mm.
    above
        Clearance above the surface, mm.
    max_tiles
        Number of tiles along the longer side.
    bodies
        Radius of each section above the flutes, and the minimum height of the tool tip above the surface for this
        section, mm. This height is negative if the distance from the tip to the section exceeds the clearance.
    """
    from leafcut.kernels.surface import dilate_heights, raise_cells_to_maximum, reach_in_cells

    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    reaches = [(radius, above), *bodies]
    largest = max(body_radius for body_radius, _ in reaches)
    side = max(float(max(high[:2] - low[:2])) / max_tiles, FINEST_TILE, largest / MOST_IN_REACH)
    margin = math.ceil(largest / side) + 1
    x, y = float(low[0]) - margin * side, float(low[1]) - margin * side
    columns, rows = (math.ceil(float(high[k] - low[k]) / side) + 2 * margin + 1 for k in range(2))
    heights, safe = np.full((rows, columns), -np.inf), np.full((rows, columns), -np.inf)
    raise_cells_to_maximum(np.ascontiguousarray(triangles), x, y, side, heights)
    for body_radius, height in reaches:
        raised = np.empty((rows, columns))
        dilate_heights(heights, reach_in_cells(body_radius, side), raised)
        np.maximum(safe, raised + height, out=safe)
    return SafeTiles(safe, x, y, side)


def heights_around_holes(triangles: NDArray[np.float64], xy: NDArray[np.float64], radius: Floats) -> HoleRims:
    """Return the surface around holes at the positions `xy`, float64[n, 2], for tools with the given radii, float64[n].

    The function evaluates the centre and the rim just outside the tool, because a hole may be open in the mesh.
    """
    from leafcut.kernels.surface import mesh_heights_at

    angle = np.linspace(0.0, math.tau, RIM_PLACES, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = xy[:, None, :] + (radius + RIM)[:, None, None] * circle[None]
    points = np.concatenate([points, xy[:, None, :]], axis=1).reshape(-1, 2)
    order = np.argsort(points[:, 0], kind="stable")
    sorted_top, sorted_under = np.full(len(points), -np.inf), np.full(len(points), np.inf)
    x, y = (np.ascontiguousarray(points[order, k]) for k in range(2))
    first = np.searchsorted(x, triangles[:, :, 0].min(axis=1))
    mesh_heights_at(np.ascontiguousarray(triangles), first, x, y, sorted_top, sorted_under)
    top, under = np.empty(len(points)), np.empty(len(points))
    top[order], under[order] = sorted_top, sorted_under
    tops, unders = top.reshape(len(xy), -1), under.reshape(len(xy), -1)
    return HoleRims(tops.max(axis=1), tops[:, :-1].min(axis=1), unders[:, :-1].min(axis=1))
