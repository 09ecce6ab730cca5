"""The cost of a milled plate and of its parts, for a quote."""

from __future__ import annotations

import math
from collections.abc import Sequence

import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.model.quote import PartCost, RunCost, cost_of_time
from leafcut.options import SpeedOptions
from leafcut.processes.part.model import Edge, PartRequest, material_of
from leafcut.processes.plan import Plan
from leafcut.processes.quoting import density_of, no_part, weight


def plate_cost(plan: Plan, seconds: float) -> RunCost:
    """Return the time and the cost of a run, and of each copy of the drawing. A run mills a plate in each fixture.

    Parameters
    ----------
    seconds
        Machine time of the program, s.

    Raises
    ------
    PlanError
        The drawing has no closed outline.
    """
    settings, request = plan.job.settings, plan.spec
    outlines = sum(not edge.inside for edge in request.edges)
    if not outlines:
        raise no_part(plan.part.name)
    grid, plates = plan.work.copies, len(plan.work.work_offsets)
    copies = grid.number if grid else 1
    # The edges of the first copy come first.
    edges = request.edges[: len(request.edges) // copies]
    material = settings.job.material
    cost = cost_of_time(settings.of(SpeedOptions).shop_rate or 0.0, seconds) + plates * plan.work.plate_price
    part = PartCost(
        name=plan.part.name,
        per_run=plates * copies,
        time_s=seconds / (plates * copies),
        cost=cost / (plates * copies),
        weight_kg=weight(_volume(plan) / copies, density_of(settings, material)),
        outlines=outlines // copies,
        lighter=bool(request.engravings or request.chamfers or request.carvings or request.isolations),
        edges=tuple(edge.path for edge in edges),
        lines=_lines_inside(request, edges),
    )
    return RunCost(seconds, cost, (part,), material, request.thickness, stock_price=plan.work.plate_price)


def _volume(plan: Plan) -> float:
    """Return the volume of all parts, mm³: the plate inside their edges without drilled holes and pockets."""
    request = plan.spec
    material = material_of(request.edges)
    holes = [
        shapely.Point(x, y).buffer(0.5 * group.tool.diameter, quad_segs=64)
        for group in plan.work.groups
        for x, y in group.places.tolist()
    ]
    material = material.difference(shapely.union_all(holes))
    pockets = math.fsum(area.region.intersection(material).area * area.depth for area in request.pockets)
    return float(material.area * request.thickness - pockets)


def _lines_inside(request: PartRequest, edges: Sequence[Edge]) -> tuple[Polyline, ...]:
    boxes = [edge.path.extents for edge in edges]
    x0, y0, x1, y1 = (pick(box[k] for box in boxes) for k, pick in enumerate((min, min, max, max)))
    areas = [*request.pockets, *(carving.area for carving in request.carvings)]
    lines = [one.path for one in request.engravings]
    lines += [path for area in areas for path in (area.outline, *area.islands)]
    box = shapely.box(x0, y0, x1, y1)
    return tuple(path for path in lines if box.intersects(shapely.Point(path.vertices[0, :2])))
