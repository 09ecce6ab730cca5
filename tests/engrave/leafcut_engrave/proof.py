"""Check that the cuts of a program at depth cover the lines of the drawing, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath


def check_lines(written: Toolpath, lines: Sequence[NDArray[np.float64]], depth: float, near: float) -> list[Difference]:
    """Return a difference if a line is not engraved, and if a cut is not at `depth` within `near` mm of a line."""
    ends, before = written.end, written.before
    low = np.isin(written.kind, (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)) & (np.maximum(before[:, 2], ends[:, 2]) < 0.0)
    deep = low & (np.abs(ends[:, 2] + depth) < near)
    cuts = shapely.union_all(shapely.linestrings(np.stack([before[deep, :2], ends[deep, :2]], axis=1)))
    drawn = shapely.union_all([shapely.LineString(line) for line in lines])
    differences = []
    if drawn.difference(cuts.buffer(near)).length > near:
        differences.append(Difference(Message("missing line"), 0, 0, Message("a line of the drawing is not engraved")))
    if cuts.difference(drawn.buffer(near)).length > near or (low & ~deep).any():
        text = Message("a cut is not on a line of the drawing, or not at its depth")
        differences.append(Difference(Message("cut not drawn"), 0, 0, text))
    return differences
