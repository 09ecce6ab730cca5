"""What an algorithm is: leafcut's own are in `solve`, those of installed packages are found here and run with care."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import LeafcutError, SolveError
from leafcut.files.plugins import PluginKind, reason
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.options import ALGORITHM_GROUP, ALGORITHM_TITLES, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.running import SearchResult, set_budget_of_visits
from leafcut.order.statistics import Best
from leafcut.order.stop import Stop

if TYPE_CHECKING:
    from leafcut.order.instance import Instance


@dataclass(frozen=True)
class AlgorithmRun:
    """What an algorithm is given beside the instance: the options of the run, and where it offers its tours."""

    options: SolveOptions
    aco: AcoOptions
    firefly: FireflyOptions
    best: Best

    @property
    def stop(self) -> Stop:
        """What says when the search ends."""
        return self.best.stop


class Algorithm(Protocol):
    """One way to find a short closed tour."""

    @property
    def title(self) -> str:
        """What it is, in a line of ``leafcut list algorithms``."""
        ...

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        """Return a tour int32[n] of all nodes, each once, and `first` and `second`, where there are any, side by side.

        Every tour that may be the best is offered to `run.best`, with its `Instance.length`; after each iteration
        `run.best.tell` is called, and before the next one `run.stop.reached` is asked. Same seed, same tour.
        """
        ...


def _algorithm_of(_: str, found: Any) -> Algorithm:
    """Return the algorithm that an entry point names: a class without parameters, or an object."""
    algorithm: Algorithm = found() if isinstance(found, type) else found
    if not isinstance(algorithm.title, str) or not algorithm.title.isprintable() or not callable(algorithm.solve):
        raise TypeError("an algorithm has a title of one line and a method solve(instance, run)")
    return algorithm


#: Algorithms of other packages.
PACKAGED = PluginKind("algorithm", ALGORITHM_GROUP, lambda: ALGORITHM_TITLES, _algorithm_of, lambda one: one.title)


def algorithm_titles() -> dict[str, str]:
    """Return what ``--algorithm`` takes and what each is; of a broken plug-in its error."""
    titles = {one.name: one.refusal if one.adds is None else one.adds.title for one in PACKAGED.plugins()}
    return {**titles, **ALGORITHM_TITLES}


def run_packaged(name: str, instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Return what the algorithm of a package finds; one of its iterations is counted as one tour of all nodes.

    Raises
    ------
    OptionError
        It cannot be used.
    SolveError
        It fails, or returns what is no tour.
    """
    algorithm, best = PACKAGED.load(name), run.best
    set_budget_of_visits(run.stop, run.options, instance.n)
    ends = _Ends(best.progress)
    best.progress = None if best.progress is None else ends
    try:
        found = algorithm.solve(instance, run)
    except KeyboardInterrupt:
        run.stop.cancelled.set()
        if not len(best.tour):
            raise
        found = SearchResult(best.tour, best.iteration)
    except (LeafcutError, MemoryError):
        raise
    except Exception as problem:
        if problem is ends.raised:
            raise
        raise SolveError(f"algorithm '{name}' failed ({reason(problem)}); it is no part of leafcut") from problem
    finally:
        best.progress = ends.progress
    tours = [found.tour, best.tour] if len(best.tour) else [found.tour]
    return SearchResult(_shortest(name, instance, tours), found.iterations, found.workers)


class _Ends:
    """Passes progress on, and knows what whoever is told raises to end the search."""

    def __init__(self, progress: OnProgress | None) -> None:
        self.progress = progress
        self.raised: Exception | None = None

    def __call__(self, now: Progress) -> None:
        if self.progress is None:
            return
        try:
            self.progress(now)
        except Exception as ended:
            self.raised = ended
            raise


def _shortest(name: str, instance: Instance, tours: list[NDArray[np.int32]]) -> NDArray[np.int32]:
    """Return the shortest of some tours, after each was looked at; lengths that were told of them count nothing."""
    whole = [_checked(name, instance, tour) for tour in tours]
    return min(whole, key=instance.length)


def _checked(name: str, instance: Instance, tour: Any) -> NDArray[np.int32]:
    nodes = np.asarray(tour)
    right = nodes.shape == (instance.n,) and np.array_equal(np.sort(nodes), np.arange(instance.n))
    if right and instance.second >= 0:
        place = {int(np.flatnonzero(nodes == end)[0]) for end in (instance.first, instance.second)}
        right = max(place) - min(place) in (1, instance.n - 1)
    if not right:
        raise SolveError(
            f"algorithm '{name}' returned no tour of all {instance.n} nodes, each once and the ends side by side; it is"
            " no part of leafcut"
        )
    return np.ascontiguousarray(nodes, dtype=np.int32)
