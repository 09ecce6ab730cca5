"""Compute the cost of travel between two nodes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

EUCLIDEAN, CHEBYSHEV, MANHATTAN = 0, 1, 2
EUC_2D, CEIL_2D, ATT, GEO, MAX_2D, MAN_2D, EXPLICIT = 3, 4, 5, 6, 7, 8, 9
LINEAR, DOGLEG = 10, 11
#: Numeric code for each metric in `model.problem.METRICS`.
CODES = {
    "euclidean": EUCLIDEAN,
    "chebyshev": CHEBYSHEV,
    "manhattan": MANHATTAN,
    "EUC_2D": EUC_2D,
    "CEIL_2D": CEIL_2D,
    "ATT": ATT,
    "GEO": GEO,
    "MAX_2D": MAX_2D,
    "MAN_2D": MAN_2D,
    "EXPLICIT": EXPLICIT,
    "linear": LINEAR,
    "dogleg": DOGLEG,
}

#: The value of π and the radius of the earth in km that define GEO distances (TSPLIB 95, section 2.4).
GEO_PI, GEO_RADIUS = 3.141592, 6378.388

#: Cost of an edge that must not be removed. Its magnitude exceeds the cost of any real move in mm or s, but it is small
#: enough to keep gains exact to 1e-9. Larger rounding errors would look like gains, and the search would never end.
TIED = -(2.0**20)


#: Number of values in the first row of a relief matrix. The cost model stores travel heights in its matrix, because an
#: additional field would slow down every kernel. The first row contains the lower left corner of the tiles and their
#: side length in mm, the velocity and acceleration of z, the number of rows with node heights, and the number of tile
#: columns. The next rows contain the heights of the nodes in mm. The last rows contain the minimum height for crossing
#: each tile, or −∞ if the tile has no obstacle.
RELIEF = 7


def relief_table(header: tuple[float, ...], tiles: NDArray, heights: NDArray) -> NDArray[np.float64]:
    """Build the matrix of a relief (see `RELIEF`). The header is (x, y, side, velocity, acceleration)."""
    rows, columns = tiles.shape
    width = max(columns, RELIEF)
    above = -(-len(heights) // width)
    table = np.zeros((1 + above + rows, width))
    table[0, :RELIEF] = (*header, above, columns)
    table[1 : 1 + above].reshape(-1)[: len(heights)] = heights
    table[1 + above :, :columns] = tiles
    return table


class CostModel(NamedTuple):
    """Input of `node_travel_cost`. It has few fields because a kernel copies every field when it is not inlined.

    ============== ============== ==========================================================================
    code           int            code of the metric (see the constants above)
    plain          bool           True if only the metric matters: no free or tied node, zones, matrix, or relief
    xy             float64[n, 2]  positions of the nodes, mm (degrees and minutes for GEO)
    vx, vy         float          maximum velocity of x and y, mm/s
    ax, ay         float          acceleration of x and y, mm/s²
    per_mm         float          additional cost per mm, s/mm, in LINEAR and DOGLEG
    zones          float64[k, 4]  rectangles x0, y0, x1, y1 that the tool must lift over
    lift           float          cost of a lift
    matrix         float64[n, n]  costs of EXPLICIT; or heights of nodes and tiles (`RELIEF`);
                                  otherwise shape (0, 0)
    tied_a, tied_b int            the two nodes whose edge must not be removed, or -1
    free           int            node that costs 0 to reach from any node, for the free end of an open path, or -1
    ============== ============== ==========================================================================
    """

    code: int
    plain: bool
    xy: NDArray[np.float64]
    vx: float
    vy: float
    ax: float
    ay: float
    per_mm: float
    zones: NDArray[np.float64]
    lift: float
    matrix: NDArray[np.float64]
    tied_a: int
    tied_b: int
    free: int


@inner_kernel
def rest_to_rest_seconds(distance: float, velocity: float, acceleration: float) -> float:
    """Compute the duration in seconds of a move that starts and ends at rest.

    The velocity profile of a short move is a triangle. The profile of a longer move is a trapezoid.
    """
    ramp = velocity * velocity / acceleration
    if distance < ramp:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / velocity + velocity / acceleration


@inner_kernel
def rapid_seconds(code: int, dx: float, dy: float, vx: float, vy: float, ax: float, ay: float) -> float:
    """Compute the duration in seconds of a rapid by (dx, dy) ≥ 0 mm.

    The axes move together on LINEAR machines and independently on DOGLEG machines.
    """
    if code == DOGLEG:
        return max(rest_to_rest_seconds(dx, vx, ax), rest_to_rest_seconds(dy, vy, ay))
    # If axes are synchronised, the time follows from the maximum d/v and the maximum d/a of the axes.
    ramp = max(dx / vx, dy / vy)
    pull = max(dx / ax, dy / ay)
    if pull == 0.0:
        return 0.0
    if ramp * ramp < pull:
        return 2.0 * math.sqrt(pull)
    return ramp + pull / ramp


@inner_kernel
def _geographical_radians(degrees_minutes: float) -> float:
    degrees = float(int(degrees_minutes))
    return GEO_PI * (degrees + 5.0 * (degrees_minutes - degrees) / 3.0) / 180.0


@inner_kernel
def geographical_distance(xi: float, yi: float, xj: float, yj: float) -> float:
    """Compute the distance in whole kilometres between two points that are given in degrees.minutes.

    Source: TSPLIB 95, section 2.4.
    """
    latitude_i, longitude_i = _geographical_radians(xi), _geographical_radians(yi)
    latitude_j, longitude_j = _geographical_radians(xj), _geographical_radians(yj)
    q1 = math.cos(longitude_i - longitude_j)
    q2 = math.cos(latitude_i - latitude_j)
    q3 = math.cos(latitude_i + latitude_j)
    cosine = 0.5 * ((1.0 + q1) * q2 - (1.0 - q1) * q3)
    return float(int(GEO_RADIUS * math.acos(min(1.0, max(-1.0, cosine))) + 1.0))


@inner_kernel
def tsplib_distance(code: int, xi: float, yi: float, xj: float, yj: float) -> float:
    """Compute the integer distance between two points as TSPLIB defines it.

    Source: TSPLIB 95 (Reinelt), sections 2.1 to 2.6.
    """
    if code == GEO:
        return geographical_distance(xi, yi, xj, yj)
    dx, dy = abs(xi - xj), abs(yi - yj)
    if code == MAX_2D:
        return max(math.floor(dx + 0.5), math.floor(dy + 0.5))
    if code == MAN_2D:
        return math.floor(dx + dy + 0.5)
    if code == ATT:
        real = math.sqrt((dx * dx + dy * dy) / 10.0)
        rounded = math.floor(real + 0.5)
        return rounded + 1.0 if rounded < real else rounded
    length = math.sqrt(dx * dx + dy * dy)
    return math.ceil(length) if code == CEIL_2D else math.floor(length + 0.5)


@inner_kernel
def segment_touches_zone(zones: NDArray, k: int, xi: float, yi: float, xj: float, yj: float) -> bool:
    """Check whether the segment between two points touches the rectangle ``zones[k]`` (Liang–Barsky clipping)."""
    enter, leave = 0.0, 1.0
    for axis in range(2):
        start = xi if axis == 0 else yi
        step = (xj - xi) if axis == 0 else (yj - yi)
        low, high = zones[k, axis], zones[k, axis + 2]
        if step == 0.0:
            if start < low or start > high:
                return False
        else:
            t0, t1 = (low - start) / step, (high - start) / step
            if t0 > t1:
                t0, t1 = t1, t0
            enter, leave = max(enter, t0), min(leave, t1)
            if enter > leave:
                return False
    return True


@inner_kernel
def box_touches_zone(zones: NDArray, k: int, xi: float, yi: float, xj: float, yj: float) -> bool:
    """Check whether the bounding box of two points touches the rectangle ``zones[k]``."""
    if max(xi, xj) < zones[k, 0] or min(xi, xj) > zones[k, 2]:
        return False
    return not (max(yi, yj) < zones[k, 1] or min(yi, yj) > zones[k, 3])


@kernel
def metric_distance(
    code: int, xi: float, yi: float, xj: float, yj: float, vx: float, vy: float, ax: float, ay: float, per_mm: float
) -> float:
    """Compute the cost of travel between two points using only the metric."""
    dx, dy = abs(xi - xj), abs(yi - yj)
    if code == EUCLIDEAN:
        return math.sqrt(dx * dx + dy * dy)
    if code == EUC_2D:
        return math.floor(math.sqrt(dx * dx + dy * dy) + 0.5)
    if code >= LINEAR:
        return rapid_seconds(code, dx, dy, vx, vy, ax, ay) + per_mm * math.sqrt(dx * dx + dy * dy)
    if code == CHEBYSHEV:
        return max(dx, dy)
    if code == MANHATTAN:
        return dx + dy
    return tsplib_distance(code, xi, yi, xj, yj)


@inner_kernel
def max_tile_height_in_box(table: NDArray, xi: float, yi: float, xj: float, yj: float) -> float:
    """Return the maximum safe height of the tiles that two points' bounding box touches, or −∞ if it touches none."""
    x0, y0, side, above = table[0, 0], table[0, 1], table[0, 2], 1 + int(table[0, 5])
    first_c = max(math.floor((min(xi, xj) - x0) / side), 0)
    last_c = min(math.floor((max(xi, xj) - x0) / side), int(table[0, 6]) - 1)
    first_r = max(math.floor((min(yi, yj) - y0) / side), 0)
    last_r = min(math.floor((max(yi, yj) - y0) / side), len(table) - above - 1)
    best = -math.inf
    for r in range(first_r, last_r + 1):
        for c in range(first_c, last_c + 1):
            best = max(best, table[above + r, c])
    return best


