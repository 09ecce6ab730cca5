"""A k-d tree over the nodes. It finds the nearest neighbours in each quadrant and the nearest unvisited node.

Points are numbered in the order of the leaves. Each leaf is therefore contiguous in memory, and points with similar
numbers are close to each other. Points at the same position ("twins") have consecutive numbers.

Source: J. L. Bentley, K-d trees for semidynamic point sets, SoCG 1990 (bottom-up search, deletion by counting).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

#: Number of points per leaf. The search scans a whole leaf. With few points, this is cheaper than another level of the
#: tree.
LEAF_SIZE = 8

#: List at most this many twins of a point.
MOST_TWINS = 2

#: Rows of `Nearby` that follow the rows of quadrants 0 … 3.
REST, TWINS = 4, 5


class Tree(NamedTuple):
    """A k-d tree that has m tree nodes over n points. The root is tree node 0.

    ======= ============= ===================================================
    x, y    float64[n]    the points, in the order of the leaves
    leaf_of int32[n]      leaf of every point
    begin   int32[m]      first point of a tree node
    stop    int32[m]      index after the last point of a tree node
    box     float64[m, 4] bounding box of its points, x0, y0, x1, y1
    child   int32[m]      left child; the right child is the next node; -1 for a leaf
    parent  int32[m]      -1 for the root
    ======= ============= ===================================================
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    leaf_of: NDArray[np.int32]
    begin: NDArray[np.int32]
    stop: NDArray[np.int32]
    box: NDArray[np.float64]
    child: NDArray[np.int32]
    parent: NDArray[np.int32]


class Nearby(NamedTuple):
    """Result of a search by quadrant. Each row lists points, nearest first. Each worker has its own object.

    ====== ============= ============================================================================================
    found  int32[6, w]   points by quadrant, other points (row REST), and twins (row TWINS); -1 for none
    near   float64[6, w] their squared distances, infinite for none
    chosen int32[w]      selected points
    limit  float64[6]    squared distance at and above which a row accepts no more points
    stack  int32[64]     tree nodes to visit
    ====== ============= ============================================================================================
    """

    found: NDArray[np.int32]
    near: NDArray[np.float64]
    chosen: NDArray[np.int32]
    limit: NDArray[np.float64]
    stack: NDArray[np.int32]


@inner_kernel
def _swap_points(u: NDArray, v: NDArray, label: NDArray, i: int, j: int) -> None:
    u[i], u[j] = u[j], u[i]
    v[i], v[j] = v[j], v[i]
    label[i], label[j] = label[j], label[i]


