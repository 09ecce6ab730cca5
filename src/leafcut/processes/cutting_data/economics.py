"""Compute the time, the cost and the tool life for a pair of speed and feed.

Sources: W. W. Gilbert, Economics of Machining, in Machining Theory and Practice (ASM, 1950); in the form of M. P.
Groover, Fundamentals of Modern Manufacturing, section 23.3: Tc = Th + Tm + Tt/np (eq. 23.3) and Cc = Co Th + Co Tm + Co
Tt/np + Ct/np (eq. 23.11), with np = T/Tm parts per tool. Th is the time of the moves between holes. A tool may wear out
while it machines a part, so np need not be an integer, unlike in Groover's eq. 23.6 and
23.12.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.material.cutting_force import (
    drilling_power,
    drilling_thrust,
    drilling_torque,
    mean_chip_thickness,
    milling_power,
    spindle_torque,
)
from leafcut.model.cutting_front import CuttingPoint
from leafcut.model.kinds import CuttingWork
from leafcut.model.tool import Tool
from leafcut.model.work_material import ToolLife, WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

#: Speed reduction of a drill in deep holes: depth in diameters, and the share of the speed at this depth. Source:
#: Kosilova and Meshcheryakov, Handbook of the Manufacturing Engineer, vol. 2 (1986), table 31, from memory.
_DEEP = ((3.0, 4.0, 5.0, 6.0, 8.0), (1.0, 0.85, 0.75, 0.7, 0.6))


@dataclass(frozen=True)
class ToolWork:
    """The work that one tool does for one part.

    Attributes
    ----------
    lives
        Tool life equations, sorted by their lower feed limits.
    fed, cut
        Distance at feed, and how much of this distance is in the material, mm.
    idle
        Time for the other moves, s.
    hole_depth
        Depth of the holes that a drill makes, mm.
    width, depth, teeth
        Width and depth of cut of a mill, mm, and the number of its teeth. A drill counts as one tooth.
    """

    tool: Tool
    work: CuttingWork
    lives: tuple[ToolLife, ...]
    fed: float
    cut: float
    idle: float = 0.0
    hole_depth: float = 0.0
    width: float = 1.0
    depth: float = 1.0
    teeth: int = 1
    holes: int = 0


class Prices(NamedTuple):
    """Prices and times that determine the cost of a part.

    Attributes
    ----------
    rate
        Cost of the machine and its operator per second.
    tool, change
        Cost of a worn tool, and time to replace it, s.
    longest
        Longest assumed tool life, s.
    """

    rate: float
    tool: float
    change: float
    longest: float


class CuttingResults(NamedTuple):
    """Results for many pairs of speed and feed. There is an array for each quantity of `CuttingPoint`."""

    rpm: Floats
    feed: Floats
    chip: Floats
    speed: Floats
    time: Floats
    cost: Floats
    life: Floats
    worn: Floats
    power: Floats
    torque: Floats
    thrust: Floats

    def select(self, selection: Mask | Indices) -> CuttingResults:
        """Return the selected results."""
        return CuttingResults(*(column[selection] for column in self))

    def points(self) -> tuple[CuttingPoint, ...]:
        """Convert the results to one object per pair of speed and feed."""
        return tuple(CuttingPoint(*row) for row in zip(*(column.tolist() for column in self), strict=True))


def deep_hole_factor(depth: float, diameter: float) -> float:
    """Return the factor by which the speed of a drill is reduced in a deep hole.

    It is 1 up to a depth of three diameters, and falls to 0.6 at eight diameters.
    """
    return float(np.interp(depth / diameter, *_DEEP))


def tool_life(work: ToolWork, speed: Floats, chip: Floats) -> Floats:
    """Return the tool life, s, for each pair of speed, mm/s, and chip thickness, mm.

    Each tool life equation covers a range of feeds. The first equation also covers thinner chips.
    """
    depth_factor = deep_hole_factor(work.hole_depth, work.tool.diameter) if work.work is CuttingWork.DRILL else 1.0
    seconds = np.empty_like(speed)
    least = np.array([life.least_feed for life in work.lives])
    law_index = np.maximum(np.searchsorted(least, chip * (1.0 + 1e-9), side="right") - 1, 0)
    for number, life in enumerate(work.lives):
        in_law = law_index == number
        seconds[in_law] = life.seconds(
            speed[in_law] / depth_factor, chip[in_law], work.tool.diameter, work.width, work.depth, work.teeth
        )
    return seconds


def cutting_results(
    work: ToolWork, material: WorkMaterial, prices: Prices, rpm: Floats, feed: Floats, efficiency: float
) -> CuttingResults:
    """Compute the results for pairs of speed, 1/min, and feed, mm/s, for one part."""
    diameter = work.tool.diameter
    speed = math.pi * diameter * rpm / SECONDS_PER_MINUTE
    chip = SECONDS_PER_MINUTE * feed / (rpm * work.teeth)
    life = np.minimum(tool_life(work, speed, chip), prices.longest)
    worn = work.cut / feed / life
    time = work.idle + work.fed / feed + worn * prices.change
    if work.work is CuttingWork.DRILL:
        torque = drilling_torque(material, diameter, chip, work.tool.point_angle)
        power = drilling_power(torque, rpm, efficiency)
        thrust = drilling_thrust(material, diameter, chip, work.tool.point_angle)
    else:
        cutting = milling_power(
            material, work.width * work.depth * feed, mean_chip_thickness(chip, work.width, diameter)
        )
        power, torque, thrust = cutting / efficiency, spindle_torque(cutting, rpm), np.zeros_like(rpm)
    cost = prices.rate * time + worn * prices.tool
    return CuttingResults(rpm, feed, chip, speed, time, cost, life, worn, power, torque, thrust)


def index_of_best(results: CuttingResults, objective: str) -> int:
    """Return the index of the best result for an objective.

    If several results are equal, the other objectives decide (time, then cost, then life), and then the lower spindle
    speed.
    """
    keys = {
        "time": (results.time, results.cost, -results.life),
        "cost": (results.cost, results.time, -results.life),
        "life": (-results.life, results.cost, results.time),
    }[objective]
    return int(np.lexsort((results.rpm, *reversed(keys)))[0])
