"""Check that each edge of the part is milled on the correct side, through the plate, and with its tabs.

The path beside each edge is computed with shapely, not with the offset of the planner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import Edge, PartRequest, shape_of
from leafcut.processes.part.proof.cuts import HEIGHT, STRIP, TOLERANCE, Cuts, FaceWork, Verdict, strip_along
from leafcut.proof.difference import position_text

#: Minimum width of the area of tool centres in an opening, mm; in a narrower area, the tool has no path.
_NARROWEST = 0.01
#: Chords per quarter of the circle that grows an edge.
_QUARTER = 256


def check_edges(request: PartRequest, cuts: Cuts, others: NDArray[np.bool_], material: Any) -> Verdict:
    """Check that each edge is cut through all around, except at tabs of the requested width and height.

    `others` marks the cuts of other operations, which do not count for the order of the edges. `material` is the area
    of the finished part.
    """
    shapes, tabs = [shape_of(edge) for edge in request.edges], request.tabs
    rings = [
        _centre_rings(shape, edge, request.radius, material) for shape, edge in zip(shapes, request.edges, strict=True)
    ]
    owner = _owners(cuts, rings)
    into_tabs = shapely.STRtree(cuts.lines[cuts.lowest < tabs.height - request.thickness - HEIGHT])
    differences, works = [], []
    for number, (edge, own_rings) in enumerate(zip(request.edges, rings, strict=True)):
        mine = np.flatnonzero(owner == number)
        for ring in own_rings:
            differences += _check_ring(request, edge, ring, cuts, mine, into_tabs)
        if edge.is_bore and own_rings:
            through = mine[cuts.highest[mine] <= request.bottom + HEIGHT]
            differences += _check_bore(request, edge, shapes[number], cuts.lines[through])
        works.append(FaceWork(edge.name, mine[~others[mine]], shapes[number]))
    differences += _check_held(request, cuts.lines[cuts.highest <= HEIGHT - request.thickness], material)
    return Verdict(owner >= 0, differences, works)


def _centre_rings(shape: Any, edge: Edge, radius: float, material: Any) -> list[Any]:
    """Return the closed paths of the tool's centre along an edge, as shapely lines.

    A path that would take the tool into the finished part, as in a gap narrower than the tool, is left out.
    """
    grown = shape.buffer(-radius if edge.inside else radius, quad_segs=_QUARTER)
    pieces = [piece for piece in getattr(grown, "geoms", [grown]) if not piece.is_empty]
    # A passage exactly as wide as the tool may leave a sliver, which is not a path.
    rings = [piece.exterior for piece in pieces if 2.0 * piece.area > _NARROWEST * piece.exterior.length]
    return [ring for ring in rings if not shapely.dwithin(ring, material, radius - TOLERANCE)]


def _owners(cuts: Cuts, rings: Sequence[Sequence[Any]]) -> NDArray[np.int64]:
    """Return the edge whose path each cut follows, int64[n]; -1 if a cut follows none."""
    owner = np.full(len(cuts), -1, dtype=np.int64)
    for number, own in enumerate(rings):
        for ring in own:
            owner[cuts.along(ring)] = number
    return owner


def _check_ring(
    request: PartRequest, edge: Edge, ring: Any, cuts: Cuts, mine: NDArray[np.int64], into_tabs: shapely.STRtree
) -> list[Difference]:
    """Check that the moves along a ring cut through the plate, except at tabs.

    `into_tabs` contains all cuts below the tops of tabs.
    """
    tabs, diameter = request.tabs, 2.0 * request.radius
    lines, highest = cuts.lines[mine], cuts.highest[mine]
    through = ring.difference(strip_along(lines[highest <= request.bottom + HEIGHT]))
    left = [piece for piece in shapely.get_parts(_joined(through)) if piece.length > TOLERANCE]
    wanted = 0 if edge.is_bore else None if edge.inside else max(edge.tabs, tabs.fewest)
    differences = []
    if wanted is not None and len(left) != wanted:
        words = Message(
            "{} has {} places that are not cut through, but {} tabs were requested", edge.name, len(left), wanted
        )
        differences.append(Difference(Message("tabs"), 0, 0, words))
    if wanted is None and left and len(left) != tabs.count:
        words = Message("{} is not cut through at {}", edge.name, position_text(*left[0].coords[0][:2]))
        differences.append(Difference(Message("not cut"), 0, 0, words))
    for piece in left:
        (x, y), *_, last = piece.coords
        width = math.dist((x, y), last) + 2.0 * STRIP - diameter
        if not -2.0 * STRIP <= width - tabs.width <= 4.0 * STRIP:
            words = Message("a tab of {} at {} is {:.3g} mm wide", edge.name, position_text(x, y), width)
            differences.append(Difference(Message("tabs"), 0, 0, words))
        elif _is_cut_through(piece, ring, edge, request, into_tabs):
            words = Message("a cut goes through a tab of {} at {}", edge.name, position_text(x, y))
            differences.append(Difference(Message("tabs"), 0, 0, words))
    top = tabs.height - request.thickness
    above = ring.difference(strip_along(lines[highest <= (top if left else request.bottom) + HEIGHT]))
    if not above.is_empty and above.length > TOLERANCE:
        at = shapely.get_parts(above)[0].coords[0]
        words = Message("material above the tabs of {} is not cut at {}", edge.name, position_text(*at[:2]))
        differences.append(Difference(Message("not cut"), 0, 0, words))
    return differences


def _check_bore(request: PartRequest, edge: Edge, shape: Any, lines: NDArray[Any]) -> list[Difference]:
    """Check that no slug remains in a bore."""
    slug = shape.buffer(-STRIP).difference(shapely.union_all(lines).buffer(request.radius, quad_segs=_QUARTER))
    if slug.is_empty:
        return []
    at = slug.representative_point()
    words = Message("{} has a slug at {}", edge.name, position_text(at.x, at.y))
    return [Difference(Message("not cut"), 0, 0, words)]


def _is_cut_through(piece: Any, ring: Any, edge: Edge, request: PartRequest, into_tabs: shapely.STRtree) -> bool:
    """Return whether a cut reaches the tab on a piece of the ring."""
    start, end = piece.coords[0], piece.coords[-1]
    middle = piece.interpolate(0.5, normalized=True).coords[0]
    left = shapely.Point(middle[0] - _NARROWEST * (end[1] - start[1]), middle[1] + _NARROWEST * (end[0] - start[0]))
    waste_left = shapely.Polygon(ring).contains(left) == edge.inside
    area = request.tabs.area(start, end, middle, request.radius, waste_left=waste_left)
    return len(into_tabs.query(area, predicate="dwithin", distance=request.radius - 2.0 * STRIP)) > 0


def _joined(pieces: Any) -> Any:
    """Join the two pieces that meet at the start of a ring."""
    return shapely.line_merge(pieces) if pieces.geom_type == "MultiLineString" else pieces


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
