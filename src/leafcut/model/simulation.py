"""`Simulation`: motion of a program on a machine, with its times."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.toolpath import Toolpath


@dataclass(frozen=True)
class Simulation:
    """Motion of a program on a machine, and the times and lengths of `run`, starting at X0 Y0.

    `defaults` are the used options that were set by the user's own defaults, as typed.
    """

    program: str
    machine: Machine
    dialect: str
    path: Toolpath
    run: Toolpath
    measure: Measure
    issues: tuple[Issue, ...] = ()
    defaults: tuple[str, ...] = ()
