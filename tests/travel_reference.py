"""Cost of travel in plain Python, the reference of the compiled code: a machine's, and the rules of TSPLIB."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import touches_any_zone
from leafcut.model.problem import Metric, Relief
from leafcut.timing.profile import trapezoid_time


def travel_cost(metric: Metric, a: Point, b: Point) -> float:
    """Return the cost of travel between two places; those of TSPLIB have no relief."""
    lift = metric.lift if touches_any_zone([a], [b], metric.zones, dogleg=metric.name == "dogleg")[0] else 0.0
    if metric.name in TSPLIB:
        return TSPLIB[metric.name](a, b) + lift
    return MACHINE[metric.name](metric, a, b) + rise_and_fall(metric, a, b) + lift


def rise_and_fall(metric: Metric, a: Point, b: Point) -> float:
    """Return the cost of rising to the height of travel and of the descent; 0 without a relief."""
    relief = metric.relief
    if relief is None:
        return 0.0
    heights = relief.at(np.array([a, b], dtype=np.float64))
    distances = (travel_height(relief, a, b, metric.name == "dogleg") - heights).tolist()
    if metric.name in ("linear", "dogleg"):
        return sum(trapezoid_time(distance, relief.velocity, relief.acceleration) for distance in distances)
    return float(sum(distances))


def travel_height(relief: Relief, a: Point, b: Point, dogleg: bool) -> float:
    """Return the highest of both places and of all tiles that the move touches; of a dogleg, all in its box."""
    (x0, y0), (x1, y1) = sorted([a, b], key=lambda point: (point[1], point[0]))
    rows, columns = relief.safe.shape
    tolerance = 0.0 if dogleg else 1e-6 * relief.side
    first = max(math.floor((y0 - tolerance - relief.y) / relief.side), 0)
    last = min(math.floor((y1 + tolerance - relief.y) / relief.side), rows - 1)
    best = float(relief.at(np.array([a, b], dtype=np.float64)).max())
    for row in range(first, last + 1):
        left, right = x0, x1
        if not dogleg and y1 > y0:
            edges = (
                relief.y + row * relief.side - tolerance - y0,
                relief.y + (row + 1) * relief.side + tolerance - y0,
            )
            low, high = (min(max(edge / (y1 - y0), 0.0), 1.0) for edge in edges)
            left, right = x0 + low * (x1 - x0), x0 + high * (x1 - x0)
        left, right = min(left, right), max(left, right)
        start = max(math.floor((left - tolerance - relief.x) / relief.side), 0)
        stop = min(math.floor((right + tolerance - relief.x) / relief.side), columns - 1)
        if stop >= start:
            best = max(best, float(relief.safe[row, start : stop + 1].max()))
    return best


def _linear(metric: Metric, a: Point, b: Point) -> float:
    """Seconds of a straight move: v = min v_i/|u_i|, a = min a_i/|u_i| along the unit vector u."""
    distance = math.dist(a, b)
    if distance == 0.0:
        return 0.0
    ux, uy = abs(b[0] - a[0]) / distance, abs(b[1] - a[1]) / distance
    velocity, acceleration = (
        min(limits[0] / ux if ux else math.inf, limits[1] / uy if uy else math.inf)
        for limits in (metric.velocity, metric.acceleration)
    )
    return trapezoid_time(distance, velocity, acceleration) + metric.per_mm * distance


def _dogleg(metric: Metric, a: Point, b: Point) -> float:
    """Seconds of the slower axis."""
    axes = [trapezoid_time(abs(b[i] - a[i]), metric.velocity[i], metric.acceleration[i]) for i in (0, 1)]
    return max(axes) + metric.per_mm * math.dist(a, b)


MACHINE: dict[str, Callable[[Metric, Point, Point], float]] = {
    "euclidean": lambda _, a, b: math.dist(a, b),
    "chebyshev": lambda _, a, b: max(abs(a[0] - b[0]), abs(a[1] - b[1])),
    "manhattan": lambda _, a, b: abs(a[0] - b[0]) + abs(a[1] - b[1]),
    "linear": _linear,
    "dogleg": _dogleg,
}


def _nearest_whole(x: float) -> int:
    """TSPLIB's nint of a number that is not negative: halves go up."""
    return int(x + 0.5)


def _att(a: Point, b: Point) -> float:
    """The pseudo-Euclidean distance of TSPLIB 95, section 2.5."""
    exact = math.sqrt(((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) / 10.0)
    rounded = _nearest_whole(exact)
    return float(rounded + 1 if rounded < exact else rounded)


#: TSPLIB 95's value of pi and its radius of the earth in km: the rule is only met with these.
_TSPLIB_PI = 3.141592
_EARTH_KM = 6378.388


def _radians(degrees_minutes: float) -> float:
    """Radians of TSPLIB's DDD.MM; the degrees are cut off, not rounded, as its FAQ corrects the 1995 text."""
    degrees = int(degrees_minutes)
    return _TSPLIB_PI * (degrees + 5.0 * (degrees_minutes - degrees) / 3.0) / 180.0


def _geo(a: Point, b: Point) -> float:
    """Kilometres on the idealised earth of TSPLIB 95, section 2.4; x is the latitude, y the longitude."""
    (latitude_a, longitude_a), (latitude_b, longitude_b) = (tuple(map(_radians, p)) for p in (a, b))
    q1 = math.cos(longitude_a - longitude_b)
    q2, q3 = math.cos(latitude_a - latitude_b), math.cos(latitude_a + latitude_b)
    cosine = 0.5 * ((1.0 + q1) * q2 - (1.0 - q1) * q3)
    return float(int(_EARTH_KM * math.acos(max(-1.0, min(1.0, cosine))) + 1.0))


TSPLIB: dict[str, Callable[[Point, Point], float]] = {
    "EUC_2D": lambda a, b: float(_nearest_whole(math.dist(a, b))),
    "CEIL_2D": lambda a, b: float(math.ceil(math.dist(a, b))),
    "MAX_2D": lambda a, b: float(max(_nearest_whole(abs(a[0] - b[0])), _nearest_whole(abs(a[1] - b[1])))),
    "MAN_2D": lambda a, b: float(_nearest_whole(abs(a[0] - b[0]) + abs(a[1] - b[1]))),
    "ATT": _att,
    "GEO": _geo,
}
