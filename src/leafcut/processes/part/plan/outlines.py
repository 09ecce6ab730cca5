"""Outlines and openings: plan the tool path along each edge, place the tabs, select start points, and generate the
motion.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from leafcut.errors import PlanError, count_of
from leafcut.geometry.arrays import Point
from leafcut.geometry.offset import offset_closed_path
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.milling.entries import ABOVE, MOST_LEGS, cut_along, enter_level
from leafcut.processes.part.model import Edge, TabRules
from leafcut.processes.part.plan.finishing import (
    TOLERANCE,
    FinishingPass,
    crowded_place,
    finishing_pass,
    interval_beside,
    pieces_from,
    ring_of,
    roughing_path,
)
from leafcut.processes.part.plan.task import Mill, PartHeights

#: Number of start points per tool path. Start points on tabs are skipped.
STARTS = 16
#: Candidate positions for a tab within its section of the path, in order of preference. Straight sections are
#: preferred.
_TAB_POSITIONS = (0.5, 0.4, 0.6, 0.3, 0.7, *(0.3 + 0.02 * k for k in range(1, 20) if k % 5))
#: Maximum half length of a tab interval, and minimum distance between a start point and a tab, relative to the path
#: length per tab. If every start point is too close, the tool starts at the start of the path.
_LONGEST_TAB, _RAMP_ROOM = 0.25, 0.04
#: Minimum distance between a start point and a tab that leaves room for a ramp, mm. 24 ramp legs of this length descend
#: 1.2 mm at 3°.
_LEAST_ROOM = 1.0
#: Maximum depth and inscribed radius of the material that remains in a corner, in mill radii. If more remains, a notch
#: or slot is too narrow for the mill.
_DEEPEST_CORNER, _WIDEST_CORNER = 1.02, 0.35
#: Precision of interval lengths and heights, mm.
_EXACT = 1e-6
#: Intervals (from, to) along a path, mm.
_Intervals = tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class OutlineCut:
    """A closed path of the tool centre along an edge, in milling direction.

    Attributes
    ----------
    tabs
        Intervals (from, to) along the path that cross a tab, mm.
    starts
        Distances of the start points along the path, mm.
    later
        Indices of the edges around this edge.
    path, passes
        If there is a finishing allowance, `path` is the roughing path, and `passes` contains a finishing pass for each
        start point.
    lead
        Distance from the entry point to the start point, mm. The mill ramps down along it, and ends at the start point.
        It is 0 if the mill spirals down (see `with_ramps`).
    """

    edge: int
    path: Polyline
    tabs: tuple[tuple[float, float], ...]
    starts: tuple[float, ...]
    later: tuple[int, ...]
    passes: tuple[FinishingPass, ...] = ()
    lead: float = 0.0

    @property
    def choices(self) -> list[tuple[Point, Point]]:
        """Entry and exit point for each start point."""
        entries = [self.path.point_at((start - self.lead) % self.path.length) for start in self.starts]
        ends = [self.path.point_at(start) for start in self.starts] if self.lead else entries
        exits = [finishing.end for finishing in self.passes] or ends
        return list(zip(entries, exits, strict=True))

    @property
    def centres(self) -> shapely.MultiLineString:
        """All paths of the tool centre."""
        finishing = [piece for one in self.passes[:1] for piece, _ in one.pieces]
        return shapely.MultiLineString([ring_of(self.path), *(piece.flattened(TOLERANCE) for piece in finishing)])

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Descend along the path, cut between the tabs, and finish the wall."""
        _cut_outline(builder, self, self.starts[choice], mill, heights)
        if self.passes:
            _finish_outline(builder, self.passes[choice], mill, heights)


