"""The proof that a program engraves what is drawn: its cuts at depth cover the lines, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath


def check_lines(written: Toolpath, lines: Sequence[NDArray[np.float64]], depth: float, near: float) -> list[Difference]:
    """Return the lines that are not engraved, and engraved parts farther than `near` mm from all lines."""
    ends, before = written.end, written.before
    low = np.isin(written.kind, (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)) & (np.maximum(before[:, 2], ends[:, 2]) < 0.0)
    deep = low & (np.abs(ends[:, 2] + depth) < near)
    cuts = shapely.union_all(shapely.linestrings(np.stack([before[deep, :2], ends[deep, :2]], axis=1)))
    drawn = shapely.union_all([shapely.LineString(line) for line in lines])
    found = []
    if drawn.difference(cuts.buffer(near)).length > near:
        found.append(Difference("lines", 0, 0, "a line of the drawing is not engraved"))
    if cuts.difference(drawn.buffer(near)).length > near or (low & ~deep).any():
        found.append(Difference("lines", 0, 0, "something is engraved that is not drawn"))
    return found
