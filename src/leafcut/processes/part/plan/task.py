"""The protocol of milling tasks: each task has choices of entry and exit, and generates its motion."""

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
    """Heights of a program, mm: rapids, tops of the tabs, and lowest cut.

    Rapids cross the keep-out `zones`, float64[k, 4], at the clearance height. `end` is the last position.
    """

    clearance: float
    retract: float
    tab_top: float
    bottom: float
    zones: NDArray[np.float64]
    end: Point | None = None


@dataclass(frozen=True, eq=False)
class Mill:
    """A milling tool with its feeds, its largest step-down, mm, and the milling direction."""

    data: MillingData
    step: float
    climb: bool


class MillTask(Protocol):
    """Work that a mill does without interruption. It starts at the retract height, and ends at the last cut."""

    @property
    def choices(self) -> Sequence[tuple[Point, Point]]:
        """Entry and exit of each choice, mm."""
        ...

    @property
    def later(self) -> Sequence[int]:
        """Indices of the edges that are milled after this task."""
        ...

    def mill(self, builder: ToolpathBuilder, choice: int, mill: Mill, heights: PartHeights) -> None:
        """Generate the motion of a choice. At first, the tool is above the entry."""
        ...
