"""A k-d tree over the nodes: nearest neighbours, by quadrant too, and the nearest node not yet visited.

Source: J. L. Bentley, K-d trees for semidynamic point sets, SoCG 1990 (bottom-up search, deletion by counting).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import kernel

#: Points per leaf: the whole leaf is scanned, so a few points cost less than one more level.
LEAF_SIZE = 8


class Tree(NamedTuple):
    """A k-d tree of m tree nodes over n points.

    ======= =========== ===================================================
    x, y    float64[n]  the points
    order   int32[n]    points, so that every tree node owns a run of them
    leaf_of int32[n]    the leaf of every point
    begin   int32[m]    first of the run in `order`
    stop    int32[m]    one past its last
    axis    int8[m]     0 splits x, 1 splits y
    split   float64[m]  left holds values ≤ split, right values ≥ split
    child   int32[m]    left child; right is the next one; -1 for a leaf
    parent  int32[m]    -1 for the root
    ======= =========== ===================================================
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    order: NDArray[np.int32]
    leaf_of: NDArray[np.int32]
    begin: NDArray[np.int32]
    stop: NDArray[np.int32]
    axis: NDArray[np.int8]
    split: NDArray[np.float64]
    child: NDArray[np.int32]
    parent: NDArray[np.int32]


@kernel
def _select(values: NDArray, order: NDArray, low: int, high: int, middle: int) -> None:
    """Order the run low … high so that its `middle` is in place (quickselect). Changes: order."""
    while low < high:
        pivot = values[order[(low + high) // 2]]
        i, j = low, high
        while i <= j:
            while values[order[i]] < pivot:
                i += 1
            while values[order[j]] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@kernel
def _spread(values: NDArray, order: NDArray, begin: int, stop: int) -> float:
    low, high = math.inf, -math.inf
    for k in range(begin, stop):
        low, high = min(low, values[order[k]]), max(high, values[order[k]])
    return high - low


@kernel
def grow_tree(
    x: NDArray,
    y: NDArray,
    order: NDArray,
    leaf_of: NDArray,
    begin: NDArray,
    stop: NDArray,
    axis: NDArray,
    split: NDArray,
    child: NDArray,
    parent: NDArray,
) -> int:
    """Fill the arrays of a `Tree` (all but x, y; order = 0 … n-1 on entry) and return how many tree nodes it has.

    Changes: all arrays but x and y.
    """
    begin[0], stop[0], parent[0], child[0] = 0, len(x), -1, -1
    count, node = 1, 0
    while node < count:
        b, s = begin[node], stop[node]
        child[node] = -1
        if s - b > LEAF_SIZE:
            wide = _spread(x, order, b, s) >= _spread(y, order, b, s)
            middle = (b + s) // 2
            values = x if wide else y
            _select(values, order, b, s - 1, middle)
            axis[node] = 0 if wide else 1
            split[node] = values[order[middle]]
            child[node] = count
            begin[count], stop[count], parent[count] = b, middle, node
            begin[count + 1], stop[count + 1], parent[count + 1] = middle, s, node
            count += 2
        else:
            for k in range(b, s):
                leaf_of[order[k]] = node
        node += 1
    return count


@kernel
def _in_quadrant(dx: float, dy: float, quadrant: int) -> bool:
    """Quadrants are half open, so that every direction but none belongs to exactly one; a point on top to all."""
    if quadrant < 0 or (dx == 0.0 and dy == 0.0):
        return True
    if quadrant == 0:
        return dx > 0.0 and dy >= 0.0
    if quadrant == 1:
        return dx <= 0.0 and dy > 0.0
    if quadrant == 2:
        return dx < 0.0 and dy <= 0.0
    return dx >= 0.0 and dy < 0.0


@kernel
def _scan_leaf(tree: Tree, leaf: int, i: int, quadrant: int, found: NDArray, near: NDArray, k: int, have: int) -> int:
    for slot in range(tree.begin[leaf], tree.stop[leaf]):
        j = tree.order[slot]
        dx, dy = tree.x[j] - tree.x[i], tree.y[j] - tree.y[i]
        if j == i or not _in_quadrant(dx, dy, quadrant):
            continue
        d = dx * dx + dy * dy
        if have == k and d >= near[k - 1]:
            continue
        if have < k:
            have += 1
        place = have - 1
        while place > 0 and near[place - 1] > d:
            near[place], found[place] = near[place - 1], found[place - 1]
            place -= 1
        near[place], found[place] = d, j
    return have


@kernel
def nearest_k(tree: Tree, i: int, k: int, quadrant: int, found: NDArray, near: NDArray, stack: NDArray) -> int:
    """Find the k points nearest to point i, in one quadrant (0 … 3) or in all (-1); return how many there are.

    Changes: found int32[≥k] (nearest first), near float64[≥k] (squared distances), stack int32[64].
    """
    leaf = tree.leaf_of[i]
    have = _scan_leaf(tree, leaf, i, quadrant, found, near, k, 0)
    node = leaf
    while tree.parent[node] >= 0:
        up = tree.parent[node]
        sibling = tree.child[up] + 1 if node == tree.child[up] else tree.child[up]
        height = 0
        stack[0] = sibling
        gap = (tree.x[i] if tree.axis[up] == 0 else tree.y[i]) - tree.split[up]
        if have < k or gap * gap < near[k - 1]:
            height = 1
        while height > 0:
            height -= 1
            at = stack[height]
            if tree.child[at] < 0:
                have = _scan_leaf(tree, at, i, quadrant, found, near, k, have)
                continue
            gap = (tree.x[i] if tree.axis[at] == 0 else tree.y[i]) - tree.split[at]
            left = tree.child[at]
            close, far = (left, left + 1) if gap <= 0.0 else (left + 1, left)
            if have < k or gap * gap < near[k - 1]:
                stack[height] = far
                height += 1
            stack[height] = close
            height += 1
        node = up
    return have


@kernel
def remove(tree: Tree, alive: NDArray, i: int) -> None:
    """Take point i out of the counts. Changes: alive int32[m]."""
    node = tree.leaf_of[i]
    while node >= 0:
        alive[node] -= 1
        node = tree.parent[node]


@kernel
def nearest_unvisited(tree: Tree, alive: NDArray, visited: NDArray, i: int, stack: NDArray) -> int:
    """Return the unvisited point nearest to point i, or -1 when all are visited.

    Symbols: alive int32[m], unvisited points under every tree node; visited uint8[n].
    Changes: stack int32[64].
    """
    best, best_d = -1, math.inf
    node, came_from = tree.leaf_of[i], -1
    while node >= 0:
        if alive[node] > 0:
            height = 0
            if came_from < 0:
                stack[0] = node
                height = 1
            else:
                gap = (tree.x[i] if tree.axis[node] == 0 else tree.y[i]) - tree.split[node]
                if gap * gap < best_d:
                    stack[0] = tree.child[node] + 1 if came_from == tree.child[node] else tree.child[node]
                    height = 1
            while height > 0:
                height -= 1
                at = stack[height]
                if alive[at] == 0:
                    continue
                if tree.child[at] < 0:
                    for slot in range(tree.begin[at], tree.stop[at]):
                        j = tree.order[slot]
                        if visited[j] == 0:
                            dx, dy = tree.x[j] - tree.x[i], tree.y[j] - tree.y[i]
                            d = dx * dx + dy * dy
                            if d < best_d or (d == best_d and j < best):
                                best, best_d = j, d
                    continue
                gap = (tree.x[i] if tree.axis[at] == 0 else tree.y[i]) - tree.split[at]
                left = tree.child[at]
                close, far = (left, left + 1) if gap <= 0.0 else (left + 1, left)
                if gap * gap < best_d:
                    stack[height] = far
                    height += 1
                stack[height] = close
                height += 1
        came_from = node
        node = tree.parent[node]
    return best
