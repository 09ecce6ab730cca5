"""How much of the tool's edge is in material, step by step along the way: exact by circles against circles.

At a place p the tool has removed what its disc swept so far. Engaged is the part of its edge, on the half of the
circle that looks ahead, that lies in none of it. What was swept is taken as discs one step apart, so that each covers
one interval of angles about p and their union is found by sorting: no raster, no polygon.

Two circles of one radius touch each other all the time (the edge has just been there), so material is looked for a
tolerance inside the edge: a film thinner than the tolerance is no material. The disc that the tool stands on then
covers exactly the half behind it, and discs of the same run nearer than `_NEAR` are shrunk by the tolerance, too, or
the fresh edge would seem to be cut by the step before.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.model.pocket import PocketRules
from leafcut.stock.tool_steps import ToolWay

#: Pairs of places that are looked at together: few, so that what is reckoned stays in the cache.
_PAIRS = 120_000
#: Places that are looked at together: the earlier ones are put into cells once for all of them.
_BLOCK = 1024
#: Angles of one place lie within −π … π; this keeps those of different places apart when they are sorted together.
_APART = 16.0
_HALF = 0.5 * math.pi
#: An engagement below this is rounding, rad.
_NOTHING = 1e-6


class Engaged(NamedTuple):
    """What the tool engages at every place of a way: the angle of its edge, rad, at most π; its width, mm; float64[n].

    The width is measured square to the way: the strip of material that the tool takes off sideways, its whole diameter
    in a slot. `chip` is the thickest chip as a share of the feed per tooth: cos of the least angle between the way
    ahead and an engaged part of the edge, 1 where material is straight ahead. Of a straight cut a wide at one side,
    a < r, that is √(1 − (1 − a/r)²), the 2 √(a/D (1 − a/D)) of chip thinning (`stock.chip_thickness`).
    """

    angle: Floats
    width: Floats
    chip: Floats


def engagement(way: ToolWay, rules: PocketRules, entry: NDArray[np.bool_] | None = None) -> Engaged:
    """Return what is engaged at every place of a way.

    Exact at the places but for what the tolerance t does to the width of material: an angle φ is true within
    t / (r sin φ), 0.1 degrees at 90 for a tool of 10 mm and 0.01 mm; where less than 2t is cut it may be 0. In between
    it is not looked at: an edge met head-on within one step shows at the step's end.

    Parameters
    ----------
    entry
        Places on the loop along which the tool came down: it has cleared them on its way, and 0 is told.
    """
    angles, widths, chips = (np.zeros(len(way)) for _ in range(3))
    place = np.cumsum(way.step)
    for first in range(0, len(way), _BLOCK):
        block = np.arange(first, min(first + _BLOCK, len(way)))
        # All earlier places count, those too where nothing was engaged: a film that they took off, thinner than the
        # tolerance, would be material for others, and such films would add up.
        for rows, who, whom in _pairs(way, block, 2.0 * rules.radius):
            angles[rows], widths[rows], chips[rows] = _engaged(way, rules, place, rows, who, whom)
    if entry is not None:
        angles[entry] = widths[entry] = chips[entry] = 0.0
    return Engaged(angles, widths, chips)


def _engaged(
    way: ToolWay,
    rules: PocketRules,
    place: Floats,
    rows: NDArray[np.int64],
    who: NDArray[np.int64],
    whom: NDArray[np.int64],
) -> Engaged:
    """Return what is engaged at some rows, in order; `whom` are the earlier places near `who`."""
    edge = rules.radius - rules.tolerance
    near = 2.0 * math.sqrt(2.0 * rules.radius * rules.tolerance)
    to = way.xy[whom] - way.xy[who]
    distance = np.hypot(to[:, 0], to[:, 1])
    recent = (way.run[who] == way.run[whom]) & (place[who] - place[whom] < near)
    disc = np.where(recent, edge, rules.radius)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (edge * edge + distance * distance - disc * disc) / (2.0 * edge * distance)
    # A disc about the very place: covers everything when it is an old one, and nothing that `back` does not otherwise.
    cosine = np.where(distance > 0.0, cosine, np.where(recent, 2.0, -2.0))
    half = np.arccos(np.clip(cosine, -1.0, 1.0))
    centre = _angle(to, way.ahead[who])
    behind = rows[np.isfinite(way.back[rows, 0])]
    own = _angle(-way.back[behind], way.ahead[behind])
    number = np.searchsorted(rows, np.concatenate([who, behind]))
    centre, half = np.concatenate([centre, own]), np.concatenate([half, np.full(len(own), _HALF)])
    angle, width, nearest = _covered(number, centre - half, centre + half, len(rows))
    angle, width, chip = math.pi - angle, rules.radius * (2.0 - width), np.cos(nearest)
    nothing = angle <= _NOTHING
    angle[nothing] = width[nothing] = chip[nothing] = 0.0
    return Engaged(angle, width, chip)


def _angle(vector: Floats, ahead: Floats) -> Floats:
    """Return the angles of vectors against the way ahead, counter-clockwise, rad."""
    (x, y), (ahead_x, ahead_y) = vector.T, ahead.T
    angle: Floats = np.arctan2(ahead_x * y - ahead_y * x, ahead_x * x + ahead_y * y)
    return angle


def _covered(who: NDArray[np.int64], low: Floats, high: Floats, count: int) -> tuple[Floats, Floats, Floats]:
    """Return what the intervals of every one cover together of −π/2 … π/2, float64[count] each.

    How much of it; how much of its sines; and the least angle, either way, that they leave uncovered, π/2 without one.
    """
    every, lows, highs = [], [], []
    for turn in (-math.tau, 0.0, math.tau):
        a, b = np.maximum(low + turn, -_HALF), np.minimum(high + turn, _HALF)
        there = b > a
        every.append(who[there])
        lows.append(a[there])
        highs.append(b[there])
    # One of no width at the end of every one's half: what is uncovered before it is seen as any other gap.
    each = np.arange(count)
    owner = np.concatenate([*every, each])
    start = np.concatenate([*lows, np.full(count, _HALF)]) + _APART * owner
    end = np.concatenate([*highs, np.full(count, _HALF)]) + _APART * owner
    order = np.argsort(start)
    owner, start, end = owner[order], start[order], end[order]
    reach = np.maximum.accumulate(end) if len(end) else end
    before = np.concatenate([[-np.inf], reach[:-1]])[: len(end)]
    # From the end of what is covered to where the next begins.
    gap_low, gap_high = np.maximum(before - _APART * owner, -_HALF), start - _APART * owner
    gap = gap_high - gap_low > _NOTHING
    nearest = np.full(count, _HALF)
    np.minimum.at(nearest, owner[gap], np.maximum(np.maximum(gap_low, -gap_high), 0.0)[gap])
    start = np.minimum(np.maximum(start, before), end)
    angle = np.bincount(owner, end - start, minlength=count)
    width = np.bincount(owner, np.sin(end - _APART * owner) - np.sin(start - _APART * owner), minlength=count)
    return np.minimum(angle, math.pi), np.minimum(width, 2.0), nearest


def _pairs(
    way: ToolWay, block: NDArray[np.int64], reach: float
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]]:
    """Yield some rows of a block, and the pairs (one of them, an earlier one that covers edge ahead of it).

    A disc at the distance d, an angle a off the way ahead, covers its edge up to acos(d / 2r) from a on both sides: a
    place ahead only where cos a > −√(1 − (d / 2r)²).
    """
    (x, y), (ahead_x, ahead_y) = np.ascontiguousarray(way.xy.T), np.ascontiguousarray(way.ahead.T)
    places, earlier = way.xy[block], way.xy[: block[-1] + 1]
    # Only what is near the block is sorted into cells: all earlier places would be sorted once for every block.
    around = (earlier >= places.min(axis=0) - reach) & (earlier <= places.max(axis=0) + reach)
    near = np.flatnonzero(around[:, 0] & around[:, 1])
    for stretch, one, other in near_pairs(places, earlier[near], reach):
        who, whom = block[one], near[other]
        dx, dy = x[whom] - x[who], y[whom] - y[who]
        square = dx * dx + dy * dy
        keep = np.flatnonzero((square < reach * reach) & (whom < who))
        who, whom, square = who[keep], whom[keep], square[keep]
        side = dx[keep] * ahead_x[who] + dy[keep] * ahead_y[who]
        # With some room for the discs that are looked at a tolerance inside their edge.
        ahead = (side > -0.1 * reach) | (side * side < 1.1 * square * (1.0 - square / reach**2))
        yield block[stretch], who[ahead], whom[ahead]


def near_pairs(
    xy: Floats, others: Floats, reach: float
) -> Iterator[tuple[slice, NDArray[np.int64], NDArray[np.int64]]]:
    """Yield stretches of `xy` and the pairs (one of them, one of `others`) in the same or neighbouring cells.

    All pairs nearer than `reach` are among them, and some that are not. At most some `_PAIRS` at a time, or those of
    one place.
    """
    if not len(xy) or not len(others):
        yield from ([(slice(0, len(xy)), np.zeros(0, np.int64), np.zeros(0, np.int64))] if len(xy) else [])
        return
    low = np.minimum(xy.min(axis=0), others.min(axis=0))
    side = 0.5 * reach  # five by five cells are looked at: less beside the circle than three by three twice as large
    cell, other = (np.floor((points - low) / side).astype(np.int64) + 2 for points in (xy, others))
    wide = int(max(cell[:, 0].max(), other[:, 0].max())) + 3
    key = other[:, 1] * wide + other[:, 0]
    order = np.argsort(key, kind="stable")
    key = key[order]
    middle = cell[:, 1] * wide + cell[:, 0]
    rows_of_cells = middle[:, None] + wide * np.arange(-2, 3)
    first = np.searchsorted(key, rows_of_cells - 2, side="left")
    count = np.searchsorted(key, rows_of_cells + 2, side="right") - first
    total = np.cumsum(count.sum(axis=1))
    begin = 0
    while begin < len(xy):
        done = total[begin - 1] if begin else 0
        end = max(int(np.searchsorted(total, done + _PAIRS, side="right")), begin + 1)
        many = count[begin:end].ravel()
        who = np.repeat(np.repeat(np.arange(begin, end), 5), many)
        offset = np.arange(len(who)) - np.repeat(np.cumsum(many) - many, many)
        yield slice(begin, end), who, order[np.repeat(first[begin:end].ravel(), many) + offset]
        begin = end
