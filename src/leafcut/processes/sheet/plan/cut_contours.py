"""The contours of a sheet as the torch follows them: half a kerf beside what is drawn, on the side of the scrap."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Points
from leafcut.geometry.offset import offset
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Lead
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.kinds import CutMethod
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.processes.sheet.plan.cut_rules import NARROWEST_HOLE, CutRules

#: How true paths beside the contours are, and how true chords are to arcs, mm.
OFFSET_TOLERANCE = 0.01
FLATNESS = 0.005
#: What is nearer than it may be by less than this is rounding, mm.
ROUNDING = 0.03
#: Less uncut area than this is rounding, mm².
SMALL = 0.01
NO_LEAD = Lead()
#: A drawn corner turns by more than this, rad.
CORNER = math.radians(30.0)


@dataclass(frozen=True, eq=False)
class CutContour:
    """A contour that is cut or marked, and the path beside it.

    Attributes
    ----------
    index
        In `Sheet.contours`.
    source
        What is drawn.
    path
        What the middle of the kerf follows, counter-clockwise where it is closed.
    line
        The path in chords, a shapely line.
    hole
        True: the part is outside, the scrap inside.
    diameter
        Of the circle of equal area, mm; 0 for an open one.
    corners
        Where along the path the drawn corners are, mm.
    loops
        (from, to) along the path: loops round corners.
    covers
        Indices of the outlines that it cuts, or a part of each, where parts have common lines; empty for its own.
    group
        Number of its group of parts with common lines, from 1; 0 for none.
    common
        Of a common line: how much of it is an edge of two parts, mm; 0 for all else.
    inlets
        Of an open cut: its lead-in at either end; None where it cannot begin there.
    by_path
        True: the program compensates the kerf here, where a controller that does elsewhere has no room for its lead.
    pinched
        Of an outline: what the kerf cannot reach of its notches, because their mouths are narrower than the kerf.
    notch_of
        In `Sheet.contours`, of the outline whose cut detaches the scrap around this contour: it lies in a notch with a
        mouth that the kerf closes; -1 for none.
    """

    index: int
    source: SheetContour
    path: Polyline
    line: Any
    hole: bool
    diameter: float
    corners: tuple[float, ...] = ()
    loops: tuple[tuple[float, float], ...] = ()
    covers: tuple[int, ...] = ()
    group: int = 0
    common: float = 0.0
    inlets: tuple[Lead | None, Lead | None] = (NO_LEAD, NO_LEAD)
    by_path: bool = False
    pinched: tuple[Polyline, ...] = ()
    notch_of: int = -1

    def rules_of(self, rules: CutRules) -> CutRules:
        """Return the rules that it is cut by, of those of its sheet."""
        return rules.by_path() if self.by_path else rules

    @property
    def indices(self) -> tuple[int, ...]:
        """In `Sheet.contours`, of all that it cuts."""
        return self.covers or (self.index,)

    @property
    def kind(self) -> str:
        """``cut`` or ``mark``."""
        return self.source.contour.kind

    @property
    def has_leads(self) -> bool:
        """True: closed and to be cut: it has an inside and an outside, and one of them is scrap."""
        return self.path.closed and self.kind == "cut"

    def is_small(self, rules: CutRules) -> bool:
        """Return whether it is cut by the rules of small holes."""
        return self.hole and self.has_leads and self.diameter < rules.small_hole

    def name(self) -> str:
        """Return what a person calls it."""
        x, y = self.source.contour.path.start
        if self.common:
            return f"common line of part {self.source.part} from ({x:.4g}, {y:.4g})"
        what = "mark" if self.kind == "mark" else "hole" if self.hole else "outline" if self.path.closed else "cut"
        part = f"part {self.source.part}: " if self.source.part else ""
        return f"{part}{what} at ({x:.4g}, {y:.4g})"


def flat_line(path: Polyline) -> Any:
    """Return a path as a shapely line of chords."""
    points = path.flattened(FLATNESS)
    if len(points) < 2:
        points = np.repeat(points, 2, axis=0)
    return shapely.LineString(points)


def prepare_contours(sheet: Sheet, rules: CutRules) -> tuple[list[CutContour], list[Issue]]:
    """Return the contours that can be cut, in the order of the sheet, and what was found about the others.

    A hole into which the kerf does not go, or in which it cannot pierce, is reported and not cut. So are the notches of
    an outline whose mouths are narrower than the kerf; the rest of the outline is cut.
    """
    made: dict[int, CutContour] = {}
    remarks: list[_Remark] = []
    chambers = [shapely.Polygon(c.contour.path.flattened(FLATNESS)) for c in sheet.contours if c.chamber]
    for index, source in enumerate(sheet.contours):
        if source.contour.kind == "sheet":
            continue
        contour = _prepared(index, source, rules)
        if contour is not None:
            made[index] = contour
            remarks += _remarks(contour, rules, chambers)
            continue
        remarks.append(_too_narrow(index, source, rules))
    issues = _grouped(remarks)
    kept = list(made.values())
    if not kept:
        raise PlanError(f"{sheet.name}: nothing is left to cut" + (f"; {issues[0].message}" if issues else ""))
    return kept, issues


def _prepared(index: int, source: SheetContour, rules: CutRules) -> CutContour | None:
    """Return a contour with its path; None where the kerf is too wide for it."""
    drawn = source.contour.path
    if source.contour.kind != "cut" or not drawn.closed:
        return CutContour(index, source, drawn, flat_line(drawn), False, 0.0)
    path = drawn if drawn.area >= 0.0 else drawn.reversed()
    diameter = 2.0 * math.sqrt(abs(drawn.area) / math.pi)
    pinched: tuple[Polyline, ...] = ()
    if rules.half > 0.0:
        rings = offset(path, -rules.half if source.is_hole else rules.half, OFFSET_TOLERANCE)
        if not rings or (source.is_hole and len(rings) > 1):
            return None
        pinched = tuple(rings[1:])
        path = rings[0] if rings[0].area >= 0.0 else rings[0].reversed()
    line = flat_line(path)
    if rules.half > 0.0 and source.is_hole and not _holds_pierce(path, line, rules):
        return None
    return CutContour(
        index, source, path, line, source.is_hole, diameter, corners_along(drawn, path, line), pinched=pinched
    )


def with_notches(contours: list[CutContour], rules: CutRules) -> list[CutContour]:
    """Return the contours with `notch_of` set: an outline's kerf burns its edge, so a mouth below two kerfs closes."""
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


