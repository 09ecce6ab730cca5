"""Check that grooves separate the copper shapes, that they are as wide as requested, and that no cut enters the copper.

The check uses the drawn copper and the area that the tool sweeps at the surface. It does not use the planned paths.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import Isolation, PartRequest
from leafcut.processes.part.proof.cuts import HEIGHT, Cuts, FaceWork, Verdict
from leafcut.proof.difference import position_text

#: Maximum deviation of a groove, mm. It covers the tolerance of the path, chords, and rounded decimals.
_NEAR = 0.01
#: A gap must be cut even if each side lacks this much room for the tool, mm. A gap of exactly the tool's width is cut.
_TIGHT = 0.0025
#: Number of chords per quarter of a circle.
_QUARTER = 32
#: Maximum length of the cuts at full depth, relative to the length of the edges of the grown copper.
_ONCE = 1.02


def check_isolations(request: PartRequest, cuts: Cuts) -> Verdict:
    """Find the cuts around the copper of each layer, and check them against the request."""
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences: list[Difference] = []
    works = []
    for one in request.isolations:
        name = Message("the copper on layer {}", one.layer)
        inner, outer = (_grown(one, d) for d in (one.radius - _NEAR, one.offsets[-1] + _NEAR))
        mine = (cuts.tools == one.tool) & (cuts.lowest >= -one.depth - HEIGHT)
        inside = cuts.within(outer)
        shapely.prepare(inner)
        # A cut may touch the area that it must not enter.
        own = inside[mine[inside] & ~shapely.crosses(cuts.lines[inside], inner)]
        own = own[~shapely.within(cuts.lines[own], inner)]
        explained[own] = True
        floor = own[cuts.highest[own] <= -one.depth + HEIGHT]
        differences += _check_grooves(one, name, cuts, floor)
        works.append(FaceWork(name, own, outer))
    return Verdict(explained, differences, works)


def _grown(one: Isolation, distance: float) -> Any:
    return one.copper.buffer(distance, quad_segs=_QUARTER)


def _check_grooves(one: Isolation, name: Message, cuts: Cuts, floor: Any) -> list[Difference]:
    """Check the width of the grooves, and that they separate the shapes where the tool fits between them."""
    lines = shapely.union_all(cuts.lines[floor])
    swept = lines.buffer(one.radius, quad_segs=_QUARTER)
    edges = [_grown(one, offset).boundary for offset in one.offsets]
    # In a gap of the tool's width, the path has no area. So the copper is grown a little less as well.
    slim = [_grown(one, offset - _TIGHT).boundary for offset in one.offsets]
    groove = shapely.union_all([edge.buffer(one.radius - 2.0 * _NEAR, quad_segs=_QUARTER) for edge in (*edges, *slim)])
    left = groove - swept.buffer(_NEAR)
    if not left.buffer(-0.1 * _NEAR).is_empty:
        point = left.representative_point()
        words = Message("{} is not isolated {:g} mm deep at {}", name, one.depth, position_text(point.x, point.y))
        return [Difference(Message("not cut"), 0, 0, words)]
    differences = [
        Difference(Message("not cut"), 0, 0, Message("two shapes of {} are still connected at {}", name, place))
        for place in _connected(one, swept)
    ]
    length = float(shapely.length(cuts.lines[floor]).sum())
    drawn = sum(max(edge.length, thin.length) for edge, thin in zip(edges, slim, strict=True))
    if length > _ONCE * drawn + 2.0 * _NEAR:
        words = Message("{} is isolated {:.2g} times", name, length / drawn)
        differences.append(cuts.difference(Message("cut twice"), int(floor[-1]), words))
    return differences


def _connected(one: Isolation, swept: Any) -> list[str]:
    """Return a place in each shape that is connected to another one, although the tool fits between them."""
    pieces = shapely.get_parts(one.copper)
    around = shapely.box(*one.copper.bounds).buffer(2.0 * one.offsets[-1] + 2.0 * one.radius)
    # Copper that cannot be separated belongs together.
    together = shapely.get_parts(_grown(one, one.radius - _TIGHT))
    remaining = shapely.get_parts(around - swept)
    points = shapely.point_on_surface(shapely.buffer(pieces, -2.0 * _NEAR))
    group = dict(shapely.STRtree(together).query(points, predicate="within").T.tolist())
    piece_of: dict[int, int] = {}
    found = []
    for piece, rest in shapely.STRtree(remaining).query(points, predicate="within").T.tolist():
        first = piece_of.setdefault(rest, piece)
        if group.get(first) != group.get(piece):
            found.append(position_text(points[piece].x, points[piece].y))
    return found
