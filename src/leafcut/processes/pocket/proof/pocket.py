"""Verify a pocketing program by simulation: it must not gouge, cut too deep, or make rapids in material."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Points, consecutive_segments
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import FINE, chords_per_quarter
from leafcut.material.engagement import Engaged, engagement_along_path
from leafcut.material.removal import Removal, cleared_area, measure_removal, steps_near
from leafcut.material.step_over import measure_widest_step_overs
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.material.tool_steps import ToolSteps, steps_along_path
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.pocket import FILM, Pocket, PocketPath, PocketPiece, PocketRules
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.model.turns import arc_turns
from leafcut.proof.difference import limit_differences, position_text
from leafcut.proof.surface import surface_reaches_into_area

#: Tolerance for heights in the program, mm (half of 0.0001 inch is 0.00127 mm), and for the chords of walls.
HEIGHT_TOLERANCE = 0.002
#: Minimum height above the cleared floor at which a rapid may end, mm.
OVER = 0.4
#: Maximum width of a film that is ignored, in tool diameters.
AIR_FILM = 0.01


@dataclass(frozen=True, eq=False)
class PocketCut:
    """A feed move.

    Attributes
    ----------
    row, line
        Row in the toolpath, and line in the program.
    path
        Path of the tool tip, float64[n, 3], mm.
    bulge
        Bulge of an arc of at most half a turn (`geometry.polyline`), or 0 for all other moves.
    """

    row: int
    line: int
    path: NDArray[np.float64]
    bulge: float = 0.0

    @property
    def z(self) -> float:
        """Height at the end of the move, mm."""
        return float(self.path[-1, 2])

    @property
    def height_difference(self) -> float:
        """Height difference between the highest and the lowest point of the move, mm."""
        return float(np.ptp(self.path[:, 2]))

    @property
    def vertices(self) -> NDArray[np.float64]:
        """The path of the move in the plane, as vertices of a polyline, float64[n, 3]. Arcs stay arcs."""
        points = self.path[[0, -1], :2] if self.bulge else self.path[:, :2]
        return np.column_stack([points, np.append(np.full(len(points) - 1, self.bulge), 0.0)])


def check_pockets(
    written: Toolpath,
    pockets: Sequence[Pocket],
    rules: PocketRules,
    depths: Sequence[float],
    retract: float,
    tops: Sequence[float] = (),
) -> list[Difference]:
    """Find the gouges and dangerous rapids of a program. If the list is empty, the program obeys these rules:

    1. No feed move is deeper than its pocket. Below the surface, no feed move takes the tool beyond a wall by more than
       the tolerance.
    2. Each feed move starts and ends at a known position.
    3. Rapids below the R plane are vertical. A rapid that descends below the R plane ends above an area that earlier
       feed moves cleared under the whole tool, or above a pocket whose material starts lower.

    Parameters
    ----------
    depths
        Depth of each pocket below the surface, mm, positive.
    tops
        Height of the material above each pocket before milling, mm. By default, all heights are 0.
    """
    cuts = list(cutting_moves(written, rules.tolerance))
    low = _lower_tops(pockets, tops, rules)
    wrong = [*_unknown_position_differences(written), *_dangerous_rapids(written, cuts, rules, retract, low)]
    return limit_differences([*wrong, *_cuts_beyond_walls(cuts, pockets, rules, depths)])


@dataclass(frozen=True, eq=False)
class SimulatedLevel:
    """The material removed from a pocket at height `z`, and the maximum distance between neighbouring passes, mm."""

    z: float
    number: int
    removal: Removal
    step_over: float


def simulate_levels(
    written: Toolpath,
    pockets: Sequence[Pocket],
    rules: PocketRules,
    levels: Sequence[Sequence[float]],
    finishing: Sequence[Sequence[float]] = (),
) -> list[SimulatedLevel]:
    """Simulate each pocket at its `levels` and at the heights of its finishing passes, mm.

    The step-over of a finishing pass is the distance to the passes on the next lower level. Levels with identical paths
    are only simulated once.
    """
    cuts = list(cutting_moves(written, rules.tolerance))
    shapes = [pocket.region(rules.tolerance) for pocket in pockets]
    opened = _area_in_helices(written, cuts, rules)
    known: dict[tuple[int, bytes], tuple[Removal, float]] = {}
    rows = []
    at: dict[float, list[Points]] = {}

    def pieces(z: float) -> list[Points]:
        if z not in at:
            at[z] = list(_connected_paths(cuts, z))
        return at[z]

    for number, (pocket, shape) in enumerate(zip(pockets, shapes, strict=True)):
        own = levels[number]
        for z in sorted({*own, *(finishing[number] if finishing else ())}):
            lower = max((level for level in own if level <= z), default=z)
            mine, more = (
                [p for p in some if _lies_in(p, shape)] for some in (pieces(z), [] if z in own else pieces(lower))
            )
            key = (number, b"".join(np.round(p, 4).tobytes() for p in (*mine, *more)))
            if key not in known:
                removed = measure_removal(pocket, path_of_cuts(mine), rules)
                path, room = steps_along_path(path_of_cuts([*mine, *more]), rules), removed.centres.difference(opened)
                known[key] = removed, measure_widest_step_overs(path, room, rules).step_over
            rows.append(SimulatedLevel(z, number, *known[key]))
    return rows


def fast_cut_differences(written: Toolpath, rules: PocketRules, feed: float) -> list[Difference]:
    """Find moves below the surface that cut material faster than the feed of the mill, mm/s.

    A faster move must be level, and earlier moves at the same height must have cleared its whole path. The path is
    sampled (`material.engagement`). Films up to a hundredth of the diameter are ignored, because passes within the
    tolerance may leave such films. At the same feed, their chips are only a fifth as thick as usual.
    """
    cuts = list(cutting_moves(written, rules.tolerance))
    speed = {cut.row: float(written.value[cut.row]) for cut in cuts}
    fast = {row for row, value in speed.items() if value > feed * (1.0 + 1e-6)}
    wrong = [
        (cut, Message("goes down")) for cut in cuts if cut.row in fast and cut.height_difference > HEIGHT_TOLERANCE
    ]
    for there, path, engaged in engaged_levels(cuts, rules, {cut.row for cut in cuts if cut.row in fast}):
        wide = engaged.width > max_ignored_film(rules)
        wrong += [
            (there[number], Message("cuts"))
            for number in np.unique(path.piece[wide]).tolist()
            if there[number].row in fast
        ]
    return limit_differences(
        [
            Difference(
                Message("feed"),
                0,
                cut.line,
                Message(
                    "a move at {:g} mm/min {} near {}; the mill cuts at {:g} mm/min at most",
                    60.0 * speed[cut.row],
                    what,
                    position_text(*cut.path[-1]),
                    60.0 * feed,
                ),
            )
            for cut, what in sorted(wrong, key=lambda one: one[0].row)
        ]
    )


def max_ignored_film(rules: PocketRules) -> float:
    """Return the maximum width of a film that is ignored, mm."""
    return max(AIR_FILM * rules.tool_diameter, 6.0 * rules.tolerance)


def engaged_levels(
    cuts: Sequence[PocketCut], rules: PocketRules, rows: Collection[int]
) -> Iterator[tuple[list[PocketCut], ToolSteps, Engaged]]:
    """Yield the moves at each height, their sampled path, and the engagement along the path.

    Only heights at which a move of `rows` ends are included. The engagement at the end of a descent is left out.
    """
    known: dict[bytes, tuple[ToolSteps, Engaged]] = {}
    for z in sorted({round(cut.z, 3) for cut in cuts if cut.row in rows}):
        there = [cut for cut in cuts if abs(cut.z - z) <= HEIGHT_TOLERANCE]
        level = np.array([cut.height_difference <= HEIGHT_TOLERANCE for cut in there])
        paths = [cut.vertices if flat else cut.vertices[-1:] for cut, flat in zip(there, level.tolist(), strict=True)]
        key = b"".join([level.tobytes(), *(np.round(points, 4).tobytes() for points in paths)])
        if key not in known:
            path = steps_along_path(path_of_cuts(paths), rules)
            known[key] = path, engagement_along_path(path, rules, ~level[path.piece])
        yield there, *known[key]


def path_of_cuts(pieces: Sequence[Points]) -> PocketPath:
    """Return a path with a section for each polyline. The polylines are given by their vertices, float64[n, 3]."""
    return PocketPath("program", tuple(PocketPiece(Polyline(p)) for p in pieces))


def _area_in_helices(written: Toolpath, cuts: Sequence[PocketCut], rules: PocketRules) -> Any:
    """Return the area inside full circles of the tool centre, such as the turns of a helix. The tool clears this area.

    If the circle is larger than the tool radius, a core remains inside, so the circle does not count.
    """
    turned: dict[tuple[float, ...], float] = {}
    for cut in cuts:
        if written.kind[cut.row] == Kind.FEED:
            continue
        x, y = written.arcs[int(written.ref[cut.row])].center[:2]
        from_centre = cut.path[:, :2] - (x, y)
        radius = float(np.hypot(*from_centre[0]))
        if radius > rules.radius:
            continue
        angles = np.unwrap(np.arctan2(from_centre[:, 1], from_centre[:, 0]))
        key = tuple(np.round((x, y, radius, 0.0 if cut.height_difference > 0.0 else cut.z), 2).tolist())
        turned[key] = turned.get(key, 0.0) + abs(float(angles[-1] - angles[0]))
    whole = [key for key, turn in turned.items() if turn >= 2.0 * np.pi - 1e-3]
    return shapely.union_all([shapely.Point(x, y).buffer(radius, quad_segs=64) for x, y, radius, _ in whole])


def gouge_differences(simulated: Sequence[SimulatedLevel], pockets: Sequence[Pocket]) -> list[Difference]:
    """Create a difference for each simulated level at which the tool cuts into a wall."""
    wrong = []
    for level in simulated:
        gouges = level.removal.gouges
        if gouges.area > 0.0:
            point, name = gouges.representative_point(), pockets[level.number].label
            words = Message("{} at Z{:.3f}: {:.3g} mm² are cut beyond the wall", name, level.z, gouges.area)
            wrong.append(
                Difference(Message("gouge"), 0, 0, Message("{} near {}", words, position_text(point.x, point.y)))
            )
    return wrong


def step_over_differences(
    simulated: Sequence[SimulatedLevel], pockets: Sequence[Pocket], rules: PocketRules
) -> list[Difference]:
    """Create a difference for each level whose passes are further apart than the requested step-over."""
    return [
        Difference(
            Message("step-over"),
            0,
            0,
            Message(
                "{} at Z{:.3f}: passes are {:.3f} mm apart, {:.4g} mm are allowed",
                pockets[level.number].label,
                level.z,
                level.step_over,
                rules.step_over,
            ),
        )
        for level in simulated
        if not rules.allows_step_over(level.step_over)
    ]


def depth_differences(
    written: Toolpath, rules: PocketRules, step: float, pockets: Sequence[Pocket] = (), tops: Sequence[float] = ()
) -> list[Difference]:
    """Find levels at which the tool cuts more than `step` mm deeper than earlier levels.

    Strips narrower than `FILM` diameters are allowed, because a finishing pass removes the stock over its full depth.
    `tops` contains the heights of the material above the pockets before milling, mm. By default, all heights are 0.
    """
    lower = _lower_tops(pockets, tops, rules)
    wrong, levels = [], _levels(list(cutting_moves(written, rules.tolerance)))
    for number, level in enumerate(levels):
        if level.z >= -step - HEIGHT_TOLERANCE:
            continue
        over = (
            earlier
            for earlier in levels[:number]
            if level.z + HEIGHT_TOLERANCE < earlier.z <= level.z + step + HEIGHT_TOLERANCE
        )
        above = np.concatenate([np.zeros((0, 2, 2)), *(earlier.steps for earlier in over)])
        new = level.steps[~np.isin(_undirected_keys(level.steps), _undirected_keys(above))]
        if not len(new):
            continue
        left = cleared_area(new, rules).difference(cleared_area(steps_near(above, new, rules), rules))
        left = left.difference(
            shapely.union_all([shape for top, shape in lower if top <= level.z + step + HEIGHT_TOLERANCE])
        )
        wide = left.buffer(-FILM * rules.radius - 2.0 * rules.tolerance)
        if not wide.is_empty:
            point = wide.representative_point()
            where = position_text(point.x, point.y, level.z)
            words = Message("more than the step-down of {:.3f} mm would be cut at once near {}", step, where)
            wrong.append(Difference(Message("too deep"), 0, level.line, words))
    return limit_differences(wrong)


@dataclass
class _Level:
    """Consecutive cuts at the same height, with their segments and the program line of the first cut."""

    z: float
    line: int
    parts: list[NDArray[np.float64]] = field(default_factory=list)

    @property
    def steps(self) -> NDArray[np.float64]:
        return np.concatenate(self.parts)


def _levels(cuts: Sequence[PocketCut]) -> list[_Level]:
    """Return all levels in cutting order, without descents."""
    levels: list[_Level] = []
    for cut in cuts:
        if cut.height_difference > HEIGHT_TOLERANCE:
            continue
        if not levels or abs(levels[-1].z - cut.z) > HEIGHT_TOLERANCE:
            levels.append(_Level(cut.z, cut.line))
        levels[-1].parts.append(consecutive_segments(cut.path[:, :2]))
    return levels


def _undirected_keys(steps: NDArray[np.float64]) -> NDArray[Any]:
    """Return a key for each segment that does not depend on its direction."""
    rounded = np.round(steps, 3) + 0.0
    turned = (rounded[:, 0] > rounded[:, 1])[:, 0] | (
        (rounded[:, 0, 0] == rounded[:, 1, 0]) & (rounded[:, 0, 1] > rounded[:, 1, 1])
    )
    rounded[turned] = rounded[turned, ::-1]
    return np.ascontiguousarray(rounded.reshape(-1, 4)).view("V32").ravel()


def _lies_in(points: Points, shape: Any) -> bool:
    return bool(shape.intersects(shapely.Point(points[0, :2])))


# -- moves -----------------------------------------------------------------------------------------------------------


def cutting_moves(path: Toolpath, tolerance: float) -> Iterator[PocketCut]:
    """Yield the feed moves that go below the surface. Chords replace the arcs."""
    moves = convert_to_straight_moves(
        replace(path, line=np.arange(len(path), dtype=np.int32)), FINE * tolerance, np.inf
    )
    turns = arc_turns(path)
    bulges = {
        row: math.tan(0.25 * sweep)
        for row, sweep in zip(turns.row.tolist(), turns.sweep.tolist(), strict=True)
        if abs(sweep) <= math.pi
    }
    firsts = np.flatnonzero(np.diff(moves.row, prepend=-1))
    for ends in np.split(np.arange(len(moves)), firsts[1:]) if len(moves) else ():
        row = int(moves.path.line[moves.row[ends[0]]])
        points = np.concatenate([moves.ends[ends[:1], :3], moves.ends[ends, 3:]])
        if not moves.rapid[ends[0]] and min(points[0, 2], points[-1, 2]) < -HEIGHT_TOLERANCE:
            yield PocketCut(row, int(path.line[row]), points, bulges.get(row, 0.0))


def _connected_paths(cuts: Sequence[PocketCut], z: float) -> Iterator[Points]:
    """Yield each connected path at height `z`, as the vertices of a polyline, float64[n, 3]."""
    run: list[Points] = []
    for cut in cuts:
        there = np.abs(cut.path[:, 2] - z) <= HEIGHT_TOLERANCE
        on = bool(there.all()) and bool(run) and np.allclose(run[-1][-1, :2], cut.path[0, :2], rtol=0.0, atol=1e-9)
        if run and not on:
            yield _join_cuts(run)
            run = []
        if there.all():
            run.append(cut.vertices)
        elif there[-1]:
            run.append(np.append(cut.path[-1:, :2], [[0.0]], axis=1))
    if run:
        yield _join_cuts(run)


def _join_cuts(run: Sequence[Points]) -> Points:
    return np.concatenate([*(part[:-1] for part in run[:-1]), run[-1]])


def _lower_tops(pockets: Sequence[Pocket], tops: Sequence[float], rules: PocketRules) -> list[tuple[float, Any]]:
    """Return the top height, mm, and the area of each pocket whose material starts below Z0."""
    if not tops:
        return []
    return [(top, pocket.region(rules.tolerance)) for pocket, top in zip(pockets, tops, strict=True) if top < 0.0]


def _cut_lines(cuts: Sequence[PocketCut]) -> Any:
    return shapely.linestrings(
        np.concatenate([cut.path[:, :2] for cut in cuts]),
        indices=np.repeat(np.arange(len(cuts)), [len(cut.path) for cut in cuts]),
    )


# -- checks ----------------------------------------------------------------------------------------------------------


def _unknown_position_differences(path: Toolpath) -> list[Difference]:
    feeds = np.isin(path.kind, [int(kind) for kind in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)])
    known = np.isfinite(np.concatenate([path.before, path.end], axis=1)).all(axis=1)
    words = Message("a cut starts or ends at a position that the program does not state")
    return [
        Difference(Message("gouge"), 0, int(path.line[row]), words) for row in np.flatnonzero(feeds & ~known).tolist()
    ]


def _dangerous_rapids(
    path: Toolpath, cuts: Sequence[PocketCut], rules: PocketRules, retract: float, lower: Sequence[tuple[float, Any]]
) -> list[Difference]:
    before = path.before
    rapid = path.kind == Kind.RAPID
    sideways = (np.isfinite(path.end[:, :2]) & ~(path.end[:, :2] == before[:, :2])).any(axis=1)
    low = np.fmin(before[:, 2], path.end[:, 2]) < retract - HEIGHT_TOLERANCE
    down = low & ~sideways & ~(path.end[:, 2] >= before[:, 2])
    wrong = [
        (row, Message("a rapid may move sideways only at Z{:.3f} or above", retract))
        for row in np.flatnonzero(rapid & low & sideways).tolist()
    ]
    blind = _rapids_into_material(path, np.flatnonzero(rapid & down).tolist(), cuts, rules, lower)
    wrong += [(row, Message("a rapid may go below Z{:.3f} only over cleared area", retract)) for row in blind]
    return [
        Difference(
            Message("rapid in material"),
            0,
            int(path.line[row]),
            Message(
                "{}; this move goes from {} to {}", text, position_text(*before[row]), position_text(*path.end[row])
            ),
        )
        for row, text in sorted(wrong)
    ]


def _rapids_into_material(
    path: Toolpath,
    rows: Sequence[int],
    cuts: Sequence[PocketCut],
    rules: PocketRules,
    lower: Sequence[tuple[float, Any]],
) -> list[int]:
    """Return the rows of vertical rapids that end less than `OVER` mm above material.

    Earlier feed moves must have cleared a disc that is smaller than the tool by the tolerance. `lower` contains the
    pockets whose material starts below 0.
    """
    before, earlier, uncleared = path.before, EarlierCuts(cuts, rules), []
    chords = chords_per_quarter(rules.radius, FINE * rules.tolerance)
    for row in rows:
        centre, height = (
            np.where(np.isnan(before[row]), path.end[row], before[row])[:2],
            path.end[row, 2] - OVER + HEIGHT_TOLERANCE,
        )
        if earlier.has_passed(centre, row, height):
            continue
        disc = shapely.Point(centre).buffer(rules.radius - rules.tolerance, quad_segs=chords)
        cleared = [earlier.cleared_area(centre, row, height), *(shape for top, shape in lower if top <= height)]
        if not shapely.union_all(cleared).covers(disc):
            uncleared.append(row)
    return uncleared


class EarlierCuts:
    """Finds the area around a position that earlier feed moves of a program have cleared. Plunges clear no area."""

    def __init__(self, cuts: Sequence[PocketCut], rules: PocketRules) -> None:
        self.rules, moving = rules, [cut for cut in cuts if np.ptp(cut.path[:, :2], axis=0).any()]
        self._steps = [consecutive_segments(cut.path[:, :2]) for cut in moving]
        self._row = np.array([cut.row for cut in moving], dtype=np.int64)
        self._top = np.array([cut.path[:, 2].max() for cut in moving], dtype=np.float64)
        self._tree = shapely.STRtree([shapely.LineString(cut.path[:, :2]) for cut in moving])

    def has_passed(self, place: Floats, row: int, height: float) -> bool:
        """Return whether the tool centre passed a position at or below `height` mm in a move before `row`."""
        return len(self._cuts_near(place, row, height, 0.1 * self.rules.tolerance)) > 0

    def cleared_area(self, place: Floats, row: int, height: float) -> Any:
        """Return the area around a position that the moves before `row` clear down to `height` mm."""
        near = self._cuts_near(place, row, height, self.rules.tool_diameter)
        steps = steps_near(np.concatenate([np.zeros((0, 2, 2)), *(self._steps[k] for k in near)]), place, self.rules)
        return cleared_area(steps[(steps[:, 0] != steps[:, 1]).any(axis=1)], self.rules)

    def _cuts_near(self, place: Floats, row: int, height: float, distance: float) -> list[int]:
        near = np.sort(self._tree.query(shapely.Point(place), predicate="dwithin", distance=distance))
        chosen: list[int] = near[(self._row[near] < row) & (self._top[near] <= height)].tolist()
        return chosen


def _cuts_beyond_walls(
    cuts: Sequence[PocketCut], pockets: Sequence[Pocket], rules: PocketRules, depths: Sequence[float]
) -> list[Difference]:
    if not cuts:
        return []
    reach = rules.radius - rules.tolerance
    rooms = np.array([pocket.region(rules.tolerance).buffer(-reach, quad_segs=64) for pocket in pockets], dtype=object)
    lines, low, wrong = _cut_lines(cuts), np.array([float(cut.path[:, 2].min()) for cut in cuts]), []
    deep = low[:, None] >= -np.asarray(depths) - HEIGHT_TOLERANCE
    everywhere = shapely.union_all(rooms)
    for allowed in np.unique(deep, axis=0):
        room = shapely.union_all(rooms[allowed])
        shapely.prepare(room)
        rows = np.flatnonzero((deep == allowed).all(axis=1))
        for k in rows[~shapely.covers(room, lines[rows])].tolist():
            if everywhere.covers(lines[k]):
                deepest = max(d for d, one in zip(depths, rooms, strict=True) if one.intersects(lines[k]))
                words = Message("the tool goes to Z{:.3f}; the pocket is {:.3f} mm deep", low[k], deepest)
                wrong.append(Difference(Message("too deep"), 0, cuts[k].line, words))
                continue
            outside = lines[k].difference(room)
            point = outside.representative_point() if not outside.is_empty else lines[k].centroid
            words = Message(
                "the tool of {:g} mm cuts into a wall near {}", rules.tool_diameter, position_text(point.x, point.y)
            )
            wrong.append(Difference(Message("gouge"), 0, cuts[k].line, words))
    return wrong


#: Tolerance for chords and triangles that approximate arcs, mm.
_CHORD_TOLERANCE = 0.06


def stock_top_differences(
    pockets: Sequence[Pocket],
    tops: Sequence[float],
    of_solid: Sequence[Pocket],
    triangles: NDArray[np.float64],
    radius: float,
) -> list[Difference]:
    """Find pockets with higher material than assumed, either above the pocket or within a tool radius of it.

    The check measures the distance to each triangle, and shares no code with the planning of heights.

    Parameters
    ----------
    tops
        Assumed height of the material above each pocket, mm.
    of_solid
        All pockets of the solid. Other pockets count as filled up to their rims.
    triangles
        Surface of the solid, float64[n, 3, 3], mm.
    radius
        Tool radius, mm.
    """
    wrong = []
    for pocket, top in zip(pockets, tops, strict=True):
        own = pocket.region(filled=True)
        around = [other.region(filled=True) for other in of_solid]
        area = shapely.union_all([own, *(other for other in around if other.distance(own) <= 0.0)])
        height = (pocket.top or 0.0) + top
        if surface_reaches_into_area(triangles, area, radius - _CHORD_TOLERANCE, height + _CHORD_TOLERANCE):
            words = Message(
                "{}: the solid is higher than Z{:.3f}, the assumed top of its material", pocket.label, height
            )
            wrong.append(Difference(Message("rapid in material"), 0, 0, words))
    return wrong
