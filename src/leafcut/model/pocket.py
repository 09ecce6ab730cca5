"""`Pocket`: a region to clear to a depth, with the rules for clearing it and the resulting paths."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut.geometry.polyline import Polyline
from leafcut.message import Message

#: Strategies that most shops use. The faster strategy is the baseline for the program of a pocket.
USUAL = ("zigzag", "contour")

#: Kinds of outlines: pocket, island, edge of the plate, or undecided until the code knows how the outlines are nested.
POCKET, ISLAND, EDGE, EITHER = "pocket", "island", "edge", ""

#: Maximum width of cut of a finishing pass deeper than one level, diameters.
FILM = 0.2

#: Share of the reachable area that may stay uncut without a warning, percent.
UNCOVERED = 0.1

#: Maximum distance between equal points, mm. The tool continues between equal points without a retract.
SAME_PLACE = 1e-6


@dataclass(frozen=True)
class Pocket:
    """A closed region with islands, as drawn.

    Its outlines are the walls of the finished part, not the path of the tool.

    Attributes
    ----------
    outline
        Closed counter-clockwise path, mm.
    islands
        Closed clockwise paths inside the outline, mm. They touch neither the outline nor each other.
    name
        A number, a layer, or a name from the drawing.
    depth, top
        Depth of the floor below the top of the pocket, and height of the top, mm; None if unknown, as in a drawing.
    """

    outline: Polyline
    islands: tuple[Polyline, ...] = ()
    name: str = ""
    layer: str = ""
    handle: str = ""
    depth: float | None = None
    top: float | None = None

    @property
    def label(self) -> str:
        """Name for messages: ``the pocket``, ``pocket 3``, or the pocket's own name if it is descriptive."""
        if self.name.lower() in ("", "pocket"):
            return Message("the pocket")
        return self.name if "pocket" in self.name.lower() else Message("pocket {}", self.name)

    def region(self, tolerance: float = 0.01, *, filled: bool = False) -> Any:
        """Return the pocket as a valid shapely Polygon. With `filled`, it has no islands.

        For the accuracy, see `geometry.regions.region_with_islands`.

        Raises
        ------
        PlanError
            The outline or an island crosses itself, or an island touches the wall or another island.
        """
        from leafcut.geometry.regions import (
            region_with_islands,
        )  # loads shapely, which jobs without pockets do not need

        return region_with_islands(self.outline, () if filled else self.islands, tolerance, self.label)

    @property
    def area(self) -> float:
        """Area inside the outline and outside the islands, mm²."""
        return abs(self.outline.area) - sum(abs(island.area) for island in self.islands)


@dataclass(frozen=True)
class PocketLevels:
    """The heights of a pocket's levels, mm. The top of the program's pockets is 0, and lower heights are negative.

    `begin` is the top of the material. It is 0, the floor of an enclosing pocket that is cleared first, or the
    surrounding surface of the solid.
    """

    begin: float
    levels: tuple[float, ...]

    @property
    def floor(self) -> float:
        """Height of the last level, mm."""
        return self.levels[-1]

    @property
    def depth(self) -> float:
        """Distance from the top of the material to the floor, mm."""
        return self.begin - self.floor

    @property
    def step(self) -> float:
        """Depth of a level, mm."""
        return self.begin - self.levels[0]


@dataclass(frozen=True)
class PocketRules:
    """The rules for clearing a pocket with one tool, in the plane. Lengths are in mm.

    The tool is a flat end mill. Passes are planned slightly closer together than the step-over (`planned`), because
    each pass is accurate only within the tolerance. The measured step-over can therefore exceed the rule only by
    rounding (`allows_step_over`).

    Attributes
    ----------
    step_over
        Maximum distance between adjacent passes.
    stock
        Thickness that roughing leaves on the walls for the finishing pass.
    climb
        Whether the material is on the right of the tool (clockwise spindle).
    tolerance
        Maximum deviation of a path from the exact path.
    max_engagement
        Maximum engagement angle, rad; None without a limit.
    """

    tool_diameter: float
    step_over: float
    stock: float = 0.0
    climb: bool = True
    tolerance: float = 0.01
    max_engagement: float | None = None

    @property
    def radius(self) -> float:
        """Tool radius, mm."""
        return 0.5 * self.tool_diameter

    @property
    def engagement(self) -> float:
        """Engagement angle of a straight cut whose width is the step-over, rad."""
        return math.acos(max(1.0 - self.step_over / self.radius, -1.0))

    @property
    def planned(self) -> PocketRules:
        """A copy of the rules for planning. Its step-over is slightly smaller, so passes meet the original rules."""
        return replace(self, step_over=self.step_over - 2.0 * self.tolerance)

    def allows_step_over(self, step_over: float) -> bool:
        """Return whether a measured step-over, mm, meets these rules, apart from rounding."""
        return step_over <= self.step_over + 0.5 * self.tolerance


@dataclass(frozen=True)
class PocketPiece:
    """A section of a path of the tool's centre in the plane, without rapids.

    `kind` is ``rough``, ``finish`` (along a wall), ``link`` (through cleared area, or from pass to pass), ``air`` (the
    simulation shows that the tool cuts nothing), or ``entry``. A path may start with an entry, a closed loop along
    which the tool descends and clears the area inside. `feed` is a fraction of the tool's feed. Sections in the air
    have their own feed.
    """

    path: Polyline
    kind: str = "rough"
    feed: float = 1.0


