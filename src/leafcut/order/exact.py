"""The best order of a few clusters, by dynamic programming over sets of them.

Source: M. Held and R. M. Karp, Journal of the SIAM 10 (1962), section 2; the state here is a set of clusters and the
node that was worked last, so that clusters of several nodes, directions and precedence are all one case.
"""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats, Ints
from leafcut.model.problem import RoutingProblem
from leafcut.order.instance import cost_model, costs_of_edges

#: Most states (sets of clusters by nodes), 8 bytes each; more clusters have too many sets whatever their nodes.
MOST_STATES, MOST_CLUSTERS = 5_000_000, 18

#: Most sums of a state and a way that are looked at, over all nodes that a closed path may begin with: about a second.
MOST_SUMS = 2e8


def within_reach(problem: RoutingProblem) -> bool:
    """Return whether the best path can be found in about a second."""
    m, n = problem.n_clusters, problem.n_nodes
    if not 0 < m <= MOST_CLUSTERS:
        return False
    firsts = n if problem.closed else 1
    return n << m <= MOST_STATES and firsts * n * n << m <= MOST_SUMS


def best_nodes(problem: RoutingProblem, pairs: Ints) -> Ints:
    """Return int32[clusters]: the nodes of the cheapest path, in their order, that keeps pairs int32[k, 2].

    The problem has to be `within_reach`, and its precedence one that can be kept.
    """
    table = _Table(problem, pairs)
    if not problem.closed:
        return table.cheapest(table.begun, table.home)[1]
    # A closed path begins somewhere: without precedence with cluster 0, else with any that nothing comes before.
    firsts = np.flatnonzero(table.needs[problem.cluster] == 0) if len(pairs) else np.flatnonzero(problem.cluster == 0)
    paths = []
    for first in firsts:
        begun = np.full(problem.n_nodes, np.inf)
        begun[first] = problem.service[first]
        paths.append(table.cheapest(begun, table.ways[:, first]))
    return min(paths, key=lambda path: path[0])[1]


class _Table:
    """What the ways cost, and what must come before what.

    Attributes
    ----------
    ways
        float64[nodes, nodes]: from the exit of one to the entry of the other.
    begun, home
        float64[nodes]: to have worked a node first, and to go to the end from it, on an open path.
    needs
        int64[clusters]: a bit for every cluster that must come before.
    """

    def __init__(self, problem: RoutingProblem, pairs: Ints) -> None:
        self.problem, n, m = problem, problem.n_nodes, problem.n_clusters
        ends = [p if p is not None else (0.0, 0.0) for p in (problem.start, problem.end)]
        cost = cost_model(problem.metric, np.concatenate([problem.entry, problem.exit, np.array(ends)]))
        node = np.arange(n, dtype=np.int32)
        leave = node if problem.metric.name == "EXPLICIT" else node + np.int32(n)
        self.ways: Floats = costs_of_edges(cost, np.repeat(leave, n), np.tile(node, n)).reshape(n, n)
        self.begun, self.home = problem.service.astype(np.float64), np.zeros(n)
        if not problem.closed and problem.start is not None:
            self.begun = self.begun + costs_of_edges(cost, np.full(n, 2 * n, dtype=np.int32), node)
        if not problem.closed and problem.end is not None:
            self.home = costs_of_edges(cost, leave, np.full(n, 2 * n + 1, dtype=np.int32))
        self.needs = np.zeros(m, dtype=np.int64)
        np.bitwise_or.at(self.needs, pairs[:, 1], np.int64(1) << pairs[:, 0].astype(np.int64))
        sets = np.arange(1 << m, dtype=np.int64)
        size = sum((sets >> c & 1 for c in range(m)), np.zeros(len(sets), dtype=np.int64))
        self.levels = [sets[size == k] for k in range(m)]
        self.members = [np.flatnonzero(problem.cluster == c) for c in range(m)]

    def cheapest(self, begun: Floats, home: Floats) -> tuple[float, Ints]:
        """Return the cheapest path and its cost; `begun`: what it costs to have worked each node first."""
        problem, m = self.problem, self.problem.n_clusters
        spent = np.full((1 << m, problem.n_nodes), np.inf)
        for c in range(m):
            if self.needs[c] == 0:
                spent[1 << c, self.members[c]] = begun[self.members[c]]
        for level in self.levels[1:]:
            for c in range(m):
                done = level[(level >> c & 1 == 0) & (level & self.needs[c] == self.needs[c])]
                for node in self.members[c]:
                    least = (spent[done] + self.ways[:, node]).min(axis=1)
                    spent[done | 1 << c, node] = least + problem.service[node]
        return self._followed_back(spent, home)

    def _followed_back(self, spent: Floats, home: Floats) -> tuple[float, Ints]:
        """Return the cheapest path that the table float64[sets, nodes] holds, and its cost."""
        cluster, done = self.problem.cluster, (1 << self.problem.n_clusters) - 1
        total = spent[done] + home
        nodes = [int(np.argmin(total))]
        while done := done & ~(1 << int(cluster[nodes[-1]])):
            nodes.append(int(np.argmin(spent[done] + self.ways[:, nodes[-1]])))
        return float(total.min()), np.array(nodes[::-1], dtype=np.int32)
