"""`Pace`: new feeds for the motions of a program, the rules for them, and lowered heights."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from leafcut.model.work_material import WorkMaterial


@dataclass(frozen=True)
class PaceRules:
    """Permitted changes to the feeds of a program.

    With `air`, feed moves in air become rapids, which stay at least `clearance` mm away from all material. With
    `feeds`, feeds follow the chip thickness. `spindle` is None if the material is unknown.
    """

    air: bool
    feeds: bool
    clearance: float = 1.0
    spindle: SpindleLoad | None = None


@dataclass(frozen=True)
class SpindleLoad:
    """Power, W, and torque, N·mm, of a spindle (infinite if unknown), and the material that it cuts.

    `efficiency` is the share of the power that reaches the tool.
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
    """A section of a motion: its end as a fraction of the motion, and its speed, mm/s; the speed of a rapid is
    infinite.
    """

    until: float
    speed: float


@dataclass(frozen=True, eq=False)
class Pace:
    """New speeds of a program: row of the path → its sections, and tool number → limits of the tool."""

    stretches: dict[int, tuple[PaceStretch, ...]] = field(default_factory=dict)
    limits: dict[int, ToolLimits] = field(default_factory=dict)


class ToolLimits(NamedTuple):
    """Limits of a tool: chip thickness, mm per revolution at full engagement, and material removal rate, mm³/s.

    `stated` means that the chip thickness follows from feed and speed of the tool library, and not from the heaviest
    cut of the program. `plunge` is the maximum plunge rate, mm/s, infinite if the library has none. `spindle` is None
    if the material, the spindle or the number of teeth is unknown.
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
