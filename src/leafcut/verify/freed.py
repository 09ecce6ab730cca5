"""Ways of a head that stays down over parts that are cut free: counted in the program that was read back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.dialects import Dialect
from leafcut.model.toolpath import Kind, Toolpath, positions_before
from leafcut.verify.difference import Difference, place
from leafcut.verify.laid_runs import Laid
from leafcut.verify.sheet_shapes import Target

#: Ways are looked at in steps, mm; what comes no deeper over a part crosses nothing.
_STEP, _DEPTH = 0.5, 0.3

Points = NDArray[np.float64]


def check_freed(laid: Laid, path: Toolpath, dialect: Dialect) -> list[Difference]:
    """Return the ways over free parts that the plan does not tell; a head that rises between cuts crosses nothing."""
    torch, told = dialect.torch, laid.plan.crossings
    if torch is None or torch.heights != "none" or told is None:
        return []
    found = crossings(laid, path)
    if len(found) <= told:
        return []
    line, where = found[0]
    text = f"{len(found)} ways cross parts that are cut free, {told} are told; the first to {place(*where)}"
    return [Difference("way over a free part", 0, line, text)]


def crossings(laid: Laid, path: Toolpath) -> list[tuple[int, tuple[float, float]]]:
    """Return the line and the end of every way that crosses a free part, once for each way from run to run."""
    ends = np.array([run.row_line[-1] for run in laid.runs], dtype=np.int64)
    freed = _freed(laid)
    before = positions_before(path)
    seen: dict[int, tuple[int, tuple[float, float]]] = {}
    for row in np.flatnonzero(path.kind == Kind.RAPID).tolist():
        way = int(np.searchsorted(ends, path.line[row]))
        a, b = before[row, :2], path.end[row, :2]
        if way in seen or not (np.isfinite(a).all() and np.isfinite(b).all()):
            continue
        if any(_crosses(a, b, edge) for run, edge in freed if run < way):
            seen[way] = int(path.line[row]), (float(b[0]), float(b[1]))
    return list(seen.values())


def _freed(laid: Laid) -> list[tuple[int, Points]]:
    """Return the runs that cut outlines all round without letting go, and the outlines, closed, float64[n, 2]."""
    import shapely

    return [
        (claim.run, shapely.get_coordinates(claim.target.edge))
        for claim in laid.claims
        if _is_outline(claim.target) and laid.frees(claim) and len(laid.runs[claim.run].lines()) == 1
    ]


def _is_outline(target: Target) -> bool:
    return target.shape is not None and not target.marks and target.source.depth % 2 == 0


def _crosses(a: Points, b: Points, edge: Points) -> bool:
    """Return whether a straight way comes deep over what is inside an edge."""
    low, high = edge.min(axis=0), edge.max(axis=0)
    if (np.maximum(a, b) < low).any() or (np.minimum(a, b) > high).any():
        return False
    steps = max(2, int(np.hypot(*(b - a)) / _STEP) + 2)
    points = a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)
    points = points[((points > low) & (points < high)).all(axis=1)]
    return any(_is_deep(point, edge) for point in points[_inside(points, edge)])


def _inside(points: Points, edge: Points) -> NDArray[np.bool_]:
    """Return which points lie inside a closed edge: a ray to the right crosses it an odd number of times."""
    (x, y), (u, v) = edge[:-1].T, edge[1:].T
    px, py = points[:, :1], points[:, 1:]
    spans = (y > py) != (v > py)
    rise = np.where(v == y, 1.0, v - y)
    crossed = spans & (px < x + (py - y) * (u - x) / rise)
    odd: NDArray[np.bool_] = crossed.sum(axis=1) % 2 == 1
    return odd


def _is_deep(point: Points, edge: Points) -> bool:
    begin, step = edge[:-1], np.diff(edge, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-18)
    share = np.clip(((point - begin) * step).sum(axis=1) / square, 0.0, 1.0)
    away = point - begin - share[:, None] * step
    return bool(np.hypot(away[:, 0], away[:, 1]).min() > _DEPTH)
