"""Recorded statistics of a search."""

from __future__ import annotations

import numpy as np

from leafcut.order.search import Best
from leafcut.order.stop import Stop


def test_a_tour_that_is_better_by_rounding_alone_is_not_taken() -> None:
    best = Best(Stop())
    costs = [0.1 + 0.2 + 0.3, 0.3 + 0.2 + 0.1]
    first, same = np.array([0, 1, 2], np.int32), np.array([2, 1, 0], np.int32)
    assert costs[1] < costs[0]
    assert best.offer(first, costs[0], 0)
    assert not best.offer(same, costs[1], 1)
    assert best.tour.tolist() == [0, 1, 2] and len(best.history) == 1
    assert best.offer(same, costs[0] - 1e-9, 2)
