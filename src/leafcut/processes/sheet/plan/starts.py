"""The possible starts of cuts: positions on the contours, directions, and leads that fit into the scrap."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point, Points
from leafcut.message import Message
from leafcut.model.cutting import Lead
from leafcut.processes.sheet.plan.contours import ROUNDING, CutContour, distance_on_closed_path
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads import NO_LEAD, lead_shape, lead_variants, leads_as_lines, place_leads
from leafcut.processes.sheet.plan.scrap import Scrap

#: Shorter leads are tried until a contour has this number of starts, and this share of its positions has a start.
ENOUGH, ENOUGH_SHARE = 8, 0.25
#: Start positions per contour: default number; minimum and maximum spacing, mm; maximum and minimum number.
PLACES, NEAREST, FARTHEST, MOST_PLACES, FEWEST_PLACES = 16, 10.0, 100.0, 32, 4
#: Maximum number of start positions on the sheet.
MOST_NODES = 20_000
#: Distance from the edge of the sheet to a start beyond it, mm. Half a kerf is added.
IN_THE_AIR = 5.0
#: Directions of leads that come in from the edge of the sheet. They follow the axes, as an operator would draw them.
AXES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))

#: A position along a path, mm, and the direction of travel, which is True for clockwise.
Place = tuple[float, bool]


@dataclass(frozen=True)
class CutStart:
    """A possible start of a cut, with its position, direction and leads.

    Attributes
    ----------
    at
        Start position along the contour, mm. An open contour starts at 0, or at its full length if it is cut in reverse
        (`clockwise`).
    entry
        Point at which the torch is switched on.
    exit
        Point at which the next rapid starts.
    pierce
        Whether the start needs a pierce. A start in the air beyond the edge of the sheet does not.
    then
        The other contours of a chain. Each bridge ends at the `entry` of a contour, and the next bridge starts at the
        `exit` of that contour.
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
        """Indices of all contours of the cut, in order."""
        return (self.contour, *(s.contour for s in self.then))


# -- all starts ------------------------------------------------------------------------------------------------------


