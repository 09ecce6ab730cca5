"""Check that rapids below the top of the plate are vertical, and only descend over cleared material."""

from __future__ import annotations

import math

import numpy as np
import shapely

from leafcut.material.straight_moves import StraightMoves
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import PartRequest
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts
from leafcut.proof.difference import position_text


def check_rapids(request: PartRequest, moves: StraightMoves, cuts: Cuts) -> list[Difference]:
    """Return a `Difference` for each rapid that may hit material."""
    start, end = moves.ends[:, :3].copy(), moves.ends[:, 3:]
    # A rapid from an unknown height, such as the first one in a work offset, may come from above.
    start[~np.isfinite(moves.path.before[moves.row, 2]), 2] = math.inf
    low = moves.rapid & (np.minimum(start[:, 2], end[:, 2]) < -HEIGHT)
    level = np.hypot(*(end - start)[:, :2].T) > TOLERANCE
    drills = {hole.tool for hole in request.holes} - {request.tool}
    differences = []
    for k in np.flatnonzero(low & (level | (end[:, 2] < start[:, 2]))).tolist():
        cleared = _is_drilled(moves, k) if moves.tool[k] in drills else _is_cleared(request, moves, k, cuts)
        if level[k] or not cleared:
            words = Message("a rapid at {} goes through material", position_text(*end[k].tolist()))
            differences.append(Difference(Message("rapid into the part"), 0, int(moves.path.line[moves.row[k]]), words))
    return differences


def _is_drilled(moves: StraightMoves, k: int) -> bool:
    before = ~moves.rapid & (moves.row < moves.row[k]) & (moves.tool == moves.tool[k])
    place, ends = moves.ends[k, 3:], moves.ends[before, 3:]
    same = np.hypot(*(ends - place)[:, :2].T) <= TOLERANCE
    return bool((ends[same, 2] <= place[2] + HEIGHT).any())


def _is_cleared(request: PartRequest, moves: StraightMoves, k: int, cuts: Cuts) -> bool:
    place, tool = moves.ends[k, 3:], moves.tool[k]
    mill = request.clearing_mills.get(int(tool))
    radius = mill.radius if mill else request.radius
    disc = shapely.Point(place[:2]).buffer(radius - TOLERANCE)
    near = cuts.near(disc, radius)
    mine = (cuts.rows[near] < moves.row[k]) & (cuts.tools[near] == tool)
    near = near[mine & (cuts.highest[near] <= place[2] + HEIGHT)]
    return bool(shapely.union_all(shapely.buffer(cuts.lines[near], radius, quad_segs=64)).covers(disc))
