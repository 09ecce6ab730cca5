"""Convert the strokes of a drawing to outlines by joining strokes and removing duplicates."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Indices, Point, Points
from leafcut.geometry.cleaning import path_ends
from leafcut.geometry.index import connected_components, point_pairs_within, query_pairs
from leafcut.geometry.joining import Joined, Joining, join_paths
from leafcut.geometry.polyline import COINCIDENT, Polyline
from leafcut.message import Message

#: Chord error of outlines during checks, mm.
CHORDS = 0.01
#: Maximum total number of chords of all outlines.
MOST_CHORDS = 20_000_000
#: Maximum --join-tolerance that a message suggests, mm. Accidental gaps are smaller. The ends of the centre mark of a
#: hole are farther apart. If they were joined, they would form a diamond.
WIDEST_PROPOSED_JOIN = 0.5
_FULL = 2.0 * np.pi


@dataclass
class TidiedOutlines(Joining):
    """Outlines that were joined from strokes, the branches of the drawing, and the positions of removed duplicates."""

    doubles: list[Point] = field(default_factory=list)


def advice_for_open_path(number: int, paths: Sequence[Polyline]) -> str:
    """Return advice for a message about the open path `paths[number]`. The advice names the nearest end and a remedy.

    The nearest end may belong to the same path.
    """
    ends = path_ends(paths)
    own_ends = slice(2 * number, 2 * number + 2)
    distances = np.hypot(*(ends[None, :, :] - ends[own_ends, None, :]).transpose(2, 0, 1))
    distances[[0, 1], [2 * number, 2 * number + 1]] = math.inf
    own_end, nearest_end = np.unravel_index(int(np.argmin(distances)), distances.shape)
    gap = float(distances[own_end, nearest_end])
    x, y = ends[nearest_end].tolist()
    join_tolerance = math.ceil(gap * 1000.0 + 1e-6) / 1000.0
    remedy = (
        Message("--join-tolerance {:g} closes it", join_tolerance)
        if join_tolerance <= WIDEST_PROPOSED_JOIN
        else Message("draw the missing line there")
    )
    return Message(" (the nearest end is {:.3g} mm away at ({:g}, {:g}): {})", gap, x, y, remedy)


def tidy_outlines(strokes: Sequence[Polyline], tolerance: float) -> TidiedOutlines:
    """Join strokes to outlines.

    If strokes do not form closed outlines, duplicates are removed and the remaining strokes are joined again.

    Raises
    ------
    PlanError
        Hundreds of ends or lines share the same position.
    """
    first = join_paths(strokes, tolerance)
    sound = [joined for joined in first.paths if strokes[joined.members[0]].closed]
    loops = [joined for joined in first.paths if joined.path.closed and not strokes[joined.members[0]].closed]
    flaws = _have_flaws([joined.path for joined in loops])
    sound += [loop for loop, flaw in zip(loops, flaws, strict=True) if not flaw]
    used = {i for joined in sound for i in joined.members}
    remaining = [i for i in range(len(strokes)) if i not in used]
    if not remaining:
        return TidiedOutlines(first.paths)
    covered = _lie_on_outlines([strokes[i] for i in remaining], [joined.path for joined in sound])
    covered_strokes = [i for i, c in zip(remaining, covered, strict=True) if c]
    loose = [i for i, c in zip(remaining, covered, strict=True) if not c]

    unique = without_overlaps([strokes[i] for i in loose])
    rejoined = join_paths([p for p, _ in unique.paths], tolerance)
    rejoined_paths = [
        joined._replace(members=_strokes_of_path(joined, unique.paths, loose)) for joined in rejoined.paths
    ]
    doubles = [strokes[i].point_at(0.5 * strokes[i].length) for i in covered_strokes] + unique.removed
    open_ones = any(not joined.path.closed for joined in rejoined_paths)
    branches = sorted({*first.branches, *rejoined.branches}) if open_ones else rejoined.branches
    return TidiedOutlines(sorted([*sound, *rejoined_paths], key=lambda joined: min(joined.members)), branches, doubles)


def _strokes_of_path(joined: Joined, pieces: Sequence[tuple[Polyline, int]], loose: Sequence[int]) -> list[int]:
    return list(dict.fromkeys(loose[pieces[k][1]] for k in joined.members))


def chord_polygons(paths: Sequence[Polyline]) -> Any:
    """Convert closed paths to shapely polygons. Chords replace the arcs.

    Raises
    ------
    PlanError
        The paths need more than `MOST_CHORDS` chords.
    """
    if not paths:
        return np.array([], dtype=object)
    rings, total = [], 0
    for path in paths:
        ring = path.flattened(CHORDS)
        rings.append(ring if len(ring) >= 4 else np.concatenate([ring, ring[-1:], ring[-1:]]))
        total += len(ring)
        if total > MOST_CHORDS:
            raise PlanError("the arcs of this drawing need more than {:,} chords; check its units", MOST_CHORDS)
    indices = np.repeat(np.arange(len(rings)), [len(r) for r in rings])
    return shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=indices))


def _have_flaws(paths: Sequence[Polyline]) -> list[bool]:
    shapes = chord_polygons(paths)
    thin = 2.0 * shapely.area(shapes) <= COINCIDENT * shapely.length(shapes)
    return list(thin | ~shapely.is_valid(shapes))


def _lie_on_outlines(loose: Sequence[Polyline], outlines: Sequence[Polyline]) -> list[bool]:
    """Return whether each open stroke lies on an outline and has no other stroke that continues from its ends."""
    if not loose or not outlines:
        return [False] * len(loose)
    lines: Any = shapely.linearrings(
        np.concatenate(rings := [p.flattened(0.1 * COINCIDENT) for p in outlines]),
        indices=np.repeat(np.arange(len(rings)), [len(r) for r in rings]),
    )
    tree = shapely.STRtree(lines)
    shares = (0.0, 0.25, 0.5, 0.75, 1.0)
    points = np.array([p.point_at(s * p.length) for p in loose for s in shares])
    point_index, outline = tree.query(shapely.points(points), predicate="dwithin", distance=COINCIDENT)
    pairs, counts = np.unique(np.stack([point_index // len(shares), outline]), axis=1, return_counts=True)
    on_outline = np.zeros(len(loose), dtype=bool)
    on_outline[pairs[0][counts == len(shares)]] = True
    # An outline may share an edge with its neighbour. A stroke that other strokes continue belongs to the neighbour.
    ends = np.array([end for p in loose for end in (p.start, p.end)])

    first, second, _ = point_pairs_within(ends, COINCIDENT)
    for a, b in ((first, second), (second, first)):
        on_outline[(a // 2)[~on_outline[b // 2]]] = False
    return list(on_outline)


# -- overlaps --------------------------------------------------------------------------------------------------------


class PathsWithoutOverlaps(NamedTuple):
    """Paths without overlaps, with the index of the source of each path, and the positions of removed pieces."""

    paths: list[tuple[Polyline, int]]
    removed: list[Point]


def without_overlaps(paths: Sequence[Polyline]) -> PathsWithoutOverlaps:
    """Keep a single copy of every repeated line and arc in open paths, unless two neighbours share it; O(n log n).

    Overlapping lines are split at each other's ends, so that duplicates match exactly. Then a single copy of each piece
    is kept. If this leaves an odd number of ends at a point, an outline needs the duplicate, so it is restored. Closed
    paths and open paths without overlaps do not change. All other paths are returned in pieces.
    """
    table = _segment_table(paths)
    cuts = _split_positions(table)
    if not cuts:
        return PathsWithoutOverlaps([(p, i) for i, p in enumerate(paths)], [])
    broken = {int(table.path[k]) for k in cuts}
    pieces: list[tuple[Polyline, int]] = []
    for k in np.flatnonzero(np.isin(table.path, sorted(broken))).tolist():
        source = int(table.path[k])
        row = Polyline(np.array([[*table.a[k], table.bulge[k]], [*table.b[k], 0.0]]))
        stops = [0.0, *cuts.get(k, ()), row.length]
        pieces += [(row.piece(s, e), source) for s, e in pairwise(stops)]
    unbroken = [(p, i) for i, p in enumerate(paths) if i not in broken]
    repeated = _repeated_pieces([p for p, _ in pieces])
    restored = _duplicates_to_restore(pieces, repeated, [p for p, _ in unbroken if not p.closed])
    dropped = {k for k in repeated if k not in restored}
    kept = [piece for k, piece in enumerate(pieces) if k not in dropped]
    removed = [pieces[k][0].point_at(0.5 * pieces[k][0].length) for k in sorted(dropped)]
    return PathsWithoutOverlaps(sorted([*unbroken, *kept], key=lambda pair: pair[1]), removed)


class _Segments(NamedTuple):
    """Lines and arcs in columns: both ends, bulge, length, centre and radius (NaN for lines), and index of the path."""

    a: Points
    b: Points
    bulge: Floats
    length: Floats
    center: Points
    radius: Floats
    path: Indices


def _segment_table(paths: Sequence[Polyline]) -> _Segments:
    chosen = [(i, p) for i, p in enumerate(paths) if not p.closed and p.n_segments]
    if not chosen:
        empty = np.zeros((0, 2))
        return _Segments(empty, empty, empty[:, 0], empty[:, 0], empty, empty[:, 0], np.zeros(0, dtype=np.int64))
    a = np.concatenate([p.vertices[:-1, :2] for _, p in chosen])
    b = np.concatenate([p.vertices[1:, :2] for _, p in chosen])
    bulge = np.concatenate([p.bulges for _, p in chosen])
    length = np.concatenate([p.lengths for _, p in chosen])
    path = np.concatenate([np.full(p.n_segments, i) for i, p in chosen])
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.where(bulge == 0.0, np.nan, (1.0 - bulge**2) / (4.0 * bulge))
    chord = b - a
    center = 0.5 * (a + b) + off[:, None] * np.column_stack([-chord[:, 1], chord[:, 0]])
    return _Segments(a, b, bulge, length, center, np.hypot(*(a - center).T), path)


def _split_positions(table: _Segments) -> dict[int, list[float]]:
    """Return the positions at which each overlapping segment is split, in mm from its start and in ascending order."""
    positions: dict[int, list[float]] = {}
    for first, second in (_overlapping_line_pairs(table), _overlapping_arc_pairs(table)):
        for i, j in ((first, second), (second, first)):
            starts, ends = _end_positions(table, i, j)
            for index, length, *stops in zip(
                i.tolist(), table.length[i].tolist(), starts.tolist(), ends.tolist(), strict=True
            ):
                inside = [s for s in stops if COINCIDENT < s < length - COINCIDENT]
                positions.setdefault(index, []).extend(inside)
    return {k: _without_close_stops(sorted(stops)) for k, stops in positions.items()}


def _without_close_stops(stops: list[float]) -> list[float]:
    kept: list[float] = []
    for stop in stops:
        if not kept or stop - kept[-1] > COINCIDENT:
            kept.append(stop)
    return kept


def _overlapping_line_pairs(table: _Segments) -> tuple[Indices, Indices]:
    lines = np.flatnonzero(table.bulge == 0.0)
    if len(lines) < 2:
        return lines[:0], lines[:0]
    shapes = shapely.linestrings(np.stack([table.a[lines], table.b[lines]], axis=1))
    batches = []
    for i, j in query_pairs(shapes, shapes, Message("coincident lines"), "dwithin", COINCIDENT):
        first, second = lines[i[i < j]], lines[j[i < j]]
        overlapping = _lines_overlap(table, first, second)
        batches.append(np.stack([first[overlapping], second[overlapping]]))
    first, second = np.concatenate(batches, axis=1)
    return first, second


def _lines_overlap(table: _Segments, i: Indices, j: Indices) -> NDArray[np.bool_]:
    direction = (table.b[i] - table.a[i]) / table.length[i][:, None]
    off = [
        np.abs(direction[:, 0] * d[:, 1] - direction[:, 1] * d[:, 0])
        for d in (table.a[j] - table.a[i], table.b[j] - table.a[i])
    ]
    start, end = _end_positions(table, i, j)
    overlap = np.minimum(np.maximum(start, end), table.length[i]) - np.maximum(np.minimum(start, end), 0.0)
    overlapping: NDArray[np.bool_] = (np.maximum(*off) <= COINCIDENT) & (overlap > COINCIDENT)
    return overlapping


def _end_positions(table: _Segments, i: Indices, j: Indices) -> tuple[Floats, Floats]:
    """Return the positions of both ends of segments `j` along segments `i`, mm. Both lie on the same line or circle."""
    line = table.bulge[i] == 0.0
    with np.errstate(invalid="ignore"):
        direction = (table.b[i] - table.a[i]) / table.length[i][:, None]
        on_line = [((p - table.a[i]) * direction).sum(axis=1) for p in (table.a[j], table.b[j])]
        side, radius = np.sign(table.bulge[i]), table.radius[i]
        first = np.arctan2(*(table.a[i] - table.center[i]).T[::-1])
        on_arc = []
        for p in (table.a[j], table.b[j]):
            angle = np.arctan2(*(p - table.center[i]).T[::-1]) - first
            # A point slightly before the start counts as before it, not as almost a full turn after it.
            turn = np.mod(side * angle + 1e-9, _FULL) - 1e-9
            on_arc.append(turn * radius)
    return np.where(line, on_line[0], on_arc[0]), np.where(line, on_line[1], on_arc[1])


def _overlapping_arc_pairs(table: _Segments) -> tuple[Indices, Indices]:
    arcs = np.flatnonzero(table.bulge != 0.0)
    if len(arcs) < 2:
        return arcs[:0], arcs[:0]
    by_radius = arcs[np.argsort(table.radius[arcs], kind="stable")]
    groups = np.split(by_radius, np.flatnonzero(np.diff(table.radius[by_radius]) > COINCIDENT) + 1)
    batches = [np.zeros((2, 0), dtype=np.int64)]
    for group in groups:
        if len(group) > 1:
            i, j, _ = point_pairs_within(table.center[group], COINCIDENT)
            batches.append(np.stack([group[i], group[j]]))
    first, second = np.concatenate(batches, axis=1)
    first, second = np.minimum(first, second), np.maximum(first, second)
    overlapping = _arcs_overlap(table, first, second)
    return first[overlapping], second[overlapping]


def _arcs_overlap(table: _Segments, i: Indices, j: Indices) -> NDArray[np.bool_]:
    first_end, second_end = _end_positions(table, i, j)
    opposite = np.sign(table.bulge[i]) != np.sign(table.bulge[j])
    start = np.where(opposite, second_end, first_end)
    turn = _FULL * table.radius[i]
    overlap = np.minimum(start + table.length[j], table.length[i]) - np.maximum(start, 0.0)
    overlap_across_start = np.minimum(start + table.length[j] - turn, table.length[i])
    alike = np.abs(table.radius[i] - table.radius[j]) <= COINCIDENT
    overlapping: NDArray[np.bool_] = alike & (np.maximum(overlap, overlap_across_start) > COINCIDENT)
    return overlapping


def _repeated_pieces(pieces: list[Polyline]) -> list[int]:
    if not pieces:
        return []
    middles = np.array([p.point_at(0.5 * p.length) for p in pieces])
    first, second, _ = point_pairs_within(middles, 2.0 * COINCIDENT)
    a, b = np.array([p.start for p in pieces]), np.array([p.end for p in pieces])

    def point_distances(p: Points, q: Points) -> Floats:
        gap: Floats = np.hypot(*(p - q).T)
        return gap

    straight = np.maximum(point_distances(a[first], a[second]), point_distances(b[first], b[second]))
    crossed = np.maximum(point_distances(a[first], b[second]), point_distances(b[first], a[second]))
    return sorted(set(second[np.minimum(straight, crossed) <= 2.0 * COINCIDENT].tolist()))


def _duplicates_to_restore(
    pieces: list[tuple[Polyline, int]], repeated: list[int], outlines: list[Polyline]
) -> set[int]:
    """Return the duplicates to restore, so that every point where three or more ends meet has an even number of ends.

    The function connects odd ends in pairs along every tree of duplicates (a T-join, computed from the leaves).
    """
    ends = path_ends([*(p for p, _ in pieces), *outlines])
    node = _number_ends(ends)
    doubles = set(repeated)
    present = np.array([k // 2 not in doubles for k in range(len(ends))])
    degree = np.bincount(node[present], minlength=len(ends))
    odd = (degree % 2 == 1) & (degree >= 3)
    neighbours: dict[int, list[tuple[int, int]]] = {}
    for k in repeated:
        u, v = int(node[2 * k]), int(node[2 * k + 1])
        neighbours.setdefault(u, []).append((v, k))
        neighbours.setdefault(v, []).append((u, k))
    needed: set[int] = set()
    visited: set[int] = set()
    for root in neighbours:
        if root in visited:
            continue
        visited.add(root)
        tree: list[tuple[int, int, int]] = []
        queue = deque([root])
        while queue:
            u = queue.popleft()
            for v, k in neighbours[u]:
                if v not in visited:
                    visited.add(v)
                    tree.append((v, u, k))
                    queue.append(v)
        if (sum(bool(odd[v]) for v, _, _ in tree) + bool(odd[root])) % 2:
            continue
        for v, u, k in reversed(tree):
            if odd[v]:
                needed.add(k)
                odd[v], odd[u] = False, not odd[u]
    return needed


def _number_ends(ends: Points) -> Indices:
    """Number the ends. Ends that are linked by distances of at most 2 · `COINCIDENT` get the same number."""
    first, second, _ = point_pairs_within(ends, 2.0 * COINCIDENT)
    return connected_components(len(ends), first, second)
