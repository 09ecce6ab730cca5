"""`PaceChange`: effect of new speeds on a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class FeedLimit(NamedTuple):
    """Largest load against one limit of a tool's feeds, in the original and the new program, and the limit.

    Attributes
    ----------
    name
        ``power`` of the spindle, W, ``torque``, N·mm, ``slot``: chip at the full width, mm per revolution, ``plunge``:
        downward speed in material, mm/s.
    before, after, limit
        A cut whose line cannot be changed keeps its feed, so `after` may exceed the limit.
    """

    name: str
    before: float
    after: float
    limit: float


@dataclass(frozen=True)
class ToolPace:
    """Effect of new feeds on the cuts of a milling tool.

    Attributes
    ----------
    feed_before, feed_after
        (lowest, highest) feed in material, mm/s.
    chip_before, chip_after, chip_limit
        Largest chip thickness per revolution, mm (single-tooth equivalent): of the original, of the new program, and
        the limit.
    limit_stated
        Whether the limit follows from feed and speed in the tool library, rather than from the program's worst cut.
    rate_before, rate_after
        Largest material removal rate, mm³/s.
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
    """Effect of new speeds on a program.

    Attributes
    ----------
    air_s, feeds_s, retracts_s
        Time saved by rapids in the air, by new feeds, and by lower heights, s; None if not requested.
    rapids, clearance_mm
        Number of sections that became rapids, and their smallest distance to material, mm; None if they never approach
        any.
    assumed
        Whether the stock was unknown; material was then assumed wherever no rapid of the program went.
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
