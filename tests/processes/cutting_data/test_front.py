"""The Pareto front: equal to the definition by comparing everything with everything."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leafcut.geometry.arrays import Floats, Mask
from leafcut.processes.cutting_data.run import non_dominated


def by_comparing_all(values: Floats) -> Mask:
    """Return which rows no other row dominates, straight from the definition, in O(n²)."""
    no_larger = (values[:, None, :] <= values[None, :, :]).all(axis=2)
    smaller = (values[:, None, :] < values[None, :, :]).any(axis=2)
    return np.asarray(~(no_larger & smaller).any(axis=0))


@given(arrays(np.int64, st.tuples(st.integers(0, 60), st.just(3)), elements=st.integers(-4, 4)))
def test_the_front_of_any_points_is_that_of_the_definition_ties_and_equals_included(values: np.ndarray) -> None:
    found = non_dominated(values.astype(float))
    assert found.tolist() == by_comparing_all(values.astype(float)).tolist()


@given(arrays(np.float64, st.tuples(st.integers(0, 60), st.just(3)), elements=st.floats(-1e6, 1e6)))
def test_the_front_of_any_real_numbers_is_that_of_the_definition(values: Floats) -> None:
    assert non_dominated(values).tolist() == by_comparing_all(values).tolist()


@pytest.mark.parametrize("kind", ["sphere", "line", "cloud"])
def test_the_front_of_many_points_is_that_of_the_definition(kind: str) -> None:
    """On a sphere all points are on it, on a line one; of a cloud some."""
    random = np.random.default_rng(7)
    values = random.normal(size=(1500, 3))
    if kind == "sphere":
        values = -np.abs(values) / np.linalg.norm(values, axis=1)[:, None]
    elif kind == "line":
        values = np.repeat(values[:, :1], 3, axis=1)
    found = non_dominated(values)
    assert found.tolist() == by_comparing_all(values).tolist()
    assert found.sum() in ({"sphere": {1500}, "line": {1}}.get(kind) or range(2, 1500))
