"""How an end mill comes down to a level: in a ramp along its own way, in a helix, or straight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline, Segment
from leafcut.model.toolpath import Arc, ToolpathBuilder
from leafcut.processes.pocket.plan.rules import MillingData

#: A ramp or a helix begins so far over what is to be cut, mm.
ABOVE = 0.5
#: Radii of a helix that are tried, parts of the tool's radius: below 1, or a core stays.
HELIX_RADII = (0.9, 0.75, 0.6, 0.5)
#: Directions from the start of a path in which the centre of a helix is tried.
HELIX_DIRECTIONS = 24
#: A ramp goes back and forth at most so often; where the path is too short for it the tool goes straight down.
MOST_LEGS = 24
#: A loop is followed at most so often: a deep level on a very small loop is gone down to straight.
MOST_LOOPS = 400
#: What is shorter is written as a line, mm: no arc so short can be told from its opposite.
SHORTEST_ARC = 0.01
SHORTEST = 1e-6
#: What is tried where a way down is asked for.
_IN_PLACE_OF = {"ramp": ("ramp", "helix"), "helix": ("helix", "ramp"), "plunge": (), "predrilled": ()}
#: Chords of a region and of a circle differ by less than they keep away from the wall besides, mm.
TOUCH = 1e-6


@dataclass(frozen=True)
class Descent:
    """One way down: `kind` as it is made, which may be less than was asked for, and from where to where."""

    kind: str
    asked: str
    place: Point
    top: float
    bottom: float


def come_down(
    builder: ToolpathBuilder,
    way: Polyline,
    top: float,
    bottom: float,
    data: MillingData,
    allowed: Any,
    climb: bool,
    ring: Polyline | None = None,
) -> Descent:
    """Bring the tool from the start of `way`, at or over `top`, down to `bottom` at the same place.

    A ramp goes along the way and back, so that it ends where it began; along a `ring` shorter than itself it goes round
    and round. A helix turns beside the way, inside `allowed` (shapely geometry of tool centres). Where neither fits the
    tool goes straight down.

    Parameters
    ----------
    way
        Open, in the plane: what the tool follows at the bottom afterwards.
    ring
        The first stretch of it where that ends where it began.
    top
        Height of what is to be cut, mm.
    """
    start, asked = way.start, data.entry
    high = min(builder.position[2], top + ABOVE) if builder.position[2] > top else builder.position[2]
    if builder.position[2] > high + SHORTEST:
        builder.feed(z=high, feed=data.tool.feed)
    turns = 0 if ring is None else _round(ring.length, high - bottom, data.entry_angle)
    legs = _legs(way, high - bottom, data.entry_angle)
    ramps = legs is not None or turns > 0
    # A place for a helix takes a while to find: it is looked for where it may be used only.
    wanted = asked == "helix" or (asked == "ramp" and not ramps)
    circle = _helix_place(start, 0.5 * data.tool.diameter, allowed) if wanted else None
    possible = {"ramp": ramps, "helix": circle is not None}
    kind = next((k for k in _IN_PLACE_OF[asked] if possible[k]), "plunge" if asked in possible else asked)
    feed = data.ramp_feed(top - bottom)
    if kind == "helix" and circle is not None:
        _helix(builder, start, circle, (high, bottom), data.entry_angle, feed, climb)
    elif kind == "ramp" and ring is not None and turns:
        _wind(builder, ring, turns, (high, bottom), feed)
    elif kind == "ramp" and legs is not None:
        _ramp(builder, way, legs, (high, bottom), feed)
    else:
        builder.feed(z=bottom, feed=data.straight_feed)
    return Descent(kind, asked, start, high, bottom)


def wind_down(
    builder: ToolpathBuilder, loop: Polyline, top: float, bottom: float, data: MillingData, allowed: Any, climb: bool
) -> Descent:
    """Bring the tool down along a closed loop, as often round as it takes; like `come_down` where no ramp is wanted."""
    turns = _turns(loop.length, min(builder.position[2], top + ABOVE) - bottom, data.entry_angle)
    if data.entry not in ("ramp", "helix") or not turns:
        return come_down(builder, loop, top, bottom, data, allowed, climb)
    high = min(builder.position[2], top + ABOVE) if builder.position[2] > top else builder.position[2]
    if builder.position[2] > high + SHORTEST:
        builder.feed(z=high, feed=data.tool.feed)
    feed = data.ramp_feed(top - bottom)
    _wind(builder, loop, turns, (high, bottom), feed)
    return Descent("helix", "helix", loop.start, high, bottom)


def _wind(builder: ToolpathBuilder, loop: Polyline, turns: int, heights: tuple[float, float], feed: float) -> None:
    high, low = heights
    for turn in range(turns):
        begin, end = (high + (low - high) * (turn + k) / turns for k in (0, 1))
        follow(builder, loop, feed, (begin, end))


def _turns(length: float, drop: float, angle: float) -> int:
    """Return how often a loop is followed for a drop, 0 where it is too short for that."""
    turns = math.ceil(drop / (length * math.tan(angle)) - 1e-9) if length > SHORTEST else 0
    return turns if turns <= MOST_LOOPS else 0


def _round(length: float, drop: float, angle: float) -> int:
    """Return how often a ring is followed for a drop; 0 where it is longer than a ramp, or hardly there."""
    turns = _turns(length, drop, angle)
    return turns if 1 < turns <= MOST_LEGS else 0


# -- ramp ------------------------------------------------------------------------------------------------------------


def _legs(way: Polyline, drop: float, angle: float) -> tuple[int, float] | None:
    """Return how many legs a ramp has, an even number, and how long each is, mm; None where the way is too short."""
    needed = drop / math.tan(angle)
    if not way.length > 0.0:
        return None
    count = 2 * max(math.ceil(0.5 * needed / way.length - 1e-9), 1)
    return (count, needed / count) if count <= MOST_LEGS else None


def _ramp(
    builder: ToolpathBuilder, way: Polyline, legs: tuple[int, float], heights: tuple[float, float], feed: float
) -> None:
    count, length = legs
    forth = way.piece(0.0, length)
    back = forth.reversed()
    high, low = heights
    for leg in range(count):
        begin, end = (high + (low - high) * (leg + k) / count for k in (0, 1))
        follow(builder, back if leg % 2 else forth, feed, (begin, end))


# -- helix -----------------------------------------------------------------------------------------------------------


def _helix_place(start: Point, tool_radius: float, allowed: Any) -> tuple[Point, float] | None:
    """Return centre and radius of the widest circle through `start` that lies in the allowed region, or None."""
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
    """Turn down in half circles; counter-clockwise, the material is on the right of a tool inside a hole."""
    (high, low), (centre, radius) = heights, circle
    halves = 2 * max(math.ceil((high - low) / (2.0 * math.pi * radius * math.tan(angle)) - 1e-9), 1)
    across = (2.0 * centre[0] - start[0], 2.0 * centre[1] - start[1])
    for half in range(halves):
        z = high + (low - high) * (half + 1) / halves
        place = start if half % 2 else across
        builder.arc(not climb, (*place, z), Arc((*centre, builder.position[2])), feed=feed)


# -- moves -----------------------------------------------------------------------------------------------------------


def follow(builder: ToolpathBuilder, way: Polyline, feed: float, heights: tuple[float, float] | None = None) -> None:
    """Cut along an open way from where it begins; with `heights` from the first to the second, evenly."""
    length, gone = way.length, 0.0
    level = builder.position[2]
    for index, s in enumerate(way.segments()):
        gone += float(way.lengths[index])
        z = level if heights is None else heights[0] + (heights[1] - heights[0]) * gone / length
        if index == way.n_segments - 1 and heights is not None:
            z = heights[1]
        _move(builder, s, z, feed)


def _move(builder: ToolpathBuilder, s: Segment, z: float, feed: float) -> None:
    chord = math.dist(s.start, s.end)
    if s.is_arc and chord > SHORTEST_ARC:
        builder.arc(s.bulge < 0.0, (*s.end, z), Arc((*s.center, builder.position[2])), feed=feed)
    elif chord > SHORTEST or abs(z - builder.position[2]) > SHORTEST:
        builder.feed(*s.end, z, feed=feed)
