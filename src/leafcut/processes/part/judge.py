"""Check that a program mills each edge of the part once, on the right side, through the plate, and leaves its tabs.

The judge reads the program as straight moves of the mill and compares them with the drawn edges. It computes the path
beside each edge with shapely, not with the offset of the planner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Points
from leafcut.material.straight_moves import StraightMoves, straight_moves
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Toolpath
from leafcut.processes.part.model import Edge, PartRequest
from leafcut.proof.difference import limit_differences, position_text

#: Largest distance between the tool's path and the ideal path, mm: tolerance of the plan, chords, and written decimals.
TOLERANCE = 0.03
#: Maximum distance of chords from the arcs of the program and of the drawing, mm.
_CHORD = 0.002
#: Tolerance of heights, mm.
_HEIGHT = 0.002
#: Half of the width of the strip along a cut in which the ideal path must lie, mm.
_STRIP = 2.0 * TOLERANCE
#: Smallest width of the path in an opening that is hardly wider than the tool, mm.
_NARROWEST = 0.01
#: Chords per quarter of the circle that grows an edge.
_QUARTER = 256
#: Maximum length of a straight move, mm; no move is divided.
_WHOLE = 1e9


def judge_part(request: PartRequest, written: Toolpath) -> list[Difference]:
    """Return the differences between a program and the request; an empty list is the proof.

    1. No cut takes the tool into the finished part or below the request's `bottom`.
    2. Each cut runs along an edge, and each edge is cut through all around, except at its tabs.
    3. Each tab is as wide as requested, the cut over it is at its top, and no cut goes through it.
    4. An edge is finished before the cut of an edge around it starts.
    5. With tabs, each part is connected to the plate after all cuts.
    6. Each hole is drilled once, with its tool, to its depth, before the cuts; nothing else is drilled.
    """
    moves = straight_moves(written, _CHORD, _WHOLE)
    low = ~moves.rapid & (np.minimum(moves.ends[:, 2], moves.ends[:, 5]) < -_HEIGHT)
    drills = {hole.tool for hole in request.holes}
    cutting = low & ~np.isin(moves.tool, list(drills - {request.tool}))
    ends, rows = moves.ends[cutting], moves.row[cutting]
    lines = np.asarray(shapely.linestrings(ends.reshape(-1, 2, 3)[:, :, :2]))
    shapes = [shapely.Polygon(edge.path.flattened(_CHORD)) for edge in request.edges]
    material = _material(shapes)
    rings = [
        _centre_rings(shape, edge, request.radius, material) for shape, edge in zip(shapes, request.edges, strict=True)
    ]

    def at(row: int) -> int:
        return int(moves.path.line[row])

    differences = [
        Difference(Message("tool"), 0, at(row), Message("the cut uses tool {}, not tool {}", tool, request.tool))
        for row, tool in zip(rows.tolist(), moves.tool[cutting].tolist(), strict=True)
        if tool != request.tool
    ]
    differences += [
        Difference(
            Message("gouge"), 0, at(int(rows[k])), Message("the cut ends inside the part, at {}", _place(ends[k]))
        )
        for k in np.flatnonzero(shapely.dwithin(lines, material, request.radius - TOLERANCE)).tolist()
    ]
    differences += [
        Difference(
            Message("depth"),
            0,
            at(int(rows[k])),
            Message("the cut is below Z{:g}, at {}", request.bottom, _place(ends[k])),
        )
        for k in np.flatnonzero(ends[:, [2, 5]].min(axis=1) < request.bottom - _HEIGHT).tolist()
    ]
    owner = _owners(lines, rings)
    tab_top = request.tabs.height - request.thickness
    into_tabs = shapely.STRtree(lines[ends[:, [2, 5]].min(axis=1) < tab_top - _HEIGHT])
    differences += [
        Difference(
            Message("cut not drawn"), 0, at(int(rows[k])), Message("a cut at {} follows no edge", _place(ends[k]))
        )
        for k in np.flatnonzero(owner < 0).tolist()
    ]
    for number, (edge, own_rings) in enumerate(zip(request.edges, rings, strict=True)):
        mine = owner == number
        for ring in own_rings:
            differences += _check_ring(request, edge, ring, ends[mine], lines[mine], into_tabs)
    differences += _check_order(request, owner, rows, at)
    differences += _check_held(request, lines[ends[:, [2, 5]].max(axis=1) <= _HEIGHT - request.thickness], material)
    return limit_differences([*differences, *_check_holes(request, moves, low & ~cutting, rows, at)])


def _material(shapes: Sequence[Any]) -> Any:
    """Return the area of the finished part."""
    material = shapely.Polygon()
    for shape in sorted(shapes, key=lambda one: -one.area):
        # An edge inside another one always has the smaller area, so that openings cut outlines and contain others.
        material = material.symmetric_difference(shape)
    shapely.prepare(material)
    return material


def _centre_rings(shape: Any, edge: Edge, radius: float, material: Any) -> list[Any]:
    """Return the closed paths of the tool's centre along an edge, as shapely lines.

    A path that would take the tool into the finished part, as in a gap narrower than the tool, is left out.
    """
    grown = shape.buffer(-radius if edge.inside else radius, quad_segs=_QUARTER)
    pieces = [piece for piece in getattr(grown, "geoms", [grown]) if not piece.is_empty]
    # The remainder of a passage exactly as wide as the tool is no path.
    rings = [piece.exterior for piece in pieces if 2.0 * piece.area > _NARROWEST * piece.exterior.length]
    return [ring for ring in rings if not shapely.dwithin(ring, material, radius - TOLERANCE)]


def _owners(lines: NDArray[Any], rings: Sequence[Sequence[Any]]) -> NDArray[np.int64]:
    """Return the edge whose path each move follows, int64[n]; -1 if a move follows none."""
    paths = [(number, ring) for number, own in enumerate(rings) for ring in own]
    owner = np.full(len(lines), -1, dtype=np.int64)
    if not paths or not len(lines):
        return owner
    tree = shapely.STRtree(lines)
    for number, ring in paths:
        owner[tree.query(ring.buffer(TOLERANCE), predicate="covers")] = number
    return owner


def _check_ring(
    request: PartRequest,
    edge: Edge,
    ring: Any,
    ends: NDArray[np.float64],
    lines: NDArray[Any],
    into_tabs: shapely.STRtree,
) -> list[Difference]:
    """Check that the moves along a ring cut through the plate, apart from its tabs.

    `into_tabs` has all cuts below the tops of tabs.
    """
    tabs, diameter = request.tabs, 2.0 * request.radius
    highest = ends[:, [2, 5]].max(axis=1)
    through = ring.difference(_followed(lines[highest <= request.bottom + _HEIGHT]))
    left = [piece for piece in shapely.get_parts(_joined(through)) if piece.length > TOLERANCE]
    wanted = None if edge.inside else tabs.count
    differences = []
    if wanted is not None and len(left) != wanted:
        words = Message(
            "{} has {} places that are not cut through, and {} tabs were requested", edge.name, len(left), wanted
        )
        differences.append(Difference(Message("tabs"), 0, 0, words))
    if wanted is None and left and len(left) != tabs.count:
        words = Message("{} is not cut through at {}", edge.name, position_text(*left[0].coords[0][:2]))
        differences.append(Difference(Message("not cut"), 0, 0, words))
    for piece in left:
        (x, y), *_, last = piece.coords
        width = math.dist((x, y), last) + 2.0 * _STRIP - diameter
        if not -2.0 * _STRIP <= width - tabs.width <= 4.0 * _STRIP:
            words = Message("a tab of {} at {} is {:.3g} mm wide", edge.name, position_text(x, y), width)
            differences.append(Difference(Message("tabs"), 0, 0, words))
        elif _is_cut_through(piece, ring, edge, request, into_tabs):
            words = Message("a cut goes through a tab of {} at {}", edge.name, position_text(x, y))
            differences.append(Difference(Message("tabs"), 0, 0, words))
    top = tabs.height - request.thickness
    above = ring.difference(_followed(lines[highest <= (top if left else request.bottom) + _HEIGHT]))
    if not above.is_empty and above.length > TOLERANCE:
        at = shapely.get_parts(above)[0].coords[0]
        words = Message("material above the tabs of {} is not cut at {}", edge.name, position_text(*at[:2]))
        differences.append(Difference(Message("not cut"), 0, 0, words))
    return differences


def _is_cut_through(piece: Any, ring: Any, edge: Edge, request: PartRequest, into_tabs: shapely.STRtree) -> bool:
    """Return whether a cut reaches the area that must remain of the tab on a piece of the ring."""
    start, end = piece.coords[0], piece.coords[-1]
    middle = piece.interpolate(0.5, normalized=True).coords[0]
    left = shapely.Point(middle[0] - _NARROWEST * (end[1] - start[1]), middle[1] + _NARROWEST * (end[0] - start[0]))
    waste_left = shapely.Polygon(ring).contains(left) == edge.inside
    area = request.tabs.area(start, end, middle, request.radius, waste_left=waste_left)
    return len(into_tabs.query(area, predicate="dwithin", distance=request.radius - 2.0 * _STRIP)) > 0


def _followed(lines: NDArray[Any]) -> Any:
    """Return the strip along some moves; its round ends reach `_STRIP` mm into the tabs."""
    return shapely.union_all(shapely.buffer(lines, _STRIP))


def _joined(pieces: Any) -> Any:
    """Return pieces of a ring with the two pieces at the start of the ring joined."""
    return shapely.line_merge(pieces) if pieces.geom_type == "MultiLineString" else pieces


def _check_order(request: PartRequest, owner: NDArray[np.int64], rows: NDArray[np.int64], at: Any) -> list[Difference]:
    span = {number: rows[owner == number] for number in np.unique(owner[owner >= 0]).tolist()}
    return [
        Difference(
            Message("order"),
            0,
            at(int(own[-1])),
            Message("{} is milled after {}", request.edges[number].name, request.edges[around].name),
        )
        for number, own in span.items()
        for around in request.edges[number].within
        if around in span and own[-1] > span[around][0]
    ]


def _check_held(request: PartRequest, through: NDArray[Any], material: Any) -> list[Difference]:
    """Check that the cuts through the plate leave each part connected to its surroundings, if tabs were requested."""
    if not request.tabs.count or material.is_empty:
        return []
    plate = request.sheet or shapely.box(*shapely.bounds(material.envelope.buffer(8.0 * request.radius)))
    pieces = shapely.get_parts(plate.difference(shapely.union_all(through).buffer(request.radius)))
    around = pieces[shapely.intersects(pieces, plate.exterior)]
    inside = [part.representative_point() for part in shapely.get_parts(material)]
    return [
        Difference(
            Message("tabs"), 0, 0, Message("no tab connects the part at {} to the plate", position_text(at.x, at.y))
        )
        for at in inside
        if not shapely.intersects(around, at).any()
    ]


def _check_holes(
    request: PartRequest, moves: StraightMoves, drilling: NDArray[np.bool_], cuts: NDArray[np.int64], at: Any
) -> list[Difference]:
    """Check that the drills go down at the holes only, once each, to their depth, and before the first cut."""
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
            words = Message("T{} drills at {}, where the drawing has no hole for it", tool, _place(end))
            differences.append(Difference(Message("hole not drawn"), 0, at(row), words))
            continue
        visits[near] += near != last
        last = near
        lowest[near] = min(lowest[near], float(end[5]))
        if len(cuts) and row > cuts[0]:
            words = Message("the hole at {} is drilled after an edge is milled", _place(end))
            differences.append(Difference(Message("order"), 0, at(row), words))
    for hole, count, low in zip(request.holes, visits, lowest, strict=True):
        where = position_text(hole.x, hole.y)
        if count != 1:
            differences.append(
                Difference(Message("hole"), 0, 0, Message("the hole at {} is drilled {} times", where, count))
            )
        elif abs(low - hole.tip) > _HEIGHT:
            words = Message("the hole at {} is drilled to Z{:g}, not to Z{:g}", where, low, hole.tip)
            differences.append(Difference(Message("depth"), 0, 0, words))
    return differences


def _place(ends: Points) -> str:
    return position_text(*ends[3:].tolist())
