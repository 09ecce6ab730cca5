"""Run algorithms from other packages: load their entry points, report their exceptions, and check their tours."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import LeafcutError, SolveError
from leafcut.files.plugins import PluginKind, exception_line
from leafcut.model.heartbeat import OnProgress, Progress
from leafcut.options import ALGORITHM_GROUP, ALGORITHM_TITLES
from leafcut.order.instance import Instance
from leafcut.order.search import AlgorithmRun, SearchResult, set_visit_budget


class PackagedAlgorithm(Protocol):
    """Interface for an algorithm in another package. The algorithm searches for short closed tours."""

    @property
    def title(self) -> str:
        """Title that ``leafcut list algorithms`` displays."""
        ...

    def solve(self, instance: Instance, run: AlgorithmRun) -> SearchResult:
        """Return a tour, int32[n], that visits each node once.

        If `Instance.first` and `second` are given, they must be neighbours in the tour. Offer each improved tour to
        `run.best` with its `Instance.length`. Call `run.best.tell` after each iteration, and check `run.stop.reached`
        before the next iteration. The same seed must give the same tour.
        """
        ...


def _create_algorithm(_: str, found: Any) -> PackagedAlgorithm:
    """Return the algorithm behind an entry point. It is an object, or a class whose constructor takes no arguments."""
    algorithm: PackagedAlgorithm = found() if isinstance(found, type) else found
    if not isinstance(algorithm.title, str) or not algorithm.title.isprintable() or not callable(algorithm.solve):
        raise TypeError("an algorithm must have a title of one line and a method solve(instance, run)")
    return algorithm


#: Algorithms that other packages provide.
PACKAGED = PluginKind("algorithm", ALGORITHM_GROUP, lambda: ALGORITHM_TITLES, _create_algorithm, lambda one: one.title)


def run_plugin_algorithm(name: str, instance: Instance, run: AlgorithmRun) -> SearchResult:
    """Run an algorithm from another package. Each iteration counts as one tour of all nodes.

    Raises
    ------
    OptionError
        If the algorithm cannot be loaded.
    SolveError
        If the algorithm fails or does not return a tour.
    """
    algorithm, best = PACKAGED.load(name), run.best
    set_visit_budget(run.stop, run.options, instance.n)
    ends = _ProgressForwarder(best.progress)
    best.progress = None if best.progress is None else ends
    try:
        found = algorithm.solve(instance, run)
    except KeyboardInterrupt:
        if len(best.tour):
            best.tour = _checked_tour(name, instance, best.tour)
        raise
    except (LeafcutError, MemoryError):
        raise
    except Exception as problem:
        if problem is ends.raised:
            raise
        raise SolveError(
            "algorithm '{}' failed ({}); it is not part of leafcut", name, exception_line(problem)
        ) from problem
    finally:
        best.progress = ends.progress
    tours = [found.tour, best.tour] if len(best.tour) else [found.tour]
    return SearchResult(_shortest_checked_tour(name, instance, tours), found.iterations, found.workers)


class _ProgressForwarder:
    """Forwards progress to its receiver.

    If the receiver raises an exception to stop the search, this class keeps it.
    """

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


def _shortest_checked_tour(name: str, instance: Instance, tours: list[NDArray[np.int32]]) -> NDArray[np.int32]:
    whole = [_checked_tour(name, instance, tour) for tour in tours]
    return min(whole, key=instance.length)


def _checked_tour(name: str, instance: Instance, tour: Any) -> NDArray[np.int32]:
    nodes = np.asarray(tour)
    right = nodes.shape == (instance.n,) and np.array_equal(np.sort(nodes), np.arange(instance.n))
    if right and instance.second >= 0:
        place = {int(np.flatnonzero(nodes == end)[0]) for end in (instance.first, instance.second)}
        right = max(place) - min(place) in (1, instance.n - 1)
    if not right:
        raise SolveError(
            "algorithm '{}' did not return a tour that visits each of the {} nodes once, with its ends "
            "adjacent; it is not part of leafcut",
            name,
            instance.n,
        )
    return np.ascontiguousarray(nodes, dtype=np.int32)