@inner_kernel
def _quickselect(u: NDArray, v: NDArray, label: NDArray, low: int, high: int, middle: int) -> None:
    """Partially sort the run low … high by u until position `middle` has its final value (quickselect).

    Changes: u, v, label.
    """
    while low < high:
        pivot = u[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while u[i] < pivot:
                i += 1
            while u[j] > pivot:
                j -= 1
            if i <= j:
                _swap_points(u, v, label, i, j)
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@inner_kernel
def _split_run(u: NDArray, v: NDArray, label: NDArray, start: int, stop: int) -> int:
    """Split a run of points by u near its middle, and return the start of the right part.

    Points with equal values of u stay together.
    Changes: u, v, label.
    """
    middle = (start + stop) // 2
    _quickselect(u, v, label, start, stop - 1, middle)
    value = u[middle]
    first, last = middle, middle + 1
    for i in range(middle - 1, start - 1, -1):
        if u[i] == value:
            first -= 1
            _swap_points(u, v, label, i, first)
    for i in range(middle + 1, stop):
        if u[i] == value:
            _swap_points(u, v, label, i, last)
            last += 1
    # The points first … last - 1 have equal values. Split before or after them, whichever is closer to the middle,
    # unless a part would be empty.
    if first > start and (last == stop or middle - first <= last - middle):
        return first
    return last if last < stop else middle


@inner_kernel
def _sort_leaf(x: NDArray, y: NDArray, label: NDArray, start: int, stop: int) -> None:
    """Sort a few points by position and then by label, so that points at the same position follow each other.

    Changes: x, y, label.
    """
    for i in range(start + 1, stop):
        j = i
        while j > start and (
            x[j - 1] > x[j]
            or (x[j - 1] == x[j] and (y[j - 1] > y[j] or (y[j - 1] == y[j] and label[j - 1] > label[j])))
        ):
            _swap_points(x, y, label, j - 1, j)
            j -= 1


@inner_kernel
def _set_bounding_box(x: NDArray, y: NDArray, start: int, stop: int, box: NDArray, node: int) -> None:
    x0, y0, x1, y1 = math.inf, math.inf, -math.inf, -math.inf
    for i in range(start, stop):
        x0, x1 = min(x0, x[i]), max(x1, x[i])
        y0, y1 = min(y0, y[i]), max(y1, y[i])
    box[node, 0], box[node, 1], box[node, 2], box[node, 3] = x0, y0, x1, y1


@kernel
def fill_tree(
    x: NDArray,
    y: NDArray,
    label: NDArray,
    n_separate: int,
    leaf_of: NDArray,
    begin: NDArray,
    stop: NDArray,
    box: NDArray,
    child: NDArray,
    parent: NDArray,
    stack: NDArray,
) -> int:
    """Sort the points into the order of the leaves, and fill the arrays of a `Tree`. Return the number of tree nodes.

    The last `n_separate` points (≤ LEAF_SIZE) get their own leaf, so they keep their positions in the arrays. Each leaf
    has at least one point, so the arrays need space for 2n + 1 tree nodes.
    Changes: all arrays. `label` int32[n] is permuted with the points.
    """
    begin[0], stop[0], parent[0] = 0, len(x), -1
    stack[0] = 0
    count, height = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        b, s = begin[node], stop[node]
        child[node] = -1
        _set_bounding_box(x, y, b, s, box, node)
        if node == 0 and 0 < n_separate < s:
            cut = s - n_separate
        elif s - b <= LEAF_SIZE:
            if b < len(x) - n_separate:
                _sort_leaf(x, y, label, b, s)
            for i in range(b, s):
                leaf_of[i] = node
            continue
        elif box[node, 2] - box[node, 0] >= box[node, 3] - box[node, 1]:
            cut = _split_run(x, y, label, b, s)
        else:
            cut = _split_run(y, x, label, b, s)
        child[node] = count
        begin[count], stop[count], parent[count] = b, cut, node
        begin[count + 1], stop[count + 1], parent[count + 1] = cut, s, node
        # Split depth first, the left child first, so that neighbours in the plane are close in memory.
        stack[height], stack[height + 1] = count + 1, count
        height += 2
        count += 2
    return count


@inner_kernel
def _insert_sorted(points: NDArray, distances: NDArray, row: int, capacity: int, j: int, d: float) -> None:
    """Insert j at squared distance d into a sorted row that holds at most `capacity` points.

    Changes: points, distances.
    """
    slot = capacity - 1
    while slot > 0 and distances[row, slot - 1] > d:
        distances[row, slot], points[row, slot] = distances[row, slot - 1], points[row, slot - 1]
        slot -= 1
    distances[row, slot], points[row, slot] = d, j


@inner_kernel
def _record_twin(points: NDArray, j: int) -> None:
    for c in range(MOST_TWINS):
        if points[TWINS, c] == j:
            return
        if points[TWINS, c] < 0:
            points[TWINS, c] = j
            return


@inner_kernel
def _record_nearest_in_run(
    x: NDArray,
    y: NDArray,
    start: int,
    stop: int,
    i: int,
    points: NDArray,
    distances: NDArray,
    per_quadrant: int,
    capacity: int,
) -> int:
    """Record the points of a run that are among the nearest in their quadrant, and other points if space remains.

    If several points have the same position, only the first and the last are examined. Returns the space left for other
    points. Changes: points, distances.
    """
    xi, yi, last = x[i], y[i], per_quadrant - 1
    step = max(1, stop - 1 - start) if stop - start > LEAF_SIZE else 1
    for j in range(start, stop, step):
        dx, dy = x[j] - xi, y[j] - yi
        d = dx * dx + dy * dy
        quadrant = (0 if dx > 0.0 else 1) if dy > 0.0 or (dy == 0.0 and dx > 0.0) else (2 if dx < 0.0 else 3)
        limit = distances[quadrant, last]
        rest_limit = distances[REST, capacity - 1] if capacity > 0 else -1.0
        if d >= limit and d >= rest_limit:
            continue
        if dx == 0.0 and dy == 0.0:
            if j != i:
                _record_twin(points, j)
            continue
        if start < j < stop - 1 and x[j - 1] == x[j] == x[j + 1] and y[j - 1] == y[j] == y[j + 1]:
            continue
        if d >= limit:
            _insert_sorted(points, distances, REST, capacity, j, d)
            continue
        dropped = points[quadrant, last]
        _insert_sorted(points, distances, quadrant, per_quadrant, j, d)
        if dropped < 0:
            capacity -= 1
        elif limit < rest_limit:
            _insert_sorted(points, distances, REST, capacity, dropped, limit)
    return capacity


@inner_kernel
def squared_distance_to_box(box: NDArray, node: int, x: float, y: float) -> float:
    """Compute the squared distance from a position to a tree node's bounding box. Inside the box, the distance is 0."""
    dx = max(box[node, 0] - x, x - box[node, 2], 0.0)
    dy = max(box[node, 1] - y, y - box[node, 3], 0.0)
    return float(dx * dx + dy * dy)


@inner_kernel
def _set_quadrant_limits(points: NDArray, distances: NDArray, per_quadrant: int, capacity: int, limit: NDArray) -> None:
    """Set the squared distance limit of each row. Row REST has the largest limit. Changes: limit."""
    rest_limit = distances[REST, capacity - 1] if capacity > 0 else -1.0
    limit[REST] = 0.0
    for quadrant in range(4):
        limit[quadrant] = max(distances[quadrant, per_quadrant - 1], rest_limit)
        limit[REST] = max(limit[REST], limit[quadrant])
    # Twins have distance 0, the only value below this limit.
    limit[TWINS] = 1e-300 if points[TWINS, MOST_TWINS - 1] < 0 else 0.0


@inner_kernel
def _box_is_within_limits(box: NDArray, node: int, x: float, y: float, limit: NDArray) -> bool:
    """Check whether a box may contain a point at (x, y), or reaches into a quadrant within the quadrant's limit."""
    d = squared_distance_to_box(box, node, x, y)
    if d >= limit[REST]:
        return False
    x0, y0, x1, y1 = box[node, 0], box[node, 1], box[node, 2], box[node, 3]
    if x1 > x and y1 >= y and d < limit[0]:
        return True
    if x0 <= x and y1 > y and d < limit[1]:
        return True
    if x0 < x and y0 <= y and d < limit[2]:
        return True
    if x1 >= x and y0 < y and d < limit[3]:
        return True
    return bool(d < limit[TWINS])


@inner_kernel
def find_nearby(tree: Tree, i: int, per_quadrant: int, k: int, nearby: Nearby) -> None:
    """Find the points nearest to point i.

    The result contains the nearest points in each quadrant, the nearest other points up to k in total, and the twins of
    i.

    Twins are points at the same position. Quadrants are half open, so each direction belongs to exactly one quadrant.
    The twins of i belong to no quadrant, because there may be thousands of them. If possible, the search lists the
    twins directly before and after i, so that all twins form a chain. If points at another position are twins, the
    search lists only the first and the last of them. More twins would displace other positions.
    Changes: nearby.
    """
    x, y, box, child = tree.x, tree.y, tree.box, tree.child
    points, distances, stack, limit = nearby.found, nearby.near, nearby.stack, nearby.limit
    xi, yi = x[i], y[i]
    points[:] = -1
    distances[:] = math.inf
    for j in range(max(0, i - 1), min(len(x), i + 2)):
        if j != i and x[j] == xi and y[j] == yi:
            _record_twin(points, j)
    node, up, capacity, height = -1, tree.leaf_of[i], k, 1
    stack[0] = up
    while up >= 0:
        while height > 0:
            height -= 1
            box_node = stack[height]
            if box_node != up and not _box_is_within_limits(box, box_node, xi, yi, limit):
                continue
            left = child[box_node]
            if left < 0 or (box[box_node, 0] == box[box_node, 2] and box[box_node, 1] == box[box_node, 3]):
                capacity = _record_nearest_in_run(
                    x, y, tree.begin[box_node], tree.stop[box_node], i, points, distances, per_quadrant, capacity
                )
                _set_quadrant_limits(points, distances, per_quadrant, capacity, limit)
                continue
            right_first = squared_distance_to_box(box, left + 1, xi, yi) < squared_distance_to_box(box, left, xi, yi)
            stack[height] = left if right_first else left + 1
            stack[height + 1] = left + 1 if right_first else left
            height += 2
        node, up = up, tree.parent[up]
        if up >= 0:
            stack[0] = child[up] + 1 if child[up] == node else child[up]
            height = 1


@inner_kernel
def mark_point_visited(tree: Tree, alive: NDArray, i: int) -> None:
    """Subtract point i from the tree's counts of unvisited points. Changes: alive int32[m]."""
    node = tree.leaf_of[i]
    while node >= 0:
        alive[node] -= 1
        node = tree.parent[node]


@inner_kernel
def nearest_unvisited(tree: Tree, alive: NDArray, visited: NDArray, i: int, stack: NDArray) -> int:
    """Find the unvisited point nearest to point i. Return -1 if all points have been visited.

    Symbols: alive int32[m] is the number of unvisited points below each tree node; visited uint8[n].
    Changes: stack int32[64].
    """
    box, x, y = tree.box, tree.x, tree.y
    xi, yi = x[i], y[i]
    best, best_d = -1, math.inf
    node, came_from = tree.leaf_of[i], -1
    while node >= 0:
        stack[0] = node
        if came_from >= 0:
            stack[0] = tree.child[node] + 1 if came_from == tree.child[node] else tree.child[node]
        height = 1
        while height > 0:
            height -= 1
            box_node = stack[height]
            if alive[box_node] == 0 or squared_distance_to_box(box, box_node, xi, yi) >= best_d:
                continue
            left = tree.child[box_node]
            if left < 0:
                for j in range(tree.begin[box_node], tree.stop[box_node]):
                    if visited[j] == 0:
                        d = (x[j] - xi) * (x[j] - xi) + (y[j] - yi) * (y[j] - yi)
                        if d < best_d:
                            best, best_d = j, d
                continue
            right_first = squared_distance_to_box(box, left + 1, xi, yi) < squared_distance_to_box(box, left, xi, yi)
            stack[height] = left if right_first else left + 1
            stack[height + 1] = left + 1 if right_first else left
            height += 2
        came_from = node
        node = tree.parent[node]
    return best
