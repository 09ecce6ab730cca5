"""Ants on a GPU build the tours of the CPU. CUDA's simulator runs each CUDA thread as a Python thread."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from leafcut import api
from leafcut.errors import OptionError, SolveError
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions, SolveOptions
from leafcut.order.solve import solve

#: Three iterations of 40 ants (more than one block) on random places, on a grid with many ties, and with a free end.
COMPARED = """
import json
import numpy as np
from leafcut.model.problem import RoutingProblem
from leafcut.options import AcoOptions
from leafcut.order.literature import gpu
from leafcut.order.literature.ants import Ants, trails_of
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
            parameters = AntParameters.of(algorithm, AcoOptions(n_ants=40), instance.n, False)
            moves = Places(instance, False)
            ants = kind(moves, trails_of(moves, parameters, moves.start(best), 3), 3, stop)
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
build = gpu._Builder.__init__
def few(self, *given):
    build(self, *given)
    self.share = 7
gpu._Builder.__init__ = few""",
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
    assert re.fullmatch(r"leafcut: --parallel gpu: .*(pip install 'leafcut\[gpu\]'|no CUDA GPU).*\n", done.stderr)


def test_searches_that_cannot_use_a_gpu_are_refused() -> None:
    with pytest.raises(OptionError, match=r"^--parallel: only used with --algorithm"):
        api.solve("random:12", parallel="gpu", iterations=1)
    with pytest.raises(SolveError, match=r"^--parallel gpu: the ants of acs"):
        api.solve("random:12", parallel="gpu", algorithm="acs", iterations=1)


def test_directed_paths_are_refused() -> None:
    places = np.random.default_rng(1).uniform(0, 100, (12, 2))
    several = RoutingProblem(
        entry=places, exit=places + 1.0, cluster=np.arange(12, dtype=np.int32), service=np.zeros(12),
        precedence=np.array([[3, 2]], dtype=np.int32),
    )  # fmt: skip
    with pytest.raises(SolveError, match="--parallel gpu: paths with directions"):
        solve(several, SolveOptions(algorithm="as", iterations=1, bound=False), AcoOptions(parallel="gpu"))
