"""Ground that passes leave uncut between them: cleared by spurs, as short as will do, there and back from a pass."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.geometry.regions import polygons, quarter, swept
from leafcut.model.pocket import PocketRules
from leafcut.processes.pocket.plan.track import Track

#: Uncut places smaller than this share of the tool's area are left: what the chords of rings leave between them.
SPECK = 1e-5
#: A spur goes so much deeper than it needs to, in tool radii: one clears more ground, and fewer are needed.
DEEPER = 0.1
#: Passes further than this from a place are not looked at, in tool radii: what is uncut lies within two of some.
FAR = 4.0
#: A spur along the edge of the ground may leave it by rounding, mm.
ROUNDING = 1e-6
#: Spurs that one place may take.
MOST = 60


def uncut(ground: Any, passes: list[Any], rules: PocketRules) -> list[Any]:
    """Return the polygons of the ground that are further than the tool's radius from all passes (shapely lines)."""
    quarters = quarter(rules.radius, rules.tolerance)
    cleared = shapely.union_all([line.buffer(rules.radius, quad_segs=quarters) for line in passes])
    return _worth(ground.difference(cleared), rules)


def with_spurs(ways: list[Points], ground: Any, rules: PocketRules) -> list[Points]:
    """Return ways that leave nothing uncut of the ground: with spurs where they are nearest to what is uncut.

    A spur leads straight to the deepest point of the place until the tool clears it, and back; then what is still
    uncut. None leaves the ground: where the straight way from the nearest pass does, it comes from the next.
    """
    room = ground.buffer(ROUNDING)
    shapely.prepare(room)
    lines = [shapely.LineString(way) for way in ways]
    tracks = [Track(way) for way in ways]
    spurs: list[list[tuple[float, Points]]] = [[] for _ in ways]
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
    """Return the polygons of a shape that are more than specks."""
    return [place for place in polygons(shape) if place.area > SPECK * math.pi * rules.radius**2]


def _spur(places: list[Any], track: Track, rules: PocketRules, room: Any) -> tuple[float, Points] | None:
    """Return the station of a way where a spur to the deepest point of places leaves it, and the spur's tip.

    None where the spur does not lie in the room (shapely).
    """
    corners = shapely.get_coordinates(places)
    away, stations = track.nearest(corners)
    deepest = int(np.argmax(away))
    most, station = float(away[deepest]), float(stations[deepest])
    base = track.places(np.array([station]))[0]
    tip = base + (corners[deepest] - base) * min(most, most - (1.0 - DEEPER) * rules.radius) / most
    return (station, tip) if room.covers(shapely.LineString([base, tip])) else None


def _spliced(track: Track, spurs: list[tuple[float, Points]]) -> Points:
    """Return a way with spurs at its stations."""
    way, parts, at = track.points, [], 0
    for station, tip in sorted(spurs, key=lambda spur: spur[0]):
        k = max(int(np.searchsorted(track.stations, station, side="right")), at)
        base = track.places(np.array([station]))
        parts += [way[at:k], base, tip[None], base]
        at = k
    return np.vstack([*parts, way[at:]])
