"""Build a greedy tour: add the cheapest edges first, provided that they can belong to a tour.

The edges come from neighbour lists and form fragments of the tour. The ends of the fragments are joined in the same
way, with new neighbour lists of only the ends, until a single path remains.

======= ================ ======================================================================================
edges   uint64[m]        cost (bits of a float32, sortable as an integer) · 2³² + row·k + c
tail    int32[n]         other end of the fragment that ends at a node (itself if single); -1 for inner nodes
beside  int32[n, 2]      neighbours of a node in its fragment, -1 for none
======= ================ ======================================================================================

Source: J. L. Bentley, Fast algorithms for geometric traveling salesman problems, ORSA J. Computing 4 (1992) (greedy).
Differs: a sorted list of edges replaces the priority queue. This is less work and gives nearly the same edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import kernel


@kernel
def list_edges(
    candidates: NDArray, lengths: NDArray, nodes: NDArray, tail: NDArray, limit: float, edges: NDArray
) -> int:
    """List each edge that can be added and costs at most `limit` once, and return the number of edges.

    ========== ================ ===================================
    candidates int32[rows, k]   neighbours of every row, -1 for none
    lengths    float64[rows, k] their costs
    nodes      int32[rows]      node of each row
    ========== ================ ===================================

    Costs are rounded to seven digits (float32). Changes: edges[≥rows·k].
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
                for slot in range(k):
                    listed = listed or candidates[j, slot] == i
            if not listed:
                bits = np.uint64(np.float32(length).view(np.uint32))
                # Negative costs occur only in matrices; their bits sort in reverse order.
                key = bits ^ np.uint64(0xFFFFFFFF if length < 0.0 else 0x80000000)
                edges[count] = (key << np.uint64(32)) | np.uint64(i * k + c)
                count += 1
    return count


@kernel
def join(tail: NDArray, neighbours: NDArray, i: int, j: int) -> bool:
    """Join two nodes if they are ends of different fragments, and return whether they were joined.

    Changes: tail, neighbours.
    """
    a, b = tail[i], tail[j]
    if a < 0 or b < 0 or a == j:
        return False
    neighbours[i, 0 if neighbours[i, 0] < 0 else 1] = j
    neighbours[j, 0 if neighbours[j, 0] < 0 else 1] = i
    tail[i] = tail[j] = -1
    tail[a], tail[b] = b, a
    return True


@kernel
def join_edges(
    edges: NDArray, count: int, candidates: NDArray, nodes: NDArray, tail: NDArray, neighbours: NDArray
) -> None:
    """Join the nodes of each of the first `count` edges, in order, if possible.

    ``nodes`` int32[rows] is the node of each row of candidates int32[rows, k]. Changes: tail, neighbours.
    """
    k = candidates.shape[1]
    for e in range(count):
        index = np.int64(edges[e] & np.uint64(0xFFFFFFFF))
        row = index // k
        i = nodes[row]
        if tail[i] >= 0:
            join(tail, neighbours, i, nodes[candidates[row, index - row * k]])


@kernel
def walk_path(neighbours: NDArray, start: int, tour: NDArray) -> None:
    """Write the nodes of the path that starts at a given node to `tour`. Changes: tour int32[n]."""
    previous, node = -1, start
    for step in range(len(tour)):
        tour[step] = node
        previous, node = node, neighbours[node, 0 if neighbours[node, 0] != previous else 1]