def edges_of(contours: Sequence[Contour]) -> tuple[list[Edge], list[Issue]]:
    """Return the closed edges of a part, and issues about marks and open paths, which are not milled.

    Contours with an even nesting depth are outlines. Contours with an odd nesting depth are openings.
    """
    chosen = [k for k, contour in enumerate(contours) if contour.path.closed and contour.kind == "cut"]
    number = {index: k for k, index in enumerate(chosen)}
    edges = []
    for index in chosen:
        around, parent = [], contours[index].parent
        while parent >= 0:
            around.append(number[parent])
            parent = contours[parent].parent
        contour = contours[index]
        edges.append(Edge(contour.path, contour.is_hole, tuple(around), _name(contour), contour.layer))
    left = [contour.path for k, contour in enumerate(contours) if k not in number]
    issues = []
    if left:
        words = Message(
            "the program does not mill {}; engrave lines with --operations", count_of(len(left), "open or marked line")
        )
        issues.append(Issue("L707", words, missing=missing_paths("line", left)))
    return edges, issues


def plan_cuts(
    edges: Sequence[Edge],
    radius: float,
    climb: bool,
    tabs: TabRules,
    sheet: shapely.Polygon | None = None,
    finish: float = 0.0,
) -> tuple[list[OutlineCut], list[Issue]]:
    """Plan the tool path along each edge and place its tabs.

    A short outline gets fewer tabs than requested, but at least two. If the `sheet` is known, all tabs lie inside it.

    Returns
    -------
    cuts
        The tool paths.
    issues
        Issues about edges that are not milled completely or have no tabs.

    Raises
    ------
    PlanError
        An outline is too short for two tabs, a cut would go through a tab, or the finishing allowance `finish`, mm,
        does not fit.
    """
    milled: list[tuple[int, Polyline]] = []
    narrow, loose, fewer = [], [], []
    necks: dict[int, tuple[Edge, Point]] = {}
    crowded: dict[int, tuple[Edge, Point]] = {}
    lines = shapely.STRtree([ring_of(edge.path) for edge in edges])
    for number, edge in enumerate(edges):
        rings = offset_closed_path(edge.path, -radius if edge.inside else radius, TOLERANCE)
        # A grown outline may close the mouth of a notch that is narrower than the tool.
        rings, closed_notches = [ring for ring in rings if ring.area > 0.0], [ring for ring in rings if ring.area < 0.0]
        if not rings:
            narrow.append(edge)
        branch = _narrow_branch(edge, radius)
        if len(rings) > 1 or closed_notches or branch:
            necks[number] = edge, branch or edge.path.start
        for ring in rings:
            if place := crowded_place(ring_of(ring), edge, lines, radius):
                crowded[number] = edge, place
                continue
            milled.append((number, ring if climb == edge.inside else ring.reversed()))
    cuts = []
    rough = [roughing_path(edges[number], path, lines, radius, finish) if finish else path for number, path in milled]
    all_paths = shapely.STRtree([ring_of(path) for path in (*(path for _, path in milled), *(rough if finish else ()))])
    for own, (number, path) in enumerate(milled):
        edge = edges[number]
        number_of_tabs = 0 if edge.is_bore else tabs.number_on(path.length, 2.0 * radius)
        if edge.inside:
            number_of_tabs = number_of_tabs if number_of_tabs == tabs.count else 0
        elif number_of_tabs < tabs.fewest:
            raise _no_room(edge, path.length, tabs, radius)
        elif number_of_tabs < tabs.count:
            fewer.append(edge)
        ours = {own, own + len(milled)}
        places = _tab_intervals(
            path, rough[own], edge.inside, number_of_tabs, tabs, radius, finish, all_paths, ours, sheet
        )
        if places is None and not edge.inside:
            raise PlanError(
                "{}: another cut, or the cut on the other side of a corner, would cut through a tab, or a tab would "
                "reach the edge of the sheet; move the parts at least {:g} mm apart and {:g} mm from the edge, use a "
                "smaller mill, change --tabs or --tab-width, or give --tabs 0",
                edge.name,
                tabs.least_gap(radius, finish),
                2.0 * radius + finish + tabs.web,
            )
        exact, intervals = places or ((), ())
        is_loose = edge.inside and not edge.is_bore and not intervals
        if is_loose and not shapely.Polygon(rough[own].flattened(TOLERANCE)).buffer(-radius).is_empty:
            loose.append(edge)
        # A start point near a tab would leave no room for a ramp, or for the leads of the finishing pass.
        margin = max(_RAMP_ROOM * path.length / number_of_tabs, _LEAST_ROOM) + 3.0 * finish if intervals else 0.0
        starts = [
            s
            for s in (np.arange(STARTS) * rough[own].length / STARTS).tolist()
            if not any(low - margin <= s <= high + margin for low, high in intervals)
        ] or [0.0]
        passes: list[FinishingPass] = []
        if finish:
            waste_left = edge.inside == (path.area > 0.0)
            passes = [
                finishing_pass(path, exact, rough[own].point_at(s), finish, waste_left=waste_left) for s in starts
            ]
            # A pass without leads leaves a mark.
            kept = [k for k, one in enumerate(passes) if one.has_leads] or range(len(passes))
            starts, passes = [starts[k] for k in kept], [passes[k] for k in kept]
        cuts.append(OutlineCut(number, rough[own], intervals, tuple(starts), edge.within, tuple(passes)))
    return cuts, [
        *_narrow_issues(narrow, radius),
        *_neck_issues(list(necks.values()), radius),
        *_crowded_issues(list(crowded.values()), radius),
        *_loose_issues(loose, tabs),
        *_fewer_issues(fewer, tabs),
    ]


