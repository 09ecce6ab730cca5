"""Improve a path of clusters by ruin and recreate.

Each step removes a few clusters and reinserts them where they add the least cost. It then chooses the nodes of the
affected clusters again.

Sources: G. Schrimpf et al., J. Computational Physics 159 (2000), for ruin and recreate. J. Christiaens and G. Vanden
Berghe, Transportation Science 54 (2020), for removing pieces of the path near a position and for blinks on reinsertion.
S. L. Smith and F. Imeson, Computers & Operations Research 87 (2017), for removing and inserting sets (GLNS).
Differs: precedence limits the positions of a cluster. Gaps are skipped if the minimum cost between the clusters is too
high.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel
from leafcut.kernels.cluster_paths import Clusters, choose_nodes_between, closed_path_length
from leafcut.kernels.random import random_below, random_uniform

#: Indices into `AntPath.costs`.
PATH, BEST = 0, 1

#: A step removes at most MOST clusters, in pieces of at most LONGEST clusters.
MOST, LONGEST = 10, 6

#: SPARED is the probability of keeping a cluster near the first removed cluster. BLINK is the probability of skipping a
#: gap.
SPARED, BLINK = 0.3, 0.01

#: When a position changes, nodes are chosen again within this many positions on each side.
REACH = 2


class AntPath(NamedTuple):
    """An ant's current path, trial path, and best path.

    ======= ============== ===========================================================================
    path    int32[m]       the path: nodes in the order in which they are visited
    trial   int32[m]       trial path
    best    int32[m]       best path of the run
    place   int32[m]       position of each cluster in `trial`, -1 if removed
    out     int32[m]       removed clusters
    dirty   uint8[m]       1 for positions of `trial` whose nodes must be chosen again
    costs   float64[2]     costs of path and best
    sums    float64[2, w]  w is the maximum number of nodes in a cluster
    links   int32[m, w]
    ======= ============== ===========================================================================
    """

    path: NDArray[np.int32]
    trial: NDArray[np.int32]
    best: NDArray[np.int32]
    place: NDArray[np.int32]
    out: NDArray[np.int32]
    dirty: NDArray[np.uint8]
    costs: NDArray[np.float64]
    sums: NDArray[np.float64]
    links: NDArray[np.int32]


@inner_kernel
def remove_piece(layers: Clusters, walk: AntPath, c: int, length: int, count: int, states: NDArray, k: int) -> int:
    """Remove a piece of the path that contains cluster c, and return the number of removed clusters.

    This function only marks the clusters as removed. `close_gaps` closes the gaps. Changes: place, out, states[k].
    """
    m, place = len(walk.trial), walk.place
    start = place[c] - random_below(states, k, length)
    for i in range(length):
        p = (start + i + m) % m
        v = layers.owner[walk.trial[p]]
        if place[v] >= 0 and (p > 0 or layers.anchored[0] == 0) and count < m - 2:
            place[v] = -1
            walk.out[count] = v
            count += 1
    return count


@inner_kernel
def close_gaps(layers: Clusters, walk: AntPath) -> int:
    """Close the gaps that removed clusters left in the path, and return the number of remaining positions.

    Changes: trial, place, dirty.
    """
    kept, trial, place = 0, walk.trial, walk.place
    gap = False
    for at in range(len(trial)):
        c = layers.owner[trial[at]]
        if place[c] < 0:
            gap = True
            if kept > 0:
                walk.dirty[kept - 1] = 1
            continue
        trial[kept] = trial[at]
        place[c] = kept
        walk.dirty[kept] = gap
        gap = False
        kept += 1
    if gap:
        walk.dirty[0] = 1
    return kept


@inner_kernel
def find_cheapest_insertion(
    layers: Clusters, walk: AntPath, c: int, count: int, blink: float, states: NDArray, k: int
) -> tuple[int, int]:
    """Find the cheapest position for cluster c among `count` positions, and the node to use there.

    The search considers the gaps that precedence allows, and skips each of them with probability `blink`. Changes:
    states[k].
    """
    trial, place, owner, table, back = walk.trial, walk.place, layers.owner, layers.table, layers.back
    first, last = layers.anchored[0], count
    for e in range(layers.before_begin[c], layers.before_begin[c + 1]):
        first = max(first, place[layers.before[e]] + 1)
    for e in range(layers.after_begin[c], layers.after_begin[c + 1]):
        p = place[layers.after[e]]
        if p >= 0:
            last = min(last, p)
    best, gap, node = math.inf, last, layers.begin[c]
    x = trial[first - 1] if first > 0 else trial[count - 1]
    for p in range(first, last + 1):
        y = trial[p if p < count else 0]
        current = table[x, y]
        if (
            layers.least_back[c, owner[x]] + layers.least[c, owner[y]] - current < best
            and random_uniform(states, k) >= blink
        ):
            for w in range(layers.begin[c], layers.begin[c + 1]):
                added = table[x, w] + back[y, w] - current
                if added < best:
                    best, gap, node = added, p, w
        x = y
    return gap, node


@inner_kernel
def insert_cluster(layers: Clusters, walk: AntPath, c: int, count: int, blink: float, states: NDArray, k: int) -> None:
    """Insert cluster c at the cheapest of `count` positions in the path. Changes: trial, place, dirty, states[k]."""
    trial, place, dirty = walk.trial, walk.place, walk.dirty
    gap, node = find_cheapest_insertion(layers, walk, c, count, blink, states, k)
    for index in range(count, gap, -1):
        v = trial[index - 1]
        trial[index] = v
        place[layers.owner[v]] = index
        dirty[index] = dirty[index - 1]
    trial[gap] = node
    place[c] = gap
    dirty[gap] = 1
    dirty[gap - 1 if gap > 0 else count] = 1
    dirty[gap + 1 if gap < count else 0] = 1


@inner_kernel
def remove_pieces_around_neighbours(layers: Clusters, walk: AntPath, states: NDArray, k: int) -> int:
    """Remove pieces of the path around a few neighbouring clusters, and return the number of removed clusters.

    Changes: place, out, states[k].
    """
    n_clusters = len(walk.trial)
    target = 1 + random_below(states, k, MOST)
    centre = random_below(states, k, n_clusters)
    count = remove_piece(layers, walk, centre, 1 + random_below(states, k, min(LONGEST, target)), 0, states, k)
    for i in range(layers.near.shape[1]):
        if count >= target:
            break
        c = layers.near[centre, i]
        if walk.place[c] >= 0 and random_uniform(states, k) >= SPARED:
            count = remove_piece(
                layers, walk, c, 1 + random_below(states, k, min(LONGEST, target - count)), count, states, k
            )
    return count


@inner_kernel
def reinsert_clusters(layers: Clusters, walk: AntPath, count: int, n_removed: int, states: NDArray, k: int) -> None:
    """Reinsert the removed clusters in random order. Changes: trial, place, dirty, out, states[k]."""
    for i in range(n_removed - 1, 0, -1):
        j = random_below(states, k, i + 1)
        walk.out[i], walk.out[j] = walk.out[j], walk.out[i]
    for i in range(n_removed):
        insert_cluster(layers, walk, walk.out[i], count + i, BLINK, states, k)


@inner_kernel
def mark_nearby_positions(walk: AntPath) -> None:
    """Mark all positions within `REACH` of a position that is already marked. Changes: dirty."""
    m, dirty = len(walk.trial), walk.dirty
    for _ in range(REACH):
        first, previous = dirty[0], dirty[m - 1]
        for at in range(m):
            current = dirty[at]
            following = dirty[at + 1] if at + 1 < m else first
            if previous == 1 or following == 1:
                dirty[at] = 1
            previous = current


@inner_kernel
def rechoose_marked_nodes(layers: Clusters, walk: AntPath, states: NDArray, k: int) -> None:
    """Choose the nodes at all marked positions again.

    If all positions are marked, the node at one random position stays fixed. Changes: trial, dirty, sums, links,
    states[k].
    """
    m, dirty = len(walk.trial), walk.dirty
    clean = 0
    while clean < m and dirty[clean] == 1:
        clean += 1
    if clean == m:
        clean = random_below(states, k, m)
        dirty[clean] = 0
    at, end = clean + 1, clean + m
    while at < end:
        if dirty[at if at < m else at - m] == 0:
            at += 1
            continue
        first = at
        while at < end and dirty[at if at < m else at - m] == 1:
            at += 1
        shift = m if first >= m else 0
        choose_nodes_between(layers, walk.trial, first - shift, at - 1 - shift, walk.sums, walk.links)


@inner_kernel
def copy_path(path: NDArray, target: NDArray) -> None:
    """Copy a path, int32[m], to `target` without allocating memory. Changes: target."""
    for at in range(len(path)):
        target[at] = path[at]


@inner_kernel
def start_trial(layers: Clusters, walk: AntPath) -> None:
    """Start a trial with the current path. Changes: trial, place, dirty."""
    for at in range(len(walk.path)):
        walk.trial[at] = walk.path[at]
        walk.place[layers.owner[walk.path[at]]] = at
        walk.dirty[at] = 0


@kernel
def anneal(
    layers: Clusters, walk: AntPath, states: NDArray, k: int, heat: float, cooling: float, steps: int, min_gain: float
) -> float:
    """Ruin and recreate `steps` times, and return the final value of `heat`.

    If a step makes the path longer by x, the result is accepted with probability exp(-x / heat). Each step multiplies
    `heat` by `cooling`. The best path only changes if the gain exceeds `min_gain`.
    Changes: walk, states[k].
    """
    costs = walk.costs
    costs[PATH] = closed_path_length(layers, walk.path)
    for _ in range(steps):
        start_trial(layers, walk)
        n_removed = remove_pieces_around_neighbours(layers, walk, states, k)
        reinsert_clusters(layers, walk, close_gaps(layers, walk), n_removed, states, k)
        mark_nearby_positions(walk)
        rechoose_marked_nodes(layers, walk, states, k)
        length = closed_path_length(layers, walk.trial)
        if length < costs[PATH] - heat * math.log(1.0 - random_uniform(states, k)):
            copy_path(walk.trial, walk.path)
            costs[PATH] = length
            if length < costs[BEST] - min_gain:
                copy_path(walk.trial, walk.best)
                costs[BEST] = length
        heat *= cooling
    return heat
