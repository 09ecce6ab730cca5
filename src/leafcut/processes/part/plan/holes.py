"""Holes of a part that are drilled with a drill from the tool library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import count_of
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.tool import LONGEST_STROKE, Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import DrillCycle
from leafcut.processes.spindle_moves import check_speeds


@dataclass(frozen=True, eq=False)
class HoleGroup:
    """The holes that one drill makes, and the drilling cycle. `places` contains the hole centres, float64[n, 2], mm."""

    tool: Tool
    cycle: DrillCycle
    places: NDArray[np.float64]


class PlannedHole(NamedTuple):
    """A through hole, with its centre, mm, its drill, and its layer in the drawing."""

    x: float
    y: float
    drill: Tool
    layer: str

    @property
    def name(self) -> Message:
        """Name for messages."""
        return Message("the hole at ({:g}, {:g})", self.x, self.y)

    @property
    def outline(self) -> Polyline:
        """The drilled circle."""
        return Polyline.circle(self.x, self.y, 0.5 * self.drill.diameter)


def fitting_drill(library: ToolLibrary | None, diameter: float, tolerance: float, depth: float) -> Tool | None:
    """Select the drill whose diameter is closest to the diameter of a hole, mm.

    Return None if no drill is within the tolerance and long enough for the depth of the hole, mm.
    """
    drills = [] if library is None else library.tools
    fitting = [
        tool
        for tool in drills
        if tool.kind is ToolKind.DRILL
        and abs(tool.diameter - diameter) <= tolerance + 1e-9
        and depth + tool.point_length <= tool.reach + 1e-9
    ]
    return min(fitting, key=lambda tool: abs(tool.diameter - diameter), default=None)


def hole_groups(
    holes: Sequence[PlannedHole], bottom: float, r_plane: float, to_initial: bool, machine: Machine
) -> tuple[list[HoleGroup], list[Issue]]:
    """Group the holes by drill. Every hole has its full diameter down to `bottom`, mm.

    Returns
    -------
    groups
        The holes of each drill.
    issues
        Warnings about deep holes that are drilled in a single stroke.

    Raises
    ------
    PlanError
        A drill has no feed or speed, or the machine cannot run at its feed or speed.
    """
    places: dict[Tool, list[tuple[float, float]]] = {}
    for hole in holes:
        places.setdefault(hole.drill, []).append((hole.x, hole.y))
    groups, issues = [], []
    for tool, centres in places.items():
        check_speeds(tool, machine)
        tip, peck = round(bottom - tool.point_length, 6), tool.peck or 0.0
        cycle = DrillCycle("G83" if peck else "G81", r_plane, tip, to_initial=to_initial, peck=peck)
        groups.append(HoleGroup(tool, cycle, np.array(centres, dtype=np.float64)))
        if min(peck or math.inf, -bottom) > LONGEST_STROKE * tool.diameter:
            number = count_of(len(centres), "hole")
            words = Message(
                "{} drills {} deeper than {:g} diameters in one stroke; set 'peck' for the tool in the library",
                tool.label,
                number,
                LONGEST_STROKE,
            )
            issues.append(Issue("L446", words))
    return groups, issues
