"""The cost of a sheet and of its parts, for a quote."""

from __future__ import annotations

import math

from leafcut.model.cutting import CutPlan, PartTimes
from leafcut.model.quote import PartCost, RunCost
from leafcut.options import Settings
from leafcut.processes.quoting import density_of, no_part, part_label, weight
from leafcut.processes.sheet.report.norms import part_kinds


def sheet_cost(plan: CutPlan, settings: Settings) -> RunCost:
    """Return the time and the cost of a sheet, and of each kind of part on it.

    Raises PlanError if the sheet has no parts, for example because it is only marked.
    """
    kinds = [own for own in part_kinds(plan.measures) if own[0].area > 0.0]
    if not kinds:
        raise no_part(plan.sheet.name)
    density = density_of(settings, plan.data.material)
    parts = tuple(_part_cost(plan, own, density, alone=len(kinds) == 1) for own in kinds)
    measures, data = plan.measures, plan.data
    return RunCost(
        measures.sheet.total_s, measures.cost, parts, data.material, data.thickness, stock_price=plan.sheet.price
    )


def _part_cost(plan: CutPlan, own: list[PartTimes], density: float, *, alone: bool) -> PartCost:
    """Return the mean time, cost and weight of equal parts. If they are `alone`, the drawing gives their name."""
    number, mine = len(own), [c for c in plan.sheet.contours if c.part == own[0].part and not c.chamber]
    return PartCost(
        name=own[0].name or (plan.sheet.name if alone else part_label(own[0].part)),
        per_run=number,
        time_s=math.fsum(part.times.total_s for part in own) / number,
        cost=math.fsum(part.cost for part in own) / number,
        weight_kg=weight(math.fsum(part.area for part in own) / number * plan.data.thickness, density),
        edges=tuple(c.path for c in mine if c.kind == "cut" and c.path.closed),
        lines=tuple(c.path for c in mine if c.kind == "mark" or not c.path.closed),
    )
