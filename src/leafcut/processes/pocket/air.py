"""Where the tool cuts nothing on its way at depth: those stretches become pieces of their own, at a higher feed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.material.removal import engaged_way
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules

if TYPE_CHECKING:
    from leafcut.material.engagement import Engaged
    from leafcut.material.tool_steps import ToolWay


#: Shorter stretches keep their feed: the machine would hardly be faster, tool diameters.
SHORTEST = 0.5
#: The higher feed begins and ends so far from where something is cut, tool diameters: a step of what is measured.
MARGIN = 0.05
#: What is shorter than this is no piece, mm.
NOTHING = 1e-3


def with_air(
    pieces: Sequence[PocketPiece], way: ToolWay, engaged: Engaged, rules: PocketRules
) -> list[list[PocketPiece]]:
    """Return every piece divided where the tool begins or ceases to cut: what cuts nothing is of the kind ``air``.

    `way` and `engaged` are measured of the pieces, in their order. A finishing piece and an entry stay as they are.
    What is found is measured once more, as it is divided: a sliver thinner than a step may lie between two places of
    the one measure and at a place of the other, and the proof measures what is written.
    """
    stations, free = np.cumsum(way.step), _free(way, engaged, rules)
    rows = np.arange(len(pieces))
    ends = stations[np.searchsorted(way.piece, rows, side="right") - 1]
    begins = np.concatenate([[0.0], ends[:-1]])
    found = []
    for piece, begin, end in zip(pieces, begins.tolist(), ends.tolist(), strict=True):
        if piece.kind not in ("rough", "link") or end - begin <= NOTHING:
            found.append([piece])
            continue
        near = free[(free[:, 1] > begin) & (free[:, 0] < end)]
        share = piece.path.length / (end - begin)  # chords of arcs are shorter than these
        found.append(_divided(piece, (np.clip(near, begin, end) - begin) * share))
    return _looked_again(pieces, found, rules)


def _looked_again(
    pieces: Sequence[PocketPiece], found: list[list[PocketPiece]], rules: PocketRules
) -> list[list[PocketPiece]]:
    """Return the pieces with those cut at the usual feed after all that are not air once they are measured alone."""
    every = [one for many in found for one in many]
    if all(one.kind != "air" for one in every):
        return found
    way, engaged = engaged_way(PocketPath("", tuple(every)), rules)
    cutting = set(np.unique(way.piece[engaged.angle > 0.0]).tolist())
    number = count()
    return [
        [PocketPiece(one.path, piece.kind) if next(number) in cutting and one.kind == "air" else one for one in many]
        for piece, many in zip(pieces, found, strict=True)
    ]


def _free(way: ToolWay, engaged: Engaged, rules: PocketRules) -> Floats:
    """Return the stretches of a way on which nothing is cut, from station to station, float64[n, 2], mm."""
    stations = np.cumsum(way.step)
    # A step is free where both its ends are, and no lift lies between them.
    step = (engaged.angle == 0.0) & np.isfinite(way.back[:, 0])
    step[1:] &= (engaged.angle[:-1] == 0.0) | (way.step[1:] == 0.0)
    edge = np.flatnonzero(np.diff(np.concatenate([[False], step, [False]]).astype(np.int8)))
    first, last = edge[0::2], edge[1::2] - 1
    margin = MARGIN * rules.tool_diameter
    free = np.column_stack([stations[first] - way.step[first] + margin, stations[last] - margin])
    long: Floats = free[free[:, 1] - free[:, 0] >= SHORTEST * rules.tool_diameter]
    return long


def _divided(piece: PocketPiece, free: Floats) -> list[PocketPiece]:
    """Return a piece divided at the ends of stretches, mm from where it begins."""
    parts, at, length = [], 0.0, piece.path.length
    for start, end in free.tolist():
        parts += [(at, start, piece.kind), (start, end, "air")]
        at = end
    parts.append((at, length, piece.kind))
    parts = [part for part in parts if part[1] - part[0] > NOTHING]
    if len(parts) == 1:
        return [PocketPiece(piece.path, parts[0][2])]
    ends = [*(start for start, _, _ in parts[1:]), length]
    starts = [0.0, *ends[:-1]]
    return [PocketPiece(piece.path.piece(a, b), part[2]) for a, b, part in zip(starts, ends, parts, strict=True)]
