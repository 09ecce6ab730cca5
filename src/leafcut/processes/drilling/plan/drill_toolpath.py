"""The routing problems of drilling operations, and the toolpath for their solutions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import touches_any_zone
from leafcut.message import Message
from leafcut.model.machine import Machine
from leafcut.model.plan import Stage
from leafcut.model.problem import Metric, Relief, RoutingProblem
from leafcut.model.tool import Tool
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.processes.drilling.plan.drilling import DrillOperation, DrillPlan
from leafcut.processes.spindle_moves import end_program, move_to_tool_change, take_tool
from leafcut.timing.travel import travel_heights, travel_metric

_SAME_HEIGHT = 1e-6


def build_stages(
    plan: DrillPlan,
    machine: Machine,
    objective: Literal["time", "distance"],
    first_nodes: Mapping[int, NDArray[np.int32]],
) -> tuple[Stage, ...]:
    """Return a search stage for each operation. Each stage starts where the previous stage ends.

    `first_nodes` lists the nodes that must be visited first, in order, keyed by the index of the operation.
    """
    height = 0.0 if plan.always_initial else plan.clearance_height - plan.retract_height
    stages = []
    for number, operation in enumerate(plan.operations):
        if plan.reliefs:
            metric = travel_metric(machine, objective, relief=plan.reliefs[number])
        else:
            zones = plan.high_zones_for(operation.tool)
            metric = travel_metric(machine, objective, zones=zones, lift_height_mm=height)
        last = number == len(plan.operations) - 1
        problem = build_problem(plan, operation, metric, None if number else plan.start, plan.end if last else None)
        nodes = first_nodes.get(number, np.zeros(0, dtype=np.int32))
        stages.append(
            Stage(problem, number > 0, drawing_order(operation), Message("ordering {}", operation.tool.label), nodes)
        )
    return tuple(stages)


def build_problem(
    plan: DrillPlan, operation: DrillOperation, metric: Metric, start: Point | None, end: Point | None
) -> RoutingProblem:
    """Build the routing problem for an operation.

    A hole is a cluster with one node. A slot is a cluster with two nodes, one for each direction: node 2k cuts slot k
    from start to end, and node 2k + 1 cuts it from end to start.
    """
    name = f"{plan.part.name}: {operation.tool.label}"
    if not operation.slots:
        # Rounded to 1e-6 mm, so that the same drawing in inches and mm gives the same tour.
        holes = plan.part.hole_xy[operation.targets].round(6)
        return RoutingProblem.of_points(holes, metric, start=start, end=end, name=name)
    slots = [plan.part.slots[t] for t in operation.targets]
    starts = np.array([s.start for s in slots], dtype=np.float64).reshape(-1, 2)
    ends = np.array([s.end for s in slots], dtype=np.float64).reshape(-1, 2)
    entry = np.stack([starts, ends], axis=1).reshape(-1, 2)
    exits = np.stack([ends, starts], axis=1).reshape(-1, 2)
    cluster = np.repeat(np.arange(len(slots), dtype=np.int32), 2)
    return RoutingProblem(entry, exits, cluster, np.zeros(len(entry)), metric, start=start, end=end, name=name)


def drawing_order(operation: DrillOperation) -> NDArray[np.int32]:
    """Return the nodes in file order. Slots are cut in the direction in which they are drawn."""
    return np.arange(len(operation.targets), dtype=np.int32) * (2 if operation.slots else 1)


def targets_in_order(operation: DrillOperation, nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the indices of the part's holes or slots, in the order of `nodes`."""
    return operation.targets[nodes // 2 if operation.slots else nodes]


def generate_toolpath(
    plan: DrillPlan,
    machine: Machine,
    orders: Sequence[NDArray[np.int32]],
    *,
    coolant: bool = False,
    pause: bool = False,
) -> Toolpath:
    """Generate the motion of the whole program. `orders` contains an array of nodes for each operation.

    Between holes, the tool travels at the R plane (G99) or at the initial plane (G98, `always_initial`). If a keep-out
    zone is in the way, the tool first retracts with a separate rapid. A single G98 would not be safe: if G98 follows
    G99 in a series of cycles, LinuxCNC 2.9 rises diagonally, unlike other controllers. With `pause`, the program waits
    (M0) after every tool change, because the M6 of some controllers does not wait.
    """
    builder = ToolpathBuilder()
    if machine.safe_z is not None:
        builder.machine(z=machine.safe_z)
    for number, (operation, nodes) in enumerate(zip(plan.operations, orders, strict=True)):
        if number:
            move_to_tool_change(builder, machine, max(plan.clearance_height, plan.tool_change_height), coolant=coolant)
        take_tool(builder, machine, operation.tool, plan.clearance_height, coolant=coolant, pause=pause)
        if operation.slots:
            _cut_slots(builder, plan, machine, operation, nodes)
        else:
            _drill_holes(builder, plan, machine, operation, nodes, plan.reliefs[number] if plan.reliefs else None)
    end_program(builder, machine, plan.clearance_height, plan.end, coolant=coolant)
    return builder.build()


def with_high_travel(plan: DrillPlan) -> DrillPlan:
    """Return the same plan, but with all travel moves above the highest point of the surface."""
    operations = tuple(
        replace(operation, cycle=replace(operation.cycle, to_initial=True)) for operation in plan.operations
    )
    return replace(plan, operations=operations, always_initial=True, reliefs=())


def surface_tops(plan: DrillPlan, drawn: bool) -> NDArray[np.float64] | None:
    """Return x, y and the height of the surface at each hole, float64[n, 3], mm, or None for a plate.

    The heights come from the plan. If `drawn` is set, or the part is a solid, they come from the drawing instead.
    """
    if drawn or plan.part.has_hole_depths:
        return np.array([(hole.x, hole.y, hole.z) for hole in plan.part.holes], dtype=np.float64).reshape(-1, 3)
    return None if plan.work_surface is None else np.column_stack([plan.part.hole_xy, plan.tops])


def _drill_holes(
    builder: ToolpathBuilder,
    plan: DrillPlan,
    machine: Machine,
    operation: DrillOperation,
    nodes: NDArray[np.int32],
    relief: Relief | None,
) -> None:
    targets = targets_in_order(operation, nodes)
    offsets = (operation.bottoms(plan.tops, plan.deeper) - operation.cycle.bottom)[nodes]
    xy, bottoms = plan.part.hole_xy[targets], offsets.round(9).tolist()
    heights = _travel_heights(plan, machine, operation, xy, relief)
    for k, (x, y) in enumerate(xy.tolist()):
        if k == 0:
            _approach(builder, plan, x, y)
        elif heights[k] > float(builder.position[2]) + _SAME_HEIGHT:
            builder.rapid(z=heights[k])
            builder.rapid(x, y)
        r_plane = float(plan.r_planes[targets[k]])
        builder.drill(x, y, _shifted_cycle(operation.cycle, r_plane, bottoms[k]), feed=operation.tool.feed)
    builder.rapid(z=plan.clearance_height)


def _travel_heights(
    plan: DrillPlan, machine: Machine, operation: DrillOperation, xy: NDArray[np.float64], relief: Relief | None
) -> list[float]:
    """Return the minimum height of the travel move to each hole, mm.

    The height is −∞ if the move may be at any height.
    """
    heights = np.full(len(xy), -np.inf)
    dogleg = machine.rapid_style == "dogleg"
    if relief is not None:
        # Rounded up to the written precision, so that the move is never too low.
        heights[1:] = np.ceil(travel_heights(relief, xy.round(6), dogleg) * 1000.0 - 1e-6) / 1000.0
    elif len(plan.zones) and not plan.always_initial:
        lifted = touches_any_zone(xy[:-1], xy[1:], plan.high_zones_for(operation.tool), dogleg=dogleg)
        heights[1:][lifted] = plan.clearance_height
    values: list[float] = heights.tolist()
    return values


def _shifted_cycle(cycle: DrillCycle, r_plane: float, lower: float) -> DrillCycle:
    """Change the R plane of a cycle, and move its bottom up by `lower` mm (down if negative)."""
    if r_plane == cycle.r_plane and not lower:
        return cycle
    return replace(cycle, r_plane=r_plane, bottom=round(cycle.bottom + lower, 6))


def _cut_slots(
    builder: ToolpathBuilder, plan: DrillPlan, machine: Machine, operation: DrillOperation, nodes: NDArray[np.int32]
) -> None:
    cycle, feed = operation.cycle, operation.tool.feed
    zones, dogleg = plan.high_zones_for(operation.tool), machine.rapid_style == "dogleg"
    position: Point | None = None
    for node in nodes.tolist():
        slot = plan.part.slots[int(operation.targets[node // 2])]
        (x0, y0), (x1, y1) = (slot.start, slot.end) if node % 2 == 0 else (slot.end, slot.start)
        if position is None:
            _approach(builder, plan, x0, y0)
        else:
            crosses_zone = bool(touches_any_zone([position], [(x0, y0)], zones, dogleg=dogleg)[0])
            builder.rapid(z=plan.clearance_height if crosses_zone or plan.always_initial else plan.retract_height)
            builder.rapid(x0, y0)
        if builder.position[2] != plan.retract_height:
            builder.rapid(z=plan.retract_height)
        for number, depth in enumerate(slot_depths(cycle, operation.tool)):
            builder.feed(z=depth, feed=feed)
            builder.feed(*((x1, y1) if number % 2 == 0 else (x0, y0)), feed=feed)
        position = (x1, y1)
    builder.rapid(z=plan.clearance_height)


def slot_depths(cycle: DrillCycle, tool: Tool) -> list[float]:
    """Return the heights of the passes of a slot, mm, from the first pass to the bottom.

    A pass is at most one peck deep. If there is no peck, it is at most one diameter deep, which is the usual limit for
    a slot mill. The number of passes is odd, so that the last pass ends at the end of the slot.
    """
    step = tool.peck or tool.diameter
    passes = max(1, math.ceil(-cycle.bottom / step - 1e-9))
    passes += 1 - passes % 2
    return [cycle.bottom * number / passes for number in range(1, passes)] + [cycle.bottom]


def _approach(builder: ToolpathBuilder, plan: DrillPlan, x: float, y: float) -> None:
    """Move above the first position without descending, and then descend to the clearance height."""
    builder.rapid(x, y)
    if builder.position[2] != plan.clearance_height:
        builder.rapid(z=plan.clearance_height)
