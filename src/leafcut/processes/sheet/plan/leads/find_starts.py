"""Where each cut may begin: places along its contour, and every way to begin there."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from leafcut.errors import PlanError
from leafcut.processes.sheet.plan.cut_contours import ROUNDING, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    apart_along,
    away_from_corners,
    directions_of,
    end_of,
    in_loop,
    scrap_left,
    travel_at,
    ways_of,
    with_leads,
)
from leafcut.processes.sheet.plan.leads.edge_starts import edge_starts
from leafcut.processes.sheet.plan.leads.leads import Scrap, lead_shape, placed

#: Starts are tried at so many places of a contour, at such distances (mm), and with so many on all contours together.
PLACES, NEAREST, FARTHEST, MOST_PLACES, FEWEST_PLACES = 16, 10.0, 100.0, 32, 4
MOST_NODES = 20_000


def find_starts(contours: list[CutContour], scrap: Scrap, rules: CutRules) -> list[CutStart]:
    """Return every start of every contour, contour by contour.

    Raises
    ------
    PlanError
        Contours have no room for a lead anywhere: says which, and where.
    """
    most = max(FEWEST_PLACES, min(MOST_PLACES, MOST_NODES // max(len(contours), 1)))
    found: list[CutStart] = []
    stuck: list[CutContour] = []
    for number, contour in enumerate(contours):
        starts = starts_of(number, contour, scrap, rules, most)
        found += starts
        if not starts:
            stuck.append(contour)
    if stuck:
        names = "; ".join(c.name() for c in stuck[:3]) + (f" and {len(stuck) - 3} more" if len(stuck) > 3 else "")
        if rules.edge_start:
            raise PlanError(
                f"the sheet is above the pierce capacity: cuts start at its edge, and no cut from there reaches "
                f"{names}; drill a hole there first and give --pierce-delay, or nest it nearer to the edge"
            )
        # The controller cannot turn its compensation on without a lead.
        instead = "--compensation geometry" if rules.compensation == "controller" else "--lead-in none"
        if not (rules.common_lines or rules.once) and any(_has_common_edge(one, contours, rules) for one in stuck[:3]):
            instead = "cut edges that lie a kerf apart once (--common-lines), nested by leafcut nest --blocks"
        if rules.common_lines:
            instead = "nest the parts in blocks with room around them (leafcut nest --blocks)"
        raise PlanError(
            f"no lead fits into the scrap at {names}; give a shorter --lead-in-length, {instead}, or more room "
            "between the parts"
        )
    return found


def _has_common_edge(one: CutContour, contours: list[CutContour], rules: CutRules) -> bool:
    """Return whether the kerf of another outline runs along its own, so that one cut would do for both."""
    near = one.line.buffer(ROUNDING)
    others = (other for other in contours if other is not one and other.has_leads and not other.hole)
    return not one.hole and any(near.intersection(other.line).length > 2.0 * rules.kerf for other in others)


def starts_of(number: int, contour: CutContour, scrap: Scrap, rules: CutRules, most: int) -> list[CutStart]:
    """Return the starts of one contour; none where there is no room for any lead."""
    path, rules = contour.path, contour.rules_of(rules)
    if not contour.has_leads:
        # Where the torch cannot pierce, an open cut has no lead along which it could come from the sheet's edge.
        pierces = contour.kind == "cut" and not rules.data.can_pierce
        return [] if pierces else _plain_starts(number, contour, rules, most)
    places = start_places(contour, rules, most)
    if rules.edge_start and not contour.hole:
        return edge_starts(number, contour, scrap, rules, places)
    if rules.edge_start:
        return []
    if rules.lead_in.style == "none":
        return [
            CutStart(number, at, way, path.point_at(at), path.point_at(end_of(contour, at, way, rules)))
            for at in places
            for way in directions_of(contour, rules)
        ]
    for finer in (1, 4):
        dense = places if finer == 1 else _smooth(contour, _even_places(path.length, 4 * len(places)), rules)
        for splash in (True, False) if rules.kerf > 0.0 else (False,):
            left_over = [(at, way) for way in directions_of(contour, rules) for at in dense]
            starts = with_leads(number, contour, scrap, rules, left_over, ways_of(contour, rules), splash)
            if starts:
                return starts
    return []


def _plain_starts(number: int, contour: CutContour, rules: CutRules, most: int) -> list[CutStart]:
    """Return the starts of a mark or of an open cut, which have no leads."""
    path = contour.path
    if not path.closed:
        return list(_open_starts(number, contour))
    places = start_places(contour, rules, most)
    return [CutStart(number, at, False, path.point_at(at), path.point_at(at)) for at in places]


def _open_starts(number: int, contour: CutContour) -> Iterator[CutStart]:
    """Yield the starts of an open cut, from either end where it can begin there."""
    path = contour.path
    ends = ((0.0, False, path.start, path.end), (path.length, True, path.end, path.start))
    for (at, backward, here, there), lead in zip(ends, contour.inlets, strict=True):
        if lead is not None:
            travel = np.array([travel_at(path, at, backward)])
            left = scrap_left(contour, backward)
            x, y = placed(lead_shape(lead), np.array([here]), travel, left)[0, 0].tolist()
            yield CutStart(number, at, backward, (x, y), there, lead)


def start_places(contour: CutContour, rules: CutRules, most: int) -> list[float]:
    """Return places along a closed contour, mm: its corners and places between."""
    length = contour.path.length
    pitch = min(max(length / PLACES, NEAREST), FARTHEST)
    count = min(max(math.ceil(length / pitch), FEWEST_PLACES), most)
    corners = [at for at in contour.corners if not in_loop(contour, at, rules) and rules.compensation != "controller"]
    if len(corners) > most:
        corners = corners[:: math.ceil(len(corners) / most)]
    even = [at for at in _even_places(length, count) if not in_loop(contour, at, rules)]
    if rules.compensation == "controller":
        return _smooth(contour, even, rules)
    near = 0.25 * length / count
    return sorted(corners + [at for at in even if all(apart_along(at, c, length) > near for c in corners)])


def _smooth(contour: CutContour, places: list[float], rules: CutRules) -> list[float]:
    """Return the places where a cut can begin: for a controller that compensates, those that are no corners."""
    if rules.compensation != "controller":
        return places
    return [at for at in places if away_from_corners(contour, at, rules)]


def _even_places(length: float, count: int) -> list[float]:
    # Half a step from where the drawing begins, which often is a corner.
    return [length * (k + 0.5) / count for k in range(count)]
