"""Convert the strokes of a drawing to outlines: join the strokes and remove duplicates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.cleaning import ends_of
from leafcut.geometry.index import near_pairs
from leafcut.geometry.joining import Joined, Joining, join
from leafcut.geometry.overlaps import without_overlaps
from leafcut.geometry.polyline import COINCIDENT, Polyline
from leafcut.message import Message

#: Chord error of outlines when they are checked, mm.
CHORDS = 0.01
#: Maximum number of chords of all outlines together.
MOST_CHORDS = 20_000_000
#: Maximum --join-tolerance that a message proposes, mm. Accidental gaps are smaller. The ends of a hole's centre cross
#: are farther apart; joined, they would form a diamond.
WIDEST_PROPOSED_JOIN = 0.5


@dataclass
class TidiedOutlines(Joining):
    """Outlines joined from strokes, the branches of the drawing, and the positions of removed duplicates."""

    doubles: list[Point] = field(default_factory=list)


def join_advice(number: int, paths: Sequence[Polyline]) -> str:
    """Return advice on the open path `paths[number]` for a message: the nearest end of any path, and a remedy.

    The nearest end may be the other end of the same path.
    """
    ends = ends_of(paths)
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
    """Join strokes to outlines. Strokes that do not form closed outlines are joined again after duplicates are removed.

    Raises
    ------
    PlanError
        Hundreds of ends or lines lie at the same position.
    """
    first = join(strokes, tolerance)
    sound = [joined for joined in first.paths if strokes[joined.members[0]].closed]
    loops = [joined for joined in first.paths if joined.path.closed and not strokes[joined.members[0]].closed]
    flaws = _has_flaws([joined.path for joined in loops])
    sound += [loop for loop, flaw in zip(loops, flaws, strict=True) if not flaw]
    used = {i for joined in sound for i in joined.members}
    remaining = [i for i in range(len(strokes)) if i not in used]
    if not remaining:
        return TidiedOutlines(first.paths)
    covered = _lie_on_outlines([strokes[i] for i in remaining], [joined.path for joined in sound])
    covered_strokes = [i for i, c in zip(remaining, covered, strict=True) if c]
    loose = [i for i, c in zip(remaining, covered, strict=True) if not c]

    unique = without_overlaps([strokes[i] for i in loose])
    rejoined = join([p for p, _ in unique.paths], tolerance)
    rejoined_paths = [
        joined._replace(members=_source_strokes(joined, unique.paths, loose)) for joined in rejoined.paths
    ]
    doubles = [strokes[i].point_at(0.5 * strokes[i].length) for i in covered_strokes] + unique.removed
    open_ones = any(not joined.path.closed for joined in rejoined_paths)
    branches = sorted({*first.branches, *rejoined.branches}) if open_ones else rejoined.branches
    return TidiedOutlines(sorted([*sound, *rejoined_paths], key=lambda joined: min(joined.members)), branches, doubles)


def _source_strokes(joined: Joined, pieces: Sequence[tuple[Polyline, int]], loose: Sequence[int]) -> list[int]:
    return list(dict.fromkeys(loose[pieces[k][1]] for k in joined.members))


def polygons(paths: Sequence[Polyline]) -> Any:
    """Return closed paths as shapely polygons, with arcs approximated by chords.

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


def _has_flaws(paths: Sequence[Polyline]) -> list[bool]:
    """Return, for each closed path, whether it crosses itself or encloses no area."""
    shapes = polygons(paths)
    thin = 2.0 * shapely.area(shapes) <= COINCIDENT * shapely.length(shapes)
    return list(thin | ~shapely.is_valid(shapes))


def _lie_on_outlines(loose: Sequence[Polyline], outlines: Sequence[Polyline]) -> list[bool]:
    """Return for each open stroke whether it lies on an outline, and no other stroke continues from its ends."""
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

    first, second, _ = near_pairs(ends, COINCIDENT)
    for a, b in ((first, second), (second, first)):
        on_outline[(a // 2)[~on_outline[b // 2]]] = False
    return list(on_outline)
