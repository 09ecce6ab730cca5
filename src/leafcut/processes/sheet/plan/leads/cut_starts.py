"""How a cut begins: direction, leads for which there is room, and how it ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Lead
from leafcut.model.kinds import CutMethod
from leafcut.processes.sheet.plan.cut_contours import NO_LEAD, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.leads import Scrap, as_lines, lead_shape, placed, ways_to_lead

#: When a contour has so many starts, or this share of its places, no lesser lead is tried.
ENOUGH, ENOUGH_SHARE = 8, 0.25
#: No cut begins as near to a loop round a corner as this, mm.
BESIDE_LOOP = 1.0
#: Directions at a place are the mean of those so far before and behind it, mm: at a corner, half-way.
AROUND = 0.01


@dataclass(frozen=True)
class CutStart:
    """One way to begin a cut: a node of its cluster.

    Attributes
    ----------
    contour
        Position in the list of contours.
    at
        Along the contour's path, mm; of an open one 0, or its length to run it backward.
    clockwise
        Of a closed one; of an open one, True runs it backward.
    entry, exit
        Where the torch goes on, and where the next rapid begins.
    pierce
        False: it starts in the air, beyond the sheet's edge.
    then
        The other contours of its chain, in order, each begun and left on its own path.
    """

    contour: int
    at: float
    clockwise: bool
    entry: Point
    exit: Point
    lead_in: Lead = NO_LEAD
    lead_out: Lead = NO_LEAD
    pierce: bool = True
    then: tuple[CutStart, ...] = ()

    @property
    def contours(self) -> tuple[int, ...]:
        """Positions of all the contours that are cut in this run, in order."""
        return (self.contour, *(s.contour for s in self.then))


def overcut_of(contour: CutContour, rules: CutRules) -> float:
    """Return how far a contour is cut past its beginning, mm."""
    if not contour.has_leads or (joints_wanted(contour, rules) and rules.kind != CutMethod.LASER):
        return 0.0
    return rules.hole_overcut if contour.hole else rules.overcut


def joints_wanted(contour: CutContour, rules: CutRules) -> int:
    """Return how many micro-joints a contour is to have."""
    if not contour.has_leads or contour.hole or contour.is_small(rules):
        return 0
    return rules.joints


def lead_out_of(contour: CutContour, rules: CutRules) -> Lead:
    """Return the lead-out that a contour should have."""
    ends_on_contour = rules.torch_off_in_overcut and overcut_of(contour, rules) > 0.0
    ends_at_joint = joints_wanted(contour, rules) and rules.kind != CutMethod.LASER
    if ends_on_contour or ends_at_joint or contour.is_small(rules) or (contour.hole and not rules.hole_lead_out):
        return NO_LEAD
    return rules.lead_out


def directions_of(contour: CutContour, rules: CutRules) -> tuple[bool, ...]:
    """Return whether a contour may be cut clockwise, counter-clockwise, or either way."""
    wanted = rules.direction_of(contour.hole)
    return {"clockwise": (True,), "counter-clockwise": (False,), "free": (False, True)}[wanted]


def scrap_left(contour: CutContour, clockwise: bool) -> bool:
    """Return whether the scrap is to the left of travel."""
    return contour.hole != clockwise


def travel_at(path: Polyline, at: float, clockwise: bool) -> Point:
    """Return the direction of travel at a place, unit vector; at a corner, half-way."""
    (x0, y0), (x1, y1) = path.direction_at(at - AROUND), path.direction_at(at + AROUND)
    x, y = x0 + x1, y0 + y1
    length = math.hypot(x, y)
    if length < 1e-9:
        (x, y), length = (x1, y1), 1.0
    sign = -1.0 if clockwise else 1.0
    return sign * x / length, sign * y / length


def away_from_corners(contour: CutContour, at: float, rules: CutRules) -> bool:
    """Return whether the contour is smooth around a place, so that a controller may begin there."""
    return all(apart_along(at, corner, contour.path.length) > 2.0 * rules.kerf for corner in contour.corners)


def apart_along(a: float, b: float, length: float) -> float:
    """Return how far two places of a closed path of that length are apart along it, mm."""
    return min((a - b) % length, (b - a) % length)


def in_loop(contour: CutContour, at: float, rules: CutRules) -> bool:
    """Return whether a place of the path is in a loop round a corner, or so near that the joint at the cut's end is.

    What is left of a contour at its end must be on its edge: in a loop, the corner's arc would be left, too.
    """
    length, room = contour.path.length, BESIDE_LOOP + closing_joint(contour, rules)
    return any((at - begin + room) % length <= end - begin + 2.0 * room for begin, end in contour.loops)


def end_of(contour: CutContour, at: float, clockwise: bool, rules: CutRules) -> float:
    """Return where along the path a cut that begins at `at` leaves it, mm."""
    past = overcut_of(contour, rules) - closing_joint(contour, rules)
    return at - past if clockwise else at + past


def closing_joint(contour: CutContour, rules: CutRules) -> float:
    """Return how much of the path stays uncut at the end of a cut, mm; the kerf's round ends take half a kerf each."""
    if not joints_wanted(contour, rules) or rules.kind == CutMethod.LASER:
        return 0.0
    return min(rules.joint_width + rules.kerf, 0.25 * contour.path.length)


