"""Chips and widths of cuts by the stock, against the formula of chip thinning."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.material.cutting import cut_width, relative_chip_thickness, simulate_cutting
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.straight_moves import convert_to_straight_moves
from leafcut.model.cutter import flat_mill
from leafcut.model.toolpath import ToolpathBuilder

CELL = 0.05


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("width", [0.3, 0.6, 1.5, 3.0, 4.5, 5.7])
def test_a_cut_of_a_part_of_the_diameter_has_chips_by_the_formula(width: float, side: int) -> None:
    """2 √(a/D (1 − a/D)) up to half of the diameter, then the whole feed per tooth (Altintas 2012, 2.6)."""
    builder = ToolpathBuilder()
    # Beside the block, whose edges are at Y0 and Y20.
    y = -3.0 + width if side > 0 else 23.0 - width
    builder.rapid(-10.0, y, -2.0)
    builder.feed(50.0, y, -2.0, feed=10.0)
    field = HeightField.of_block(StockBlock((0.0, 0.0, -5.0), (40.0, 20.0, 0.0)), CELL)
    moves = convert_to_straight_moves(builder.build(), 0.001, 2.0)
    removed = simulate_cutting(field, moves, {0: flat_mill(6.0)})
    radius = np.full(len(moves), 3.0)
    share, wide = relative_chip_thickness(removed, radius, CELL), cut_width(removed, radius, CELL)
    inside = (moves.ends[:, 0] > 5) & (moves.ends[:, 3] < 35)
    part = width / 6.0
    exact = 2.0 * math.sqrt(part * (1.0 - part)) if part < 0.5 else 1.0
    assert inside.sum() > 10
    # Never below the truth; above it by no more than two cells make.
    more = (width + 2 * CELL) / 6.0
    most = 2.0 * math.sqrt(more * (1.0 - more)) if more < 0.5 else 1.0
    assert (share[inside] >= exact - 1e-9).all()
    assert (share[inside] <= most + 1e-9).all()
    assert wide[inside] == pytest.approx(width, abs=2 * CELL)
    assert not share[moves.rapid].any()
    beyond = moves.ends[:, 0] > 45
    assert not share[beyond].any()
    assert not wide[beyond].any()