def with_ramps(cut: OutlineCut, mill: Mill, heights: PartHeights) -> OutlineCut:
    """Return the cut with the lead of its ramps, if the path is long enough to ramp down by a whole step.

    Start points too close to a tab for a ramp beside it are left out, unless no others exist.
    """
    levels = _turn_levels(cut, mill, heights)
    slope = math.tan(mill.data.entry_angle)
    ramp = (levels[0] - levels[1]) / slope
    if ramp > cut.path.length:
        return cut
    room = max(high - low for high, low in pairwise(levels)) / (slope * MOST_LEGS) + _EXACT
    kept = [
        k
        for k, start in enumerate(cut.starts)
        if not any(low - room < start < high + room for low, high in _on_both_laps(cut))
    ] or range(len(cut.starts))
    return replace(
        cut,
        starts=tuple(cut.starts[k] for k in kept),
        passes=tuple(cut.passes[k] for k in kept if cut.passes),
        lead=ABOVE / slope + ramp,
    )


def _on_both_laps(cut: OutlineCut) -> list[tuple[float, float]]:
    """Return the intervals of the tabs along three laps of the path, because a tab may cross the first point."""
    length = cut.path.length
    return [(low + lap, high + lap) for low, high in cut.tabs for lap in (-length, 0.0, length)]


def _no_room(edge: Edge, length: float, tabs: TabRules, radius: float) -> PlanError:
    """Create the error for an outline that is too short for its tabs. The message suggests options that fit."""
    width = tabs.width_of_fewest(length, 2.0 * radius)
    return PlanError(
        "{}: the tool path of {:.4g} mm has no room for {} of {:g} mm; {}. If it is a hole, draw the outline "
        "of its part around it",
        edge.name,
        length,
        count_of(tabs.fewest, "tab"),
        tabs.width,
        Message("give --tab-width {:g}mm, or --tabs 0", width) if width >= 1.0 else Message("give --tabs 0"),
    )


def _narrow_branch(edge: Edge, radius: float) -> Point | None:
    """Return a point in a notch or slot that is too narrow for the mill, or None if the mill fits everywhere.

    Material in corners does not count. In a corner of 60°, the remaining material is one radius deep and holds a circle
    with a third of the radius.
    """
    shape = shapely.Polygon(ring_of(edge.path))
    first = -radius if edge.inside else radius
    milled = shape.buffer(first, quad_segs=32).buffer(-first, quad_segs=32)
    rest = shape.difference(milled) if edge.inside else milled.difference(shape)
    if rest.is_empty or milled.is_empty:
        return None
    corners = shapely.get_coordinates(rest)
    depths = shapely.distance(shapely.points(corners), milled.boundary)
    wide = rest.buffer(-_WIDEST_CORNER * radius)
    if depths.max() <= _DEEPEST_CORNER * radius and wide.is_empty:
        return None
    x, y = corners[depths.argmax()] if wide.is_empty else wide.representative_point().coords[0]
    return float(x), float(y)


