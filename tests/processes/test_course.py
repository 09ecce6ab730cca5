"""The course of a job: an order is used only if it does each task once and keeps the precedence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from leafcut.errors import PlanError
from leafcut.model.plan import Order, Stage
from leafcut.model.problem import RoutingProblem
from leafcut.processes.ordering import check_order

#: Three tasks with two choices each; task 0 comes before task 2.
PROBLEM = replace(
    RoutingProblem.of_points(np.arange(12.0).reshape(6, 2)),
    cluster=np.array([0, 0, 1, 1, 2, 2], dtype=np.int32),
    precedence=np.array([[0, 2]], dtype=np.int32),
)
STAGE = Stage(PROBLEM, False, np.array([0, 2, 4], dtype=np.int32), "ordering T1")


@pytest.mark.parametrize("nodes", [[0, 2, 4], [1, 5, 3], [3, 0, 4]])
def test_an_order_of_each_task_once_that_keeps_the_precedence_is_used(nodes: list[int]) -> None:
    check_order([STAGE], Order((np.array(nodes, dtype=np.int32),)))


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("nodes", "wrong"),
    [
        ([0, 2], "an order of 2 visits does not contain each of the 3 tasks exactly once"),
        ([0, 2, 4, 5], "an order of 4 visits"),
        ([0, 1, 4], "an order of 3 visits does not contain each of the 3 tasks exactly once"),
        ([0, 2, 6], "an order of 3 visits does not contain each of the 3 tasks exactly once"),
        ([0, 2, -1], "an order of 3 visits does not contain each of the 3 tasks exactly once"),
        ([4, 0, 2], "a task comes before its predecessor"),
    ],
)
def test_any_other_order_is_refused(nodes: list[int], wrong: str) -> None:
    with pytest.raises(PlanError, match=f"^ordering T1: {wrong}.*choose another --algorithm"):
        check_order([STAGE], Order((np.array(nodes, dtype=np.int32),)))
