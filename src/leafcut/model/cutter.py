"""The profile of a tool: the flutes from the tip up, and above them the shank and the holder, which do not cut."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.message import Message
from leafcut.model.tool import CONES, BodySegment, Tool, ToolKind

#: Radius step between the discs that approximate the cone of a holder, mm. Each disc is as wide as the cone at the
#: upper end of its section, so no collision is missed.
CONE_STEP = 0.25
#: Number of discs that enclose the cone of a spot drill.
CONE_DISCS = 32
#: Maximum amount by which the shank's radius may exceed the tool's radius so that the shank still fits into the cut,
#: mm.
SAME_RADIUS = 5e-4


@dataclass(frozen=True)
class Cutter:
    """The profile of a rotating tool: a flat end, a corner arc, and a cone, mm.

    From the axis outwards, the surface is flat up to the radius `flat`. It then follows the arc to the point where the
    cone is tangent to the arc, and finally the cone up to `radius`. This is the APT tool (ISO 3592), restricted to
    convex profiles.

    `corner` is the radius of the arc, or 0 for a sharp edge. `slope` is the rise of the cone per mm of radius. It is
    infinite for a cylinder.
    """

    radius: float
    flat: float
    corner: float = 0.0
    slope: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 < self.radius < math.inf:
            raise OptionError("a tool of diameter {:g} mm cannot cut; give its true diameter", 2 * self.radius)
        if not (
            self.slope > 0 and self.flat >= 0 and self.corner >= 0
        ) or self.flat + self.tangent_fraction * self.corner > self.radius * (1.0 + 1e-9):
            raise OptionError(
                "a tool of diameter {:g} mm cannot have a corner radius of {:g} mm and a tip diameter of {:g} mm",
                2 * self.radius,
                self.corner,
                2 * self.flat,
            )

    @property
    def tangent_fraction(self) -> float:
        """Radial distance from the start of the arc to its tangent point with the cone, as a fraction of `corner`."""
        return 1.0 if math.isinf(self.slope) else self.slope / math.hypot(1.0, self.slope)

    @property
    def tangent_point(self) -> tuple[float, float]:
        """Point where the arc meets the cone: distance from the axis, and height above the tip, mm."""
        share = self.tangent_fraction
        return self.flat + share * self.corner, self.corner * (1.0 - math.sqrt(max(1.0 - share * share, 0.0)))

    def height(self, distance: float) -> float:
        """Return how high the surface lies above the tip at a distance from the axis, mm.

        The height is infinite beyond the radius of the tool.
        """
        reach, rise = self.tangent_point
        if distance > self.radius:
            return math.inf
        if distance <= self.flat:
            return 0.0
        if distance <= reach:
            return self.corner - math.sqrt(max(self.corner**2 - (distance - self.flat) ** 2, 0.0))
        return math.inf if math.isinf(self.slope) else rise + self.slope * (distance - reach)

    def radius_at(self, depth: float) -> float:
        """Return the largest radius that the tool cuts when its tip is at the given depth, mm.

        The result is smaller than `radius` only for a pointed tool.
        """
        if self.corner > 0.0 or math.isinf(self.slope):
            return self.radius
        return min(self.flat + max(depth, 0.0) / self.slope, self.radius)


def flat_mill(diameter: float) -> Cutter:
    """Return the profile of an end mill with sharp corners."""
    return Cutter(0.5 * diameter, 0.5 * diameter)


def ball_mill(diameter: float) -> Cutter:
    """Return the profile of a ball mill."""
    return Cutter(0.5 * diameter, 0.0, 0.5 * diameter)


def bull_mill(diameter: float, corner: float) -> Cutter:
    """Return the profile of an end mill with rounded corners."""
    return Cutter(0.5 * diameter, 0.5 * diameter - corner, corner)


def pointed_cutter(diameter: float, angle: float, tip: float = 0.0) -> Cutter:
    """Return the profile of a drill, V-bit or chamfer mill.

    `angle` is the included angle, rad (π for a flat end). `tip` is the diameter of the flat at the tip, mm.
    """
    if not 0.0 < angle <= math.pi:
        raise OptionError(
            "a point angle of {:g} degrees is impossible; give an angle between 0 and 180", math.degrees(angle)
        )
    if angle > math.pi - 1e-9:
        return flat_mill(diameter)
    return Cutter(0.5 * diameter, 0.5 * tip, 0.0, 1.0 / math.tan(0.5 * angle))


def cutter_of_tool(tool: Tool) -> Cutter:
    """Return the profile of a library tool. If the library does not specify the shape of the end, the end is flat."""
    if tool.kind is ToolKind.BALL_MILL:
        return ball_mill(tool.diameter)
    if tool.kind is ToolKind.END_MILL and tool.corner_radius:
        return bull_mill(tool.diameter, tool.corner_radius)
    if tool.kind in (ToolKind.DRILL, ToolKind.CENTRE_DRILL, *CONES):
        return pointed_cutter(tool.diameter, tool.point_angle, tool.tip_diameter)
    return flat_mill(tool.diameter)


class Body(StrEnum):
    """A section of a tool above its flutes: shank or holder."""

    SHANK = Message("shank")
    HOLDER = Message("holder")


@dataclass(frozen=True)
class BodyPart:
    """A section of a tool above its flutes, as seen from below: a flat face and then a cone, mm.

    `above` is how high the lower end lies above the tip. `flat` is the radius at the lower end. It equals `radius` for
    a cylinder, and for a section that narrows upwards. `slope` is the rise of the cone per mm of radius, and is
    infinite for a cylinder.
    """

    body: Body
    above: float
    flat: float
    radius: float
    slope: float = math.inf


class BodyDisc(NamedTuple):
    """A horizontal disc that represents a section of a tool above its flutes, mm.

    Material within `radius` collides with the disc if it is higher than the disc. A cone becomes several discs. Each
    disc is as wide as the cone at the lower end of the next disc.
    """

    body: Body
    above: float
    radius: float


def wide_discs_above_flutes(tool: Tool) -> tuple[BodyDisc, ...]:
    """Return discs for the known sections above the flutes that are wider than the tool, from the tip up."""
    discs = []
    for part in shank_and_holder_sections(tool):
        wider = part.radius - part.flat
        steps = max(math.ceil(wider / CONE_STEP), 1)
        for k in range(steps):
            above = part.above + (part.slope * wider * k / steps if k else 0.0)
            discs.append(BodyDisc(part.body, above, part.flat + wider * (k + 1) / steps))
    return tuple(disc for disc in discs if disc.radius > 0.5 * tool.diameter + SAME_RADIUS)


def widest_radius_below(
    radius: float, bodies: Sequence[tuple[float, float]], tip: float, heights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the largest radius of a tool below each height, float64[k], mm.

    Parameters
    ----------
    radius
        Radius of the flutes, mm.
    bodies
        Height above the tip and radius of each disc of shank and holder, mm.
    tip
        Height of the tip, mm.
    """
    widest = np.full(np.shape(heights), radius)
    for above, wide in bodies:
        widest = np.where(tip + above < heights, np.maximum(widest, wide), widest)
    return widest


