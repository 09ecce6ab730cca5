"""Bridges: straight ways through the scrap from one closed cut to another, along which the torch stays on.

Two contours can be bridged when they border on the same piece of scrap: two outlines that lie directly on the sheet, or
directly in the same hole, or an outline and the hole around it (which comes last: it lets the scrap go). A bridge
leaves the one kerf at once, comes to the other, and between them touches no part, no clamp and no other kerf.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Indices, Mask, Points
from leafcut.processes.sheet.plan.cut_contours import ROUNDING, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import closing_joint, directions_of, in_loop
from leafcut.processes.sheet.plan.leads.leads import Scrap, as_lines

#: A contour is looked at in so many places; so many neighbours of it are looked at, the nearest.
SAMPLES, NEIGHBOURS = 160, 8
#: Places of a contour at most, and of all contours together; places nearer to each other than this are one, mm.
PLACES, MOST_PLACES, SAME_PLACE = 16, 3000, 1.0
#: A bridge has left its contour's kerf after so many kerfs.
LEAVES_WITHIN = 3.0


@dataclass(frozen=True, eq=False)
class ChainPlaces:
    """Where contours may be begun in a chain.

    Attributes
    ----------
    contour
        Position in the list of contours, int64[n].
    at
        Along its path, float64[n], mm.
    arrive, leave
        Where a bridge ends, and where the next begins, float64[n, 2], mm.
    """

    contour: Indices
    at: NDArray[np.float64]
    arrive: Points
    leave: Points


@dataclass(frozen=True, eq=False)
class Bridges:
    """Bridges between places: from and to (int64[n], positions in `places`) and their lengths, float64[n], mm."""

    places: ChainPlaces
    begin: Indices
    end: Indices
    length: NDArray[np.float64]


def clockwise_of(contour: CutContour, rules: CutRules) -> bool:
    """Return which way round a contour of a chain is cut."""
    return directions_of(contour, rules)[0]


def scrap_of(contour: CutContour) -> int:
    """Return which scrap lies along a contour: the hole (index in `Sheet.contours`) that it is in; -1 for the sheet.

    A notch that the kerf of its outline closes is a scrap of its own: -2 less the index of the outline.
    """
    if contour.hole:
        return contour.index
    return -2 - contour.notch_of if contour.notch_of >= 0 else contour.source.parent


def find_bridges(contours: list[CutContour], members: Sequence[int], scrap: Scrap, reach: float) -> Bridges:
    """Return all bridges between some contours (positions in `contours`) that are shorter than `reach` mm."""
    pairs = _neighbours(contours, members, reach)
    places = _places(contours, pairs, reach, scrap.rules)
    begin, end = _near(places, pairs, reach)
    step = places.arrive[end] - places.leave[begin]
    length = np.hypot(*step.T) if len(step) else np.zeros(0)
    lines = np.stack([places.leave[begin], places.arrive[end]], axis=1).reshape(-1, 2, 2)
    fits = _fit(contours, places, begin, end, lines, scrap)
    return Bridges(places, begin[fits], end[fits], length[fits])


def _neighbours(contours: list[CutContour], members: Sequence[int], reach: float) -> list[tuple[int, int]]:
    """Return pairs of contours along the same scrap, the nearest of each; both ways round, but never from a hole."""
    lines = np.array([contours[k].line for k in members], dtype=object)
    if not len(lines):
        return []
    a, b = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=reach)
    side = np.array([scrap_of(contours[k]) for k in members])
    keep = (a != b) & (side[a] == side[b])
    a, b = a[keep], b[keep]
    away = shapely.distance(lines[a], lines[b])
    rank = np.lexsort((away, a))
    chosen: set[tuple[int, int]] = set()
    count: dict[int, int] = {}
    for k in rank.tolist():
        one, other = members[int(a[k])], members[int(b[k])]
        count[one] = count.get(one, 0) + 1
        if count[one] <= NEIGHBOURS:
            chosen |= {(one, other), (other, one)}
    return sorted((one, other) for one, other in chosen if not contours[one].hole)


# -- places ----------------------------------------------------------------------------------------------------------


def _places(contours: list[CutContour], pairs: Sequence[tuple[int, int]], reach: float, rules: CutRules) -> ChainPlaces:
    """Return places that are near to a neighbour, or to two of them at once, and what lies opposite of these."""
    near: dict[int, list[int]] = {}
    for one, other in pairs:
        near.setdefault(one, []).append(other)
        near.setdefault(other, []).append(one)
    wanted: dict[int, dict[float, float]] = {k: {} for k in near}
    for k, neighbours in near.items():
        contour, others = contours[k], sorted(set(neighbours))
        at = _samples(contour, rules)
        points = shapely.points([contour.path.point_at(a) for a in at])
        away = np.array([shapely.distance(points, contours[o].line) for o in others])
        for i, j in itertools.combinations_with_replacement(range(len(others)), 2):
            for best, total in _between(away[i], away[j], reach):
                # A place between two neighbours is worth as much as two places beside one.
                _want(wanted[k], float(at[best]), total * (0.5 if i != j else 0.25))
                for o in {others[i], others[j]}:
                    share = float(shapely.line_locate_point(contours[o].line, points[best], normalized=True))
                    _want(wanted[o], share * contours[o].path.length, total)
    most = max(2, min(PLACES, MOST_PLACES // max(len(wanted), 1)))
    rows = [(k, at) for k in sorted(wanted) for at in _spread(contours[k], wanted[k], most, rules)]
    return _laid_out(contours, rows, rules)


def _between(one: NDArray[np.float64], other: NDArray[np.float64], reach: float) -> set[tuple[int, float]]:
    """Return the places with the least way to two neighbours together, and to the farther one, and the ways' sum, mm.

    `one` and `other` are the distances of the places to the neighbours.
    """
    total, farther = one + other, np.maximum(one, other)
    if not (farther < reach).any():
        return set()
    # Of equal sums the one half-way: it sees both.
    best = int(np.lexsort((farther, np.round(np.where(farther < reach, total, np.inf), 1)))[0])
    return {(k, float(total[k])) for k in (best, int(np.argmin(farther)))}


def _laid_out(contours: list[CutContour], rows: Sequence[tuple[int, float]], rules: CutRules) -> ChainPlaces:
    arrive, leave = [], []
    for k, at in rows:
        contour = contours[k]
        arrive.append(contour.path.point_at(at))
        leave.append(contour.path.point_at(left_at(contour, at, clockwise_of(contour, rules), rules)))
    return ChainPlaces(
        np.array([k for k, _ in rows], dtype=np.int64),
        np.array([at for _, at in rows], dtype=np.float64),
        np.array(arrive, dtype=np.float64).reshape(-1, 2),
        np.array(leave, dtype=np.float64).reshape(-1, 2),
    )


def left_at(contour: CutContour, at: float, clockwise: bool, rules: CutRules) -> float:
    """Return where along its path a contour in the middle of a chain is left: where it began, or a joint before."""
    return at + (closing_joint(contour, rules) if clockwise else -closing_joint(contour, rules))


def joins(
    contours: list[CutContour],
    pair: tuple[int, int],
    ends: tuple[tuple[float, float], tuple[float, float]],
    scrap: Scrap,
) -> bool:
    """Return whether two contours border on the same scrap and there is room for a bridge between `ends`."""
    one, other = (contours[k] for k in pair)
    if one.hole or pair[0] == pair[1] or scrap_of(one) != scrap_of(other):
        return False
    lines = np.array([ends])
    kerf = scrap.rules.kerf
    apart = leaves_at_once(lines, one.line, kerf)[0] and leaves_at_once(lines[:, ::-1], other.line, kerf)[0]
    return bool(apart and scrap.free(as_lines(lines), one, other)[0])


def _samples(contour: CutContour, rules: CutRules) -> NDArray[np.float64]:
    """Return places along a contour that are looked at: evenly, and where its segments meet."""
    length = contour.path.length
    even = (np.arange(SAMPLES) + 0.5) * length / SAMPLES
    meet = np.cumsum(contour.path.lengths)[:-1][:SAMPLES]
    at = np.unique(np.concatenate([even, meet]))
    kept = [a for a in at.tolist() if not in_loop(contour, a, rules)]
    return np.array(kept or at.tolist())


def _want(wanted: dict[float, float], at: float, away: float) -> None:
    wanted[at] = min(away, wanted.get(at, np.inf))


def _spread(contour: CutContour, wanted: dict[float, float], most: int, rules: CutRules) -> list[float]:
    """Return the places nearest to neighbours, but none beside another, sorted."""
    kept: list[float] = []
    length = contour.path.length
    for at in sorted(wanted, key=lambda a: (wanted[a], a)):
        if in_loop(contour, at, rules) or any(min((at - b) % length, (b - at) % length) < SAME_PLACE for b in kept):
            continue
        kept.append(at)
        if len(kept) == most:
            break
    return sorted(kept)


# -- ways ------------------------------------------------------------------------------------------------------------


def _near(places: ChainPlaces, pairs: Sequence[tuple[int, int]], reach: float) -> tuple[Indices, Indices]:
    """Return pairs of places of neighbouring contours that are nearer than `reach`."""
    of: dict[int, Indices] = {int(k): np.flatnonzero(places.contour == k) for k in np.unique(places.contour)}
    begin, end = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for one, other in pairs:
        a, b = of.get(one), of.get(other)
        if a is None or b is None:
            continue
        step = places.leave[a][:, None] - places.arrive[b][None]
        i, j = np.nonzero(np.hypot(step[..., 0], step[..., 1]) < reach)
        begin.append(a[i])
        end.append(b[j])
    return np.concatenate(begin), np.concatenate(end)


def _fit(
    contours: list[CutContour],
    places: ChainPlaces,
    begin: Indices,
    end: Indices,
    lines: NDArray[np.float64],
    scrap: Scrap,
) -> Mask:
    """Return which bridges (float64[n, 2, 2]) lie in scrap, bool[n]."""
    ok = np.zeros(len(lines), dtype=bool)
    if not len(lines):
        return ok
    groups: dict[tuple[int, int], list[int]] = {}
    for k, pair in enumerate(zip(places.contour[begin].tolist(), places.contour[end].tolist(), strict=True)):
        groups.setdefault(pair, []).append(k)
    shapes = as_lines(lines)
    for (one, other), group in groups.items():
        a, b = contours[one], contours[other]
        own = leaves_at_once(lines[group], a.line, scrap.rules.kerf)
        own &= leaves_at_once(lines[group][:, ::-1], b.line, scrap.rules.kerf)
        rows = np.array(group)[own]
        if len(rows):
            ok[rows] = scrap.free(shapes[rows], a, b)
    return ok


def leaves_at_once(lines: NDArray[np.float64], kerf_line: Any, kerf: float) -> Mask:
    """Return which straight lines (float64[n, 2, 2]) that begin on a kerf leave it at once and stay away, bool[n].

    `kerf_line` is what the middle of that kerf follows, a shapely line.
    """
    step = lines[:, 1] - lines[:, 0]
    length = np.hypot(*step.T)
    share = np.minimum(LEAVES_WITHIN * kerf / np.maximum(length, 1e-9), 1.0)
    rest = np.stack([lines[:, 0] + share[:, None] * step, lines[:, 1]], axis=1)
    away: NDArray[np.float64] = shapely.distance(as_lines(rest), kerf_line)
    # A rest without length is no line to GEOS, and near to nothing.
    short = share >= 1.0
    away[short] = shapely.distance(shapely.points(lines[short, 1]), kerf_line)
    stays: Mask = away >= kerf - ROUNDING
    return stays
