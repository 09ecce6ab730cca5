"""A path between two given places is a closed tour with an edge that must stay, and no search runs for ever on it."""

from __future__ import annotations

import numpy as np

from leafcut.kernels.local_search import improve_by_two_opt_and_or_opt
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.construction import nearest_neighbour_tour
from leafcut.order.instance import build_instance
from leafcut.order.kicks import tour_with_buffers


def test_local_search_ends_where_ways_differ_by_little() -> None:
    """Nine holes of a real board: a gain of 6e-8 s, added up beside the edge that must stay, was undone as a gain."""
    x = [79.583] * 4 + [82.423] * 5
    y = [-111.336, -114.106, -116.876, -119.646, -109.951, -112.721, -115.491, -118.261, -121.031]
    points = np.column_stack([x, y])
    metric = Metric("linear", (124.0, 124.0), (228.6, 228.6), per_mm=1e-6)
    problem = RoutingProblem(
        entry=points,
        exit=points,
        cluster=np.arange(9, dtype=np.int32),
        service=np.zeros(9),
        metric=metric,
        start=(153.67, -96.266),
        end=(147.32, -99.06),
    )
    instance = build_instance(problem, 16)
    work = tour_with_buffers(nearest_neighbour_tour(instance))
    moves = improve_by_two_opt_and_or_opt(instance.cost, work, instance.candidates, 1000)
    assert moves < 1000
    assert sorted(work.node.tolist()) == list(range(11))
    at = work.place
    assert abs(int(at[instance.first]) - int(at[instance.second])) in (1, 10)
