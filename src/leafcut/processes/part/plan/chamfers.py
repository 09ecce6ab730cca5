"""Chamfers: the tip of a V-bit follows the edge as the mill leaves it, with round inner corners."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.offset import offset_closed_path
from leafcut.geometry.polyline import Polyline
from leafcut.model.tool import Tool
from leafcut.processes.part.model import Chamfer, Edge, Engraving, VBit
from leafcut.processes.part.plan.engraving import EngravingTask
from leafcut.processes.part.plan.finishing import TOLERANCE, index_of_areas, ring_of


def v_bit(tool: Tool) -> VBit:
    """Return the dimensions of a V-bit from the tool library."""
    return VBit(tool.number, 0.5 * tool.diameter, 0.5 * tool.tip_diameter, math.tan(0.5 * tool.point_angle))


def chamfer_path(chamfer: Chamfer) -> Polyline:
    """Return the path of the tip, which runs on the waste side, counter-clockwise.

    The flat of the tip touches the edge, so the bevel ends exactly there.

    Raises
    ------
    PlanError
        The mill or the V-bit does not fit everywhere.
    """
    sign = -1.0 if chamfer.inside else 1.0
    milled = [ring for ring in offset_closed_path(chamfer.path, sign * chamfer.corner, TOLERANCE) if ring.area > 0.0]
    rings = (
        offset_closed_path(milled[0], sign * (chamfer.bit.tip - chamfer.corner), TOLERANCE) if len(milled) == 1 else []
    )
    rings = [ring for ring in rings if ring.area > 0.0]
    if len(rings) != 1:
        raise PlanError("{}: too narrow for its mill or for the tip of T{} in places", chamfer.name, chamfer.bit.tool)
    return rings[0]


def chamfer_tasks(chamfers: Sequence[Chamfer], edges: Sequence[Edge], step: float, climb: bool) -> list[EngravingTask]:
    """Create the chamfer tasks of one V-bit. Each pass is at most `step` mm deep."""
    areas = index_of_areas(edges)
    tasks = []
    for one in chamfers:
        path = chamfer_path(one)
        path = path if climb == one.inside else path.reversed()
        later = np.sort(areas.query(ring_of(one.path), predicate="intersects")).tolist()
        groove = Engraving(path, one.depth, one.bit.tool, one.name, one.layer)
        tasks.append(EngravingTask(groove, max(math.ceil(one.depth / step - 1e-9), 1), tuple(later)))
    return tasks
