"""Ruin and recreate on a path: remove a few clusters, reinsert them, and choose the nodes there again."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from leafcut.kernels import kernel, part
from leafcut.kernels.insertion import AntPath, close_path, put_back, take_piece
from leafcut.kernels.layers import Clusters, choose_between, ring_length
from leafcut.kernels.random import below, uniform

#: Entries of `AntPath.costs`.
PATH, BEST = 0, 1

#: Maximum number of removed clusters, and maximum length of a removed piece.
MOST, LONGEST = 10, 6

#: Probability of keeping a cluster near the first removed cluster, and of skipping a gap.
SPARED, BLINK = 0.3, 0.01

#: Distance from a changed position within which nodes are chosen again, in positions.
REACH = 2


@part
def forget(layers: Clusters, walk: AntPath, states: NDArray, k: int) -> int:
    """Remove a few neighbouring clusters, in pieces of the path; return how many. Changes: place, out, states[k]."""
    n_clusters = len(walk.trial)
    target = 1 + below(states, k, MOST)
    centre = below(states, k, n_clusters)
    count = take_piece(layers, walk, centre, 1 + below(states, k, min(LONGEST, target)), 0, states, k)
    for i in range(layers.near.shape[1]):
        if count >= target:
            break
        c = layers.near[centre, i]
        if walk.place[c] >= 0 and uniform(states, k) >= SPARED:
            count = take_piece(layers, walk, c, 1 + below(states, k, min(LONGEST, target - count)), count, states, k)
    return count


@part
def find_places(layers: Clusters, walk: AntPath, count: int, n_removed: int, states: NDArray, k: int) -> None:
    """Reinsert the removed clusters in random order. Changes: trial, place, dirty, out, states[k]."""
    for i in range(n_removed - 1, 0, -1):
        j = below(states, k, i + 1)
        walk.out[i], walk.out[j] = walk.out[j], walk.out[i]
    for i in range(n_removed):
        put_back(layers, walk, walk.out[i], count + i, BLINK, states, k)


@part
def spread_dirty(walk: AntPath) -> None:
    """Mark the neighbours of marked positions, `REACH` times. Changes: dirty."""
    m, dirty = len(walk.trial), walk.dirty
    for _ in range(REACH):
        first, previous = dirty[0], dirty[m - 1]
        for at in range(m):
            current = dirty[at]
            following = dirty[at + 1] if at + 1 < m else first
            if previous == 1 or following == 1:
                dirty[at] = 1
            previous = current


@part
def choose_dirty(layers: Clusters, walk: AntPath, states: NDArray, k: int) -> None:
    """Choose the nodes at all marked positions again; if all are marked, a random one is kept. Changes: trial, dirty,
    sums, links, states[k].
    """
    m, dirty = len(walk.trial), walk.dirty
    clean = 0
    while clean < m and dirty[clean] == 1:
        clean += 1
    if clean == m:
        clean = below(states, k, m)
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
        choose_between(layers, walk.trial, first - shift, at - 1 - shift, walk.sums, walk.links)


@part
def copy_path(path: NDArray, target: NDArray) -> None:
    """Copy a path int32[m]; a loop allocates no memory. Changes: target."""
    for at in range(len(path)):
        target[at] = path[at]


@part
def begin_trial(layers: Clusters, walk: AntPath) -> None:
    """Start a trial with the current path. Changes: trial, place, dirty."""
    for at in range(len(walk.path)):
        walk.trial[at] = walk.path[at]
        walk.place[layers.owner[walk.path[at]]] = at
        walk.dirty[at] = 0


@kernel
def anneal(
    layers: Clusters, walk: AntPath, states: NDArray, k: int, heat: float, cooling: float, steps: int, min_gain: float
) -> float:
    """Ruin and recreate `steps` times; a path longer by x is accepted with probability exp(-x / heat).

    `heat` is multiplied by `cooling` at every step, and its final value is returned. The best path changes only by
    gains above `min_gain`.
    Changes: walk, states[k].
    """
    costs = walk.costs
    costs[PATH] = ring_length(layers, walk.path)
    for _ in range(steps):
        begin_trial(layers, walk)
        n_removed = forget(layers, walk, states, k)
        find_places(layers, walk, close_path(layers, walk), n_removed, states, k)
        spread_dirty(walk)
        choose_dirty(layers, walk, states, k)
        length = ring_length(layers, walk.trial)
        if length < costs[PATH] - heat * math.log(1.0 - uniform(states, k)):
            copy_path(walk.trial, walk.path)
            costs[PATH] = length
            if length < costs[BEST] - min_gain:
                copy_path(walk.trial, walk.best)
                costs[BEST] = length
        heat *= cooling
    return heat
