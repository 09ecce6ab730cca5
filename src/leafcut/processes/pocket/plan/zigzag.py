"""Direction-parallel clearing: try zigzag lines at several angles, use the best angle, then follow all walls."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import shapely
from shapely.affinity import rotate

from leafcut.geometry.arrays import Points, consecutive_segments
from leafcut.geometry.regions import as_polyline, polygons, shrink_region
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.rings import (
    LINK_STEPS,
    LinkedPath,
    never_stopped,
    offset_rings,
    ring_section_kind,
    stays_in_region,
)
from leafcut.processes.pocket.plan.spurs import add_spurs

#: Number of angles to try.
ANGLES = 12
#: Distances between the ends of lines and the finishing pass, in step-overs. If the first distance leaves gaps, for
#: example along a wall that is nearly parallel to the lines, the second distance is tried.
MARGINS = (0.5, 0.0)
#: Spacing of samples along a wall, in step-overs, and maximum angle between a wall and a line along it, rad.
SAMPLE_SPACING, SIDE_BY_SIDE = 0.1, math.radians(30.0)
#: Minimum length of a line that can start with an entry ramp of the usual depth, in tool diameters.
ENTRY_ROOM = 1.0


def zigzag(
    region: CentreRegion,
    angle: float | None = None,
    stopped: Callable[[], bool] = never_stopped,
    too_wide: Callable[[PocketPath], Points] | None = None,
) -> PocketPath:
    """Return a path of zigzag lines, followed by passes along all walls.

    Neighbouring lines form a run if straight links between their ends stay in the region. Runs are visited in
    nearest-neighbour order, and spurs clear any material that remains. The function returns the shortest path without
    gaps between passes.

    Parameters
    ----------
    angle
        Angle of the lines, rad. If None, twelve angles are tried.
    stopped
        Function that returns whether the search must stop. No further angle is tried then.
    too_wide
        Function that returns the points of a path, float64[n, 2], where passes are further apart than the step-over.
    """
    angles = [math.pi * k / ANGLES for k in range(ANGLES)] if angle is None else [angle]
    candidates: list[tuple[int, PocketPath]] = []
    for margin in MARGINS:
        paths: list[tuple[PocketPath, int]] = []
        for turn in angles:
            if (paths or candidates) and stopped():
                break
            paths.append(_zigzag_at_angle(region, turn, margin * region.rules.step_over))
        for path, far in sorted(paths, key=lambda one: one[0].feed_mm + one[0].rapid_mm):
            candidates.append((far or (len(too_wide(path)) if too_wide else 0), path))
            if not candidates[-1][0]:
                return path
    return min(candidates, key=lambda one: one[0])[1]


def _zigzag_at_angle(region: CentreRegion, angle: float, margin: float) -> tuple[PocketPath, int]:
    """Return the zigzag path at an angle, rad, and the number of gaps along the walls.

    Lines end `margin` mm before the walls.
    """
    rules = region.rules
    inner = shrink_region(region.polygon, margin, rules.tolerance) if margin else region.polygon
    runs = [run for part in polygons(inner) for run in _zigzag_lines(region, part, angle, rules)]
    walls = [ring for ring in offset_rings(region) if ring.level == 0]
    far = _count_gaps_at_walls(runs, [ring.points_between(0.0, ring.length) for ring in walls], rules.step_over)
    path = LinkedPath(region, region.boundary_rings[0][0])
    while runs:
        line = _nearest_line(path, [line for run in runs for line in (run, run[::-1])])
        runs = [run for run in runs if run is not line and not np.array_equal(run[::-1], line)]
        path.append_section(line, "rough")
    while walls:
        starts = [ring.nearest_station(path.end) for ring in walls]
        lines = [ring.points_between(s, s + ring.length) for ring, s in zip(walls, starts, strict=True)]
        k = min(range(len(lines)), key=lambda i: math.dist(path.end, lines[i][0]))
        path.append_section(lines[k], ring_section_kind(walls.pop(k), rules))
    lines = add_spurs([piece.path.vertices[:, :2] for piece in path.pieces], region.polygon, rules)
    pieces = [PocketPiece(as_polyline(line), piece.kind) for line, piece in zip(lines, path.pieces, strict=True)]
    return PocketPath("zigzag", tuple(pieces)), far


def _count_gaps_at_walls(runs: list[Points], walls: list[Points], step_over: float) -> int:
    """Count the sample points on wall passes whose nearest parallel line is one to two step-overs away."""
    if not runs or not walls:
        return 0
    lines = np.concatenate([consecutive_segments(run) for run in runs])
    lines = lines[np.hypot(*(lines[:, 1] - lines[:, 0]).T) > 0.0]
    sampled = [
        shapely.get_coordinates(shapely.segmentize(shapely.LineString(wall), SAMPLE_SPACING * step_over))
        for wall in walls
    ]
    places = np.concatenate([0.5 * (wall[1:] + wall[:-1]) for wall in sampled])
    along = np.concatenate([np.diff(wall, axis=0) for wall in sampled])
    along /= np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    (at, by), away = shapely.STRtree(shapely.linestrings(lines)).query_nearest(
        shapely.points(places), max_distance=2.0 * step_over, return_distance=True, all_matches=False
    )
    ahead = (lines[:, 1] - lines[:, 0])[by]
    ahead /= np.hypot(*ahead.T)[:, None]
    beside = np.abs((ahead * along[at]).sum(axis=1)) >= math.cos(SIDE_BY_SIDE)
    across = places[at] - lines[by, 0]
    square = np.abs(across[:, 0] * ahead[:, 1] - across[:, 1] * ahead[:, 0]) >= away * (1.0 - 1e-6)
    return int((beside & square & (away > step_over * (1.0 + 1e-6))).sum())


def _zigzag_lines(region: CentreRegion, inner: Any, angle: float, rules: PocketRules) -> list[Points]:
    level = rotate(inner, -angle, origin=(0.0, 0.0), use_radians=True)
    x0, y0, x1, y1 = level.bounds
    n = max(math.ceil((y1 - y0) / rules.step_over - 1e-9), 1)
    rim = min(1e-3 * rules.step_over, 0.25 * (y1 - y0))  # in a slot as wide as the tool, the region has almost no area
    rows: list[list[Points]] = []
    for y in np.linspace(y0 + rim, y1 - rim, n + 1):
        cut = shapely.intersection(level, shapely.LineString([(x0 - 1.0, y), (x1 + 1.0, y)]))
        lines = [np.asarray(part.coords) for part in shapely.get_parts(cut) if part.geom_type == "LineString"]
        rows.append([line[np.argsort(line[:, 0])] for line in lines])
    turned = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    runs = []
    while any(rows):
        first = next(k for k, row in enumerate(rows) if row)
        runs.append(_joined_lines(region, rows, first, turned))
    return runs


def _joined_lines(region: CentreRegion, rows: list[list[Points]], row: int, turned: Points) -> Points:
    """Join the first line of a row to lines in the following rows, and remove the joined lines from `rows`.

    Each link to the next row must be short and stay in the region.
    """
    lines = [rows[row].pop(0)]
    while row + 1 < len(rows):
        row += 1
        at = lines[-1][-1]
        options = [(math.dist(at, end[0]), k, end) for k, line in enumerate(rows[row]) for end in (line, line[::-1])]
        options = [o for o in options if o[0] <= LINK_STEPS * region.rules.step_over]
        options = [o for o in options if stays_in_region(region, shapely.LineString(np.vstack([at, o[2][0]]) @ turned))]
        if not options:
            break
        _, k, line = min(options, key=lambda o: o[0])
        rows[row].pop(k)
        lines.append(line)
    joined: Points = np.vstack(lines) @ turned
    return joined


def _nearest_line(path: LinkedPath, lines: list[Points]) -> Points:
    """Return the line that starts closest to the tool.

    The first line of a path must be long enough for an entry ramp.
    """
    if path.pieces:
        return min(lines, key=lambda line: math.dist(path.end, line[0]))
    lengths = [float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in lines]
    enough = min(ENTRY_ROOM * path.region.rules.tool_diameter, max(lengths))
    return next(line for line, length in zip(lines, lengths, strict=True) if length >= enough)
