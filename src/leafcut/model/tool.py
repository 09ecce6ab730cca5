"""Tools, and recipes that list the tools for a hole in order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from fnmatch import fnmatch
from typing import NamedTuple

from leafcut.model.kinds import ToolMaterial


class ToolKind(StrEnum):
    """Kinds of tools, in the order in which they machine a hole."""

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


#: Milling tools, which have teeth and a plunge feed.
MILLS = (ToolKind.END_MILL, ToolKind.BALL_MILL, ToolKind.CHAMFER_MILL, ToolKind.V_BIT)
#: Conical milling tools.
CONES = (ToolKind.CHAMFER_MILL, ToolKind.V_BIT)


class BodySegment(NamedTuple):
    """A section of a tool above its flutes. It has a length, and a lower and an upper diameter, mm."""

    length: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Tool:
    """A tool. Units are mm, mm/s, rpm, rad and s.

    Attributes
    ----------
    number
        Number in the T word.
    point_angle
        Included angle of the point, or of the cone of a chamfer mill or V-bit, rad; π for a flat end (reamer, tap, slot
        mill).
    cycle, peck, dwell
        Canned cycle of this tool and its parameters. If they are None, the plan chooses them.
    pitch
        Pitch of a tap, mm per revolution.
    flute_length
        Maximum depth of cut, mm; None if the library does not state it.
    depth
        Depth of a centre drill's point below the surface, mm.
    plunge_feed, teeth
        Plunge rate and number of teeth of `MILLS`. The plunge rate is 0 if the library does not state it.
    corner_radius
        Corner radius of an end mill, mm; 0 for sharp corners.
    tip_diameter
        Diameter of the flat at the tip of `CONES`, mm; 0 for a sharp tip.
    material, life_cost
        Material of the cutting edges, and cost of a worn tool in any currency; None if the library does not state it.
    shank_diameter
        Diameter above the flutes and the `shaft`, mm; None if the library does not state it.
    stickout
        Length from the tip to the holder, mm; None if the library does not state it.
    shaft, holder
        Sections between flutes and shank, and sections of the holder, both from the bottom up.
    assumed
        Whether leafcut assumed the tool because the library does not contain it.
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
    def reach(self) -> float:
        """Maximum depth of the tip, mm. The flutes still extend out of the hole, and the holder stays above it."""
        return min(
            math.inf if self.flute_length is None else self.flute_length,
            math.inf if self.stickout is None else self.stickout,
        )

    @property
    def label(self) -> str:
        """Name for messages: ``T3 drill Ø6.35``."""
        return f"T{self.number} {self.name or self.kind.value} Ø{self.diameter:g}"


#: Maximum stroke without pecking, diameters (usually 3 to 5). In a longer stroke, chips pack the flutes, and the drill
#: breaks.
LONGEST_STROKE = 5.0


@dataclass(frozen=True)
class Recipe:
    """The tools for a kind of hole.

    A recipe has a drawn diameter, mm, a layer (with wildcards), and the tool numbers in the order of use.
    """

    diameter: float
    steps: tuple[int, ...]
    layer: str = "*"


@dataclass(frozen=True)
class ToolLibrary:
    """The tools and recipes of a shop.

    `left_out` has a line for each tool in the file that leafcut cannot use, with the reason. With `without_feeds`,
    leafcut assumes the feeds and speeds of drills.
    """

    tools: tuple[Tool, ...] = ()
    recipes: tuple[Recipe, ...] = ()
    source: str = ""
    left_out: tuple[str, ...] = ()
    without_feeds: bool = False
    by_number: dict[int, Tool] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_number", {t.number: t for t in self.tools})

    def recipes_for(self, diameter: float, layer: str, tolerance: float) -> list[Recipe]:
        """Return the recipes for holes with a drawn diameter, mm, on a layer."""
        return [
            recipe
            for recipe in self.recipes
            if abs(recipe.diameter - diameter) <= tolerance and fnmatch(layer.lower(), recipe.layer.lower())
        ]
