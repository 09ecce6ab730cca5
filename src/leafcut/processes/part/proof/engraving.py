"""Check that each path is engraved exactly once, over its full length, with the correct tool and to the correct
depth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import Engraving, PartRequest
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts, FaceWork, Verdict, strip_along
from leafcut.proof.difference import position_text

#: Maximum length of the cuts at full depth, relative to the length of the path.
_ONCE = 1.01


def check_engravings(request: PartRequest, cuts: Cuts) -> Verdict:
    """Find the cuts that engrave a path, and check them against the request."""
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences, works = [], []
    lines = [engraving.line for engraving in request.engravings]
    tree = shapely.STRtree(lines)
    for engraving, line in zip(request.engravings, lines, strict=True):
        along = cuts.along(line)
        own = along[(cuts.tools[along] == engraving.tool) & (cuts.lowest[along] >= -engraving.depth - HEIGHT)]
        explained[own] = True
        floor = own[cuts.highest[own] <= -engraving.depth + HEIGHT]
        strip = line.buffer(TOLERANCE)
        # Drawn paths may share lines, which are engraved once for each path.
        drawn = [
            lines[k].intersection(strip).length
            for k in tree.query(strip, predicate="intersects").tolist()
            if (request.engravings[k].tool, request.engravings[k].depth) == (engraving.tool, engraving.depth)
        ]
        differences += _check_path(engraving, line, sum(drawn), cuts, floor)
        works.append(FaceWork(engraving.name, own, line))
    return Verdict(explained, differences, works)


def _check_path(engraving: Engraving, line: Any, drawn: float, cuts: Cuts, floor: Any) -> list[Difference]:
    """Check that the cuts at full depth cover the whole path, and that their total length is at most `drawn` mm."""
    left = line.difference(strip_along(cuts.lines[floor]))
    if left.length > TOLERANCE:
        x, y = shapely.get_coordinates(left)[0].tolist()
        words = Message("{} is not engraved {:g} mm deep at {}", engraving.name, engraving.depth, position_text(x, y))
        return [Difference(Message("not cut"), 0, 0, words)]
    length = float(shapely.length(cuts.lines[floor]).sum())
    if length > _ONCE * drawn + 2.0 * TOLERANCE:
        words = Message("{} is engraved {:.2g} times", engraving.name, length / line.length)
        return [cuts.difference(Message("cut twice"), int(floor[-1]), words)]
    return []
