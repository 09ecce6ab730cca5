"""The motion of the torch for ordered cuts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline, Segment
from leafcut.model.cutting import Cut, CutData
from leafcut.model.machine import Machine, Probe
from leafcut.model.obstacles import Obstacles
from leafcut.model.toolpath import UNKNOWN, Arc, Kind, Toolpath, ToolpathBuilder

#: Shorter segments are rounding, mm.
SHORTEST = 1e-6
#: An arc whose ends are closer is a line, mm: two steps of a program in inches, with four decimals, and a bit.
SHORTEST_ARC = 0.006
#: Places nearer to each other can be one in a program, mm: the diagonal of a step in inches, with four decimals.
LEAST_STEP = 0.0037
#: M3 needs a speed on most controllers; a torch has none.
TORCH_ON = 1.0


def lay_cuts(
    cuts: Sequence[Cut],
    data: CutData,
    machine: Machine,
    *,
    clearance: float,
    end: Point | None = None,
    switches: bool = False,
    power: float = TORCH_ON,
    mark_power: float = TORCH_ON,
    tolerance: float = 0.0,
    probe: Probe | None = None,
    moves_z: bool = True,
    mark_tool: int | None = None,
    corners: Mapping[int, Sequence[Point]] = MappingProxyType({}),
    obstacles: Obstacles | None = None,
) -> tuple[Toolpath, list[slice]]:
    """Return the motions of the whole program, and the rows of each cut, from the rapid to it to its rise.

    Between cuts the torch rises to `clearance` (mm over the sheet, which is Z0). A cut begins at the pierce height: on,
    pierce delay, down to the cut height. `switches`: the controller can put the torch off, and hold its height, while
    it moves; else it stops for what must be cut off in between. `power` and `mark_power` are those of a beam; what
    marks is spindle 1. `tolerance`: how far corners may be cut short (G64 P), mm; 0: they are not. `probe`: how the
    torch finds the sheet before every pierce; None: Z0 is the sheet's top as it is. `moves_z`: that of the dialect;
    a table whose beam keeps its height travels as high as it cuts. `mark_tool`: the tool that marks,
    chosen where the torch, tool 0, is not what is wanted, before the way there; None: marks need no other tool.
    `corners`: places on the way to a cut, by its number; to the end, by the number of cuts.
    `obstacles`: a head that keeps its height goes round them; others cross them at the clearance.

    Raises
    ------
    PlanError
        The torch would travel lower than it pierces, or there is no way round an obstacle.
    """
    if clearance <= max(data.pierce_height, data.cut_height):
        raise PlanError(
            f"the torch travels at {clearance:g} mm, not above its pierce height of {data.pierce_height:g} mm; give a "
            "larger --clearance-height"
        )
    if not any(_pierces(cut) for cut in cuts):
        probe = None  # nothing is found that would have to be forgotten
    builder = ToolpathBuilder()
    if tolerance > 0.0:
        builder.blending(640, tolerance)
    safe_z = machine.safe_z if moves_z else None
    if safe_z is not None:
        builder.machine(z=safe_z)
    elif moves_z:
        builder.rapid(z=clearance)
    rows = []
    tool = 0
    for number, cut in enumerate(cuts):
        first = len(builder)
        if mark_tool is not None:
            tool = _choose(builder, tool, mark_tool if cut.kind == "mark" else 0)
        around = obstacles if not moves_z else None
        for place in corners.get(number, ()):
            _go(builder, around, place)
        torch = _Torch(data, switches, moves_z, probe, *((power, 0) if cut.kind == "cut" else (mark_power, 1)))
        _go_round(builder, around, cut.path.start)
        _lay(builder, cut, torch, clearance, descend=number == 0 and safe_z is not None)
        rows.append(slice(first, len(builder)))
    _choose(builder, tool, 0)
    if end is not None:
        for place in (*corners.get(len(cuts), ()), end):
            _go(builder, obstacles if not moves_z else None, place)
    if safe_z is not None:
        builder.machine(z=safe_z)
    builder.spindle(0.0)
    if probe is not None:
        builder.set_place(Kind.SHIFT, (UNKNOWN, UNKNOWN, UNKNOWN), 0)
    builder.end()
    return builder.build(), rows


def _go(builder: ToolpathBuilder, obstacles: Obstacles | None, to: Point) -> None:
    """Move at rapid to a place, around all obstacles."""
    _go_round(builder, obstacles, to)
    builder.rapid(*to)


def _go_round(builder: ToolpathBuilder, obstacles: Obstacles | None, to: Point) -> None:
    """Move at rapid to a point from which the path to a place is clear."""
    here = (builder.position[0], builder.position[1])
    if obstacles is None or obstacles.between(here, to, None) == -math.inf:
        return
    turns = obstacles.round(here, to, None)
    if turns is None:
        raise PlanError(f"there is no path to {to[0]:.4g}, {to[1]:.4g} around the --keep-out zones; move the clamp")
    for x, y in turns:
        builder.rapid(x, y)


def _choose(builder: ToolpathBuilder, tool: int, wanted: int) -> int:
    """Change to the wanted tool with its offset; return its number."""
    if tool != wanted:
        builder.tool(wanted)
        builder.offset(0)
    return wanted


@dataclass(frozen=True)
class _Torch:
    """What lights one cut: the chart's data, whether it goes dark as it moves, and up and down; power; which it is."""

    data: CutData
    switches: bool
    moves_z: bool
    probe: Probe | None
    power: float
    spindle: int


