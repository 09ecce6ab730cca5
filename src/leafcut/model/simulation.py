"""`Simulation`: the motion of a program on a machine, and its time."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.toolpath import Toolpath


@dataclass(frozen=True)
class Simulation:
    """The motion of a program on a machine.

    `path` is the motion as programmed. `run` adds the moves of the controller, and `measure` is the measure of `run`
    with a start at X0 Y0. `defaults` are the options, as typed, whose values come from the user's own defaults.
    """

    program: str
    machine: Machine
    dialect: str
    path: Toolpath
    run: Toolpath
    measure: Measure
    issues: tuple[Issue, ...] = ()
    defaults: tuple[str, ...] = ()