def _tab_intervals(
    path: Polyline,
    rough: Polyline,
    inside: bool,
    count: int,
    tabs: TabRules,
    radius: float,
    finish: float,
    all_paths: shapely.STRtree,
    ours: Collection[int],
    sheet: shapely.Polygon | None,
) -> tuple[_Intervals, _Intervals] | None:
    """Find a position for each of `count` tabs on an edge.

    Because cuts end in half circles, each interval is one tool diameter longer than the tab is wide. No other cut goes
    through a tab. `ours` contains the indices in `all_paths` of the two paths along this edge.

    Returns
    -------
    exact, rough
        The intervals over the tabs, in order, along the exact path and along the roughing path. The function returns
        None if a tab does not fit anywhere.
    """
    share = path.length / max(count, 1)
    intervals: list[_Intervals] = []

    def in_roughing(place: tuple[float, float]) -> tuple[float, float] | None:
        low, high = place
        area = tabs.area(
            path.point_at(low),
            path.point_at(high),
            path.point_at(0.5 * (low + high)),
            radius,
            finish,
            waste_left=inside == (path.area > 0.0),
        )
        if not _holds(path, place, area, radius, all_paths, ours, sheet):
            return None
        return interval_beside(rough, area, radius) if finish else place

    for number in range(count):
        middles = [(number + position) * share for position in _TAB_POSITIONS]
        places = [(s - half, s + half) for s in middles if (half := _half_length(path, s, tabs, radius, share))]
        straight = [place for place in places if _is_straight(path.piece(*place))]
        tab = next(((place, other) for place in (*straight, *places) if (other := in_roughing(place))), None)
        if tab is None:
            return None
        intervals.append(tab)
    return tuple(exact for exact, _ in intervals), tuple(other for _, other in intervals)


def _is_straight(piece: Polyline) -> bool:
    return piece.n_segments == 1 and not piece.bulges.any()


def _half_length(path: Polyline, middle: float, tabs: TabRules, radius: float, share: float) -> float | None:
    """Return half the length of a tab interval, mm, or None if the path bends too much for a tab.

    The width of a tab is the straight distance between the cuts, so the interval is longer on a bent path.
    """
    wanted = tabs.width + 2.0 * radius

    def too_short(half: float) -> bool:
        return math.dist(path.point_at(middle - half), path.point_at(middle + half)) < wanted - _EXACT

    low, high = 0.5 * wanted, _LONGEST_TAB * share
    if not too_short(low):
        return low
    if too_short(high):
        return None
    while high - low > _EXACT:
        half = 0.5 * (low + high)
        low, high = (half, high) if too_short(half) else (low, half)
    return high


def _holds(
    path: Polyline,
    place: tuple[float, float],
    area: shapely.Polygon,
    radius: float,
    all_paths: shapely.STRtree,
    ours: Collection[int],
    sheet: shapely.Polygon | None,
) -> bool:
    if sheet is not None and not sheet.covers(area):
        return False
    near = radius - TOLERANCE
    if any(other not in ours for other in all_paths.query(area, predicate="dwithin", distance=near)):
        return False
    low, high = place
    rest = shapely.LineString(path.piece(high, low + path.length).flattened(0.5 * TOLERANCE))
    return not shapely.dwithin(rest, area, near)


def _name(contour: Contour) -> str:
    x, y = contour.path.start
    if contour.is_hole:
        return Message("opening at ({:.4g}, {:.4g})", x, y)
    return Message("outline at ({:.4g}, {:.4g})", x, y)


def missing_paths(what: str, paths: Sequence[Polyline]) -> MissingWork:
    """Return the paths as missing work, including the outlines of closed paths. `what` is a noun for a single path."""
    places: list[Point] = [path.start for path in paths]
    return MissingWork(what, len(paths), tuple(places), tuple(path for path in paths if path.closed))


