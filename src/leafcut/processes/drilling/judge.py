"""Check that a program drills each hole of the drawing once, at the right position and depth, with the right tool.

This module has its own code to compute tools, depths and positions. If it shared code with the planner, it would repeat
the errors of the planner.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.heights import SAME_HEIGHT
from leafcut.model.mesh import Mesh
from leafcut.model.part import Hole, HoleStep, Part, Slot
from leafcut.model.tool import CONES, Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.options import JobOptions, ReadOptions
from leafcut.processes.drilling.options import DrillOptions
from leafcut.proof.difference import limit_differences, position_text

#: Tolerance for floating-point errors of sums and rotations, mm. The rounding of numbers in the program is added to it.
_ARITHMETIC = 2e-6
#: Point angle of assumed drills, rad: DIN 338, type N.
_POINT_ANGLE = math.radians(118.0)
#: Diameter that is assumed for a hole drawn as a point, mm.
_BARE_POINT = 1.0
#: Default depth of a centre drill as a share of its diameter.
_CENTRE_SHARE = 0.4
#: Number of decimals of the diameters of assumed tools, and smallest such diameter, mm.
_DECIMALS, _THINNEST = 4, 1e-4
_NO_NUMBER = -1
#: Diameters or depths that differ by no more than this count as equal, mm; likewise for countersink angles, rad.
_SAME, _SAME_ANGLE = 1e-9, math.radians(1.0)
#: Tolerance on each axis for matching a tool with a drawn hole, mm. The exact position is compared later.
_SAME_PLACE = 0.01
#: An angle counts as a multiple of 90° if it deviates by no more than this, in quarter turns.
_QUARTER_TOLERANCE = 1e-9
#: Comment at a tool change that names an assumed tool: ``(T1 drill D6.35)``.
_TOOL_COMMENT = re.compile(r"[(;]\s*T(\d+) (drill|slot-mill) D([\d.]+)\s*(?:\)|$)", re.IGNORECASE | re.MULTILINE)
#: Kinds of motion that never occur in drilling programs written by leafcut.
_FOREIGN_KINDS = (Kind.ARC_CW, Kind.ARC_CCW, Kind.FRAME, Kind.SHIFT, Kind.FOREIGN, Kind.PROBE)


class _Cut(NamedTuple):
    """A plunge that a hole requires: position and lowest height of the tip (mm), tool, and index of the hole."""

    x: float
    y: float
    tip: float
    tool: str
    hole: int


class _SlotCut(NamedTuple):
    """A cut that a slot requires: both ends, height of the bottom, and maximum depth of a single pass (`step`), mm."""

    ends: tuple[tuple[float, float], tuple[float, float]]
    bottom: float
    step: float
    tool: str


class _Plunge(NamedTuple):
    """A plunge in the program: position and lowest height of the tip (mm), tool, and program line."""

    x: float
    y: float
    tip: float
    tool: str
    line: int


class _Pass(NamedTuple):
    """A horizontal or sloping straight cut in the program: start and end (mm), tool, and program line."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    tool: str
    line: int


