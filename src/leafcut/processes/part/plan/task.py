"""The protocol for milling tasks. A task offers choices of entry and exit, and generates its own motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Point
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.processes.milling.mill import MillingData


@dataclass(frozen=True, eq=False)
class PartHeights:
    """The heights of a program, mm: rapids, top of the tabs, and lowest cut.

    Rapids cross the keep-out `zones`, float64[k, 4], at the clearance height. `end` is the final position.
    """

    clearance: float
    retract: float
    tab_top: float
    bottom: float
    zones: NDArray[np.float64]
    end: Point | None = None


@dataclass(frozen=True, eq=False)
class Mill:
    """A mill with its feeds, its maximum step-down, mm, and its milling direction."""

    data: MillingData
    step: float
    climb: bool


class MillTask(Protocol):
    """Work that a mill does in one go. The task starts at the retract height and ends with its last cut."""

    @property
    def choices(self) -> Sequence[tuple[Point, Point]]:
        """Entry and exit point of each choice, mm."""
        ...

    @property
    def later(self) -> Sequence[int]:
        """Indices of the edges that must be milled after this task."""
        ...

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Generate the motion for a choice. The tool starts above the entry point."""
        ...
