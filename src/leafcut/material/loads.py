"""Cutting loads for each segment of a motion: chip thickness, width of cut, removed volume, and distance to
material.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats
from leafcut.material.cutting import Removed, cut_width, relative_chip_thickness, simulate_cutting
from leafcut.material.cutting_force import (
    feed_ratio_for_power,
    mean_chip_thickness,
    milling_power,
    ramp_power,
    spindle_torque,
)
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.straight_moves import StraightMoves, cutting_moves_for_cells, smallest_tool_diameter
from leafcut.model.cutter import Cutter
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.pace import PaceRules, SpindleLoad, ToolLimits
from leafcut.model.tool import MILLS, Tool, ToolKind
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.units import SECONDS_PER_MINUTE

#: Minimum slope of a cut that counts as a descent into material.
_LEVEL = 0.001
#: Tools whose feed depends on the chip thickness.
MILLING = (*MILLS, ToolKind.SLOT_MILL)


#: Height of unknown material above the highest position of the program, mm. This is an assumption.
_ABOVE = 1.0


@dataclass(frozen=True, eq=False)
class StockBefore:
    """The material before a program runs.

    `field` contains the heights of the material. `beside` is the height of the material around the field, mm. `known`
    is true if the user has described the stock.
    """

    field: HeightField
    beside: float
    known: bool


@dataclass(frozen=True, eq=False)
class Loads:
    """The loads on each straight segment of a program's motion.

    Attributes
    ----------
    moves, removed
        The segments, and the material that each segment removes.
    feed, rpm
        Feed, mm/s, which is 0 for rapids, and spindle speed, rpm.
    share
        Maximum chip thickness as a share of the feed per tooth.
    width, rate
        Width of cut, mm, and material removal rate, mm³/s.
    source
        Row of each segment in the toolpath of the program, int64[m].
    """

    moves: StraightMoves
    removed: Removed
    feed: Floats
    rpm: Floats
    share: Floats
    width: Floats
    rate: Floats
    source: NDArray[np.int64]

    @cached_property
    def chip(self) -> Floats:
        """Maximum chip thickness per revolution, mm, as if the tool had a single tooth. A ramp counts as a slot."""
        share = np.where(self.is_ramping, 1.0, self.share)
        with np.errstate(divide="ignore", invalid="ignore"):
            chip: Floats = np.where(self.rpm > 0, SECONDS_PER_MINUTE * share * self.feed / self.rpm, 0.0)
        return chip

    @cached_property
    def is_vertical(self) -> NDArray[np.bool_]:
        """Mask of the segments that move straight up or down."""
        return np.asarray(np.hypot(*(self.moves.ends[:, 3:5] - self.moves.ends[:, :2]).T) < 1e-9)

    @cached_property
    def is_milling(self) -> NDArray[np.bool_]:
        """Mask of the segments that cut without descending."""
        mills: NDArray[np.bool_] = self._is_cutting_feed & ~self.is_vertical & ~self._descends
        return mills

    @cached_property
    def is_ramping(self) -> NDArray[np.bool_]:
        """Mask of the segments that cut while descending at an angle, such as ramps and helices."""
        sinks: NDArray[np.bool_] = self._is_cutting_feed & ~self.is_vertical & self._descends
        return sinks

    @cached_property
    def is_plunging(self) -> NDArray[np.bool_]:
        """Mask of the segments that plunge straight down into material."""
        plunges: NDArray[np.bool_] = self._is_cutting_feed & self.is_vertical & self._descends
        return plunges

    @cached_property
    def descent_speed(self) -> Floats:
        """Downward speed of each segment, mm/s, or 0 if the segment does not descend."""
        ends = self.moves.ends
        drop = np.maximum(ends[:, 2] - ends[:, 5], 0.0)
        return np.divide(self.feed * drop, self.length, out=np.zeros_like(drop), where=self.length > 0)

    @cached_property
    def length(self) -> Floats:
        """Length of each segment, mm."""
        ends = self.moves.ends
        return np.asarray(np.sqrt(((ends[:, 3:] - ends[:, :3]) ** 2).sum(axis=1)))

    @cached_property
    def _is_cutting_feed(self) -> NDArray[np.bool_]:
        return np.asarray(~self.moves.rapid & self.removed.cuts)

    @cached_property
    def _descends(self) -> NDArray[np.bool_]:
        ends = self.moves.ends
        across = np.hypot(*(ends[:, 3:5] - ends[:, :2]).T)
        return np.asarray(ends[:, 5] - ends[:, 2] < -_LEVEL * across)

    def main_cuts_of_tool(self, number: int) -> NDArray[np.bool_]:
        """Return a mask of the segments in which a tool mills.

        If the tool never mills, return a mask of its ramps and helices. If the tool has no ramps or helices either,
        return a mask of its plunges.
        """
        of_tool = self.moves.tool == number
        kinds = (np.asarray(pieces & of_tool) for pieces in (self.is_milling, self.is_ramping, self.is_plunging))
        return next((pieces for pieces in kinds if pieces.any()), np.zeros(len(of_tool), dtype=np.bool_))

    def power(self, spindle: SpindleLoad, teeth: int, diameter: float) -> Floats:
        """Return the power of each segment at the tool, W, or 0 without a cut.

        In a plunge, the end of the tool removes all the material, and the chip thickness is the descent per tooth. On a
        ramp or a helix, the end removes at most its full area times the descent, and the side removes the remainder.
        The formulas are in `material.cutting_force`.
        """
        turns = self.rpm > 0
        mills, sinks, plunges = self.is_milling & turns, self.is_ramping & turns, self.is_plunging & turns
        teeth_by_time = np.where(turns, self.rpm * teeth / SECONDS_PER_MINUTE, 1.0)
        across = np.sqrt(np.maximum(self.feed**2 - self.descent_speed**2, 0.0))
        chip = mean_chip_thickness(np.where(sinks, across, self.feed) / teeth_by_time, self.width, diameter)
        end = np.where(sinks, np.minimum(self.rate, 0.25 * math.pi * diameter**2 * self.descent_speed), 0.0)
        power = np.zeros(len(self.feed))
        power[mills] = milling_power(spindle.material, self.rate[mills], chip[mills])
        power[sinks] = ramp_power(
            spindle.material,
            (self.rate - end)[sinks],
            end[sinks],
            chip[sinks],
            (self.descent_speed / teeth_by_time)[sinks],
        )
        # A segment may start in the air. While it cuts, its removal rate is the cut area seen from above times the
        # descent speed.
        sink_rate = self.descent_speed[plunges]
        power[plunges] = milling_power(
            spindle.material, self.removed.area[plunges] * sink_rate, sink_rate / teeth_by_time[plunges]
        )
        return power

    def max_feed_factor(self, limit: ToolLimits, diameter: float) -> Floats:
        """Return the factor by which the feed of each segment can increase before power or torque reaches its limit."""
        spindle = limit.spindle
        if spindle is None:
            return np.full(len(self.feed), math.inf)
        power = self.power(spindle, limit.teeth, diameter)
        with np.errstate(divide="ignore", invalid="ignore"):
            of_torque = spindle.torque / spindle_torque(power, self.rpm)
            ratio = np.minimum(spindle.power * spindle.efficiency / power, of_torque)
            return np.asarray(np.where(power > 0, feed_ratio_for_power(spindle.material, ratio), math.inf))


def infer_largest_safe_stock(
    moves: StraightMoves,
    cutters: Mapping[int, Cutter],
    cell: float,
    dogleg: bool,
    threads: int = 1,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> HeightField:
    """Return the largest possible stock around the cuts of a program that leaves its rapids free of material.

    This function assumes that the program is safe: the space above a rapid is either empty from the start, or an
    earlier cut has cleared it down to this depth. All other space may contain material. With `dogleg`, only the end
    point of a rapid in several axes counts.

    Raises
    ------
    PlanError
        There would be too many cells.
    """
    low, high = moves.swept_box(~moves.rapid, cutters)
    bottom = float(low[2]) - _ABOVE
    top = float(np.maximum(moves.ends[:, 2], moves.ends[:, 5]).max()) + _ABOVE
    field = HeightField.of_block(
        StockBlock((float(low[0]), float(low[1]), bottom), (float(high[0]), float(high[1]), top)), cell
    )
    assumed_ends = moves.ends.copy()
    if dogleg:
        dogleg_moves = moves.rapid & ((assumed_ends[:, 3:] != assumed_ends[:, :3]).sum(axis=1) > 1)
        assumed_ends[dogleg_moves, :3] = assumed_ends[dogleg_moves, 3:]
    remaining = field.copy()
    simulate_cutting(field, replace(moves, ends=assumed_ends), cutters, threads, check_cancelled, lowered=remaining)
    return remaining


def compute_loads(
    path: Toolpath,
    cutters: Mapping[int, Cutter],
    stock: StockBefore,
    clearance: float,
    threads: int = 1,
    check_cancelled: Heartbeat = ignore_heartbeat,
) -> Loads:
    """Compute the loads on each segment of a path. The given stock does not change.

    Raises PlanError if there are too many segments.
    """
    field = stock.field.copy()
    numbered = replace(path, line=np.arange(len(path), dtype=np.int32))
    moves = cutting_moves_for_cells(
        numbered, cutters, field.cell, max(0.5 * smallest_tool_diameter(cutters), 2.0 * field.cell)
    )
    margin = clearance + field.cell
    removed = simulate_cutting(
        field, moves, cutters, threads, check_cancelled, margin=margin, surrounding_height=stock.beside
    )
    source = moves.path.line[moves.row].astype(np.int64)
    radius = np.array([cutters[number].radius for number in moves.tool.tolist()])
    feed = np.where(moves.rapid, 0.0, moves.path.value[moves.row])
    rpm = np.abs(path.latest(Kind.SPINDLE, path.value))[source]
    length = np.sqrt(((moves.ends[:, 3:] - moves.ends[:, :3]) ** 2).sum(axis=1))
    rate = np.divide(removed.volume * feed, length, out=np.zeros_like(length), where=length > 0)
    share, width = relative_chip_thickness(removed, radius, field.cell), cut_width(removed, radius, field.cell)
    return Loads(moves, removed, feed, rpm, share, width, rate, source)


def tool_limits(loads: Loads, tools: Mapping[int, Tool], rules: PaceRules) -> dict[int, ToolLimits]:
    """Return the limits of each milling tool, either from the tool library or from the heaviest cut in the program.

    Tools without cuts or with an unknown spindle speed are left out. A spindle limit requires the number of teeth.
    """
    limits: dict[int, ToolLimits] = {}
    chip = loads.chip
    for number, tool in tools.items():
        cutting = loads.main_cuts_of_tool(number)
        if tool.kind not in MILLING or not cutting.any() or not (loads.rpm[cutting] > 0).all():
            continue
        rate = float(loads.rate[cutting].max())
        has_library_chip = has_known_chip_thickness(tool)
        limits[number] = ToolLimits(
            SECONDS_PER_MINUTE * tool.feed / tool.spindle_rpm if has_library_chip else float(chip[cutting].max()),
            rate,
            has_library_chip,
            tool.plunge_feed or math.inf,
            rules.spindle if rules.spindle is not None and rules.spindle.limited and tool.teeth else None,
            tool.teeth or 1,
        )
    return limits


def has_known_chip_thickness(tool: Tool) -> bool:
    """Return whether the tool library defines the chip thickness of a tool by its feed and speed."""
    return tool.feed > 0 and tool.spindle_rpm > 0 and not tool.assumed
