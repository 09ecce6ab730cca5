"""Data shared by all pockets of a job, and the motion that clears them."""

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

    - `triangles`: surface of the solid, float64[n, 3, 3], mm
    - `pockets`: all pockets of the solid
    - `milled`: the pockets to be milled
    - `before`: the solid on the machine, with all pockets filled
    """

    triangles: NDArray[np.float64]
    pockets: tuple[Pocket, ...]
    milled: tuple[Pocket, ...]
    before: Mesh


@dataclass(frozen=True, eq=False)
class PocketJob:
    """The pockets of a job, with tool, levels, heights and rules.

    `around` contains, for each pocket, the index of the pocket whose floor contains it, or None. `limits` is None for a
    constant feed. `tops` contains the height of the material above each pocket before milling, mm, relative to the
    highest point of the part.
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
    def exact(self) -> PocketRules:
        """The rules of the job without stock on the walls, as for the finished pocket."""
        return replace(self.rules, stock=0.0)

    @property
    def floor(self) -> float:
        """Height of the floor of the deepest pocket, mm."""
        return min(levels.floor for levels in self.levels)

    @property
    def top(self) -> float:
        """Height of the top of the pockets, mm. Planning and verification measure heights from there."""
        return self.part.pockets[0].top or 0.0

    @property
    def rounding(self) -> float:
        """Maximum distance between the tool path and a corner that the machine rounds, mm."""
        return corner_rounding(self.run.machine, self.limits.most if self.limits else self.data.tool.feed)


@dataclass(frozen=True, eq=False)
class PocketMotion:
    """The motion that clears all regions in the given order, its entry moves, and its time."""

    path: Toolpath
    descents: tuple[Descent, ...]
    measure: Measure
    #: Issues about uncut areas, and the chips if feeds follow the load; both are results of verification.
    left: Sequence[Issue] = ()
    chips: MeasuredChips | None = None


def required_holes(descents: Sequence[Descent]) -> dict[Point, float]:
    """Return the holes that must be drilled before milling, as position and height of the bottom, mm."""
    bottoms: dict[Point, float] = {}
    for descent in descents:
        if descent.kind == "predrilled":
            bottoms[descent.place] = min(descent.bottom, bottoms.get(descent.place, 0.0))
    return bottoms


def raise_path(path: Toolpath, by: float) -> Toolpath:
    """Raise a toolpath by `by` mm. It must not contain drilling cycles. Moves in machine coordinates do not change."""
    if not by:
        return path
    end = path.end.copy()
    moved = np.isin(path.kind, [int(kind) for kind in PLACES])
    end[moved, 2] = np.round(end[moved, 2] + by, 6)
    arcs = tuple(replace(arc, center=(*arc.center[:2], round(arc.center[2] + by, 6))) for arc in path.arcs)
    return replace(path, end=end, arcs=arcs)
