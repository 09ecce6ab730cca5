"""How a chain begins and ends: its lead-in at the first contour, its lead-out at the last, clear of its bridges."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points
from leafcut.model.cutting import Lead
from leafcut.processes.sheet.plan.cut_contours import NO_LEAD, ROUNDING, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    end_of,
    fitting_lead_out,
    lead_out_of,
    scrap_left,
    travel_at,
    ways_of,
    with_leads,
)
from leafcut.processes.sheet.plan.leads.edge_starts import edge_starts
from leafcut.processes.sheet.plan.leads.find_starts import starts_of
from leafcut.processes.sheet.plan.leads.leads import Scrap, lead_shape, placed

if TYPE_CHECKING:
    from leafcut.processes.sheet.plan.cutting import Cutting

#: Places along a contour that differ by less are one, mm.
SAME = 0.01
#: So many ways to begin a chain are offered to the search.
MOST_STARTS = 4
#: Where the room of a contour has changed, so many places are tried.
PLACES = 16


@dataclass(frozen=True)
class Link:
    """A place of a chain: the contour (position in `Cutting.contours`), along its path, arrival and leave, mm."""

    contour: int
    at: float
    arrive: tuple[float, float]
    leave: tuple[float, float]
    clockwise: bool = True


Chain = tuple[Link, ...]


def chain_starts(cutting: Cutting, chain: Chain, scrap: Scrap) -> list[CutStart]:
    """Return the ways to begin a chain; none where no lead-in has room beside its bridges."""
    rules, contours = cutting.rules, cutting.contours
    ways = [shapely.LineString([a.leave, b.arrive]) for a, b in itertools.pairwise(chain)]
    rest = [CutStart(link.contour, link.at, link.clockwise, link.arrive, link.leave) for link in chain]
    last = _ended(contours[chain[-1].contour], rest[-1], scrap, rules, ways[-1])
    found = []
    own = [cutting.starts[n] for n in cutting.by_contour[chain[0].contour]]
    fixed = chain[0].contour in cutting.fixed
    begun = own if fixed else _begun(contours[chain[0].contour], rest[0], scrap, rules)
    for first in begun:
        if abs(first.at - rest[0].at) > SAME or first.clockwise != rest[0].clockwise:
            continue
        lead = _lead_points(contours[first.contour], first, first.lead_in)
        if len(lead) < 2 or not first.pierce or clear_of(lead[::-1], ways[0], rules.kerf):
            found.append(replace(first, exit=last.exit, lead_out=NO_LEAD, then=(*rest[1:-1], last)))
    return found[:MOST_STARTS]


def _begun(contour: CutContour, step: CutStart, scrap: Scrap, rules: CutRules) -> list[CutStart]:
    """Return the starts of a contour at one place, with every lead that has room there."""
    place = [(step.at, step.clockwise)]
    if rules.edge_start:
        return [s for s in edge_starts(step.contour, contour, scrap, rules, [step.at]) if s.clockwise == step.clockwise]
    if rules.lead_in.style == "none":
        return [step]
    found: list[CutStart] = []
    for splash in (True, False) if rules.kerf > 0.0 else (False,):
        for way in ways_of(contour, rules):
            found += with_leads(step.contour, contour, scrap, rules, place, [way], splash)
        if len(found) >= MOST_STARTS:
            break
    return list(dict.fromkeys(found))


def _ended(contour: CutContour, step: CutStart, scrap: Scrap, rules: CutRules, way: Any) -> CutStart:
    """Return the last step of a chain with the longest lead-out for which there is room beside its bridge."""
    end = contour.path.point_at(end_of(contour, step.at, step.clockwise, rules))
    wanted = lead_out_of(contour, rules)
    for share in (1.0, 0.5, 0.25) if wanted.style != "none" else ():
        lead = replace(wanted, length=share * wanted.length)
        out, leave = fitting_lead_out(contour, scrap, rules, step.at, step.clockwise, lead)
        moved = replace(step, exit=leave, lead_out=out)
        if out.style != "none" and clear_of(_lead_points(contour, moved, out, rules), way, rules.kerf):
            return moved
    return replace(step, exit=end, lead_out=NO_LEAD)


def _lead_points(contour: CutContour, start: CutStart, lead: Lead, out: CutRules | None = None) -> Points:
    """Return the points of a start's lead-in; with the rules, of its lead-out: float64[k, 2], in travel."""
    at = start.at if out is None else end_of(contour, start.at, start.clockwise, out)
    here, travel = np.array([contour.path.point_at(at)]), np.array([travel_at(contour.path, at, start.clockwise)])
    points: Points = placed(lead_shape(lead), here, travel, scrap_left(contour, start.clockwise), out is not None)[0]
    return points


def clear_of(lead: Points, bridge: Any, kerf: float) -> bool:
    """Return whether a lead, float64[k, 2] from its contour on, leaves the kerf of a bridge and stays away from it."""
    line = shapely.LineString(lead)
    count = max(math.ceil(line.length / max(0.25 * kerf, 0.01)), 2)
    points = shapely.line_interpolate_point(line, np.linspace(0.0, line.length, count + 1))
    apart = shapely.distance(points, bridge) >= kerf - ROUNDING
    return bool((apart | ~np.maximum.accumulate(apart)).all() and apart[-1])


def starts_beside(cutting: Cutting, number: int, scrap: Scrap) -> list[CutStart]:
    """Return the starts of a contour that is in no chain whose leads keep away from all bridges."""
    own = [cutting.starts[n] for n in cutting.by_contour[number]]
    contour = cutting.contours[number]
    if contour.kind != "cut":
        return own
    kept = [s for s in own if _free(contour, s, scrap, cutting.rules)]
    return kept or starts_of(number, contour, scrap, cutting.rules, PLACES)


def _free(contour: CutContour, start: CutStart, scrap: Scrap, rules: CutRules) -> bool:
    lines = lead_lines(contour, start, rules)
    return not lines or bool(scrap.free(lines, contour, leaves_sheet=not start.pierce).all())


def lead_lines(contour: CutContour, start: CutStart, rules: CutRules) -> list[Any]:
    """Return the leads of a start that is in no chain, as shapely lines."""
    if not contour.path.closed and start.lead_in.length:
        return [shapely.LineString(_lead_points(contour, start, start.lead_in))]
    if not contour.has_leads:
        return []
    leads: Sequence[Points] = (
        _lead_points(contour, start, start.lead_in),
        _lead_points(contour, start, start.lead_out, rules),
    )
    return [shapely.LineString(points) for points in leads if len(points) > 1]
