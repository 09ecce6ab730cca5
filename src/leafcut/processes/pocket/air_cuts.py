"""Divide a path at its air cuts, where the tool cuts nothing at depth, so that these sections get a higher feed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.material.removal import engaged_tool_path
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.feeds import MIN_LENGTH, divide_section

if TYPE_CHECKING:
    from leafcut.material.engagement import Engaged
    from leafcut.material.tool_steps import ToolSteps


#: Minimum length of an air cut, in tool diameters; a shorter air cut would save hardly any time.
MIN_AIR_CUT = 0.5
#: Distance from the material at which the higher feed starts and ends, in tool diameters (one step of the measurement).
MARGIN = 0.05


def divide_at_air_cuts(
    pieces: Sequence[PocketPiece], path: ToolSteps, engaged: Engaged, rules: PocketRules
) -> list[list[PocketPiece]]:
    """Divide each path section where the tool enters or leaves the material; sections in air get the kind ``air``.

    `path` and `engaged` are the sampled path and its engagement. Finishing sections and entries are not divided. The
    divided path is measured again, because the first measurement may have missed a sliver between two samples, and
    verification samples the program at other points.
    """
    stations, free = np.cumsum(path.step), _air_cuts(path, engaged, rules)
    rows = np.arange(len(pieces))
    ends = stations[np.searchsorted(path.piece, rows, side="right") - 1]
    starts = np.concatenate([[0.0], ends[:-1]])
    result = []
    for piece, start, end in zip(pieces, starts.tolist(), ends.tolist(), strict=True):
        if piece.kind not in ("rough", "link") or end - start <= MIN_LENGTH:
            result.append([piece])
            continue
        near = free[(free[:, 1] > start) & (free[:, 0] < end)]
        share = piece.path.length / (end - start)  # because arcs are longer than their sampled chords
        result.append(_divide_section(piece, (np.clip(near, start, end) - start) * share))
    return _without_false_air_cuts(pieces, result, rules)


def _without_false_air_cuts(
    pieces: Sequence[PocketPiece], divided: list[list[PocketPiece]], rules: PocketRules
) -> list[list[PocketPiece]]:
    parts = [part for pieces_of in divided for part in pieces_of]
    if all(part.kind != "air" for part in parts):
        return divided
    path, engaged = engaged_tool_path(PocketPath("", tuple(parts)), rules)
    cutting = set(np.unique(path.piece[engaged.angle > 0.0]).tolist())
    number = count()
    return [
        [
            PocketPiece(part.path, piece.kind) if next(number) in cutting and part.kind == "air" else part
            for part in pieces_of
        ]
        for piece, pieces_of in zip(pieces, divided, strict=True)
    ]


def _air_cuts(path: ToolSteps, engaged: Engaged, rules: PocketRules) -> Floats:
    """Return the start and end of each air cut, measured along the path, float64[n, 2], mm."""
    stations = np.cumsum(path.step)
    # A step is in air if both its ends are in air and the tool is not lifted between them.
    step = (engaged.angle == 0.0) & np.isfinite(path.back[:, 0])
    step[1:] &= (engaged.angle[:-1] == 0.0) | (path.step[1:] == 0.0)
    edge = np.flatnonzero(np.diff(np.concatenate([[False], step, [False]]).astype(np.int8)))
    first, last = edge[0::2], edge[1::2] - 1
    margin = MARGIN * rules.tool_diameter
    free = np.column_stack([stations[first] - path.step[first] + margin, stations[last] - margin])
    long: Floats = free[free[:, 1] - free[:, 0] >= MIN_AIR_CUT * rules.tool_diameter]
    return long


def _divide_section(piece: PocketPiece, free: Floats) -> list[PocketPiece]:
    """Divide a section at its air cuts.

    `free` contains the start and end of each air cut, mm from the start of the section, float64[n, 2].
    """
    parts, at = [], 0.0
    for start, end in free.tolist():
        parts += [(at, piece.kind, 1.0), (start, "air", 1.0)]
        at = end
    return divide_section(piece, [*parts, (at, piece.kind, 1.0)])
