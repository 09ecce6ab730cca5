"""Paths for a controller that keeps half a kerf away by itself (G41, G42): what it is told, from what it shall do.

The middle of the kerf runs half a kerf beside what is programmed, on the side of the scrap. So the contour is
programmed as it is drawn, and the arc of the lead with half a kerf more radius about the same middle. The compensation
is taken up on the straight run-in before it: LinuxCNC leads the torch along the tangent to the circle of half a kerf
about the run-in's end, and the torch starts on that tangent.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline, joined
from leafcut.model.issue import Issue, Severity
from leafcut.processes.sheet.plan.cut_contours import CORNER, FLATNESS, ROUNDING, CutContour, corner_turns, flat_line
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    overcut_of,
    scrap_left,
    travel_at,
)
from leafcut.processes.sheet.plan.leads.find_starts import FEWEST_PLACES, starts_of
from leafcut.processes.sheet.plan.leads.leads import Scrap, lead_path

#: Beside a hollow corner neither line nor arc is shorter than so many kerfs, or the controller's path crosses itself.
SHORTEST_KERFS = 2.0
#: A hollow's radius is at least so many half kerfs, or a controller does not get through.
TIGHTEST = 1.05


def by_path_where_needed(
    contours: list[CutContour], scrap: Scrap, rules: CutRules
) -> tuple[list[CutContour], list[Issue]]:
    """Return the contours, those compensated by the program that a controller could not: and a note on them.

    That is where there is no room for a run-in and an arc, as in a small hole, and where a hollow is rounder, or a
    notch narrower, than the kerf: there a controller stops, with the torch on, or cuts into the part.
    """
    made = [
        replace(c, by_path=c.has_leads and not _suits_the_controller(k, c, scrap, rules))
        for k, c in enumerate(contours)
    ]
    own = [c for c in made if c.by_path]
    if not own:
        return made, []
    names = ", ".join(c.name() for c in own[:3]) + (" …" if len(own) > 3 else "")
    words = "1 contour is" if len(own) == 1 else f"{len(own)} contours are"
    words += f" compensated by the program for a kerf of {rules.kerf:g} mm: no room for a controller's lead-in, or a "
    words += "hollow that is too tight for it"
    return made, [Issue("L626", words, names, Severity.NOTE)]


def _suits_the_controller(number: int, contour: CutContour, scrap: Scrap, rules: CutRules) -> bool:
    side = 1.0 if contour.hole else -1.0
    arcs = [s for s in _drawn(contour).segments() if s.is_arc and s.bulge * side > 0.0]
    if contour.pinched or any(s.radius < rules.half * TIGHTEST for s in arcs):
        return False
    hollow = side * np.asarray(corner_turns(_drawn(contour))) > CORNER
    lengths = _drawn(contour).lengths
    if (hollow & (np.minimum(lengths, np.roll(lengths, 1)) < SHORTEST_KERFS * rules.kerf)).any():
        return False
    return bool(starts_of(number, contour, scrap, rules, FEWEST_PLACES))


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
    left = scrap_left(contour, start.clockwise)
    here, travel = contour.path.point_at(start.at), travel_at(contour.path, start.at, start.clockwise)
    side = 1.0 if left else -1.0
    on = (here[0] + side * travel[1] * rules.half, here[1] - side * travel[0] * rules.half)
    drawn = _drawn(contour)
    line = flat_line(drawn)
    point = shapely.Point(*on)
    if shapely.distance(point, line) > ROUNDING + FLATNESS:
        raise PlanError(f"{contour.name()}: the controller's compensation cannot start at ({on[0]:.5g}, {on[1]:.5g})")
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
