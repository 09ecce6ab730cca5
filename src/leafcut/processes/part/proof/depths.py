"""Check that no cut is deeper than the step-down of its mill, measured from the surface that earlier cuts left."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import PartRequest
from leafcut.processes.part.proof.cuts import STRIP, Cuts, points_on

#: Maximum distance between checked points on a cut, mm.
_SPACING = 0.5
#: Tolerance of the depth, mm. A ramp may be `STRIP` mm beside the earlier cuts.
_SLACK = STRIP
#: Number of points that are checked at once.
_BLOCK = 20_000


def check_depths(request: PartRequest, cuts: Cuts, pockets: NDArray[np.bool_]) -> list[Difference]:
    """Find cuts that go deeper than the step-down. `pockets` marks the cuts in pockets, which have their own check.

    The surface at a point is the lowest earlier cut along the same path. If that is too high, earlier cuts of all mills
    count whose radius reaches the point. So material beside the centre of the mill is not measured.
    """
    steps = np.array([request.steps.get(int(tool), np.inf) for tool in cuts.tools])
    deep = np.flatnonzero((cuts.lowest < -steps - _SLACK) & ~pockets)
    which, points = points_on(cuts.ends[deep], _SPACING)
    cut = deep[which]
    radii = {request.tool: request.radius, **{tool: mill.radius for tool, mill in request.clearing_mills.items()}}
    reach = np.array([radii.get(int(tool), 0.0) for tool in cuts.tools])
    differences: list[Difference] = []
    for first in range(0, len(cut), _BLOCK):
        block, places = cut[first : first + _BLOCK], points[first : first + _BLOCK]
        for distances in (np.full(len(cuts), STRIP), reach):
            over = _surface(cuts, block, places, distances) - places[:, 2] > steps[block] + _SLACK
            block, places = block[over], places[over]
            if not len(block):
                break
        for k in np.unique(block).tolist():
            words = Message(
                "more than the step-down of {:.3f} mm would be cut at once near {}", float(steps[k]), cuts.place(k)
            )
            differences.append(cuts.difference(Message("too deep"), k, words))
    return differences


def _surface(cuts: Cuts, cut: NDArray[np.int64], places: Floats, distances: Floats) -> Floats:
    """Return the height of the surface at each place before its own cut, float64[n], mm.

    Earlier cuts count up to the distance in `distances`, float64[cuts], mm.
    """
    surface = np.zeros(len(cut))
    points = shapely.points(places[:, :2])
    near, other = cuts.tree.query(points, predicate="dwithin", distance=float(distances.max(initial=0.0)))
    near, other = near[other < cut[near]], other[other < cut[near]]
    start, move = cuts.ends[other, :3], cuts.ends[other, 3:] - cuts.ends[other, :3]
    length = (move[:, :2] ** 2).sum(axis=1)
    share = ((places[near, :2] - start[:, :2]) * move[:, :2]).sum(axis=1) / np.where(length > 0.0, length, 1.0)
    share = np.clip(share, 0.0, 1.0)
    apart = np.hypot(*(places[near, :2] - start[:, :2] - share[:, None] * move[:, :2]).T)
    height = np.where(length > 0.0, start[:, 2] + share * move[:, 2], cuts.lowest[other])
    close = apart <= distances[other]
    np.minimum.at(surface, near[close], height[close])
    return surface
