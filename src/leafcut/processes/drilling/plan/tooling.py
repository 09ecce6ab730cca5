"""Choose the tools for each hole.

With a library, the tools come from its recipes and drills. Without a library, a drill of a catalogue size is assumed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from leafcut.errors import PlanError, count_of
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.part import Hole, HoleStep, Slot
from leafcut.model.tool import CONES, Tool, ToolKind, ToolLibrary
from leafcut.options import JobOptions
from leafcut.processes.drilling.options import DrillOptions
from leafcut.units import MM_PER_INCH

#: Conservative cutting data of assumed tools: high-speed steel in mild steel or aluminium (estimate).
SURFACE_SPEED = 20_000.0 / 60.0  # mm/s
FEED_PER_REVOLUTION = 0.02  # relative to the diameter
#: Highest surface speed for carbide drills in circuit boards, mm/s: 150 m/min (Richvertex, PCB cutting conditions).
BOARD_SPEED = 150_000.0 / 60.0
#: Largest ratio between the speed that suits a tool and the speed of the spindle. Beyond this ratio, the tool breaks or
#: burns.
MAX_SPEED_RATIO = 2.0
#: If an assumed speed exceeds the suitable speed by more than this factor, a warning is issued.
FAST = 1.5

#: Diameter that is assumed for holes drawn as points, mm.
POINT_DIAMETER = 1.0

#: Largest common twist drill, mm. A wider circle is more likely to be milled than drilled.
LARGEST_COMMON_DRILL = 32.0

#: Resolution of diameters, and smallest diameter, mm.
_RESOLUTION = 1e-4


#: Largest accepted difference between the point angle of a tool and the angle of its countersink, rad.
SAME_ANGLE = math.radians(1.0)
#: Default plunge rate of an end mill or a countersink as a share of its feed.
PLUNGE_PART = 1.0 / 3.0

#: A diameter equals a catalogue size if it differs by no more than this, mm. Drawings are rounded to three decimals in
#: mm, or to four decimals in inches (0.0013 mm).
EQUAL = 1.5e-3
#: Metric drill sizes: upper end of each range, and the increments within the range, mm (DIN 1899 below 1 mm, DIN 338
#: above).
_METRIC = ((1.0, (0.01,)), (3.0, (0.05,)), (np.inf, (0.1, 0.25)))
#: If an inch fraction is this close to a metric size, mm, it is only used for a hole of exactly this diameter.
_BESIDE_METRIC = 0.02
#: Number drills 1 to 80 and letter drills A to Z, thousandths of an inch: ASME B94.11M.
_NUMBERS = (
    228, 221, 213, 209, 205.5, 204, 201, 199, 196, 193.5, 191, 189, 185, 182, 180, 177, 173, 169.5, 166, 161, 159, 157,
    154, 152, 149.5, 147, 144, 140.5, 136, 128.5, 120, 116, 113, 111, 110, 106.5, 104, 101.5, 99.5, 98, 96, 93.5, 89,
    86, 82, 81, 78.5, 76, 73, 70, 67, 63.5, 59.5, 55, 52, 46.5, 43, 42, 41, 40, 39, 38, 37, 36, 35, 33, 32, 31, 29.2,
    28, 26, 25, 24, 22.5, 21, 20, 18, 16, 14.5, 13.5,
)  # fmt: skip
_LETTERS = (
    234, 238, 242, 246, 250, 257, 261, 266, 272, 277, 281, 290, 295, 302, 316, 323, 332, 339, 348, 358, 368, 377, 386,
    397, 404, 413,
)  # fmt: skip
_NUMBERED = np.array([*_NUMBERS, *_LETTERS]) * 1e-3 * MM_PER_INCH


class Step(NamedTuple):
    """A tool, and whether it cuts holes, slots (`slots`), or counterbores and countersinks (`wide`)."""

    tool: Tool
    slots: bool = False
    wide: bool = False


def _can_bore(tool: Tool, part: HoleStep) -> bool:
    long = tool.flute_length is None or tool.flute_length > part.tip - 1e-9
    return tool.kind is ToolKind.END_MILL and tool.corner_radius == 0.0 and long


def _can_countersink(tool: Tool, part: HoleStep) -> bool:
    wide = tool.tip_diameter <= part.narrow < part.diameter <= tool.diameter + 1e-9
    return tool.kind in CONES and abs(tool.point_angle - part.angle) <= SAME_ANGLE and wide


class ToolChooser:
    """Chooses the tools for a drawing. It also records which data it assumed, so that they can be reported later."""

    def __init__(
        self,
        library: ToolLibrary | None,
        machine: Machine,
        job: JobOptions,
        options: DrillOptions,
        *,
        board: bool = False,
    ) -> None:
        self.library, self.machine, self.job, self.options = library, machine, job, options
        self._board = board
        self._fastest = BOARD_SPEED if board else SURFACE_SPEED
        self._assumed: dict[tuple[ToolKind, float], Tool] = {}
        self._chosen: dict[tuple[float, str], tuple[Step, ...]] = {}
        self._bare_points = 0
        self._approximated: dict[Tool, list[float]] = {}
        self._with_assumed_feeds: dict[int, Tool] = {}
        self._widened = set[tuple[Step, ...]]()

    @property
    def tool_sequences(self) -> list[tuple[Step, ...]]:
        """The different sequences of tools that holes require, for example centre drill, drill, tap."""
        return list(dict.fromkeys((*self._chosen.values(), *sorted(self._widened, key=repr))))

    def step_for_counterbore(self, hole: Hole, part: HoleStep) -> Step | None:
        """Return the step for a counterbore or countersink, or None if no tool fits.

        It follows the other steps of the hole.

        A counterbore needs an end mill of the same diameter. A countersink needs a chamfer mill or a V-bit that has the
        same angle and is wide enough.
        """
        if self.library is None or not part.open:
            return None
        flat = part.angle == math.pi
        fitting = [tool for tool in self.library.tools if (_can_bore if flat else _can_countersink)(tool, part)]
        fitting = [tool for tool in fitting if tool.feed > 0.0 and tool.spindle_rpm > 0.0]
        tolerance = self.job.diameter_tolerance + 1e-9
        fitting = [tool for tool in fitting if not flat or abs(tool.diameter - part.diameter) <= tolerance]
        if not fitting:
            return None
        tool = min(fitting, key=lambda candidate: (abs(candidate.diameter - part.diameter), candidate.number))
        step = Step(replace(tool, feed=tool.plunge_feed or PLUNGE_PART * tool.feed), wide=True)
        self._widened.add((*self.steps_for_hole(hole), step))
        return step

    def steps_for_hole(self, hole: Hole) -> tuple[Step, ...]:
        """Return the steps that make a hole, in order. Raises PlanError if the library has no suitable tool."""
        if hole.diameter <= 0:
            self._bare_points += 1
        diameter = hole.diameter if hole.diameter > 0 else self.point_diameter
        key = (round(diameter, 6), hole.layer)
        if key not in self._chosen:
            self._chosen[key] = tuple(Step(tool) for tool in self._tools_for_hole(diameter, hole))
        if self.library is None:
            self._record_size_difference(self._chosen[key][0].tool, diameter)
        return self._chosen[key]

    @property
    def point_diameter(self) -> float:
        """Diameter of holes that are drawn as points, mm.

        If the library contains only one drill, this is its diameter. Otherwise, it is `POINT_DIAMETER`.
        """
        drills = [t for t in self.library.tools if t.kind is ToolKind.DRILL] if self.library else []
        return drills[0].diameter if len(drills) == 1 else POINT_DIAMETER

    def step_for_slot(self, slot: Slot) -> Step:
        """Return the step that cuts a slot. It uses a slot mill that is as wide as the slot.

        Raises PlanError if the library has no such mill.
        """
        if self.library is None:
            assumed = self._assumed_tool(ToolKind.SLOT_MILL, slot.width)
            self._record_size_difference(assumed, slot.width)
            return Step(assumed, slots=True)
        tool = self._nearest_tool(slot.width, ToolKind.SLOT_MILL)
        if tool is None:
            raise PlanError(
                "{}: there is no slot mill of {:g} mm for the slot at ({:g}, {:g}); add one to the library",
                self.library.source,
                slot.width,
                slot.start[0],
                slot.start[1],
            )
        return Step(tool, slots=True)

    def issues(self) -> Iterable[Issue]:
        """Report all assumptions."""
        for tool in self._assumed.values():
            yield Issue(
                "L401",
                Message(
                    "{} is assumed, with {:.6g} mm/min at {:.0f} rpm{}; load it under this number "
                    "and check these values, or give --tools{}",
                    tool.label,
                    tool.feed * 60,
                    tool.spindle_rpm,
                    self._material_note(),
                    self._speed_advice(tool),
                ),
                severity=Severity.WARNING if self._speed_advice(tool) else Severity.NOTE,
            )
            if tool.kind is ToolKind.DRILL and tool.diameter > LARGEST_COMMON_DRILL:
                yield Issue(
                    "L401",
                    Message(
                        "{} is unusually large for a drill; use --max-diameter to leave out circles that you "
                        "do not want to drill",
                        tool.label,
                    ),
                )
            if tool in self._approximated:
                yield self._size_issue(tool, self._approximated[tool])
        for tool in self._with_assumed_feeds.values():
            yield Issue(
                "L401",
                Message(
                    "{}: the tool library states no feeds, so leafcut assumes {:.6g} mm/min at {:.0f} rpm{}; "
                    "check both values{}",
                    tool.label,
                    tool.feed * 60,
                    tool.spindle_rpm,
                    self._material_note(),
                    self._speed_advice(tool),
                ),
                severity=Severity.WARNING if self._speed_advice(tool) else Severity.NOTE,
            )
        if self.library is not None and self.library.left_out:
            unused = self.library.left_out
            more = Message("; and {} more", len(unused) - 1) if len(unused) > 1 else ""
            message = Message("a tool of the library is not used: {}{}", unused[0], more)
            yield Issue("L407", message, severity=Severity.NOTE)
        if self._bare_points:
            yield Issue(
                "L401",
                Message(
                    "{} points have no diameter and are drilled as {:g} mm holes",
                    self._bare_points,
                    self.point_diameter,
                ),
            )

    def _tools_for_hole(self, diameter: float, hole: Hole) -> list[Tool]:
        if self.library is None:
            if self.options.centre_drill:
                raise PlanError("--centre-drill uses the centre drill of a tool library; give --tools")
            return [self._assumed_tool(ToolKind.DRILL, diameter)]
        tools = self._library_tools(diameter, hole)
        if self.options.centre_drill and all(t.kind is not ToolKind.CENTRE_DRILL for t in tools):
            return [self._centre_drill(), *tools]
        return tools

    def _library_tools(self, diameter: float, hole: Hole) -> list[Tool]:
        assert self.library is not None
        tolerance = self.job.diameter_tolerance
        fitting = self.library.recipes_for(diameter, hole.layer, tolerance)
        if fitting:
            # Prefer a recipe for the layer to a recipe for all layers, then the closest diameter.
            best = min(fitting, key=lambda r: (r.layer == "*", abs(r.diameter - diameter)))
            return [self._with_cutting_data(self.library.by_number[number]) for number in best.steps]
        drill = self._nearest_tool(diameter, ToolKind.DRILL)
        if drill is None:
            raise PlanError(self._no_drill_message(diameter, hole))
        return [self._with_cutting_data(drill)]

    def _centre_drill(self) -> Tool:
        assert self.library is not None
        centre_drills = [t for t in self.library.tools if t.kind is ToolKind.CENTRE_DRILL]
        if not centre_drills:
            raise PlanError("{}: --centre-drill needs a centre drill; add one to the library", self.library.source)
        return self._with_cutting_data(centre_drills[0])

    def _with_cutting_data(self, tool: Tool) -> Tool:
        """Return the tool with cutting data. Feed and speed are assumed if the library contains no feeds at all."""
        if self.library is None or not self.library.without_feeds or tool.kind is ToolKind.TAP:
            return tool
        if tool.number not in self._with_assumed_feeds:
            rpm, feed = self._cutting_data(tool)
            self._with_assumed_feeds[tool.number] = replace(tool, spindle_rpm=rpm, feed=tool.feed or feed, assumed=True)
        return self._with_assumed_feeds[tool.number]

    def _nearest_tool(self, diameter: float, kind: ToolKind) -> Tool | None:
        assert self.library is not None
        candidates = [t for t in self.library.tools if t.kind is kind]
        best = min(candidates, key=lambda t: abs(t.diameter - diameter), default=None)
        if best is None or abs(best.diameter - diameter) > self.job.diameter_tolerance + 1e-9:
            return None
        return best

    def _no_drill_message(self, diameter: float, hole: Hole) -> Message:
        assert self.library is not None
        drills = [t.diameter for t in self.library.tools if t.kind is ToolKind.DRILL]
        near = min(drills, key=lambda d: abs(d - diameter), default=None)
        advice = (
            Message("the nearest drill has {:g} mm", near)
            if near is not None
            else Message("the library has no drills at all")
        )
        return Message(
            "{}: there is no drill of {:g} mm for the hole at ({:g}, {:g}) on layer '{}'; {}; add a tool or a "
            "recipe, or raise --diameter-tolerance",
            self.library.source,
            diameter,
            hole.x,
            hole.y,
            hole.layer,
            advice,
        )

    def _assumed_tool(self, kind: ToolKind, diameter: float) -> Tool:
        """Return an assumed tool of the nearest catalogue size. For circuit boards, use exactly the given diameter."""
        if not self._board:
            diameter = catalogue_size(diameter, self.job.diameter_tolerance)
        diameter = max(round(diameter, 4), _RESOLUTION)
        if (kind, diameter) not in self._assumed:
            tool = Tool(
                number=len(self._assumed) + 1,
                diameter=diameter,
                kind=kind,
                point_angle=math.radians(118) if kind is ToolKind.DRILL else math.pi,
                assumed=True,
            )
            rpm, feed = self._cutting_data(tool)
            self._assumed[kind, diameter] = replace(tool, feed=feed, spindle_rpm=rpm)
        return self._assumed[kind, diameter]

    def _record_size_difference(self, tool: Tool, diameter: float) -> None:
        if abs(tool.diameter - diameter) > EQUAL:
            self._approximated.setdefault(tool, []).append(diameter)

    def _size_issue(self, tool: Tool, diameters: list[float]) -> Issue:
        low, high = (f"{diameter:.5g}" for diameter in (min(diameters), max(diameters)))
        targets = count_of(len(diameters), "slot" if tool.kind is ToolKind.SLOT_MILL else "hole")
        return Issue(
            "L401",
            Message(
                "{} makes {} of Ø{}{}, because it is the nearest catalogue size within --diameter-tolerance {:g} mm",
                tool.label,
                targets,
                low,
                "" if low == high else Message(" to {}", high),
                self.job.diameter_tolerance,
            ),
            severity=Severity.NOTE,
        )

    def _cutting_data(self, tool: Tool) -> tuple[float, float]:
        """Return the spindle speed of a tool, rpm, and an assumed feed, mm/s.

        If the speed is unknown, it is assumed as well.
        """
        machine = self.machine
        # A given speed is kept, and refused later if the machine cannot reach it.
        rpm = tool.spindle_rpm or self.job.spindle_speed
        if not rpm:
            careful, highest = (_rpm(speed, tool.diameter) for speed in (SURFACE_SPEED, self._fastest))
            if highest * MAX_SPEED_RATIO < machine.spindle_min_rpm:
                raise PlanError(self._spindle_message(tool, highest))
            if careful > machine.spindle_max_rpm * MAX_SPEED_RATIO:
                raise PlanError(self._spindle_message(tool, careful))
            rpm = float(round(min(max(careful, machine.spindle_min_rpm), machine.spindle_max_rpm)))
        feed = self.job.feed or min(round(FEED_PER_REVOLUTION * tool.diameter * rpm, 1) / 60.0, machine.max_feed)
        return rpm, feed

    def _spindle_message(self, tool: Tool, rpm: float) -> Message:
        machine = self.machine
        needs = Message(
            "{} needs {:.0f} rpm, but the spindle of {} turns {:g} to {:g} rpm",
            tool.label,
            rpm,
            machine.name,
            machine.spindle_min_rpm,
            machine.spindle_max_rpm,
        )
        if rpm > machine.spindle_max_rpm:
            return Message(
                "{}; use a faster spindle, or give the --spindle-speed that your drill and material need", needs
            )
        if tool.kind is ToolKind.SLOT_MILL:
            return Message(
                "{}; mill the slot as a pocket, or give the --spindle-speed that your mill and material need", needs
            )
        return Message("{}; mill the hole, or give the --spindle-speed that your drill and material need", needs)

    def _material_note(self) -> str:
        """Return the end of a message, which names the material for which feeds and speeds are assumed.

        The text is empty if the user gave both feed and speed.
        """
        if self.job.feed and self.job.spindle_speed:
            return ""
        return (
            Message(" (for circuit boards)")
            if self._board
            else Message(" (for high-speed steel in mild steel or aluminium)")
        )

    def _speed_advice(self, tool: Tool) -> str:
        """Return the end of a message, which recommends a speed if the tool turns much too fast.

        Otherwise, the text is empty.
        """
        right = _rpm(self._fastest, tool.diameter)
        lowest = self.machine.spindle_min_rpm
        if tool.spindle_rpm > MAX_SPEED_RATIO * right and not self.job.feed:
            return Message(". The recommended spindle speed is {:.0f} rpm", right)
        if self.job.spindle_speed or tool.spindle_rpm != lowest or lowest <= FAST * right:
            return ""
        return Message(
            ". The recommended spindle speed is {:.0f} rpm, but the minimum speed of the spindle of {} is {:g} rpm",
            right,
            self.machine.name,
            lowest,
        )


def _rpm(surface_speed: float, diameter: float) -> float:
    return 60.0 * surface_speed / (math.pi * diameter)


def catalogue_size(diameter: float, tolerance: float) -> float:
    """Return the size of the drill for a hole, mm.

    This is the catalogue size that equals the diameter. If there is none, it is the nearest size within `tolerance`,
    mm. If there is none either, it is the diameter itself. Number and letter drills are close to metric sizes, so they
    are only used for holes of exactly their size.
    """
    metric, inch = _nearest_metric_size(diameter), round(diameter / MM_PER_INCH * 64.0) / 64.0 * MM_PER_INCH
    numbered = float(_NUMBERED[np.argmin(np.abs(_NUMBERED - diameter))])
    for size in (metric, inch, numbered):
        if size > 0.0 and abs(size - diameter) <= min(EQUAL, tolerance):
            return round(size, 4)
    sizes = [metric]
    if abs(inch - _nearest_metric_size(inch)) > _BESIDE_METRIC:
        sizes.append(inch)
    # Of two equally near sizes, take the smaller: a hole can be opened up.
    away, size = min((round(abs(size - diameter), 6), size) for size in sizes)
    return round(size, 4) if size > 0.0 and away <= tolerance + 1e-9 else diameter


def _nearest_metric_size(diameter: float) -> float:
    steps = next(steps for limit, steps in _METRIC if diameter <= limit)
    sizes = {round(count * step, 4) for step in steps for count in (int(diameter / step), int(diameter / step) + 1)}
    return min((round(abs(size - diameter), 6), size) for size in sizes)[1]
