"""Join open paths at their ends to form longer or closed paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices, Point, Points
from leafcut.geometry.cleaning import path_ends
from leafcut.geometry.index import point_pairs_within
from leafcut.geometry.polyline import Polyline

#: Maximum distance between ends that count as the same point, mm. Drawings store 4 to 6 digits.
EXACT = 1e-4
#: Minimum angle between two paths at a common end, rad. At smaller angles, the paths would overlap.
DOUBLED_BACK = 1e-3


class Joined(NamedTuple):
    """A path that was joined from several paths.

    `members` contains the indices of these paths, in order. `gaps` contains the position and the width of each gap that
    was closed.
    """

    path: Polyline
    members: list[int]
    gaps: list[tuple[Point, float]]


@dataclass
class Joining:
    """The joined paths in drawing order, and the branches, which are positions where more than two ends meet.

    At a branch, the drawing order determines which ends are joined. This choice is a guess.
    """

    paths: list[Joined] = field(default_factory=list)
    branches: list[Point] = field(default_factory=list)


def join_paths(paths: Sequence[Polyline], tolerance: float) -> Joining:
    """Join open paths whose ends are within `tolerance` mm of each other, starting with the closest ends; O(n log n).

    Ends that coincide are joined before any gap is closed. If more than two ends meet, paths that are consecutive in
    the drawing are joined first, followed by the paths with the sharpest corner. As a result, outlines that touch do
    not cross. Both ends of a gap move to its middle. Closed paths do not change.

    Raises
    ------
    PlanError
        Hundreds of ends share the same position.
    """
    result = Joining([Joined(p, [i], []) for i, p in enumerate(paths) if p.closed])
    members = [i for i, p in enumerate(paths) if not p.closed]
    if not members:
        return result
    chosen = [paths[i] for i in members]
    ends = path_ends(chosen)
    first, second, gaps = point_pairs_within(ends, tolerance)
    lengths = np.array([p.length for p in chosen])
    same_path = first // 2 == second // 2
    # Do not join a short line to itself: its ends are close only because it is short.
    allowed = ~same_path | (lengths[first // 2] > 3.0 * np.maximum(gaps, EXACT)) & (
        lengths[first // 2] > 2.0 * tolerance
    )
    first, second, gaps, same_path = first[allowed], second[allowed], gaps[allowed], same_path[allowed]
    mate = _match_ends(chosen, first, second, gaps, same_path)
    result.branches = _branch_points(ends, mate, first, second, gaps)
    for walk, loop in _chains_of_paths(mate):
        gaps_closed: list[tuple[Point, float]] = []
        path = _build_chain(chosen, walk, loop, gaps_closed)
        result.paths.append(Joined(path, [members[end // 2] for end in walk], gaps_closed))
    result.paths.sort(key=lambda joined: min(joined.members))
    return result


def _match_ends(
    paths: Sequence[Polyline], first: Indices, second: Indices, gaps: NDArray[np.float64], same_path: NDArray[np.bool_]
) -> Indices:
    """Return the end that each end is joined to, or -1.

    The closest pairs are joined first. Pairs at the same distance are joined in drawing order.
    """
    distance = np.where(gaps <= EXACT, 0.0, gaps)
    follow = np.abs(first // 2 - second // 2) == 1
    # Join the end of a path to the start of the next path in the drawing: starts are even numbers, ends are odd.
    head_to_tail = follow & (second - first == 1)
    rank = np.select([same_path, head_to_tail, follow], [0, 1, 2], 3)
    angle = _angles_between_ends(paths, first, second, distance == 0.0)
    rank[angle < DOUBLED_BACK] = 4
    order = np.lexsort((angle, rank, distance))
    mate = np.full(2 * len(paths), -1, dtype=np.int64)
    for a, b in zip(first[order].tolist(), second[order].tolist(), strict=True):
        if mate[a] < 0 and mate[b] < 0:
            mate[a], mate[b] = b, a
    return mate


def _angles_between_ends(
    paths: Sequence[Polyline], first: Indices, second: Indices, exact: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the angle between the paths at each pair of ends, rad, or π if no other end meets there."""
    crowded = np.bincount(np.concatenate([first[exact], second[exact]]), minlength=2 * len(paths)) > 1
    directions = {end: _inward_direction(paths[end // 2], end % 2 == 1) for end in np.flatnonzero(crowded).tolist()}
    angles = np.full(len(first), np.pi)
    for k in np.flatnonzero(exact & crowded[first] & crowded[second]).tolist():
        (ux, uy), (vx, vy) = directions[int(first[k])], directions[int(second[k])]
        angles[k] = abs(np.arctan2(ux * vy - uy * vx, ux * vx + uy * vy))
    return angles


def _inward_direction(path: Polyline, at_end: bool) -> Point:
    return (path.reversed() if at_end else path).direction_at(0.0)


def _branch_points(
    ends: Points, mate: Indices, first: Indices, second: Indices, gaps: NDArray[np.float64]
) -> list[Point]:
    """Return all positions where three or more ends meet, or where an end has no free partner left."""
    partners = np.bincount(np.concatenate([first, second]), minlength=len(ends))
    close = gaps <= EXACT
    exact = np.bincount(np.concatenate([first[close], second[close]]), minlength=len(ends))
    points = ends[(exact > 1) | ((mate < 0) & (partners > 0))]
    return [(float(x), float(y)) for x, y in np.unique(points.round(3), axis=0)]


def _chains_of_paths(mate: Indices) -> list[tuple[list[int], bool]]:
    """Return the chains of joined paths, and whether each chain is closed.

    A chain is a list of ends. Each entry is the end at which the chain enters a path. End 2i is the start of path i,
    and end 2i + 1 is its end.
    """
    table = mate.tolist()
    done = [False] * (len(table) // 2)
    walks = []
    for path in range(len(done)):
        if done[path]:
            continue
        entry = 2 * path
        while table[entry] >= 0 and table[entry] ^ 1 != 2 * path:
            entry = table[entry] ^ 1  # go back path by path
        loop = table[entry] >= 0
        entry = 2 * path if loop else entry
        walk = []
        while entry >= 0 and not done[entry // 2]:
            done[entry // 2] = True
            walk.append(entry)
            entry = table[entry ^ 1]
        walks.append((walk, loop))
    return walks


def _build_chain(paths: list[Polyline], walk: list[int], loop: bool, gaps: list[tuple[Point, float]]) -> Polyline:
    """Build the path of a chain (`walk`, from `_chains_of_paths`), and append each gap that it closes to `gaps`."""
    pieces = [paths[end // 2].reversed() if end % 2 else paths[end // 2] for end in walk]
    tables = [piece.vertices.copy() for piece in pieces]
    for k in range(0 if loop else 1, len(tables)):
        before, current = tables[k - 1][-1, :2], tables[k][0, :2]
        gap = float(np.hypot(*(current - before)))
        middle = 0.5 * (before + current)
        if gap > EXACT:
            gaps.append(((float(middle[0]), float(middle[1])), gap))
        tables[k - 1][-1, :2] = tables[k][0, :2] = middle
    rows = [table[:-1] for table in tables]
    if not loop:
        rows.append(tables[-1][-1:])
    return Polyline(np.concatenate(rows), closed=loop)
