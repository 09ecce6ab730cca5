"""Runs the kernels on a few nodes and prints what they give: once compiled, once as plain Python."""

from __future__ import annotations

import json
import sys

import numpy as np
import shapely

from leafcut.geometry.polyline import Polyline
from leafcut.kernels import (
    annealing,
    bands,
    candidates,
    chords,
    cluster_paths,
    construct,
    cost,
    engagement,
    firefly,
    greedy,
    lin_kernighan,
    local_search,
    long_edges,
    neighbours,
    one_tree,
    ordering,
    pheromone,
    random,
    route,
    sequential,
    spanning_tree,
    step_over,
    surface,
    sweep,
)
from leafcut.material.engagement import engagement_along_path as measured
from leafcut.material.step_over import measure_widest_step_overs
from leafcut.material.tool_steps import steps_along_path
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.model.problem import Metric, Relief, RoutingProblem
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order import bound as patched
from leafcut.order import kicks as tour_kicks
from leafcut.order.annealing import PathAnnealing
from leafcut.order.bound import lower_bound
from leafcut.order.construction import greedy_tour
from leafcut.order.directed import build_directed_instance
from leafcut.order.instance import build_cost_model, build_instance
from leafcut.order.kicks import shorten_long_edges, tour_with_buffers
from leafcut.order.solve import solve
from leafcut.processes.pocket.plan.coverage_points import CoveragePoints

#: Flat, ball, bull nose, a drill, and a tapered ball: radius, flat, corner, reach, rise, slope.
SHAPES = (
    (3.0, 3.0, 0.0, 3.0, 0.0, 0.0),
    (3.0, 0.0, 3.0, 3.0, 3.0, 0.0),
    (3.0, 2.0, 1.0, 3.0, 1.0, 0.0),
    (3.0, 0.0, 0.0, 0.0, 0.0, 0.6),
    (3.0, 0.0, 1.0, 0.8, 0.4, 4 / 3),
)


def points(n: int = 24) -> np.ndarray:
    """Return n places with two on top of each other and some in line, float64[n, 2]."""
    xy = np.random.default_rng(5).uniform(0, 90, (n, 2)).round(1)
    xy[3], xy[5:8, 1] = xy[2], 10.0
    return xy


