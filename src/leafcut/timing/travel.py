"""Cost and height of travel moves between positions on a machine."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats, Point, Points
from leafcut.geometry.zones import touches_any_zone
from leafcut.model.machine import Machine
from leafcut.model.problem import Metric, Relief
from leafcut.timing.profile import trapezoid_time

#: Additional cost of travel, s/mm. Many orders of a grid take the same time, because the faster axis waits. This cost
#: selects the shortest of them, and does not change the reported time.
TIE_BREAK = 1e-6
#: Metrics of machines and of the plane; all other metrics are for maps.
_MACHINES = ("euclidean", "chebyshev", "manhattan", "linear", "dogleg")


def travel_metric(
    machine: Machine,
    objective: Literal["time", "distance"],
    *,
    zones: ArrayLike | None = None,
    lift_height_mm: float = 0.0,
    relief: Relief | None = None,
) -> Metric:
    """Return the cost of travel moves between positions on a machine.

    For the objective ``time``, the cost is the time of a rapid in x and y. A move across one of the `zones`, float64[k,
    4], (x0, y0, x1, y1) in mm, also costs two Z rapids by `lift_height_mm`, each from rest to rest. For the objective
    ``distance``, the cost is the length, mm, plus twice the height of a lift. With a `relief`, the cost of a move also
    includes the rise to its travel height and the descent from it.

    Raises
    ------
    PlanError
        The zones are not rows of four finite numbers, the height is negative, or the objective is unknown.
    """
    rectangles = _rectangles(zones)
    if not (math.isfinite(lift_height_mm) and lift_height_mm >= 0):
        raise PlanError("a lift of {} mm is out of range; the height must be 0 or more", lift_height_mm)
    if objective == "distance":
        return Metric("euclidean", zones=rectangles, lift=2.0 * lift_height_mm, relief=relief)
    if objective != "time":
        raise PlanError("unknown objective '{}'; choose one of time, distance", objective)
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
    """Return the cost of travel from `a` to `b`, mm, at a constant height, as the search computes it.

    Raises PlanError if the metric is for maps, or if travel heights differ.
    """
    from leafcut.kernels.cost import CODES, distance

    if metric.relief is not None:
        raise PlanError("this cost model covers travel at a single height only")
    if metric.name not in _MACHINES:
        raise PlanError("the metric {} is for maps, not for machines", metric.name)
    numbers = map(float, (*a, *b, *metric.velocity, *metric.acceleration, metric.per_mm))
    cost = float(distance(CODES[metric.name], *numbers))
    if len(metric.zones) and touches_any_zone([a], [b], metric.zones, dogleg=metric.name == "dogleg")[0]:
        cost += metric.lift
    return cost


def travel_heights(relief: Relief, xy: Points, dogleg: bool) -> Floats:
    """Return the safe height of the travel move from each position to the next, float64[n - 1], mm.

    The move must clear all tiles that it touches. If the axes move independently (`dogleg`), it must clear all tiles in
    the rectangle between both positions.
    """
    from leafcut.kernels.cost import DOGLEG, LINEAR, relief_table, way_heights

    header = (relief.x, relief.y, relief.side, relief.velocity, relief.acceleration)
    heights, xy = np.zeros(len(xy) - 1), np.ascontiguousarray(xy, dtype=np.float64)
    way_heights(DOGLEG if dogleg else LINEAR, xy, relief_table(header, relief.safe, relief.at(xy)), heights)
    return heights
