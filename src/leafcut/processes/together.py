"""Several paths that follow each other, such as those of the tools of a program, ordered together.

Where one path ends the next begins, so a path that is short by itself may make the whole longer. First all are ordered
in turn, quickly, and again, each between the one before and the one behind it; that fixes what is first and last in
each. Then each is ordered well between its fixed ends. What is fixed depends on a small, counted amount of work and not
on the budget, so that with more of it no path gets longer, nor all of them.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leafcut.geometry.arrays import Ints, Point
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import SolveOptions

#: Rounds in which paths are ordered between their neighbours, and the iterations of each search.
_ROUNDS, _ITERATIONS = {"fast": 0, "default": 2, "thorough": 2}, 2
#: Of so few clusters the quick search finds the best order, or nearly.
_FEW = 18
#: Of a time limit the quick searches together take so much; what is under way, and the first of each path, is ended.
_QUICK_PART = 0.3
#: Above this many clusters in all the first round is enough: the ways from path to path are a small part.
_MANY = 20_000


@dataclass(frozen=True, eq=False)
class Stage:
    """One of several paths.

    Attributes
    ----------
    problem
        With its start, where that does not depend on the path before, and with its end, where it has one.
    follows
        It begins where the path before ends.
    own
        int32[clusters]: the nodes in the order that there is, which is kept if none is better; empty for none.
    """

    problem: RoutingProblem
    follows: bool
    own: Ints


#: Seeks the order of the stage with this number, all of it or what is left of it: (stage, problem, options).
SearchOne = Callable[[int, RoutingProblem, SolveOptions], Solution]


def solve_together(
    stages: Sequence[Stage], search: SearchOne, options: SolveOptions, quick: SearchOne, cancelled: threading.Event,
    bound_late: Callable[[RoutingProblem], Callable[[float], bool]] = lambda _: lambda _: False,
) -> list[Solution]:  # fmt: skip
    """Return a solution for every stage; that of a stage that follows another one begins where that one ends.

    Parameters
    ----------
    quick
        `search` with nobody to tell what it finds.
    bound_late
        Returns what `solve` asks while it computes the lower bound of a stage.
    """
    linked = [number for number, stage in enumerate(stages) if stage.follows and number]
    if not linked or options.algorithm in ("nn", "none"):
        orders, found = list[Ints](), list[Solution]()
        for number, _ in enumerate(stages):
            found.append(search(number, _placed(stages, number, orders), options))
            orders.append(found[-1].nodes)
    else:
        orders = _outlined(stages, quick, options)
        found = []
        for number, stage in enumerate(stages):
            fixed = stage.follows and number > 0, number + 1 < len(stages) and stages[number + 1].follows
            found.append(_between(number, _placed(stages, number, orders), orders[number], fixed, search, options))
            orders[number] = found[-1].nodes
    own = [stage.own for stage in stages]
    if all(len(nodes) for nodes in own) and options.algorithm != "nn" and _total(stages, own) < _total(stages, orders):
        orders = own
    return [
        _stated(
            number, _placed(stages, number, orders), orders[number], solution, options, quick, cancelled, bound_late
        )
        for number, solution in enumerate(found)
    ]


def _placed(stages: Sequence[Stage], number: int, orders: Sequence[Ints]) -> RoutingProblem:
    """Return the problem of a stage that begins where the one before ends with these orders."""
    stage = stages[number]
    if not stage.follows or not number:
        return stage.problem
    before = stages[number - 1].problem
    x, y = before.exit[orders[number - 1][-1]].tolist()
    return replace(stage.problem, start=(x, y))


def _total(stages: Sequence[Stage], orders: Sequence[Ints]) -> float:
    from leafcut.order.instance import path_cost

    return sum(path_cost(_placed(stages, number, orders), nodes) for number, nodes in enumerate(orders))


def _outlined(stages: Sequence[Stage], quick: SearchOne, options: SolveOptions) -> list[Ints]:
    """Return quick orders of all stages, each sought between the one before and the one behind it."""
    few = _quick(options)
    orders: list[Ints] = []

    spent, most = 0.0, math.inf if options.time_limit is None else _QUICK_PART * options.time_limit

    def searched(number: int, problem: RoutingProblem) -> Ints:
        nonlocal spent
        found = quick(number, problem, few)
        spent += found.seconds
        return found.nodes

    for number in range(len(stages)):
        orders.append(searched(number, _placed(stages, number, orders)))
    best, least = list(orders), _total(stages, orders)
    if all(len(stage.own) for stage in stages) and _total(stages, [s.own for s in stages]) < least:
        best = [stage.own for stage in stages]
        least = _total(stages, best)
    if sum(stage.problem.n_clusters for stage in stages) > _MANY:
        return best
    orders = list(best)
    for _ in range(_ROUNDS[options.preset]):
        for number in range(len(stages)):
            if spent > most:
                return best
            problem = _placed(stages, number, orders)
            if number + 1 < len(stages) and stages[number + 1].follows:
                x, y = stages[number + 1].problem.entry[orders[number + 1][0]].tolist()
                problem = replace(problem, end=(x, y))
            orders[number] = searched(number, problem)
        total = _total(stages, orders)
        if total < least:
            best, least = list(orders), total
    return best


def _between(
    number: int,
    problem: RoutingProblem,
    known: Ints,
    fixed: tuple[bool, bool],
    search: SearchOne,
    options: SolveOptions,
) -> Solution:
    """Return the path of a stage that begins and ends, where that is `fixed`, as the known one does."""
    from leafcut.order.instance import path_cost

    low, high = int(fixed[0]), len(known) - int(fixed[1])
    if high - low < 2:
        return _known(problem, known, options)
    inner, node_of = _without(problem, known[:low], known[high:])
    found = search(
        number, inner, replace(options, bound=False, target_gap=None) if low or high < len(known) else options
    )
    nodes = np.concatenate([known[:low], node_of[found.nodes], known[high:]]).astype(np.int32)
    if path_cost(problem, known) < path_cost(problem, nodes):
        nodes = known
    return replace(found, nodes=nodes)


def _known(problem: RoutingProblem, nodes: Ints, options: SolveOptions) -> Solution:
    return Solution(nodes, 0.0, problem.metric.unit, "exact", options.seed)


def _without(problem: RoutingProblem, first: Ints, last: Ints) -> tuple[RoutingProblem, Ints]:
    """Return the problem of what lies between some first and some last nodes, and which nodes of `problem` it has."""
    gone = np.isin(problem.cluster, problem.cluster[np.concatenate([first, last])])
    node_of = np.flatnonzero(~gone).astype(np.int32)
    clusters, cluster = np.unique(problem.cluster[node_of], return_inverse=True)
    number = np.full(problem.n_clusters, -1, dtype=np.int32)
    number[clusters] = np.arange(len(clusters), dtype=np.int32)
    pairs = number[problem.precedence]
    ends: list[Point | None] = [problem.start, problem.end]
    if len(first):
        x, y = problem.exit[first[-1]].tolist()
        ends[0] = (x, y)
    if len(last):
        x, y = problem.entry[last[0]].tolist()
        ends[1] = (x, y)
    inner = replace(
        problem,
        entry=problem.entry[node_of],
        exit=problem.exit[node_of],
        cluster=cluster.ravel().astype(np.int32),
        service=problem.service[node_of],
        precedence=pairs[(pairs >= 0).all(axis=1)].reshape(-1, 2),
        start=ends[0],
        end=ends[1],
    )
    return inner, node_of


def _stated(
    number: int, problem: RoutingProblem, nodes: Ints, found: Solution, options: SolveOptions, quick: SearchOne,
    cancelled: threading.Event, bound_late: Callable[[RoutingProblem], Callable[[float], bool]],
) -> Solution:  # fmt: skip
    """Return the solution of a whole stage at its cost, with a bound where that is wanted."""
    from leafcut.order.certificate import certify
    from leafcut.order.instance import path_cost

    cost = path_cost(problem, nodes)
    if np.array_equal(nodes, found.nodes) and found.cost == cost and found.lower_bound is not None:
        return found
    told = replace(found, nodes=nodes, cost=cost, history=((found.seconds, cost),), lower_bound=None)
    if not options.bound:
        return told
    # The best order of a few is its own bound.
    bound = quick(number, problem, _quick(options, bound=True)).lower_bound if problem.n_clusters <= _FEW else None
    return certify(problem, told, bound, cancelled, late=bound_late(problem))


def _quick(options: SolveOptions, bound: bool = False) -> SolveOptions:
    return replace(options, iterations=_ITERATIONS, time_limit=None, bound=bound, target_gap=None)
