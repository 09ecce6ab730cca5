"""`Simulation`: what a program does on a machine, and what that costs."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.toolpath import Toolpath


@dataclass(frozen=True)
class Simulation:
    """What a program does on a machine, and what that costs.

    Attributes
    ----------
    program
        Its name, as it was given.
    machine, dialect
        On which it runs, and in which it was read.
    path
        What the program says, and `run` that with what its controller adds at every cut.
    measure
        What `run` costs, from X0 Y0 on.
    issues
        What is dangerous in it, what was assumed, and what of the controller's own doing is not known.
    defaults
        Which of the options that were used are of the person's own defaults, as one types them.
    """

    program: str
    machine: Machine
    dialect: str
    path: Toolpath
    run: Toolpath
    measure: Measure
    issues: tuple[Issue, ...] = ()
    defaults: tuple[str, ...] = ()
