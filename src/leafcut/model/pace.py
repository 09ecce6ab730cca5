"""`Pace`: how fast each stretch of a program goes, by which rules, and which heights are lower."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from leafcut.model.work_material import WorkMaterial


@dataclass(frozen=True)
class PaceRules:
    """What may be done to the feeds of a program.

    Attributes
    ----------
    air, feeds
        Make fed moves in the air rapids; fit feeds to the chips.
    clearance
        How far rapids that were none keep from all material, mm.
    spindle
        What the spindle gives, and what it cuts; None: the material is not known.
    """

    air: bool
    feeds: bool
    clearance: float = 1.0
    spindle: SpindleLoad | None = None


@dataclass(frozen=True)
class SpindleLoad:
    """What a spindle gives at most, and the material that it cuts.

    Attributes
    ----------
    material
        Its specific cutting force.
    power, torque
        W, N·mm; infinite where not known.
    efficiency
        Part of the power that reaches the tool.
    """

    material: WorkMaterial
    power: float = math.inf
    torque: float = math.inf
    efficiency: float = 1.0

    @property
    def limited(self) -> bool:
        """Whether power or torque is known."""
        return min(self.power, self.torque) < math.inf


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

    Attributes
    ----------
    stated
        The chip is that of the tool's own feed and speed in its library, and not the program's worst.
    plunge
        How fast it goes down at most, mm/s; infinite where its library does not say it.
    spindle, teeth
        What power and torque are reckoned with; None where the material, the spindle or the teeth are not known.
    """

    chip: float
    rate: float
    stated: bool
    plunge: float = math.inf
    spindle: SpindleLoad | None = None
    teeth: int = 1


class CycleReturn(NamedTuple):
    """A block of a canned cycle that is to come up to the R plane, code 99, or to the initial height, 98."""

    block: int
    code: int


class Lowered(NamedTuple):
    """A word of a block that gets another height: the block, Z or R, mm."""

    block: int
    letter: str
    height: float
