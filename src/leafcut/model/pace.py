"""`Pace`: how fast each stretch of a program goes, by which rules, and which heights are lower."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


@dataclass(frozen=True)
class PaceRules:
    """What may be done to the feeds of a program.

    Attributes
    ----------
    air, feeds
        Make fed moves in the air rapids; fit feeds to the chips.
    clearance
        How far rapids that were none keep from all material, mm.
    increase
        By which factor a feed may grow at most.
    """

    air: bool
    feeds: bool
    clearance: float = 1.0
    increase: float = 1.5


class PaceStretch(NamedTuple):
    """A part of one motion: up to which share of it, and how fast, mm/s; infinite: a rapid."""

    until: float
    speed: float


@dataclass(frozen=True, eq=False)
class Pace:
    """New speeds: stretches by row of the path, and what the tools were limited to, by number."""

    stretches: dict[int, tuple[PaceStretch, ...]] = field(default_factory=dict)
    limits: dict[int, ToolLimits] = field(default_factory=dict)


class ToolLimits(NamedTuple):
    """What one tool is asked for at most: chip, mm per revolution at the full share, and volume, mm³/s.

    `stated` says that the chip is that of the tool's own feed and speed in its library, and not the program's worst.
    """

    chip: float
    rate: float
    stated: bool


class Lowered(NamedTuple):
    """A word of a block that gets another height: the block, Z or R, mm."""

    block: int
    letter: str
    height: float
