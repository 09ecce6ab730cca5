"""Convert a benchmark map to a routing problem: a closed tour through points or through sets of points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.model.part import Part
from leafcut.model.problem import Metric, RoutingProblem


def problem_from_map(part: Part) -> RoutingProblem:
    """Convert a map to a closed-tour problem. If the file names a TSPLIB distance function, the problem uses it.

    A forbidden edge costs more than any tour of allowed edges. Raises PlanError if the first cluster of the tour has a
    predecessor.
    """
    metric = Metric(part.edge_weight_type or "euclidean", matrix=part.matrix)
    problem = RoutingProblem.of_points(part.hole_xy, metric, closed=True, name=part.name)
    grouping = part.grouping
    if grouping is None:
        return problem
    pairs, count = grouping.precedence, grouping.n_clusters
    if grouping.first >= 0:
        before = pairs[pairs[:, 1] == grouping.first, 0]
        if len(before):
            raise PlanError(
                "{}: the tour begins with set {}, and set {} must come before it; change one of the two",
                part.source or part.name,
                grouping.first + 1,
                before[0] + 1,
            )
        others = np.delete(np.arange(count, dtype=np.int32), grouping.first)
        starts = np.column_stack([np.full_like(others, grouping.first), others])
        pairs = np.concatenate([pairs, starts])
    if part.matrix is not None:
        barred = part.matrix < 0
        metric = replace(metric, matrix=np.where(barred, _forbidden_edge_cost(part.matrix, count), part.matrix))
    return replace(problem, cluster=grouping.cluster, precedence=pairs, metric=metric)


def check_forbidden_edges(part: Part, nodes: NDArray[np.int32]) -> None:
    """Raise `PlanError` if the closed tour through `nodes` uses a forbidden edge of the map."""
    if part.matrix is None or len(nodes) < 2:
        return
    behind = np.roll(nodes, -1)
    wrong = np.flatnonzero(part.matrix[nodes, behind] < 0)
    if len(wrong):
        raise PlanError(
            "{}: no tour was found without edges that the file forbids; the best tour "
            "goes from node {} to {} (-1 in the matrix); "
            "give more time, or allow more edges",
            part.source or part.name,
            nodes[wrong[0]] + 1,
            behind[wrong[0]] + 1,
        )


def _forbidden_edge_cost(matrix: NDArray[np.float64], count: int) -> float:
    return float((matrix.max(initial=0.0) + 1.0) * (count + 1))
