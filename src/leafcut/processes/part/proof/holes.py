"""Check that each hole is drilled exactly once, with the correct drill, to the correct depth, and before all cuts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.material.straight_moves import StraightMoves
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import PartRequest
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts
from leafcut.proof.difference import position_text


def check_holes(
    request: PartRequest, moves: StraightMoves, drilling: NDArray[np.bool_], cuts: Cuts
) -> list[Difference]:
    """Check that each hole is drilled once to its depth before the first cut.

    The program must not drill anything else.
    """
    ends, tools, rows = moves.ends[drilling], moves.tool[drilling], moves.row[drilling]
    wanted = np.array([(hole.x, hole.y) for hole in request.holes]).reshape(-1, 2)
    differences, visits = [], [0] * len(wanted)
    lowest = [0.0] * len(wanted)
    last = -1
    for end, tool, row in zip(ends, tools.tolist(), rows.tolist(), strict=True):
        away = np.hypot(*(wanted - end[3:5]).T)
        level = np.hypot(end[3] - end[0], end[4] - end[1]) > TOLERANCE
        near = int(np.argmin(np.where([hole.tool == tool for hole in request.holes], away, np.inf)))
        if level or away[near] > TOLERANCE or request.holes[near].tool != tool:
            words = Message(
                "T{} drills at {}, where the drawing has no hole for it", tool, position_text(*end[3:].tolist())
            )
            differences.append(Difference(Message("hole not drawn"), 0, int(moves.path.line[row]), words))
            continue
        visits[near] += near != last
        last = near
        lowest[near] = min(lowest[near], float(end[5]))
        if len(cuts) and row > cuts.rows[0]:
            words = Message("the hole at {} is drilled after an edge is milled", position_text(*end[3:].tolist()))
            differences.append(Difference(Message("order"), 0, int(moves.path.line[row]), words))
    for hole, count, low in zip(request.holes, visits, lowest, strict=True):
        where = position_text(hole.x, hole.y)
        if count != 1:
            differences.append(
                Difference(Message("hole"), 0, 0, Message("the hole at {} is drilled {} times", where, count))
            )
        elif abs(low - hole.tip) > HEIGHT:
            words = Message("the hole at {} is drilled to Z{:g}, not to Z{:g}", where, low, hole.tip)
            differences.append(Difference(Message("depth"), 0, 0, words))
    return differences
