"""How near leafcut's lower bound of a board comes to the best that 1-trees can prove.

    python benchmarks/held_karp.py --write docs/colony.md

The best bound by 1-trees is the least cost of a fractional tour: two edges' worth at every node, and at least two into
every set of nodes (Held and Karp 1970). Here it is found by linear programming with scipy's HiGHS, which shares nothing
with leafcut's ascent: sets that are left too loosely are added until there are none. It is taken over edges to near
nodes alone, so it is a ceiling: with all edges it can only be lower.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from boards import Board, load
from numpy.typing import NDArray
from page import facts, table, write_section
from scipy.optimize import linprog
from scipy.sparse import csr_array, vstack
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow
from tsplib import problem_of

from leafcut.options import SolveOptions
from leafcut.solve.instance import Instance, build_instance, costs_of_edges
from leafcut.solve.solve import solve

#: Boards measured unless others are named: some minutes in all.
USUAL = ["lin318", "pcb442", "d657", "rl1304", "u1817", "d2103", "pcb3038"]
#: Nearest nodes whose edges there are, unless told otherwise.
NEAR = 12
#: Parts of an edge that make components whose sets are looked at before any flow is worked out.
PARTS = (0.0, 0.9, 0.7, 0.5, 0.3, 0.1)
#: Flows are whole numbers; so much is an edge of which all is in the tour.
WHOLE = 1_000_000
#: Sets found by flows that end a round.
SETS = 15
#: A set is left too loosely below two by this; far more than HiGHS is off by.
LOOSE = 1e-5


def ceiling(instance: Instance) -> float:
    """Return the least cost of a fractional tour over the candidate edges of an instance."""
    n, lists = instance.n, instance.candidates
    ends = np.stack([np.repeat(np.arange(n), lists.shape[1]), lists.ravel()])
    edges: NDArray[np.int32] = np.unique(np.sort(ends[:, ends[1] >= 0], axis=0), axis=1).astype(np.int32)
    costs = costs_of_edges(instance.cost, *map(np.ascontiguousarray, edges))
    count = edges.shape[1]
    degrees = csr_array((np.ones(2 * count), (edges.ravel(), np.tile(np.arange(count), 2))), shape=(n, count))
    rows: list[Any] = []
    while True:
        most = {"A_ub": -vstack(rows), "b_ub": np.full(len(rows), -2.0)} if rows else {}
        found = linprog(costs, A_eq=degrees, b_eq=np.full(n, 2.0), bounds=(0.0, 1.0), method="highs", **most)
        assert found.status == 0, found.message
        new = loose_sets(edges, found.x, n)
        if not new:
            return float(found.fun)
        rows += [csr_array((inside[edges[0]] != inside[edges[1]]).astype(float)[None]) for inside in new]


def loose_sets(edges: NDArray[np.int32], taken: NDArray[np.float64], n: int) -> list[NDArray[np.bool_]]:
    """Return sets of nodes, bool[n], into which less than two edges' worth leads; none where there are none."""
    for parts in (PARTS[:1], PARTS[1:]):  # subtours first
        if found := [inside for part in parts for inside in loose_components(edges, taken, n, part)]:
            return found
    return list(itertools.islice(loose_cuts(edges, taken, n), SETS))


def loose_components(
    edges: NDArray[np.int32], taken: NDArray[np.float64], n: int, part: float
) -> Iterator[NDArray[np.bool_]]:
    """Yield the loose sets among those that edges join of which more than a part is taken."""
    some = taken > max(part, LOOSE)
    count, label = connected_components(graph(edges[:, some], taken[some], n), directed=False)
    for number in range(count if count > 1 else 0):
        inside = label == number
        if taken[inside[edges[0]] != inside[edges[1]]].sum() < 2.0 - LOOSE:
            yield inside


def loose_cuts(edges: NDArray[np.int32], taken: NDArray[np.float64], n: int) -> Iterator[NDArray[np.bool_]]:
    """Yield the sets that part the first node from others where less than two edges' worth flows between them."""
    both = np.concatenate([edges, edges[::-1]], axis=1)
    room = graph(both, np.rint(np.tile(taken, 2) * WHOLE).astype(np.int32), n)
    for to in range(1, n):
        flow = maximum_flow(room, 0, to)
        if flow.flow_value < (2.0 - LOOSE) * WHOLE - n:
            left = room - flow.flow
            left.data[left.data < 0] = 0
            left.eliminate_zeros()
            inside = np.zeros(n, dtype=bool)
            inside[breadth_first_order(left, 0, return_predecessors=False)] = True
            yield inside


def graph(edges: NDArray[np.int32], weights: NDArray[Any], n: int) -> Any:
    """Return the matrix of a graph."""
    return csr_array((weights, (edges[0], edges[1])), shape=(n, n))


def row_of(board: Board, near: int) -> list[str]:
    """Return the row of a board: its nodes, and how far both bounds are below its length to compare with, percent.

    Raises
    ------
    AssertionError
        leafcut's bound is above what no bound by 1-trees can be above.
    """
    problem = problem_of(board)
    bound = solve(problem, SolveOptions(preset="fast", threads=1)).lower_bound
    assert bound is not None
    most = ceiling(build_instance(problem, near))
    # leafcut's is rounded up to a whole number where all costs are.
    assert bound <= most + 1.0, f"{board.name}: {bound} is above {most}"
    return [board.name, f"{board.n:,}", f"{-board.gap_percent(bound):.3f}", f"{-board.gap_percent(most):.3f}"]


def main() -> None:
    """Measure, print the table, write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("boards", nargs="*", default=USUAL, help="names of boards")
    made.add_argument("--near", type=int, default=NEAR, help="nearest nodes whose edges there are")
    made.add_argument("--write", type=Path, help="the page whose section is replaced")
    given = made.parse_args()
    rows = []
    for name in given.boards:
        rows.append(row_of(load(name), given.near))
        print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    text = f"""How far lower bounds are below the optimum, percent: leafcut's, and the best that 1-trees can prove, over
edges to {given.near} near nodes (over all edges it can only be further below).

{table(["board", "nodes", "leafcut", "best by 1-trees"], rows)}

{facts("held_karp", sys.argv[1:], ["leafcut", "numpy", "scipy"])}"""
    print(text)
    if given.write:
        write_section(given.write, "held-karp", text)


if __name__ == "__main__":
    main()