@inner_kernel
def max_tile_height_on_line(table: NDArray, xi: float, yi: float, xj: float, yj: float) -> float:
    """Return the maximum safe height of the tiles that a straight move touches, or −∞ if it touches none.

    In each row of tiles, the move touches the columns between its entry and its exit. The range is widened slightly so
    that rounding cannot skip a tile.
    """
    x0, y0, side, above = table[0, 0], table[0, 1], table[0, 2], 1 + int(table[0, 5])
    rows, columns = len(table) - above, int(table[0, 6])
    if yj < yi or (yj == yi and xj < xi):
        xi, yi, xj, yj = xj, yj, xi, yi
    tolerance = 1e-6 * side
    first_r = max(math.floor((yi - tolerance - y0) / side), 0)
    last_r = min(math.floor((yj + tolerance - y0) / side), rows - 1)
    best = -math.inf
    for r in range(first_r, last_r + 1):
        left, right = xi, xj
        if yj > yi:
            low = min(max((y0 + r * side - tolerance - yi) / (yj - yi), 0.0), 1.0)
            high = min(max((y0 + (r + 1) * side + tolerance - yi) / (yj - yi), 0.0), 1.0)
            left, right = xi + low * (xj - xi), xi + high * (xj - xi)
        if right < left:
            left, right = right, left
        first_c = max(math.floor((left - tolerance - x0) / side), 0)
        last_c = min(math.floor((right + tolerance - x0) / side), columns - 1)
        for c in range(first_c, last_c + 1):
            best = max(best, table[above + r, c])
    return best


