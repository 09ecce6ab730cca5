"""Find the corners between rapids that the controller rounds, and compute how far it rounds them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from leafcut.model.machine import Machine
from leafcut.model.toolpath import MOTIONS, Kind, Toolpath

#: A corner of two rapids is rounded by at most this distance if one of the rapids is slow at the corner, mm.
_ROUNDED = 0.05
#: A change of direction counts as a corner from this angle on, rad.
_STRAIGHT = math.radians(2.0)


def rows_with_free_rounding(path: Toolpath, machine: Machine, clearance: float) -> NDArray[np.bool_]:
    """Detect the rows where the controller may round corners by more than `clearance` (mm). Return a mask."""
    if (machine.corners or machine.control) == "grbl":
        return np.zeros(len(path), dtype=np.bool_)
    blending = path.latest(Kind.BLENDING, path.ref, 640)
    tolerance = path.latest(Kind.BLENDING, path.value, 0.0)
    return np.asarray((blending == 640) & ((tolerance <= 0) | (tolerance > clearance)))


def longest_rounding(machine: Machine) -> float:
    """Return the distance from a corner of two rapids where the controller may start to round the corner, mm.

    This is the stopping distance, v²/2a.
    """
    return 0.5 * max(machine.rapid_velocity) ** 2 / min(machine.acceleration)


class RapidCorners:
    """Detects corners between rapids that the controller may round by more than the clearance from the material.

    The rounding starts no earlier than the stopping distance of the slower move, v²/2a. A corner between a rapid and a
    cut is therefore harmless. So is a corner between two rapids if one of them is slow at the corner.
    """

    #: At this speed or below, the controller rounds a corner by at most `_ROUNDED`, mm/s.
    slow: float

    def __init__(self, path: Toolpath, machine: Machine, clearance: float, top: float, fast: NDArray[np.bool_]) -> None:
        self.path, self.fast = path, fast
        self.free_from = top + clearance
        self.free = rows_with_free_rounding(path, machine, clearance)
        moving = np.isin(path.kind, [int(k) for k in MOTIONS])
        self.moving = np.flatnonzero(moving)
        self.longest = longest_rounding(machine)
        self.slow = math.sqrt(2.0 * min(machine.acceleration) * _ROUNDED)

    def rounded_ends(self, row: int) -> tuple[bool, bool]:
        """Return whether the controller may round the corners at the start and at the end of a straight move."""
        if not self.free[row]:
            return False, False
        at = int(np.searchsorted(self.moving, row))
        before = at > 0 and self._is_rounded_corner(row, int(self.moving[at - 1]), float(self.path.before[row, 2]))
        behind = at + 1 < len(self.moving) and self._is_rounded_corner(
            row, int(self.moving[at + 1]), float(self.path.end[row, 2])
        )
        return before, behind

    def _is_rounded_corner(self, row: int, other: int, height: float) -> bool:
        kind = self.path.kind[other]
        if kind == Kind.DRILL or not (kind == Kind.RAPID or self.fast[other]):
            return False  # cycles are in exact-path mode
        here, there = (self.path.end[one] - self.path.before[one] for one in (row, other))
        if not np.isfinite(there).all():
            return True
        one, two = float(np.linalg.norm(here)), float(np.linalg.norm(there))
        if height >= self.free_from + min(self.longest, 0.5 * one, 0.5 * two):
            return False
        return two <= 0 or float(here @ there) < math.cos(_STRAIGHT) * one * two
