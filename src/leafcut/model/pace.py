"""`Pace`: new feeds of a program's motions, the rules for them, and lowered heights."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from leafcut.model.work_material import WorkMaterial


@dataclass(frozen=True)
class PaceRules:
    """Permitted changes to the feeds of a program.

    `air` replaces feeds in air by rapids, `clearance` mm from all material; `feeds` adapts feeds to the chip. `spindle`
    is None if the material is unknown.
    """

    air: bool
    feeds: bool
    clearance: float = 1.0
    spindle: SpindleLoad | None = None


@dataclass(frozen=True)
class SpindleLoad:
    """Limits of a spindle, W and N·mm (infinite if unknown), and the material that it cuts.

    `efficiency` is the fraction of the power that reaches the tool.
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
    """A section of a motion: its end as a fraction of the motion, and its speed, mm/s; infinite: a rapid."""

    until: float
    speed: float


@dataclass(frozen=True, eq=False)
class Pace:
    """New speeds: sections by row of the path, and the limits of the tools, by number."""

    stretches: dict[int, tuple[PaceStretch, ...]] = field(default_factory=dict)
    limits: dict[int, ToolLimits] = field(default_factory=dict)


class ToolLimits(NamedTuple):
    """Limits of a tool: chip, mm per revolution at full engagement, and material removal rate, mm³/s.

    `stated`: the chip follows from feed and speed in the tool library, rather than from the program's worst cut.
    `plunge` is the highest plunge rate, mm/s; infinite if the library has none. `spindle` and `teeth` are None if the
    material, the spindle or the teeth are unknown.
    """

    chip: float
    rate: float
    stated: bool
    plunge: float = math.inf
    spindle: SpindleLoad | None = None
    teeth: int = 1


class CycleReturn(NamedTuple):
    """A block of a canned cycle that shall return to the R plane, code 99, or to the initial height, 98."""

    block: int
    code: int


class Lowered(NamedTuple):
    """A word of a block with a new height: the block, Z or R, mm."""

    block: int
    letter: str
    height: float