@dataclass(frozen=True)
class PocketPath:
    """The path of the tool's centre on one level of a pocket, without approach and departure.

    If a section starts at the end of the previous section (within `SAME_PLACE`), the tool continues at depth. Otherwise
    it retracts, makes a straight rapid, and plunges again.
    """

    strategy: str
    pieces: tuple[PocketPiece, ...]

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distance from the end of each section to the start of the next section, mm.

        It is 0 where the tool stays at depth.
        """
        gaps = (math.dist(a.path.end, b.path.start) for a, b in zip(self.pieces, self.pieces[1:], strict=False))
        return tuple(0.0 if gap <= SAME_PLACE else gap for gap in gaps)

    @property
    def feed_mm(self) -> float:
        """Length of all sections, mm."""
        return sum(piece.path.length for piece in self.pieces)

    @property
    def finish_mm(self) -> float:
        """Length of the finishing sections, mm. All other sections are roughing."""
        return sum(piece.path.length for piece in self.pieces if piece.kind == "finish")

    @property
    def rapid_mm(self) -> float:
        """Length of the rapids between sections, mm."""
        return sum(self.gaps)

    @property
    def retracts(self) -> int:
        """Number of retracts between sections."""
        return sum(gap > 0.0 for gap in self.gaps)


@dataclass(frozen=True)
class PocketMeasures:
    """Measures of a path on one level, taken from a simulation (`processes.pocket.clearing.measure_path`).

    Attributes
    ----------
    feed_mm, rapid_mm, retracts
        Lengths of feed moves and rapids, and number of retracts, without approach and departure.
    gouge_mm2
        Area that the tool cuts beyond the walls, deeper than the tolerance.
    reachable_mm2
        Area that a tool of this diameter can clear.
    uncovered_mm2
        Part of the reachable area that stays uncut.
    max_step_over
        Maximum distance between a pass and the nearer of its neighbours, mm.
    max_core
        Maximum width of a strip between two passes that meet in the middle, mm. Examples are the sides of the innermost
        ring or of a narrow channel.
    max_engagement, mean_engagement
        Engagement angle of the tool: maximum, and mean over the length of the feed moves, rad.
    max_width, wide_mm
        Maximum width of cut, and length of the feed moves that cut much wider than the step-over
        (`material.removal.min_reported_width`), mm. Such cuts are first cuts into solid material, cores, and corners.
    air_mm
        Length of the feed moves that cut nothing, mm.
    floor_mm
        Area of the permitted tool centres divided by the step-over, mm. A path with this spacing cannot be much
        shorter.
    """

    feed_mm: float
    rapid_mm: float
    retracts: int
    finish_mm: float = 0.0
    gouge_mm2: float = 0.0
    reachable_mm2: float = 0.0
    uncovered_mm2: float = 0.0
    max_step_over: float = 0.0
    max_core: float = 0.0
    max_engagement: float = 0.0
    mean_engagement: float = 0.0
    max_width: float = 0.0
    wide_mm: float = 0.0
    air_mm: float = 0.0
    floor_mm: float = 0.0

    @property
    def uncovered_percent(self) -> float:
        """Percentage of the reachable area that stays uncut."""
        return 100.0 * self.uncovered_mm2 / self.reachable_mm2 if self.reachable_mm2 > 0.0 else 0.0


@dataclass(frozen=True)
class PocketResult:
    """The result of a strategy for a pocket: its path and measures, or the reason why it is refused.

    `program_s` is the machine time of a program for this pocket alone, s. If this strategy is cheaper than the chosen
    strategy, `passed_over` explains why it was not chosen.
    """

    strategy: str
    path: PocketPath | None = None
    measures: PocketMeasures | None = None
    refused: str = ""
    program_s: float = 0.0
    passed_over: str = ""


@dataclass(frozen=True)
class PocketProgram:
    """Figures of a program for several pockets.

    Attributes
    ----------
    time_s
        Time of all levels, s.
    rapid_mm, retracts
        Length of rapids and number of retracts for one level of each pocket, including the moves between pockets.
    strategy
        The strategy that all pockets share; empty for the written program.
    """

    strategy: str
    time_s: float
    rapid_mm: float
    retracts: int


@dataclass(frozen=True)
class PocketPlan:
    """A pocket, and how it is cleared.

    Attributes
    ----------
    levels
        Heights of the levels relative to the top of the pockets, mm, negative.
    begin
        Top of the material relative to the top of the pockets, mm, zero or negative.
    in_floor
        Whether a negative `begin` is the floor of an enclosing pocket. Otherwise it is the surrounding surface of the
        solid.
    """

    pocket: Pocket
    rules: PocketRules
    levels: tuple[float, ...]
    results: tuple[PocketResult, ...] = field(default=())
    chosen: int = 0
    begin: float = 0.0
    in_floor: bool = True

    @property
    def heights(self) -> tuple[float, ...]:
        """Z of each level in the program, mm."""
        return tuple(round(level + (self.pocket.top or 0.0), 6) for level in self.levels)

    @property
    def result(self) -> PocketResult:
        """The result of the chosen strategy."""
        return self.results[self.chosen]

    @property
    def usual(self) -> PocketResult:
        """The baseline of the program: the faster strategy in `USUAL`, or else the chosen strategy."""
        plain = [r for r in self.results if r.path is not None and r.strategy in USUAL]
        plain = [r for r in plain if not r.passed_over] or plain
        return min(plain, key=lambda result: result.program_s, default=self.result)
