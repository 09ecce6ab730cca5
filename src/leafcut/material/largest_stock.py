"""The largest possible stock of a program: undescribed material may be anywhere the program never went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from leafcut.material.cutting import cut
from leafcut.material.height_field import HeightField, StockBlock
from leafcut.material.straight_moves import StraightMoves
from leafcut.model.cutter import Cutter
from leafcut.model.heartbeat import Heartbeat, unseen

#: Height of unknown material above the program's greatest height, mm.
_ABOVE = 1.0


def largest_stock(
    moves: StraightMoves,
    cutters: Mapping[int, Cutter],
    cell: float,
    dogleg: bool,
    threads: int = 1,
    check_cancelled: Heartbeat = unseen,
) -> HeightField:
    """Return the maximum material over the cuts of a program that none of its rapids would meet.

    The program is assumed to be safe: above a rapid there can be no material, unless a cut went as deep before.
    Everywhere else there may be material. With `dogleg`, only the end of a rapid in several axes counts. Raises
    PlanError if there would be too many cells.
    """
    low, high = moves.extent(~moves.rapid, cutters)
    bottom = float(low[2]) - _ABOVE
    top = float(np.maximum(moves.ends[:, 2], moves.ends[:, 5]).max()) + _ABOVE
    field = HeightField.of_block(
        StockBlock((float(low[0]), float(low[1]), bottom), (float(high[0]), float(high[1]), top)), cell
    )
    assumed_ends = moves.ends.copy()
    if dogleg:
        dogleg_moves = moves.rapid & ((assumed_ends[:, 3:] != assumed_ends[:, :3]).sum(axis=1) > 1)
        assumed_ends[dogleg_moves, :3] = assumed_ends[dogleg_moves, 3:]
    remaining = field.copy()
    cut(field, replace(moves, ends=assumed_ends), cutters, threads, check_cancelled, lowered=remaining)
    return remaining
