"""leafcut compared with other solvers, on one machine, in one run, by one clock.

    python -m benchmarks peers pcb442 pcb3038 --times 1,10 --seeds 3

The extra `bench` installs the other solvers (`pip install -e '.[bench]'`). The table names those that are not installed
or cannot solve a board. Each run is a separate process. Solvers take turns, so that other load affects all of them.
"""

from __future__ import annotations

import importlib.util
import math
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from statistics import median
from typing import Any

from numpy.typing import ArrayLike

from benchmarks import boards, page
from benchmarks.boards import Board
from benchmarks.tsplib import NO_TOUR, problem_of, search_parser, warm_up
from leafcut.options import SolveOptions
from leafcut.order.solve import solve

#: Maximum time for imports, file and matrix, and maximum time until a run ends after its time limit, s.
PATIENCE = 120.0

#: Tour, and its length if the solver reports it.
Answer = tuple[ArrayLike, float | None]


@dataclass(frozen=True)
class Task:
    """One run: time limit, s, seed and threads, as far as the solver supports them."""

    seconds: float
    seed: int
    threads: int


@dataclass(frozen=True)
class Peer:
    """A solver: name, required package, reason to refuse a board, and preparation.

    `prepare` does the work that is not measured (import, matrix), and returns the function that is measured. `anytime`
    solvers stop at the time limit. The others run only once, until they finish.
    """

    name: str
    package: str
    refusal: Callable[[Board], str]
    prepare: Callable[[Board, Task], Callable[[], Answer]]
    anytime: bool = True


@dataclass(frozen=True)
class Result:
    """Gap in percent, wall-clock time and processor time, s; or the reason of a failure."""

    gap: float = math.inf
    wall: float = 0.0
    processor: float = 0.0
    why: str = ""


def prepare_leafcut(board: Board, task: Task, algorithm: str = "auto") -> Callable[[], Answer]:
    """Return leafcut's search with loaded kernels; the search builds the neighbour lists itself."""
    options = SolveOptions(
        algorithm=algorithm, time_limit=task.seconds, seed=task.seed, threads=task.threads, bound=False
    )
    warm_up(board, options)
    problem = problem_of(board)

    def run() -> Answer:
        found = solve(problem, options)
        return found.nodes, found.cost

    return run


def prepare_2opt(board: Board, task: Task) -> Callable[[], Answer]:
    """Return leafcut's nearest neighbour with 2-opt and Or-opt to a local optimum."""
    return prepare_leafcut(board, task, "2opt")


def prepare_fast_tsp(board: Board, task: Task) -> Callable[[], Answer]:
    """Return fast-tsp's search with its distance matrix."""
    fast_tsp = import_module("fast_tsp")
    distances = boards.matrix(board, "uint16")

    def run() -> Answer:
        tour = fast_tsp.find_tour(distances, duration_seconds=task.seconds, max_threads=task.threads)
        return tour, None

    return run


def prepare_elkai(board: Board, task: Task) -> Callable[[], Answer]:
    """Return one run of LKH with its default settings, without time limit and seed."""
    cities = import_module("elkai").Coordinates2D({str(i): (x, y) for i, (x, y) in enumerate(board.xy.tolist())})

    def run() -> Answer:
        return [int(city) for city in cities.solve_tsp(runs=1)[:-1]], None

    return run


def prepare_ortools(board: Board, task: Task) -> Callable[[], Answer]:
    """Return guided local search in OR-Tools from a cheapest-arc start, with model and matrix."""
    routing: Any = import_module("ortools.constraint_solver.pywrapcp")
    enums: Any = import_module("ortools.constraint_solver.routing_enums_pb2")
    manager = routing.RoutingIndexManager(board.n, 1, 0)
    model = routing.RoutingModel(manager)
    model.SetArcCostEvaluatorOfAllVehicles(model.RegisterTransitMatrix(boards.matrix(board, "int64").tolist()))
    parameters = routing.DefaultRoutingSearchParameters()
    parameters.first_solution_strategy = enums.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    parameters.local_search_metaheuristic = enums.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    parameters.time_limit.FromMilliseconds(round(1000 * task.seconds))

    def run() -> Answer:
        found = model.SolveWithParameters(parameters)
        if found is None:
            raise TimeoutError(f"no tour within {task.seconds:g} s")
        tour, index = [], model.Start(0)
        while not model.IsEnd(index):
            tour.append(manager.IndexToNode(index))
            index = found.Value(model.NextVar(index))
        return tour, found.ObjectiveValue()

    return run


