"""`PaceChange`: the effect of new speeds on a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class FeedLimit(NamedTuple):
    """A limit of a tool's feeds, and the largest load in the original and in the new program.

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
    """The effect of new feeds on the cuts of a milling tool.

    Attributes
    ----------
    feed_before, feed_after
        Lowest and highest feed in material, mm/s.
    chip_before, chip_after, chip_limit
        Maximum chip thickness per revolution in the original and in the new program, and its limit, mm, as if the tool
        had one tooth.
    limit_stated
        Whether the limit follows from feed and speed of the tool library, and not from the heaviest cut of the program.
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
    """The effect of new speeds on a program.

    Attributes
    ----------
    air_s, feeds_s, retracts_s
        Time saved by rapids in air, by new feeds, and by lower heights, s; None if not requested.
    lowered, changed
        Number of lowered heights, and number of cuts with a new feed.
    rapids, clearance_mm
        Number of sections that became rapids, and their minimum distance from material, mm; None if all sections are
        far from material.
    assumed
        Whether the stock was unknown. Then material is assumed everywhere except on the rapids of the program.
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
