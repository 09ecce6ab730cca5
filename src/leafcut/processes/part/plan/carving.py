"""V-carving: a V-bit follows the medial axis of a shape, so deep that its cone just reaches both walls."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from leafcut.geometry.arrays import Floats, Point
from leafcut.geometry.medial_axis import medial_axis
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.milling.entries import ABOVE, SHORTEST
from leafcut.processes.part.model import Carving, Edge, VBit
from leafcut.processes.part.plan.finishing import index_of_areas
from leafcut.processes.part.plan.task import Mill, PartHeights

#: Maximum material that is left in a corner, and tolerance of the path, mm.
_LEFT, _TOLERANCE = 0.015, 0.004
#: Maximum number of start points of a path.
_STARTS = 8


@dataclass(frozen=True, eq=False)
class CarvingTask:
    """The connected paths in a shape, which the V-bit follows in one go.

    Each of `tours`, float64[n, 3], mm, starts at another end. The V-bit goes back over branches that it has carved. If
    the shape is deeper than the step-down, it repeats the tour, back and forth. `later` contains the edges that enclose
    or cross the shape.
    """

    tours: tuple[Floats, ...]
    passes: int
    later: tuple[int, ...]

    @property
    def choices(self) -> list[tuple[Point, Point]]:
        """Entry and exit point of each choice."""
        ends = [tour[[0, -1 if self.passes % 2 else 0], :2].tolist() for tour in self.tours]
        return [((x0, y0), (x1, y1)) for (x0, y0), (x1, y1) in ends]

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Carve the shape pass by pass. The vertical speed is at most the plunge rate."""
        data, tour = mill.data, self.tours[choice]
        builder.feed(z=ABOVE, feed=data.tool.feed)
        for number in range(self.passes):
            level = -(number + 1) * mill.step
            for x, y, depth in (tour[::-1] if number % 2 else tour).tolist():
                position, z = builder.position, max(depth, level)
                length, drop = math.dist(position, (x, y, z)), position[2] - z
                if length > SHORTEST:
                    steep = data.plunge_feed * length / drop if drop > SHORTEST else math.inf
                    builder.feed(x, y, z, feed=min(data.tool.feed, steep))


def carving_axis(region: shapely.Polygon, bit: VBit) -> list[Floats]:
    """Return the paths of the tip in a shape as float64[n, 3], mm. Places narrower than the tip are left out."""
    wide = region.buffer(-bit.tip).buffer(bit.tip) if bit.tip else region
    pieces = [piece for piece in shapely.get_parts(wide) if not piece.is_empty]
    axis = [branch for piece in pieces for branch in medial_axis(piece, _LEFT, _TOLERANCE)]
    for branch in axis:
        branch[:, 2] = np.minimum(bit.tip - branch[:, 2], 0.0) / bit.spread
    return axis


def carving_tasks(
    carved: Sequence[tuple[Carving, Sequence[Floats]]], edges: Sequence[Edge], step: float
) -> list[CarvingTask]:
    """Create the carving tasks of one V-bit from shapes and their paths. Each pass is at most `step` mm deep."""
    areas = index_of_areas(edges)
    tasks = []
    for carving, axis in carved:
        later = tuple(np.sort(areas.query(carving.area.region, predicate="intersects")).tolist())
        for tours in _connected_tours(axis):
            deepest = -min(float(tour[:, 2].min()) for tour in tours)
            tasks.append(CarvingTask(tours, max(math.ceil(deepest / step - 1e-9), 1), later))
    return tasks


def _connected_tours(axis: Sequence[Floats]) -> Iterator[tuple[Floats, ...]]:
    """Yield the tours of each connected part of an axis. They start at its ends, at the shallowest first."""
    at: dict[tuple[float, ...], list[int]] = {}
    for number in sorted(range(len(axis)), key=lambda k: len(axis[k])):
        for place in (axis[number][0], axis[number][-1]):
            at.setdefault(tuple(place), []).append(number)
    left = set(range(len(axis)))
    # A closed branch has no end.
    ends = sorted(at, key=lambda place: (len(at[place]) > 1, -place[2]))
    for place in ends:
        if left.isdisjoint(at[place]):
            continue
        first, own = _tour(axis, at, place)
        left -= own
        others = [end for end in ends if end != place and len(at[end]) == 1 and at[end][0] in own]
        yield (first, *(_tour(axis, at, end)[0] for end in others[: _STARTS - 1]))


def _tour(
    axis: Sequence[Floats], at: dict[tuple[float, ...], list[int]], place: tuple[float, ...]
) -> tuple[Floats, set[int]]:
    """Return a tour along all branches that are connected to an end, and the numbers of these branches."""
    done: set[int] = set()
    path, back, seen = [np.array([place])], [], 0
    while True:
        number = next((k for k in at[place] if k not in done), None)
        if number is not None:
            done.add(number)
            branch = axis[number] if tuple(axis[number][0]) == place else axis[number][::-1]
            back.append(branch[::-1])
            path.append(branch[1:])
            seen = len(path)
        elif back:
            branch = back.pop()
            path.append(branch[1:])
        else:
            # The way back after the last new branch is not needed.
            return np.concatenate(path[:seen] or path), done
        place = tuple(branch[-1])
