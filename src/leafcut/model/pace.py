"""`Pace`: new feeds and lower heights for the motions of a program, and the rules for them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from leafcut.model.work_material import WorkMaterial


@dataclass(frozen=True)
class PaceRules:
    """Changes to the feeds of a program that the user permits.

    Attributes
    ----------
    air
        Whether feed moves in air become rapids.
    clearance
        Minimum distance of these rapids from all material, mm.
    feeds
        Whether feeds follow the chip thickness.
    spindle
        The spindle with the material that it cuts; None if the material is unknown.
    """

    air: bool
    feeds: bool
    clearance: float = 1.0
    spindle: SpindleLoad | None = None


@dataclass(frozen=True)
class SpindleLoad:
    """Power, W, and torque, N·mm, of a spindle, and the material that it cuts.

    If the power or torque is unknown, it is treated as infinite. `efficiency` is the share of the power that reaches
    the tool.
    """

    material: WorkMaterial
    power: float = math.inf
    torque: float = math.inf
    efficiency: float = 1.0

    @property
    def limited(self) -> bool:
        """Whether the power or the torque is known."""
        return min(self.power, self.torque) < math.inf


class PaceStretch(NamedTuple):
    """A section of a motion.

    It has an end, as a fraction of the motion, and a speed, mm/s. The speed of a rapid is infinite.
    """

    until: float
    speed: float


@dataclass(frozen=True, eq=False)
class Pace:
    """New speeds of a program.

    The sections are stored by row of the path, and the limits by tool number.
    """

    stretches: dict[int, tuple[PaceStretch, ...]] = field(default_factory=dict)
    limits: dict[int, ToolLimits] = field(default_factory=dict)


class ToolLimits(NamedTuple):
    """Limits of a tool.

    Attributes
    ----------
    chip
        Chip thickness, mm per revolution at full engagement.
    rate
        Material removal rate, mm³/s.
    stated
        Whether the chip thickness comes from the feed and speed in the tool library. Otherwise it comes from the
        heaviest cut of the program.
    plunge
        Maximum plunge rate, mm/s; infinite if the library has none.
    spindle
        The spindle; None if the material, the spindle or the number of teeth is unknown.
    """

    chip: float
    rate: float
    stated: bool
    plunge: float = math.inf
    spindle: SpindleLoad | None = None
    teeth: int = 1


class CycleReturn(NamedTuple):
    """A block of a canned cycle that must return to the R plane (code 99) or to the initial height (code 98)."""

    block: int
    code: int


class Lowered(NamedTuple):
    """A new height, mm, for the Z or R word of a block."""

    block: int
    letter: str
    height: float
