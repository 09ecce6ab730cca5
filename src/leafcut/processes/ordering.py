"""Search for the order of a plan: its stages are ordered together, within the time limit of the job.

If a stage starts where another one ends, the shortest path of one may make the whole longer. So all stages are first
ordered quickly, one after the other, and again between their neighbours; that fixes the first and last choice of each.
Then each is searched thoroughly between these ends. The quick searches do a small, fixed amount of work, so that more
time never gives a longer result.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Ints, Point
from leafcut.model.plan import Order, Stage
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import AcoOptions, SolveOptions
from leafcut.options.search import ANTS_AS_PARTS
from leafcut.order.deadline import Deadline

if TYPE_CHECKING:
    from leafcut.processes.job import Job

#: Rounds of quick searches between the neighbours, and the iterations of each search.
_ROUNDS, _ITERATIONS = {"fast": 0, "default": 2, "thorough": 2}, 2
#: Up to this many tasks the quick search finds the best order, or nearly.
_FEW = 18
#: Share of the time limit for all quick searches; a started search, and the first of each stage, always finish.
_QUICK_PART = 0.3
#: Above this many tasks the first round is enough: travel between stages is a small part of the whole.
_MANY = 20_000


#: Searches the order of a stage, or of the rest of it: (number of the stage, problem, options).
SearchOne = Callable[[int, RoutingProblem, SolveOptions], Solution]


def find_order(
    job: Job, stages: Sequence[Stage], options: SolveOptions | None = None, deadline: Deadline | None = None
) -> Order:
    """Return the best order of all stages that the search finds in its time.

    Parameters
    ----------
    options
        Options of the search; without them those of the job.
    deadline
        Time of the search; without it the job's. A nearest-neighbour order has no limit.

    Raises
    ------
    SolveError
        The precedence of the tasks cannot be kept, or not by this algorithm.
    PlanError
        The algorithm returns an order that does not do each task once (`check_order`).
    """
    from leafcut.order.solve import solve

    options, settings = options or job.settings.solve, job.settings
    deadline = Deadline() if options.algorithm == "nn" else deadline or job.deadline
    total = left = sum(stage.problem.n_clusters for stage in stages)

    def search(number: int, problem: RoutingProblem, options: SolveOptions) -> Solution:
        nonlocal left
        tasks = stages[number].problem.n_clusters
        try:
            job.tell(stages[number].name, 1.0 - left / total)
        except KeyboardInterrupt:
            job.cancelled.set()  # Ctrl-C between two searches: keep the best order, as within a search
        own = replace(options, time_limit=deadline.part(problem.n_clusters / left).seconds)
        solution = solve(
            problem, own, _ants(settings.aco, stages[number]), firefly=settings.firefly,
            progress=job.passing_on(stages[number].name, left / total, tasks / total), observe=job.observe,
            cancelled=job.cancelled, bounds=job.bounds.part(tasks / left),
        )  # fmt: skip
        deadline.spend(solution.seconds)
        left = max(left - tasks, 1)
        return solution

    def quick(number: int, problem: RoutingProblem, options: SolveOptions) -> Solution:
        ants = _ants(settings.aco, stages[number])
        bounds = job.bounds.part(problem.n_clusters / total)
        solution = solve(problem, options, ants, firefly=settings.firefly, cancelled=job.cancelled, bounds=bounds)
        deadline.spend(solution.seconds)
        return solution

    if options.algorithm != "nn" and any(len(stage.first) for stage in stages):
        solutions = _around_first(job, stages, search, options)
    else:
        solutions = solve_together(
            stages, search, options, quick, job.cancelled, lambda part: job.bounds.part(part.n_clusters / total)
        )
    order = Order(tuple(solution.nodes for solution in solutions), tuple(solutions))
    check_order(stages, order)
    return order


def check_order(stages: Sequence[Stage], order: Order) -> None:
    """Refuse an order that does not do each task once, or that breaks a precedence.

    It depends on neither planner nor search. Recipes of a process are not checked here.

    Raises
    ------
    PlanError
        The stage that is wrong.
    """
    if not all(isinstance(nodes, np.ndarray) for nodes in order.choices):
        return
    for stage, nodes in zip(stages, order.choices, strict=True):
        problem = stage.problem
        known = nodes[(nodes >= 0) & (nodes < problem.n_nodes)]
        tasks, place = problem.cluster[known], np.full(problem.n_clusters, -1)
        place[tasks] = np.arange(len(tasks))
        before, after = problem.precedence.T
        if len(nodes) != problem.n_clusters or (place < 0).any():
            wrong = f"{len(nodes)} visits do not do each of the {problem.n_clusters} tasks once"
        elif (place[before] > place[after]).any():
            wrong = "a task is done before another one that must come first"
        else:
            continue
        raise PlanError(f"{stage.name}: {wrong}; this is a fault of the algorithm, choose another --algorithm")


def nearest_order(job: Job, stages: Sequence[Stage]) -> Order:
    """Return the nearest-neighbour order, for comparison."""
    return find_order(job.quiet(), stages, SolveOptions(algorithm="nn", bound=False))


def _ants(options: AcoOptions, stage: Stage) -> AcoOptions:
    """Return the options with one ant for each part of a stage, if they ask for that."""
    return replace(options, n_ants=stage.parts) if stage.parts and options.n_ants == ANTS_AS_PARTS else options


def restated(job: Job, stages: Sequence[Stage], order: Order) -> list[Solution]:
    """Return the solutions of an order whose choices may be others than those found: at their own cost and bound."""
    if all(np.array_equal(one.nodes, nodes) for one, nodes in zip(order.solutions, order.choices, strict=True)):
        return list(order.solutions)
    given = all(np.array_equal(stage.given, nodes) for stage, nodes in zip(stages, order.choices, strict=True))
    solutions = []
    for number, (found, nodes) in enumerate(zip(order.solutions, order.choices, strict=True)):
        problem = _placed(stages, number, order.choices)
        solution = replace(_with_nodes(problem, found, nodes), algorithm="none" if given else "nn")
        # The bound of the search holds only for the end of the stage before it in the searched order.
        solutions.append(_with_bound(job, problem, solution, 1.0 / (len(stages) - number)))
    return solutions


def _with_nodes(problem: RoutingProblem, found: Solution, nodes: Ints) -> Solution:
    """Return a solution with other nodes, at their cost and without a bound."""
    from leafcut.order.instance import path_cost

    cost = path_cost(problem, nodes)
    return replace(found, nodes=nodes, cost=cost, history=((found.seconds, cost),), lower_bound=None)


def _with_bound(job: Job, problem: RoutingProblem, solution: Solution, share: float) -> Solution:
    """Return a solution with its lower bound, if requested; it gets a `share` of the time left for bounds."""
    from leafcut.order.certificate import certify

    if not job.settings.solve.bound:
        return solution
    return certify(problem, solution, None, job.cancelled, deadline=job.bounds.part(share))


def _around_first(job: Job, stages: Sequence[Stage], search: SearchOne, options: SolveOptions) -> list[Solution]:
    """Order the stages one after the other; choices that the user wants first stay first."""
    from leafcut.order.solve import keep_better

    choices, solutions = list[Ints](), list[Solution]()
    for number, stage in enumerate(stages):
        problem, first = _placed(stages, number, choices), stage.first
        if not len(first):
            solution = keep_better(problem, search(number, problem, options), stage.given)
        else:
            rest, node_of = _without(problem, first, first[:0])
            solution = Solution(first, 0.0, problem.metric.unit, "given", 0)
            if len(node_of):
                solution = search(number, rest, options)
            nodes = np.concatenate([first, node_of[solution.nodes]]) if len(node_of) else first
            solution = _with_nodes(problem, solution, nodes.astype(np.int32))
            solution = _with_bound(job, problem, solution, 1.0 / (len(stages) - number))
        choices.append(solution.nodes)
        solutions.append(solution)
    return solutions


def solve_together(
    stages: Sequence[Stage], search: SearchOne, options: SolveOptions, quick: SearchOne, cancelled: threading.Event,
    bounds: Callable[[RoutingProblem], Deadline] = lambda _: Deadline(),
) -> list[Solution]:  # fmt: skip
    """Return a solution for every stage; a stage that follows another one starts where that one ends.

    Parameters
    ----------
    quick
        `search` without progress reports.
    bounds
        Returns the deadline of the lower bound of a problem.
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
    given = [stage.given for stage in stages]
    usable = all(len(nodes) for nodes in given) and options.algorithm != "nn"
    if usable and _total(stages, given) < _total(stages, orders):
        orders = given
    return [
        _stated(number, _placed(stages, number, orders), orders[number], solution, options, quick, cancelled, bounds)
        for number, solution in enumerate(found)
    ]


