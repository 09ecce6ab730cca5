"""`Measure`: what a toolpath costs."""

from __future__ import annotations

from dataclasses import field

from leafcut.quick_dataclass import dataclass


@dataclass(frozen=True)
class Measure:
    """What a toolpath costs: rapid and cutting lengths in mm, machine time in s, and seconds by kind of motion.

    `by_kind` has the keys rapid, feed, dwell, tool_change and spindle.
    """

    travel_mm: float
    cut_mm: float
    time_s: float
    by_kind: dict[str, float] = field(default_factory=dict)
