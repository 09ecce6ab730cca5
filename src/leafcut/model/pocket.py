"""`Pocket`: a region to be cleared to a depth, the rules for clearing it, and the paths that do."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from leafcut.geometry.polyline import Polyline

#: What most shops run, in this order: what a pocket's program is measured against.
USUAL = ("zigzag", "contour")

#: What an outline is: of a pocket, of an island, of a plate, or unknown until its depth is known.
POCKET, ISLAND, EDGE, EITHER = "pocket", "island", "edge", ""

#: A finishing pass takes off no more than this, in diameters, where it goes deeper than one level.
FILM = 0.2

#: Share of the reachable area that may stay uncut without a warning, percent.
UNCOVERED = 0.1

#: Two places nearer than this are the same: the tool goes on without being lifted, mm.
SAME_PLACE = 1e-6


@dataclass(frozen=True)
class Pocket:
    """A closed region with islands, as it is drawn: the walls of the finished part, not the way of the tool.

    Attributes
    ----------
    outline
        Closed, counter-clockwise, mm.
    islands
        Closed, clockwise, inside the outline, clear of it and of each other.
    name
        For people: a number, a layer or the drawing's own name.
    layer, handle
        The drawing's layer and entity handle of the outline; empty for pictures.
    depth, top
        How deep the floor lies below the height that the pocket is milled from, and that height, mm; None where that is
        not said: a drawing says neither.
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
        """For messages: ``the pocket``, ``pocket 3``, or its name where that says what it is."""
        if self.name.lower() in ("", "pocket"):
            return "the pocket"
        return self.name if "pocket" in self.name.lower() else f"pocket {self.name}"

    @property
    def area(self) -> float:
        """Area inside the outline and outside the islands, mm²."""
        return abs(self.outline.area) - sum(abs(island.area) for island in self.islands)


@dataclass(frozen=True)
class PocketLevels:
    """The heights of one pocket's levels, mm, 0 where the pockets of a program begin, and negative below.

    Attributes
    ----------
    begin
        Where the material begins: 0, or the floor of the pocket in which this one lies and which is cleared before it,
        or the surface of the solid around it.
    levels
        From the top down.
    """

    begin: float
    levels: tuple[float, ...]

    @property
    def floor(self) -> float:
        """The last level."""
        return self.levels[-1]

    @property
    def depth(self) -> float:
        """From where the material begins to the floor, mm."""
        return self.begin - self.floor

    @property
    def step(self) -> float:
        """How deep each level is, mm."""
        return self.begin - self.levels[0]


@dataclass(frozen=True)
class PocketRules:
    """How one tool clears a pocket in the plane.

    Attributes
    ----------
    tool_diameter
        Of a flat end mill, mm.
    step_over
        Largest distance between neighbouring passes, mm.
    stock
        What roughing leaves on the walls for the finishing pass, mm.
    climb
        True: the material is on the right of the tool's way (spindle clockwise), walls are passed accordingly.
    tolerance
        How far a path may leave the exact one, mm.
    max_engagement
        Largest angle of the tool's edge in the material, rad; None: not limited.

    Passes are planned a little nearer to each other than the step-over (`planned`): each is only true within the
    tolerance. So what is measured of a program is no more than the step-over but for rounding (`keeps`).
    """

    tool_diameter: float
    step_over: float
    stock: float = 0.0
    climb: bool = True
    tolerance: float = 0.01
    max_engagement: float | None = None

    @property
    def radius(self) -> float:
        """Of the tool, mm."""
        return 0.5 * self.tool_diameter

    @property
    def engagement(self) -> float:
        """Angle of the tool's edge in material in a straight cut as wide as the step-over, rad."""
        return math.acos(max(1.0 - self.step_over / self.radius, -1.0))

    @property
    def planned(self) -> PocketRules:
        """The rules with the step-over that passes are laid at, so that they keep that of these rules."""
        return replace(self, step_over=self.step_over - 2.0 * self.tolerance)

    def keeps(self, step_over: float) -> bool:
        """Return whether a measured step-over, mm, is within these rules: room is left for rounded numbers only."""
        return step_over <= self.step_over + 0.5 * self.tolerance


@dataclass(frozen=True)
class PocketPiece:
    """A stretch of the way of the tool's centre at feed, open, in the plane.

    `kind` is ``rough``, ``finish`` (along a wall), ``link`` (through what is cut already, or from pass to pass),
    ``air`` (measured: nothing is cut), or ``entry``: a closed loop, the first piece, along which the tool comes down as
    on a helix and so has cleared it when it is at depth.

    `feed` is how fast it is gone, as a share of the tool's feed; ``air`` has a feed of its own.
    """

    path: Polyline
    kind: str = "rough"
    feed: float = 1.0


