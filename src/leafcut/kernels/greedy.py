"""The greedy tour: the cheapest edges first, as far as they leave room for a tour.

Edges come from lists of neighbours. What they leave are fragments: paths whose inner nodes have their two edges. The
ends of the fragments are joined in the same way by new lists of the ends alone, until one path is left.

======= ================ ======================================================================================
edges   uint64[m]        cost (as the bits of a float32, so that it can be sorted as a whole number) · 2³² + row·k + c
tail    int32[n]         the other end of the fragment that a node is an end of (itself, if alone); -1 for inner nodes
beside  int32[n, 2]      the neighbours of a node in its fragment, -1 for none
======= ================ ======================================================================================

Source: J. L. Bentley, Fast algorithms for geometric traveling salesman problems, ORSA J. Computing 4 (1992) (greedy).
Differs: lists and a sort instead of a queue of the nearest ends: less work, and next to the same edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import kernel


@kernel
def list_edges(
    candidates: NDArray, lengths: NDArray, nodes: NDArray, tail: NDArray, limit: float, edges: NDArray
) -> int:
    """List once every edge that can be joined and costs no more than `limit`; return how many there are.

    ========== ================ ===================================
    candidates int32[rows, k]   neighbours of every row, -1 for none
    lengths    float64[rows, k] their costs
    nodes      int32[rows]      the node that each row stands for
    ========== ================ ===================================

    Costs are cut to seven digits, as float32. Changes: edges[≥rows·k].
    """
    count = 0
    k = candidates.shape[1]
    for i in range(candidates.shape[0]):
        end = tail[nodes[i]]
        if end < 0:
            continue
        for c in range(k):
            j = candidates[i, c]
            if j < 0:
                break
            length = lengths[i, c]
            if length > limit or tail[nodes[j]] < 0 or end == nodes[j]:
                continue
            listed = False
            if j < i:
                for other in range(k):
                    listed = listed or candidates[j, other] == i
            if not listed:
                bits = np.uint64(np.float32(length).view(np.uint32))
                # Negative numbers, of matrices only, are ordered the other way round.
                key = bits ^ np.uint64(0xFFFFFFFF if length < 0.0 else 0x80000000)
                edges[count] = (key << np.uint64(32)) | np.uint64(i * k + c)
                count += 1
    return count


@kernel
def join(tail: NDArray, beside: NDArray, i: int, j: int) -> bool:
    """Join two nodes, if they are ends of different fragments; return whether they were. Changes: tail, beside."""
    a, b = tail[i], tail[j]
    if a < 0 or b < 0 or a == j:
        return False
    beside[i, 0 if beside[i, 0] < 0 else 1] = j
    beside[j, 0 if beside[j, 0] < 0 else 1] = i
    tail[i] = tail[j] = -1
    tail[a], tail[b] = b, a
    return True


@kernel
def join_edges(edges: NDArray, count: int, candidates: NDArray, nodes: NDArray, tail: NDArray, beside: NDArray) -> None:
    """Join nodes by the first `count` edges, in their order, wherever it can be done.

    ``nodes`` int32[rows] says which node a row of candidates int32[rows, k] stands for. Changes: tail, beside.
    """
    k = candidates.shape[1]
    for e in range(count):
        at = np.int64(edges[e] & np.uint64(0xFFFFFFFF))
        row = at // k
        i = nodes[row]
        if tail[i] >= 0:
            join(tail, beside, i, nodes[candidates[row, at - row * k]])


@kernel
def walk_path(beside: NDArray, begin: int, tour: NDArray) -> None:
    """Write down the path that begins at a node. Changes: tour int32[n]."""
    came, at = -1, begin
    for step in range(len(tour)):
        tour[step] = at
        came, at = at, beside[at, 0 if beside[at, 0] != came else 1]
