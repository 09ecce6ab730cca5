"""Cost of travel in plain Python, the reference of the compiled code: a machine's, and the rules of TSPLIB."""

from __future__ import annotations

import math
from collections.abc import Callable

from leafcut.geometry.arrays import Point
from leafcut.geometry.zones import touches_any_zone
from leafcut.model.problem import Metric
from leafcut.timing import travel


def travel_cost(metric: Metric, a: Point, b: Point) -> float:
    """Return the cost of travel between two places; those of TSPLIB have zones, and no relief."""
    if metric.name not in TSPLIB:
        return travel.travel_cost(metric, a, b)
    return TSPLIB[metric.name](a, b) + (metric.lift if touches_any_zone([a], [b], metric.zones)[0] else 0.0)


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