def ways_of(contour: CutContour, rules: CutRules) -> list[Lead | None]:
    """Return the leads to be tried, the wanted one first; None stands for one from the middle of a hole.

    That is the first for a small hole, and the last where no other fits into a hole.
    """
    ways = ways_to_lead(rules.lead_in, rules.kerf)
    if not contour.hole or rules.lead_in.run_in > 0.0:
        return [*ways]
    return [None, *ways] if contour.is_small(rules) else [*ways, None]


def with_leads(
    number: int,
    contour: CutContour,
    scrap: Scrap,
    rules: CutRules,
    left_over: list[tuple[float, bool]],
    ways: list[Lead | None],
    splash: bool,
) -> list[CutStart]:
    """Return the starts where a lead fits: the first of `ways` where enough places have room for it.

    `left_over` are the places to try: along the path in mm, and whether clockwise. `splash`: with room round the
    pierce, too.
    """
    path = contour.path
    enough = min(max(ENOUGH, math.ceil(ENOUGH_SHARE * len(left_over))), len(left_over))
    starts: list[CutStart] = []
    for way in ways:
        at = np.array([path.point_at(a) for a, _ in left_over])
        travel = np.array([travel_at(path, a, clockwise) for a, clockwise in left_over])
        leads = [way] * len(left_over) if way else from_centre(contour, at, travel, left_over)
        fits = lead_ins_fit(contour, scrap, leads, at, travel, left_over, splash)
        starts += [
            _start(number, contour, scrap, rules, place, lead)
            for place, lead, fit in zip(left_over, leads, fits, strict=True)
            if fit
        ]
        left_over = [place for place, fit in zip(left_over, fits, strict=True) if not fit]
        if len(starts) >= enough or not left_over:
            break
    return starts


def from_centre(contour: CutContour, at: Points, travel: Points, places: list[tuple[float, bool]]) -> list[Lead]:
    """Return straight leads from the middle of a small hole."""
    middle = shapely.Polygon(contour.line.coords).centroid
    leads = []
    for (x, y), (tx, ty), (_, clockwise) in zip(at.tolist(), travel.tolist(), places, strict=True):
        dx, dy = middle.x - x, middle.y - y
        sign = 1.0 if scrap_left(contour, clockwise) else -1.0
        angle = math.atan2(sign * (tx * dy - ty * dx), -(tx * dx + ty * dy))
        leads.append(Lead("line", math.hypot(dx, dy), angle))
    return leads


def lead_ins_fit(
    contour: CutContour,
    scrap: Scrap,
    leads: list[Lead],
    at: Points,
    travel: Points,
    places: list[tuple[float, bool]],
    splash: bool,
) -> NDArray[np.bool_]:
    """Return which lead-ins have room, bool[n]; `splash`: round their pierces too."""
    fits = np.zeros(len(leads), dtype=bool)
    groups: dict[tuple[Lead, bool], list[int]] = {}
    for k, (lead, (_, clockwise)) in enumerate(zip(leads, places, strict=True)):
        groups.setdefault((lead, clockwise), []).append(k)
    shapes, rows = [], []
    for (lead, clockwise), group in groups.items():
        if lead.length > 0.0 and 0.0 < lead.angle < math.pi:
            shapes.append(placed(lead_shape(lead), at[group], travel[group], scrap_left(contour, clockwise)))
            rows.append(group)
    by_size: dict[int, list[int]] = {}
    for k, shape in enumerate(shapes):
        by_size.setdefault(shape.shape[1], []).append(k)
    for members in by_size.values():
        points = np.concatenate([shapes[k] for k in members])
        row = np.concatenate([rows[k] for k in members])
        ok = scrap.free(as_lines(points), contour)
        ok &= scrap.leaves_once(points, contour)
        if splash:
            ok &= scrap.clear(points[:, 0], scrap.rules.kerf)
        fits[row] = ok
    return fits


def _start(
    number: int, contour: CutContour, scrap: Scrap, rules: CutRules, place: tuple[float, bool], lead: Lead
) -> CutStart:
    """Return the start with this lead-in and the longest lead-out for which there is room."""
    at, clockwise = place
    path, left = contour.path, scrap_left(contour, clockwise)
    travel = travel_at(path, at, clockwise)
    entry = placed(lead_shape(lead), np.array([path.point_at(at)]), np.array([travel]), left)[0, 0]
    out, leave = fitting_lead_out(contour, scrap, rules, at, clockwise)
    return CutStart(number, at, clockwise, (float(entry[0]), float(entry[1])), leave, lead, out)


def fitting_lead_out(
    contour: CutContour, scrap: Scrap, rules: CutRules, at: float, clockwise: bool, wanted: Lead | None = None
) -> tuple[Lead, Point]:
    """Return the lead-out that fits where a cut ends, if need be a shorter one or none, and where it ends."""
    path = contour.path
    wanted = lead_out_of(contour, rules) if wanted is None else wanted
    end = end_of(contour, at, clockwise, rules)
    here = path.point_at(end)
    if wanted.style == "none":
        return NO_LEAD, here
    travel = np.array([travel_at(path, end, clockwise)])
    for share in (1.0, 0.5, 0.25):
        out = replace(wanted, length=share * wanted.length)
        points = placed(lead_shape(out), np.array([here]), travel, scrap_left(contour, clockwise), out=True)
        if scrap.free(as_lines(points), contour)[0] and scrap.leaves_once(points[:, ::-1], contour)[0]:
            x, y = points[0, -1].tolist()
            return out, (x, y)
    return NO_LEAD, here
