"""Run the ant algorithms. Ants work in threads, in processes, or on a GPU."""

from __future__ import annotations

from contextlib import ExitStack, closing

from leafcut.errors import SolveError
from leafcut.options import AcoOptions, FireflyOptions
from leafcut.order.directed import DirectedInstance
from leafcut.order.instance import Instance
from leafcut.order.literature.ants import AntColony, Ants, create_move_set, initial_trails
from leafcut.order.literature.pheromone import AntParameters
from leafcut.order.literature.processes import AntProcesses
from leafcut.order.search import AlgorithmRun, SearchResult, run_population, set_visit_budget
from leafcut.order.workers import thread_count, thread_pool


def check_ants(algorithm: str, aco: AcoOptions, _: FireflyOptions, choices: bool) -> None:
    """Raise SolveError if parallel ants were requested but the algorithm, problem, or machine does not support them."""
    if aco.parallel == "processes" and algorithm == "acs":
        raise SolveError(
            "--parallel processes: the ants of acs update the shared pheromone in turn; use --parallel exchange or "
            "threads"
        )
    if aco.parallel != "gpu":
        return
    if choices:
        raise SolveError("--parallel gpu: paths with directions or precedence are ordered on the CPU; leave it out")
    if algorithm == "acs":
        raise SolveError(
            "--parallel gpu: the ants of acs update the pheromone during construction; use --parallel threads"
        )
    from leafcut.order.literature.gpu import check_gpu

    check_gpu()


def run_ants(instance: Instance | DirectedInstance, run: AlgorithmRun) -> SearchResult:
    """Run one of the five ant algorithms."""
    options, stop, best = run.options, run.stop, run.best
    parameters = AntParameters.from_options(options.algorithm, run.aco, instance.n, options.local_search)
    threads = min(thread_count(options), parameters.ants) if isinstance(instance, Instance) else 1
    moves = create_move_set(instance, options.local_search, threads)
    c_nn = moves.offer_first_solution(best)
    set_visit_budget(stop, options, parameters.ants * instance.n)
    if best.cost <= 0.0:
        return SearchResult(moves.instance_nodes(best.tour))  # all nodes at the same position: nothing to gain
    with ExitStack() as stack:
        if run.aco.parallel in ("processes", "exchange", "partners"):
            ants: AntColony = stack.enter_context(closing(AntProcesses(moves, run, parameters, c_nn)))
        else:
            trails, executor = (
                initial_trails(moves, parameters, c_nn, options.seed),
                stack.enter_context(thread_pool(threads, stop)),
            )
            ants = _ants_class(run.aco.parallel)(moves, trails, options.seed, stop, executor, threads)
        iterations = run_population(ants, best)
        return SearchResult(moves.instance_nodes(best.tour), iterations, ants.log.worker_figures())


def _ants_class(parallel: str) -> type[Ants]:
    if parallel != "gpu":
        return Ants
    from leafcut.order.literature.gpu import GpuAnts

    return GpuAnts