def _pierces(cut: Cut) -> bool:
    """Return whether a cut starts with a pierce."""
    return cut.pierce and cut.kind == "cut"


def _lay(builder: ToolpathBuilder, cut: Cut, torch: _Torch, clearance: float, *, descend: bool) -> None:
    x, y = cut.path.start
    builder.rapid(x, y)
    if descend:
        builder.rapid(z=clearance)
    pierces = _pierces(cut)
    if pierces and torch.probe is not None:
        builder.probe(-torch.probe.depth, feed=torch.probe.feed)
        builder.set_place(Kind.SHIFT, (x, y, -torch.probe.switch_offset), 0)
    hold = torch.switches and cut.small_hole
    _light(builder, torch, torch.data.pierce_delay if pierces else 0.0, cut.speeds[0][1], pierces)
    if hold:
        builder.height_control(False)
    if cut.compensation != 40:
        builder.radius(cut.compensation, torch.data.kerf)
    _follow(builder, cut, torch)
    if cut.compensation != 40:
        builder.spindle(0.0)
        builder.radius(40)
    if hold:
        builder.height_control(True)
    if cut.compensation == 40:
        builder.spindle(0.0)
    if torch.moves_z:
        builder.rapid(z=clearance)


def _light(builder: ToolpathBuilder, torch: _Torch, delay: float, feed: float, pierces: bool) -> None:
    """Switch the torch on at the pierce height, wait, and move down to the cut height."""
    data = torch.data
    height = data.pierce_height if pierces else data.cut_height
    if torch.moves_z and builder.position[2] != height:
        builder.rapid(z=height)
    builder.spindle(torch.power, number=torch.spindle)
    if delay > 0.0:
        builder.dwell(delay)
    if torch.moves_z and height != data.cut_height:
        builder.feed(z=data.cut_height, feed=feed)


def _follow(builder: ToolpathBuilder, cut: Cut, torch: _Torch) -> None:
    """Follow the path, stretch by stretch between the places where the speed or the torch changes."""
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
            _light(builder, torch, torch.data.pierce_delay, cut.speeds[0][1], pierces=False)
        elif on != burning:
            builder.spindle(0.0)
        burning = on
        feed = next(f for at, f in reversed(cut.speeds) if at <= middle)
        follow(builder, cut.path.piece(low, high), feed)
    if torch.switches and not burning:
        builder.torch(True)


def follow(builder: ToolpathBuilder, path: Polyline, feed: float) -> None:
    """Cut along an open path from its start, at one speed."""
    for s in _writable(without_short_steps(path)):
        if s.is_arc:
            _arc(builder, s, feed)
        elif abs(s.end[0] - s.start[0]) > SHORTEST or abs(s.end[1] - s.start[1]) > SHORTEST:
            builder.feed(*s.end, feed=feed)


def without_short_steps(path: Polyline) -> Polyline:
    """Return an open path without segments that a program's decimals could take for one place.

    It begins and ends where it did; what follows a segment that is left out begins where that one began.
    """
    lengths, rows = path.lengths, path.vertices
    if lengths.min(initial=math.inf) >= LEAST_STEP:
        return path
    kept: list[tuple[float, float, float]] = []
    x, y, left_out = float(rows[0, 0]), float(rows[0, 1]), 0.0
    for length, row, after in zip(lengths.tolist(), rows.tolist(), rows[1:].tolist(), strict=False):
        left_out += length
        if left_out < LEAST_STEP:
            continue
        kept.append((x, y, row[2] if length >= LEAST_STEP else 0.0))
        x, y, left_out = after[0], after[1], 0.0
    return Polyline(np.array([*(kept or [(x, y, 0.0)]), (*path.end, 0.0)]))


def _writable(path: Polyline) -> Iterator[Segment]:
    """Yield the segments of a path; no arc's ends are so near that a program's decimals would take them for one place.

    A short arc becomes its chord, which it leaves by less than half its length; one that is nearly round, two arcs.
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


def _arc(builder: ToolpathBuilder, s: Segment, feed: float) -> None:
    z = builder.position[2]
    builder.arc(s.bulge < 0.0, (*s.end, z), Arc((*s.center, z)), feed=feed)
