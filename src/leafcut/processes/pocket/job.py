"""What is the same for every pocket of a drawing, and a laid program of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.measure import Measure
from leafcut.model.pocket import Pocket, PocketLevels, PocketRules
from leafcut.model.toolpath import PLACES, Toolpath
from leafcut.processes.job import Job

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.model.issue import Issue
    from leafcut.model.mesh import Mesh
    from leafcut.model.part import Part
    from leafcut.processes.pocket.plan.entries import Descent
    from leafcut.processes.pocket.plan.rules import MillingData
    from leafcut.processes.pocket.plan.toolpath import PocketHeights
    from leafcut.processes.pocket.proof.chips import MeasuredChips


@dataclass(frozen=True, eq=False)
class PocketSolid:
    """A solid as it was read: its surface, float64[n, 3, 3], mm, all its pockets, and those that are milled.

    `before` is it with all of them full, as it is placed.
    """

    triangles: NDArray[np.float64]
    pockets: tuple[Pocket, ...]
    milled: tuple[Pocket, ...]
    before: Mesh


@dataclass(frozen=True, eq=False)
class PocketJob:
    """What is the same for every way to clear the pockets of a drawing.

    `levels` are those of each pocket, and `around` says in the floor of which other one it lies, or None. `limits` are
    those of feeds that follow what the tool meets; None where one feed is used throughout. `tops` says how high the
    material of each pocket stands before any is milled, mm, 0 at the top of all; `solid` is what they were found in.
    `made_for` names the file of a solid, and how it is placed.
    """

    run: Job
    part: Part
    rules: PocketRules
    levels: tuple[PocketLevels, ...]
    around: tuple[int | None, ...]
    heights: PocketHeights
    data: MillingData
    words: Dialect
    start: Point | None
    limits: FeedLimits | None = None
    tops: tuple[float, ...] = ()
    solid: PocketSolid | None = None
    made_for: str = ""

    @property
    def exact(self) -> PocketRules:
        """The rules of the finished pocket: without stock."""
        return replace(self.rules, stock=0.0)

    @property
    def floor(self) -> float:
        """That of the deepest pocket, mm."""
        return min(one.floor for one in self.levels)

    @property
    def top(self) -> float:
        """The height at which the pockets begin, mm: all is planned and proved as if it were 0."""
        return self.part.pockets[0].top or 0.0

    @property
    def rounding(self) -> float:
        """How far the tool leaves a corner that it rounds, at most, mm."""
        from leafcut.processes.pocket.plan.rules import corner_rounding

        return corner_rounding(self.run.machine, self.limits.most if self.limits else self.data.tool.feed)


@dataclass(frozen=True, eq=False)
class LaidPockets:
    """An order as motions, and what it costs."""

    path: Toolpath
    descents: tuple[Descent, ...]
    measure: Measure
    #: What the proof finds: uncut places, and the chips if feeds follow the load.
    left: Sequence[Issue] = ()
    chips: MeasuredChips | None = None


def holes(descents: Sequence[Descent]) -> dict[Point, float]:
    """Return the places where a hole has to be before the program runs, and the height of the bottom of each, mm."""
    found: dict[Point, float] = {}
    for one in descents:
        if one.kind == "predrilled":
            found[one.place] = min(one.bottom, found.get(one.place, 0.0))
    return found


def raised(path: Toolpath, by: float) -> Toolpath:
    """Return a toolpath without drilling cycles higher by some mm; places of the machine stay."""
    if not by:
        return path
    end = path.end.copy()
    moved = np.isin(path.kind, [int(kind) for kind in PLACES])
    end[moved, 2] = np.round(end[moved, 2] + by, 6)
    arcs = tuple(replace(arc, center=(*arc.center[:2], round(arc.center[2] + by, 6))) for arc in path.arcs)
    return replace(path, end=end, arcs=arcs)
