"""Find nested and intersecting outlines. An index of bounding boxes makes this fast even for thousands of outlines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.index import query_pairs
from leafcut.geometry.polyline import COINCIDENT
from leafcut.message import Message

#: Maximum number of touching pairs of outlines in a valid sheet: a base value, plus a number for each outline.
MOST_MEETING, MEETING_PER_SHAPE = 20_000, 8


class Conflict(NamedTuple):
    """Two outlines whose edges meet, with a position and the kind of conflict (``same``, ``overlap`` or ``touch``)."""

    first: int
    second: int
    kind: str
    place: Point


def find_outline_conflicts(shapes: NDArray[Any], same: float = COINCIDENT) -> list[Conflict]:
    """Find all pairs of polygons whose edges come within `same` mm of each other.

    Each pair has one of these kinds:

    - ``overlap``: neither polygon lies inside the other, and they share more than an edge.
    - ``touch``: edges or corners meet, from outside or inside.
    - ``same``: an outline is drawn twice. `first` is the earlier copy.

    Raises
    ------
    PlanError
        More outlines meet than in any valid sheet.
    """
    if len(shapes) < 2:
        return []
    copies, single = _split_off_copies(shapes)
    rings = shapely.get_exterior_ring(shapes)[single]
    pairs, total = [np.zeros((2, 0), dtype=np.int64)], 0
    for i, j in query_pairs(rings, rings, Message("outlines that cross or touch each other"), "dwithin", same):
        pairs.append(np.stack([single[i], single[j]])[:, i < j])
        total += pairs[-1].shape[1]
        if total > MOST_MEETING + MEETING_PER_SHAPE * len(shapes):
            raise PlanError("thousands of outlines that cross or touch each other; clean up the drawing")
    first, second = np.concatenate(pairs, axis=1)
    if not len(first):
        return copies
    inner = np.full(len(shapes), None, dtype=object)
    touching = np.unique(np.concatenate([first, second]))
    inner[touching] = shapely.buffer(shapes[touching], -same, join_style="mitre")
    area, length = shapely.area(shapes), shapely.length(shapes)
    separate = ~shapely.intersects(inner[first], inner[second])
    inside = shapely.within(inner[first], shapes[second]) | shapely.within(inner[second], shapes[first])
    slack = 2.0 * same * np.maximum(length[first], length[second])
    alike = np.abs(area[first] - area[second]) <= slack
    alike[alike] = (
        shapely.area(shapely.symmetric_difference(shapes[first[alike]], shapes[second[alike]])) <= slack[alike]
    )
    result = copies
    for k, (i, j) in enumerate(zip(first.tolist(), second.tolist(), strict=True)):
        kind = "same" if alike[k] else "touch" if separate[k] or inside[k] else "overlap"
        result.append(Conflict(i, j, kind, _conflict_point(shapes[i], shapes[j], kind)))
    return result


def _split_off_copies(shapes: NDArray[Any]) -> tuple[list[Conflict], NDArray[np.int64]]:
    """Return a conflict for each exact copy of a shape, and the indices of all other shapes.

    A drawing that was exported twice contains thousands of copies, and comparing all pairs of them would be slow.
    """
    first: dict[bytes, int] = {}
    copies = []
    for k, outline in enumerate(shapely.to_wkb(shapes).tolist()):
        earlier = first.setdefault(outline, k)
        if earlier != k:
            x, y = shapely.get_coordinates(shapes[k])[0]
            copies.append(Conflict(earlier, k, "same", (float(x), float(y))))
    return copies, np.array(sorted(first.values()), dtype=np.int64)


def _conflict_point(a: Any, b: Any, kind: str) -> Point:
    if kind == "overlap":
        point = shapely.point_on_surface(shapely.intersection(a, b))
    else:
        point = shapely.get_point(shapely.shortest_line(shapely.boundary(a), shapely.boundary(b)), 0)
    return (float(point.x), float(point.y))


def nesting_depths_and_parents(shapes: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Count the polygons around each polygon.

    The polygons must not overlap or coincide (`find_outline_conflicts`).

    Returns
    -------
    depths
        Number of polygons around each polygon.
    parents
        Index of the innermost surrounding polygon, or -1.

    Raises
    ------
    PlanError
        The nesting is deeper than in any valid sheet.
    """
    return count_enclosing_polygons(shapely.point_on_surface(shapes), shapes, shapely.area(shapes))


def count_enclosing_polygons(
    points: Sequence[Any] | NDArray[Any], shapes: NDArray[Any], areas: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Count the polygons that contain each point.

    With `areas` (mm², one per point), only polygons with a larger area count. A point on a polygon then does not count
    as inside this polygon or inside its holes.

    Returns
    -------
    depths
        Number of polygons around each point.
    parents
        Index of the smallest of these polygons, or -1.
    """
    depth, parent = np.zeros(len(points), dtype=np.int64), np.full(len(points), -1, dtype=np.int64)
    if not len(shapes) or not len(points):
        return depth, parent
    shape_areas = shapely.area(shapes)
    pairs = list(query_pairs(np.asarray(points), shapes, Message("outlines inside each other"), "within"))
    point_index, outline = (np.concatenate(column) for column in zip(*pairs, strict=True))
    if areas is not None:
        larger = shape_areas[outline] > areas[point_index]
        point_index, outline = point_index[larger], outline[larger]
    depth += np.bincount(point_index, minlength=len(points))
    # Largest first, so that the smallest is written last.
    order = np.argsort(-shape_areas[outline], kind="stable")
    parent[point_index[order]] = outline[order]
    return depth, parent
