"""`PaceChange`: what new speeds did to a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class FeedLimit(NamedTuple):
    """What one limit of a tool's feeds is asked for at most, in the program and in the new one, and the limit itself.

    Attributes
    ----------
    name
        ``power`` of the spindle, W, ``torque``, N·mm, ``slot``: chip at the full width, mm a revolution, ``plunge``:
        the speed downwards in material, mm/s.
    before, after, limit
        A cut whose line cannot be changed keeps its feed: there `after` may be above the limit.
    """

    name: str
    before: float
    after: float
    limit: float


@dataclass(frozen=True)
class ToolPace:
    """What new feeds did to the cuts of one milling tool.

    Attributes
    ----------
    number, label
        The tool, and how it is called.
    feed_before, feed_after
        (lowest, highest) feed in the material, mm/s.
    chip_before, chip_after, chip_limit
        The thickest chip in a revolution, mm (of one tooth, if it had but one): of the program, of the new one, and
        what was allowed.
    limit_stated
        The limit is that of the tool's own feed and speed in its library; else the program's worst cut is.
    rate_before, rate_after
        The most that is taken off, mm³/s.
    limits
        The other limits whose data are known.
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
    """What new speeds did to a program.

    Attributes
    ----------
    air_s, feeds_s, retracts_s
        What rapids in the air save, what new feeds do, and what lower heights do, s; None where that was not asked for.
    rapids, clearance_mm
        How many stretches of cuts are rapids now; how near these come to material, mm; None where they never do.
    lowered
        So many heights are lower.
    changed
        So many motions have another feed.
    assumed
        The stock was not given: material was taken to stand wherever no rapid of the program went.
    tools
        Milling tools whose feeds were fitted, by number.
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
