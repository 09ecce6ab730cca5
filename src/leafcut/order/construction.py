"""Construct the nearest-neighbour tour and the greedy tour, and allocate the buffers for the construction kernels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels.cost import EXPLICIT, CostModel
from leafcut.order.instance import Instance, build_tree, candidate_lists, matrix_of_nodes

if TYPE_CHECKING:
    from leafcut.kernels.construct import Unvisited

#: Number of candidates per fragment end in each round. One of the candidates may be the other end of the same fragment.
END_NEIGHBOURS = 5

#: Each round has a cost limit: half of the nodes have this many neighbours within the limit. The round does not join
#: longer edges. These wait until the lists are updated. We measured the mean excess over the optimum on 12 TSPLIB
#: boards, and the time for 100,000 random points:
#: 2 neighbours 13.7 %, 0.24 s; 3 13.6 %, 0.12 s; 4 15.0 %, 0.09 s; whole lists 20.3 %, 0.05 s.
SURE_NEIGHBOURS = 3

#: Randomized greedy tours lengthen edges by at most this fraction.
MOST_NOISE = 0.1


#: Up to this many nodes, we find the nearest node by comparing all nodes, which takes a few milliseconds.
FEW = 500


def allocate_unvisited_buffers(instance: Instance) -> Unvisited:
    """Allocate buffers for a worker. No node is marked as visited yet."""
    from leafcut.kernels.construct import Unvisited

    return Unvisited(
        np.zeros(instance.n, dtype=np.uint8),
        np.zeros(len(instance.tree.parent), dtype=np.int32),
        np.zeros(64, dtype=np.int32),
    )


def nearest_neighbour_tour(instance: Instance) -> NDArray[np.int32]:
    """Build the nearest-neighbour tour, int32[n]. It starts at the given start or at the first cluster."""
    if instance.n <= FEW:
        return _nearest_neighbour_tour_of_few(instance)
    from leafcut.kernels.construct import nearest_neighbour_tour

    tour = np.zeros(instance.n, dtype=np.int32)
    words, unvisited = np.ones(1, dtype=np.uint64), allocate_unvisited_buffers(instance)
    nearest_neighbour_tour(
        instance.cost, instance.tree, instance.default_start, instance.second, words, tour, unvisited
    )
    return tour


def _nearest_neighbour_tour_of_few(instance: Instance) -> NDArray[np.int32]:
    cost, explicit = instance.cost, len(instance.tree.x) == 0
    tour = [instance.default_start] if instance.second < 0 else [instance.first, instance.second]
    far = np.zeros(instance.n)
    far[tour] = np.inf
    while len(tour) < instance.n:
        last = tour[-1]
        if last == cost.free:
            away = far
        elif explicit:
            away = far.copy()
            away[: len(cost.matrix)] += cost.matrix[last]  # the free node has no row
        else:
            away = far + ((cost.xy - cost.xy[last]) ** 2).sum(axis=1)
        tour.append(int(np.argmin(away)))
        far[tour[-1]] = np.inf
    return np.array(tour, dtype=np.int32)


def _remove_free_node(
    free: int, lists: NDArray[np.int32], lengths: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Remove the free node from the candidate lists. It owns the last row and is the first entry in every other row."""
    if free < 0:
        return lists, lengths
    rest, costs = lists[:free].copy(), lengths[:free].copy()
    has = rest[:, 0] == free
    rest[has, :-1], costs[has, :-1] = rest[has, 1:], costs[has, 1:]
    rest[has, -1], costs[has, -1] = -1, np.inf
    return rest, costs


def greedy_tour(instance: Instance, random: np.random.Generator | None = None) -> NDArray[np.int32]:
    """Build the greedy tour, int32[n], by repeatedly adding the cheapest edge that can still be part of a tour.

    With `random`, each edge is lengthened by up to `MOST_NOISE`. Different calls then return different tours of similar
    quality.
    """
    from leafcut.kernels.greedy import join_fragments, write_path

    cost, n = instance.cost, instance.n
    tail, beside = np.arange(n, dtype=np.int32), np.full((n, 2), -1, dtype=np.int32)
    if cost.tied_a >= 0:
        join_fragments(tail, beside, cost.tied_a, cost.tied_b)
    # The free node, which is the last, is added after the other nodes form a single path.
    ends = np.arange(n if cost.free < 0 else n - 1, dtype=np.int32)
    lists, lengths = _remove_free_node(cost.free, instance.candidates, instance.lengths)
    while True:
        _join_fragments_along_candidates(lists, _with_noise(lengths, random), ends, tail, beside)
        ends = ends[tail[ends] >= 0]
        if len(ends) <= 1 or (len(ends) == 2 and tail[ends[0]] == ends[1]):
            break
        lists, lengths, ends = _candidates_between_fragment_ends(cost, ends)
    begin = int(ends[0])
    if cost.free >= 0:
        join_fragments(tail, beside, cost.free, begin)
        begin = cost.free
    tour = np.empty(n, dtype=np.int32)
    write_path(beside, begin, tour)
    return tour


def _with_noise(lengths: NDArray[np.float64], random: np.random.Generator | None) -> NDArray[np.float64]:
    return lengths if random is None else lengths * (1.0 + MOST_NOISE * random.random(lengths.shape))


def _median(values: NDArray[np.float64]) -> float:
    """Compute the median. Unlike `np.median`, this function does not import masked arrays, which would take time."""
    ordered, half = np.sort(values), len(values) // 2
    return float(ordered[half] if len(values) % 2 else (ordered[half - 1] + ordered[half]) / 2)


def _join_fragments_along_candidates(
    candidates: NDArray[np.int32],
    lengths: NDArray[np.float64],
    nodes: NDArray[np.int32],
    tail: NDArray[np.int32],
    beside: NDArray[np.int32],
) -> None:
    """Join the fragments of a tour along the candidate edges of `nodes`, cheapest edge first.

    The function skips edges that cost more than a typical edge to neighbour number `SURE_NEIGHBOURS`. Changes: tail,
    beside.
    """
    from leafcut.kernels.greedy import join_fragments_along_edges, list_joinable_edges

    k = candidates.shape[1]
    limit = np.inf if k >= len(nodes) - 1 else _median(lengths[:, min(SURE_NEIGHBOURS, k) - 1])
    edges = np.empty(candidates.size, dtype=np.uint64)
    count = list_joinable_edges(candidates, lengths, nodes, tail, limit, edges)
    edges[:count].sort()
    join_fragments_along_edges(edges, count, candidates, nodes, tail, beside)


def _candidates_between_fragment_ends(
    cost: CostModel, ends: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.int32]]:
    m, explicit = len(ends), cost.code == EXPLICIT
    tree, order = build_tree(np.zeros((0, 2)) if explicit else cost.xy[ends])
    nodes = ends if explicit else ends[order]
    among = cost._replace(xy=cost.xy[nodes], matrix=matrix_of_nodes(cost, nodes), tied_a=-1, tied_b=-1, free=-1)
    lists, lengths = candidate_lists(among, tree, m, m, min(END_NEIGHBOURS, m - 1))
    return lists, lengths, nodes


def random_states(seed: int, *stream: int, count: int) -> NDArray[np.uint64]:
    """Create a nonzero random state for each ant, uint64[count].

    Each state depends only on the seed, the stream, and the ant.
    """
    words = np.random.SeedSequence((seed, *stream)).generate_state(count, np.uint64)
    return np.maximum(words, np.uint64(1))
