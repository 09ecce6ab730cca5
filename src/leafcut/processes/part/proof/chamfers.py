"""Check that each chamfer is cut exactly once, around its edge, at its depth, and into no other wall.

The check computes the path of the tip with shapely and does not use the planner's offset.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import CHORD, Chamfer, PartRequest
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts, FaceWork, Verdict, strip_along
from leafcut.proof.difference import position_text

#: Maximum length of the cuts at full depth, relative to the length of the path.
_ONCE = 1.01
#: Number of chords per quarter circle when an edge is offset.
_QUARTER = 256


def check_chamfers(request: PartRequest, cuts: Cuts) -> Verdict:
    """Find the cuts along each chamfer, and check them against the request."""
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences: list[Difference] = []
    works = []
    walls = [shapely.LinearRing(edge.path.flattened(CHORD)) for edge in request.edges]
    for chamfer in request.chamfers:
        drawn = shapely.LinearRing(chamfer.path.flattened(CHORD))
        ring, depth = _tip_ring(drawn, chamfer), chamfer.width / chamfer.bit.spread
        along = cuts.along(ring)
        own = along[(cuts.tools[along] == chamfer.bit.tool) & (cuts.lowest[along] >= -depth - HEIGHT)]
        explained[own] = True
        floor = own[cuts.highest[own] <= -depth + HEIGHT]
        left = ring.difference(strip_along(cuts.lines[floor]))
        if left.length > TOLERANCE:
            x, y = shapely.get_coordinates(left)[0].tolist()
            words = Message("{} has no chamfer of {:g} mm at {}", chamfer.name, chamfer.width, position_text(x, y))
            differences.append(Difference(Message("not cut"), 0, 0, words))
        elif float(shapely.length(cuts.lines[floor]).sum()) > _ONCE * ring.length + 2.0 * TOLERANCE:
            words = Message("the chamfer of {} is cut more than once", chamfer.name)
            differences.append(cuts.difference(Message("cut twice"), int(floor[-1]), words))
        reach = chamfer.bit.tip + chamfer.width - TOLERANCE
        for edge, wall in zip(request.edges, walls, strict=True):
            if shapely.dwithin(ring, wall, reach) and not wall.equals(drawn):
                words = Message("the chamfer of {} cuts into {}", chamfer.name, edge.name)
                differences.append(Difference(Message("gouge"), 0, 0, words))
        works.append(FaceWork(chamfer.name, own, drawn))
    return Verdict(explained, differences, works)


def _tip_ring(drawn: Any, chamfer: Chamfer) -> Any:
    """Return the closed path of the tip, as a shapely line.

    The mill leaves its own radius in the inner corners of the edge. The flat of the tip runs beside the edge.
    """
    sign = -1.0 if chamfer.inside else 1.0
    centres = shapely.Polygon(drawn).buffer(sign * chamfer.corner, quad_segs=_QUARTER)
    area = centres.buffer(sign * (chamfer.bit.tip - chamfer.corner), quad_segs=_QUARTER)
    return shapely.union_all([piece.exterior for piece in shapely.get_parts(area)])