def tip_radius_and_discs(tool: Tool) -> tuple[float, list[tuple[float, float]]]:
    """Return the radius of a tool at its tip, and the discs around its flutes as (height above the tip, radius), mm.

    The cone of a spot drill is narrow at its tip. All other tools are treated as cylinders without discs.
    """
    radius = 0.5 * tool.diameter
    if tool.kind is not ToolKind.CENTRE_DRILL or tool.point_angle >= math.pi:
        return radius, []
    tip = 0.5 * tool.tip_diameter
    length = (radius - tip) / math.tan(0.5 * tool.point_angle)
    steps = range(CONE_DISCS)
    return tip, [(length * k / CONE_DISCS, tip + (radius - tip) * (k + 1) / CONE_DISCS) for k in steps]


def shank_and_holder_discs(tool: Tool) -> list[tuple[float, float]]:
    """Return the discs of shank and holder as pairs (height above the tip, radius), mm."""
    return [(disc.above, disc.radius) for disc in wide_discs_above_flutes(tool)]


def shank_and_holder_sections(tool: Tool) -> tuple[BodyPart, ...]:
    """Return the sections of shank and holder that are at least as wide as the tool.

    The result is empty if no section is known.
    """
    return tuple(part for part in _body_parts(tool) if part.radius >= 0.5 * tool.diameter * (1.0 - 1e-9))


def _body_parts(tool: Tool) -> Iterator[BodyPart]:
    at = tool.flute_length
    if at is not None:
        for segment in tool.shaft:
            yield _body_part(Body.SHANK, at, segment)
            at += segment.length
        if tool.shank_diameter is not None and (tool.stickout is None or at < tool.stickout):
            yield BodyPart(Body.SHANK, at, 0.5 * tool.shank_diameter, 0.5 * tool.shank_diameter)
    at = tool.stickout
    if at is not None:
        for segment in tool.holder:
            yield _body_part(Body.HOLDER, at, segment)
            at += segment.length


def _body_part(body: Body, above: float, segment: BodySegment) -> BodyPart:
    low, high = 0.5 * segment.lower, 0.5 * segment.upper
    if high <= low:
        return BodyPart(body, above, low, low)
    return BodyPart(body, above, low, high, segment.length / (high - low))
