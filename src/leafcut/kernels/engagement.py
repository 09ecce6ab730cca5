"""Compute how much of a tool's edge engages the material at each point of a path."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.bands import Bands, band_at, first_point_right_of

_HALF = 0.5 * math.pi
#: Gap sequence for Shell's sort (M. Ciura, FCT 2001).
_GAPS = (701, 301, 132, 57, 23, 10, 4, 1)


class ToolEdge(NamedTuple):
    """Parameters of a tool's edge.

    ========= =======================================================================
    radius    radius of the tool, mm
    edge      radius at which to look for material: the tool radius minus the tolerance, mm
    near      path length over which discs of the same run also have the radius `edge`, mm
    nothing   angle below which an engagement counts as a rounding error, rad
    ========= =======================================================================
    """

    radius: float
    edge: float
    near: float
    nothing: float


class EdgePath(NamedTuple):
    """The points of a tool's path.

    ================ ============= ==================================================================
    x, y             float64[n]    points, mm
    ahead_x, ahead_y float64[n]    unit tangents of the outgoing path
    back_x, back_y   float64[n]    unit tangents of the incoming path; NaN for none
    run, station     int64, float64[n]  number of the run; path length up to here, mm
    ================ ============= ==================================================================
    """

    x: NDArray
    y: NDArray
    ahead_x: NDArray
    ahead_y: NDArray
    back_x: NDArray
    back_y: NDArray
    run: NDArray
    station: NDArray


@inner_kernel
def sort_intervals(low: NDArray, high: NDArray, count: int) -> None:
    """Sort the first `count` intervals by their starts (Shell's sort). Changes: low, high."""
    for gap in _GAPS:
        for k in range(gap, count):
            a, b, j = low[k], high[k], k
            while j >= gap and low[j - gap] > a:
                low[j], high[j] = low[j - gap], high[j - gap]
                j -= gap
            low[j], high[j] = a, b


@inner_kernel
def uncovered_edge(
    low: NDArray, high: NDArray, count: int, left: float, right: float, tolerance: float
) -> tuple[float, float, float]:
    """Compute the part of −π/2 … π/2 that no interval covers.

    Returns the angle of the uncovered part, the sum of its sines, and its smallest absolute angle.

    low, high    float64[count + 2], starts and ends of the intervals
    left, right  −π/2 … left and right … π/2 are covered as well

    Changes: low, high.
    """
    if left >= right:
        return 0.0, 0.0, _HALF
    low[count], high[count] = right, _HALF
    count += 1
    sort_intervals(low, high, count)
    # Add an interval of width 0 at the end, so that a gap before it is treated like any other gap.
    low[count], high[count] = _HALF, _HALF
    covered, sines, nearest, covered_to = left + _HALF, math.sin(left) + 1.0, _HALF, left
    for k in range(count + 1):
        a, b = low[k], high[k]
        if a - covered_to > tolerance:
            nearest = min(nearest, max(covered_to, -a, 0.0))
        if b > covered_to:
            a = max(a, covered_to)
            covered += b - a
            sines += math.sin(b) - math.sin(a)
            covered_to = b
    if covered >= math.pi - tolerance:
        return 0.0, 0.0, _HALF
    return math.pi - covered, 2.0 - min(sines, 2.0), nearest


@kernel
def measure_engagement(
    bands: Bands,
    path: EdgePath,
    tool: ToolEdge,
    low: NDArray,
    high: NDArray,
    angle: NDArray,
    width: NDArray,
    nearest: NDArray,
) -> None:
    """Compute the engagement at each point of a path: the part of the edge that no disc of an earlier point covers.

    Consider a disc at distance d in direction a, relative to the direction of travel. It covers the edge from a −
    acos(d / 2r) to a + acos(d / 2r). The rear half of the edge is skipped because the previous step's disc covers it.

    ================ ============= ===============================================================================
    bands                          the points in bands
    low, high        float64[2n+2] work arrays for intervals of angles
    angle            float64[n]    engagement angle, rad
    width            float64[n]    engaged width perpendicular to the path, in radii
    nearest          float64[n]    smallest angle between the direction of travel and the engagement, rad; π/2 for none
    ================ ============= ===============================================================================

    Changes: low, high, angle, width, nearest.
    """
    reach = 2.0 * tool.radius
    x, y, ahead_x, ahead_y, back_x, back_y, run, station = path
    for i in range(len(x)):
        # All intervals that reach an end of the half circle are merged into one.
        left, right, count = -_HALF, _HALF, 0
        for band in range(band_at(bands, y[i] - reach), band_at(bands, y[i] + reach) + 1):
            at = first_point_right_of(bands, band, x[i] - reach)
            while left < right and at < bands.first[band + 1] and bands.x[at] <= x[i] + reach:
                j, dx, dy = bands.row[at], bands.x[at] - x[i], bands.y[at] - y[i]
                at += 1
                square = dx * dx + dy * dy
                if j > i or square >= reach * reach:
                    continue
                if j == i:
                    if not math.isfinite(back_x[i]):
                        continue
                    half, dx, dy = _HALF, -back_x[i], -back_y[i]
                    along = dx * ahead_x[i] + dy * ahead_y[i]
                else:
                    along = dx * ahead_x[i] + dy * ahead_y[i]
                    # The factors are a margin for discs with the smaller radius `edge`.
                    if along <= -0.1 * reach and along * along >= 1.1 * square * (1.0 - square / (reach * reach)):
                        continue
                    recent = run[i] == run[j] and station[i] - station[j] < tool.near
                    if square > 0.0:
                        distance, disc = math.sqrt(square), tool.edge if recent else tool.radius
                        cosine = (tool.edge * tool.edge + square - disc * disc) / (2.0 * tool.edge * distance)
                        half = math.acos(min(max(cosine, -1.0), 1.0))
                    elif recent:
                        continue  # same position: the previous step covers the other half
                    else:
                        half = math.pi
                middle = math.atan2(ahead_x[i] * dy - ahead_y[i] * dx, along)
                for turn in range(-1, 2):
                    a = max(middle - half + turn * math.tau, -_HALF)
                    b = min(middle + half + turn * math.tau, _HALF)
                    if b <= a or b <= left or a >= right:
                        continue
                    if a <= left:
                        left = b
                    elif b >= right:
                        right = a
                    else:
                        low[count], high[count] = a, b
                        count += 1
        angle[i], width[i], nearest[i] = uncovered_edge(low, high, count, left, right, tool.nothing)