def _placed(stages: Sequence[Stage], number: int, orders: Sequence[Ints]) -> RoutingProblem:
    """Return the problem of a stage that starts where the stage before it ends in these orders."""
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
    """Return quick orders of all stages, each searched between its neighbours."""
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
    if all(len(stage.given) for stage in stages) and _total(stages, [s.given for s in stages]) < least:
        best = [stage.given for stage in stages]
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
    """Return the path of a stage; where an end is `fixed`, it is that of the known path."""
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
    """Return the problem without its first and last nodes, and its nodes as nodes of `problem`."""
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
    cancelled: threading.Event, bounds: Callable[[RoutingProblem], Deadline],
) -> Solution:  # fmt: skip
    """Return the solution of a whole stage with its cost, and with a bound if requested."""
    from leafcut.order.certificate import certify
    from leafcut.order.instance import path_cost

    cost = path_cost(problem, nodes)
    if (
        np.array_equal(nodes, found.nodes)
        and found.cost == cost
        and (found.lower_bound is not None or not options.bound)
    ):
        return found
    solution = _with_nodes(problem, found, nodes)
    if not options.bound:
        return solution
    # The best order of a few tasks is its own bound.
    bound = quick(number, problem, _quick(options, bound=True)).lower_bound if problem.n_clusters <= _FEW else None
    return certify(problem, solution, bound, cancelled, deadline=bounds(problem))


def _quick(options: SolveOptions, bound: bool = False) -> SolveOptions:
    return replace(options, iterations=_ITERATIONS, time_limit=None, bound=bound, target_gap=None)
