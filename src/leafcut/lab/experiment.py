"""`run_experiment`: run several algorithms on a point map, each with several seeds."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut import api
from leafcut.errors import OptionError, name_suggestion
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.model.part import Part
from leafcut.model.snapshot import Observer
from leafcut.model.solution import Solution
from leafcut.model.study import Study
from leafcut.options import ALGORITHM_TITLES, SolveOptions
from leafcut.options.option_spec import Conditions
from leafcut.order.maps import problem_of_map
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings

#: Maximum number of runs per algorithm, and maximum number of points per curve.
MAX_RUNS, MAX_POINTS = 1000, 300
#: Maximum number of points of all curves together, because one page draws them all, and minimum number per curve.
_ALL_POINTS, _MIN_POINTS = 20_000, 10

#: Algorithms that can be compared, which are those that search for a tour.
COMPARED = tuple(name for name in ALGORITHM_TITLES if name not in ("auto", "none"))


@dataclass(frozen=True, eq=False)
class Repetition:
    """One run of an algorithm with one seed.

    Attributes
    ----------
    seconds
        Search time without the lower bound, s.
    nodes
        int32[k]: the nodes of the tour in order.
    curve
        (iteration, seconds, cost) at each improvement of the best tour; iteration 0 is the initial tour.
    """

    algorithm: str
    seed: int
    cost: float
    iterations: int
    seconds: float
    nodes: NDArray[np.int32]
    curve: tuple[tuple[int, float, float], ...]


@dataclass(frozen=True, eq=False)
class Experiment:
    """The results of all runs, sorted by algorithm and then by seed.

    `lower_bound` is a lower bound on the cost of the tour. `stopped` is true if the user stopped the experiment early.
    """

    part: Part
    repetitions: tuple[Repetition, ...]
    lower_bound: float | None
    stopped: bool = False

    @property
    def algorithms(self) -> tuple[str, ...]:
        """The algorithms in the order in which they ran."""
        return tuple(dict.fromkeys(run.algorithm for run in self.repetitions))

    @property
    def best(self) -> Repetition:
        """The run with the lowest cost; if several runs are equal, the first."""
        return min(self.repetitions, key=lambda run: run.cost)

    def runs_of(self, algorithm: str) -> tuple[Repetition, ...]:
        """Return the runs of an algorithm."""
        return tuple(run for run in self.repetitions if run.algorithm == algorithm)


def check_experiment(algorithms: Sequence[str], runs: int) -> None:
    """Raise `OptionError` if no algorithm is given, one is unknown, or the number of runs is out of range."""
    if not algorithms:
        raise OptionError("choose at least one algorithm to compare")
    for name in algorithms:
        if name not in COMPARED:
            raise OptionError("unknown algorithm '{}'{}", name, name_suggestion(name, COMPARED))
    if not 1 <= runs <= MAX_RUNS:
        raise OptionError("runs of each algorithm: {} is out of range; choose 1 to {}", runs, MAX_RUNS)


def run_experiment(
    part: Part,
    algorithms: Sequence[str],
    runs: int,
    options: Mapping[str, Any] | None = None,
    *,
    progress: OnProgress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
) -> Experiment:
    """Run each algorithm `runs` times on a point map, with seeds that count up from the option ``seed``.

    `options` are those of `api.solve`. Each algorithm receives only the options that it uses, and all algorithms use
    the same seeds. If `cancelled` is set, the current run is discarded, unless it is the first.

    Raises
    ------
    OptionError
        The algorithms, the number of runs or an option is invalid.
    SolveError
        An algorithm cannot solve this map.
    """
    check_experiment(algorithms, runs)
    cancel_event = cancelled or threading.Event()
    first = collect_settings({"seed": (options or {}).get("seed")}).of(SolveOptions).seed
    repetitions: list[Repetition] = []
    best: Solution | None = None
    stopped = False
    todo = [(algorithm, first + k) for algorithm in dict.fromkeys(algorithms) for k in range(runs)]
    max_points = min(MAX_POINTS, max(_ALL_POINTS // len(todo), _MIN_POINTS))
    for number, (algorithm, seed) in enumerate(todo):
        study = Study(observe)
        on_progress = _run_progress(progress, Message("{}, seed {}", algorithm, seed), number, len(todo))
        run_options = {**options_for(algorithm, options or {}), "seed": seed}
        solution = api.solve(part, progress=on_progress, observe=study, cancelled=cancel_event, **run_options).solution
        stopped = cancel_event.is_set()
        if stopped and repetitions:
            break
        repetitions.append(_repetition(algorithm, seed, solution, study, max_points))
        best = solution if best is None or solution.cost < best.cost else best
        if stopped:
            break
    return Experiment(part, tuple(repetitions), _bound(part, best, options or {}, cancel_event), stopped)


def options_for(algorithm: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that an algorithm uses.

    The lower bound is switched off, because it is computed only once for all algorithms.
    """
    used = registry.work("solve").used()
    kept = {name: value for name, value in options.items() if _fits(used.get(name, ()), algorithm)}
    return {**kept, "bound": False, "algorithm": algorithm}


def _fits(needs: Conditions, algorithm: str) -> bool:
    return all(algorithm in condition.values for condition in needs if condition.names == ("algorithm",))


def _run_progress(progress: OnProgress | None, run_name: str, number: int, runs: int) -> OnProgress | None:
    """Return a progress callback that adds the name of the run and scales its share to all runs."""
    if progress is None:
        return None

    def report(current: Progress) -> None:
        progress(
            replace(
                current,
                step=Message("{} ({} of {})", run_name, number + 1, runs),
                share=(number + current.share) / runs,
            )
        )

    return report


def _repetition(algorithm: str, seed: int, solution: Solution, study: Study, max_points: int) -> Repetition:
    curve = tuple(curve_of(solution, study, max_points))
    return Repetition(algorithm, seed, solution.cost, solution.iterations, solution.seconds, solution.nodes, curve)


def curve_of(solution: Solution, study: Study, max_points: int) -> Iterator[tuple[int, float, float]]:
    """Yield (iteration, seconds, cost) of the initial tour, each improvement, and the end.

    Improvements are thinned out to about `max_points`.
    """
    started, cost = solution.history[0]
    points, rows = [(0, started, cost)], study.iterations()
    # For a map with sets of points, a search may know only the lengths through the centres.
    known = bool(rows) and math.isclose(rows[-1].shortest, solution.cost, rel_tol=1e-9)
    for row in rows if known else ():
        if row.shortest < points[-1][2]:
            points.append((row.number, row.seconds, row.shortest))
    yield from points[:: len(points) // max_points + 1]
    yield (solution.iterations, solution.seconds, solution.cost)


def search_curve(study: Study, max_points: int) -> Iterator[tuple[int, float, float]]:
    """Yield (iteration, seconds, cost) of each improvement in the latest search, and of its end.

    Improvements are thinned out to about `max_points`.
    """
    points: list[tuple[int, float, float]] = []
    rows = study.iterations()
    for row in rows:
        if not points or row.shortest < points[-1][2]:
            points.append((row.number, row.seconds, row.shortest))
    yield from points[:: len(points) // max_points + 1]
    if rows:
        yield (rows[-1].number, rows[-1].seconds, rows[-1].shortest)


def _bound(
    part: Part, best: Solution | None, options: Mapping[str, Any], cancel_event: threading.Event
) -> float | None:
    if best is None or options.get("bound") is False:
        return None
    from leafcut.order.certificate import certify

    return certify(problem_of_map(part), replace(best, lower_bound=None), None, cancel_event).lower_bound