def find_starts(contours: list[CutContour], scrap: Scrap) -> list[CutStart]:
    """Find all starts, contour by contour. Raises PlanError if no lead fits at one of the contours."""
    most = max(FEWEST_PLACES, min(MOST_PLACES, MOST_NODES // max(len(contours), 1)))
    found: list[CutStart] = []
    stuck: list[CutContour] = []
    for number, contour in enumerate(contours):
        starts = find_contour_starts(number, contour, scrap, most)
        found += starts
        if not starts:
            stuck.append(contour)
    if stuck:
        raise PlanError(_no_start_message(stuck, contours, scrap.rules))
    return found


def _no_start_message(stuck: list[CutContour], contours: list[CutContour], rules: CutRules) -> Message:
    names = Message.joined("; ", (c.name() for c in stuck[:3]))
    names = Message("{} and {} more", names, len(stuck) - 3) if len(stuck) > 3 else names
    if rules.edge_start:
        return Message(
            "the sheet is too thick to pierce: cuts start at its edge, and no cut from there reaches "
            "{}; drill a hole there first and give --pierce-delay, or nest it nearer to the edge",
            names,
        )
    # The controller needs a lead to switch compensation on.
    instead = Message("--compensation geometry") if rules.compensation == "controller" else Message("--lead-in none")
    if not (rules.common_lines or rules.once) and any(_has_common_edge(one, contours) for one in stuck[:3]):
        instead = Message(
            "nest the parts with leafcut nest --blocks and cut edges one kerf apart only once (--common-lines)"
        )
    if rules.common_lines:
        instead = Message("nest the parts in blocks with space around them (leafcut nest --blocks)")
    return Message(
        "no lead fits into the scrap at {}; give a shorter --lead-in-length, {}, or more room between the parts",
        names,
        instead,
    )


def _has_common_edge(one: CutContour, contours: list[CutContour]) -> bool:
    """Return whether another outline runs one kerf away from a contour. If so, a common line could cut both."""
    near = one.line.buffer(ROUNDING)
    others = (other for other in contours if other is not one and other.has_leads and not other.hole)
    return not one.hole and any(near.intersection(other.line).length > 2.0 * one.rules.kerf for other in others)


def find_contour_starts(number: int, contour: CutContour, scrap: Scrap, most: int) -> list[CutStart]:
    """Find the starts of a contour at up to `most` positions.

    If no lead fits at these positions, more positions are tried. If no lead fits anywhere, the list is empty. `number`
    is the index of the contour.
    """
    path, rules = contour.path, contour.rules
    if not contour.has_leads:
        # If the torch cannot pierce, an open cut cannot start, because it has no lead from the edge of the sheet.
        pierces = contour.kind == "cut" and not rules.data.can_pierce
        return [] if pierces else _plain_starts(number, contour, most)
    places = start_positions(contour, most)
    if rules.edge_start:
        return [] if contour.hole else edge_starts(number, contour, scrap, places)
    if rules.lead_in.style == "none":
        return starts_without_lead(number, contour, [(at, way) for at in places for way in contour.allowed_directions])
    for finer in (1, 4):
        dense = places if finer == 1 else _compensable_positions(contour, _even_positions(path.length, 4 * len(places)))
        for splash in (True, False) if rules.kerf > 0.0 else (False,):
            tried = [(at, clockwise) for clockwise in contour.allowed_directions for at in dense]
            starts = starts_with_leads(number, contour, scrap, tried, leads_to_try(contour), splash)
            if starts:
                return starts
    return []


def _plain_starts(number: int, contour: CutContour, most: int) -> list[CutStart]:
    path = contour.path
    if not path.closed:
        return list(_open_starts(number, contour))
    places = start_positions(contour, most)
    return [CutStart(number, at, False, path.point_at(at), path.point_at(at)) for at in places]


def _open_starts(number: int, contour: CutContour) -> Iterator[CutStart]:
    path = contour.path
    ends = ((0.0, False, path.end), (path.length, True, path.start))
    for (at, backward, there), lead in zip(ends, contour.inlets, strict=True):
        if lead is not None:
            x, y = contour.lead_points(lead, at, backward)[0].tolist()
            yield CutStart(number, at, backward, (x, y), there, lead)


def starts_without_lead(number: int, contour: CutContour, places: Sequence[Place]) -> list[CutStart]:
    """Return starts of a closed contour without a lead-in. The torch pierces directly on the path."""
    point = contour.path.point_at
    return [CutStart(number, at, way, point(at), point(contour.end_position(at, way))) for at, way in places]


def start_positions(contour: CutContour, most: int) -> list[float]:
    """Return the positions along a closed contour at which to try a start, mm.

    These are its corners, and positions between them.
    """
    length, by_controller = contour.path.length, contour.rules.compensation == "controller"
    pitch = min(max(length / PLACES, NEAREST), FARTHEST)
    count = min(max(math.ceil(length / pitch), FEWEST_PLACES), most)
    corners = [at for at in contour.corners if not contour.is_in_loop(at) and not by_controller]
    if len(corners) > most:
        corners = corners[:: math.ceil(len(corners) / most)]
    even = [at for at in _even_positions(length, count) if not contour.is_in_loop(at)]
    if by_controller:
        return _compensable_positions(contour, even)
    near = 0.25 * length / count
    return sorted(corners + [at for at in even if all(distance_on_closed_path(at, c, length) > near for c in corners)])


def _compensable_positions(contour: CutContour, places: list[float]) -> list[float]:
    """Return the positions at which a cut can start.

    If the controller compensates the kerf, a cut cannot start at a corner.
    """
    if contour.rules.compensation != "controller":
        return places
    return [at for at in places if contour.is_smooth(at)]


def _even_positions(length: float, count: int) -> list[float]:
    # Begin half a step from the start of the path as drawn, which is often a corner.
    return [length * (k + 0.5) / count for k in range(count)]


# -- leads -----------------------------------------------------------------------------------------------------------


def leads_to_try(contour: CutContour) -> list[Lead | None]:
    """Return the lead-ins to try, in order of preference.

    None stands for a lead from the centre of a hole. It comes first for a small hole and last for all other holes.
    """
    rules = contour.rules
    found = lead_variants(rules.lead_in, rules.kerf)
    if not contour.hole or rules.lead_in.run_in > 0.0:
        return [*found]
    return [None, *found] if contour.is_small else [*found, None]


def starts_with_leads(
    number: int,
    contour: CutContour,
    scrap: Scrap,
    places: list[Place],
    leads: Sequence[Lead | None],
    splash: bool,
) -> list[CutStart]:
    """Find starts at the positions `places`. The leads are tried in order until enough positions have a start.

    If `splash` is set, the area around the pierce must be free of parts.
    """
    enough = min(max(ENOUGH, math.ceil(ENOUGH_SHARE * len(places))), len(places))
    starts: list[CutStart] = []
    for wanted in leads:
        tried = [wanted] * len(places) if wanted else leads_from_centre(contour, places)
        fits, entries = check_lead_ins(contour, scrap, tried, places, splash)
        starts += [
            _start_with_lead(number, contour, scrap, place, lead, (x, y))
            for place, lead, fit, (x, y) in zip(places, tried, fits, entries.tolist(), strict=True)
            if fit
        ]
        places = [place for place, fit in zip(places, fits, strict=True) if not fit]
        if len(starts) >= enough or not places:
            break
    return starts


def leads_from_centre(contour: CutContour, places: Sequence[Place]) -> list[Lead]:
    """For each of the positions `places`, return a straight lead from the centre of a hole to that position."""
    middle = shapely.Polygon(contour.line.coords).centroid
    leads = []
    for place in places:
        x, y = contour.path.point_at(place[0])
        dx, dy = middle.x - x, middle.y - y
        leads.append(Lead("line", math.hypot(dx, dy), _angle_from(contour, place, dx, dy)))
    return leads


def _angle_from(contour: CutContour, place: Place, dx: float, dy: float) -> float:
    """Return the angle of a straight lead that comes from the direction (dx, dy), rad.

    On the side of the scrap, the angle is between 0 and π.
    """
    tx, ty = contour.travel_direction(*place)
    sign = 1.0 if contour.is_scrap_left(place[1]) else -1.0
    return math.atan2(sign * (tx * dy - ty * dx), -(tx * dx + ty * dy))


def check_lead_ins(
    contour: CutContour, scrap: Scrap, leads: list[Lead], places: list[Place], splash: bool
) -> tuple[NDArray[np.bool_], Points]:
    """Check which lead-ins fit into the scrap.

    If `splash` is set, the area around the pierce must also be free of parts.

    Returns
    -------
    fits
        Mask of the lead-ins that fit, bool[n].
    entries
        First point of each lead-in, float64[n, 2].
    """
    fits, entries = np.zeros(len(leads), dtype=bool), np.full((len(leads), 2), math.nan)
    at = np.array([contour.path.point_at(a) for a, _ in places])
    travel = np.array([contour.travel_direction(a, clockwise) for a, clockwise in places])
    groups: dict[tuple[Lead, bool], list[int]] = {}
    for k, (lead, (_, clockwise)) in enumerate(zip(leads, places, strict=True)):
        groups.setdefault((lead, clockwise), []).append(k)
    by_size: dict[int, list[tuple[Points, list[int]]]] = {}
    for (lead, clockwise), group in groups.items():
        if lead.length > 0.0 and 0.0 < lead.angle < math.pi:
            shape = place_leads(lead_shape(lead), at[group], travel[group], contour.is_scrap_left(clockwise))
            by_size.setdefault(shape.shape[1], []).append((shape, group))
    for members in by_size.values():
        points = np.concatenate([shape for shape, _ in members])
        row = np.concatenate([group for _, group in members])
        ok = scrap.allowed_mask(leads_as_lines(points), contour)
        ok &= scrap.mask_leaving_own_kerf(points, contour)
        if splash:
            ok &= scrap.clear_mask(points[:, 0], scrap.rules.kerf)
        fits[row], entries[row] = ok, points[:, 0]
    return fits, entries


def _start_with_lead(
    number: int, contour: CutContour, scrap: Scrap, place: Place, lead: Lead, entry: Point
) -> CutStart:
    out, leave = fitting_lead_out(contour, scrap, place)
    return CutStart(number, *place, entry, leave, lead, out)


def fitting_lead_out(contour: CutContour, scrap: Scrap, place: Place, wanted: Lead | None = None) -> tuple[Lead, Point]:
    """Return the lead-out for the end of a cut and the point where it ends.

    If the requested lead-out does not fit, it is shortened or left out.
    """
    wanted = contour.requested_lead_out if wanted is None else wanted
    end = contour.end_position(*place), place[1]
    if wanted.style != "none":
        for share in (1.0, 0.5, 0.25):
            out = replace(wanted, length=share * wanted.length)
            points = contour.lead_points(out, *end, out=True)[None]
            if (
                scrap.allowed_mask(leads_as_lines(points), contour)[0]
                and scrap.mask_leaving_own_kerf(points[:, ::-1], contour)[0]
            ):
                x, y = points[0, -1].tolist()
                return out, (x, y)
    return NO_LEAD, contour.path.point_at(end[0])


def edge_starts(number: int, contour: CutContour, scrap: Scrap, places: Sequence[float]) -> list[CutStart]:
    """Find starts beyond the edge of the sheet, where no pierce is needed.

    Raises PlanError if the size of the sheet is unknown.
    """
    rules = contour.rules
    if scrap.sheet is None:
        raise PlanError(
            "{:g} mm is above the pierce capacity: cuts start at the sheet's edge, but its size "
            "is not known; give --sheet-size, or --pierce-delay to pierce anyway",
            rules.data.thickness,
        )
    low_x, low_y, high_x, high_y = scrap.sheet.bounds
    reach = 2.0 * math.hypot(high_x - low_x, high_y - low_y)
    starts = []
    for at in places:
        x, y = contour.path.point_at(at)
        for dx, dy in AXES:
            ray = shapely.LineString([(x, y), (x + reach * dx, y + reach * dy)])
            pieces = shapely.get_parts(shapely.intersection(ray, scrap.sheet))
            inside = sum(shapely.length(p) for p in pieces if shapely.distance(p, shapely.Point(x, y)) < 1e-6)
            length = inside + IN_THE_AIR + 0.5 * rules.kerf
            entry = (x + length * dx, y + length * dy)
            points = np.array([[entry, (x, y)]])
            lines = leads_as_lines(points)
            if len(pieces) > 1 or not (
                scrap.allowed_mask(lines, contour, leaves_sheet=True)[0]
                and scrap.mask_leaving_own_kerf(points, contour)[0]
            ):
                continue
            for clockwise in contour.allowed_directions:
                angle = _angle_from(contour, (at, clockwise), dx, dy)
                if 0.0 < angle < math.pi:
                    out, leave = fitting_lead_out(contour, scrap, (at, clockwise))
                    lead = Lead("line", length, angle)
                    starts.append(CutStart(number, at, clockwise, entry, leave, lead, out, pierce=False))
    return starts


# -- other places ----------------------------------------------------------------------------------------------------


def start_with_same_leads(
    contour: CutContour,
    scrap: Scrap,
    like: CutStart,
    at: float,
    wanted: Callable[[CutStart], bool] = lambda _: True,
) -> CutStart | None:
    """Return a start with the same leads as `like` at another position, mm.

    Return None if the leads do not fit there, or if `wanted` rejects the start.
    """
    if not contour.may_start(at):
        return None
    place, rules = (at, like.clockwise), contour.rules
    lead = leads_from_centre(contour, [place])[0] if _is_from_centre(contour, like) else like.lead_in
    x, y = contour.lead_points(lead, *place)[0].tolist()
    end = contour.end_position(*place)
    moved = replace(like, at=at, lead_in=lead, entry=(x, y), exit=contour.path.point_at(end))
    if like.lead_out.style != "none":
        u, v = contour.lead_points(like.lead_out, end, like.clockwise, out=True)[-1].tolist()
        moved = replace(moved, exit=(u, v))
    if not wanted(moved):
        return None
    if like.lead_in.style != "none" and contour.has_leads:
        clear = bool(rules.kerf > 0.0 and scrap.clear_mask(np.array([like.entry]), rules.kerf)[0])
        if not check_lead_ins(contour, scrap, [lead], [place], clear)[0].all():
            return None
    if like.lead_out.style == "none":
        return moved
    fitting, _ = fitting_lead_out(contour, scrap, place, like.lead_out)
    return moved if fitting == like.lead_out else None


def _is_from_centre(contour: CutContour, start: CutStart) -> bool:
    """Return whether the lead-in comes from the centre of a small hole.

    Such a lead-in depends on the start position.
    """
    if not contour.is_small or start.lead_in.style != "line":
        return False
    middle = leads_from_centre(contour, [(start.at, start.clockwise)])[0]
    return abs(middle.length - start.lead_in.length) < 1e-6 and abs(middle.angle - start.lead_in.angle) < 1e-6
