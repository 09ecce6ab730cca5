"""Enumerations that are easily confused: heads of machines, cutting methods, kinds of programs, and tool materials.

The processes of leafcut are a further one, which plug-ins extend: `processes.registry.names`.
"""

from __future__ import annotations

from enum import StrEnum


class CutMethod(StrEnum):
    """Method of cutting sheet. A process name in a cut chart starts with it: ``laser_fiber_3kW``."""

    PLASMA = "plasma"
    LASER = "laser"
    OXYFUEL = "oxyfuel"
    WATERJET = "waterjet"


class Head(StrEnum):
    """Kind of head of a machine; value of the key ``process`` in its profile."""

    SPINDLE = "spindle"
    TORCH = "torch"
    LASER = "laser"
    FLAME = "flame"
    WATER = "water"

    @property
    def method(self) -> CutMethod | None:
        """Cutting method for sheet; None for a spindle."""
        return _METHODS.get(self)

    @classmethod
    def that_cuts(cls, method: CutMethod) -> Head:
        """Return the head that a cutting method needs."""
        return next(head for head, cuts in _METHODS.items() if cuts is method)


def method_of(name: str) -> str:
    """Return the `CutMethod` in a process name of a cut chart, or a word of the chart itself."""
    return name.lower().partition("_")[0]


_METHODS = {
    Head.TORCH: CutMethod.PLASMA,
    Head.LASER: CutMethod.LASER,
    Head.FLAME: CutMethod.OXYFUEL,
    Head.WATER: CutMethod.WATERJET,
}


class ProgramKind(StrEnum):
    """Kind of a program, as given by ``--process``."""

    DRILL = "drill"
    MILL = "mill"
    LASER = "laser"
    PLASMA = "plasma"


class CuttingWork(StrEnum):
    """Operation of a rotating tool; tool life and loads differ."""

    DRILL = "drill"
    MILL = "mill"


class ToolMaterial(StrEnum):
    """Material of a tool's cutting edge."""

    HSS = "hss"
    CARBIDE = "carbide"


#: Kinds of programs with a beam, which is on while cutting and has no height of its own.
BEAMS = (ProgramKind.LASER, ProgramKind.PLASMA)
