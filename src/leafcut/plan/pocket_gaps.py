"""Ground between passes that are too far from each other: lines along its middle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import FINE, polygons, quarter
from leafcut.model.pocket import PocketRules

#: Uncut places smaller than this share of the tool's area are left: what the chords of rings leave between them.
SPECK = 1e-5
#: Gaps that are wider by less than this share of the step-over are what chords and rounding make.
SLACK = 0.006
#: A pass that turns by more at one place has a corner there, rad.
SQUARE = math.radians(10.0)
#: Places on passes are so many step-overs apart.
SITE_STEP = 0.05
#: A pass is ahead of a corner where the cosine between the way to it and straight ahead is above this.
AHEAD = 0.5
#: Passes further than this from a gap, in step-overs, have nothing to do with it.
NEARBY = 1.0
#: Distances that differ by less than this share are equal.
EQUAL = 1e-3
#: Gaps shorter than this, in step-overs, are let be.
SHORT = 0.02
#: Points along the middle of a place.
MIDDLE_POINTS = 17
#: Passes whose directions differ by less than this run side by side, rad; others meet in a corner.
SIDE_BY_SIDE = math.radians(30.0)


def uncut(ground: Any, passes: list[Any], rules: PocketRules) -> list[Points]:
    """Return lines along the middle of what passes (shapely lines) leave uncut of a polygon, float64[m, 2] each."""
    import shapely

    places = _beyond(ground, passes, rules.radius, rules)
    lines = [middle_of(place) for place in places if place.area > SPECK * math.pi * rules.radius**2]
    return [line for line in lines if ground.covers(shapely.LineString(line))]


def wide_gaps(ground: Any, passes: list[Any], rules: PocketRules) -> list[Points]:
    """Return lines along the middle of gaps between passes that run side by side further apart than the step-over.

    The middle is the Voronoi diagram of places on the passes: a point of it that is as far from two of them, on
    opposite sides, has a gap of twice that. Where passes meet in a corner (of an offset ring, 1.41 step-overs apart
    on the diagonal of a square one) there is no gap: each is at the step-over from both sides of the other. What is
    uncut there is told by `uncut`.
    """
    import shapely

    places = _beyond(ground, passes, 0.5 * rules.step_over * (1.0 + SLACK), rules)
    places = [place for place in places if place.area > SPECK * rules.step_over**2]
    if not places:
        return []
    sites, square = _sites(passes, SITE_STEP * rules.step_over)
    beside = shapely.STRtree(places).query(shapely.points(sites), "dwithin", distance=NEARBY * rules.step_over)[0]
    sites, square = sites[np.unique(beside)], square[np.unique(beside)]
    edges = shapely.get_parts(shapely.voronoi_polygons(shapely.multipoints(sites), only_edges=True))
    corners, owner = shapely.get_coordinates(edges, return_index=True)
    edges = shapely.linestrings(np.stack([corners[:-1], corners[1:]], axis=1)[owner[1:] == owner[:-1]])
    middle = 0.5 * shapely.get_coordinates(edges).reshape(-1, 2, 2).sum(axis=1)
    inside = np.unique(shapely.STRtree(places).query(shapely.points(middle), predicate="intersects")[0])
    wide = inside[_wide(middle[inside], sites, square, rules)]
    merged = shapely.line_merge(shapely.multilinestrings(edges[wide]))
    lines = [line for line in shapely.get_parts(merged) if line.length > SHORT * rules.step_over]
    return [np.asarray(line.simplify(5.0 * rules.tolerance).coords) for line in lines]


def _sites(passes: list[Any], step: float) -> tuple[Points, Any]:
    """Return places on the passes and whether a pass is smooth there: no corner."""
    import shapely

    places, smooth = [], []
    for line in shapely.segmentize(np.array(passes), step):
        points = np.asarray(line.coords)
        ahead = np.diff(points, axis=0)
        angle = np.arctan2(ahead[:, 1], ahead[:, 0])
        before = np.concatenate([angle[-1:] if line.is_closed else angle[:1] + 0.5 * math.pi, angle[:-1]])
        turn = np.abs((angle - before + math.pi) % (2.0 * math.pi) - math.pi)
        places.append(points[:-1])
        smooth.append(turn < SQUARE)
    sites, first = np.unique(np.round(np.vstack(places), 9), axis=0, return_index=True)
    return sites, np.concatenate(smooth)[first]


def _wide(middle: Points, sites: Points, square: Any, rules: PocketRules) -> Any:
    """Return whether places have the nearest passes on opposite sides, too far from each other."""
    import shapely

    tree = shapely.STRtree(shapely.points(sites))
    here = shapely.points(middle)
    near, away = tree.query_nearest(here, return_distance=True, all_matches=False)
    radius = np.empty(len(middle))
    radius[near[0]] = away
    rows, who = tree.query(here, predicate="dwithin", distance=radius * (1.0 + EQUAL))
    apart = (sites[who] - middle[rows]) / np.hypot(*(sites[who] - middle[rows]).T)[:, None]
    found = np.zeros(len(middle), dtype=bool)
    first = np.searchsorted(rows, np.arange(len(middle)))
    last = np.append(first[1:], len(rows))
    widest = rules.step_over * (1.0 + SLACK)
    for k in np.flatnonzero(2.0 * radius > widest):
        ways, touched = apart[first[k] : last[k]], who[first[k] : last[k]]
        cosine = ways @ ways.T
        i, j = np.unravel_index(np.argmin(cosine), cosine.shape)
        if cosine[i, j] > -math.cos(SIDE_BY_SIDE) or radius[k] * (1.0 - cosine[i, j]) <= widest:
            continue
        pair = (int(touched[i]), int(touched[j]))
        found[k] = all(square[c] or not _met(sites, tree, c, o, rules) for c, o in (pair, pair[::-1]))
    return found


def _met(sites: Points, tree: Any, corner: int, other: int, rules: PocketRules) -> bool:
    """Return whether a corner has the pass it looks at within the step-over, though not straight ahead."""
    import shapely

    near = tree.query(shapely.Point(sites[corner]), "dwithin", distance=rules.step_over * (1.0 + SLACK + SITE_STEP**2))
    ways, ahead = sites[near] - sites[corner], sites[other] - sites[corner]
    along = ways @ ahead > AHEAD * np.hypot(*ways.T) * math.hypot(*ahead)
    return bool((along & (np.hypot(*ways.T) > 0.5 * rules.step_over)).any())


def _beyond(ground: Any, passes: list[Any], reach: float, rules: PocketRules) -> list[Any]:
    """Return the polygons of the ground that are further than `reach` from all passes."""
    import shapely

    quarters = quarter(reach, FINE * rules.tolerance)
    near = shapely.union_all([line.buffer(reach, quad_segs=quarters) for line in passes])
    return polygons(ground.difference(near))


def middle_of(place: Any) -> Points:
    """Return a line through a slender polygon: the mean of the two ways along its edge between its farthest points."""
    import shapely

    edge = np.asarray(place.exterior.coords)[:-1]
    hull = np.asarray(place.convex_hull.exterior.coords)[:-1]
    reach = np.hypot(*(hull[:, None] - hull[None]).transpose(2, 0, 1))
    ends = [int(np.argmin(np.hypot(*(edge - hull[k]).T))) for k in np.unravel_index(np.argmax(reach), reach.shape)]
    i, j = sorted(ends)
    share = np.linspace(0.0, 1.0, MIDDLE_POINTS)
    there, back = shapely.LineString(edge[i : j + 1]), shapely.LineString(np.vstack([edge[j:], edge[: i + 1]])[::-1])
    ways = [
        shapely.get_coordinates(shapely.line_interpolate_point(way, share, normalized=True)) for way in (there, back)
    ]
    middle: Points = 0.5 * (ways[0] + ways[1])
    return middle