def _whole(board: Board) -> str:
    return "" if board.rule in ("EUC_2D", "CEIL_2D") else "requires integer distances"


def _small(board: Board, most: int, bytes_each: int) -> str:
    """Return the reason why a matrix of more than `most` nodes is refused, or an empty text."""
    return "" if board.n <= most else f"its matrix of n² distances would take {board.n**2 * bytes_each / 1e9:,.1f} GB"


def _refused_by_fast_tsp(board: Board) -> str:
    reach = float(max(board.xy.max(axis=0) - board.xy.min(axis=0)))
    far = "supports distances up to 65,535" if math.hypot(reach, reach) > 65_535 else ""
    return _whole(board) or far or _small(board, 12_000, 2)


def _refused_by_elkai(board: Board) -> str:
    return "" if board.rule == "EUC_2D" else "supports EUC_2D only"


def _refused_by_ortools(board: Board) -> str:
    # A list of lists of Python numbers takes about 40 bytes for each distance.
    return _whole(board) or _small(board, 6_000, 40)


PEERS = (
    Peer("leafcut", "", lambda board: "", prepare_leafcut),
    Peer("nearest neighbour + 2-opt", "", lambda board: "", prepare_2opt),
    Peer("fast-tsp", "fast_tsp", _refused_by_fast_tsp, prepare_fast_tsp),
    Peer("LKH (elkai)", "elkai", _refused_by_elkai, prepare_elkai, anytime=False),
    Peer("OR-Tools guided local search", "ortools", _refused_by_ortools, prepare_ortools),
)


def work(connection: Connection, peer: int, name: str, task: Task) -> None:
    """Run one solver in this process; send ``ready`` when the clock starts, then a `Result` or the failed check."""
    try:
        board = boards.load(name)
        run = PEERS[peer].prepare(board, task)
        connection.send("ready")
        wall, processor = time.perf_counter(), time.process_time()
        tour, stated = run()
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        length = boards.checked_length(board, tour, stated)
        connection.send(Result(board.gap_percent(length), wall, processor))
    except AssertionError as problem:
        connection.send(problem)
    except Exception as problem:
        connection.send(Result(why=" ".join((str(problem) or type(problem).__name__).split())))


