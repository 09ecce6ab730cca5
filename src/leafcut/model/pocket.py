"""`Pocket`: a region to clear to a depth, the rules for clearing it, and the resulting paths."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut.geometry.polyline import Polyline
from leafcut.message import Message

#: Strategies that most shops use. The faster strategy is the baseline of a pocket's program.
USUAL = ("zigzag", "contour")

#: Kinds of outlines: pocket, island, edge of the plate, or undecided until the nesting of the outlines is known.
POCKET, ISLAND, EDGE, EITHER = "pocket", "island", "edge", ""

#: Maximum width of cut of a finishing pass deeper than one level, diameters.
FILM = 0.2

#: Share of the reachable area that may stay uncut without a warning, percent.
UNCOVERED = 0.1

#: Maximum distance of equal points, mm; the tool continues between them without a retract.
SAME_PLACE = 1e-6


@dataclass(frozen=True)
class Pocket:
    """A drawn closed region with islands: the walls of the finished part, not the path of the tool.

    Attributes
    ----------
    outline
        Closed counter-clockwise path, mm.
    islands
        Closed clockwise paths inside the outline, which touch neither the outline nor each other, mm.
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
        """Name for messages: ``the pocket``, ``pocket 3``, or its own name if that is descriptive."""
        if self.name.lower() in ("", "pocket"):
            return Message("the pocket")
        return self.name if "pocket" in self.name.lower() else Message("pocket {}", self.name)

    def region(self, tolerance: float = 0.01, *, filled: bool = False) -> Any:
        """Return the pocket as a valid shapely Polygon (`geometry.regions.region`), without islands if `filled`.

        Raises
        ------
        PlanError
            The outline or an island crosses itself, or an island touches the wall or another island.
        """
        from leafcut.geometry.regions import region  # loads shapely, which jobs without pockets do not need

        return region(self.outline, () if filled else self.islands, tolerance, self.label)

    @property
    def area(self) -> float:
        """Area inside the outline and outside the islands, mm²."""
        return abs(self.outline.area) - sum(abs(island.area) for island in self.islands)


@dataclass(frozen=True)
class PocketLevels:
    """Heights of a pocket's levels, mm: 0 at the top of the program's pockets, negative below.

    `begin` is the top of the material: 0, or the floor of an enclosing pocket that is cleared first, or the surrounding
    surface of the solid.
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
    """Rules for clearing a pocket with one tool, in the plane; lengths are in mm.

    The tool is a flat end mill. Passes are planned slightly closer than the step-over (`planned`), because each pass is
    accurate only within the tolerance. Therefore, only rounding can make the measured step-over exceed the rule
    (`allows_step_over`).

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
        """Engagement angle of a straight cut as wide as the step-over, rad."""
        return math.acos(max(1.0 - self.step_over / self.radius, -1.0))

    @property
    def planned(self) -> PocketRules:
        """Copy of the rules with a slightly smaller step-over, for planning. The passes meet the original rules."""
        return replace(self, step_over=self.step_over - 2.0 * self.tolerance)

    def allows_step_over(self, step_over: float) -> bool:
        """Return whether a measured step-over, mm, is within these rules, apart from rounding."""
        return step_over <= self.step_over + 0.5 * self.tolerance


@dataclass(frozen=True)
class PocketPiece:
    """An open section of the path of the tool's centre at feed, in the plane.

    `kind` is ``rough``, ``finish`` (along a wall), ``link`` (through cleared area, or from pass to pass), ``air`` (the
    simulation shows that nothing is cut), or ``entry``. An entry is the first section: a closed loop along which the
    tool descends, so that the area inside is cleared. `feed` is a share of the tool's feed; ``air`` has its own feed.
    """

    path: Polyline
    kind: str = "rough"
    feed: float = 1.0


@dataclass(frozen=True)
class PocketPath:
    """Path of the tool's centre on one level of a pocket, without approach and departure.

    If a section starts at the end of the previous section (within `SAME_PLACE`), the tool continues at depth. Otherwise
    it retracts, moves in a straight rapid and plunges again.
    """

    strategy: str
    pieces: tuple[PocketPiece, ...]

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distance from the end of each section to the start of the next, mm; 0 where the tool continues at depth."""
        gaps = (math.dist(a.path.end, b.path.start) for a, b in zip(self.pieces, self.pieces[1:], strict=False))
        return tuple(0.0 if gap <= SAME_PLACE else gap for gap in gaps)

    @property
    def feed_mm(self) -> float:
        """Length of all sections, mm."""
        return sum(piece.path.length for piece in self.pieces)

    @property
    def finish_mm(self) -> float:
        """Length of the finishing sections, mm; all other sections are roughing."""
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
    """Measures of a path on one level, from its simulation (`processes.pocket.clearing.measure_path`).

    Attributes
    ----------
    feed_mm, rapid_mm, retracts
        Lengths of feed moves and rapids, and number of retracts, without approach and departure.
    gouge_mm2
        Area cut beyond the walls, deeper than the tolerance.
    reachable_mm2
        Area that a tool of this diameter can clear.
    uncovered_mm2
        Part of the reachable area that stays uncut.
    max_step_over
        Maximum distance of a pass from the nearer of its neighbours, mm.
    max_core
        Maximum width of a strip between two passes that meet in the middle, such as the sides of the innermost ring or
        of a narrow channel, mm.
    max_engagement, mean_engagement
        Engagement angle of the tool: maximum, and mean over the length of the feed, rad.
    max_width, wide_mm
        Maximum width of cut, and length of the feed moves that cut much wider than the step-over
        (`material.removal.much_wider`), mm. Such cuts are first cuts into solid material, cores, and corners.
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
        """Share of the reachable area that stays uncut, percent."""
        return 100.0 * self.uncovered_mm2 / self.reachable_mm2 if self.reachable_mm2 > 0.0 else 0.0


@dataclass(frozen=True)
class PocketResult:
    """Result of a strategy for a pocket: its path and measures, or the reason why it is refused.

    `program_s` is the machine time of a program for this pocket alone, s. If this strategy is cheaper than the chosen
    strategy, `passed_over` is the reason why it was not chosen.
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

    `time_s` is the time of all levels. `rapid_mm` and `retracts` are for one level of each pocket, including the moves
    between pockets. `strategy` is the common strategy of all pockets; empty for the written program.
    """

    strategy: str
    time_s: float
    rapid_mm: float
    retracts: int


@dataclass(frozen=True)
class PocketPlan:
    """A pocket and its clearing.

    Attributes
    ----------
    levels
        Heights of the levels relative to the top of the pockets, mm, negative.
    begin
        Top of the material relative to the top of the pockets, mm, zero or negative.
    in_floor
        If `begin` is negative, whether it is the floor of an enclosing pocket, or else the surrounding surface of the
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
        """The baseline of the program: the faster of the strategies `USUAL`, or else the chosen strategy."""
        plain = [r for r in self.results if r.path is not None and r.strategy in USUAL]
        plain = [r for r in plain if not r.passed_over] or plain
        return min(plain, key=lambda result: result.program_s, default=self.result)
