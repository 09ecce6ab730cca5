"""Ants on a GPU build the tours of the CPU. CUDA's simulator runs each CUDA thread as a Python thread."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from leafcut import api
from leafcut.errors import OptionError, SolveError
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions, SolveOptions
from leafcut.order.instance import build_instance
from leafcut.order.literature import gpu
from leafcut.order.literature.ants import Ants, initial_trails
from leafcut.order.literature.gpu import GpuAnts
from leafcut.order.literature.pheromone import AntParameters
from leafcut.order.literature.places import Places
from leafcut.order.search import Best
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from plain_python import plain_parts, plain_python

__all__ = ["plain_parts"]

#: Three iterations of 40 ants (more than one block) on random places, on a grid with many ties, and with a free end.
COMPARED = """
import json
import numba
import numpy as np
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions
from leafcut.order.literature import gpu
from leafcut.order.literature.ants import Ants, initial_trails
from leafcut.order.literature.pheromone import AntParameters
from leafcut.order.literature.places import Places
from leafcut.order.literature.gpu import GpuAnts
from leafcut.order.instance import build_instance
from leafcut.order.search import Best
from leafcut.order.stop import Stop

places = np.random.default_rng(4).uniform(0, 100, (40, 2))
grid = np.array([(7.0 * x, 7.0 * y) for x in range(6) for y in range(5)])
problems = {
    "places": (RoutingProblem.of_points(places, closed=True), 8),
    "grid": (RoutingProblem.of_points(grid, closed=True), 4),
    "open": (RoutingProblem.of_points(places, start=(0.0, 0.0)), 5),
}
found = {}
for name, (problem, candidates) in problems.items():
    instance = build_instance(problem, candidates)
    for algorithm in ("as", "mmas"):
        said = []
        for kind in (Ants, GpuAnts):
            stop = Stop()
            best = Best(stop)
            parameters = AntParameters.from_options(algorithm, AcoOptions(n_ants=40), instance.n, False)
            moves = Places(instance, False)
            ants = kind(moves, initial_trails(moves, parameters, moves.offer_first_solution(best), 3), 3, stop)
            for iteration in range(1, 4):
                tours, costs = ants.construct(iteration)
                said.append((tours.tolist(), costs.tolist()))
                best.offer(tours[costs.argmin()], float(costs.min()), iteration)
                ants.reinforce(iteration, tours, costs, best)
        differ = len({tuple(tour) for tours, _ in said[:3] for tour in tours})
        found[f"{name} {algorithm}"] = [said[:3] == said[3:], differ]
print(json.dumps(found))
"""

#: The same with memory for seven ants at once, so that an iteration takes several shares.
IN_SHARES = COMPARED.replace(
    "found = {}",
    """found = {}
build = gpu._TourConstructor.__init__
def few(self, *given):
    build(self, *given)
    self.share = 7
gpu._TourConstructor.__init__ = few""",
)


def simulated(code: str) -> dict[str, Any]:
    """Run a program with simulated CUDA and return the JSON that it prints."""
    environment = dict(os.environ, NUMBA_ENABLE_CUDASIM="1")
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("code", [COMPARED, IN_SHARES], ids=["at once", "in shares"])
def test_every_ant_builds_the_same_tour_as_on_the_cpu(code: str) -> None:
    found = simulated(code)
    assert len(found) == 6
    for name, (same, tours) in found.items():
        assert same, name
        assert tours > 30, name  # ants differ: equal tours are no coincidence


def test_a_whole_search_with_local_search_equals_that_on_the_cpu() -> None:
    code = """
import json
from leafcut import api
found = {}
for algorithm in ("eas", "asrank"):
    answers = [
        api.solve("random:30:2", algorithm=algorithm, parallel=d, iterations=2, n_ants=6, bound=False, threads=2)
        for d in ("threads", "gpu")
    ]
    found[algorithm] = answers[0].solution.nodes.tolist() == answers[1].solution.nodes.tolist()
