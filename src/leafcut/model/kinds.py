"""Enumerations: heads of machines, cutting methods, kinds of programs, work of rotating tools, and tool materials.

The names of processes are not an enumeration, because plug-ins can add more names (`processes.registry.process_names`).
"""

from __future__ import annotations

from enum import StrEnum


class CutMethod(StrEnum):
    """A method for cutting sheet. Process names in cut charts start with the method: ``laser_fiber_3kW``."""

    PLASMA = "plasma"
    LASER = "laser"
    OXYFUEL = "oxyfuel"
    WATERJET = "waterjet"


class Head(StrEnum):
    """The kind of head of a machine. Its profile stores this value under the key ``process``."""

    SPINDLE = "spindle"
    TORCH = "torch"
    LASER = "laser"
    FLAME = "flame"
    WATER = "water"

    @property
    def method(self) -> CutMethod | None:
        """The cutting method of the head, or None for a spindle."""
        return _METHODS.get(self)

    @classmethod
    def for_method(cls, method: CutMethod) -> Head:
        """Return the head that a cutting method needs."""
        return next(head for head, cuts in _METHODS.items() if cuts is method)


def first_word_of_process(name: str) -> str:
    """Return the first word of a process name from a cut chart. This is usually a value of `CutMethod`."""
    return name.lower().partition("_")[0]


_METHODS = {
    Head.TORCH: CutMethod.PLASMA,
    Head.LASER: CutMethod.LASER,
    Head.FLAME: CutMethod.OXYFUEL,
    Head.WATER: CutMethod.WATERJET,
}


class ProgramKind(StrEnum):
    """The kind of a program, as selected with ``--process``."""

    DRILL = "drill"
    MILL = "mill"
    LASER = "laser"
    PLASMA = "plasma"


class CuttingWork(StrEnum):
    """The operation of a rotating tool. The life of the tool and the loads on it depend on the operation."""

    DRILL = "drill"
    MILL = "mill"


class ToolMaterial(StrEnum):
    """The material of a tool's cutting edge."""

    HSS = "hss"
    CARBIDE = "carbide"


#: Kinds of programs with a beam. The beam is on while cutting, and has no depth.
BEAMS = (ProgramKind.LASER, ProgramKind.PLASMA)
