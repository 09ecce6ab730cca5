"""Spurs: short detours from a pass and back, which clear material that is left between passes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.regions import chords_per_quarter, polygons, swept_region
from leafcut.model.pocket import PocketRules
from leafcut.processes.pocket.plan.stationed_path import StationedPath

#: Minimum size of an uncut area that is cleared, relative to the area of the tool. The chords of rings leave smaller
#: areas.
SPECK = 1e-5
#: Extra length of a spur, in tool radii. Longer spurs clear more, so fewer spurs are needed.
DEEPER = 0.1
#: Maximum distance between an uncut area and the pass that its spur starts from, in tool radii.
FAR = 4.0
#: Rounding tolerance for a spur along the edge of the region, mm.
ROUNDING = 1e-6
#: Maximum number of spurs per uncut area.
MOST = 60


def uncut_areas(floor: Any, passes: list[Any], rules: PocketRules) -> list[Any]:
    """Return the areas of `floor` that no pass clears, as shapely polygons."""
    quarters = chords_per_quarter(rules.radius, rules.tolerance)
    cleared = shapely.union_all([line.buffer(rules.radius, quad_segs=quarters) for line in passes])
    return _significant_parts(floor.difference(cleared), rules)


def add_spurs(paths: list[Points], floor: Any, rules: PocketRules) -> list[Points]:
    """Add spurs to the paths, so that the paths clear all of `floor`.

    A spur runs in a straight line from the nearest pass to an uncut area and back. If this line leaves `floor`, the
    spur starts from the next nearest pass instead.
    """
    room = floor.buffer(ROUNDING)
    shapely.prepare(room)
    lines = [shapely.LineString(path) for path in paths]
    tracks = [StationedPath(path) for path in paths]
    spurs: list[list[tuple[float, Points]]] = [[] for _ in paths]
    tree = shapely.STRtree(lines)
    for place in uncut_areas(floor, lines, rules):
        near = tree.query(place, predicate="dwithin", distance=FAR * rules.radius)
        near = near[np.argsort(shapely.distance(place, np.array(lines)[near]), kind="stable")]
        left = [place]
        for _ in range(MOST):
            if not left:
                break
            free = (
                (int(k), *found) for k in near if (found := _spur_to_uncut(left, tracks[k], rules, room)) is not None
            )
            k, station, tip = next(free, (0, 0.0, None))
            if tip is None:
                break
            spurs[k].append((station, tip))
            disc = swept_region(shapely.Point(tip), rules.radius, rules.tolerance)
            left = [part for some in left for part in _significant_parts(some.difference(disc), rules)]
    return [_insert_spurs(track, found) for track, found in zip(tracks, spurs, strict=True)]


def _significant_parts(shape: Any, rules: PocketRules) -> list[Any]:
    return [place for place in polygons(shape) if place.area > SPECK * math.pi * rules.radius**2]


def _spur_to_uncut(
    places: list[Any], track: StationedPath, rules: PocketRules, room: Any
) -> tuple[float, Points] | None:
    """Return the station and the tip of a spur towards the point of `places` that is farthest from the passes.

    Return None if the spur would leave `room`.
    """
    corners = shapely.get_coordinates(places)
    away, stations = track.nearest_stations(corners)
    deepest = int(np.argmax(away))
    distance, station = float(away[deepest]), float(stations[deepest])
    base = track.positions_at(np.array([station]))[0]
    tip = base + (corners[deepest] - base) * min(distance, distance - (1.0 - DEEPER) * rules.radius) / distance
    return (station, tip) if room.covers(shapely.LineString([base, tip])) else None


def _insert_spurs(track: StationedPath, spurs: list[tuple[float, Points]]) -> Points:
    points, parts, at = track.points, [], 0
    for station, tip in sorted(spurs, key=lambda spur: spur[0]):
        k = max(int(np.searchsorted(track.stations, station, side="right")), at)
        base = track.positions_at(np.array([station]))
        parts += [points[at:k], base, tip[None], base]
        at = k
    return np.vstack([*parts, points[at:]])
