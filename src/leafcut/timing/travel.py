"""Compute the cost and the height of travel moves on a machine."""

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

#: Small extra cost for travel, s/mm. On a grid, many orders take the same time because the faster axis waits for the
#: slower axis. This cost makes the search prefer the shortest of them. It does not change the reported time.
TIE_BREAK = 1e-6
#: Metrics for machines and for the plane. All other metrics are for maps.
_MACHINES = ("euclidean", "chebyshev", "manhattan", "linear", "dogleg")


def travel_metric(
    machine: Machine,
    objective: Literal["time", "distance"],
    *,
    zones: ArrayLike | None = None,
    lift_height_mm: float = 0.0,
    relief: Relief | None = None,
) -> Metric:
    """Build the metric that gives the cost of travel between two positions on a machine.

    For the objective ``time``, the cost of a move is the duration of a rapid in x and y. A move that crosses a zone
    also costs two Z rapids, up and down, each of which starts and ends at rest. For the objective ``distance``, the
    cost is the length in mm, plus twice the height of a lift.

    Parameters
    ----------
    zones
        Rectangles (x0, y0, x1, y1) that the tool must lift over, float64[k, 4], mm.
    lift_height_mm
        Height of the lift over a zone.
    relief
        If given, the cost of a move includes rising to its travel height and descending again.

    Raises
    ------
    PlanError
        If the zones are not rows of four finite numbers, the height is negative, or the objective is unknown.
    """
    rectangles = _zone_rectangles(zones)
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


def _zone_rectangles(zones: ArrayLike | None) -> NDArray[np.float64]:
    if zones is None:
        return np.zeros((0, 4))
    table = np.asarray(zones, dtype=np.float64)
    if table.size % 4 or not np.isfinite(table).all():
        raise PlanError("a keep-out zone is four finite numbers: x0 y0 x1 y1")
    x0, y0, x1, y1 = table.reshape(-1, 4).T
    return np.column_stack([np.minimum(x0, x1), np.minimum(y0, y1), np.maximum(x0, x1), np.maximum(y0, y1)])


def travel_cost(metric: Metric, a: Point, b: Point) -> float:
    """Compute the cost of travel from `a` to `b` (mm) at constant height, exactly as the search does.

    Raises PlanError if the metric is for maps or if travel heights differ.
    """
    from leafcut.kernels.cost import CODES, metric_distance

    if metric.relief is not None:
        raise PlanError("this cost model covers travel at a single height only")
    if metric.name not in _MACHINES:
        raise PlanError("the metric {} is for maps, not for machines", metric.name)
    numbers = map(float, (*a, *b, *metric.velocity, *metric.acceleration, metric.per_mm))
    cost = float(metric_distance(CODES[metric.name], *numbers))
    if len(metric.zones) and touches_any_zone([a], [b], metric.zones, dogleg=metric.name == "dogleg")[0]:
        cost += metric.lift
    return cost


def travel_heights(relief: Relief, xy: Points, dogleg: bool) -> Floats:
    """Return the safe height for the travel move from each position to the next, float64[n - 1], mm.

    The move must clear every tile that it touches. If the axes move independently (`dogleg`), the move must clear every
    tile in the rectangle between the two positions.
    """
    from leafcut.kernels.cost import DOGLEG, LINEAR, relief_table, travel_heights_along_path

    header = (relief.x, relief.y, relief.side, relief.velocity, relief.acceleration)
    heights, xy = np.zeros(len(xy) - 1), np.ascontiguousarray(xy, dtype=np.float64)
    travel_heights_along_path(
        DOGLEG if dogleg else LINEAR, xy, relief_table(header, relief.safe, relief.at(xy)), heights
    )
    return heights
