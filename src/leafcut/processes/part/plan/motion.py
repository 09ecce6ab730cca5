"""Motion of a part program: spiral along each path, then cut the rest between the tabs, level by level."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.zones import touches_any_zone, widen_zones
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.processes.milling.entries import ABOVE, enter_level, follow
from leafcut.processes.milling.mill import MillingData
from leafcut.processes.part.plan.holes import HoleGroup
from leafcut.processes.part.plan.outlines import OutlineCut
from leafcut.processes.spindle_moves import end_program, leave_tool, take_tool


@dataclass(frozen=True, eq=False)
class PartHeights:
    """Heights of a program, mm: rapids, tops of the tabs (`bottom` without tabs), lowest cut, and largest step-down.

    `zones`, float64[k, 4], are crossed at the clearance height. `end` is the last position.
    """

    clearance: float
    retract: float
    tab_top: float
    bottom: float
    step: float
    zones: NDArray[np.float64]
    end: Point | None = None


def part_motion(
    drilled: Sequence[HoleGroup],
    cuts: Sequence[tuple[OutlineCut, float]],
    heights: PartHeights,
    data: MillingData,
    machine: Machine,
    *,
    climb: bool,
    coolant: bool,
    pause: bool,
) -> Toolpath:
    """Return the motion of the whole program: the holes of each drill in order, then the cuts.

    A cut has its start point as a distance along its path, mm.
    """
    builder = ToolpathBuilder()
    if machine.safe_z is not None:
        builder.machine(z=machine.safe_z)
    for group in drilled:
        take_tool(builder, machine, group.tool, heights.clearance, coolant=coolant, pause=pause)
        _drill(builder, group, heights, machine)
        leave_tool(builder, machine, heights.clearance, coolant=coolant)
    take_tool(builder, machine, data.tool, heights.clearance, coolant=coolant, pause=pause)
    places = np.array([cut.path.point_at(start) for cut, start in cuts], dtype=np.float64)
    high = _crosses_zone(places, heights, data.tool, machine)
    for number, ((cut, start), place) in enumerate(zip(cuts, places.tolist(), strict=True)):
        if number:
            builder.rapid(z=heights.clearance if high[number] else heights.retract)
        builder.rapid(*place)
        if builder.position[2] != heights.retract:
            builder.rapid(z=heights.retract)
        _cut_outline(builder, cut, start, heights, data, climb)
    builder.rapid(z=heights.clearance)
    end_program(builder, machine, heights.clearance, heights.end, coolant=coolant)
    return builder.build()


def _crosses_zone(places: NDArray[np.float64], heights: PartHeights, tool: Tool, machine: Machine) -> list[bool]:
    """Return for each position whether the rapid to it crosses a keep-out zone; no rapid leads to the first."""
    zones = widen_zones(heights.zones, 0.5 * tool.diameter)
    crossed = touches_any_zone(places[:-1], places[1:], zones, dogleg=machine.rapid_style == "dogleg")
    return [False, *crossed.tolist()]


def _drill(builder: ToolpathBuilder, group: HoleGroup, heights: PartHeights, machine: Machine) -> None:
    high = _crosses_zone(group.places, heights, group.tool, machine)
    for number, (x, y) in enumerate(group.places.tolist()):
        if not number:
            builder.rapid(x, y)
            if builder.position[2] != heights.clearance:
                builder.rapid(z=heights.clearance)
        elif high[number]:
            builder.rapid(z=heights.clearance)
            builder.rapid(x, y)
        builder.drill(x, y, group.cycle, feed=group.tool.feed)
    builder.rapid(z=heights.clearance)


def _cut_outline(
    builder: ToolpathBuilder, cut: OutlineCut, start: float, heights: PartHeights, data: MillingData, climb: bool
) -> None:
    """Spiral down along the whole path to the tops of the tabs, cut a level turn there, then cut between the tabs."""
    length, feed = cut.path.length, data.tool.feed
    loop = cut.path.piece(start, start + length)
    level = heights.tab_top if cut.tabs else heights.bottom
    builder.feed(z=ABOVE, feed=feed)
    drop = ABOVE - level
    # From the second turn on, the tool cuts as deep as it has descended in a turn.
    turns = math.ceil(drop / min(heights.step, length * math.tan(data.entry_angle)) - 1e-9)
    slope = math.atan2(drop / turns, length)
    for turn in range(turns):
        high, low = (ABOVE - drop * (turn + k) / turns for k in (0, 1))
        follow(builder, loop, min(feed, data.plunge_feed / math.sin(slope)), (high, low))
    follow(builder, loop, feed)
    if cut.tabs:
        _cut_between_tabs(builder, cut, start, heights, data, climb)


def _cut_between_tabs(
    builder: ToolpathBuilder, cut: OutlineCut, start: float, heights: PartHeights, data: MillingData, climb: bool
) -> None:
    feed, nowhere = data.tool.feed, shapely.Polygon()
    count = max(math.ceil((heights.tab_top - heights.bottom) / heights.step - 1e-9), 1)
    top = heights.tab_top
    for level in (heights.tab_top - (heights.tab_top - heights.bottom) * k / count for k in range(1, count + 1)):
        for piece, is_tab in _pieces_from(cut, start):
            if is_tab:
                builder.feed(z=heights.tab_top, feed=feed)
                follow(builder, piece, feed)
            else:
                descent = enter_level(builder, piece, top, level, data, nowhere, climb)
                if descent.kind == "plunge":
                    raise PlanError(
                        "no room for a ramp of {:.3g} degrees between two tabs; give a larger --entry-angle, a smaller "
                        "--step-down, or fewer --tabs",
                        math.degrees(data.entry_angle),
                    )
                follow(builder, piece, feed)
        top = level


def _pieces_from(cut: OutlineCut, start: float) -> list[tuple[Polyline, bool]]:
    """Return the pieces of the path from a start point on, each with whether it lies over a tab."""
    length, pieces, position = cut.path.length, [], start
    ahead = sorted(
        (low + (length if low < start else 0.0), high + (length if low < start else 0.0)) for low, high in cut.tabs
    )
    for low, high in ahead:
        pieces += [(cut.path.piece(position, low), False), (cut.path.piece(low, high), True)]
        position = high
    return [*pieces, (cut.path.piece(position, start + length), False)]