def _holds_pierce(path: Polyline, line: Any, rules: CutRules) -> bool:
    """Return whether there is a place half a kerf inside the path of a hole, where a pierce reaches no part."""
    if path.area > 2.0 * rules.kerf * path.length:
        return True
    return not shapely.Polygon(line.coords).buffer(-rules.half, quad_segs=2).is_empty


def corners_along(drawn: Polyline, path: Polyline, line: Any) -> tuple[float, ...]:
    """Return where along the path the drawn corners are."""
    turns = corner_turns(drawn)
    places = drawn.vertices[np.abs(turns) > CORNER, :2]
    share = shapely.line_locate_point(line, shapely.points(places), normalized=True)
    return tuple(sorted({round(float(s) * path.length, 3) % path.length for s in np.atleast_1d(share)}))


def corner_turns(path: Polyline) -> Points:
    """Return by how much a closed path turns at the start of every segment, rad, positive to the left."""
    turns = np.zeros(path.n_segments)
    ends = [_tangents(path, i) for i in range(path.n_segments)]
    for i, (begin, _) in enumerate(ends):
        before = ends[i - 1][1]
        cross, dot = before[0] * begin[1] - before[1] * begin[0], before[0] * begin[0] + before[1] * begin[1]
        turns[i] = math.atan2(cross, dot)
    return turns


