"""Check that each edge of the part is milled through the plate on the correct side, with tabs and a finishing pass.

The check computes the path along each edge with shapely and does not use the planner's offset.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.part.model import Edge, PartRequest, shape_of
from leafcut.processes.part.proof.cuts import HEIGHT, STRIP, TOLERANCE, Cuts, FaceWork, Verdict, strip_along
from leafcut.proof.difference import position_text

#: Minimum width of the area of tool centres in an opening, mm. A narrower area has no tool path.
_NARROWEST = 0.01
#: Number of chords per quarter circle when an edge is offset.
_QUARTER = 256


def check_edges(request: PartRequest, cuts: Cuts, others: NDArray[np.bool_], material: Any) -> Verdict:
    """Check that the cuts go through the plate all around each edge, except at tabs of the requested size.

    If a finishing allowance is requested, roughing must leave it on the wall, and a finishing pass must follow.
    `others` marks the cuts of other operations, which do not affect the order of the edges. `material` is the area of
    the finished part.
    """
    shapes, tabs = [shape_of(edge) for edge in request.edges], request.tabs
    rings = [
        _centre_rings(shape, edge, request.radius, material) for shape, edge in zip(shapes, request.edges, strict=True)
    ]
    owner = _owners(cuts, rings)
    explained = owner >= 0
    rough = _roughing(request, shapes, rings, cuts, others, material) if request.finish else []
    into_tabs = shapely.STRtree(cuts.lines[cuts.lowest < tabs.height - request.thickness - HEIGHT])
    differences, works = [], []
    for number, (edge, own_rings) in enumerate(zip(request.edges, rings, strict=True)):
        mine = np.flatnonzero(owner == number)
        if rough:
            differences += _check_roughing(request, edge, own_rings, rough[number], cuts, mine)
            differences += [one for ring in own_rings for one in _check_direction(request, edge, ring, cuts, mine)]
            mine = np.union1d(mine, np.concatenate([rough[number].before, rough[number].nearer]))
            explained[mine] = True
        for ring in own_rings:
            differences += _check_ring(request, edge, ring, cuts, mine, into_tabs)
        if edge.is_bore and own_rings:
            through = mine[cuts.highest[mine] <= request.bottom + HEIGHT]
            differences += _check_bore(request, edge, shapes[number], cuts.lines[through])
        works.append(FaceWork(edge.name, mine[~others[mine]], shapes[number]))
    differences += _check_held(request, cuts.lines[cuts.highest <= HEIGHT - request.thickness], material)
    return Verdict(explained, differences, works)


def _centre_rings(shape: Any, edge: Edge, radius: float, material: Any) -> list[Any]:
    """Return the closed paths of the tool centre along an edge, as shapely lines.

    A path is left out if the tool would cut into the finished part, for example in a gap that is too narrow.
    """
    grown = shape.buffer(-radius if edge.inside else radius, quad_segs=_QUARTER)
    pieces = [piece for piece in getattr(grown, "geoms", [grown]) if not piece.is_empty]
    # A passage exactly as wide as the tool may leave a sliver, which is not a path.
    rings = [piece.exterior for piece in pieces if 2.0 * piece.area > _NARROWEST * piece.exterior.length]
    return [ring for ring in rings if not shapely.dwithin(ring, material, radius - TOLERANCE)]


def _owners(cuts: Cuts, rings: Sequence[Sequence[Any]]) -> NDArray[np.int64]:
    """Return the index of the edge that each cut follows, or -1 if a cut does not follow an edge, int64[n]."""
    owner = np.full(len(cuts), -1, dtype=np.int64)
    for number, own in enumerate(rings):
        for ring in own:
            owner[cuts.along(ring)] = number
    return owner


def _check_ring(
    request: PartRequest, edge: Edge, ring: Any, cuts: Cuts, mine: NDArray[np.int64], into_tabs: shapely.STRtree
) -> list[Difference]:
    """Check that the moves along a ring cut through the plate everywhere except at tabs.

    `into_tabs` contains all cuts that go below the tops of the tabs.
    """
    tabs, diameter = request.tabs, 2.0 * request.radius
    lines, highest = cuts.lines[mine], cuts.highest[mine]
    left = _left(ring, lines[highest <= request.bottom + HEIGHT])
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


class _Roughing(NamedTuple):
    """The roughing of an edge.

    `rings` are the paths of the tool centre that leave the allowance. `nearer` contains the cuts that are closer to the
    edge. `before` contains the cuts along the rings that come before the first of these closer cuts.
    """

    rings: list[Any]
    before: NDArray[np.int64]
    nearer: NDArray[np.int64]


def _roughing(
    request: PartRequest,
    shapes: Sequence[Any],
    rings: Sequence[Sequence[Any]],
    cuts: Cuts,
    others: NDArray[np.bool_],
    material: Any,
) -> list[_Roughing]:
    """Collect the roughing cuts of each edge. Cuts of other operations never count as closer to the edge."""
    wide = request.radius + request.finish
    rough_rings = [
        _centre_rings(shape, edge, wide, material) for shape, edge in zip(shapes, request.edges, strict=True)
    ]
    along = [_join([cuts.along(ring) for ring in own]) for own in rough_rings]
    known = others.copy()
    known[_join(along)] = True
    found = []
    for number, own in enumerate(rings):
        nearer = _join([cuts.within(_allowance(ring, request.edges[number], request.finish)) for ring in own])
        nearer = nearer[~known[nearer]]
        first = cuts.rows[nearer].min(initial=len(cuts.path))
        before = along[number][cuts.rows[along[number]] < first]
        found.append(_Roughing(rough_rings[number], before, nearer))
    return found


def _allowance(ring: Any, edge: Edge, finish: float) -> Any:
    area, strip = shapely.Polygon(ring), ring.buffer(finish + TOLERANCE)
    return strip & area.buffer(TOLERANCE) if edge.inside else strip - area.buffer(-TOLERANCE)


def _join(parts: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *parts]))


def _check_roughing(
    request: PartRequest, edge: Edge, rings: Sequence[Any], rough: _Roughing, cuts: Cuts, mine: NDArray[np.int64]
) -> list[Difference]:
    through = cuts.lines[mine][cuts.highest[mine] <= request.bottom + HEIGHT]
    areas = [_tab_area(piece, ring, edge, request) for ring in rings for piece in _left(ring, through)]
    tabs = shapely.union_all(areas).buffer(request.radius + 2.0 * STRIP)
    lines, highest = cuts.lines[rough.before], cuts.highest[rough.before]
    left = []
    for ring in rough.rings:
        deep = strip_along(lines[highest <= request.bottom + HEIGHT])
        above = strip_along(lines[highest <= request.tabs.height - request.thickness + HEIGHT])
        left += [ring.difference(deep).difference(tabs), ring.difference(above)]
    left = [rest for rest in left if rest.length > TOLERANCE] or ([] if len(rings) == len(rough.rings) else [*rings])
    if not left:
        return []
    x, y = shapely.get_coordinates(left[0])[0].tolist()
    words = Message(
        "{} is not roughed with an allowance of {:g} mm at {}", edge.name, request.finish, position_text(x, y)
    )
    return [Difference(Message("roughing"), 0, 0, words)]


def _check_direction(
    request: PartRequest, edge: Edge, ring: Any, cuts: Cuts, mine: NDArray[np.int64]
) -> list[Difference]:
    deep = mine[cuts.highest[mine] <= request.bottom + HEIGHT]
    deep = np.intersect1d(deep, cuts.along(ring))
    start, end = (shapely.line_locate_point(ring, shapely.points(cuts.ends[deep, k : k + 2])) for k in (0, 3))
    forth = (end - start + 0.5 * ring.length) % ring.length - 0.5 * ring.length
    if ring.is_ccw != (request.climb == edge.inside):
        forth = -forth
    return [
        cuts.difference(
            Message("direction"), k, Message("{} is finished in the wrong direction at {}", edge.name, cuts.place(k))
        )
        for k in deep[forth < -TOLERANCE][:1].tolist()
    ]


def _check_bore(request: PartRequest, edge: Edge, shape: Any, lines: NDArray[Any]) -> list[Difference]:
    slug = shape.buffer(-STRIP).difference(shapely.union_all(lines).buffer(request.radius, quad_segs=_QUARTER))
    if slug.is_empty:
        return []
    at = slug.representative_point()
    words = Message("{} has a slug at {}", edge.name, position_text(at.x, at.y))
    return [Difference(Message("not cut"), 0, 0, words)]


def _is_cut_through(piece: Any, ring: Any, edge: Edge, request: PartRequest, into_tabs: shapely.STRtree) -> bool:
    area = _tab_area(piece, ring, edge, request)
    return len(into_tabs.query(area, predicate="dwithin", distance=request.radius - 2.0 * STRIP)) > 0


def _tab_area(piece: Any, ring: Any, edge: Edge, request: PartRequest) -> shapely.Polygon:
    """Return the area of the tab that lies on a piece of the ring. No cut may enter this area."""
    start, end = piece.coords[0], piece.coords[-1]
    middle = piece.interpolate(0.5, normalized=True).coords[0]
    left = shapely.Point(middle[0] - _NARROWEST * (end[1] - start[1]), middle[1] + _NARROWEST * (end[0] - start[0]))
    waste_left = shapely.Polygon(ring).contains(left) == edge.inside
    return request.tabs.area(start, end, middle, request.radius, request.finish, waste_left=waste_left)


def _left(ring: Any, lines: NDArray[Any]) -> list[Any]:
    rest = _joined(ring.difference(strip_along(lines)))
    return [piece for piece in shapely.get_parts(rest) if piece.length > TOLERANCE]


def _joined(pieces: Any) -> Any:
    return shapely.line_merge(pieces) if pieces.geom_type == "MultiLineString" else pieces


def _check_held(request: PartRequest, through: NDArray[Any], material: Any) -> list[Difference]:
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
