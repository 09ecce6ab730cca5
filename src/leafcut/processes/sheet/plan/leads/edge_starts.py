"""Starts in the air beyond the sheet's edge: for sheets too thick to pierce."""

from __future__ import annotations

import math

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.model.cutting import Lead
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    directions_of,
    fitting_lead_out,
    scrap_left,
    travel_at,
)
from leafcut.processes.sheet.plan.leads.leads import Scrap, as_lines

#: The torch goes on so far outside the sheet, besides half a kerf, mm.
IN_THE_AIR = 5.0
#: Leads come in along the axes, as an operator would lay them.
WAYS = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))


def edge_starts(number: int, contour: CutContour, scrap: Scrap, rules: CutRules, places: list[float]) -> list[CutStart]:
    """Return the starts of an outline whose lead-in comes straight from beyond the sheet's edge.

    Raises
    ------
    PlanError
        Nobody has said where the sheet ends.
    """
    if scrap.sheet is None:
        raise PlanError(
            f"{rules.data.thickness:g} mm is above the pierce capacity: cuts start at the sheet's edge, but its size "
            "is not known; give --sheet-size, or --pierce-delay to pierce all the same"
        )
    low_x, low_y, high_x, high_y = scrap.sheet.bounds
    reach = 2.0 * math.hypot(high_x - low_x, high_y - low_y)
    starts = []
    for at in places:
        x, y = contour.path.point_at(at)
        for dx, dy in WAYS:
            ray = shapely.LineString([(x, y), (x + reach * dx, y + reach * dy)])
            pieces = shapely.get_parts(shapely.intersection(ray, scrap.sheet))
            inside = sum(shapely.length(p) for p in pieces if shapely.distance(p, shapely.Point(x, y)) < 1e-6)
            length = inside + IN_THE_AIR + 0.5 * rules.kerf
            entry = (x + length * dx, y + length * dy)
            points = np.array([[entry, (x, y)]])
            lines = as_lines(points)
            if len(pieces) > 1 or not (
                scrap.free(lines, contour, leaves_sheet=True)[0] and scrap.leaves_once(points, contour)[0]
            ):
                continue
            for clockwise in directions_of(contour, rules):
                tx, ty = travel_at(contour.path, at, clockwise)
                sign = 1.0 if scrap_left(contour, clockwise) else -1.0
                angle = math.atan2(sign * (tx * dy - ty * dx), -(tx * dx + ty * dy))
                if 0.0 < angle < math.pi:
                    out, leave = fitting_lead_out(contour, scrap, rules, at, clockwise)
                    lead = Lead("line", length, angle)
                    starts.append(CutStart(number, at, clockwise, entry, leave, lead, out, pierce=False))
    return starts
