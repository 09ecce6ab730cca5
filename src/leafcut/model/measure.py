"""`Measure`: the lengths and the machine time of a toolpath."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Measure:
    """Lengths of the rapids and cuts in a toolpath, mm, and its machine time, s.

    Attributes
    ----------
    by_kind
        Seconds of rapid, feed, dwell, tool_change and spindle.
    by_tool
        Seconds with each tool, by tool number, including the change to the tool. Empty for a path with fewer than two
        tools. Number 0 is the time before the first tool.
    start
        Position before the first move, (x, y) in mm, if the time includes the move from this position.
    lines
        Byte and word counts of the sent lines, int64[n] each, if the time depends on them (GRBL).
    """

    travel_mm: float
    cut_mm: float
    time_s: float
    by_kind: dict[str, float] = field(default_factory=dict)
    by_tool: dict[int, float] = field(default_factory=dict)
    start: tuple[float, float] | None = None
    lines: tuple[NDArray[np.int64], NDArray[np.int64]] | None = field(default=None, compare=False, repr=False)
