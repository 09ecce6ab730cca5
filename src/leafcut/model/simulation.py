"""`Simulation`: the motion of a program on a machine, and the time that it takes."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.toolpath import Toolpath


@dataclass(frozen=True)
class Simulation:
    """The motion of a program on a machine.

    Attributes
    ----------
    path
        The motion as programmed.
    run
        The programmed motion, and the moves that the controller adds.
    measure
        Measure of `run` with a start at X0 Y0.
    defaults
        Options that came from the user's own defaults, as typed.
    """

    program: str
    machine: Machine
    dialect: str
    path: Toolpath
    run: Toolpath
    measure: Measure
    issues: tuple[Issue, ...] = ()
    defaults: tuple[str, ...] = ()