print(json.dumps(found))
"""
    assert simulated(code) == {"eas": True, "asrank": True}


def test_a_missing_gpu_is_reported_in_one_line_before_anything_is_compiled(tmp_path: Path) -> None:
    words = ["solve", "random:12", "--algorithm", "as", "--parallel", "gpu"]
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_ENABLE_CUDASIM"}
    environment |= {"CUDA_VISIBLE_DEVICES": "-1", "NUMBA_CACHE_DIR": str(tmp_path)}  # an empty cache of kernels
    done = subprocess.run(
        [sys.executable, "-c", f"from leafcut.cli.app import run; raise SystemExit(run({words!r}))"],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    assert done.returncode == 1
    assert re.fullmatch(r"leafcut: --parallel gpu.*(pip install 'leafcut\[gpu\]'|no CUDA GPU).*\n", done.stderr)


def test_searches_that_cannot_use_a_gpu_are_refused() -> None:
    with pytest.raises(OptionError, match=r"^--parallel: only used with --algorithm"):
        api.solve("random:12", parallel="gpu", iterations=1)
    with pytest.raises(SolveError, match=r"^--parallel gpu: the ants of acs"):
        api.solve("random:12", parallel="gpu", algorithm="acs", iterations=1)


def test_directed_paths_are_refused() -> None:
    places = np.random.default_rng(1).uniform(0, 100, (12, 2))
    several = RoutingProblem(
        entry=places,
        exit=places + 1.0,
        cluster=np.arange(12, dtype=np.int32),
        service=np.zeros(12),
        precedence=np.array([[3, 2]], dtype=np.int32),
    )
    with pytest.raises(SolveError, match="--parallel gpu: paths with directions"):
        solve(several, SolveOptions(algorithm="as", iterations=1, bound=False), AcoOptions(parallel="gpu"))


class FakeArray(np.ndarray):
    """An array in the memory of the fake GPU."""

    def copy_to_host(self) -> np.ndarray:
        """Return a copy."""
        return np.array(self)

    def copy_to_device(self, values: np.ndarray) -> None:
        """Overwrite the array."""
        self[:] = values


class FakeCuda:
    """`numba.cuda` with plain Python: threads run in turn, and arrays are copied."""

    def __init__(self, free: float) -> None:
        self.free, self.launched = free, []  # type: ignore[var-annotated]
        self.at = 0

    def current_context(self) -> FakeCuda:
        return self

    def get_memory_info(self) -> tuple[float, float]:
        return self.free, 1e12

    def is_available(self) -> bool:
        return self.free > 0.0

    def to_device(self, values: np.ndarray) -> FakeArray:
        return np.array(values).view(FakeArray)

    def device_array(self, shape: tuple[int, ...], dtype: np.dtype) -> FakeArray:
        return np.full(shape, 77, dtype).view(FakeArray)

    def grid(self, axes: int) -> int:
        assert axes == 1
        return self.at

    def jit(self, function: Any = None, device: bool = False) -> Any:
        if device:
            return lambda part: part

        class Launcher:
            def __getitem__(_, shape: tuple[int, int]) -> Callable[..., None]:
                self.launched.append(shape)
                return partial(self.run, function, shape)

        return Launcher()

    def run(self, function: Callable[..., None], shape: tuple[int, int], *given: object) -> None:
        """Run every thread of all blocks."""
        for self.at in range(shape[0] * shape[1]):
            function(*given)


@pytest.fixture
def fresh_kernels() -> Iterator[None]:
    """Compile the kernel of the GPU again, before and after a test."""
    for compiled in (gpu._compile_tour_kernel, gpu.compile_for_gpu):
        compiled.cache_clear()
    yield
    for compiled in (gpu._compile_tour_kernel, gpu.compile_for_gpu):
        compiled.cache_clear()


@pytest.mark.usefixtures("fresh_kernels", "plain_parts")
@pytest.mark.parametrize(
    ("ants", "ends", "free_ants", "launched"),
    [
        (40, {"closed": True}, 1e6, [(2, 32)]),
        (32, {"start": (0.0, 0.0)}, 1e6, [(1, 32)]),
        (7, {"closed": True}, 2 * 3.5, [(1, 32)] * 3),
        (3, {"start": (0.0, 0.0), "end": (9.0, 9.0)}, 0.5, [(1, 32)] * 3),
    ],
)
def test_a_fake_gpu_builds_the_tours_of_the_cpu(
    ants: int,
    ends: dict[str, object],
    free_ants: float,
    launched: list[tuple[int, int]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Half of the free memory is for ants; an ant has its tour, marks, counts, a stack of 64, and a random state."""
    xy = np.random.default_rng(4).uniform(0, 100, (9, 2))
    instance = build_instance(RoutingProblem.of_points(xy, **ends), 4)  # type: ignore[arg-type]
    per_ant = 4 * instance.n + instance.n + 4 * len(instance.tree.parent) + 4 * 64 + 8
    fake = FakeCuda(free_ants * per_ant)
    monkeypatch.setattr(numba, "cuda", fake, raising=False)
    parameters = AntParameters.from_options("mmas", AcoOptions(n_ants=ants), instance.n, False)
    swarms = []
    for kind in (Ants, GpuAnts):
        moves, best = Places(instance, False), Best(Stop())
        swarms.append(kind(moves, initial_trails(moves, parameters, moves.offer_first_solution(best), 3), 3, Stop()))
    for iteration in range(2):
        found = [swarm.construct(iteration) for swarm in swarms]
        assert np.array_equal(found[0][0], found[1][0])
        assert np.array_equal(found[0][1], found[1][1])
        assert fake.launched == launched * (iteration + 1)
        assert len({tuple(tour) for tour in found[0][0].tolist()}) > min(ants, 5) - 1
        best.offer(found[0][0][0], float(found[0][1][0]), iteration)
        for swarm in swarms:
            swarm.reinforce(iteration, *found[0], best)


