"""Entry moves. An end mill descends to a level by a ramp along its path, by a helix, or by a plunge."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.cleaning import without_short_steps
from leafcut.geometry.polyline import Polyline, Segment
from leafcut.model.toolpath import Arc, ToolpathBuilder
from leafcut.processes.milling.mill import MillingData

#: Height above the material at which a ramp or a helix starts, mm.
ABOVE = 0.5
#: Candidate helix radii, in tool radii. A helix with a radius of 1 or more would leave a core.
HELIX_RADII = (0.9, 0.75, 0.6, 0.5)
#: Number of directions in which to look for the centre of a helix.
HELIX_DIRECTIONS = 24
#: Maximum number of legs of a ramp. If a ramp needs more, the tool plunges.
MOST_LEGS = 24
#: Maximum number of turns along a loop. If the tool needs more, it plunges.
MOST_LOOPS = 400
#: Minimum length of an arc, mm. Shorter arcs become lines, because rounding could reverse their direction.
SHORTEST_ARC = 0.01
#: Minimum length of a move, mm. Shorter moves are skipped.
SHORTEST = 1e-6
#: Kinds of entry to try, in order, for each requested kind.
_FALLBACKS = {"ramp": ("ramp", "helix"), "helix": ("helix", "ramp"), "plunge": (), "predrilled": ()}
#: Tolerance for points on the boundary of a region, mm.
TOUCH = 1e-6


@dataclass(frozen=True)
class Descent:
    """An entry move from the height `top` to the height `bottom`, mm.

    If the requested entry does not fit, the actual `kind` differs from the requested kind (`asked`).
    """

    kind: str
    asked: str
    place: Point
    top: float
    bottom: float


def enter_level(
    builder: ToolpathBuilder,
    path: Polyline,
    top: float,
    bottom: float,
    data: MillingData,
    allowed: Any,
    climb: bool,
    ring: Polyline | None = None,
) -> Descent:
    """Lower the tool to `bottom`, mm, at the start of `path`. If neither a ramp nor a helix fits, the tool plunges.

    A ramp goes back and forth along the path and ends at the start of the path. If the path starts with a closed `ring`
    that is shorter than the ramp, the tool spirals down along this ring instead. A helix lies next to the path, inside
    the area `allowed`.

    Parameters
    ----------
    top
        Height of the top of the material, mm. The tool starts at this height or above it.
    allowed
        Possible tool centres as a shapely geometry.
    """
    start, asked = path.start, data.entry
    high = min(builder.position[2], top + ABOVE) if builder.position[2] > top else builder.position[2]
    if builder.position[2] > high + SHORTEST:
        builder.feed(z=high, feed=data.tool.feed)
    turns = 0 if ring is None else _turns_instead_of_ramp(ring.length, high - bottom, data.entry_angle)
    legs = _ramp_legs(path, high - bottom, data.entry_angle)
    ramps = legs is not None or turns > 0
    # The search for a helix is slow, so it is run only if a helix may be used.
    wanted = asked == "helix" or (asked == "ramp" and not ramps)
    circle = _widest_helix(start, 0.5 * data.tool.diameter, allowed) if wanted else None
    possible = {"ramp": ramps, "helix": circle is not None}
    kind = next((k for k in _FALLBACKS[asked] if possible[k]), "plunge" if asked in possible else asked)
    feed = data.ramp_feed(top - bottom)
    if kind == "helix" and circle is not None:
        _helix(builder, start, circle, (high, bottom), data.entry_angle, feed, climb)
    elif kind == "ramp" and ring is not None and turns:
        _follow_turns(builder, ring, turns, (high, bottom), feed)
    elif kind == "ramp" and legs is not None:
        _ramp(builder, path, legs, (high, bottom), feed)
    else:
        builder.feed(z=bottom, feed=data.limited_plunge_feed)
    return Descent(kind, asked, start, high, bottom)


def descend_along_loop(
    builder: ToolpathBuilder, loop: Polyline, top: float, bottom: float, data: MillingData, allowed: Any, climb: bool
) -> Descent:
    """Lower the tool along a closed loop in as many turns as needed.

    If the requested entry is neither a ramp nor a helix, or if the loop is too short, this function falls back to
    `enter_level`.
    """
    turns = _descent_turns(loop.length, min(builder.position[2], top + ABOVE) - bottom, data.entry_angle)
    if data.entry not in ("ramp", "helix") or not turns:
        return enter_level(builder, loop, top, bottom, data, allowed, climb)
    high = min(builder.position[2], top + ABOVE) if builder.position[2] > top else builder.position[2]
    if builder.position[2] > high + SHORTEST:
        builder.feed(z=high, feed=data.tool.feed)
    feed = data.ramp_feed(top - bottom)
    _follow_turns(builder, loop, turns, (high, bottom), feed)
    return Descent("helix", "helix", loop.start, high, bottom)


def _follow_turns(
    builder: ToolpathBuilder, loop: Polyline, turns: int, heights: tuple[float, float], feed: float
) -> None:
    high, low = heights
    for turn in range(turns):
        start, end = (high + (low - high) * (turn + k) / turns for k in (0, 1))
        cut_along(builder, loop, feed, (start, end))


def _descent_turns(length: float, drop: float, angle: float) -> int:
    """Return the number of turns that descend by `drop` mm at the ramp angle, or 0 if the loop is too short."""
    turns = math.ceil(drop / (length * math.tan(angle)) - 1e-9) if length > SHORTEST else 0
    return turns if turns <= MOST_LOOPS else 0


def _turns_instead_of_ramp(length: float, drop: float, angle: float) -> int:
    """Return the number of turns along a ring that can replace a ramp.

    Return 0 if the ring is longer than the ramp or much too short.
    """
    turns = _descent_turns(length, drop, angle)
    return turns if 1 < turns <= MOST_LEGS else 0


# -- ramp ------------------------------------------------------------------------------------------------------------


def _ramp_legs(path: Polyline, drop: float, angle: float) -> tuple[int, float] | None:
    """Return the number of legs of a ramp, which is even, and their length, mm, or None if the path is too short."""
    needed = drop / math.tan(angle)
    if not path.length > 0.0:
        return None
    count = 2 * max(math.ceil(0.5 * needed / path.length - 1e-9), 1)
    return (count, needed / count) if count <= MOST_LEGS else None


def _ramp(
    builder: ToolpathBuilder, path: Polyline, legs: tuple[int, float], heights: tuple[float, float], feed: float
) -> None:
    count, length = legs
    forth = path.piece(0.0, length)
    back = forth.reversed()
    high, low = heights
    for leg in range(count):
        start, end = (high + (low - high) * (leg + k) / count for k in (0, 1))
        cut_along(builder, back if leg % 2 else forth, feed, (start, end))


# -- helix -----------------------------------------------------------------------------------------------------------


def _widest_helix(start: Point, tool_radius: float, allowed: Any) -> tuple[Point, float] | None:
    """Return the centre and radius, mm, of the widest helix that passes through `start` and fits into `allowed`.

    Return None if no helix fits.
    """
    room = allowed.buffer(TOUCH)
    shapely.prepare(room)
    for part in HELIX_RADII:
        radius = part * tool_radius
        for k in range(HELIX_DIRECTIONS):
            angle = 2.0 * math.pi * k / HELIX_DIRECTIONS
            centre = (start[0] + radius * math.cos(angle), start[1] + radius * math.sin(angle))
            if room.covers(shapely.Point(centre).buffer(radius, quad_segs=64)):
                return centre, radius
    return None


def _helix(
    builder: ToolpathBuilder,
    start: Point,
    circle: tuple[Point, float],
    heights: tuple[float, float],
    angle: float,
    feed: float,
    climb: bool,
) -> None:
    """Descend in half circles. For climb milling, they run counter-clockwise, so the uncut material is on the right."""
    (high, low), (centre, radius) = heights, circle
    halves = 2 * max(math.ceil((high - low) / (2.0 * math.pi * radius * math.tan(angle)) - 1e-9), 1)
    across = (2.0 * centre[0] - start[0], 2.0 * centre[1] - start[1])
    for half in range(halves):
        z = high + (low - high) * (half + 1) / halves
        place = start if half % 2 else across
        builder.arc(not climb, (*place, z), Arc((*centre, builder.position[2])), feed=feed)


# -- moves -----------------------------------------------------------------------------------------------------------


def cut_along(
    builder: ToolpathBuilder, path: Polyline, feed: float, heights: tuple[float, float] | None = None
) -> None:
    """Cut along an open path at the current height.

    With `heights` (start, end), mm, cut at a constant slope instead.
    """
    path = without_short_steps(path)
    length, gone = path.length, 0.0
    level = builder.position[2]
    for index, s in enumerate(path.segments()):
        gone += float(path.lengths[index])
        z = level if heights is None else heights[0] + (heights[1] - heights[0]) * gone / length
        if index == path.n_segments - 1 and heights is not None:
            z = heights[1]
        _write_segment(builder, s, z, feed)


def _write_segment(builder: ToolpathBuilder, s: Segment, z: float, feed: float) -> None:
    chord = math.dist(s.start, s.end)
    if s.is_arc and chord > SHORTEST_ARC:
        builder.arc(s.bulge < 0.0, (*s.end, z), Arc((*s.center, builder.position[2])), feed=feed)
    elif chord > SHORTEST or abs(z - builder.position[2]) > SHORTEST:
        builder.feed(*s.end, z, feed=feed)
