"""Compile all kernels before the first job needs them, by running tiny jobs of every kind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely

from leafcut import api
from leafcut.files.whole_files import StandardInput
from leafcut.geometry.polyline import Polyline
from leafcut.kernels.compiling import Compilations, announced_compilations
from leafcut.material.bands import segment_point_pairs_within
from leafcut.material.mesh_field import mesh_to_height_field
from leafcut.material.removal import engaged_tool_path
from leafcut.material.step_over import measure_widest_step_overs
from leafcut.material.surface import build_safe_tiles, heights_around_holes
from leafcut.message import Message
from leafcut.model.mesh import Mesh
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.model.problem import Metric, Relief, RoutingProblem
from leafcut.model.study import Study
from leafcut.options import LITERATURE, AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.bound import ALL_PAIRS
from leafcut.order.construction import FEW
from leafcut.order.instance import MANY
from leafcut.order.solve import solve
from leafcut.timing.travel import travel_cost, travel_heights

#: A program with moves that a controller merges into one.
_PROGRAM = b"""G21 G90 G17 G64 P0.1
T1 M6 (drill D6)
S1000 M3
G0 X0 Y0 Z5
G1 Z-1 F300
X5
X9 Y0.01
X14 Y0
G0 Z5
M5
M30
"""


def compile_all_kernels(on_compile: Callable[[Message], None] = lambda _: None) -> Compilations:
    """Compile every kernel that is not cached on disk; `on_compile` is called once, before the first compilation."""
    with announced_compilations(on_compile) as compilations:
        _warm_order()
        _warm_program_reader()
        _warm_surfaces()
        _warm_timing()
    return compilations


def _warm_order() -> None:
    for n in (40, ALL_PAIRS + 10):
        solve(RoutingProblem.of_points(_pseudo_random_points(n)), SolveOptions(iterations=1))
    solve(
        RoutingProblem.of_points(_pseudo_random_points(40)), SolveOptions(algorithm="kicks", iterations=1, bound=False)
    )
    solve(RoutingProblem.of_points(_pseudo_random_points(MANY)), SolveOptions(iterations=1, bound=False))
    solve(RoutingProblem.of_points(_pseudo_random_points(FEW + 1)), SolveOptions(algorithm="nn", bound=False))
    free, directed = RoutingProblem.of_points(_pseudo_random_points(12)), _directed_problem(12)
    solve(_directed_problem(40), SolveOptions(iterations=50, bound=False))
    ants = AcoOptions(n_ants=2)
    for problem in (free, directed):
        for algorithm in ("colony", *LITERATURE):
            for local_search in (True, False):
                options = SolveOptions(
                    algorithm=algorithm, iterations=2, threads=1, local_search=local_search, bound=False
                )
                solve(problem, options, ants, firefly=FireflyOptions(n_fireflies=3), observe=Study())
    published = FireflyOptions(n_fireflies=3, variant="published")
    solve(free, SolveOptions(algorithm="firefly", iterations=2, threads=1, bound=False), firefly=published)


def _directed_problem(n: int) -> RoutingProblem:
    places = _pseudo_random_points(2 * n)
    return RoutingProblem(
        entry=places[:n],
        exit=places[n:],
        cluster=np.arange(n, dtype=np.int32),
        service=np.zeros(n),
        precedence=np.array([[0, 1]], dtype=np.int32),
    )


def _pseudo_random_points(n: int) -> np.ndarray:
    """Return pseudo-random points, float64[n, 2], mm."""
    return np.arange(1.0, n + 1.0)[:, None] * (75.4878, 56.9840) % 100.0


def _warm_program_reader() -> None:
    for machine in ("linuxcnc-mill", "grbl-3018"):
        api.simulate(StandardInput(_PROGRAM), machine=machine)
    api.stock(StandardInput(_PROGRAM), machine="linuxcnc-mill", workpiece="-5,-5,-5,20,10,0", tool_diameter=6)


def _warm_surfaces() -> None:
    slope = np.array([[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 1.0]]])
    tiles = build_safe_tiles(slope, 1.0, 1.0, 20)
    relief = Relief(np.zeros((0, 2)), np.zeros(0), 0.0, *tiles, velocity=50.0, acceleration=200.0)
    travel_heights(relief, np.zeros((2, 2)), dogleg=False)
    heights_around_holes(slope, np.array([[2.0, 2.0]]), np.array([1.0]))
    mesh_to_height_field(Mesh(slope, "slope"), 1.0)


def _warm_timing() -> None:
    travel_cost(Metric(), (0.0, 0.0), (9.0, 2.0))
    rules = PocketRules(tool_diameter=4.0, step_over=2.0)
    path = PocketPath("warm", (PocketPiece(Polyline.of_points([(0.0, 0.0), (9.0, 0.0), (9.0, 2.0), (0.0, 2.0)])),))
    path_cut, _ = engaged_tool_path(path, rules)
    measure_widest_step_overs(path_cut, shapely.box(0.0, 0.0, 9.0, 2.0), rules)
    segment_point_pairs_within(path_cut.xy[:-1], path_cut.xy[1:], path_cut.xy, np.ones(len(path_cut)))
