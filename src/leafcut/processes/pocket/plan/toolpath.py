"""Generate the motion of a pocketing program from the paths on a single level.

The motion includes entry moves, links, retracts and finishing passes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point, consecutive_segments
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.geometry.regions import FINE, chords_per_quarter
from leafcut.geometry.zones import touches_any_zone, widen_zones
from leafcut.material.removal import cleared_area, steps_near
from leafcut.model.machine import Machine
from leafcut.model.pocket import FILM, SAME_PLACE, PocketLevels, PocketPath, PocketPiece, PocketRules
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.processes.milling.entries import ABOVE, TOUCH, Descent, cut_along, descend_along_loop, enter_level
from leafcut.processes.milling.mill import MillingData
from leafcut.processes.pocket.plan.region import CentreRegion
from leafcut.processes.pocket.plan.rules import finishing_levels
from leafcut.processes.spindle_moves import end_program, take_tool
from leafcut.units import SECONDS_PER_MINUTE

#: Maximum number of moves of a program.
MOST_MOVES = 3_000_000
#: Number of significant digits in mm/min for feeds that differ from the feed of the tool.
DIGITS = 3


@dataclass(frozen=True, eq=False)
class Clearing:
    """A region of a pocket, and the path that clears the region on one level.

    Attributes
    ----------
    region
        The possible tool centres for the finished walls.
    allowed
        The area of tool centres for roughing (shapely geometry).
    walls
        The finishing pass if roughing leaves stock, otherwise None.
    air
        Tool centres at which a larger mill has cleared everything down to the floor (shapely geometry), or None.
    """

    region: CentreRegion
    allowed: Any
    rough: PocketPath
    levels: PocketLevels
    walls: PocketPath | None = None
    air: Any = None

    @property
    def path(self) -> PocketPath:
        """The path on the last level: the roughing path, followed by the finishing pass if there is stock."""
        walls = () if self.walls is None else self.walls.pieces
        return PocketPath(self.rough.strategy, (*self.rough.pieces, *walls))

    @property
    def start(self) -> Point:
        """Position at which the path starts, mm."""
        return self.rough.pieces[0].path.start

    @property
    def end(self) -> Point:
        """Position at which the path ends, mm."""
        return self.path.pieces[-1].path.end

    def is_in_air(self, place: Point) -> bool:
        """Return whether the tool can descend to the floor without touching material."""
        return self.air is not None and bool(shapely.dwithin(self.air, shapely.Point(place), TOUCH))


@dataclass(frozen=True, eq=False)
class PocketHeights:
    """The heights and positions of a pocketing program, mm.

    `zones`, float64[k, 4], contains keep-out zones that are higher than the retract height. The tool only crosses them
    at the clearance height. If a shank or holder would hit a zone at the retract height, the zone is enlarged by the
    overhang of this shank or holder.
    """

    clearance: float
    retract: float
    always_clearance: bool = False
    end: Point | None = None
    zones: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))


def pocket_motion(
    clearings: Sequence[Clearing],
    heights: PocketHeights,
    data: MillingData,
    machine: Machine,
    *,
    coolant: bool = False,
    pause: bool = False,
    corner_tolerance: float = 0.0,
    rounded: bool = False,
) -> tuple[Toolpath, tuple[Descent, ...]]:
    """Return the motion of the whole program, and all entries into material.

    The tool clears each region level by level, from the top. If roughing leaves stock, the tool then finishes the walls
    in steps of at most two diameters. Most pockets need only one such step. If roughing leaves more than `FILM`, for
    example in a passage that is too narrow for the tool and the stock, the walls are finished level by level.

    Between levels, the tool stays down if it can move straight to the next path and if this is quicker than a retract.
    Otherwise, it rises to the R plane or to the clearance height. Rapids below the surface end slightly above the floor
    that was cut before.

    Parameters
    ----------
    corner_tolerance
        Value of P for G64, mm, or 0 for none.
    rounded
        Whether roughing rounds corners as far as the acceleration requires (G64). All other moves then use exact stop
        (G61).

    Raises
    ------
    PlanError
        The program would have more than `MOST_MOVES` moves.
    """
    moves = sum(p.path.n_segments * len(c.levels.levels) for c in clearings for p in c.path.pieces)
    if moves > MOST_MOVES:
        raise PlanError(
            "the toolpath has too many moves ({:,}); raise --step-down or the tolerance of the drawing", moves
        )
    builder = ToolpathBuilder()
    if corner_tolerance > 0.0:
        builder.blending(640, corner_tolerance)
    if machine.safe_z is not None:
        builder.machine(z=machine.safe_z)
    take_tool(builder, machine, data.tool, heights.clearance, coolant=coolant, pause=pause)
    motion = ClearingMotion(builder, heights, data, machine, rounded=rounded)
    for clearing in clearings:
        motion.clear_region(clearing)
    motion.end_program(coolant)
    return builder.build(), tuple(motion.descents)


class ClearingMotion:
    """Generates the motion that clears several regions in sequence.

    With `down`, the tool is already above the start of the first region, at or below the retract height, and does not
    rise first.
    """

    def __init__(
        self,
        builder: ToolpathBuilder,
        heights: PocketHeights,
        data: MillingData,
        machine: Machine,
        *,
        rounded: bool = False,
        down: bool = False,
    ) -> None:
        self.builder, self.heights, self.data, self.machine = builder, heights, data, machine
        self.rounded = rounded
        self.zones = widen_zones(heights.zones, 0.5 * data.tool.diameter)
        self.descents: list[Descent] = []
        self.down = down

    def clear_region(self, clearing: Clearing) -> None:
        """Clear a region level by level. If roughing leaves stock, finish the walls afterwards."""
        shapely.prepare(clearing.allowed)
        levels, cleared = clearing.levels, ClearedArea(clearing.region.rules)
        top = levels.begin
        runs = _feed_runs(clearing.rough)
        opened = [cleared.add_run(run.path) for run in runs]
        # The tool descends at feed, because the air may contain films.
        opened = [
            max(state, DescentClearance.NEARLY) if clearing.is_in_air(run.start) else state
            for state, run in zip(opened, runs, strict=True)
        ]
        for z in levels.levels:
            for number, run in enumerate(runs):
                # The tool always retracts between pockets.
                stays = number == 0 and top != levels.begin
                self._move_to(run.start, top if number == 0 else z, clearing.allowed if stays else None, z)
                self._enter(run, opened[number], top, z, clearing)
            top = z
        if clearing.walls is not None:
            self._cut_walls(clearing, clearing.walls, cleared)

    def _cut_walls(self, clearing: Clearing, walls: PocketPath, cleared: ClearedArea) -> None:
        radius, levels = clearing.region.rules.radius, clearing.levels
        top = levels.begin
        left = clearing.region.polygon.buffer(radius, quad_segs=32).difference(cleared.area())
        thin = left.buffer(-FILM * radius).is_empty
        runs = _feed_runs(walls)
        opened = [cleared.add_run(run.path) for run in runs]
        for z in finishing_levels(levels, 2.0 * radius) if thin else levels.levels:
            for number, run in enumerate(runs):
                self._move_to(run.start, z, None, z)
                self._enter(run, opened[number], top, z, clearing, walls=True)
            top = z

    def _move_to(self, place: Point, at: float, allowed: Any, z: float) -> None:
        """Move to the start of a series of feed moves at height `z`, mm.

        The tool moves straight at the height `at` if this move stays in `allowed` and is quicker than a retract.
        Otherwise, the tool retracts.
        """
        builder = self.builder
        x, y, now = builder.position
        if self.down and math.dist((x, y), place) <= SAME_PLACE and now >= z - TOUCH:
            return
        if self.down and allowed is not None and now == at and self._is_quicker_at_depth((x, y), place, allowed):
            builder.feed(*place, feed=self.data.tool.feed)
            return
        self._retract((x, y), place)
        builder.rapid(*place)
        if builder.position[2] != self.heights.retract:
            builder.rapid(z=self.heights.retract)

    def _is_quicker_at_depth(self, here: Point, place: Point, allowed: Any) -> bool:
        distance = math.dist(here, place)
        rise = self._travel_height(here, place) - self.builder.position[2]
        velocity, feed = self.machine.rapid_velocity, self.data.tool.feed
        lifted = (2.0 * rise - ABOVE) / velocity[2] + distance / max(velocity[:2]) + ABOVE / feed
        return distance / feed <= lifted and bool(allowed.buffer(TOUCH).covers(shapely.LineString([here, place])))

    def _travel_height(self, here: Point, place: Point) -> float:
        crossing = touches_any_zone([here], [place], self.zones, dogleg=self.machine.rapid_style == "dogleg")[0]
        high = self.heights.always_clearance or bool(crossing)
        return self.heights.clearance if high else self.heights.retract

    def _retract(self, here: Point, place: Point) -> None:
        builder = self.builder
        if self.down:
            builder.rapid(z=self._travel_height(here, place))
            self.down = False
        elif builder.position[2] != self.heights.clearance and self.machine.safe_z is None:
            builder.rapid(z=self.heights.clearance)

    def _enter(
        self,
        run: _FeedRun,
        opened: DescentClearance,
        top: float,
        z: float,
        clearing: Clearing,
        *,
        walls: bool = False,
    ) -> None:
        """Descend to the height `z`, then follow the run.

        If the material below `top` has not been cleared yet, the tool descends with an entry move.
        """
        builder, data = self.builder, self.data
        floor = z if opened is DescentClearance.CLEAR else top
        if floor < 0.0 and builder.position[2] > floor + ABOVE:
            builder.rapid(z=floor + ABOVE)
        if builder.position[2] > z:
            if opened is not DescentClearance.NO:
                if builder.position[2] > z + ABOVE:
                    builder.feed(z=z + ABOVE, feed=data.tool.feed)
                builder.feed(z=z, feed=data.limited_plunge_feed)
            else:
                allowed = clearing.region.polygon if walls else clearing.allowed
                climb = clearing.region.rules.climb
                if run.is_entry:
                    descent = descend_along_loop(builder, run.first_path, top, z, data, allowed, climb)
                else:
                    ring = run.first_path if math.dist(run.first_path.start, run.first_path.end) <= SAME_PLACE else None
                    descent = enter_level(builder, run.path, top, z, data, allowed, climb, ring)
                self.descents.append(descent)
        self.down = True
        if self.rounded and not walls:
            builder.blending(640)
        for piece in run.pieces:
            cut_along(
                builder, piece.path, data.air_feed if piece.kind == "air" else rounded_feed(piece.feed, data.tool.feed)
            )
        if self.rounded and not walls:
            builder.blending(610)

    def end_program(self, coolant: bool) -> None:
        """End the program."""
        builder = self.builder
        builder.rapid(z=self.heights.clearance)
        end_program(builder, self.machine, self.heights.clearance, self.heights.end, coolant=coolant)


@dataclass(frozen=True, eq=False)
class _FeedRun:
    pieces: tuple[PocketPiece, ...]
    path: Polyline

    @property
    def start(self) -> Point:
        return self.path.start

    @property
    def first_path(self) -> Polyline:
        return self.pieces[0].path

    @property
    def is_entry(self) -> bool:
        return self.pieces[0].kind == "entry"


def _feed_runs(path: PocketPath) -> list[_FeedRun]:
    runs: list[list[PocketPiece]] = []
    for piece, gap in zip(path.pieces, (math.inf, *path.gaps), strict=True):
        if gap > 0.0:
            runs.append([])
        runs[-1].append(piece)
    return [_FeedRun(tuple(run), concatenate(*(p.path for p in run))) for run in runs]


def rounded_feed(share: float, feed: float) -> float:
    """Return a share of a tool's feed, mm/s, rounded down to `DIGITS` significant digits in mm/min."""
    if share == 1.0:
        return feed
    value = share * feed * SECONDS_PER_MINUTE
    unit = 10.0 ** (math.floor(math.log10(value)) - DIGITS + 1)
    return math.floor(value / unit + 1e-9) * unit / SECONDS_PER_MINUTE


