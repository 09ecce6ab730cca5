"""Tools, and the recipes that say which tools make a hole, in which order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from leafcut.model.kinds import ToolMaterial


class ToolKind(StrEnum):
    """Kinds of tool, in the order in which a hole meets them."""

    CENTRE_DRILL = "centre-drill"
    DRILL = "drill"
    REAMER = "reamer"
    TAP = "tap"
    SLOT_MILL = "slot-mill"
    END_MILL = "end-mill"
    BALL_MILL = "ball-mill"
    CHAMFER_MILL = "chamfer-mill"
    V_BIT = "v-bit"
    TORCH = "torch"


#: What mills: it has teeth, and a feed of its own straight down.
MILLS = (ToolKind.END_MILL, ToolKind.BALL_MILL, ToolKind.CHAMFER_MILL, ToolKind.V_BIT)
#: What mills with a cone.
CONES = (ToolKind.CHAMFER_MILL, ToolKind.V_BIT)


class BodySegment(NamedTuple):
    """A piece of what is above a tool's flutes: its length and its lower and upper diameter, mm."""

    length: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Tool:
    """One tool: mm, mm/s, rpm, rad, s.

    Attributes
    ----------
    number
        The T word.
    point_angle
        Full angle of the point, or of the cone of a chamfer mill or V-bit, rad; π for a flat end (reamer, tap, slot
        mill).
    cycle, peck, dwell
        The canned cycle this tool drills with; None means the plan's choice.
    pitch
        Of a tap: mm per revolution.
    flute_length
        Deepest cut, mm; None when the library does not say.
    depth
        Depth of a centre drill's point below the surface, mm.
    plunge_feed, teeth
        Of `MILLS`: the feed straight down, 0 where the library does not say it; how many teeth it has.
    corner_radius
        Of an end mill: mm; 0 for sharp corners.
    tip_diameter
        Of `CONES`: of the flat at the tip, mm; 0 for a sharp one.
    material, life_cost
        What its cutting edges are made of, and what one life of it costs, in any currency; None where the library does
        not say it.
    shank_diameter
        Above the flutes and the `shaft`, mm; None when the library does not say.
    stickout
        From the tip to the holder, mm; None when the library does not say.
    shaft, holder
        Pieces from the flutes up, and of what holds the tool, each from below.
    assumed
        True for a tool that stands in no library.
    """

    number: int
    diameter: float
    kind: ToolKind = ToolKind.DRILL
    name: str = ""
    point_angle: float = math.radians(118)
    feed: float = 0.0
    spindle_rpm: float = 0.0
    cycle: str | None = None
    peck: float | None = None
    dwell: float | None = None
    pitch: float | None = None
    flute_length: float | None = None
    depth: float | None = None
    plunge_feed: float = 0.0
    teeth: int | None = None
    corner_radius: float = 0.0
    tip_diameter: float = 0.0
    material: ToolMaterial | None = None
    life_cost: float | None = None
    shank_diameter: float | None = None
    stickout: float | None = None
    shaft: tuple[BodySegment, ...] = ()
    holder: tuple[BodySegment, ...] = ()
    assumed: bool = False

    @property
    def point_length(self) -> float:
        """Length of the cone from the full diameter to the tip, mm: (D/2) / tan(point angle / 2)."""
        return 0.5 * self.diameter / math.tan(0.5 * self.point_angle) if self.point_angle < math.pi else 0.0

    @property
    def label(self) -> str:
        """For people: ``T3 drill Ø6.35``."""
        return f"T{self.number} {self.name or self.kind.value} Ø{self.diameter:g}"


@dataclass(frozen=True)
class Recipe:
    """Which tools make a hole: drawn diameter in mm, optional layer (wildcards), tool numbers in their order."""

    diameter: float
    steps: tuple[int, ...]
    layer: str = "*"


@dataclass(frozen=True)
class ToolLibrary:
    """The tools of a shop, by number, and its recipes.

    `left_out` says in a line each which tools of the file are not among them, and why. Of a library `without_feeds` the
    feeds and speeds of drills are assumed.
    """

    tools: tuple[Tool, ...] = ()
    recipes: tuple[Recipe, ...] = ()
    source: str = ""
    left_out: tuple[str, ...] = ()
    without_feeds: bool = False
    by_number: dict[int, Tool] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_number", {t.number: t for t in self.tools})