def test_words_of_ants_advance_on_the_gpu_too(fresh_kernels: None, monkeypatch: pytest.MonkeyPatch) -> None:
    instance = build_instance(RoutingProblem.of_points(np.random.default_rng(4).uniform(0, 9, (6, 2)), closed=True), 3)
    monkeypatch.setattr(numba, "cuda", FakeCuda(1e9), raising=False)
    parameters = AntParameters.from_options("as", AcoOptions(n_ants=3), instance.n, False)
    moves, words = Places(instance, False), np.arange(1, 4, dtype=np.uint64)
    with plain_python():
        ants = GpuAnts(moves, initial_trails(moves, parameters, 9.0, 3), 3, Stop())
        assert ants._construct_all(words) == 3
        here, other = np.arange(1, 4, dtype=np.uint64), Ants(moves, ants.trails, 3, Stop())
        for ant in range(3):
            moves.construct(other.trails, here, ant, other.tours[ant], 0)
    assert words.tolist() == here.tolist()


@pytest.mark.parametrize(
    ("simulated", "installed", "free", "message"),
    [
        (1, False, 0.0, None),
        (0, True, 1.0, None),
        (0, False, 1.0, "--parallel gpu needs the package numba-cuda: pip install 'leafcut[gpu]'"),
        (0, True, 0.0, "--parallel gpu: this machine has no CUDA GPU, or no driver for it; leave the option out"),
    ],
)
def test_a_gpu_needs_its_package_and_its_driver(
    simulated: int, installed: bool, free: float, message: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("numba.config.ENABLE_CUDASIM", simulated)
    monkeypatch.setattr(gpu, "find_spec", lambda name: object() if installed and name == "numba_cuda" else None)
    monkeypatch.setattr(numba, "cuda", FakeCuda(free), raising=False)
    if message is None:
        gpu.check_gpu()
        return
    with pytest.raises(SolveError) as refused:
        gpu.check_gpu()
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (RuntimeError("  out of memory\nat 0x77\n"), "out of memory"),
        (MemoryError(), "MemoryError"),
        (OSError("busy " * 40), ("busy " * 40)[:159] + "…"),
        (ImportError("no driver"), "no driver"),
    ],
)
def test_an_error_of_the_gpu_is_reported_by_its_first_line(error: Exception, words: str) -> None:
    def fail() -> None:
        raise error

    with pytest.raises(SolveError) as refused:
        gpu._run_on_gpu(fail)
    assert str(refused.value) == f"--parallel gpu: the GPU rejected the job ({words}); leave it out"
    assert gpu._run_on_gpu(lambda: 5) == 5