#: Maximum width of the material under the tool at which the tool may descend straight at feed, in tool radii.
_SLIVER = 0.02
#: Maximum width of the material under the tool at which the tool may descend by rapid, in path tolerances. The
#: verification allows slightly more.
_FILM = 0.5


class DescentClearance(IntEnum):
    """How much of the area under the tool has been cleared before a descent: nothing, nearly everything, or everything.

    If nearly everything has been cleared, only a sliver is left.
    """

    NO = 0
    NEARLY = 1
    CLEAR = 2


class ClearedArea:
    """The area that a series of feed moves clears."""

    def __init__(self, rules: PocketRules) -> None:
        self.rules, self._steps = rules, np.zeros((0, 2, 2))

    def add_run(self, run: Polyline) -> DescentClearance:
        """Add the area that a run clears.

        Return the state of the area at the start of the run before the run was added (`DescentClearance`).
        """
        opened = self._descent_clearance(run.start)
        steps = consecutive_segments(run.flattened(FINE * self.rules.tolerance))
        # As in verification, a plunge clears nothing.
        self._steps = np.concatenate([self._steps, steps[(steps[:, 0] != steps[:, 1]).any(axis=1)]])
        return opened

    def area(self) -> Any:
        """Return the total area that the runs clear (shapely geometry)."""
        return cleared_area(self._steps, self.rules)

    def _descent_clearance(self, start: Point) -> DescentClearance:
        radius, fine = self.rules.radius, _FILM * self.rules.tolerance
        cleared = cleared_area(steps_near(self._steps, np.array(start), self.rules), self.rules)
        place = shapely.Point(start)
        if cleared.covers(
            place.buffer(radius - fine, quad_segs=chords_per_quarter(radius, FINE * self.rules.tolerance))
        ):
            return DescentClearance.CLEAR
        return (
            DescentClearance.NEARLY if cleared.covers(place.buffer((1.0 - _SLIVER) * radius)) else DescentClearance.NO
        )
