"""Cost of travel between two positions on a machine: the metric of the search, and the same in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import touches_any_zone
from leafcut.model.machine import Machine
from leafcut.model.problem import Metric, Relief
from leafcut.timing.profile import trapezoid_time

#: Cost of travel between two positions, s or mm.
Travel = Callable[[Point, Point], float]

#: Many orders of a grid take equally long, because the faster axis waits. A millionth of a second per mm selects the
#: shortest of them and changes no measured time.
TIE_BREAK = 1e-6


def travel_metric(
    machine: Machine,
    objective: Literal["time", "distance"],
    *,
    zones: ArrayLike | None = None,
    lift_height_mm: float = 0.0,
    relief: Relief | None = None,
) -> Metric:
    """Return the cost of travel between holes on `machine`.

    ``time``: seconds of a rapid in x and y, with the acceleration factor included in the accelerations. A move over one
    of `zones` (float64[k, 4]: x0, y0, x1, y1 in mm) also costs the Z rapids up and down by `lift_height_mm`, each from
    rest to rest. ``distance``: millimetres, plus twice the height for a lift. With a `relief`, a move also costs the
    rise to its travel height and the descent.

    Raises
    ------
    PlanError
        Zones that are not rows of four finite numbers, a negative height, or an unknown objective.
    """
    rectangles = _rectangles(zones)
    if not (math.isfinite(lift_height_mm) and lift_height_mm >= 0):
        raise PlanError(f"a lift of {lift_height_mm} mm is out of range; the height must be 0 or more")
    if objective == "distance":
        return Metric("euclidean", zones=rectangles, lift=2.0 * lift_height_mm, relief=relief)
    if objective != "time":
        raise PlanError(f"unknown objective '{objective}'; choose one of time, distance")
    (vx, vy, vz), factor = machine.rapid_velocity, machine.acceleration_factor
    ax, ay, az = (a * factor for a in machine.acceleration)
    lift = 2.0 * trapezoid_time(float(lift_height_mm), vz, az)
    return Metric(
        machine.rapid_style,
        velocity=(vx, vy),
        acceleration=(ax, ay),
        per_mm=TIE_BREAK,
        zones=rectangles,
        lift=lift,
        relief=relief,
    )


def _rectangles(zones: ArrayLike | None) -> NDArray[np.float64]:
    if zones is None:
        return np.zeros((0, 4))
    table = np.asarray(zones, dtype=np.float64)
    if table.size % 4 or not np.isfinite(table).all():
        raise PlanError("a keep-out zone is four finite numbers: x0 y0 x1 y1")
    x0, y0, x1, y1 = table.reshape(-1, 4).T
    return np.column_stack([np.minimum(x0, x1), np.minimum(y0, y1), np.maximum(x0, x1), np.maximum(y0, y1)])


def travel_cost(metric: Metric, a: Point, b: Point) -> float:
    """Return the cost of travel from `a` to `b` (mm), as computed by the kernels.

    Raises
    ------
    PlanError
        The metric is for maps; only `kernels.cost` has the rules of TSPLIB.
    """
    if metric.name not in _COSTS:
        raise PlanError(f"the metric {metric.name} is one of maps, not of a machine")
    cost = _COSTS[metric.name](metric, a, b)
    if metric.relief is not None:
        cost += _rise_and_fall(metric, metric.relief, a, b)
    if len(metric.zones) and touches_any_zone([a], [b], metric.zones, dogleg=metric.name == "dogleg")[0]:
        cost += metric.lift
    return cost


def way_height(relief: Relief, a: Point, b: Point, dogleg: bool) -> float:
    """Return the travel height between two positions, mm: the higher of the two, or more.

    For a straight move, the tiles that it touches count, with a small tolerance; with unsynchronised axes (`dogleg`),
    the whole box between the positions.
    """
    ends = relief.at(np.array([a, b], dtype=np.float64))
    (x0, y0), (x1, y1) = sorted([a, b], key=lambda point: (point[1], point[0]))
    rows, columns = relief.safe.shape
    tolerance = 0.0 if dogleg else 1e-6 * relief.side
    first = max(math.floor((y0 - tolerance - relief.y) / relief.side), 0)
    last = min(math.floor((y1 + tolerance - relief.y) / relief.side), rows - 1)
    best = float(ends.max())
    for row in range(first, last + 1):
        left, right = x0, x1
        if not dogleg and y1 > y0:
            low, high = (
                (relief.y + row * relief.side - tolerance - y0),
                (relief.y + (row + 1) * relief.side + tolerance - y0),
            )
            low, high = (min(max(edge / (y1 - y0), 0.0), 1.0) for edge in (low, high))
            left, right = x0 + low * (x1 - x0), x0 + high * (x1 - x0)
        left, right = min(left, right), max(left, right)
        start = max(math.floor((left - tolerance - relief.x) / relief.side), 0)
        stop = min(math.floor((right + tolerance - relief.x) / relief.side), columns - 1)
        if stop >= start:
            best = max(best, float(relief.safe[row, start : stop + 1].max()))
    return best


def _rise_and_fall(metric: Metric, relief: Relief, a: Point, b: Point) -> float:
    """Return the cost of rising at `a` to the travel height to `b`, and of descending there."""
    height = way_height(relief, a, b, metric.name == "dogleg")
    distances = height - relief.at(np.array([a, b], dtype=np.float64))
    if metric.unit == "mm":
        return float(distances.sum())
    return float(sum(trapezoid_time(vertical, relief.velocity, relief.acceleration) for vertical in distances.tolist()))


def _linear(metric: Metric, a: Point, b: Point) -> float:
    """Seconds of a straight move: v = min v_i/|u_i|, a = min a_i/|u_i| along the unit vector u."""
    distance = math.dist(a, b)
    if distance == 0.0:
        return 0.0
    ux, uy = abs(b[0] - a[0]) / distance, abs(b[1] - a[1]) / distance
    seconds = trapezoid_time(distance, _along(metric.velocity, ux, uy), _along(metric.acceleration, ux, uy))
    return seconds + metric.per_mm * distance


def _along(limits: Point, ux: float, uy: float) -> float:
    return min(limits[0] / ux if ux else math.inf, limits[1] / uy if uy else math.inf)


def _dogleg(metric: Metric, a: Point, b: Point) -> float:
    """Seconds of the slower axis."""
    axes = [trapezoid_time(abs(b[i] - a[i]), metric.velocity[i], metric.acceleration[i]) for i in (0, 1)]
    return max(axes) + metric.per_mm * math.dist(a, b)


_COSTS: dict[str, Callable[[Metric, Point, Point], float]] = {
    "euclidean": lambda _, a, b: math.dist(a, b),
    "chebyshev": lambda _, a, b: max(abs(a[0] - b[0]), abs(a[1] - b[1])),
    "manhattan": lambda _, a, b: abs(a[0] - b[0]) + abs(a[1] - b[1]),
    "linear": _linear,
    "dogleg": _dogleg,
}
