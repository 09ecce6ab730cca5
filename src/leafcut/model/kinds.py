"""What machines work with, how sheet is cut, what programs do, and what tools are made of: words easily mixed up.

The processes of leafcut are a fourth one, which packages from outside make longer: `processes.registry.names`.
"""

from __future__ import annotations

from enum import StrEnum


class CutMethod(StrEnum):
    """How sheet is cut. A name in a cut chart begins with it: ``laser_fiber_3kW``."""

    PLASMA = "plasma"
    LASER = "laser"
    OXYFUEL = "oxyfuel"
    WATERJET = "waterjet"


class Head(StrEnum):
    """What a machine works with; the word of its profile's key ``process``."""

    SPINDLE = "spindle"
    TORCH = "torch"
    LASER = "laser"
    FLAME = "flame"
    WATER = "water"

    @property
    def method(self) -> CutMethod | None:
        """How it cuts sheet; None for a spindle."""
        return _METHODS.get(self)

    @classmethod
    def that_cuts(cls, method: CutMethod) -> Head:
        """Return what a machine needs to cut so."""
        return next(head for head, cuts in _METHODS.items() if cuts is method)


def method_of(name: str) -> str:
    """Return how is cut what a cut chart calls so: a `CutMethod`, or a word of the chart's own."""
    return name.lower().partition("_")[0]


_METHODS = {
    Head.TORCH: CutMethod.PLASMA,
    Head.LASER: CutMethod.LASER,
    Head.FLAME: CutMethod.OXYFUEL,
    Head.WATER: CutMethod.WATERJET,
}


class ProgramKind(StrEnum):
    """What a program does, as ``--process`` says it of one."""

    DRILL = "drill"
    MILL = "mill"
    LASER = "laser"
    PLASMA = "plasma"


class CuttingWork(StrEnum):
    """What a rotating tool does to material: tool life and loads differ."""

    DRILL = "drill"
    MILL = "mill"


class ToolMaterial(StrEnum):
    """What the cutting edge of a tool is made of."""

    HSS = "hss"
    CARBIDE = "carbide"


#: The programs whose tool is a beam: on where it cuts, and without a height of its own.
BEAMS = (ProgramKind.LASER, ProgramKind.PLASMA)
