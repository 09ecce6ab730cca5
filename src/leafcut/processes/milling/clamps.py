"""Clamps on the table, defined as keep-out zones. A job is refused if the mill would hit a clamp."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import shapely

from leafcut.errors import PlanError
from leafcut.model.cutter import wide_discs_above_flutes
from leafcut.model.tool import Tool
from leafcut.processes.zones import crossing_heights, parse_zones

#: Maximum overlap with a zone that is ignored here, mm. The verification checks it later against the exact path.
ROUNDING = 0.05


class Clamp(NamedTuple):
    """A clamp, with the text of its zone, its area, and the minimum height at which a tool can cross it, mm."""

    text: str
    area: shapely.Polygon
    height: float


def parse_clamps(keep_out: Sequence[str], clearance: float) -> list[Clamp]:
    """Parse the clamps of ``--keep-out``. A zone without its own height gets the height `clearance`, mm."""
    areas = [shapely.box(*zone) for zone in parse_zones(keep_out).tolist()]
    return [*map(Clamp, keep_out, areas, crossing_heights(keep_out, clearance).tolist())]


def refuse_clamp_collisions(
    name: str, centres: shapely.Geometry, floor: float, tool: Tool, radius: float, clamps: Sequence[Clamp]
) -> None:
    """Raise PlanError if a tool, its shank or its holder would hit a clamp.

    The message names the work and the zone. It also gives the tool length or the distance that is missing.

    Parameters
    ----------
    name
        Name of the work for the message.
    centres
        Area or path of the tool centre.
    floor
        Lowest height of the tool tip, mm.
    radius
        Radius of the flutes, mm.
    """
    for clamp in clamps:
        away = float(shapely.distance(centres, clamp.area)) + ROUNDING
        if away < radius:
            raise PlanError(
                "{} is in the keep-out zone '{}', or closer to it than the radius of "
                "{}; move the clamp, or change --keep-out",
                name,
                clamp.text,
                tool.label,
            )
        hits = [
            disc for disc in wide_discs_above_flutes(tool) if disc.radius > away and floor + disc.above < clamp.height
        ]
        if hits:
            lowest = min(hits, key=lambda disc: disc.above)
            farther = math.ceil(clamp.height - floor - lowest.above)
            apart = math.ceil(max(disc.radius for disc in hits) - away)
            raise PlanError(
                "{}: the {} of {} hits the keep-out zone '{}', {:.3g} mm beside the tool path; let the mill "
                "stick out {} mm farther, move the clamp {} mm away, or use a lower clamp",
                name,
                lowest.body,
                tool.label,
                clamp.text,
                away,
                farther,
                apart,
            )
