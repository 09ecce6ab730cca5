"""How fast the tool goes along its way at depth: chips as thick as its data say, whatever it meets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from leafcut.geometry.arrays import Floats, Indices
from leafcut.material.chip_feeds import allowed_feed
from leafcut.material.engagement import Engaged
from leafcut.material.least_around import least_around
from leafcut.material.removal import engaged_way
from leafcut.material.tool_steps import STRAIGHT_ON, ToolWay
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketPiece, PocketRules

#: No feed is above what comes within this share of the tool's diameter before and behind it.
AROUND = 0.25
#: Feeds are in steps of this factor.
STEP = 1.1
#: A feed that is not this much higher stays, as a share of the tool's.
LEAST = 1.05
#: A stretch is no shorter than this share of the tool's diameter …
SHORTEST = 0.5
#: … and is faster only where that saves so much, s.
WORTH = 0.05
#: A feed changes at a vertex of the way where one is so near, tool diameters.
SNAP = 0.1
#: Chips are planned thicker than they are, by cuts that are wider by so many tolerances.
WIDER = 2.0
#: What is shorter is no piece, mm.
_NOTHING = 1e-3


def with_feeds(
    pieces: Sequence[PocketPiece], limits: FeedLimits, rules: PocketRules, acceleration: float, *, anywhere: bool
) -> list[list[PocketPiece]]:
    """Return every piece divided where its feed changes, each part with its feed as a share of the tool's.

    Measured is the way of the pieces, in their order, over what is uncut before them. Faster are stretches on which the
    chips are thinner than in a slot, long enough for the machine to become faster and slower again: changes are in
    steps of a tenth, and a feed gives way half a diameter before and behind what it gives way to. Slower are those on
    which the cut would need more power than there is. What finishes a wall is made no faster; air and the loop along
    which the tool comes down keep their feeds.

    Parameters
    ----------
    acceleration
        Of the machine in the plane, mm/s².
    anywhere
        False: a feed changes at vertices of the way alone, and no move is divided.
    """
    way, engaged = engaged_way(PocketPath("", tuple(pieces)), rules)
    shares = _shares(pieces, way, _wider(way, engaged, rules), limits)
    places = [_Places.of(piece, way, number) for number, piece in enumerate(pieces)]
    if not anywhere:
        for place in places:
            shares[place.steps] = place.least_by_segment(shares[place.steps])
    for stretch in _stretches(pieces, way):
        shares[stretch] = _calm(shares[stretch], way.step[stretch], limits.feed, acceleration, rules)
    snap = SNAP * rules.tool_diameter if anywhere else math.inf
    return [
        [piece] if piece.kind == "air" else place.divided(piece, shares[place.steps], snap)
        for piece, place in zip(pieces, places, strict=True)
    ]


def _wider(way: ToolWay, engaged: Engaged, rules: PocketRules) -> Engaged:
    """Return what is engaged with each cut wider, and its edge nearer to the way, by what is not known of it.

    The proof measures what is written, with its rounding: at a vertex the way ahead may then be that of the line
    before it, of the one behind, or between them.
    """
    cross = np.abs(way.chord[:-1, 0] * way.chord[1:, 1] - way.chord[:-1, 1] * way.chord[1:, 0])
    turn = np.arctan2(cross, (way.chord[:-1] * way.chord[1:]).sum(axis=1))
    turn = np.minimum(np.maximum(np.append(turn, 0.0), np.append(0.0, turn)), STRAIGHT_ON)
    nearest = np.arccos(np.clip(engaged.chip, 0.0, 1.0)) - turn
    beside = np.sin(np.maximum(nearest, 0.0)) - WIDER * rules.tolerance / rules.radius
    chip = np.sqrt(1.0 - np.maximum(beside, 0.0) ** 2)
    wider = engaged.width + rules.tool_diameter * np.sin(turn) + 2.0 * WIDER * rules.tolerance
    cuts = engaged.angle > 0.0
    return engaged._replace(
        chip=np.where(cuts, chip, 0.0), width=np.where(cuts, np.minimum(wider, rules.tool_diameter), 0.0)
    )


def _shares(pieces: Sequence[PocketPiece], way: ToolWay, engaged: Engaged, limits: FeedLimits) -> Floats:
    """Return how fast every step may be, as a share of the tool's feed, in steps of `STEP` from the highest down."""
    allowed = allowed_feed(engaged, limits) / limits.feed
    kind = np.array([piece.kind for piece in pieces])[way.piece]
    allowed[kind == "finish"] = np.minimum(allowed[kind == "finish"], 1.0)
    # The loop along which the tool comes down may be a full cut: nothing is engaged by what is told of it.
    slot = Engaged(np.array([math.pi]), np.array([limits.diameter]), np.ones(1))
    allowed[kind == "entry"] = allowed_feed(slot, limits)[0] / limits.feed
    before = np.concatenate([[np.inf], allowed[:-1]])
    before[~np.isfinite(way.back[:, 0])] = np.inf
    step = np.minimum(allowed, before)
    step[kind == "air"] = np.inf
    least = least_around(step, way.step, AROUND * limits.diameter)
    most = limits.most / limits.feed
    down = np.ceil(np.log(most / np.minimum(least, most)) / math.log(STEP) - 1e-9)
    shares: Floats = most / STEP**down
    return np.where((least >= 1.0) & (shares < LEAST), 1.0, shares)


