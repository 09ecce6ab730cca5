"""The median used for cutting the greedy tour agrees with NumPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from leafcut.order.construction import _median


@given(st.lists(st.floats(0, 1e300) | st.just(np.inf), min_size=1, max_size=12))
def test_the_middle_is_the_median(values: list[float]) -> None:
    assert _median(np.array(values)) == np.median(values)