def measure(peer: int, name: str, task: Task, limit: float) -> Result:
    """Return the result of one solver in a separate process, which is killed after `limit` seconds.

    Raises
    ------
    AssertionError
        The tour is wrong, or its length differs from the reported length.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(there, peer, name, task), daemon=True)
    process.start()
    there.close()
    try:
        for wait, words in ((PATIENCE, f"not ready after {PATIENCE:g} s"), (limit, f"no tour within {limit:g} s")):
            if not here.poll(wait):
                return Result(why=words)
            message = here.recv()
            if isinstance(message, AssertionError):
                raise AssertionError(f"{PEERS[peer].name}: {message}")
            if isinstance(message, Result):
                return message
        raise AssertionError(f"{PEERS[peer].name} sent 'ready' twice")
    except EOFError:
        return Result(why="its process died")
    finally:
        process.kill()
        process.join()


def refusal(peer: Peer, board: Board) -> str:
    """Return the reason why a solver is skipped on a board, or an empty text."""
    if peer.package and importlib.util.find_spec(peer.package) is None:
        return "not installed (pip install -e '.[bench]')"
    return peer.refusal(board)


def results_of(
    board: Board, times: Sequence[float], seeds: int, threads: int, patience: float
) -> dict[tuple[int, float], list[Result]]:
    """Return the results of all solvers on a board, by solver and time; solvers without a time limit have time 0."""
    found: dict[tuple[int, float], list[Result]] = {}
    able = [k for k, peer in enumerate(PEERS) if not refusal(peer, board)]
    for seed, seconds, peer in _turns(able, times, seeds):
        limit = seconds + PATIENCE if seconds else patience
        result = measure(peer, board.name, Task(seconds, seed, threads), limit)
        found.setdefault((peer, seconds), []).append(result)
        line = result.why or f"{result.gap:.3f} % in {result.wall:.2f} s"
        print(f"{board.name}, {PEERS[peer].name}, seed {seed}: {line}", file=sys.stderr, flush=True)
    return found


def _turns(able: Sequence[int], times: Sequence[float], seeds: int) -> Iterator[tuple[int, float, int]]:
    """Yield (seed, seconds, solver): all solvers in turn for each seed and time, but those without a time limit only
    once.
    """
    for seed in range(1, seeds + 1):
        for seconds in times:
            yield from ((seed, seconds, k) for k in able if PEERS[k].anytime)
    yield from ((1, 0.0, k) for k in able if not PEERS[k].anytime)


def cell(results: Sequence[Result]) -> str:
    """Return the median gap, and the median wall-clock and processor time, such as ``0.120 (1.0 / 1.0)``."""
    good = [r for r in results if not r.why]
    if 2 * len(good) <= len(results):
        return NO_TOUR
    gap = median(r.gap for r in results)
    return f"{gap:.3f} ({median(r.wall for r in good):.1f} / {median(r.processor for r in good):.1f})"


def rows_of(board: Board, times: Sequence[float], found: dict[tuple[int, float], list[Result]]) -> Iterator[list[str]]:
    """Yield a row for each solver, including skipped ones."""
    for k, peer in enumerate(PEERS):
        note = refusal(peer, board)
        mine = [r for (number, _), results in found.items() if number == k for r in results]
        if note:
            yield [f"{board.name} ({board.n:,})", peer.name, *(NO_TOUR for _ in times), f"skipped: {note}"]
            continue
        if peer.anytime:
            cells = [cell(found[k, t]) for t in times]
        else:
            cells = [cell(mine) if mine[0].wall <= t else NO_TOUR for t in times]
            note = f"done after {mine[0].wall:.1f} s at {mine[0].gap:.3f} %"
        failures = list(dict.fromkeys(r.why for r in mine if r.why))
        yield [f"{board.name} ({board.n:,})", peer.name, *cells, "; ".join(failures) or note]


def results(rows: Sequence[Sequence[str]], times: Sequence[float], words: str, references: str, facts: str) -> str:
    """Return the results page; `references` names the reference lengths of the boards."""
    head = ["board", "solver", *(f"{t:g} s" for t in times), "note"]
    return f"""# leafcut and other solvers

The table shows the gap in percent and, in brackets, the wall-clock time / processor time in seconds, {words}. Each run
was a separate process; the solvers took turns. The time excludes import, file reading and the matrix of all distances;
it includes leafcut's neighbour lists. fast-tsp and OR-Tools have no seed. LKH ran once without a time limit, with its
defaults; its licence is for research only, and leafcut does not use it. Reference lengths of the gaps: {references}.

{facts}

{page.table(head, rows)}"""


def main(argv: Sequence[str]) -> int:
    """Measure all solvers, and publish the table."""
    parser = search_parser("peers", __doc__, "1,10", 3)
    parser.add_argument("--patience", type=float, default=60.0, help="most seconds for solvers without a time limit")
    arguments = parser.parse_args(argv)
    rows: list[list[str]] = []
    references: dict[str, None] = {}
    for name in arguments.boards:
        board = boards.load(name)
        references[board.reference_words] = None
        found = results_of(board, arguments.times, arguments.seeds, arguments.threads, arguments.patience)
        rows += rows_of(board, arguments.times, found)
    packages = ["leafcut", "numpy", "numba", "fast-tsp", "elkai", "ortools"]
    seeds = f"medians of {arguments.seeds} runs" if arguments.seeds > 1 else "one run"
    threads = f"{arguments.threads} thread{'s' if arguments.threads != 1 else ''}"
    facts = page.facts("peers", argv, packages)
    text = results(rows, arguments.times, f"{seeds}, {threads}", ", ".join(references), facts)
    page.publish("peers", text, arguments.write)
    return 0
