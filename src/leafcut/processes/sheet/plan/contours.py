"""The contours of a sheet and the torch paths along them.

A torch path runs half a kerf away from the part, in the scrap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point, Points
from leafcut.geometry.offset import offset_closed_path
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.cutting import Lead
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.kinds import CutMethod
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.cut_rules import NARROWEST_HOLE, CutRules
from leafcut.processes.sheet.plan.leads import FLATNESS, NO_LEAD, lead_path, lead_shape, place_leads

#: Tolerance for offset paths, mm.
OFFSET_TOLERANCE = 0.01
#: Tolerance for distances, mm.
ROUNDING = 0.03
#: Uncut areas smaller than this are rounding errors, mm².
SMALL = 0.01
#: Minimum turn at a corner of the drawing, rad.
CORNER = math.radians(30.0)
#: Minimum distance between the start of a cut and a corner loop, mm.
BESIDE_LOOP = 1.0
#: Directions are averaged over this distance before and after a point, mm. At a corner, this gives the bisector.
AROUND = 0.01


@dataclass(frozen=True, eq=False)
class CutContour:
    """A contour to cut or mark, with its torch path and rules.

    Attributes
    ----------
    index
        Index of the contour in `Sheet.contours`.
    path
        Centreline of the kerf. It is counter-clockwise if closed.
    line
        The path as a shapely line of chords.
    hole
        Whether the contour is a hole. Its scrap is inside, and the part is outside.
    diameter
        Diameter of a circle with the same area, mm; 0 for an open contour.
    rules
        Rules of the sheet. If the controller cannot compensate the kerf of this contour, these rules let the program do
        it.
    corners
        Positions of the drawn corners along the path, mm.
    loops
        Start and end of each corner loop along the path, mm.
    covers
        With common lines, the outlines that this contour cuts, completely or in part, as indices; otherwise empty.
    group
        Number of the group of parts with common lines, starting at 1; 0 if the contour belongs to no group.
    common
        Length that two parts share, mm, if the contour is a common line; otherwise 0.
    inlets
        For an open cut, the lead-in at each end. It is None if the cut cannot start at this end.
    pinched
        For an outline with notches whose mouths are too narrow for the kerf, the kerf centrelines in these notches, as
        rings.
    notch_of
        If the contour lies in a notch that the kerf closes, the index of the notched outline; otherwise -1.
    """

    index: int
    source: Contour
    path: Polyline
    line: Any
    hole: bool
    diameter: float
    rules: CutRules
    corners: tuple[float, ...] = ()
    loops: tuple[tuple[float, float], ...] = ()
    covers: tuple[int, ...] = ()
    group: int = 0
    common: float = 0.0
    inlets: tuple[Lead | None, Lead | None] = (NO_LEAD, NO_LEAD)
    pinched: tuple[Polyline, ...] = ()
    notch_of: int = -1

    @property
    def contour_indices(self) -> tuple[int, ...]:
        """Indices in `Sheet.contours` of all contours that are cut along this path."""
        return self.covers or (self.index,)

    @property
    def kind(self) -> str:
        """Whether the contour is cut or marked: ``cut`` or ``mark``."""
        return self.source.kind

    @property
    def has_leads(self) -> bool:
        """Whether the contour is closed and is cut. Only such a contour has scrap on one side, where leads may lie."""
        return self.path.closed and self.kind == "cut"

    @property
    def is_small(self) -> bool:
        """Whether the rules for small holes apply to this contour."""
        return self.hole and self.has_leads and self.diameter < self.rules.small_hole

    @property
    def feed(self) -> float:
        """Cutting or marking speed, mm/s."""
        return self.rules.feed_of(self.kind, small=self.is_small)

    @property
    def joint_count(self) -> int:
        """Number of micro-joints that the user requested."""
        return self.rules.joints if self.has_leads and not self.hole and not self.is_small else 0

    @property
    def closing_joint_length(self) -> float:
        """Length of the gap that a micro-joint leaves at the end of the path, mm.

        It includes half a kerf on each side.
        """
        if not self.joint_count or self.rules.kind == CutMethod.LASER:
            return 0.0
        return min(self.rules.joint_width + self.rules.kerf, 0.25 * self.path.length)

    @property
    def overcut(self) -> float:
        """Distance by which the cut continues beyond its start, mm."""
        if not self.has_leads or (self.joint_count and self.rules.kind != CutMethod.LASER):
            return 0.0
        return self.rules.hole_overcut if self.hole else self.rules.overcut

    @property
    def requested_lead_out(self) -> Lead:
        """The lead-out that the user requested, or no lead-out if the rules do not allow it for this contour."""
        ends_on_contour = self.rules.torch_off_in_overcut and self.overcut > 0.0
        ends_at_joint = self.joint_count and self.rules.kind != CutMethod.LASER
        if ends_on_contour or ends_at_joint or self.is_small or (self.hole and not self.rules.hole_lead_out):
            return NO_LEAD
        return self.rules.lead_out

    @property
    def allowed_directions(self) -> tuple[bool, ...]:
        """The allowed cutting directions; True means clockwise."""
        wanted = self.rules.cut_direction(self.hole)
        return {"clockwise": (True,), "counter-clockwise": (False,), "free": (False, True)}[wanted]

    def name(self) -> str:
        """Return a name for messages. It contains the part and the position of the contour."""
        x, y = self.source.path.start
        if self.common:
            return Message("common line of part {} from ({:.4g}, {:.4g})", self.source.part, x, y)
        if self.kind == "mark":
            name = Message("mark at ({:.4g}, {:.4g})", x, y)
        elif self.hole:
            name = Message("hole at ({:.4g}, {:.4g})", x, y)
        elif self.path.closed:
            name = Message("outline at ({:.4g}, {:.4g})", x, y)
        else:
            name = Message("cut at ({:.4g}, {:.4g})", x, y)
        return Message("part {}: {}", self.source.part, name) if self.source.part else name

    # -- places along the path ---------------------------------------------------------------------------------------

    def is_scrap_left(self, clockwise: bool) -> bool:
        """Return whether the scrap is to the left of the direction of travel."""
        return self.hole != clockwise

    def travel_direction(self, at: float, clockwise: bool) -> Point:
        """Return the direction of travel at a position on the contour, as a unit vector.

        At a corner, this is the bisector of the directions before and after the corner.
        """
        (x0, y0), (x1, y1) = self.path.direction_at(at - AROUND), self.path.direction_at(at + AROUND)
        x, y = x0 + x1, y0 + y1
        length = math.hypot(x, y)
        if length < 1e-9:
            (x, y), length = (x1, y1), 1.0
        sign = -1.0 if clockwise else 1.0
        return sign * x / length, sign * y / length

    def end_position(self, at: float, clockwise: bool) -> float:
        """Return the position at which a cut ends if it starts at the position `at`, mm along the path."""
        past = self.overcut - self.closing_joint_length
        return at - past if clockwise else at + past

    def is_smooth(self, at: float) -> bool:
        """Return whether a position is far enough from corners for the controller to start kerf compensation."""
        return all(
            distance_on_closed_path(at, corner, self.path.length) > 2.0 * self.rules.kerf for corner in self.corners
        )

    def is_in_loop(self, at: float) -> bool:
        """Return whether a position is in a corner loop, or so close that the closing joint would be in the loop.

        A joint must lie on the edge of the part. A joint in a loop would leave the arc around the corner uncut.
        """
        length, room = self.path.length, BESIDE_LOOP + self.closing_joint_length
        return any((at - begin + room) % length <= end - begin + 2.0 * room for begin, end in self.loops)

    def may_start(self, at: float) -> bool:
        """Return whether a cut may start at a position of the path. The caller must check whether the lead fits."""
        return not self.is_in_loop(at) and (self.rules.compensation != "controller" or self.is_smooth(at))

    def lead_points(self, lead: Lead, at: float, clockwise: bool, *, out: bool = False) -> Points:
        """Return the points of a lead at a position, in the direction of travel, float64[k, 2], mm."""
        here, travel = np.array([self.path.point_at(at)]), np.array([self.travel_direction(at, clockwise)])
        points: Points = place_leads(lead_shape(lead), here, travel, self.is_scrap_left(clockwise), out)[0]
        return points

    def lead_path_at(self, lead: Lead, at: float, clockwise: bool, *, out: bool = False) -> Polyline | None:
        """Return the path of a lead at a position, or None if the lead has no length."""
        left = self.is_scrap_left(clockwise)
        return lead_path(lead, self.path.point_at(at), self.travel_direction(at, clockwise), left, out)


def distance_on_closed_path(a: float, b: float, length: float) -> float:
    """Return the distance between two positions along a closed path, mm."""
    return min((a - b) % length, (b - a) % length)


def chord_line(path: Polyline) -> Any:
    """Approximate a path by chords, as a shapely line that is prepared for distance queries."""
    points = path.flattened(FLATNESS)
    if len(points) < 2:
        points = np.repeat(points, 2, axis=0)
    line = shapely.LineString(points)
    shapely.prepare(line)
    return line


def name_list(contours: Sequence[CutContour]) -> str:
    """List the names of the first few contours, for a message."""
    return ", ".join(c.name() for c in contours[:3]) + (" …" if len(contours) > 3 else "")


# -- preparation -----------------------------------------------------------------------------------------------------


def prepare_contours(sheet: Sheet, rules: CutRules) -> tuple[list[CutContour], list[Issue]]:
    """Return the contours that can be cut, in the order of the sheet, and issues about areas that stay uncut.

    A hole stays uncut if it is too small for the kerf or for a pierce. A notch stays uncut if its mouth is narrower
    than the kerf.
    """
    kept: list[CutContour] = []
    remarks: list[tuple[Message, Issue]] = []
    chambers = [shapely.Polygon(c.path.flattened(FLATNESS)) for c in sheet.contours if c.chamber]
    for index, source in enumerate(sheet.contours):
        if source.kind == "sheet":
            continue
        contour = _prepare_contour(index, source, rules)
        if contour is None:
            remarks.append(_too_narrow_remark(index, source, rules))
        else:
            kept.append(contour)
            remarks += _contour_remarks(contour, chambers)
    issues = _merge_remarks(remarks)
    if not kept:
        raise PlanError(
            Message("{}: nothing is left to cut", sheet.name) + (f"; {issues[0].message}" if issues else "")
        )
    return kept, issues


def _prepare_contour(index: int, source: Contour, rules: CutRules) -> CutContour | None:
    """Compute the torch path of a contour. Return None if the contour is too narrow for the kerf."""
    drawn = source.path
    if source.kind != "cut" or not drawn.closed:
        return CutContour(index, source, drawn, chord_line(drawn), False, 0.0, rules)
    path = drawn if drawn.area >= 0.0 else drawn.reversed()
    diameter = 2.0 * math.sqrt(abs(drawn.area) / math.pi)
    pinched: tuple[Polyline, ...] = ()
    if rules.half > 0.0:
        rings = offset_closed_path(path, -rules.half if source.is_hole else rules.half, OFFSET_TOLERANCE)
        if not rings or (source.is_hole and len(rings) > 1):
            return None
        pinched = tuple(rings[1:])
        path = rings[0] if rings[0].area >= 0.0 else rings[0].reversed()
    line = chord_line(path)
    if rules.half > 0.0 and source.is_hole and not _has_room_for_pierce(path, line, rules):
        return None
    corners = corners_along(drawn, path, line)
    return CutContour(index, source, path, line, source.is_hole, diameter, rules, corners, pinched=pinched)


def assign_closed_notches(contours: list[CutContour], rules: CutRules) -> list[CutContour]:
    """Set `notch_of` for each contour that lies in a closed notch, and return all contours.

    The kerfs on both sides of a notch close it if its mouth is narrower than two kerfs.
    """
    reach = 0.5 * rules.kerf + ROUNDING
    tree: Any = shapely.STRtree(np.array([c.line for c in contours], dtype=object))
    areas = [shapely.Polygon(c.line.coords).area if c.path.closed else 0.0 for c in contours]
    found: dict[int, tuple[float, int]] = {}
    for k, outline in enumerate(contours):
        if not outline.has_leads or outline.hole:
            continue
        near = tree.query(outline.line.envelope.buffer(reach), predicate="contains").tolist()
        beside = [n for n in near if n != k and contours[n].source.parent == outline.source.parent]
        if not beside:
            continue
        burnt = shapely.Polygon(shapely.Polygon(outline.line.coords).buffer(reach).exterior)
        for n in beside:
            if burnt.area > areas[n] and burnt.contains(contours[n].line):
                found[n] = min(found.get(n, (math.inf, -1)), (burnt.area, outline.index))
    return [replace(c, notch_of=found[n][1]) if n in found else c for n, c in enumerate(contours)]


def _has_room_for_pierce(path: Polyline, line: Any, rules: CutRules) -> bool:
    if path.area > 2.0 * rules.kerf * path.length:
        return True
    return not shapely.Polygon(line.coords).buffer(-rules.half, quad_segs=2).is_empty


def corners_along(drawn: Polyline, path: Polyline, line: Any) -> tuple[float, ...]:
    """Project the corners of a drawn contour onto its torch path. Return the positions along that path, mm."""
    turns = corner_turns(drawn)
    places = drawn.vertices[np.abs(turns) > CORNER, :2]
    share = shapely.line_locate_point(line, shapely.points(places), normalized=True)
    return tuple(sorted({round(float(s) * path.length, 3) % path.length for s in np.atleast_1d(share)}))


def corner_turns(path: Polyline) -> Points:
    """Return the change of direction at the start of each segment of a closed path, rad. Left turns are positive."""
    turns = np.zeros(path.n_segments)
    ends = [_tangents(path, i) for i in range(path.n_segments)]
    for i, (begin, _) in enumerate(ends):
        before = ends[i - 1][1]
        cross, dot = before[0] * begin[1] - before[1] * begin[0], before[0] * begin[0] + before[1] * begin[1]
        turns[i] = math.atan2(cross, dot)
    return turns


def _tangents(path: Polyline, index: int) -> tuple[Point, Point]:
    """Return the unit vectors of travel at the start and the end of a segment.

    For an arc, this is the direction of the chord, rotated by half the angle of the arc.
    """
    s = path.segment(index)
    angle = math.atan2(s.end[1] - s.start[1], s.end[0] - s.start[0])
    half = 2.0 * math.atan(s.bulge)
    return (math.cos(angle - half), math.sin(angle - half)), (math.cos(angle + half), math.sin(angle + half))


# -- issues ----------------------------------------------------------------------------------------------------------


def _remark(
    code: str, one: Message, several: Message, place: Message, missing: MissingWork | None = None
) -> tuple[Message, Issue]:
    """Combine an issue about one contour with the message to use if several contours have the same issue.

    The number of contours in that message is left empty.
    """
    return several, Issue(code, one, place, missing=missing)


def _merge_remarks(remarks: list[tuple[Message, Issue]]) -> list[Issue]:
    groups: dict[tuple[str, Message], list[Issue]] = {}
    for several, issue in remarks:
        groups.setdefault((issue.code, several), []).append(issue)
    return [own[0] if len(own) == 1 else _merge_issues(several, own) for (_, several), own in groups.items()]


def _merge_issues(several: Message, own: list[Issue]) -> Issue:
    place = Message.joined("; ", (issue.place for issue in own[:3])) + (" …" if len(own) > 3 else "")
    works = [issue.missing for issue in own if issue.missing is not None]
    missing = None
    if works:
        where = tuple(point for work in works for point in work.where)
        missing = MissingWork(works[0].what, len(works), where, tuple(path for work in works for path in work.outlines))
    message = Message(several.template, len(own), *several.values[1:])
    return Issue(own[0].code, message, place, missing=missing)


def _too_narrow_remark(index: int, source: Contour, rules: CutRules) -> tuple[Message, Issue]:
    x, y = source.path.start
    low_x, low_y, high_x, high_y = source.path.extents
    size, kerf = f"{high_x - low_x:.4g} × {high_y - low_y:.4g} mm", f"{rules.kerf:.4g}"
    if min(high_x - low_x, high_y - low_y) < 2.0 * rules.kerf:
        words = Message(
            "a hole of {} in part {} is not cut, because it is narrower than two kerfs of {} mm and has no "
            "room for a pierce",
            size,
            source.part,
            kerf,
        )
        several = Message(
            "{} holes are not cut, because they are narrower than two kerfs of {} mm and have no room for a pierce",
            "",
            kerf,
        )
    else:
        words = Message(
            "a hole of {} in part {} is not cut, because it has a neck narrower than the kerf of {} mm or no "
            "room for a pierce",
            size,
            source.part,
            kerf,
        )
        several = Message(
            "{} holes are not cut, because they have a neck narrower than the kerf of {} mm or no room for a pierce",
            "",
            kerf,
        )
    work = MissingWork("hole", 1, ((x, y),), (source.path,))
    return _remark("L611", words, several, _contour_place_text(index, source, x, y), work)


def _contour_place_text(index: int, source: Contour, x: float, y: float) -> Message:
    place = Message("contour {} at ({:.6g}, {:.6g})", index + 1, x, y)
    return Message("{}, entity {}", place, source.handle) if source.handle else place


def _notch_remarks(contour: CutContour, chambers: list[Any]) -> list[tuple[Message, Issue]]:
    """Return remarks about notches of an outline that stay uncut.

    The areas in `chambers` are cut as holes, so they need no remark.
    """
    source, rules = contour.source, contour.rules
    drawn = shapely.Polygon(source.path.flattened(FLATNESS))
    closed = shapely.Polygon(contour.line.coords).buffer(-rules.half)
    left, outlines = closed.difference(drawn), contour.pinched
    cut = [chambers[k] for k in np.flatnonzero(shapely.covers(closed.buffer(ROUNDING), chambers))]
    if cut:
        reach = shapely.union_all([*cut, *(chord_line(path) for path in contour.pinched)]).buffer(ROUNDING)
        rest = shapely.get_parts(left.difference(shapely.union_all(cut)))
        left = shapely.union_all([part for part in rest if part.area > SMALL and part.intersects(reach)])
        rings = [part.exterior.coords[:-1] for part in shapely.get_parts(left)]
        outlines = tuple(Polyline.of_points(list(ring), closed=True) for ring in rings)
    if not outlines:
        return []
    kerf = f"{rules.kerf:.4g}"
    words = Message(
        "a notch of part {} has a mouth narrower than the kerf of {} mm, so {:.3g} mm² of the part's notches "
        "stay uncut",
        source.part,
        kerf,
        left.area,
    )
    several = Message(
        "{} parts have notches with a mouth narrower than the kerf of {} mm, which stay uncut in whole or in part",
        "",
        kerf,
    )
    x, y = outlines[0].start
    work = MissingWork("place", 1, ((x, y),), outlines)
    return [_remark("L612", words, several, _contour_place_text(contour.index, source, x, y), work)]


def _contour_remarks(contour: CutContour, chambers: list[Any]) -> list[tuple[Message, Issue]]:
    source, rules = contour.source, contour.rules
    found: list[tuple[Message, Issue]] = []
    several: Message
    if contour.pinched:
        found += _notch_remarks(contour, chambers)
    elif contour.has_leads and rules.half > 0.0:
        points = source.path.flattened(max(FLATNESS, 0.1 * rules.kerf))
        away = shapely.distance(shapely.points(points), contour.line)
        worst = int(np.argmax(away))
        if away[worst] > rules.half + rules.kerf:
            left = away[worst] - rules.half
            words = Message("part {} has a gap narrower than the kerf, so {:.2g} mm remain uncut", source.part, left)
            several = Message("{} contours have a gap narrower than the kerf, which remains uncut", "")
            px, py = points[worst].tolist()
            work = MissingWork("place", 1, ((px, py),))
            found.append(_remark("L612", words, several, _contour_place_text(contour.index, source, px, py), work))
    narrowest = NARROWEST_HOLE * rules.data.thickness
    if rules.kind == CutMethod.PLASMA and contour.hole and contour.diameter < narrowest:
        words = Message(
            "a hole of {:.3g} mm is smaller than {:g} times the thickness and will be tapered",
            contour.diameter,
            NARROWEST_HOLE,
        )
        several = Message(
            "{} holes smaller than {} mm, which is {} times the thickness, will be tapered",
            "",
            f"{narrowest:g}",
            f"{NARROWEST_HOLE:g}",
        )
        found.append(_remark("L615", words, several, _contour_place_text(contour.index, source, *source.path.start)))
    return found
