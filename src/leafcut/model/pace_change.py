"""`PaceChange`: how new speeds change a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class FeedLimit(NamedTuple):
    """A limit for the feeds of a tool, with the largest load in the original and in the new program.

    Attributes
    ----------
    name
        ``power`` or ``torque`` of the spindle, W or N·mm; or ``plunge``, the downward speed in material, mm/s.
    before, after, limit
        Load in the original and in the new program, and the limit. A cut whose line cannot be changed keeps its feed,
        so `after` may exceed the limit.
    """

    name: str
    before: float
    after: float
    limit: float


@dataclass(frozen=True)
class ToolPace:
    """How new feeds change the cuts of a milling tool.

    Attributes
    ----------
    feed_before, feed_after
        Lowest and highest feed in material, mm/s.
    chip_before, chip_after, chip_limit
        Maximum chip thickness per revolution in the original and in the new program, and its limit, mm, as if the tool
        had only one tooth.
    limit_stated
        Whether the limit comes from the feed and speed in the tool library. Otherwise it comes from the heaviest cut of
        the program.
    rate_before, rate_after
        Maximum material removal rate, mm³/s.
    """

    number: int
    label: str
    feed_before: tuple[float, float]
    feed_after: tuple[float, float]
    chip_before: float
    chip_after: float
    chip_limit: float
    limit_stated: bool
    rate_before: float
    rate_after: float
    limits: tuple[FeedLimit, ...] = ()


@dataclass(frozen=True)
class PaceChange:
    """How new speeds change a program.

    Attributes
    ----------
    air_s, feeds_s, retracts_s
        Time saved by rapids in air, by new feeds, and by lower heights, s; None if not requested.
    lowered, changed
        Number of heights that were lowered, and number of cuts with a new feed.
    rapids, clearance_mm
        Number of sections that became rapids, and their minimum distance from material, mm; None if all sections are
        far from material.
    assumed
        Whether the stock was unknown. Material is then assumed everywhere except on the rapids of the program.
    """

    air_s: float | None = None
    feeds_s: float | None = None
    retracts_s: float | None = None
    lowered: int = 0
    rapids: int = 0
    clearance_mm: float | None = None
    changed: int = 0
    assumed: bool = False
    tools: tuple[ToolPace, ...] = ()
