"""The part of a tool's edge that is in material at every place of a way."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from leafcut.kernels import kernel, part
from leafcut.kernels.bands import Bands, band_at, from_left

_HALF = 0.5 * math.pi
#: Distances of places that are compared first when intervals are sorted (M. Ciura, FCT 2001).
_GAPS = (701, 301, 132, 57, 23, 10, 4, 1)


class ToolEdge(NamedTuple):
    """Numbers of a tool's edge.

    ========= =======================================================================
    radius    of the tool, mm
    edge      radius at which material is looked for, mm: less by the tolerance
    near      discs of one run that are nearer along the way are as small, mm
    nothing   an angle below this is rounding, rad
    ========= =======================================================================
    """

    radius: float
    edge: float
    near: float
    nothing: float


@part
def sort_intervals(low: NDArray, high: NDArray, count: int) -> None:
    """Sort the first intervals by where they begin (Shell's sort). Changes: low, high."""
    for gap in _GAPS:
        for k in range(gap, count):
            a, b, j = low[k], high[k], k
            while j >= gap and low[j - gap] > a:
                low[j], high[j] = low[j - gap], high[j - gap]
                j -= gap
            low[j], high[j] = a, b


@part
def uncovered(
    low: NDArray, high: NDArray, count: int, left: float, right: float, nothing: float
) -> tuple[float, float, float]:
    """Return what intervals leave of −π/2 … π/2: how much of it, of its sines, and the least angle either way.

    low, high    float64[count + 2], where they begin and end
    left, right  from −π/2 to `left` and from `right` to π/2 all is covered

    Changes: low, high.
    """
    if left >= right:
        return 0.0, 0.0, _HALF
    low[count], high[count] = right, _HALF
    count += 1
    sort_intervals(low, high, count)
    # One of no width at the end: what is uncovered before it is seen as any other gap.
    low[count], high[count] = _HALF, _HALF
    covered, sines, least, done = left + _HALF, math.sin(left) + 1.0, _HALF, left
    for k in range(count + 1):
        a, b = low[k], high[k]
        if a - done > nothing:
            least = min(least, max(done, -a, 0.0))
        if b > done:
            a = max(a, done)
            covered += b - a
            sines += math.sin(b) - math.sin(a)
            done = b
    if covered >= math.pi - nothing:
        return 0.0, 0.0, _HALF
    return math.pi - covered, 2.0 - min(sines, 2.0), least


@kernel
def engaged_edges(
    bands: Bands, x: NDArray, y: NDArray, ahead_x: NDArray, ahead_y: NDArray, back_x: NDArray, back_y: NDArray,
    run: NDArray, station: NDArray, tool: ToolEdge, low: NDArray, high: NDArray, angle: NDArray, width: NDArray,
    nearest: NDArray,
) -> None:  # fmt: skip
    """Find what is engaged at every place of a way: what the discs about earlier places do not cover of its edge.

    A disc at the distance d, an angle a off the way ahead, covers the edge up to acos(d / 2r) from a on both sides. The
    half of the edge that looks back is not looked at; the disc of the step before covers what is behind that.

    ================ ============= ===============================================================================
    bands                          the places in bands
    x, y             float64[n]    places of the way, mm
    ahead_x, ahead_y float64[n]    unit tangents of the way on
    back_x, back_y   float64[n]    unit tangents of the way that leads here; NaN where there is none
    run, station     int64, float64[n]  number of the run; length of the way up to here, mm
    low, high        float64[2n+2] room for intervals of angles
    angle            float64[n]    engaged, rad
    width            float64[n]    its width square to the way, in radii
    nearest          float64[n]    least angle between the way ahead and what is engaged, rad; π/2 without any
    ================ ============= ===============================================================================

    Changes: low, high, angle, width, nearest.
    """
    reach = 2.0 * tool.radius
    for i in range(len(x)):
        # Intervals that begin or end at an end of the half circle are one at each end.
        left, right, count = -_HALF, _HALF, 0
        for band in range(band_at(bands, y[i] - reach), band_at(bands, y[i] + reach) + 1):
            at = from_left(bands, band, x[i] - reach)
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
                    # With some room for the discs that are looked at a tolerance inside their edge.
                    if along <= -0.1 * reach and along * along >= 1.1 * square * (1.0 - square / (reach * reach)):
                        continue
                    recent = run[i] == run[j] and station[i] - station[j] < tool.near
                    if square > 0.0:
                        distance, disc = math.sqrt(square), tool.edge if recent else tool.radius
                        cosine = (tool.edge * tool.edge + square - disc * disc) / (2.0 * tool.edge * distance)
                        half = math.acos(min(max(cosine, -1.0), 1.0))
                    elif recent:
                        continue  # about the very place: nothing that the step before does not cover
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
        angle[i], width[i], nearest[i] = uncovered(low, high, count, left, right, tool.nothing)
