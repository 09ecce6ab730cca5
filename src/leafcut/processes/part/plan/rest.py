"""What the first mill of a pocket leaves for a smaller mill, and entries of this mill where nothing is left."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline, polygons, swept_region, tool_centres
from leafcut.model.pocket import Pocket, PocketPiece, PocketRules
from leafcut.processes.milling.entries import TOUCH
from leafcut.processes.part.model import PocketArea
from leafcut.processes.pocket.plan.region import reachable_area
from leafcut.processes.pocket.plan.toolpath import Clearing

#: Minimum width of material that counts as left, in path tolerances. The verification ignores wider films.
_THIN = 4.0
#: Maximum distance between the centre of the mill and the material that is left, in mill radii. Beyond 1, the mill
#: touches nothing, so it can enter there.
_AROUND = 1.25


def rest_pockets(area: PocketArea, large: PocketRules, small: PocketRules) -> list[Pocket]:
    """Return the pockets in which a mill with the rules `small` clears what a mill with the rules `large` leaves.

    They lie inside the area, and extend into the part that the large mill has cleared.
    """
    shape, tolerance = area.region, small.tolerance
    centres, thin = tool_centres(shape, small.radius, tolerance), 0.5 * _THIN * tolerance
    left = swept_region(centres, small.radius, tolerance).intersection(shape) - reachable_area(shape, large)
    near = left.buffer(-thin).buffer(thin).buffer(_AROUND * small.radius)
    pieces = polygons(swept_region(centres.intersection(near), small.radius, tolerance))
    return [
        Pocket(
            as_polyline(piece.exterior.coords, closed=True),
            tuple(as_polyline(ring.coords, closed=True) for ring in piece.interiors),
            area.name,
            area.layer,
            depth=area.depth,
        )
        for piece in map(shapely.geometry.polygon.orient, pieces)
    ]


def cleared_floor(clearings: Iterable[Clearing]) -> Any:
    """Return the area that some paths clear down to the floor (shapely geometry)."""
    areas = [shapely.Polygon()]
    for clearing in clearings:
        rules = clearing.region.rules
        lines = [shapely.LineString(piece.path.flattened(rules.tolerance)) for piece in clearing.path.pieces]
        areas.append(swept_region(shapely.union_all(lines), rules.radius - rules.tolerance, rules.tolerance))
    return shapely.union_all(areas)


def with_entries_in_air(clearing: Clearing, cleared: Any) -> Clearing:
    """Let the mill descend where a larger mill has `cleared` everything, and then move to its path at depth.

    If a straight move does not lead from there to the path, the entry stays unchanged.
    """
    rules, path = clearing.region.rules, clearing.rough
    air = clearing.region.polygon.intersection(cleared.buffer(-rules.radius - rules.tolerance))
    pieces: list[PocketPiece] = []
    for piece, gap in zip(path.pieces, (math.inf, *path.gaps), strict=True):
        entry = _entry_in_air(clearing.region.polygon, air, piece.path.start) if gap > 0.0 else None
        if entry is not None and entry != piece.path.start:
            pieces.append(PocketPiece(Polyline.of_points([entry, piece.path.start])))
        pieces.append(piece)
    return replace(clearing, rough=replace(path, pieces=tuple(pieces)), air=air)


def _entry_in_air(region: Any, air: Any, start: Point) -> Point | None:
    if air.is_empty:
        return None
    nearest = shapely.shortest_line(air, shapely.Point(start)).coords[0]
    room = region.buffer(TOUCH)
    shapely.prepare(room)
    places = sorted(shapely.get_coordinates(air).tolist(), key=lambda place: math.dist(place, start))
    places = [nearest, *places]
    return next(((x, y) for x, y in places if room.covers(shapely.LineString([(x, y), start]))), None)
