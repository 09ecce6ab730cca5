"""Count the travel moves over detached parts in a program, for a head that stays down between cuts."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import count_of
from leafcut.gcode.dialects import Dialect
from leafcut.geometry.arrays import Points
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.sheet.proof.matched_runs import MatchedRuns
from leafcut.processes.sheet.proof.sheet_shapes import Target
from leafcut.proof.difference import position_text

#: Spacing of the points that are checked along moves, mm, and minimum depth of a crossing inside a part, mm.
_STEP, _DEPTH = 0.5, 0.3
#: Tolerance for the distance between head and part, mm, because edges are chords that differ from those of the planner.
_LEEWAY = 0.2


def check_detached_parts(
    matched: MatchedRuns, path: Toolpath, dialect: Dialect, nozzle: float = 0.0
) -> list[Difference]:
    """Return a fault if more moves cross detached parts than the plan reports.

    `nozzle` is the diameter of the head, mm, or 0 if it is unknown.
    """
    reported, close = matched.plan.crossings, matched.plan.close
    if dialect.moves_z or reported is None:
        return []
    found = crossings(matched, path)
    if len(found) > reported:
        line, where = found[0]
        count = count_of(len(found), "travel move")
        text = Message(
            "{} over detached parts, but only {} reported; the first leads to {}",
            count,
            reported,
            position_text(*where),
        )
        return [Difference(Message("travel over a detached part"), 0, line, text)]
    near = crossings(matched, path, 0.5 * nozzle) if nozzle > 0.0 else []
    if len(near) > reported + close:
        line, where = near[0]
        text = Message(
            "a nozzle of {:g} mm passes over detached parts on {}, but only {} reported; the first leads to {}",
            nozzle,
            count_of(len(near), "travel move"),
            reported + close,
            position_text(*where),
        )
        return [Difference(Message("travel over a detached part"), 0, line, text)]
    return []


def crossings(matched: MatchedRuns, path: Toolpath, radius: float = 0.0) -> list[tuple[int, tuple[float, float]]]:
    """Find the routes that cross a detached part. A route consists of the travel moves between two runs.

    Returns the program line and the end point of the first crossing move of each route. With a head `radius`, mm, a
    route also counts as crossing if it passes a part within this radius, except near the ends of the route.
    """
    ends = np.array([run.row_line[-1] for run in matched.runs], dtype=np.int64)
    freed = _detaching_runs(matched)
    if not freed:
        return []
    cut_by, edges = np.array([run for run, _ in freed]), [edge for _, edge in freed]
    # Moves outside the boxes of all edges, enlarged by the radius, need no closer check.
    low, high = (np.array([side(edge, axis=0) for edge in edges]) for side in (np.min, np.max))
    grown = max(radius - _LEEWAY, 0.0)
    before = path.before
    rows = np.flatnonzero(
        (path.kind == Kind.RAPID) & np.isfinite(np.hstack([before[:, :2], path.end[:, :2]])).all(axis=1)
    )
    way_of = np.searchsorted(ends, path.line[rows])
    order = np.argsort(way_of, kind="stable")
    cuts = np.flatnonzero(np.diff(way_of[order])) + 1
    found = []
    for mine in np.split(rows[order], cuts) if len(rows) else ():
        free = cut_by < np.searchsorted(ends, path.line[mine[0]])
        begin, goal = before[mine[0], :2], path.end[mine[-1], :2]
        for row in mine.tolist():
            a, b = before[row, :2], path.end[row, :2]
            beside = (low <= np.maximum(a, b) + grown).all(axis=1) & (high >= np.minimum(a, b) - grown).all(axis=1)
            near = np.flatnonzero(free & beside).tolist()
            if not near:
                continue
            points = _points_along(a, b)
            away = np.minimum(np.hypot(*(points - begin).T), np.hypot(*(points - goal).T)) >= radius
            if any(_crosses(points, edges[k]) or _comes_near(points[away], edges[k], radius - _LEEWAY) for k in near):
                found.append((int(path.line[row]), (float(b[0]), float(b[1]))))
                break
    return found


def _detaching_runs(matched: MatchedRuns) -> list[tuple[int, Points]]:
    """Return the index of each run that detaches a part, and the outline of the part, float64[n, 2], mm.

    Common lines do not detach a part.
    """
    common = {run for run, cut in enumerate(matched.plan.cuts) if cut.common > 0.0}
    return [
        (claim.run, shapely.get_coordinates(claim.target.edge))
        for claim in matched.claims
        if _is_outline(claim.target)
        and matched.detaches(claim)
        and claim.run not in common
        and len(matched.runs[claim.run].lines()) == 1
    ]


def _is_outline(target: Target) -> bool:
    return target.shape is not None and not target.marks and target.source.depth % 2 == 0


def _points_along(a: Points, b: Points) -> Points:
    """Return evenly spaced points along a straight move, float64[n, 2], mm."""
    steps = max(2, int(np.hypot(*(b - a)) / _STEP) + 2)
    return a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)


def _crosses(points: Points, edge: Points) -> bool:
    """Return whether any points of a move are more than `_DEPTH` inside a closed edge."""
    low, high = edge.min(axis=0), edge.max(axis=0)
    points = points[((points > low) & (points < high)).all(axis=1)]
    points = points[_is_inside(points, edge)]
    return bool((_distances(points, edge) > _DEPTH).any())


def _comes_near(points: Points, edge: Points, distance: float) -> bool:
    low, high = edge.min(axis=0) - distance, edge.max(axis=0) + distance
    points = points[((points > low) & (points < high)).all(axis=1)] if distance > 0.0 else points[:0]
    return bool((_distances(points, edge) < distance).any())


def _is_inside(points: Points, edge: Points) -> NDArray[np.bool_]:
    """Return a mask of the points inside a closed edge.

    A ray to the right of a point inside the edge crosses the edge an odd number of times.
    """
    (x, y), (u, v) = edge[:-1].T, edge[1:].T
    px, py = points[:, :1], points[:, 1:]
    spans = (y > py) != (v > py)
    rise = np.where(v == y, 1.0, v - y)
    crossed = spans & (px < x + (py - y) * (u - x) / rise)
    odd: NDArray[np.bool_] = crossed.sum(axis=1) % 2 == 1
    return odd


def _distances(points: Points, edge: Points) -> Points:
    begin, step = edge[:-1], np.diff(edge, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-18)
    away = points[:, None] - begin
    share = np.clip((away * step).sum(axis=2) / square, 0.0, 1.0)
    distance: Points = np.hypot(*np.moveaxis(away - share[..., None] * step, 2, 0)).min(axis=1, initial=np.inf)
    return distance