def results() -> dict[str, object]:
    """Return every kernel's answer on a small case."""
    out: dict[str, object] = {}
    xy = points()
    machine = {"velocity": (250.0, 200.0), "acceleration": (900.0, 500.0)}
    for name in ("euclidean", "chebyshev", "manhattan", "EUC_2D", "CEIL_2D", "ATT", "GEO", "MAX_2D", "MAN_2D"):
        out[name] = cost.tour_cost(build_cost_model(Metric(name), xy), np.arange(24, dtype=np.int32))
    zone = np.array([[20.0, 20.0, 40.0, 50.0]])
    for name in ("linear", "dogleg"):
        model = build_cost_model(Metric(name, zones=zone, lift=0.7, **machine), xy)
        out[name] = cost.tour_cost(model, np.arange(24, dtype=np.int32))
    words = np.array([1, 2**63 + 5], dtype=np.uint64)
    out["uniform"] = [random.uniform(words, 1) for _ in range(5)]
    # Plain Python is slow: use a fifth of the usual kicks, and run every algorithm with two of the four combinations of
    # ends.
    tour_kicks.kicks_per_iteration = lambda _: 40
    ants = ("as", "eas", "asrank", "mmas", "acs")
    for turn, (start, end) in enumerate(
        ((None, None), ((0.0, 0.0), None), (None, (9.0, 9.0)), ((0.0, 0.0), (9.0, 9.0)))
    ):
        problem = RoutingProblem.of_points(xy, Metric("linear", **machine), start=start, end=end)
        for k in (6, 0):
            instance = build_instance(problem, k)
            out[f"lists {k} {start} {end}"] = [instance.label.tolist(), instance.candidates.tolist()]
            out[f"greedy {k} {start} {end}"] = greedy_tour(instance).tolist()
        few = RoutingProblem.of_points(xy[:10], problem.metric, start=start, end=end)
        for all_pairs in (0, 20):
            patched.ALL_PAIRS = all_pairs
            out[f"bound {all_pairs} {start} {end}"] = lower_bound(build_instance(few, 6), 9.0)
        kicked = solve(problem, SolveOptions(algorithm="kicks", iterations=1))
        out[f"kicks {start} {end}"] = [kicked.nodes.tolist(), kicked.cost]
        for local in (False, True)[: 1 + turn % 2]:
            options = SolveOptions(algorithm="firefly", iterations=2, threads=1, local_search=local, bound=False)
            found = solve(few, options, firefly=FireflyOptions(n_fireflies=3))
            out[f"firefly {local} {start} {end}"] = [found.nodes.tolist(), found.cost]
        for algorithm in ants[turn in (1, 2) :: 2]:
            for local in (False, True):
                options = SolveOptions(algorithm=algorithm, iterations=3, threads=1, local_search=local, candidates=6)
                found = solve(problem, options, AcoOptions(n_ants=4))
                out[f"{algorithm} {local} {start} {end}"] = [found.nodes.tolist(), found.cost]
    instance = build_instance(problem, 4)
    tour = tour_with_buffers(np.random.default_rng(2).permutation(instance.n).astype(np.int32), queued=False)
    out["long edges"] = [shorten_long_edges(instance, tour), tour.node.tolist(), tour.queue.tolist()]
    matrix = np.abs(xy[:, None, 0] - xy[None, :, 0])
    explicit = RoutingProblem.of_points(xy, Metric("EXPLICIT", matrix=matrix), closed=True)
    few = RoutingProblem.of_points(xy[:10], Metric("EXPLICIT", matrix=matrix[:10, :10]), closed=True)
    patched.ALL_PAIRS = 0
    out["explicit bound"] = lower_bound(build_instance(few, 6), 200.0)
    out["explicit greedy"] = greedy_tour(build_instance(explicit, 3)).tolist()
    out["explicit"] = solve(explicit, SolveOptions(algorithm="mmas", iterations=2, threads=1)).nodes.tolist()
    out["sequential"] = [in_order(xy, closed, ways) for closed, ways in ((True, 2), (False, 1))]
    lists = build_instance(RoutingProblem.of_points(xy, closed=True), 5).candidates
    out["branching"] = pheromone.branching_factor(lists, np.random.default_rng(1).uniform(0, 1, lists.shape), 0.05)
    bent = np.column_stack([np.arange(25.0), np.sin(np.arange(25.0)), np.zeros(25)])
    begins = np.zeros(24, dtype=np.bool_)
    out["chords"] = [chords.merge_chords(bent, np.arange(24) % 7 > 0, np.full(24, 1.2), begins), begins.tolist()]
    out["sweep"] = [cut_by(*shape) for shape in SHAPES]
    out["surface"] = seen_from_above()
    out["passes"] = along_a_way(xy[:10])
    return out


def along_a_way(corners: np.ndarray) -> list[object]:
    """Return the engagement of a 10 mm tool along a path, and the largest step-over."""
    rules = PocketRules(tool_diameter=10.0, step_over=6.0)
    way = steps_along_path(PocketPath("way", (PocketPiece(Polyline.of_points(corners)),)), rules)
    found = measured(way, rules)
    room = shapely.box(-10.0, -10.0, 100.0, 100.0)
    near = CoveragePoints(corners, np.full(len(corners), 30.0), np.arange(len(way) - 1)).near(way.xy)
    return [*(column.tolist() for column in (*found, *near)), list(measure_widest_step_overs(way, room, rules))]


def cut_by(*shape: float) -> list[object]:
    """Return a field of 20 × 20 cells, cut down, across, along two ramps and by a rapid, and the reported removal."""
    heights, found = np.zeros((20, 20), dtype=np.float32), np.zeros((5, 9))
    room = np.full((20, 20), 9.0, dtype=np.float32)
    places = np.array([(5, 5, 9), (5, 5, -1), (14, 8, -1), (6, 15, -2), (6, 4, -0.5), (18, 4, -3)], dtype=np.float64)
    moves = np.hstack([places[:-1], places[1:]])
    inset = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    rows, tool = sweep.CellRows(heights, room, 0, 20, 0.0, 0.0, 1.0), sweep.ToolShape(*shape)
    bodies = np.array([(3, 3, 0, 3, 0, 0, 1.0, 0), (5, 4, 0, 4, 0, 2.0, 2.0, 1)], dtype=np.float64)
    total = sweep.cut_moves(rows, tool, moves, np.arange(5), inset, 0.5, 1e-3, 0.0, bodies, found)
    return [total, heights.tolist(), room.tolist(), repr(found.tolist())]


