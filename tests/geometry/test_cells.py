"""Cells: lookups agree with an exhaustive search."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.geometry.cells import Cells, number_points

BOX = (-7.3, 2.0, 31.9, 19.5)


@pytest.mark.parametrize("side", [0.7, 3.0, 50.0])
def test_the_cells_around_some_are_all_that_are_so_near(side: float) -> None:
    rng = np.random.default_rng(5)
    reach = 2
    cells = Cells(BOX, side, reach)
    places = rng.uniform(BOX[:2], BOX[2:], (400, 2))
    some = places[:3]
    near = np.isin(cells.cells_of(places), cells.cells_around(cells.cells_of(some), reach))
    at = np.floor((places - BOX[:2]) / side)
    apart = np.abs(at[:, None] - at[None, :3]).max(axis=2).min(axis=1)
    assert np.array_equal(near, apart <= reach)


def test_cells_at_one_edge_are_not_around_those_at_the_other() -> None:
    cells = Cells(BOX, 1.0, 1)
    corners = np.array([[BOX[0], 10.0], [BOX[2], 9.0], [BOX[2], 10.0]])
    one, other, same_row = cells.cells_of(corners)
    assert not np.isin([other, same_row], cells.cells_around(np.array([one]), 1)).any()


def test_a_cell_has_the_column_and_row_of_its_places() -> None:
    cells = Cells(BOX, 2.5, 3)
    places = np.random.default_rng(6).uniform(BOX[:2], BOX[2:], (50, 2))
    column, row = cells.columns_and_rows(cells.cells_of(places))
    low = np.column_stack([column, row]) * 2.5 + BOX[:2]
    assert (low <= places).all() and (places < low + 2.5).all()


def test_places_have_the_same_number_only_where_they_are_the_same_but_for_rounding() -> None:
    places = np.array([(0.0, 0.0), (1e-7, -1e-7), (0.0, 1.0), (1.0, 0.0), (-2.0, 5.0), (-2.0, 5.0 + 1e-7), (0.5, 0.5)])
    number = number_points(places, 1e-5)
    rounded = np.round(places, 5)
    assert ((number[:, None] == number) == (rounded[:, None] == rounded).all(axis=2)).all()
    assert len(number_points(np.zeros((0, 2)), 1e-5)) == 0
