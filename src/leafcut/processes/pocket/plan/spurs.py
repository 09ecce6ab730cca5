"""Spurs: short moves from a pass and back that clear material which the passes leave between them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.regions import polygons, quarter, swept
from leafcut.model.pocket import PocketRules
from leafcut.processes.pocket.plan.track import Track

#: Smaller uncut areas are ignored, share of the tool's area: they come from the chords of rings.
SPECK = 1e-5
#: Extra length of a spur, tool radii: it clears more, so fewer spurs are needed.
DEEPER = 0.1
#: Maximum distance of passes from an uncut area, tool radii; a pass is within two of it.
FAR = 4.0
#: Rounding of a spur along the edge of the region, mm.
ROUNDING = 1e-6
#: Maximum number of spurs for an area.
MOST = 60


def uncut(ground: Any, passes: list[Any], rules: PocketRules) -> list[Any]:
    """Return the polygons of `ground` further than the tool radius from all passes (shapely lines)."""
    quarters = quarter(rules.radius, rules.tolerance)
    cleared = shapely.union_all([line.buffer(rules.radius, quad_segs=quarters) for line in passes])
    return _worth(ground.difference(cleared), rules)


def with_spurs(paths: list[Points], ground: Any, rules: PocketRules) -> list[Points]:
    """Return paths that clear all of `ground`, with spurs from the nearest pass straight towards uncut areas and back,
    until nothing remains. A spur that would leave `ground` starts from the next pass.
    """
    room = ground.buffer(ROUNDING)
    shapely.prepare(room)
    lines = [shapely.LineString(path) for path in paths]
    tracks = [Track(path) for path in paths]
    spurs: list[list[tuple[float, Points]]] = [[] for _ in paths]
    tree = shapely.STRtree(lines)
    for place in uncut(ground, lines, rules):
        near = tree.query(place, predicate="dwithin", distance=FAR * rules.radius)
        near = near[np.argsort(shapely.distance(place, np.array(lines)[near]), kind="stable")]
        left = [place]
        for _ in range(MOST):
            if not left:
                break
            free = ((int(k), *found) for k in near if (found := _spur(left, tracks[k], rules, room)) is not None)
            k, station, tip = next(free, (0, 0.0, None))
            if tip is None:
                break
            spurs[k].append((station, tip))
            disc = swept(shapely.Point(tip), rules.radius, rules.tolerance)
            left = [part for some in left for part in _worth(some.difference(disc), rules)]
    return [_spliced(track, found) for track, found in zip(tracks, spurs, strict=True)]


def _worth(shape: Any, rules: PocketRules) -> list[Any]:
    return [place for place in polygons(shape) if place.area > SPECK * math.pi * rules.radius**2]


def _spur(places: list[Any], track: Track, rules: PocketRules, room: Any) -> tuple[float, Points] | None:
    """Return the station and the tip of a spur to the most distant point; None if it leaves `room` (shapely)."""
    corners = shapely.get_coordinates(places)
    away, stations = track.nearest(corners)
    deepest = int(np.argmax(away))
    distance, station = float(away[deepest]), float(stations[deepest])
    base = track.places(np.array([station]))[0]
    tip = base + (corners[deepest] - base) * min(distance, distance - (1.0 - DEEPER) * rules.radius) / distance
    return (station, tip) if room.covers(shapely.LineString([base, tip])) else None


def _spliced(track: Track, spurs: list[tuple[float, Points]]) -> Points:
    points, parts, at = track.points, [], 0
    for station, tip in sorted(spurs, key=lambda spur: spur[0]):
        k = max(int(np.searchsorted(track.stations, station, side="right")), at)
        base = track.places(np.array([station]))
        parts += [points[at:k], base, tip[None], base]
        at = k
    return np.vstack([*parts, points[at:]])
