"""Which parts a beam cuts free before which. A change is told as a note; the operator judges whether it is dangerous.

Parts that lie beside each other may come free in any order: the work is the same. What lies inside a part, or touches
it, must keep its place; `inner_first` and `touching_order` check that.
"""

from __future__ import annotations

import numpy as np
import shapely

from leafcut.geometry.arrays import Indices
from leafcut.model.heartbeat import Heartbeat, unseen
from leafcut.processes.program.proof.features import Features
from leafcut.processes.program.proof.inner_first import loops_in, outline_of
from leafcut.processes.program.proof.traces import Traces


def came_free(features: Features, traces: Traces, run: Indices, new_of: Indices, look: Heartbeat = unseen) -> list[str]:
    """Return a note if outlines of parts are cut in another order, else nothing.

    `run` gives each feature the number of its run of cuts, int64[n], rising: no move across lies within a run. `new_of`
    is the place of each feature in the new program, int64[n], -1 where it is gone.
    """
    n = int(run[-1]) + 1 if len(run) else 0
    last = np.searchsorted(run, np.arange(n), side="right") - 1
    ends = np.full(n, -1, dtype=np.int64)
    np.maximum.at(ends, run, new_of)
    parts = _outlines(traces, run, look) if (np.diff(ends[ends >= 0]) < 0).any() else np.zeros(0, dtype=np.int64)
    parts = parts[ends[parts] >= 0]
    later = np.maximum.accumulate(np.concatenate([[-1], ends[parts]]))[:-1]
    moved = parts[later > ends[parts]]
    if not len(moved):
        return []
    one = int(moved[0])
    other = int(parts[(parts < one) & (ends[parts] > ends[one])][0])
    said = [
        f"X{x:.3f} Y{y:.3f} (line {features.line[last[k]]})" for k in (one, other) for x, y in [_end(features, last[k])]
    ]
    return [
        f"parts come free in another order: {len(moved)} of {len(parts)} outlines are now cut before one that used to "
        f"come first, such as the outline that ends at {said[0]}: it is now cut before the one that ends at {said[1]}"
    ]


def _end(features: Features, feature: int) -> tuple[float, float]:
    return float(features.end[feature, 0]), float(features.end[feature, 1])


def _outlines(traces: Traces, run: Indices, look: Heartbeat) -> Indices:
    """Return the runs that are outlines of parts: closed, and inside no other run, or inside a hole of another part."""
    number, begin = np.unique(run[traces.feature], return_index=True)
    of: list[int] = []
    shapes: list[shapely.Polygon] = []
    for k, first, stop in zip(number.tolist(), begin.tolist(), [*begin[1:].tolist(), len(traces.feature)], strict=True):
        look()
        if stop - first > 1:
            outline = outline_of(traces.pick(np.arange(first, stop)))
            largest = max(
                (shapely.Polygon(loop) for loop in loops_in(outline) if len(loop) > 2),
                key=lambda p: p.area,
                default=None,
            )
            if largest is not None:
                of.append(k)
                shapes.append(largest)
    if not shapes:
        return np.zeros(0, dtype=np.int64)
    spots = np.array([shapely.points(shape.exterior.coords[0]) for shape in shapes], dtype=object)
    areas = shapely.make_valid(np.array(shapes, dtype=object))
    inner, outer = shapely.STRtree(areas).query(spots, predicate="within")
    depth = np.bincount(inner[inner != outer], minlength=len(shapes))
    parts: Indices = np.array(of, dtype=np.int64)[depth % 2 == 0]
    return parts