@dataclass(frozen=True)
class PocketPath:
    """The way of the tool's centre over one level of a pocket, without approach and departure.

    Where a piece begins at the end of the one before (within `SAME_PLACE`) the tool goes on at depth; everywhere else
    it is lifted, moved by a rapid in a straight line and let down again.
    """

    strategy: str
    pieces: tuple[PocketPiece, ...]

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distance from the end of every piece to the start of the next, mm; 0 where the tool goes on."""
        ways = (math.dist(a.path.end, b.path.start) for a, b in zip(self.pieces, self.pieces[1:], strict=False))
        return tuple(0.0 if way <= SAME_PLACE else way for way in ways)

    @property
    def feed_mm(self) -> float:
        """Length of all pieces, mm."""
        return sum(piece.path.length for piece in self.pieces)

    @property
    def finish_mm(self) -> float:
        """Length of the pieces that finish walls, mm; the rest of the feed roughs."""
        return sum(piece.path.length for piece in self.pieces if piece.kind == "finish")

    @property
    def rapid_mm(self) -> float:
        """Length of the rapids from piece to piece, mm."""
        return sum(self.gaps)

    @property
    def retracts(self) -> int:
        """How often the tool is lifted from piece to piece."""
        return sum(gap > 0.0 for gap in self.gaps)


@dataclass(frozen=True)
class PocketMeasures:
    """What a path over one level does, found by simulating it (`processes.pocket.measures`).

    Attributes
    ----------
    feed_mm, rapid_mm, retracts
        Of the path, without approach and departure.
    finish_mm
        Length of the feed that finishes walls, mm; the rest roughs.
    gouge_mm2
        Area beyond the walls that the tool cuts, more than the tolerance deep.
    reachable_mm2
        Area that a tool of this diameter can clear at all.
    uncovered_mm2
        Area of it that stays uncut.
    max_step_over
        Largest distance of a pass from the nearer of its neighbours, mm.
    max_core
        Widest strip between two passes where fronts meet, mm: the sides of a last ring, of a narrow way.
    max_engagement, mean_engagement
        Angle of the tool's edge in material: the largest, and the mean over the length of the feed, rad.
    max_width, wide_mm
        Width of material that the tool takes off sideways: the largest, and the length of the feed on which it is much
        wider than the step-over (`material.removal.much_wider`), mm: first cuts into the full, cores, corners.
    air_mm
        Length of the feed on which nothing is cut, mm.
    floor_mm
        Area of the allowed tool centres divided by the step-over: no path of constant pitch is much shorter.
    time_s
        At feed and rapid under the machine's acceleration, s; 0 where no machine is known.
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
    time_s: float = 0.0

    @property
    def uncovered_percent(self) -> float:
        """Share of the reachable area that stays uncut, percent."""
        return 100.0 * self.uncovered_mm2 / self.reachable_mm2 if self.reachable_mm2 > 0.0 else 0.0


@dataclass(frozen=True)
class PocketResult:
    """One strategy on one pocket: its path and what it does; or why it has none.

    `program_s` is the time of a program of this pocket alone: all levels, with every way down and up. Of a strategy
    that costs less than the written one `passed_over` says why it is not written.
    """

    strategy: str
    path: PocketPath | None = None
    measures: PocketMeasures | None = None
    refused: str = ""
    program_s: float = 0.0
    passed_over: str = ""


@dataclass(frozen=True)
class PocketProgram:
    """One program of several pockets: `time_s` of all levels; what is lifted on one level, between pockets too, mm.

    `strategy` is the one that all of them are cleared by; empty for the program that is written.
    """

    strategy: str
    time_s: float
    rapid_mm: float
    retracts: int


@dataclass(frozen=True)
class PocketPlan:
    """A pocket and how it is cleared.

    Attributes
    ----------
    levels
        Height of every level below the top of the pockets, mm, negative.
    chosen
        Index in `results` of the strategy that is written.
    results
        The strategies that were tried.
    begin
        Where the material begins, mm, 0 at the top of the pockets and negative below.
    in_floor
        Whether, where that is below the top, it is the floor of the pocket that this one lies in; else it is the
        surface of the solid around it.
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
        """Z of every level in the program, mm."""
        return tuple(round(level + (self.pocket.top or 0.0), 6) for level in self.levels)

    @property
    def result(self) -> PocketResult:
        """The strategy that is written."""
        return self.results[self.chosen]

    @property
    def usual(self) -> PocketResult:
        """What the program is measured against: the first strategy of `USUAL` that is possible, else the chosen one."""
        possible = {r.strategy: r for r in self.results if r.path is not None}
        return next((possible[name] for name in USUAL if name in possible), self.result)
