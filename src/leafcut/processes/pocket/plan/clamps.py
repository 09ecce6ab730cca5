"""Pockets beside clamps: whether mill, shank and holder have room there, before any path is planned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import shapely

from leafcut.errors import PlanError
from leafcut.geometry.regions import tool_centres
from leafcut.model.cutter import discs_of
from leafcut.model.pocket import Pocket, PocketRules
from leafcut.model.tool import Tool
from leafcut.processes.pocket.plan.region import pocket_region
from leafcut.processes.zones import crossing_heights, parse_zones

#: Less than this is left to the proof of the program, which knows the path, mm.
ROUNDING = 0.05


def refuse_clamps(
    pockets: Sequence[Pocket],
    floors: Sequence[float],
    rules: PocketRules,
    tool: Tool,
    keep_out: Sequence[str],
    clearance: float,
) -> None:
    """Refuse a pocket whose walls cannot be milled without meeting a keep-out zone.

    Parameters
    ----------
    floors, clearance
        Heights of the floors in the program, and of zones without a height, mm.

    Raises
    ------
    PlanError
        Names the pocket, the zone, and the missing length or distance.
    """
    zones: Any = [shapely.box(*zone) for zone in parse_zones(keep_out)]
    heights = crossing_heights(keep_out, clearance).tolist()
    for pocket, floor in zip(pockets, floors, strict=True) if zones else ():
        centres = tool_centres(pocket_region(pocket, rules.tolerance), rules.radius + rules.stock, rules.tolerance)
        if centres.is_empty:
            continue
        for text, zone, height in zip(keep_out, zones, heights, strict=True):
            away = float(shapely.distance(centres, zone)) + ROUNDING
            if away < rules.radius:
                raise PlanError(
                    f"{pocket.label} is in the keep-out zone '{text}', or closer to it than the radius of "
                    f"{tool.label}; move the clamp, or change --keep-out"
                )
            meets = [disc for disc in discs_of(tool) if disc.radius > away and floor + disc.above < height]
            if meets:
                lowest = min(meets, key=lambda disc: disc.above)
                farther = math.ceil(height - floor - lowest.above)
                apart = math.ceil(max(disc.radius for disc in meets) - away)
                raise PlanError(
                    f"{pocket.label}: the {lowest.body} of {tool.label} meets the keep-out zone '{text}', "
                    f"{away:.3g} mm beside the tool's path; let the mill stick out {farther} mm farther, move the "
                    f"clamp {apart} mm away, or use a lower one"
                )
