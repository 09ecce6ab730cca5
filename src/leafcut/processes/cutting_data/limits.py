"""The speeds and feeds that a machine can run, and the limits that select among them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Mask
from leafcut.processes.cutting_data.economics import CuttingResults
from leafcut.units import SECONDS_PER_MINUTE

#: Number of combinations in a batch, maximum number of combinations, and maximum number of speeds.
_BATCH_SIZE, _MAX_CANDIDATES, _MAX_SPEEDS = 200_000, 20_000_000, 1_000_000
#: Rounding tolerance of the grid.
_ROUNDING_TOLERANCE = 1e-9


class SpeedGrid(NamedTuple):
    """All pairs of speed, rpm, and feed, mm/s, with a feed per tooth between `least_chip` and `largest_chip`, mm."""

    lowest_rpm: float
    highest_rpm: float
    rpm_step: float
    highest_feed: float
    feed_step: float
    least_chip: float
    largest_chip: float
    teeth: int = 1

    def blocks(self) -> Iterator[tuple[Floats, Floats]]:
        """Yield all pairs of speed, rpm, and feed, mm/s, in batches. Raises PlanError if there are too many."""
        speeds = self._steps(self.lowest_rpm, self.highest_rpm, self.rpm_step)
        by_rpm = self.teeth / SECONDS_PER_MINUTE
        first = np.maximum(np.ceil(self.least_chip * by_rpm * speeds / self.feed_step - _ROUNDING_TOLERANCE), 1.0)
        highest = np.minimum(self.largest_chip * by_rpm * speeds, self.highest_feed)
        counts = np.maximum(np.floor(highest / self.feed_step + _ROUNDING_TOLERANCE) - first + 1.0, 0.0)
        if not counts.sum() <= _MAX_CANDIDATES:
            raise PlanError(
                f"{counts.sum():.3g} speeds and feeds are too many (at most {_MAX_CANDIDATES:g}); lower the machine's "
                "spindle.max_speed"
            )
        ends = np.cumsum(counts)
        start = 0
        while start < len(speeds):
            done = ends[start - 1] if start else 0.0
            stop = max(int(np.searchsorted(ends, done + _BATCH_SIZE, side="right")), start + 1)
            batch_counts = counts[start:stop].astype(np.int64)
            rpm = np.repeat(speeds[start:stop], batch_counts)
            number = np.arange(len(rpm)) - np.repeat(np.cumsum(batch_counts) - batch_counts, batch_counts)
            yield (
                rpm,
                np.asarray(self.feed_step * (np.repeat(first[start:stop], batch_counts) + number), dtype=np.float64),
            )
            start = stop

    @staticmethod
    def _steps(low: float, high: float, step: float) -> Floats:
        """Return the multiples of a step between `low` and `high`, or else `high` alone."""
        first, last = max(math.ceil(low / step - _ROUNDING_TOLERANCE), 1), math.floor(high / step + _ROUNDING_TOLERANCE)
        if last - first >= _MAX_SPEEDS:
            raise PlanError(f"{last - first:.3g} spindle speeds are too many; lower the machine's spindle.max_speed")
        return step * np.arange(first, last + 1, dtype=float) if last >= first else np.array([high])


@dataclass
class CuttingLimit:
    """A limit of speeds and feeds, and its effect on the candidates.

    `alone` states whether any candidate is within this limit, regardless of the other limits. `nearest` is the value of
    the candidate that comes closest to the limit.
    """

    quantity: str
    flag: str
    value: float
    shown: Callable[[float], str]
    values_of: Callable[[CuttingResults], Floats]
    at_least: bool = False
    alone: bool = False
    nearest: float = field(default=math.nan)

    def holds(self, results: CuttingResults) -> Mask:
        """Return a mask of the candidates within the limit, and record the value that comes closest to it."""
        values = self.values_of(results)
        within: Mask = values >= self.value if self.at_least else values <= self.value
        best = float(values.max() if self.at_least else values.min())
        self.nearest = (np.fmax if self.at_least else np.fmin)(self.nearest, best)
        return within


def within_limits(limits: list[CuttingLimit], results: CuttingResults) -> Mask:
    """Return a mask of the candidates within all limits, and record the effect of each limit."""
    allowed = np.ones(len(results.rpm), dtype=bool)
    for limit in limits:
        mask = limit.holds(results)
        limit.alone |= bool(mask.any())
        allowed &= mask
    return allowed


def limit_error(label: str, limits: list[CuttingLimit]) -> PlanError:
    """Return an error that names the limit that excludes all candidates.

    Usually a single limit excludes them all, because a slower spindle with a thinner chip improves every limited
    quantity.
    """
    for limit in limits:
        if not limit.alone:
            least, most = ("at least", "at most") if limit.at_least else ("at most", "at least")
            return PlanError(
                f"{label}: no speed and feed reaches a {limit.quantity} of {least} {limit.shown(limit.value)}; "
                f"possible is {most} {limit.shown(limit.nearest)}; change {limit.flag}"
            )
    flags = ", ".join(dict.fromkeys(limit.flag for limit in limits))
    return PlanError(f"{label}: no speed and feed is within all limits together; change {flags}")
