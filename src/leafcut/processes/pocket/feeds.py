"""Adapt the feed to the engagement, so that no chip is thicker than the cutting data of the tool allow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from leafcut.geometry.arrays import Floats, Indices
from leafcut.material.chip_feeds import allowed_feed, sliding_minimum_along_path
from leafcut.material.engagement import Engaged, slot_engagement
from leafcut.material.removal import engaged_tool_path
from leafcut.material.tool_steps import STRAIGHT_ON, ToolSteps
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.pocket import SAME_PLACE, PocketPath, PocketPiece, PocketRules

#: Distance along the path within which a feed respects the limits of all cuts, in tool diameters.
AROUND = 0.25
#: Ratio between two consecutive steps of the feed.
STEP = 1.1
#: Minimum increased feed, relative to the tool's feed. Smaller increases are ignored.
LEAST = 1.05
#: Minimum length of a section with its own feed, in tool diameters.
SHORTEST = 0.5
#: Minimum time that a faster section must save, s.
MIN_SAVING = 0.05
#: Maximum distance between a feed change and the nearest vertex at which the change snaps to this vertex, in tool
#: diameters.
SNAP = 0.1
#: Safety margin that is added to the width of a cut, in path tolerances.
WIDTH_MARGIN = 2.0
#: Minimum length of a path section, mm.
MIN_LENGTH = 1e-3


def with_load_dependent_feeds(
    pieces: Sequence[PocketPiece], limits: FeedLimits, rules: PocketRules, acceleration: float, *, anywhere: bool
) -> list[list[PocketPiece]]:
    """Divide each section of a path wherever its feed changes. Feeds are relative to the feed of the tool.

    A section gets a higher feed if its chips are thinner than in a slot, and if the machine has room to speed up and
    slow down. A section gets a lower feed if the cut would exceed the power of the spindle. Feeds change in steps of 10
    %. Finishing sections and entry loops never get a higher feed, and air cuts keep their feed.

    Parameters
    ----------
    acceleration
        Acceleration of the machine in the plane, mm/s².
    anywhere
        Whether a feed may change in the middle of a move. Otherwise, feeds only change at vertices of the path.
    """
    path, engaged = engaged_tool_path(PocketPath("", tuple(pieces)), rules)
    shares = _allowed_feed_shares(pieces, path, _widened_by_uncertainty(path, engaged, rules), limits)
    places = [_PieceSteps.of(piece, path, number) for number, piece in enumerate(pieces)]
    if not anywhere:
        for place in places:
            shares[place.steps] = place.lowest_share_by_segment(shares[place.steps])
    for stretch in _cutting_stretches(pieces, path):
        shares[stretch] = _merge_short_stretches(shares[stretch], path.step[stretch], limits.feed, acceleration, rules)
    snap = SNAP * rules.tool_diameter if anywhere else math.inf
    return [
        [piece] if piece.kind == "air" else place.divide(piece, shares[place.steps], snap)
        for piece, place in zip(pieces, places, strict=True)
    ]


def _widened_by_uncertainty(path: ToolSteps, engaged: Engaged, rules: PocketRules) -> Engaged:
    """Widen each cut by its uncertainty, and return the resulting engagement.

    The verification measures a program with rounded coordinates. At a vertex, the measured direction can therefore be
    wrong by up to the turn of the path at this vertex.
    """
    cross = np.abs(path.chord[:-1, 0] * path.chord[1:, 1] - path.chord[:-1, 1] * path.chord[1:, 0])
    turn = np.arctan2(cross, (path.chord[:-1] * path.chord[1:]).sum(axis=1))
    turn = np.minimum(np.maximum(np.append(turn, 0.0), np.append(0.0, turn)), STRAIGHT_ON)
    nearest = np.arccos(np.clip(engaged.chip, 0.0, 1.0)) - turn
    beside = np.sin(np.maximum(nearest, 0.0)) - WIDTH_MARGIN * rules.tolerance / rules.radius
    chip = np.sqrt(1.0 - np.maximum(beside, 0.0) ** 2)
    wider = engaged.width + rules.tool_diameter * np.sin(turn) + 2.0 * WIDTH_MARGIN * rules.tolerance
    cuts = engaged.angle > 0.0
    return engaged._replace(
        chip=np.where(cuts, chip, 0.0), width=np.where(cuts, np.minimum(wider, rules.tool_diameter), 0.0)
    )


def _allowed_feed_shares(
    pieces: Sequence[PocketPiece], path: ToolSteps, engaged: Engaged, limits: FeedLimits
) -> Floats:
    """Return the allowed feed at each step, relative to the feed of the tool.

    The result is rounded down to a feed step.
    """
    allowed = allowed_feed(engaged, limits) / limits.feed
    kind = np.array([piece.kind for piece in pieces])[path.piece]
    allowed[kind == "finish"] = np.minimum(allowed[kind == "finish"], 1.0)
    # The engagement on an entry loop is not measured, so a slot is assumed.
    allowed[kind == "entry"] = allowed_feed(slot_engagement(limits.diameter), limits)[0] / limits.feed
    before = np.concatenate([[np.inf], allowed[:-1]])
    before[~np.isfinite(path.back[:, 0])] = np.inf
    step = np.minimum(allowed, before)
    step[kind == "air"] = np.inf
    least = sliding_minimum_along_path(step, path.step, AROUND * limits.diameter)
    highest = limits.most / limits.feed
    down = np.ceil(np.log(highest / np.minimum(least, highest)) / math.log(STEP) - 1e-9)
    shares: Floats = highest / STEP**down
    return np.where((least >= 1.0) & (shares < LEAST), 1.0, shares)


def _cutting_stretches(pieces: Sequence[PocketPiece], path: ToolSteps) -> list[Indices]:
    """Return the indices of consecutive cutting steps. Each array covers the steps between two retracts or air cuts."""
    air = np.array([piece.kind == "air" for piece in pieces], dtype=bool)[path.piece]
    new = np.append(True, (path.run[1:] != path.run[:-1]) | (air[1:] != air[:-1]))[: len(path)]
    rows = np.split(np.arange(len(path)), np.flatnonzero(new)[1:])
    return [stretch for stretch in rows if len(stretch) and not air[stretch[0]]]


def _merge_short_stretches(
    shares: Floats, length: Floats, feed: float, acceleration: float, rules: PocketRules
) -> Floats:
    """Slow down sections that are too short to save time. They get the next lower feed of a neighbouring section."""
    edges = np.flatnonzero(np.diff(shares)) + 1
    runs = [
        [float(part[0]), float(size.sum())]
        for part, size in zip(np.split(shares, edges), np.split(length, edges), strict=True)
    ]
    counts = [len(part) for part in np.split(shares, edges)]
    changed = True
    while changed:
        changed = False
        for k, (share, distance) in enumerate(runs):
            beside = (runs[k - 1][0] if k else 1.0, runs[k + 1][0] if k + 1 < len(runs) else 1.0)
            lower = max((neighbour for neighbour in beside if neighbour < share), default=None)
            if lower is not None and not _saves_time(share, lower, distance, feed, acceleration, rules):
                runs[k][0], changed = lower, True
        runs, counts = _merge_equal_shares(runs, counts)
    return np.repeat([share for share, _ in runs], counts)


def _saves_time(
    share: float, lower: float, distance: float, feed: float, acceleration: float, rules: PocketRules
) -> bool:
    fast, slow = share * feed, lower * feed
    longest = max(SHORTEST * rules.tool_diameter, (fast * fast - slow * slow) / acceleration)
    return distance >= longest and distance / slow - distance / fast >= MIN_SAVING


def _merge_equal_shares(runs: list[list[float]], counts: list[int]) -> tuple[list[list[float]], list[int]]:
    merged: list[list[float]] = []
    sizes: list[int] = []
    for (share, distance), count in zip(runs, counts, strict=True):
        if merged and merged[-1][0] == share:
            merged[-1][1] += distance
            sizes[-1] += count
        else:
            merged.append([share, distance])
            sizes.append(count)
    return merged, sizes


def divide_section(piece: PocketPiece, parts: Sequence[tuple[float, str, float]]) -> list[PocketPiece]:
    """Divide a path section into parts. `parts` contains the start, mm, the kind and the relative feed of each part.

    Parts shorter than `MIN_LENGTH` are merged with a neighbour.
    """
    ends = [*(start for start, _, _ in parts[1:]), piece.path.length]
    kept = [part for part, end in zip(parts, ends, strict=True) if end - part[0] > MIN_LENGTH]
    if len(kept) < 2:
        _, kind, feed = kept[0] if kept else min(parts, key=lambda part: part[2])
        return [PocketPiece(piece.path, kind, feed)]
    starts = [0.0, *(start for start, _, _ in kept[1:]), piece.path.length]
    return [
        PocketPiece(piece.path.piece(start, end), kind, feed)
        for (start, end), (_, kind, feed) in zip(pairwise(starts), kept, strict=True)
    ]


class _PieceSteps:
    """The sampled steps of a path section.

    Attributes
    ----------
    steps
        Indices of the steps.
    ends
        Distance from the start of the section to the end of each step, mm.
    vertices
        Distance from the start of the section to each vertex except the first vertex, mm.
    lifted
        Whether the section starts with a descent.
    """

    def __init__(self, steps: Indices, ends: Floats, vertices: Floats, lifted: bool) -> None:
        self.steps, self.ends, self.vertices, self.lifted = steps, ends, vertices, lifted

    @classmethod
    def of(cls, piece: PocketPiece, path: ToolSteps, number: int) -> _PieceSteps:
        first, last = np.searchsorted(path.piece, [number, number + 1])
        ends = np.cumsum(path.step[first:last])
        whole = float(ends[-1]) if len(ends) else 0.0
        scale = piece.path.length / whole if whole > 0.0 else 1.0  # because arcs are longer than their sampled chords
        lifted = bool(last > first and np.isnan(path.back[first, 0]))
        return cls(np.arange(first, last), ends * scale, np.cumsum(piece.path.lengths), lifted)

    def lowest_share_by_segment(self, shares: Floats) -> Floats:
        if not len(self.vertices):
            return shares
        middle = self.ends - 0.5 * np.diff(self.ends, prepend=0.0)
        segment = np.minimum(np.searchsorted(self.vertices, middle), len(self.vertices) - 1)
        least = np.full(len(self.vertices), np.inf)
        np.minimum.at(least, segment, shares)
        return np.asarray(least[segment])

    def divide(self, piece: PocketPiece, shares: Floats, snap: float) -> list[PocketPiece]:
        length = piece.path.length
        if not len(shares) or not length > MIN_LENGTH:
            return [piece]
        if self.lifted and math.dist(piece.path.start, piece.path.end) <= SAME_PLACE:
            # Do not divide a ring, because the tool may descend along it.
            return [PocketPiece(piece.path, piece.kind, float(shares.min()))]
        changes = np.flatnonzero(np.diff(shares))
        starts = [0.0, *(self._snap_to_vertex(float(self.ends[k]), snap) for k in changes.tolist())]
        values = shares[[*changes.tolist(), len(shares) - 1]].tolist()
        return divide_section(piece, [(start, piece.kind, share) for start, share in zip(starts, values, strict=True)])

    def _snap_to_vertex(self, place: float, snap: float) -> float:
        corners = np.append(0.0, self.vertices)
        near = float(corners[int(np.argmin(np.abs(corners - place)))])
        return near if abs(near - place) <= snap else place
