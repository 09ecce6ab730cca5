"""Candidate lists against a search of all nodes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.kernels.candidates import fill_candidates
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.order.instance import Instance, allocate_nearby_buffers, build_instance, costs_of_edges

PLACES = st.lists(st.tuples(st.integers(0, 15), st.integers(0, 15)), min_size=12, max_size=90, unique=True)
METRICS = st.sampled_from(["euclidean", "linear", "dogleg", "EUC_2D", "chebyshev"])


def metric_of(name: str) -> Metric:
    """Return a metric whose axes are not alike."""
    return Metric(name, (10.0, 20.0), (50.0, 40.0))


def instance_of(places: object, name: str = "euclidean", k: int = 8) -> Instance:
    """Return the instance of a closed tour."""
    return build_instance(RoutingProblem.of_points(places, metric_of(name), closed=True), k)


def costs_to(instance: Instance, i: int, others: list[int]) -> list[float]:
    """Return the cost of travel from a node to each of several others."""
    return costs_of_edges(instance.cost, np.full(len(others), i, np.int32), np.array(others, np.int32)).tolist()


@given(PLACES, METRICS, st.integers(4, 9))
def test_a_list_holds_the_nearest_by_quadrant_and_then_the_nearest(
    places: list[tuple[int, int]], name: str, k: int
) -> None:
    """All on different places; of equally near ones any may be taken, so their distances are compared."""
    instance = instance_of(places, name, k)
    per_quadrant = 2 if k >= 8 else 1
    xy = instance.cost.xy
    for i in range(instance.n):
        away = xy - xy[i]
        d = (away**2).sum(axis=1)
        quadrant = np.floor(np.degrees(np.arctan2(away[:, 1], away[:, 0])) % 360 / 90)
        by_quadrant = [np.sort(d[(quadrant == q) & (d > 0)]) for q in range(4)]
        taken = np.concatenate([row[:per_quadrant] for row in by_quadrant])
        rest = np.sort(np.concatenate([row[per_quadrant:] for row in by_quadrant]))
        wanted = np.sort(np.concatenate([taken, rest[: k - len(taken)]]))
        mine = instance.candidates[i][instance.candidates[i] >= 0]
        assert np.array_equal(np.sort(d[mine]), wanted)
        assert len(set(mine.tolist())) == len(mine)


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=6, max_size=90), METRICS, st.integers(1, 12))
def test_lists_are_sorted_by_cost_and_store_the_costs(places: list[tuple[int, int]], name: str, k: int) -> None:
    """Also with many points at one place; every list is full, or holds all useful nodes."""
    instance = instance_of(places, name, k)
    lengths = instance.lengths
    assert (np.diff(np.where(np.isinf(lengths), 1e300, lengths), axis=1) >= 0).all()
    for i, row in enumerate(instance.candidates.tolist()):
        listed = [j for j in row if j >= 0]
        costs = costs_to(instance, i, listed)
        assert lengths[i].tolist() == costs + [np.inf] * (len(row) - len(listed))
        assert row[len(listed) :] == [-1] * (len(row) - len(listed))
        assert i not in listed
        assert len(set(listed)) == len(listed) >= min(2, k, instance.n - 1)


def test_lists_filled_in_parts_are_those_filled_at_once() -> None:
    """Threads may share the work: a part looks at its own rows only."""
    instance = instance_of(np.random.default_rng(2).integers(0, 40, (200, 2)))
    lists, lengths = np.zeros_like(instance.candidates), np.zeros_like(instance.lengths)
    for first, last in ((120, 200), (0, 1), (1, 120)):
        fill_candidates(instance.cost, instance.tree, 2, first, last, lists, lengths, allocate_nearby_buffers(8))
    assert np.array_equal(lists, instance.candidates)
    assert np.array_equal(lengths, instance.lengths)


def test_thousands_on_one_place_crowd_nobody_out() -> None:
    """100 places, four of them of 5,000 points: everyone sees at most two of a place, and at least three other places.

    Looking through the points of a place for each of its points would be 10⁸ steps.
    """
    xy = np.random.default_rng(7).uniform(0, 100, (100, 2))
    instance = instance_of(np.repeat(xy, [5000] * 4 + [1] * 96, axis=0))
    place = instance.cost.xy
    seen = place[instance.candidates]
    assert (instance.candidates >= 0).all()
    for other in range(8):
        same = (seen == seen[:, [other]]).all(axis=2).sum(axis=1)
        assert same.max() <= 2
    elsewhere = (seen != place[:, None, :]).any(axis=2).sum(axis=1)
    assert elsewhere.min() >= 6


def test_points_on_one_place_are_joined() -> None:
    """Whatever their number: edges of no cost go through all of them, end to end."""
    instance = instance_of(np.repeat(np.array([[0.0, 0.0], [9.0, 0.0], [3.0, 8.0]]), [40, 7, 2], axis=0), k=6)
    xy = instance.cost.xy
    for i in range(instance.n - 1):
        if (xy[i] == xy[i + 1]).all():
            assert i + 1 in instance.candidates[i]
            assert i in instance.candidates[i + 1]


@pytest.mark.parametrize("n", [100, 300])
def test_points_that_all_stand_on_one_place_have_lists(n: int) -> None:
    instance = instance_of(np.zeros((n, 2)))
    assert ((instance.candidates >= 0).sum(axis=1) == 2).all()
    assert costs_to(instance, 0, [int(instance.candidates[0, 0])]) == [0.0]
