"""Drilling: holes and slots become operations, one per tool, in an order with the fewest tool changes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError
from leafcut.model.issue import Issue
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.model.tool import Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import DrillCycle
from leafcut.options import DrillOptions
from leafcut.plan.depths import DepthRule, depth_rule
from leafcut.plan.tooling import Step, ToolChooser


@dataclass(frozen=True, eq=False)
class DrillOperation:
    """One tool's work: the cycle it runs at every target.

    `targets` are indices, int32[k], into the part's holes, or into its slots when `slots`.
    """

    tool: Tool
    cycle: DrillCycle
    targets: NDArray[np.int32]
    slots: bool = False


@dataclass(frozen=True, eq=False)
class DrillPlan:
    """Operations in the order of machining, and what they have in common (mm).

    `zones` is float64[k, 4]: rectangles that are crossed at the clearance height only.
    """

    part: Part
    operations: tuple[DrillOperation, ...]
    clearance_height: float
    retract_height: float
    always_initial: bool
    zones: NDArray[np.float64]
    start: tuple[float, float] | None
    end: tuple[float, float] | None
    issues: tuple[Issue, ...]

    @property
    def tools(self) -> tuple[Tool, ...]:
        """The tools in the order of their use, each once."""
        return tuple({o.tool.number: o.tool for o in self.operations}.values())


def plan_drilling(part: Part, machine: Machine, library: ToolLibrary | None, options: DrillOptions) -> DrillPlan:
    """Return the operations that make every hole and slot of `part`.

    Holes that need several tools (centre drill, drill, tap) meet them in their recipe's order, every tool is taken up
    once where the recipes allow it, and the tools follow each other by kind and then by diameter.

    Raises
    ------
    PlanError
        No tool fits a hole, a hole is deeper than its tool can go, or the recipes contradict each other.
    """
    if not part.holes and not part.slots:
        raise PlanError(f"{part.name}: there is no hole to drill")
    if options.retract_height > options.clearance_height:
        raise PlanError(
            f"--retract-height {options.retract_height:g} mm is above --clearance-height "
            f"{options.clearance_height:g} mm; the R plane must not be higher than the initial plane"
        )
    rule = depth_rule(options)
    chooser = ToolChooser(library, machine, options)
    work = _collect(part, chooser)
    groups = _order_tools(list(work), chooser.chains)
    operations = tuple(_operation(step, work[step], rule, options) for step in groups)
    _check_speeds(operations, machine)
    return DrillPlan(
        part=part,
        operations=operations,
        clearance_height=options.clearance_height,
        retract_height=options.retract_height,
        always_initial=options.retract == "initial",
        zones=parse_zones(options.keep_out),
        start=_xy(options.start_point),
        end=_xy(options.end_point),
        issues=(*rule.issues, *chooser.issues()),
    )


def _collect(part: Part, chooser: ToolChooser) -> dict[Step, list[int]]:
    """Return the targets of every step (tool, for a slot or not), in the order of the drawing."""
    work: dict[Step, list[int]] = {}
    for index, hole in enumerate(part.holes):
        for step in chooser.steps_for_hole(hole):
            work.setdefault(step, []).append(index)
    for index, slot in enumerate(part.slots):
        work.setdefault(chooser.step_for_slot(slot), []).append(index)
    return work


_KIND_ORDER = {kind: place for place, kind in enumerate(ToolKind)}


def _order_tools(steps: list[Step], chains: Sequence[Sequence[Step]]) -> list[Step]:
    """Return the steps so that each stands after those that its holes need before it: each tool is taken up once.

    Among the free ones: by kind (centre drills first), then by diameter.
    """
    before: dict[Step, set[Step]] = {step: set() for step in steps}
    for chain in chains:
        for k, step in enumerate(chain):
            before[step].update(chain[:k])
    order: list[Step] = []
    left = sorted(steps, key=lambda s: (s.slots, _KIND_ORDER[s.tool.kind], s.tool.diameter, s.tool.number))
    while left:
        free = next((s for s in left if not before[s] - set(order)), None)
        if free is None:
            names = ", ".join(s.tool.label for s in left)
            raise PlanError(f"the recipes contradict each other: {names} each come before another; change a recipe")
        order.append(free)
        left.remove(free)
    return order


def _operation(step: Step, targets: list[int], rule: DepthRule, options: DrillOptions) -> DrillOperation:
    tool = step.tool
    bottom = -rule.tip_depth(tool)
    if tool.flute_length is not None and -bottom > tool.flute_length + 1e-9:
        raise PlanError(
            f"{tool.label} cuts {tool.flute_length:g} mm deep at most, but the hole needs {-bottom:.3g} mm; "
            "use a longer tool or a smaller --depth"
        )
    cycle = DrillCycle(
        name=_cycle_name(tool, options),
        r_plane=options.retract_height,
        bottom=bottom,
        to_initial=options.retract == "initial",
        peck=_first(tool.peck, options.peck if tool.kind is ToolKind.DRILL else None),
        dwell=_first(tool.dwell, options.dwell if tool.kind is ToolKind.DRILL else None),
    )
    return DrillOperation(tool, _consistent(cycle, tool), np.array(targets, dtype=np.int32), step.slots)


def _first(*values: float | None) -> float:
    return next((v for v in values if v is not None), 0.0)


def _cycle_name(tool: Tool, options: DrillOptions) -> str:
    if tool.cycle:
        return tool.cycle
    if tool.kind is ToolKind.TAP:
        return "G84"
    if tool.kind is ToolKind.REAMER:
        return "G85"
    if tool.kind is not ToolKind.DRILL:
        return "G82" if tool.dwell else "G81"
    if options.cycle:
        return options.cycle
    if _first(tool.peck, options.peck):
        return "G83"
    return "G82" if _first(tool.dwell, options.dwell) else "G81"


def _consistent(cycle: DrillCycle, tool: Tool) -> DrillCycle:
    """Return the cycle with only the words that it has, or say what is missing."""
    if cycle.name in ("G83", "G73") and not cycle.peck:
        raise PlanError(f"{tool.label}: {cycle.name} needs the depth of a peck; give --peck, or peck in the library")
    if cycle.name == "G82" and not cycle.dwell:
        raise PlanError(f"{tool.label}: G82 needs a dwell; give --dwell, or dwell in the library")
    if cycle.name == "G84" and tool.kind is not ToolKind.TAP:
        raise PlanError(f"{tool.label}: G84 taps a thread, and this tool is no tap; give another --cycle")
    return DrillCycle(
        name=cycle.name,
        r_plane=cycle.r_plane,
        bottom=cycle.bottom,
        to_initial=cycle.to_initial,
        peck=cycle.peck if cycle.name in ("G83", "G73") else 0.0,
        dwell=cycle.dwell if cycle.name in ("G82", "G84") else 0.0,
    )


def _check_speeds(operations: tuple[DrillOperation, ...], machine: Machine) -> None:
    for tool in (o.tool for o in operations):
        if not machine.spindle_min_rpm <= tool.spindle_rpm <= machine.spindle_max_rpm:
            raise PlanError(
                f"{tool.label} wants {tool.spindle_rpm:g} rpm, but the spindle of {machine.name} turns "
                f"{machine.spindle_min_rpm:g} to {machine.spindle_max_rpm:g} rpm"
            )
        if tool.feed > machine.max_feed * (1 + 1e-9):
            raise PlanError(
                f"{tool.label} wants {tool.feed * 60:g} mm/min, but {machine.name} feeds at most "
                f"{machine.max_feed * 60:g} mm/min"
            )


def parse_zones(rectangles: Sequence[str]) -> NDArray[np.float64]:
    """Return float64[k, 4] of texts "x0 y0 x1 y1" in mm, corners in any order.

    Raises
    ------
    OptionError
        A text is not four finite numbers.
    """
    rows = []
    for text in rectangles:
        try:
            x0, y0, x1, y1 = (float(word) for word in text.split())
        except ValueError:
            raise OptionError(f"--keep-out: '{text}' is not a rectangle such as '0 0 40 25'") from None
        if not all(math.isfinite(v) for v in (x0, y0, x1, y1)):
            raise OptionError(f"--keep-out: '{text}' has a number that is not finite")
        rows.append((min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)))
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _xy(point: tuple[float, ...] | None) -> tuple[float, float] | None:
    return None if point is None else (point[0], point[1])
