"""Validation of routing problems."""

from __future__ import annotations

import math

import pytest

from leafcut.errors import PlanError
from leafcut.model.problem import RoutingProblem


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e160, -1e160])
def test_coordinates_with_which_no_distance_can_be_computed_are_refused(bad: float) -> None:
    for kwargs in ({"points": [[0.0, 1.0], [bad, 2.0]]}, {"points": [[0, 0]], "start": (0.0, bad)}):
        with pytest.raises(PlanError, match="coordinate"):
            RoutingProblem.of_points(**kwargs)
    with pytest.raises(PlanError, match="coordinate"):
        RoutingProblem.of_points([[0, 0]], end=(bad, 0.0))