def seen_from_above() -> list[object]:
    """Return three triangles as cells, the material near them, heights over positions, and travel costs over them."""
    triangles = np.array(
        [[(0, 0, 1), (9, 0, 4), (0, 9, 7)], [(9, 9, 0), (9, 0, 4), (0, 9, 7)], [(2, 2, 0), (2, 2, 9), (4, 2, 9)]],
        dtype=np.float64,
    )
    heights, widest = np.full((12, 12), -np.inf), np.zeros((12, 12))
    surface.raise_cells_to_maximum(triangles, -1.0, -1.0, 1.0, heights)
    surface.maximum_within_reach(heights, surface.reach_in_cells(1.5, 1.0), widest)
    x, y = np.array([-0.5, 0.5, 3.0, 8.0]), np.array([2.0, 0.5, 3.0, 7.0])
    top, under = np.full(4, -np.inf), np.full(4, np.inf)
    surface.mesh_heights_at(triangles, np.searchsorted(x, triangles[:, :, 0].min(axis=1)), x, y, top, under)
    found: list[object] = [repr(part.tolist()) for part in (heights, widest, top, under)]
    places = np.array([(0.5, 0.5), (8.0, 1.0), (2.0, 8.5), (10.0, 10.0)])
    relief = Relief(places[:3], np.array([2.0, 3.0, 1.0]), 12.0, widest, -1.0, -1.0, 1.0, 50.0, 200.0)
    for name in ("linear", "dogleg", "euclidean"):
        model = build_cost_model(Metric(name, (100.0, 80.0), (500.0, 300.0), relief=relief), places)
        leave, arrive = np.repeat(np.arange(4, dtype=np.int32), 4), np.tile(np.arange(4, dtype=np.int32), 4)
        costs, ways = np.zeros(16), np.zeros(3)
        cost.edge_costs(model, leave, arrive, costs)
        cost.travel_heights_along_path(model.code, model.xy, model.matrix, ways)
        found += [costs.tolist(), ways.tolist()]
    return found


def in_order(xy: np.ndarray, closed: bool, ways: int) -> list[object]:
    """Return a path through cuts between these positions, each with `ways` choices, and its candidate lists."""
    entry = np.concatenate([np.roll(xy, k, axis=0)[:12] for k in range(ways)])
    cluster = np.tile(np.arange(12, dtype=np.int32), ways)
    pairs = np.array([[1, 0], [2, 0], [7, 9]], dtype=np.int32)
    cuts = RoutingProblem(entry, entry[::-1].copy(), cluster, np.ones(len(entry)), precedence=pairs, closed=closed)
    found = solve(cuts, SolveOptions(algorithm="colony", iterations=2, bound=False))
    directed = build_directed_instance(cuts, 6)
    ant = PathAnnealing(directed, np.array([7], dtype=np.uint64))
    orders = [
        solve(
            cuts,
            SolveOptions(algorithm=name, iterations=2, bound=False),
            AcoOptions(n_ants=2),
            firefly=FireflyOptions(n_fireflies=3),
        ).nodes.tolist()
        for name in ("acs", "firefly", "nn")
    ]
    *_, (forgotten, _) = ant.anneal(found.nodes, 20.0, 30, 1e-9)
    return [found.nodes.tolist(), found.cost, directed.rules.onward.near.tolist(), forgotten.tolist(), orders]


def unused() -> tuple[object, ...]:
    """Name the kernel modules, so that a new one is not forgotten here."""
    first = (annealing, bands, candidates, chords, construct, cost, engagement, firefly, greedy)
    rest = (
        cluster_paths,
        lin_kernighan,
        local_search,
        long_edges,
        neighbours,
        one_tree,
        ordering,
        pheromone,
        random,
        route,
        sequential,
    )
    return (*first, *rest, spanning_tree, step_over, surface, sweep)


if __name__ == "__main__":
    json.dump(results(), sys.stdout)
