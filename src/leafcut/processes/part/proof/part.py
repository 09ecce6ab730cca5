"""Check that a program does all the requested work on a part, and makes no other cuts.

The program is read back as straight tool moves. Each operation claims the moves that belong to it. Every unclaimed move
is reported as a difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Toolpath
from leafcut.processes.part.model import CHORD, PartRequest, material_of
from leafcut.processes.part.proof.carving import check_carvings
from leafcut.processes.part.proof.chamfers import check_chamfers
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts, FaceWork, Verdict
from leafcut.processes.part.proof.depths import check_depths
from leafcut.processes.part.proof.edges import check_edges
from leafcut.processes.part.proof.engraving import check_engravings
from leafcut.processes.part.proof.holes import check_holes
from leafcut.processes.part.proof.isolation import check_isolations
from leafcut.processes.part.proof.pockets import check_pockets
from leafcut.processes.part.proof.rapids import check_rapids
from leafcut.proof.difference import limit_differences

#: Maximum length of a straight move, mm. Moves are not divided.
_WHOLE = 1e9


def judge_part(request: PartRequest, written: Toolpath) -> list[Difference]:
    """Compare a program with the request. The program is correct if the returned list is empty.

    The comparison checks these rules:

    1. No cut takes the tool into the finished part or below `bottom`.
    2. Each cut runs along an edge. The cuts go through the plate all around each edge, except at its tabs.
    3. Each tab has the requested width and is cut down to its top, and no cut goes through it.
    4. An edge is finished before the tool cuts an edge around it.
    5. If tabs are requested, each part stays connected to the plate after all cuts.
    6. Each hole is drilled once with its tool, to its depth, before all cuts. Nothing else is drilled.
    7. Each path is engraved once, to its depth, before the edges that enclose or cross it.
    8. Each pocket is cleared to its depth before the edges inside and around it. No level exceeds the step-down, and
       moves faster than the feed do not touch material. In a pocket of two mills, the second mill starts after the
       first mill, clears what the first mill cannot reach, and never plunges into material.
    9. If a finishing allowance is requested, roughing leaves it on each wall. A pass along the wall follows at full
       depth in the milling direction.
    10. Rapids below the top are vertical, and only descend over cleared material.
    11. Each chamfer is cut once, to its depth, before its edge and the edges around it. It cuts into no other wall.
    12. Each carved shape is cut to its walls and no further, before the edges that enclose or cross it.
        The end mill clears the floor of a shape where it fits, before the V-bit, which clears the rest of the floor.
    13. No cut is deeper than the step-down of its mill.
    14. Grooves of the requested width separate the copper shapes of a board wherever the tool fits between them, before
        the edges that enclose or cross them. They do not enter the copper.
    """
    moves = convert_to_straight_moves(written, CHORD, _WHOLE)
    low = ~moves.rapid & (np.minimum(moves.ends[:, 2], moves.ends[:, 5]) < -HEIGHT)
    drills = {hole.tool for hole in request.holes}
    cutting = low & ~np.isin(moves.tool, list(drills - {request.tool}))
    cuts = Cuts(moves, cutting)
    pockets = check_pockets(request, cuts)
    face_checks = (check_engravings, check_chamfers, check_carvings, check_isolations)
    others = [pockets, *(check(request, cuts) for check in face_checks)]
    known = np.logical_or.reduce([other.explained for other in others])
    material = material_of(request.edges)
    edges = check_edges(request, cuts, known, material)
    return limit_differences(
        [
            *_check_places(request, cuts, edges, known, material),
            *(difference for other in (edges, *others) for difference in other.differences),
            *_check_order(request, cuts, edges, [work for other in others for work in other.works]),
            *check_rapids(request, moves, cuts),
            *check_depths(request, cuts, pockets.explained),
            *check_holes(request, moves, low & ~cutting, cuts),
        ]
    )


def _check_places(
    request: PartRequest, cuts: Cuts, edges: Verdict, others: NDArray[np.bool_], material: Any
) -> list[Difference]:
    """Check that each cut belongs to an operation, and that no cut is too deep or enters the finished part.

    `material` is the area of the finished part. `others` marks the cuts on the top face.
    """
    in_part = shapely.dwithin(cuts.lines, material, request.radius - TOLERANCE) & ~others
    differences = [
        cuts.difference(
            Message("tool"), k, Message("the cut uses tool {}, not tool {}", int(cuts.tools[k]), request.tool)
        )
        for k in np.flatnonzero((cuts.tools != request.tool) & ~others).tolist()
    ]
    differences += [
        cuts.difference(Message("gouge"), k, Message("the cut ends inside the part, at {}", cuts.place(k)))
        for k in np.flatnonzero(in_part).tolist()
    ]
    differences += [
        cuts.difference(Message("depth"), k, Message("the cut is below Z{:g}, at {}", request.bottom, cuts.place(k)))
        for k in np.flatnonzero(cuts.lowest < request.bottom - HEIGHT).tolist()
    ]
    differences += [
        cuts.difference(
            Message("cut not drawn"), k, Message("a cut at {} follows no edge of the drawing", cuts.place(k))
        )
        for k in np.flatnonzero(~edges.explained & ~others).tolist()
    ]
    return differences


def _check_order(request: PartRequest, cuts: Cuts, edges: Verdict, works: Sequence[FaceWork]) -> list[Difference]:
    """Check the order of the work.

    Work on the top face, such as pockets, must be finished before the edges that enclose or cross it. Inner edges must
    be finished before outer edges. Cuts along an edge never count as part of a pocket, because the mill passes through
    a pocket when it enters an opening in the pocket's floor.
    """
    names, own_cuts, shapes = zip(*edges.works, strict=True) if edges.works else ((), (), ())
    pairs = [(edges.works[k], around) for k, edge in enumerate(request.edges) for around in edge.within]
    tree = shapely.STRtree(shapes)
    works = [work._replace(cuts=work.cuts[~edges.explained[work.cuts]]) for work in works]
    pairs += [(work, around) for work in works for around in tree.query(work.area, predicate="intersects").tolist()]
    return [
        cuts.difference(
            Message("order"), int(work.cuts[-1]), Message("{} is milled after {}", work.name, names[around])
        )
        for work, around in pairs
        if len(work.cuts) and len(own_cuts[around]) and cuts.rows[work.cuts[-1]] > cuts.rows[own_cuts[around][0]]
    ]