def _tangents(path: Polyline, index: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the directions in which a segment begins and ends: its chord's, turned by half of its arc's angle."""
    s = path.segment(index)
    angle = math.atan2(s.end[1] - s.start[1], s.end[0] - s.start[0])
    half = 2.0 * math.atan(s.bulge)
    return (math.cos(angle - half), math.sin(angle - half)), (math.cos(angle + half), math.sin(angle + half))


class _Remark(NamedTuple):
    """What is noticed of one contour: in words for one, in words for several ({n} of them), and where.

    `missing` is what of it is drawn and not cut.
    """

    code: str
    one: str
    several: str
    place: str
    missing: MissingWork | None = None


def _grouped(remarks: list[_Remark]) -> list[Issue]:
    """Return one issue for all contours of which the same is noticed, with the first places."""
    groups: dict[tuple[str, str], list[_Remark]] = {}
    for remark in remarks:
        groups.setdefault((remark.code, remark.several), []).append(remark)
    return [
        Issue(
            code,
            own[0].one if len(own) == 1 else several.format(n=len(own)),
            _places(own),
            missing=_missing(own),
        )
        for (code, several), own in groups.items()
    ]


def _missing(remarks: list[_Remark]) -> MissingWork | None:
    """Return what is not cut of several contours, in one."""
    works = [remark.missing for remark in remarks if remark.missing is not None]
    if not works:
        return None
    where = tuple(place for work in works for place in work.where)
    return MissingWork(works[0].what, len(works), where, tuple(path for work in works for path in work.outlines))


def _places(remarks: list[_Remark]) -> str:
    return "; ".join(r.place for r in remarks[:3]) + (" …" if len(remarks) > 3 else "")


def _too_narrow(index: int, source: SheetContour, rules: CutRules) -> _Remark:
    x, y = source.contour.path.start
    low_x, low_y, high_x, high_y = source.contour.path.extents
    size, kerf = f"{high_x - low_x:.4g} × {high_y - low_y:.4g} mm", f"{rules.kerf:.4g} mm"
    if min(high_x - low_x, high_y - low_y) < 2.0 * rules.kerf:
        narrow = f"narrower than two kerfs of {kerf}, with no room for a pierce: not cut"
        words = f"a hole of {size} in part {source.part} is {narrow}"
        several = f"{{n}} holes are {narrow}"
    else:
        narrow = f"a neck narrower than the kerf of {kerf}, or no room for a pierce: not cut"
        words = f"a hole of {size} in part {source.part} has {narrow}"
        several = f"{{n}} holes have {narrow}"
    path = source.contour.path
    work = MissingWork("hole", 1, ((x, y),), (path,))
    return _Remark("L611", words, several, _place(index, source, x, y), work)


def _place(index: int, source: SheetContour, x: float, y: float) -> str:
    handle = f", entity {source.contour.handle}" if source.contour.handle else ""
    return f"contour {index + 1} at ({x:.6g}, {y:.6g}){handle}"


def _pinched(contour: CutContour, rules: CutRules, chambers: list[Any]) -> list[_Remark]:
    """Return how much of the notches of an outline stays uncut; `chambers` of all outlines are cut by themselves."""
    source = contour.source
    drawn = shapely.Polygon(source.contour.path.flattened(FLATNESS))
    closed = shapely.Polygon(contour.line.coords).buffer(-rules.half)
    left, outlines = closed.difference(drawn), contour.pinched
    cut = [chambers[k] for k in np.flatnonzero(shapely.covers(closed.buffer(ROUNDING), chambers))]
    if cut:
        reach = shapely.union_all([*cut, *(flat_line(path) for path in contour.pinched)]).buffer(ROUNDING)
        rest = shapely.get_parts(left.difference(shapely.union_all(cut)))
        left = shapely.union_all([part for part in rest if part.area > SMALL and part.intersects(reach)])
        rings = [part.exterior.coords[:-1] for part in shapely.get_parts(left)]
        outlines = tuple(Polyline.of_points(list(ring), closed=True) for ring in rings)
    if not outlines:
        return []
    mouth = f"a mouth narrower than the kerf of {rules.kerf:.4g} mm"
    words = f"a notch of part {source.part} has {mouth}: {left.area:.3g} mm² of the part's notches stay uncut"
    several = f"{{n}} parts have notches with {mouth}, which stay uncut in whole or in part"
    x, y = outlines[0].start
    work = MissingWork("place", len(outlines), ((x, y),), outlines)
    return [_Remark("L612", words, several, _place(contour.index, source, x, y), work)]


def _remarks(contour: CutContour, rules: CutRules, chambers: list[Any]) -> list[_Remark]:
    """Return what a person should know of a contour that is cut: places out of reach, a hole too small to be good."""
    source, found = contour.source, []
    if contour.pinched:
        found += _pinched(contour, rules, chambers)
    elif contour.has_leads and rules.half > 0.0:
        points = source.contour.path.flattened(max(FLATNESS, 0.1 * rules.kerf))
        away = shapely.distance(shapely.points(points), contour.line)
        worst = int(np.argmax(away))
        if away[worst] > rules.half + rules.kerf:
            left = f"{away[worst] - rules.half:.2g} mm of it stay uncut"
            words = f"a place of part {source.part} is narrower than the kerf: {left}"
            several = "{n} contours have a place narrower than the kerf, which stays uncut"
            px, py = points[worst].tolist()
            work = MissingWork("place", 1, ((px, py),))
            found.append(_Remark("L612", words, several, _place(contour.index, source, px, py), work))
    narrowest = NARROWEST_HOLE * rules.data.thickness
    if rules.kind == CutMethod.PLASMA and contour.hole and contour.diameter < narrowest:
        words = f"a hole of {contour.diameter:.3g} mm, below {NARROWEST_HOLE:g} thicknesses, will be conical"
        several = f"{{n}} holes below {narrowest:g} mm, {NARROWEST_HOLE:g} thicknesses, will be conical"
        found.append(_Remark("L615", words, several, _place(contour.index, source, *source.contour.path.start)))
    return found
