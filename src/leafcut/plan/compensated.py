"""Paths for a controller that keeps half a kerf away by itself (G41, G42): what it is told, from what it shall do.

The middle of the kerf runs half a kerf beside what is programmed, on the side of the scrap. So the contour is
programmed as it is drawn, and the arc of the lead with half a kerf more radius about the same middle. The compensation
is taken up on the straight run-in before it: LinuxCNC leads the torch along the tangent to the circle of half a kerf
about the run-in's end, and the torch starts on that tangent.
"""

from __future__ import annotations

import math

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline, joined
from leafcut.plan.cut_contours import FLATNESS, ROUNDING, CutContour, flat_line
from leafcut.plan.cut_rules import CutRules
from leafcut.plan.cut_starts import CutStart, overcut_of, scrap_left, travel_at
from leafcut.plan.leads import lead_path


def check_hollows(contours: list[CutContour], rules: CutRules) -> None:
    """Refuse hollows rounder than the kerf: a controller stops there, with the torch on.

    Raises
    ------
    PlanError
        The first such hollow.
    """
    for contour in contours:
        if not contour.has_leads:
            continue
        side = 1.0 if contour.hole else -1.0
        drawn = _drawn(contour)
        for s in drawn.segments():
            if s.is_arc and s.bulge * side > 0.0 and s.radius < rules.half * 1.05:
                raise PlanError(
                    f"{contour.name()} has a hollow of radius {s.radius:.3g} mm at ({s.start[0]:.5g}, "
                    f"{s.start[1]:.5g}), too tight for a controller that compensates a kerf of {rules.kerf:g} mm; use "
                    "--compensation geometry"
                )


def _drawn(contour: CutContour) -> Polyline:
    path = contour.source.contour.path
    return path if path.area >= 0.0 else path.reversed()


def programmed_path(contour: CutContour, start: CutStart, rules: CutRules) -> tuple[Polyline, float]:
    """Return what the controller is told, and how long its lead-in is, mm.

    Raises
    ------
    PlanError
        The start does not lie beside the drawn contour.
    """
    import shapely

    left = scrap_left(contour, start.clockwise)
    here, travel = contour.path.point_at(start.at), travel_at(contour.path, start.at, start.clockwise)
    side = 1.0 if left else -1.0
    on = (here[0] + side * travel[1] * rules.half, here[1] - side * travel[0] * rules.half)
    drawn = _drawn(contour)
    line = flat_line(drawn)
    point = shapely.Point(*on)
    if shapely.distance(point, line) > ROUNDING + FLATNESS:
        raise PlanError(f"{contour.name()}: the controller's compensation cannot begin at ({on[0]:.5g}, {on[1]:.5g})")
    at = float(shapely.line_locate_point(line, point, normalized=True)) * drawn.length
    length = drawn.length + overcut_of(contour, rules)
    body = drawn.piece(at, at + length)
    if start.clockwise:
        body = drawn.reversed().piece(drawn.length - at, drawn.length - at + length)
    wanted = lead_path(start.lead_in, here, travel, left)
    if wanted is None:
        return body, 0.0
    lead = _wider(wanted, start.lead_in.length / start.lead_in.angle, rules.half, side, travel, here, body.start)
    return joined(lead, body), lead.length


def _wider(
    lead: Polyline,
    radius: float,
    half: float,
    side: float,
    travel: tuple[float, float],
    here: tuple[float, float],
    on: tuple[float, float],
) -> Polyline:
    """Return run-in and arc as they are programmed: the same middle, half a kerf more radius, the same first point."""
    center = (here[0] - side * travel[1] * radius, here[1] + side * travel[0] * radius)
    x, y = lead.vertices[1, :2].tolist()
    scale = (radius + half) / math.hypot(x - center[0], y - center[1])
    corner = (center[0] + scale * (x - center[0]), center[1] + scale * (y - center[1]))
    rows = [[*lead.start, 0.0], [*corner, float(lead.vertices[1, 2])], [*on, 0.0]]
    return Polyline(np.array(rows))
