"""Check whether the precedence of clusters is valid, and derive implied pairs and impossible moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import SolveError
from leafcut.geometry.arrays import Ints
from leafcut.message import Message
from leafcut.model.problem import RoutingProblem

#: Maximum number of clusters for computing the transitive closure, which takes n² bytes. Larger problems only use the
#: given pairs.
CLOSURE_LIMIT = 3000


def validate_pairs(problem: RoutingProblem) -> Ints:
    """Return the problem's pairs (before, after) without duplicates, int32[k, 2].

    Raises SolveError if a pair names an unknown cluster, or if the pairs form a cycle that no order can satisfy.
    """
    given = np.asarray(problem.precedence).reshape(-1, 2)
    if len(given) and not (given.min() >= 0 and given.max() < problem.n_clusters):
        wrong = next(pair for pair in given.tolist() if min(pair) < 0 or max(pair) >= problem.n_clusters)
        raise SolveError(
            "precedence pair {}: clusters are numbered 0 to {}; correct the pair", tuple(wrong), problem.n_clusters - 1
        )
    # Without pairs, `np.unique` is not called, because it would import masked arrays, which takes time.
    pairs: Ints = (np.unique(given, axis=0) if len(given) else given).astype(np.int32)
    order = _topological_order(pairs, problem.n_clusters)
    if len(order) < problem.n_clusters:
        raise SolveError(_cycle_message(pairs, set(range(problem.n_clusters)).difference(order)))
    return pairs


def satisfies_pairs(pairs: Ints, order: NDArray[np.int32]) -> bool:
    """Check whether an order, int32[clusters], satisfies all pairs."""
    return violated_pair(pairs, order) is None


def violated_pair(pairs: Ints, order: NDArray[np.int32]) -> tuple[int, int] | None:
    """Return the first pair that an order violates, or None if it violates no pair."""
    place = np.argsort(order)
    wrong = np.flatnonzero(place[pairs[:, 0]] >= place[pairs[:, 1]])
    return None if not len(wrong) else (int(pairs[wrong[0], 0]), int(pairs[wrong[0], 1]))


def compressed_rows(pairs: Ints, n: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Store the pairs in compressed rows.

    Returns the index at which each cluster's partners start, int32[n + 1], and the list of all partners.
    """
    ordered = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    begin = np.searchsorted(ordered[:, 0], np.arange(n + 1)).astype(np.int32)
    return begin, np.ascontiguousarray(ordered[:, 1])


def transitive_closure(pairs: Ints, n: int) -> NDArray[np.bool_]:
    """Compute the transitive closure of the pairs, bool[n, n]. If entry i, j is set, cluster i must come before j."""
    later = np.zeros((n, n), dtype=np.bool_)
    begin, after = compressed_rows(pairs, n)
    for v in reversed(_topological_order(pairs, n)):
        straight = after[begin[v] : begin[v + 1]]
        later[v] = later[straight].any(axis=0)
        later[v, straight] = True
    return later


def impossible_moves_and_reduction(pairs: Ints, n: int) -> tuple[NDArray[np.bool_], Ints]:
    """Compute the impossible moves, bool[n, n], and the transitive reduction of the pairs.

    A move is impossible if it goes to a predecessor or skips a cluster that must come in between.
    """
    later, between = transitive_closure(pairs, n), np.zeros((n, n), dtype=np.bool_)
    begin, after = compressed_rows(pairs, n)
    for v in range(n):
        between[v] = later[after[begin[v] : begin[v + 1]]].any(axis=0)
    return later.T | between, pairs[~between[pairs[:, 0], pairs[:, 1]]]


def _topological_order(pairs: Ints, n: int) -> list[int]:
    """Sort the clusters topologically. The order omits clusters on a cycle and their successors."""
    begin, after = compressed_rows(pairs, n)
    missing = np.bincount(pairs[:, 1], minlength=n)
    order: list[int] = np.flatnonzero(missing == 0).tolist()
    for v in order:  # grows during the loop
        for w in after[begin[v] : begin[v + 1]].tolist():
            missing[w] -= 1
            if missing[w] == 0:
                order.append(w)
    return order


def _cycle_message(pairs: Ints, left: set[int]) -> Message:
    before = {int(b): int(a) for a, b in pairs if int(a) in left and int(b) in left}
    way: list[int] = [min(before)]
    while way[-1] not in way[:-1]:
        way.append(before[way[-1]])
    ring: Sequence[int] = way[way.index(way[-1]) : -1]
    if len(ring) == 1:
        return Message("cluster {} must come before itself: no order satisfies this; remove that pair", ring[0])
    through = Message(" (via {} more)", len(ring) - 2) if len(ring) > 2 else ""
    last, first = ring[0], ring[1]
    return Message(
        "cluster {} must come before cluster {}, and cluster {} before cluster {}{}: "
        "no order satisfies both; remove one of the pairs",
        first,
        last,
        last,
        first,
        through,
    )
