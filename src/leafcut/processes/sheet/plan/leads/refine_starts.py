"""Starts slide along their contours until no ways between cuts get shorter: the order stays.

For a fixed order the shortest way that visits the contours is a shortest polyline with a vertex on each; one vertex is
moved at a time, between the one before and the one after it, until nothing is gained.
Source: A. A. Petunin, E. G. Polishchuk and S. S. Ukolov, on the continuous cutting problem (routes of a fixed order).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from leafcut.geometry.arrays import Point
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.cutting import Cutting, route_length
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    away_from_corners,
    end_of,
    fitting_lead_out,
    from_centre,
    in_loop,
    lead_ins_fit,
    scrap_left,
    travel_at,
)
from leafcut.processes.sheet.plan.leads.leads import lead_shape, placed
from leafcut.timing.travel import Travel

#: A start moves by this at least, mm, and at first by this part of its contour.
FINEST, FIRST_PART = 0.25, 1.0 / 16.0
#: Rounds over all cuts at most; they end when one gains less than this part of all ways.
ROUNDS, LEAST_GAIN = 12, 1e-5
#: A gain below this is rounding, s or mm.
ROUNDING = 1e-9


def slide_starts(
    cutting: Cutting,
    order: list[CutStart],
    travel: Travel,
    start: Point | None,
    end: Point | None,
    late: Callable[[], bool] = lambda: False,
) -> list[CutStart]:
    """Return the same cuts in the same order, with starts that make the ways between them cheaper by `travel`.

    Leads keep their shape and stay where there is room for them. What a plan file fixes stays where it is. When it is
    `late`, the starts that have not moved yet stay.
    """
    order = list(order)
    settled: dict[int, tuple[Point | None, Point | None]] = {}
    for _ in range(ROUNDS):
        gained = 0.0
        for k, here in enumerate(order):
            if late():
                return order
            before = order[k - 1].exit if k else start
            after = order[k + 1].entry if k + 1 < len(order) else end
            if settled.get(k) == (before, after):
                continue  # nothing around it has moved since it was looked at
            moved, gain = _slid(cutting, here, travel, before, after)
            settled[k] = (before, after)
            order[k] = moved
            gained += gain
        if gained <= LEAST_GAIN * route_length(start, order, travel):
            break
    return order


def _slid(
    cutting: Cutting, start: CutStart, travel: Travel, before: Point | None, after: Point | None
) -> tuple[CutStart, float]:
    """Return a start moved to where the ways to it and from it are cheapest, and what that gained."""
    contour = cutting.contours[start.contour]
    if start.then or not contour.path.closed or not start.pierce or "start" in cutting.fixed.get(start.contour, ()):
        return start, 0.0

    def cost(s: CutStart) -> float:
        come = travel(before, s.entry) if before is not None else 0.0
        return come + (travel(s.exit, after) if after is not None else 0.0)

    first = now = cost(start)
    step = FIRST_PART * contour.path.length
    while step >= FINEST:
        for way in (step, -step):
            place = (start.at + way) % contour.path.length
            moved = start_at(cutting, start, place, lambda s, limit=now: cost(s) < limit - ROUNDING)  # type: ignore[misc]
            if moved is not None:
                start, now = moved, cost(moved)
                break
        else:
            step *= 0.5
    return start, first - now


def start_at(
    cutting: Cutting, like: CutStart, at: float, wanted: Callable[[CutStart], bool] = lambda _: True
) -> CutStart | None:
    """Return a start at another place of its contour with the same leads; None where they do not fit there.

    `wanted` is asked before it is looked whether they fit, since that takes longer.
    """
    contour, scrap = cutting.contours[like.contour], cutting.scrap
    rules = contour.rules_of(cutting.rules)
    path, clockwise = contour.path, like.clockwise
    if in_loop(contour, at, rules) or (
        rules.compensation == "controller" and not away_from_corners(contour, at, rules)
    ):
        return None
    here, travel = np.array([path.point_at(at)]), np.array([travel_at(path, at, clockwise)])
    lead = like.lead_in
    if _is_from_centre(contour, like, rules):
        lead = from_centre(contour, here, travel, [(at, clockwise)])[0]
    left = scrap_left(contour, clockwise) if contour.has_leads else True
    x, y = placed(lead_shape(lead), here, travel, left)[0, 0].tolist()
    end = end_of(contour, at, clockwise, rules)
    moved = replace(like, at=at, lead_in=lead, entry=(x, y), exit=path.point_at(end))
    if like.lead_out.style != "none":
        out = np.array([moved.exit]), np.array([travel_at(path, end, clockwise)])
        u, v = placed(lead_shape(like.lead_out), *out, left, out=True)[0, -1].tolist()
        moved = replace(moved, exit=(u, v))
    if not wanted(moved):
        return None
    if like.lead_in.style != "none" and contour.has_leads:
        clear = bool(rules.kerf > 0.0 and scrap.clear(np.array([like.entry]), rules.kerf)[0])
        if not lead_ins_fit(contour, scrap, [lead], here, travel, [(at, clockwise)], clear)[0]:
            return None
    if like.lead_out.style == "none":
        return moved
    fitting, _ = fitting_lead_out(contour, scrap, rules, at, clockwise, like.lead_out)
    return moved if fitting == like.lead_out else None


def _is_from_centre(contour: CutContour, start: CutStart, rules: CutRules) -> bool:
    """Return whether the lead-in comes from the middle of a small hole, and so changes with the place."""
    if not contour.is_small(rules) or start.lead_in.style != "line":
        return False
    place = [(start.at, start.clockwise)]
    here = np.array([contour.path.point_at(start.at)])
    travel = np.array([travel_at(contour.path, start.at, start.clockwise)])
    middle = from_centre(contour, here, travel, place)[0]
    return abs(middle.length - start.lead_in.length) < 1e-6 and abs(middle.angle - start.lead_in.angle) < 1e-6