def _stretches(pieces: Sequence[PocketPiece], way: ToolWay) -> list[Indices]:
    """Return the steps that follow each other without a lift or air between them."""
    air = np.array([piece.kind == "air" for piece in pieces], dtype=bool)[way.piece]
    new = np.append(True, (way.run[1:] != way.run[:-1]) | (air[1:] != air[:-1]))[: len(way)]
    rows = np.split(np.arange(len(way)), np.flatnonzero(new)[1:])
    return [stretch for stretch in rows if len(stretch) and not air[stretch[0]]]


def _calm(shares: Floats, length: Floats, feed: float, acceleration: float, rules: PocketRules) -> Floats:
    """Return feeds without stretches that are too short to be worth it: those go as fast as what is beside them."""
    edges = np.flatnonzero(np.diff(shares)) + 1
    runs = [
        [float(part[0]), float(size.sum())]
        for part, size in zip(np.split(shares, edges), np.split(length, edges), strict=True)
    ]
    counts = [len(part) for part in np.split(shares, edges)]
    changed = True
    while changed:
        changed = False
        for k, (share, way) in enumerate(runs):
            beside = (runs[k - 1][0] if k else 1.0, runs[k + 1][0] if k + 1 < len(runs) else 1.0)
            lower = max((one for one in beside if one < share), default=None)
            if lower is not None and not _pays(share, lower, way, feed, acceleration, rules):
                runs[k][0], changed = lower, True
        runs, counts = _merged(runs, counts)
    return np.repeat([share for share, _ in runs], counts)


def _pays(share: float, lower: float, way: float, feed: float, acceleration: float, rules: PocketRules) -> bool:
    """Return whether a stretch is long enough to be faster than what is beside it."""
    fast, slow = share * feed, lower * feed
    longest = max(SHORTEST * rules.tool_diameter, (fast * fast - slow * slow) / acceleration)
    return way >= longest and way / slow - way / fast >= WORTH


def _merged(runs: list[list[float]], counts: list[int]) -> tuple[list[list[float]], list[int]]:
    """Return runs of equal feeds as one."""
    found: list[list[float]] = []
    many: list[int] = []
    for (share, way), count in zip(runs, counts, strict=True):
        if found and found[-1][0] == share:
            found[-1][1] += way
            many[-1] += count
        else:
            found.append([share, way])
            many.append(count)
    return found, many


class _Places:
    """Where the steps of one piece are along it, mm: `steps` are their rows, `ends` where each ends.

    `vertices` are where its lines and arcs end; `lifted`: the tool comes down where it begins.
    """

    def __init__(self, steps: Indices, ends: Floats, vertices: Floats, lifted: bool) -> None:
        self.steps, self.ends, self.vertices, self.lifted = steps, ends, vertices, lifted

    @classmethod
    def of(cls, piece: PocketPiece, way: ToolWay, number: int) -> _Places:
        """Return those of a piece."""
        first, last = np.searchsorted(way.piece, [number, number + 1])
        ends = np.cumsum(way.step[first:last])
        whole = float(ends[-1]) if len(ends) else 0.0
        scale = piece.path.length / whole if whole > 0.0 else 1.0  # chords of arcs are shorter than these
        lifted = bool(last > first and np.isnan(way.back[first, 0]))
        return cls(np.arange(first, last), ends * scale, np.cumsum(piece.path.lengths), lifted)

    def least_by_segment(self, shares: Floats) -> Floats:
        """Return the least feed of the line or arc that each step is on."""
        if not len(self.vertices):
            return shares
        middle = self.ends - 0.5 * np.diff(self.ends, prepend=0.0)
        segment = np.minimum(np.searchsorted(self.vertices, middle), len(self.vertices) - 1)
        least = np.full(len(self.vertices), np.inf)
        np.minimum.at(least, segment, shares)
        return np.asarray(least[segment])

    def divided(self, piece: PocketPiece, shares: Floats, snap: float) -> list[PocketPiece]:
        """Return a piece in parts of one feed each."""
        length = piece.path.length
        if not len(shares) or not length > _NOTHING:
            return [piece]
        if self.lifted and math.dist(piece.path.start, piece.path.end) <= SAME_PLACE:
            # The tool may come down along a ring: it stays one.
            return [PocketPiece(piece.path, piece.kind, float(shares.min()))]
        changes = np.flatnonzero(np.diff(shares))
        at = [0.0, *(self._snapped(float(self.ends[k]), snap) for k in changes.tolist()), length]
        kept = [
            (a, float(shares[k]))
            for (a, b), k in zip(pairwise(at), [*changes.tolist(), len(shares) - 1], strict=True)
            if b - a > _NOTHING
        ]
        if len(kept) < 2:
            return [PocketPiece(piece.path, piece.kind, kept[0][1] if kept else float(shares.min()))]
        starts = [0.0, *(start for start, _ in kept[1:])]
        ends = [*starts[1:], length]
        return [
            PocketPiece(piece.path.piece(start, end), piece.kind, share)
            for start, end, (_, share) in zip(starts, ends, kept, strict=True)
        ]

    def _snapped(self, place: float, snap: float) -> float:
        """Return a place, or the vertex that is near to it."""
        corners = np.append(0.0, self.vertices)
        near = float(corners[int(np.argmin(np.abs(corners - place)))])
        return near if abs(near - place) <= snap else place
