"""Build a greedy tour: add the cheapest edges first, as long as they can still be part of a tour.

The edges come from neighbour lists and form fragments of the tour. The fragment ends are then joined in the same
manner, with new neighbour lists that contain only ends, until a single path remains.

======= ================ ======================================================================================
edges   uint64[m]        cost (bits of a float32, sortable as an integer) · 2³² + row·k + c
tail    int32[n]         other end of the fragment that ends at a node (itself if single); -1 for inner nodes
beside  int32[n, 2]      neighbours of a node in its fragment, -1 for none
======= ================ ======================================================================================

Source: J. L. Bentley, Fast algorithms for geometric traveling salesman problems, ORSA J. Computing 4 (1992) (greedy).
Differs: a sorted list of edges replaces the priority queue. This takes less work and selects nearly the same edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import kernel


@kernel
def list_joinable_edges(
    candidates: NDArray, lengths: NDArray, nodes: NDArray, tail: NDArray, limit: float, edges: NDArray
) -> int:
    """List each edge that can still be added and costs at most `limit`. Each edge is listed once.

    Returns the number of listed edges.

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
def join_fragments(tail: NDArray, neighbours: NDArray, i: int, j: int) -> bool:
    """If two nodes are the ends of different fragments, join them. Return whether they were joined.

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
def join_fragments_along_edges(
    edges: NDArray, count: int, candidates: NDArray, nodes: NDArray, tail: NDArray, neighbours: NDArray
) -> None:
    """Go through the first `count` edges in order, and join the nodes of each edge if possible.

    ``nodes`` int32[rows] is the node of each row of candidates int32[rows, k]. Changes: tail, neighbours.
    """
    k = candidates.shape[1]
    for e in range(count):
        index = np.int64(edges[e] & np.uint64(0xFFFFFFFF))
        row = index // k
        i = nodes[row]
        if tail[i] >= 0:
            join_fragments(tail, neighbours, i, nodes[candidates[row, index - row * k]])


@kernel
def write_path(neighbours: NDArray, start: int, tour: NDArray) -> None:
    """Follow the path that starts at a given node, and write its nodes to `tour`. Changes: tour int32[n]."""
    previous, node = -1, start
    for step in range(len(tour)):
        tour[step] = node
        previous, node = node, neighbours[node, 0 if neighbours[node, 0] != previous else 1]
