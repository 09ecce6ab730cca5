"""Generate the motion of the torch for an ordered sequence of cuts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.cleaning import LEAST_STEP, without_short_steps
from leafcut.geometry.polyline import Polyline, Segment
from leafcut.model.cutting import Cut, CutData
from leafcut.model.machine import Probe
from leafcut.model.obstacles import Obstacles
from leafcut.model.toolpath import UNKNOWN, Arc, Kind, Toolpath, ToolpathBuilder

#: Minimum length of a segment that is not a rounding error, mm.
SHORTEST = 1e-6
#: Minimum chord of an arc, mm. It is slightly more than two steps of an inch program with four decimals. Shorter arcs
#: are replaced by lines.
SHORTEST_ARC = 0.006
#: Spindle speed that switches a torch on. Most controllers require an S word with M3.
TORCH_ON = 1.0


@dataclass(frozen=True)
class TorchSetup:
    """Cutting data, and the capabilities of the torch or beam and of its controller.

    Attributes
    ----------
    clearance
        Height of travel between cuts, mm above the sheet (Z0).
    safe_z
        Height at the start and the end of the program, mm in machine coordinates; None if unknown.
    switches
        Whether the controller can switch the torch off and hold its height while the head moves. If not, the head
        stops.
    moves_z
        Whether programs move Z. If not, the head keeps its height during travel.
    power, mark_power
        S words for cutting and marking. A marking tool is spindle 1.
    tolerance
        Tolerance for rounding corners, mm (G64 P); 0 means exact corners.
    probe
        The probe for touching off; None if the top of the sheet is at Z0.
    mark_tool
        Number of the marking tool, where the torch is tool 0; None if marks need no tool change.
    """

    data: CutData
    clearance: float
    safe_z: float | None = None
    switches: bool = False
    moves_z: bool = True
    power: float = TORCH_ON
    mark_power: float = TORCH_ON
    tolerance: float = 0.0
    probe: Probe | None = None
    mark_tool: int | None = None


def generate_cuts(
    cuts: Sequence[Cut],
    torch: TorchSetup,
    *,
    end: Point | None = None,
    corners: Mapping[int, Sequence[Point]] = MappingProxyType({}),
    obstacles: Obstacles | None = None,
) -> tuple[Toolpath, list[slice]]:
    """Generate the motion of the whole program.

    Parameters
    ----------
    corners
        Corners of the travel move before each cut, keyed by the index of the cut. The key of the final move is the
        number of cuts.
    obstacles
        Obstacles that a head that keeps its height must go around. A head that retracts crosses them at the clearance
        height.

    Returns
    -------
    Toolpath
        The motion.
    list of slice
        The rows of each cut, including its rapid and its retract.

    Raises
    ------
    PlanError
        If the clearance height is not above the pierce height, or if there is no path around an obstacle.
    """
    data, clearance = torch.data, torch.clearance
    if clearance <= max(data.pierce_height, data.cut_height):
        raise PlanError(
            "the torch travels at a height of {:g} mm, which is not above its pierce height of {:g} mm; give a "
            "larger --clearance-height",
            clearance,
            data.pierce_height,
        )
    avoided = None if torch.moves_z else obstacles
    builder = ToolpathBuilder()
    if torch.tolerance > 0.0:
        builder.blending(640, torch.tolerance)
    safe_z = torch.safe_z if torch.moves_z else None
    if safe_z is not None:
        builder.machine(z=safe_z)
    elif torch.moves_z:
        builder.rapid(z=clearance)
    rows, tool = [], 0
    for number, cut in enumerate(cuts):
        first = len(builder)
        if torch.mark_tool is not None:
            tool = _change_tool(builder, tool, torch.mark_tool if cut.kind == "mark" else 0)
        for place in (*corners.get(number, ()), cut.path.start):
            _travel_to(builder, avoided, place)
        if number == 0 and safe_z is not None:
            builder.rapid(z=clearance)
        _generate_cut(builder, cut, torch)
        rows.append(slice(first, len(builder)))
    _change_tool(builder, tool, 0)
    if end is not None:
        for place in (*corners.get(len(cuts), ()), end):
            _travel_to(builder, avoided, place)
    if safe_z is not None:
        builder.machine(z=safe_z)
    builder.spindle(0.0)
    if torch.probe is not None and any(_is_pierced(cut) for cut in cuts):
        builder.set_place(Kind.SHIFT, (UNKNOWN, UNKNOWN, UNKNOWN), 0)
    builder.end()
    return builder.build(), rows


def _travel_to(builder: ToolpathBuilder, obstacles: Obstacles | None, to: Point) -> None:
    here = (builder.position[0], builder.position[1])
    if obstacles is not None and obstacles.min_rapid_height(here, to, None) != -math.inf:
        turns = obstacles.route_around(here, to, None)
        if turns is None:
            x, y = to
            raise PlanError("no path to ({:.4g}, {:.4g}) leads around the --keep-out zones; move the clamp", x, y)
        for turn in turns:
            builder.rapid(*turn)
    builder.rapid(*to)


def _change_tool(builder: ToolpathBuilder, tool: int, wanted: int) -> int:
    """Add a tool change unless `tool` is already the wanted tool. Return the wanted tool."""
    if tool != wanted:
        builder.tool(wanted)
        builder.offset(0)
    return wanted


def _is_pierced(cut: Cut) -> bool:
    return cut.pierce and cut.kind == "cut"


def _generate_cut(builder: ToolpathBuilder, cut: Cut, torch: TorchSetup) -> None:
    pierces = _is_pierced(cut)
    if pierces and torch.probe is not None:
        builder.probe(-torch.probe.depth, feed=torch.probe.feed)
        builder.set_place(Kind.SHIFT, (*cut.path.start, -torch.probe.switch_offset), 0)
    hold = torch.switches and cut.small_hole
    _light_torch(builder, cut, torch, pierces=pierces, waits=pierces)
    if hold:
        builder.height_control(False)
    if cut.compensation != 40:
        builder.radius(cut.compensation, torch.data.kerf)
    _follow_cut(builder, cut, torch)
    if cut.compensation != 40:
        builder.spindle(0.0)
        builder.radius(40)
    if hold:
        builder.height_control(True)
    if cut.compensation == 40:
        builder.spindle(0.0)
    if torch.moves_z:
        builder.rapid(z=torch.clearance)


def _light_torch(builder: ToolpathBuilder, cut: Cut, torch: TorchSetup, *, pierces: bool, waits: bool) -> None:
    """Switch the torch on, wait, and move down to the cut height.

    If the cut starts with a pierce, the torch is switched on at the pierce height.
    """
    data = torch.data
    height = data.pierce_height if pierces else data.cut_height
    if torch.moves_z and builder.position[2] != height:
        builder.rapid(z=height)
    marks = cut.kind != "cut"
    builder.spindle(torch.mark_power if marks else torch.power, number=int(marks))
    if waits and data.pierce_delay > 0.0:
        builder.dwell(data.pierce_delay)
    if torch.moves_z and height != data.cut_height:
        builder.feed(z=data.cut_height, feed=cut.speeds[0][1])


def _follow_cut(builder: ToolpathBuilder, cut: Cut, torch: TorchSetup) -> None:
    """Follow the path of a cut, one section at a time.

    A new section starts where the speed or the state of the torch changes.
    """
    length = cut.path.length
    changes = {0.0, length, *(at for at, _ in cut.speeds), *(at for span in cut.joints for at in span)}
    if cut.torch_off_at < length:
        changes.add(cut.torch_off_at)
    places = [0.0]
    for at in sorted(at for at in changes if 0.0 < at <= length - LEAST_STEP):
        places += [at] if at - places[-1] >= LEAST_STEP else []
    places.append(length)
    burning = True
    for low, high in itertools.pairwise(places):
        middle = 0.5 * (low + high)
        on = middle < cut.torch_off_at and not any(a < middle < b for a, b in cut.joints)
        if on != burning and torch.switches:
            builder.torch(on)
        elif on != burning and on:
            _light_torch(builder, cut, torch, pierces=False, waits=True)
        elif on != burning:
            builder.spindle(0.0)
        burning = on
        feed = next(f for at, f in reversed(cut.speeds) if at <= middle)
        follow_path(builder, cut.path.piece(low, high), feed)
    if torch.switches and not burning:
        builder.torch(True)


def follow_path(builder: ToolpathBuilder, path: Polyline, feed: float) -> None:
    """Cut along an open path from its start at a constant speed, mm/s."""
    for s in _writable_segments(without_short_steps(path)):
        if s.is_arc:
            z = builder.position[2]
            builder.arc(s.bulge < 0.0, (*s.end, z), Arc((*s.center, z)), feed=feed)
        elif abs(s.end[0] - s.start[0]) > SHORTEST or abs(s.end[1] - s.start[1]) > SHORTEST:
            builder.feed(*s.end, feed=feed)


def _writable_segments(path: Polyline) -> Iterator[Segment]:
    """Yield the segments of a path, without arcs whose ends could be rounded to the same point in the program.

    A short arc is replaced by its chord, which deviates from the arc by less than half its length. A nearly full circle
    is split into two arcs.
    """
    for s in path.segments():
        if not s.is_arc or math.dist(s.start, s.end) >= SHORTEST_ARC:
            yield s
            continue
        arc = Polyline(np.array([[*s.start, s.bulge], [*s.end, 0.0]]))
        if arc.length < math.pi * SHORTEST_ARC:
            yield s._replace(bulge=0.0)
        else:
            yield from arc.piece(0.0, 0.5 * arc.length).segments()
            yield from arc.piece(0.5 * arc.length, arc.length).segments()