def _narrow_issues(narrow: Sequence[Edge], radius: float) -> list[Issue]:
    if not narrow:
        return []
    number = count_of(len(narrow), "opening")
    words = Message("the program does not mill {} narrower than the mill of {:g} mm", number, 2.0 * radius)
    x, y = narrow[0].path.start
    where = Message("the first at ({:.4g}, {:.4g}); drill it, or use a smaller mill", x, y)
    return [Issue("L707", words, where, missing=missing_paths("opening", [edge.path for edge in narrow]))]


def _neck_issues(necks: Sequence[tuple[Edge, Point]], radius: float) -> list[Issue]:
    if not necks:
        return []
    number = count_of(len(necks), "edge")
    words = Message(
        "the program does not completely mill {} with a gap or corner too narrow for the mill of {:g} mm",
        number,
        2.0 * radius,
    )
    where = Message("the first at ({:.4g}, {:.4g}); use a smaller mill", *necks[0][1])
    return [Issue("L707", words, where, missing=missing_paths("place", [edge.path for edge, _ in necks]))]


def _crowded_issues(crowded: Sequence[tuple[Edge, Point]], radius: float) -> list[Issue]:
    if not crowded:
        return []
    number = count_of(len(crowded), "edge")
    words = Message(
        "the program does not mill {} closer to another edge than the diameter of the mill, {:g} mm",
        number,
        2.0 * radius,
    )
    where = Message("the first at ({:.4g}, {:.4g}); move them apart, or use a smaller mill", *crowded[0][1])
    return [Issue("L707", words, where, missing=missing_paths("edge", [edge.path for edge, _ in crowded]))]


def _fewer_issues(fewer: Sequence[Edge], tabs: TabRules) -> list[Issue]:
    if not fewer:
        return []
    words = Message("fewer tabs hold {} too short for {} tabs", count_of(len(fewer), "outline"), tabs.count)
    x, y = fewer[0].path.start
    return [Issue("L709", words, Message("the first at ({:.4g}, {:.4g})", x, y), severity=Severity.NOTE)]


def _loose_issues(loose: Sequence[Edge], tabs: TabRules) -> list[Issue]:
    if not loose:
        return []
    number = count_of(len(loose), "opening")
    words = Message("the slug comes loose inside {} without tabs", number)
    if tabs.count:
        words = Message("the slug comes loose inside {} too short for {} tabs", number, tabs.count)
    return [Issue("L708", words, severity=Severity.NOTE)]


# -- motion ----------------------------------------------------------------------------------------------------------


def _cut_outline(builder: ToolpathBuilder, cut: OutlineCut, start: float, mill: Mill, heights: PartHeights) -> None:
    """Cut level turns around the edge, from the top down. Below the tops of the tabs, cut between the tabs."""
    if not cut.lead:
        _spiral_down(builder, cut, start, mill, heights)
        levels = _levels(heights.tab_top, mill, heights)
    else:
        levels = _turn_levels(cut, mill, heights)
        whole = [z for z in levels if not cut.tabs or z >= heights.tab_top - _EXACT]
        _ramp_down_along(builder, cut, start, whole, mill)
        levels = levels[len(whole) - 1 :]
    if cut.tabs:
        _cut_between_tabs(builder, cut, start, levels, mill, heights)


def _turn_levels(cut: OutlineCut, mill: Mill, heights: PartHeights) -> list[float]:
    """Return the top of the plate and the heights of the level turns.

    At least one turn runs above the tabs, and the turn after it cuts the material above them.
    """
    levels = _levels(0.0, mill, heights)
    if not cut.tabs or levels[1] >= heights.tab_top - _EXACT:
        return levels
    return [0.0, *_levels(heights.tab_top, mill, heights)]