@dataclass(frozen=True, eq=False)
class DrillingRequest:
    """The user's options, together with the part and the surface in the coordinates of the drawing.

    `surface` is None for a flat part, and `library` is None if tools are assumed.
    """

    part: Part
    reading: ReadOptions
    job: JobOptions
    options: DrillOptions
    library: ToolLibrary | None = None
    surface: Mesh | None = None

    @cached_property
    def zero(self) -> complex:
        """The program zero as a complex number x + iy, mm, in the drawing after mirroring and rotation."""
        origin = self.reading.origin
        if origin is None or not len(self.rotated_points):
            return 0j
        if not isinstance(origin, str):
            return complex(*origin)
        bounds = self.rotated_points if self.part.reference is None else self._bounding_points(self.part.reference)
        (x0, x1), (y0, y1) = ((float(axis.min()), float(axis.max())) for axis in (bounds.real, bounds.imag))
        if origin == "centre":
            return complex(x0 + 0.5 * (x1 - x0), y0 + 0.5 * (y1 - y0))
        return complex(x0 if "left" in origin else x1, y0 if "lower" in origin else y1)

    def _bounding_points(self, outline: Part) -> NDArray[np.complex128]:
        """Return points that span the bounding box of an outline, complex128[n], mm.

        The outline is mirrored and rotated first.
        """
        corners = [complex(hole.x, hole.y) for hole in outline.holes]
        points = [self.mirror_and_rotate(np.array(corners, dtype=np.complex128))]
        side = 1.0 if self.reading.mirror is None else -1.0
        for path in (contour.path for contour in outline.contours):
            x, y, bulge = path.vertices.T
            rotated = self.mirror_and_rotate(x + 1j * y)
            x0, y0, x1, y1 = Polyline(np.column_stack([rotated.real, rotated.imag, side * bulge]), path.closed).extents
            points.append(np.array([complex(x0, y0), complex(x1, y1)]))
        return np.concatenate(points)

    def mirror_and_rotate(self, points: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Mirror points of the drawing, and then rotate them. The points are complex numbers x + iy, mm."""
        if self.reading.mirror == "x":
            points = -points.conj()
        elif self.reading.mirror == "y":
            points = points.conj()
        quarters = self.reading.rotate / (0.5 * math.pi)
        if abs(quarters - round(quarters)) < _QUARTER_TOLERANCE:
            return np.asarray(points * 1j ** (round(quarters) % 4))
        return np.asarray(points * complex(math.cos(self.reading.rotate), math.sin(self.reading.rotate)))

    @cached_property
    def rotated_points(self) -> NDArray[np.complex128]:
        """Positions of the holes and then both ends of each slot, after mirroring and rotation, complex128[n], mm."""
        points = [complex(hole.x, hole.y) for hole in self.part.holes]
        points += [complex(*end) for slot in self.part.slots for end in (slot.start, slot.end)]
        return self.mirror_and_rotate(np.array(points, dtype=np.complex128))

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """Positions of the holes, followed by both ends of each slot, in program coordinates, float64[n, 2], mm."""
        shifted = self.rotated_points - self.zero
        return np.column_stack([shifted.real, shifted.imag])

    @cached_property
    def surface_triangles(self) -> NDArray[np.float64]:
        """Triangles of the surface in program coordinates, float64[n, 3, 3], mm."""
        assert self.surface is not None
        triangles = self.surface.triangles.copy()
        shifted = self.mirror_and_rotate(triangles[:, :, 0] + 1j * triangles[:, :, 1]) - self.zero
        triangles[:, :, 0], triangles[:, :, 1] = shifted.real, shifted.imag
        return triangles


def judge_holes(request: DrillingRequest, text: str, path: Toolpath, rounding: float) -> list[Difference]:
    """Compare a drilling program with the request, and return the differences.

    `rounding` is the maximum rounding error of the numbers in the program, mm.
    """
    tolerance = rounding + _ARITHMETIC
    names = None if request.library is not None else _assumed_tools(text)
    plunges, passes, differences = _read_motions(path, names)
    tools = _ToolsUsed(
        request,
        [(motion.x, motion.y, motion.tool) for motion in plunges]
        + [(*motion.start[:2], motion.tool) for motion in passes],
    )
    holes, slots = list(_required_plunges(request, tools)), list(_required_slots(request, tools))
    unmatched, hole_differences = _compare_holes(request.part.holes, holes, plunges, tolerance)
    differences += hole_differences + _compare_slots(slots, passes, tolerance)
    drawn = _PointIndex([(cut.x, cut.y) for cut in holes])
    ends = _PointIndex([end for slot in slots for end in slot.ends])
    for plunge in unmatched:
        entered_slots = [slots[k // 2] for k in ends.indices_near(plunge.x, plunge.y, tolerance)]
        if any(slot.tool == plunge.tool and plunge.tip >= slot.bottom - tolerance for slot in entered_slots):
            continue
        where = position_text(plunge.x, plunge.y, plunge.tip)
        if drawn.indices_near(plunge.x, plunge.y, tolerance):
            text = Message("{} drills at {}, where a hole already exists", plunge.tool, where)
            differences.append(Difference(Message("hole twice"), 0, plunge.line, text))
        else:
            text = Message("{} drills at {}, where the drawing has no hole", plunge.tool, where)
            differences.append(Difference(Message("hole not drawn"), 0, plunge.line, text))
    return limit_differences(differences)


# Cuts that the drawing needs.


def _required_plunges(request: DrillingRequest, used: _ToolsUsed) -> Iterator[_Cut]:
    part, job = request.part, request.job
    steps = [_hole_tools(request, used, hole, k) for k, hole in enumerate(part.holes)]
    tops, underside = _hole_tops(request, steps)
    for k, (hole, tools) in enumerate(zip(part.holes, steps, strict=True)):
        x, y = request.points[k].tolist()
        drill_point = max((_point_length(tool) for tool in tools if tool.kind is ToolKind.DRILL), default=0.0)
        for tool in tools:
            if tool.kind is ToolKind.CENTRE_DRILL:
                tip = _CENTRE_SHARE * tool.diameter if tool.depth is None else tool.depth
            elif underside is not None:
                tip = tops[k] - underside[k] + job.break_through + _point_length(tool)
            elif job.blind_depth is not None:
                tip = job.blind_depth + (_point_length(tool) if request.options.depth_to == "shoulder" else 0.0)
            elif job.thickness is not None:
                tip = job.thickness + job.break_through + _point_length(tool)
            elif hole.depth is None:
                where = position_text(x, y)
                raise PlanError(
                    "{}: the depth of the hole at {} is unknown; give --depth or --thickness", part.name, where
                )
            else:
                below = job.break_through if hole.through else 0.0
                tip = hole.depth + below + _point_length(tool) - (drill_point if hole.flat else 0.0)
            yield _Cut(x, y, tops[k] - tip, _tool_name(request, tool), k)
        for wide in hole.steps:
            wider = _counterbore_tool(request, wide, (x, y, hole.z))
            if wider is not None:
                flat = 0.5 * wider.tip_diameter / math.tan(0.5 * wide.angle) if wide.angle < math.pi else 0.0
                yield _Cut(x, y, tops[k] - wide.tip + flat, _tool_name(request, wider), k)


def _required_slots(request: DrillingRequest, used: _ToolsUsed) -> Iterator[_SlotCut]:
    job, ends = request.job, request.points[len(request.part.holes) :].reshape(-1, 2, 2).tolist()
    for slot, ((x0, y0), (x1, y1)) in zip(request.part.slots, ends, strict=True):
        tool = _slot_tool(request, used, slot, (x0, y0), (x1, y1))
        if job.blind_depth is not None:
            depth = job.blind_depth + (_point_length(tool) if request.options.depth_to == "shoulder" else 0.0)
        elif job.thickness is None:
            where = position_text(x0, y0)
            raise PlanError(
                "{}: the depth of the slot from {} is unknown; give --depth or --thickness", request.part.name, where
            )
        else:
            depth = job.thickness + job.break_through + _point_length(tool)
        yield _SlotCut(((x0, y0), (x1, y1)), -depth, tool.peck or tool.diameter, _tool_name(request, tool))


def _hole_tops(
    request: DrillingRequest, steps: Sequence[Sequence[Tool]]
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Return the height of the top of each hole, mm, and of the underside of the part below it.

    The underside is only computed if the holes go all the way through a part with an uneven surface. Otherwise, it is
    None.
    """
    holes = request.part.holes
    drawn = np.array([hole.z for hole in holes], dtype=np.float64)
    use_drawn = request.part.has_hole_depths or request.reading.z_zero == "drawn"
    if request.surface is None:
        return (drawn if use_drawn else np.zeros(len(holes))), None
    if use_drawn and not request.job.is_through:
        return drawn, None
    from leafcut.material.surface import heights_around_holes  # loads a kernel, and most plates are flat

    points, radii = request.points[: len(holes)], [0.5 * max(tool.diameter for tool in tools) for tools in steps]
    rims = heights_around_holes(request.surface_triangles, points, np.array(radii, dtype=np.float64))
    above = np.maximum(rims.top - drawn, 0.0) if use_drawn else np.zeros(len(holes))
    cut_radii = [
        max(min(tool_radius, 0.5 * hole.diameter), *(_cut_radius(tool, height) for tool in tools))
        for hole, tools, tool_radius, height in zip(holes, steps, radii, above.tolist(), strict=True)
    ]
    inner = heights_around_holes(request.surface_triangles, points, np.array(cut_radii, dtype=np.float64))
    tops = drawn if use_drawn else np.maximum(rims.top, inner.top)
    return tops, (inner.under if request.job.is_through else None)


def _cut_radius(tool: Tool, above: float) -> float:
    """Return the largest radius that a tool cuts if material rises `above` mm over the top of the hole, mm.

    A centre drill only cuts with its point.
    """
    if tool.kind is not ToolKind.CENTRE_DRILL or tool.point_angle >= math.pi:
        return 0.5 * tool.diameter
    depth = _CENTRE_SHARE * tool.diameter if tool.depth is None else tool.depth
    return min(0.5 * tool.diameter, 0.5 * tool.tip_diameter + (depth + above) * math.tan(0.5 * tool.point_angle))


def _point_length(tool: Tool) -> float:
    return 0.5 * tool.diameter / math.tan(0.5 * tool.point_angle) if tool.point_angle < math.pi else 0.0


def _tool_name(request: DrillingRequest, tool: Tool) -> str:
    """Return a name such as ``T3`` for a tool of a library, or ``drill 6.35`` for an assumed tool."""
    return f"{tool.kind.value} {tool.diameter:g}" if request.library is None else f"T{tool.number}"


def _assumed_tool(kind: ToolKind, diameter: float) -> Tool:
    angle = _POINT_ANGLE if kind is ToolKind.DRILL else math.pi
    return Tool(_NO_NUMBER, max(round(diameter, _DECIMALS), _THINNEST), kind, point_angle=angle)


class _ToolsUsed:
    """The assumed tools of a program. They can be looked up by the positions at which they cut."""

    def __init__(self, request: DrillingRequest, cuts: Sequence[tuple[float, float, str]]) -> None:
        # A drill file of a board specifies its drills exactly.
        board = request.part.format == "excellon"
        self._tolerance = 0.5 * 10.0**-_DECIMALS + (0.0 if board else request.job.diameter_tolerance)
        known = [cut for cut in cuts if math.isfinite(cut[0] + cut[1])]
        self._points = _PointIndex([(x, y) for x, y, _ in known])
        self._tools = [name for _, _, name in known]

    def assumed_tool(self, kind: ToolKind, diameter: float, *points: tuple[float, float]) -> Tool:
        """Return the assumed tool for a hole or a slot of the given diameter or width, mm.

        The program's tool is returned if it cuts at one of the positions and its diameter is within the tolerance.
        Otherwise, the result is a tool of exactly the given diameter.
        """
        widths = [diameter]
        for x, y in points:
            for k in self._points.indices_near(x, y, _SAME_PLACE):
                name, _, width = self._tools[k].partition(" ")
                if name == kind.value and abs(float(width) - diameter) <= self._tolerance + _SAME:
                    widths.append(float(width))
        return _assumed_tool(kind, min(widths[1:] or widths, key=lambda width: abs(width - diameter)))


def _hole_tools(request: DrillingRequest, used: _ToolsUsed, hole: Hole, number: int) -> list[Tool]:
    """Return the tools that make a hole, in order.

    These are the tools of its recipe, or the drill whose diameter is closest. If the library has no suitable drill, the
    returned tool matches no tool in the program, so the hole is reported as missing.
    """
    library, tolerance = request.library, request.job.diameter_tolerance
    if library is None:
        x, y = request.points[number].tolist()
        return [used.assumed_tool(ToolKind.DRILL, hole.diameter if hole.diameter > 0.0 else _BARE_POINT, (x, y))]
    drills = [tool for tool in library.tools if tool.kind is ToolKind.DRILL]
    diameter = hole.diameter
    if diameter <= 0.0:
        diameter = drills[0].diameter if len(drills) == 1 else _BARE_POINT
    recipes = [
        (recipe.layer == "*", abs(recipe.diameter - diameter), k)
        for k, recipe in enumerate(library.recipes)
        if fnmatch(hole.layer.lower(), recipe.layer.lower()) and abs(recipe.diameter - diameter) <= tolerance
    ]
    if recipes:
        numbers = library.recipes[min(recipes)[2]].steps
        tools = [tool for number in numbers for tool in library.tools if tool.number == number]
    else:
        candidates = [(abs(tool.diameter - diameter), k) for k, tool in enumerate(drills)]
        candidates = [candidate for candidate in candidates if candidate[0] <= tolerance + _SAME]
        tools = [drills[min(candidates)[1]] if candidates else _assumed_tool(ToolKind.DRILL, diameter)]
    centre = [tool for tool in library.tools if tool.kind is ToolKind.CENTRE_DRILL]
    if request.options.centre_drill and not any(tool.kind is ToolKind.CENTRE_DRILL for tool in tools):
        tools = centre[:1] + tools
    return tools


def _slot_tool(request: DrillingRequest, used: _ToolsUsed, slot: Slot, *ends: tuple[float, float]) -> Tool:
    if request.library is None:
        return used.assumed_tool(ToolKind.SLOT_MILL, slot.width, *ends)
    mills = [tool for tool in request.library.tools if tool.kind is ToolKind.SLOT_MILL]
    candidates = [(abs(tool.diameter - slot.width), k) for k, tool in enumerate(mills)]
    return mills[min(candidates)[1]] if candidates else _assumed_tool(ToolKind.SLOT_MILL, slot.width)


def _counterbore_tool(request: DrillingRequest, wide: HoleStep, top: tuple[float, float, float]) -> Tool | None:
    """Return the tool for a counterbore or countersink.

    Return None if no tool fits, or if the tool would hit the material around the top of the hole.
    """
    if request.library is None or not wide.open:
        return None
    tolerance = request.job.diameter_tolerance + _SAME
    fitting = []
    for tool in request.library.tools:
        if wide.angle == math.pi:
            long_enough = tool.flute_length is None or tool.flute_length > wide.tip - _SAME
            fits = tool.kind is ToolKind.END_MILL and tool.corner_radius == 0.0 and long_enough
            fits = fits and abs(tool.diameter - wide.diameter) <= tolerance
        else:
            fits = tool.kind in CONES and abs(tool.point_angle - wide.angle) <= _SAME_ANGLE
            fits = fits and tool.tip_diameter <= wide.narrow < wide.diameter <= tool.diameter + _SAME
        if fits and tool.feed > 0.0 and tool.spindle_rpm > 0.0:
            fitting.append((abs(tool.diameter - wide.diameter), tool.number, tool))
    if not fitting:
        return None
    best = min(fitting)[2]
    if request.surface is not None:
        import shapely  # imported here because most plates are flat

        from leafcut.proof.surface import surface_reaches_into_area

        x, y, z = top
        if surface_reaches_into_area(
            request.surface_triangles, shapely.Point(x, y), 0.5 * best.diameter, z + SAME_HEIGHT
        ):
            return None
    return best


# Cuts of the program.


def _assumed_tools(text: str) -> dict[int, str]:
    """Read the comments at the tool changes.

    Return the kind and diameter of each assumed tool, keyed by the tool number.
    """
    return {int(number): f"{kind.lower()} {float(width):g}" for number, kind, width in _TOOL_COMMENT.findall(text)}


def _read_motions(
    path: Toolpath, names: Mapping[int, str] | None
) -> tuple[list[_Plunge], list[_Pass], list[Difference]]:
    """Sort the motions of a program into plunges and sideways cuts.

    All pecks of a hole count as one plunge. Any motion that drilling never needs is returned as a difference.
    """
    plunges: list[_Plunge] = []
    passes: list[_Pass] = []
    foreign: list[Difference] = []
    plunging = False
    rows = zip(
        path.kind.tolist(),
        path.before.tolist(),
        path.end.tolist(),
        path.ref.tolist(),
        path.line.tolist(),
        path.tool.tolist(),
        strict=True,
    )
    for kind, (x0, y0, z0), (x, y, z), ref, line, number in rows:
        tool = f"T{number}" if names is None else names.get(number, f"T{number}, which no comment describes")
        upright = x == x0 and y == y0
        if kind == Kind.DRILL:
            plunges.append(_Plunge(x, y, path.cycles[ref].bottom, tool, line))
            plunging = False
        elif kind == Kind.FEED and not upright:
            passes.append(_Pass((x0, y0, z0), (x, y, z), tool, line))
            plunging = False
        elif kind == Kind.FEED and not z >= z0:
            if plunging and z < plunges[-1].tip:
                plunges[-1] = plunges[-1]._replace(tip=z, line=line)
            else:
                plunges.append(_Plunge(x, y, z, tool, line))
            plunging = True
        elif kind in _FOREIGN_KINDS:
            text = Message(
                "the drilling program contains an arc, a probe, a shift of the origin or a block that is not understood"
            )
            foreign.append(Difference(Message("not drilling"), 0, line, text))
        elif kind == Kind.TOOL or (kind in (Kind.RAPID, Kind.MACHINE) and not upright):
            plunging = False
    return plunges, passes, foreign


class _PointIndex:
    """Points in the plane, mm. They are sorted by x."""

    def __init__(self, points: Sequence[tuple[float, float]]) -> None:
        self._points = sorted((x, y, k) for k, (x, y) in enumerate(points))

    def indices_near(self, x: float, y: float, tolerance: float) -> list[int]:
        """Return the indices of all points that are within a tolerance of (x, y) on both axes, mm."""
        first, last = (bisect_left(self._points, (x + side * tolerance,)) for side in (-2.0, 2.0))
        near = self._points[first:last]
        return sorted(k for u, v, k in near if abs(u - x) <= tolerance and abs(v - y) <= tolerance)


# The comparison.


def _compare_holes(
    holes: Sequence[Hole], required: Sequence[_Cut], plunges: Sequence[_Plunge], tolerance: float
) -> tuple[list[_Plunge], list[Difference]]:
    """Match the plunges with the required cuts.

    The function returns the plunges that match no cut, and the differences. A difference is a missing hole, or a wrong
    tool, depth or order.
    """
    index = _PointIndex([(plunge.x, plunge.y) for plunge in plunges])
    unused = [True] * len(plunges)
    matches: list[int | None] = []
    for cut in required:
        near = [k for k in index.indices_near(cut.x, cut.y, tolerance) if unused[k]]
        candidates = [k for k in near if plunges[k].tool == cut.tool]
        best = min(candidates, key=lambda k: (abs(plunges[k].tip - cut.tip) > tolerance, k), default=None)
        matches.append(best)
        if best is not None:
            unused[best] = False
    differences = []
    last: tuple[int, int] = (-1, -1)
    for cut, match in zip(required, matches, strict=True):
        where = Message("the hole Ø{:g} at {}", holes[cut.hole].diameter, position_text(cut.x, cut.y))
        if match is None:
            substitute = next((k for k in index.indices_near(cut.x, cut.y, tolerance) if unused[k]), None)
            if substitute is None:
                text = Message("{} is not made by {}", where, cut.tool)
                differences.append(Difference(Message("missing hole"), 0, 0, text))
            else:
                unused[substitute] = False
                text = Message("{} is made by {}, but must be made by {}", where, plunges[substitute].tool, cut.tool)
                differences.append(Difference(Message("wrong tool"), 0, plunges[substitute].line, text))
            continue
        if abs(plunges[match].tip - cut.tip) > tolerance:
            text = Message(
                "{}: the tip of {} goes to Z{:.3f}, but must go to Z{:.3f}",
                where,
                cut.tool,
                plunges[match].tip,
                cut.tip,
            )
            differences.append(Difference(Message("wrong depth"), 0, plunges[match].line, text))
        if last[0] == cut.hole and match < last[1]:
            text = Message("{}: {} is used before the tool that must come first", where, cut.tool)
            differences.append(Difference(Message("wrong order"), 0, plunges[match].line, text))
        last = (cut.hole, match)
    return [plunge for plunge, is_unused in zip(plunges, unused, strict=True) if is_unused], differences


def _compare_slots(slots: Sequence[_SlotCut], passes: Sequence[_Pass], tolerance: float) -> list[Difference]:
    """Compare the sideways cuts with the required slots, and return the differences.

    Slots may be missing or cut twice, passes may be too deep, and cuts may not be in the drawing.
    """
    index = _PointIndex([slot.ends[0] for slot in slots] + [slot.ends[1] for slot in slots])
    bottom_passes, depths = [0] * len(slots), [0.0] * len(slots)
    differences = []
    for motion in passes:
        (x0, y0, z0), (x1, y1, z1) = motion.start, motion.end
        slot_numbers = {k % len(slots) for k in index.indices_near(x0, y0, tolerance)} & {
            k % len(slots) for k in index.indices_near(x1, y1, tolerance)
        }
        slot_numbers = {
            k for k in slot_numbers if slots[k].tool == motion.tool and _connects_ends(slots[k], motion, tolerance)
        }
        candidates = [k for k in sorted(slot_numbers) if z0 == z1 and z1 >= slots[k].bottom - tolerance]
        if not candidates:
            text = Message(
                "{} cuts from {} to {}, where the drawing has no slot this deep",
                motion.tool,
                position_text(*motion.start),
                position_text(*motion.end),
            )
            differences.append(Difference(Message("cut not drawn"), 0, motion.line, text))
            continue
        number = min(candidates, key=lambda k: bottom_passes[k])
        where = Message("the slot from {} to {}", position_text(x0, y0), position_text(x1, y1))
        if depths[number] - z1 > slots[number].step + tolerance:
            text = Message(
                "{}: a pass is {:.3f} mm deep, but the maximum step-down of {} is {:g} mm",
                where,
                depths[number] - z1,
                motion.tool,
                slots[number].step,
            )
            differences.append(Difference(Message("deep pass"), 0, motion.line, text))
        depths[number] = min(depths[number], z1)
        if abs(z1 - slots[number].bottom) <= tolerance:
            bottom_passes[number] += 1
            if bottom_passes[number] > 1:
                text = Message("{} is cut again at its bottom", where)
                differences.append(Difference(Message("slot twice"), 0, motion.line, text))
    for slot, count in zip(slots, bottom_passes, strict=True):
        if not count:
            start, end = (position_text(*point) for point in slot.ends)
            text = Message("{} does not cut the slot from {} to {} down to Z{:.3f}", slot.tool, start, end, slot.bottom)
            differences.append(Difference(Message("missing slot"), 0, 0, text))
    return differences


def _connects_ends(slot: _SlotCut, motion: _Pass, tolerance: float) -> bool:
    forward = [math.dist(motion.start[:2], slot.ends[0]), math.dist(motion.end[:2], slot.ends[1])]
    backward = [math.dist(motion.start[:2], slot.ends[1]), math.dist(motion.end[:2], slot.ends[0])]
    return min(max(forward), max(backward)) <= math.sqrt(2.0) * tolerance
