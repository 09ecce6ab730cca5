"""Engraving: the tool follows a drawn path at a depth below the top, in one or more passes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.milling.entries import ABOVE, cut_along, enter_level
from leafcut.processes.part.model import Edge, Engraving
from leafcut.processes.part.plan.task import Mill, PartHeights

#: Number of candidate start points on a closed path.
_STARTS = 16
#: Maximum depth of a plunge, mm. Deeper passes start with a ramp.
_DEEPEST_PLUNGE = 0.5
#: Chord error of the edges when they are intersected with engraved paths, mm.
_TOLERANCE = 0.01


@dataclass(frozen=True, eq=False)
class EngravingTask:
    """A path to engrave, and the number of passes.

    An open path can be engraved in either direction, and the direction alternates between passes. A closed path offers
    several start points. `later` contains the edges that enclose or cross the path.
    """

    engraving: Engraving
    passes: int
    later: tuple[int, ...]

    @property
    def choices(self) -> list[tuple[Point, Point]]:
        """Entry and exit point of each choice."""
        path = self.engraving.path
        if path.closed:
            return [(path.point_at(start),) * 2 for start in _starts(path)]
        ends = [(path.start, path.end), (path.end, path.start)]
        return ends if self.passes % 2 else [(entry, entry) for entry, _ in ends]

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Engrave the path pass by pass."""
        data, path = mill.data, _chosen_path(self.engraving.path, choice)
        builder.feed(z=ABOVE, feed=data.tool.feed)
        top = 0.0
        for number in range(self.passes):
            level = -self.engraving.depth * (number + 1) / self.passes
            forth = path if path.closed or number % 2 == 0 else path.reversed()
            if top - level <= _DEEPEST_PLUNGE:
                builder.feed(z=level, feed=data.limited_plunge_feed)
            elif enter_level(builder, forth, top, level, data, shapely.Polygon(), mill.climb).kind == "plunge":
                raise PlanError(
                    "{}: too short for a ramp of {:.3g} degrees; give a larger --entry-angle or a smaller --step-down",
                    self.engraving.name,
                    math.degrees(data.entry_angle),
                )
            cut_along(builder, forth, data.tool.feed)
            top = level


def engraving_tasks(engravings: Sequence[Engraving], edges: Sequence[Edge], step: float) -> list[EngravingTask]:
    """Create the engraving tasks of one tool. Each pass is at most `step` mm deep."""
    areas = shapely.STRtree([shapely.Polygon(edge.path.flattened(_TOLERANCE)) for edge in edges])
    tasks = []
    for engraving in engravings:
        later = np.sort(areas.query(engraving.line, predicate="intersects")).tolist()
        tasks.append(EngravingTask(engraving, max(math.ceil(engraving.depth / step - 1e-9), 1), tuple(later)))
    return tasks


def _starts(path: Polyline) -> list[float]:
    return [k * path.length / _STARTS for k in range(_STARTS)]


def _chosen_path(path: Polyline, choice: int) -> Polyline:
    if path.closed:
        start = _starts(path)[choice]
        return path.piece(start, start + path.length)
    return path.reversed() if choice else path
