"""Collect the edges to break, and check that the V-bit cuts nothing but their chamfers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import shapely

from leafcut.errors import PlanError
from leafcut.model.tool import Tool
from leafcut.processes.part.model import Chamfer, Edge, PocketArea, TabRules
from leafcut.processes.part.operations import LayeredPart
from leafcut.processes.part.plan.chamfers import chamfer_path, v_bit
from leafcut.processes.part.plan.finishing import ring_of
from leafcut.processes.part.plan.holes import PlannedHole
from leafcut.processes.part.plan.outlines import OutlineCut


def chamfers_of(
    divided: LayeredPart,
    edges: Sequence[Edge],
    cuts: Sequence[OutlineCut],
    drilled: Sequence[PlannedHole],
    faces: Sequence[PocketArea],
    radius: float,
    tools: Mapping[int, Tool],
    tabs: TabRules,
    thickness: float,
) -> list[Chamfer]:
    """Return the chamfers of all milled edges and drilled holes whose layers ask for one.

    An edge that is not milled, because it is too narrow for the end mill, has no chamfer either. `faces` contains the
    pockets and the carved shapes. `radius` is the radius of the end mill, mm.

    Raises
    ------
    PlanError
        A chamfer is wider than the V-bit, deeper than its flutes, or so deep that it goes through the plate or into the
        tabs. Or the part is too narrow for the chamfer, or another edge is too close.
    """
    milled = {cut.edge for cut in cuts}
    works = [(edge.path, edge.inside, radius, edge.name, edge.layer) for k, edge in enumerate(edges) if k in milled] + [
        (hole.outline, True, 0.0, hole.name, hole.layer) for hole in drilled
    ]
    chamfers = []
    for path, inside, corner, name, layer in works:
        rule = divided.rules.get(layer)
        if rule is not None and rule.chamfer is not None:
            bit = v_bit(tools[rule.chamfer.tool or 0])
            chamfers.append(Chamfer(path, inside, corner, rule.chamfer.depth, bit, name, layer))
    _check_chamfers(chamfers, edges, drilled, faces, tools, tabs, thickness)
    return chamfers


def _check_chamfers(
    chamfers: Sequence[Chamfer],
    edges: Sequence[Edge],
    drilled: Sequence[PlannedHole],
    faces: Sequence[PocketArea],
    tools: Mapping[int, Tool],
    tabs: TabRules,
    thickness: float,
) -> None:
    walls = [(edge.name, ring_of(edge.path)) for edge in edges]
    walls += [(hole.name, ring_of(hole.outline)) for hole in drilled]
    walls += [(area.name, ring_of(path)) for area in faces for path in (area.outline, *area.islands)]
    width_of = {chamfer.name: chamfer.width for chamfer in chamfers}
    deepest = thickness - tabs.height if tabs.count else thickness
    for chamfer in chamfers:
        tool, width, depth = tools[chamfer.bit.tool], chamfer.width, chamfer.depth
        if chamfer.bit.tip + width > chamfer.bit.radius + 1e-9:
            raise PlanError(
                "{}: a chamfer of {:g} mm is too wide for {}; use a wider V-bit", chamfer.name, width, tool.label
            )
        if depth > tool.reach + 1e-9:
            raise PlanError(
                "{}: {} cuts {:g} mm deep at most, but {:.3g} mm are needed",
                chamfer.name,
                tool.label,
                tool.reach,
                depth,
            )
        if depth >= deepest:
            raise PlanError(
                "{}: a chamfer of {:g} mm is {:.3g} mm deep with {}, and would cut into the tabs or through the plate; "
                "give a smaller width, or use a V-bit with a larger angle",
                chamfer.name,
                width,
                depth,
                tool.label,
            )
        ring = ring_of(chamfer_path(chamfer))
        if not chamfer.inside and shapely.Polygon(ring_of(chamfer.path)).buffer(-width).geom_type != "Polygon":
            raise PlanError("{} is too narrow for a chamfer of {:g} mm on both sides", chamfer.name, width)
        for name, wall in walls:
            room = chamfer.bit.tip + width + width_of.get(name, 0.0)
            if name != chamfer.name and shapely.dwithin(ring, wall, room):
                raise PlanError(
                    "{}: a chamfer of {:g} mm would cut into {}, {:.3g} mm away; give a smaller width",
                    chamfer.name,
                    width,
                    name,
                    float(shapely.distance(ring_of(chamfer.path), wall)),
                )