def _ramp_down_along(
    builder: ToolpathBuilder, cut: OutlineCut, start: float, levels: Sequence[float], mill: Mill
) -> None:
    """Cut a level turn at each height. All ramps lie on the same part of the path, which ends at the start point.

    Each ramp runs parallel to the previous ramp, so it never cuts deeper than a step, and the turn at the end of the
    last ramp removes the rest.
    """
    path, data = cut.path, mill.data
    ramp = (levels[0] - levels[1]) / math.tan(data.entry_angle)
    entry, first = ((start - back) % path.length for back in (cut.lead, ramp))
    ramp_feed = data.ramp_feed(levels[0] - levels[1])
    builder.feed(z=ABOVE, feed=data.tool.feed)
    cut_along(builder, path.piece(entry, entry + cut.lead - ramp), ramp_feed, (ABOVE, levels[0]))
    for high, low in pairwise(levels):
        cut_along(builder, path.piece(first, first + ramp), ramp_feed, (high, low))
        cut_along(builder, path.piece(first + ramp, first + path.length), data.tool.feed)
    cut_along(builder, path.piece(first, first + ramp), data.tool.feed)


def _spiral_down(builder: ToolpathBuilder, cut: OutlineCut, start: float, mill: Mill, heights: PartHeights) -> None:
    """Spiral down along a short path, to the tops of the tabs if there are any, and cut a level turn there."""
    data = mill.data
    length, feed = cut.path.length, data.tool.feed
    loop = cut.path.piece(start, start + length)
    level = heights.tab_top if cut.tabs else heights.bottom
    builder.feed(z=ABOVE, feed=feed)
    drop = ABOVE - level
    # From the second turn on, the depth of cut is the descent per turn.
    turns = math.ceil(drop / min(mill.step, length * math.tan(data.entry_angle)) - 1e-9)
    slope = math.atan2(drop / turns, length)
    for turn in range(turns):
        high, low = (ABOVE - drop * (turn + k) / turns for k in (0, 1))
        cut_along(builder, loop, min(feed, data.plunge_feed / math.sin(slope)), (high, low))
    cut_along(builder, loop, feed)


def _cut_between_tabs(
    builder: ToolpathBuilder,
    cut: OutlineCut,
    start: float,
    levels: Sequence[float],
    mill: Mill,
    heights: PartHeights,
) -> None:
    for top, level in pairwise(levels):
        for piece, is_tab in pieces_from(cut.path, cut.tabs, start):
            if is_tab:
                builder.feed(z=heights.tab_top, feed=mill.data.tool.feed)
            else:
                _ramp_down(builder, piece, top, level, mill)
            cut_along(builder, piece, mill.data.tool.feed)


def _finish_outline(builder: ToolpathBuilder, finishing: FinishingPass, mill: Mill, heights: PartHeights) -> None:
    """Follow the exact path at full depth. The mill moves inside the slot that roughing has cut."""
    for piece, is_tab in finishing.pieces:
        if is_tab:
            builder.feed(z=heights.tab_top, feed=mill.data.tool.feed)
        elif builder.position[2] > heights.bottom + _EXACT:
            for top, level in pairwise(_levels(heights.tab_top, mill, heights)):
                _ramp_down(builder, piece, top, level, mill)
        cut_along(builder, piece, mill.data.tool.feed)


def _levels(top: float, mill: Mill, heights: PartHeights) -> list[float]:
    """Return evenly spaced heights from `top` down to the lowest cut, at most a step-down apart, mm."""
    drop = top - heights.bottom
    count = max(math.ceil(drop / mill.step - 1e-9), 1)
    return [top - drop * k / count for k in range(count + 1)]


def _ramp_down(builder: ToolpathBuilder, piece: Polyline, top: float, level: float, mill: Mill) -> None:
    data = mill.data
    if enter_level(builder, piece, top, level, data, shapely.Polygon(), mill.climb).kind == "plunge":
        raise PlanError(
            "there is no room for a ramp of {:.3g} degrees between two tabs; give a larger --entry-angle, a "
            "smaller --step-down, or fewer --tabs",
            math.degrees(data.entry_angle),
        )
