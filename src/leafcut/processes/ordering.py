"""Search for the order of the tasks in a plan.

Quick searches order all stages first, each between its neighbours. They fix the first and the last choice of each
stage. A thorough search then orders each stage between these two choices. The quick searches do a fixed amount of work,
so a longer time limit never makes the order worse.
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
from leafcut.message import Message
from leafcut.model.heartbeat import progress_for_step
from leafcut.model.plan import Order, Stage
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import AcoOptions, SolveOptions
from leafcut.options.search import ANTS_AS_PARTS
from leafcut.order.stop import Deadline

if TYPE_CHECKING:
    from leafcut.processes.job import Job

#: How many rounds of quick searches run over all stages, by preset, and the number of iterations of each quick search.
_ROUNDS, _ITERATIONS = {"fast": 0, "default": 2, "thorough": 2}, 2
#: With at most this number of tasks, the quick search nearly always gives the optimal order.
_FEW = 18
#: Share of the time limit that all quick searches together may use. The first quick search of each stage always runs.
_QUICK_PART = 0.3
#: With more tasks than this, one quick search of each stage is enough, because travel between stages is short.
_MANY = 20_000


#: A function that orders a stage or a part of it: (number of the stage, problem, options) → solution.
SearchOne = Callable[[int, RoutingProblem, SolveOptions], Solution]


def find_order(
    job: Job, stages: Sequence[Stage], options: SolveOptions | None = None, deadline: Deadline | None = None
) -> Order:
    """Return the best order of all stages that the search reaches in its time.

    Parameters
    ----------
    options
        Options of the search. By default, these are the options of the job.
    deadline
        Deadline of the search. By default, this is the deadline of the job. A nearest-neighbour order has no deadline.

    Raises
    ------
    SolveError
        If the precedence of the tasks cannot be satisfied, or the algorithm does not support it.
    PlanError
        If the algorithm returns an order that does not contain each task exactly once (`check_order`).
    """
    from leafcut.order.solve import solve

    options, settings = options or job.settings.solve, job.settings
    deadline = Deadline() if options.algorithm == "nn" else deadline or job.deadline
    total = remaining = unbounded = sum(stage.problem.n_clusters for stage in stages)

    def search(number: int, problem: RoutingProblem, options: SolveOptions) -> Solution:
        nonlocal remaining
        tasks = stages[number].problem.n_clusters
        try:
            job.report(stages[number].name, 1.0 - remaining / total)
        except KeyboardInterrupt:
            job.cancelled.set()  # Ctrl-C between two searches: keep the best order, as within a search
        stage_options = replace(
            options, time_limit=deadline.for_share(problem.n_clusters / remaining).remaining_time_limit
        )
        progress = progress_for_step(job.progress, stages[number].name, remaining / total, tasks / total)
        solution = solve(
            problem,
            stage_options,
            _ant_options(settings.aco, stages[number]),
            firefly=settings.firefly,
            progress=progress,
            observe=job.observe,
            cancelled=job.cancelled,
            bounds=job.bounds.for_share(tasks / remaining),
        )
        deadline.subtract(solution.seconds)
        remaining = max(remaining - tasks, 1)
        return solution

    def quick(number: int, problem: RoutingProblem, options: SolveOptions) -> Solution:
        ants = _ant_options(settings.aco, stages[number])
        part = job.bounds.for_share(problem.n_clusters / total)
        solution = solve(problem, options, ants, firefly=settings.firefly, cancelled=job.cancelled, bounds=part)
        deadline.subtract(solution.seconds)
        return solution

    def bounds(problem: RoutingProblem) -> Deadline:
        nonlocal unbounded
        part = job.bounds.for_share(min(problem.n_clusters / unbounded, 1.0))
        unbounded = max(unbounded - problem.n_clusters, 1)
        return part

    if options.algorithm != "nn" and any(len(stage.first) for stage in stages):
        solutions = _order_stages_with_first_choices(job, stages, search, options)
    else:
        solutions = solve_linked_stages(stages, search, options, quick, job.cancelled, bounds)
    order = Order(tuple(solution.nodes for solution in solutions), tuple(solutions))
    check_order(stages, order)
    return order


def check_order(stages: Sequence[Stage], order: Order) -> None:
    """Raise PlanError if an order does not contain each task exactly once, or if it violates a precedence."""
    if not all(isinstance(nodes, np.ndarray) for nodes in order.choices):
        return
    for stage, nodes in zip(stages, order.choices, strict=True):
        problem = stage.problem
        valid = nodes[(nodes >= 0) & (nodes < problem.n_nodes)]
        tasks, position = problem.cluster[valid], np.full(problem.n_clusters, -1)
        position[tasks] = np.arange(len(tasks))
        before, after = problem.precedence.T
        if len(nodes) != problem.n_clusters or (position < 0).any():
            fault = Message(
                "an order of {} visits does not contain each of the {} tasks exactly once",
                len(nodes),
                problem.n_clusters,
            )
        elif (position[before] > position[after]).any():
            fault = Message("a task comes before its predecessor")
        else:
            continue
        raise PlanError("{}: {}; this is a defect of the algorithm; choose another --algorithm", stage.name, fault)


def nearest_order(job: Job, stages: Sequence[Stage]) -> Order:
    """Return the nearest-neighbour order. It is used for comparison."""
    return find_order(job.quiet(), stages, SolveOptions(algorithm="nn", bound=False))


def _ant_options(options: AcoOptions, stage: Stage) -> AcoOptions:
    """Return the options of the ants. If the user asked for it, there are as many ants as parts in the stage."""
    return replace(options, n_ants=stage.parts) if stage.parts and options.n_ants == ANTS_AS_PARTS else options


def solutions_of_order(job: Job, stages: Sequence[Stage], order: Order) -> list[Solution]:
    """Return the solver results for an order. If a pass changed the order, the costs and bounds are computed again."""
    if all(
        np.array_equal(searched.nodes, nodes) for searched, nodes in zip(order.solutions, order.choices, strict=True)
    ):
        return list(order.solutions)
    given = all(np.array_equal(stage.given, nodes) for stage, nodes in zip(stages, order.choices, strict=True))
    job = replace(job, bounds=Deadline.for_bounds(job.settings.solve))  # the search may have used up its own deadline
    solutions = []
    for number, (previous, nodes) in enumerate(zip(order.solutions, order.choices, strict=True)):
        problem = _linked_problem(stages, number, order.choices)
        solution = replace(_solution_with_nodes(problem, previous, nodes), algorithm="none" if given else "nn")
        # The bound of the search holds only for the end of the previous stage in the searched order.
        solutions.append(_add_bound(job, problem, solution, 1.0 / (len(stages) - number)))
    return solutions


def _solution_with_nodes(problem: RoutingProblem, previous: Solution, nodes: Ints) -> Solution:
    from leafcut.order.instance import path_cost

    cost = path_cost(problem, nodes)
    return replace(previous, nodes=nodes, cost=cost, history=((previous.seconds, cost),), lower_bound=None)


def _add_bound(job: Job, problem: RoutingProblem, solution: Solution, share: float) -> Solution:
    """Add a lower bound to a solution, if the user asked for it.

    The computation may use a `share` of the time that is left for bounds.
    """
    if not job.settings.solve.bound:
        return solution
    from leafcut.order.certificate import add_lower_bound

    return add_lower_bound(problem, solution, None, job.cancelled, deadline=job.bounds.for_share(share))


def _order_stages_with_first_choices(
    job: Job, stages: Sequence[Stage], search: SearchOne, options: SolveOptions
) -> list[Solution]:
    from leafcut.order.solve import keep_better

    choices, solutions = list[Ints](), list[Solution]()
    for number, stage in enumerate(stages):
        problem, first = _linked_problem(stages, number, choices), stage.first
        if not len(first):
            solution = keep_better(problem, search(number, problem, options), stage.given)
        else:
            remaining, node_of = _without_end_clusters(problem, first, first[:0])
            solution = Solution(first, 0.0, problem.metric.unit, "given", 0)
            if len(node_of):
                # The bound holds for the whole stage only.
                solution = search(number, remaining, replace(options, bound=False))
            nodes = np.concatenate([first, node_of[solution.nodes]]) if len(node_of) else first
            solution = _solution_with_nodes(problem, solution, nodes.astype(np.int32))
            solution = _add_bound(job, problem, solution, 1.0 / (len(stages) - number))
        choices.append(solution.nodes)
        solutions.append(solution)
    return solutions


def solve_linked_stages(
    stages: Sequence[Stage],
    search: SearchOne,
    options: SolveOptions,
    quick: SearchOne,
    cancelled: threading.Event,
    bounds: Callable[[RoutingProblem], Deadline] = lambda _: Deadline(),
) -> list[Solution]:
    """Return a solution for every stage. If a stage follows another stage, it starts where the previous stage ends.

    `quick` searches without progress reports. `bounds` returns the deadline for the lower bound of a problem.
    """
    followers = [number for number, stage in enumerate(stages) if stage.follows and number]
    if not followers or options.algorithm in ("nn", "none"):
        orders, solutions = list[Ints](), list[Solution]()
        for number, _ in enumerate(stages):
            solutions.append(search(number, _linked_problem(stages, number, orders), options))
            orders.append(solutions[-1].nodes)
    else:
        orders = _quick_orders(stages, quick, options)
        solutions = []
        for number, stage in enumerate(stages):
            fixed = stage.follows and number > 0, number + 1 < len(stages) and stages[number + 1].follows
            solutions.append(
                _search_between(number, _linked_problem(stages, number, orders), orders[number], fixed, search, options)
            )
            orders[number] = solutions[-1].nodes
    given = [stage.given for stage in stages]
    usable = all(len(nodes) for nodes in given) and options.algorithm != "nn"
    if usable and _total_cost(stages, given) < _total_cost(stages, orders):
        orders = given
    return [
        _with_cost(
            number,
            _linked_problem(stages, number, orders),
            orders[number],
            solution,
            options,
            quick,
            cancelled,
            bounds,
        )
        for number, solution in enumerate(solutions)
    ]


def _linked_problem(stages: Sequence[Stage], number: int, orders: Sequence[Ints]) -> RoutingProblem:
    stage = stages[number]
    if not stage.follows or not number:
        return stage.problem
    before = stages[number - 1].problem
    x, y = before.exit[orders[number - 1][-1]].tolist()
    return replace(stage.problem, start=(x, y))


def _total_cost(stages: Sequence[Stage], orders: Sequence[Ints]) -> float:
    from leafcut.order.instance import path_cost

    return sum(path_cost(_linked_problem(stages, number, orders), nodes) for number, nodes in enumerate(orders))


def _quick_orders(stages: Sequence[Stage], quick: SearchOne, options: SolveOptions) -> list[Ints]:
    quick_options = _quick_search_options(options)
    orders: list[Ints] = []

    spent, limit = 0.0, math.inf if options.time_limit is None else _QUICK_PART * options.time_limit

    def search_stage(number: int, problem: RoutingProblem) -> Ints:
        nonlocal spent
        solution = quick(number, problem, quick_options)
        spent += solution.seconds
        return solution.nodes

    for number in range(len(stages)):
        orders.append(search_stage(number, _linked_problem(stages, number, orders)))
    best, lowest = list(orders), _total_cost(stages, orders)
    if all(len(stage.given) for stage in stages) and _total_cost(stages, [s.given for s in stages]) < lowest:
        best = [stage.given for stage in stages]
        lowest = _total_cost(stages, best)
    if sum(stage.problem.n_clusters for stage in stages) > _MANY:
        return best
    orders = list(best)
    for _ in range(_ROUNDS[options.preset]):
        for number in range(len(stages)):
            if spent > limit:
                return best
            problem = _linked_problem(stages, number, orders)
            if number + 1 < len(stages) and stages[number + 1].follows:
                x, y = stages[number + 1].problem.entry[orders[number + 1][0]].tolist()
                problem = replace(problem, end=(x, y))
            orders[number] = search_stage(number, problem)
        total = _total_cost(stages, orders)
        if total < lowest:
            best, lowest = list(orders), total
    return best


def _search_between(
    number: int,
    problem: RoutingProblem,
    known_path: Ints,
    fixed: tuple[bool, bool],
    search: SearchOne,
    options: SolveOptions,
) -> Solution:
    """Search for the order of a stage.

    `fixed` states whether the start and the end of the known path must stay the same.
    """
    from leafcut.order.instance import path_cost

    low, high = int(fixed[0]), len(known_path) - int(fixed[1])
    if high - low < 2:
        return Solution(known_path, 0.0, problem.metric.unit, "exact", options.seed)
    inner, node_of = _without_end_clusters(problem, known_path[:low], known_path[high:])
    solution = search(number, inner, replace(options, bound=False) if low or high < len(known_path) else options)
    nodes = np.concatenate([known_path[:low], node_of[solution.nodes], known_path[high:]]).astype(np.int32)
    if path_cost(problem, known_path) < path_cost(problem, nodes):
        nodes = known_path
    return replace(solution, nodes=nodes)


def _without_end_clusters(problem: RoutingProblem, first: Ints, last: Ints) -> tuple[RoutingProblem, Ints]:
    removed = np.isin(problem.cluster, problem.cluster[np.concatenate([first, last])])
    node_of = np.flatnonzero(~removed).astype(np.int32)
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


def _with_cost(
    number: int,
    problem: RoutingProblem,
    nodes: Ints,
    searched: Solution,
    options: SolveOptions,
    quick: SearchOne,
    cancelled: threading.Event,
    bounds: Callable[[RoutingProblem], Deadline],
) -> Solution:
    from leafcut.order.instance import path_cost

    cost = path_cost(problem, nodes)
    if (
        np.array_equal(nodes, searched.nodes)
        and searched.cost == cost
        and (searched.lower_bound is not None or not options.bound)
    ):
        return searched
    solution = _solution_with_nodes(problem, searched, nodes)
    if not options.bound:
        return solution
    from leafcut.order.certificate import add_lower_bound

    # The optimal order of a few tasks is its own bound.
    bound = (
        quick(number, problem, _quick_search_options(options, bound=True)).lower_bound
        if problem.n_clusters <= _FEW
        else None
    )
    return add_lower_bound(problem, solution, bound, cancelled, deadline=bounds(problem))


def _quick_search_options(options: SolveOptions, bound: bool = False) -> SolveOptions:
    return replace(options, iterations=_ITERATIONS, time_limit=None, bound=bound)
