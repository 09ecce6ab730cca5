"""The data that all pockets of a job share, and the motion that clears the pockets."""

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
from leafcut.processes.pocket.plan.rules import corner_rounding

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.model.issue import Issue
    from leafcut.model.mesh import Mesh
    from leafcut.model.part import Part
    from leafcut.processes.milling.entries import Descent
    from leafcut.processes.milling.mill import MillingData
    from leafcut.processes.pocket.plan.toolpath import PocketHeights
    from leafcut.processes.pocket.proof.chips import MeasuredChips


@dataclass(frozen=True, eq=False)
class PocketSolid:
    """A solid with pockets.

    Attributes
    ----------
    triangles
        Surface of the solid, float64[n, 3, 3], mm.
    pockets, milled
        All pockets of the solid, and the pockets to mill.
    before
        The solid before milling, with all pockets filled.
    """

    triangles: NDArray[np.float64]
    pockets: tuple[Pocket, ...]
    milled: tuple[Pocket, ...]
    before: Mesh


@dataclass(frozen=True, eq=False)
class PocketJob:
    """The pockets of a job, with the tool, levels, heights and rules.

    Attributes
    ----------
    around
        For each pocket, the index of the pocket whose floor contains it, or None.
    limits
        Feed limits, or None for a constant feed.
    tops
        Height of the material above each pocket before milling, mm, relative to the highest point of the part.
    """

    run: Job
    part: Part
    rules: PocketRules
    levels: tuple[PocketLevels, ...]
    around: tuple[int | None, ...]
    heights: PocketHeights
    data: MillingData
    dialect: Dialect
    start: Point | None
    limits: FeedLimits | None = None
    tops: tuple[float, ...] = ()
    solid: PocketSolid | None = None
    made_for: str = ""

    @property
    def finish_rules(self) -> PocketRules:
        """The rules of the job without stock on the walls. They apply to the finished pocket."""
        return replace(self.rules, stock=0.0)

    @property
    def deepest_floor(self) -> float:
        """Height of the floor of the deepest pocket, mm."""
        return min(levels.floor for levels in self.levels)

    @property
    def top(self) -> float:
        """Height of the top of the pockets, mm. Planning and verification use this height as their zero."""
        return self.part.pockets[0].top or 0.0

    @property
    def max_corner_rounding(self) -> float:
        """Maximum distance between the tool path and a corner when the machine rounds the corner, mm."""
        return corner_rounding(self.run.machine, self.limits.most if self.limits else self.data.tool.feed)


@dataclass(frozen=True, eq=False)
class PocketMotion:
    """The motion that clears all regions in the given order, with its entry moves and its time."""

    path: Toolpath
    descents: tuple[Descent, ...]
    measure: Measure
    #: Issues about uncut areas, and the measured chips if feeds depend on the load. The verification fills in both.
    left: Sequence[Issue] = ()
    chips: MeasuredChips | None = None


def required_holes(descents: Sequence[Descent]) -> dict[Point, float]:
    """Return the position of each hole that must be drilled before milling, and the height of its bottom, mm."""
    bottoms: dict[Point, float] = {}
    for descent in descents:
        if descent.kind == "predrilled":
            bottoms[descent.place] = min(descent.bottom, bottoms.get(descent.place, 0.0))
    return bottoms


def raise_path(path: Toolpath, by: float) -> Toolpath:
    """Raise a toolpath by `by` mm.

    The path must not contain drilling cycles. Moves in machine coordinates stay unchanged.
    """
    if not by:
        return path
    end = path.end.copy()
    moved = np.isin(path.kind, [int(kind) for kind in PLACES])
    end[moved, 2] = np.round(end[moved, 2] + by, 6)
    arcs = tuple(replace(arc, center=(*arc.center[:2], round(arc.center[2] + by, 6))) for arc in path.arcs)
    return replace(path, end=end, arcs=arcs)
