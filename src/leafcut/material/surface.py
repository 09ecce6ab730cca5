"""A mesh seen from above: how high it must be crossed, and where holes begin and end in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats

#: Tiles along the longer side of a part; where the axes of a rapid do not arrive together every tile of the box between
#: two places counts, and there are fewer. 8 bytes each: half a megabyte.
TILES, TILES_DOGLEG = 256, 64
#: Tiles are no finer than this, mm, and so many at most lie within the reach of a tool: more take long.
FINEST_TILE, MOST_IN_REACH = 0.2, 24
#: The rim of a hole is looked at so far outside of its tool, mm, at so many places.
RIM, RIM_PLACES = 0.1, 24


class SafeTiles(NamedTuple):
    """Square tiles, and the height at which each may be crossed.

    Attributes
    ----------
    heights
        float64[rows, columns], mm: row by row from the lowest y; −∞ where nothing stands.
    x, y, side
        The lower left corner of the first tile, and the side of a tile, mm.
    """

    heights: NDArray[np.float64]
    x: float
    y: float
    side: float


class Rims(NamedTuple):
    """The surface around holes, float64[n] each, mm.

    Attributes
    ----------
    top
        The highest place of the rim and the middle.
    lowest
        The lowest place of the rim's upper side; −∞ where part of the rim has no material under it.
    under
        The lowest place of all triangles under the rim.
    """

    top: Floats
    lowest: Floats
    under: Floats


def safe_tiles(
    triangles: NDArray[np.float64],
    radius: float,
    above: float,
    most: int = TILES,
    bodies: Sequence[tuple[float, float]] = (),
) -> SafeTiles:
    """Return how high a tool's tip must be to cross a surface.

    Exact in height; around what stands the tiles are taken whole, so up to two tiles too much aside.

    Parameters
    ----------
    triangles
        float64[n, 3, 3], mm.
    radius
        Of the tool, with the room that it keeps aside, mm.
    above
        How far over the surface it stays, mm.
    most
        Tiles along the longer side.
    bodies
        Of what is above the flutes: radius, and how far over the surface the tip must be for it, mm; negative where it
        is higher than the tip by more than the room that it keeps.
    """
    from leafcut.kernels.surface import raise_around, raise_whole_cells, reach_in_cells

    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    reaches = [(radius, above), *bodies]
    reach = max(one for one, _ in reaches)
    side = max(float(max(high[:2] - low[:2])) / most, FINEST_TILE, reach / MOST_IN_REACH)
    margin = math.ceil(reach / side) + 1
    x, y = float(low[0]) - margin * side, float(low[1]) - margin * side
    columns, rows = (math.ceil(float(high[k] - low[k]) / side) + 2 * margin + 1 for k in range(2))
    heights, safe = np.full((rows, columns), -np.inf), np.full((rows, columns), -np.inf)
    raise_whole_cells(np.ascontiguousarray(triangles), x, y, side, heights)
    for around, over in reaches:
        widest = np.empty((rows, columns))
        raise_around(heights, reach_in_cells(around, side), widest)
        np.maximum(safe, widest + over, out=safe)
    return SafeTiles(safe, x, y, side)


def rims_of(triangles: NDArray[np.float64], xy: NDArray[np.float64], radius: Floats) -> Rims:
    """Return what the surface is around the holes at places float64[n, 2] for tools of these radii, float64[n].

    In the mesh of a finished part a hole is open already, and in that of a blank it is not: so its rim counts, just
    outside of the tool, and its middle.
    """
    from leafcut.kernels.surface import heights_at

    angle = np.linspace(0.0, math.tau, RIM_PLACES, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    places = xy[:, None, :] + (radius + RIM)[:, None, None] * circle[None]
    places = np.concatenate([places, xy[:, None, :]], axis=1).reshape(-1, 2)
    order = np.argsort(places[:, 0], kind="stable")
    found_top, found_under = np.full(len(places), -np.inf), np.full(len(places), np.inf)
    x, y = (np.ascontiguousarray(places[order, k]) for k in range(2))
    heights_at(np.ascontiguousarray(triangles), x, y, found_top, found_under)
    top, under = np.empty(len(places)), np.empty(len(places))
    top[order], under[order] = found_top, found_under
    tops, unders = top.reshape(len(xy), -1), under.reshape(len(xy), -1)
    return Rims(tops.max(axis=1), tops[:, :-1].min(axis=1), unders[:, :-1].min(axis=1))