@inner_kernel
def node_height(table: NDArray, i: int) -> float:
    """Return the height of a node, mm."""
    return float(table[1 + i // table.shape[1], i % table.shape[1]])


@inner_kernel
def travel_height(code: int, xy: NDArray, table: NDArray, i: int, j: int) -> float:
    """Compute the height of the travel move from node i to node j in mm. It is at least the height of both nodes."""
    if code == DOGLEG:
        highest = max_tile_height_in_box(table, xy[i, 0], xy[i, 1], xy[j, 0], xy[j, 1])
    else:
        highest = max_tile_height_on_line(table, xy[i, 0], xy[i, 1], xy[j, 0], xy[j, 1])
    return float(max(highest, node_height(table, i), node_height(table, j)))


@inner_kernel
def _rise_and_fall_cost(cost: CostModel, i: int, j: int) -> float:
    """Compute the cost of rising from node i to the travel height and descending to node j."""
    height = travel_height(cost.code, cost.xy, cost.matrix, i, j)
    up, down = height - node_height(cost.matrix, i), height - node_height(cost.matrix, j)
    if cost.code < LINEAR:
        return float(up + down)
    vz, az = cost.matrix[0, 3], cost.matrix[0, 4]
    return rest_to_rest_seconds(up, vz, az) + rest_to_rest_seconds(down, vz, az)


@inner_kernel
def _general_travel_cost(cost: CostModel, i: int, j: int) -> float:
    """Compute the cost of travel like `node_travel_cost`, but also handle free and tied nodes, zones, and matrices."""
    if (i == cost.tied_a and j == cost.tied_b) or (i == cost.tied_b and j == cost.tied_a):
        return TIED
    if i == cost.free or j == cost.free:
        return 0.0
    if cost.code == EXPLICIT:
        return float(cost.matrix[i, j])
    xi, yi, xj, yj = cost.xy[i, 0], cost.xy[i, 1], cost.xy[j, 0], cost.xy[j, 1]
    base = metric_distance(cost.code, xi, yi, xj, yj, cost.vx, cost.vy, cost.ax, cost.ay, cost.per_mm)
    if len(cost.matrix) > 0:
        base += _rise_and_fall_cost(cost, i, j)
    if xj < xi or (xj == xi and yj < yi):
        # Both directions are computed alike. Otherwise rounding could make the cost asymmetric at the edge of a zone.
        xi, yi, xj, yj = xj, yj, xi, yi
    for k in range(cost.zones.shape[0]):
        # With unsynchronised axes, the path is not straight and may touch any part of the box between the points.
        if box_touches_zone(cost.zones, k, xi, yi, xj, yj) and (
            cost.code == DOGLEG or segment_touches_zone(cost.zones, k, xi, yi, xj, yj)
        ):
            return base + cost.lift
    return base


@inner_kernel
def depends_only_on_metric(cost: CostModel) -> bool:
    """Check whether the cost between ordinary nodes depends only on the metric."""
    return len(cost.zones) == 0 and len(cost.matrix) == 0


@inner_kernel
def is_free_or_tied(cost: CostModel, i: int) -> bool:
    """Check whether a node is free or tied."""
    return bool(i == cost.free or i == cost.tied_a or i == cost.tied_b)


@inner_kernel
def node_travel_cost(cost: CostModel, i: int, j: int) -> float:
    """Compute the cost of travel between nodes i and j. The cost is symmetric."""
    if cost.plain or (depends_only_on_metric(cost) and not is_free_or_tied(cost, i) and not is_free_or_tied(cost, j)):
        xy = cost.xy
        return metric_distance(
            cost.code, xy[i, 0], xy[i, 1], xy[j, 0], xy[j, 1], cost.vx, cost.vy, cost.ax, cost.ay, cost.per_mm
        )
    return _general_travel_cost(cost, i, j)


@inner_kernel
def uses_straight_cost(cost: CostModel) -> bool:
    """Check whether `straight_travel_cost` gives the correct cost of travel between ordinary nodes."""
    metric = cost.code == EUCLIDEAN or cost.code == EUC_2D or cost.code == CEIL_2D
    return metric and depends_only_on_metric(cost)


@inner_kernel
def straight_travel_cost(xy: NDArray, code: int, i: int, j: int) -> float:
    """Compute the same cost as `node_travel_cost`, provided that `uses_straight_cost` holds.

    Numba inlines this short function. Calling `node_travel_cost`, which passes all fields of the cost model, made local
    search a quarter slower.
    """
    dx, dy = xy[i, 0] - xy[j, 0], xy[i, 1] - xy[j, 1]
    length = math.sqrt(dx * dx + dy * dy)
    if code == EUCLIDEAN:
        return length
    if code == CEIL_2D:
        return math.ceil(length)
    return float(int(length + 0.5))  # like `math.floor`, but without a function call


@kernel
def tour_cost(cost: CostModel, tour: NDArray) -> float:
    """Compute the cost of a closed tour, int32[n], without tied edges."""
    total = 0.0
    for k in range(len(tour)):
        step = node_travel_cost(cost, tour[k], tour[k - 1])
        if step != TIED:
            total += step
    return total


@kernel
def travel_heights_along_path(code: int, xy: NDArray, table: NDArray, heights: NDArray) -> None:
    """Compute the travel height from each node (`xy`: float64[n, 2]) to the next node, using the nodes' `relief_table`.

    Changes: heights float64[n - 1], mm.
    """
    for i in range(len(heights)):
        heights[i] = travel_height(code, xy, table, i, i + 1)


@kernel
def edge_costs(cost: CostModel, leave: NDArray, arrive: NDArray, costs: NDArray) -> None:
    """Compute the travel cost of each edge from leave[e] to arrive[e], int32[m] each. Changes: costs float64[m]."""
    for e in range(len(leave)):
        costs[e] = node_travel_cost(cost, leave[e], arrive[e])
