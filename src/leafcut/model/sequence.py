"""`Sequence`: a program of another CAM as tasks that can be reordered and blocks that must stay.

Blocks are numbered as in `gcode.program.Program`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.issue import Issue


class Stay(NamedTuple):
    """Reason why one task keeps its position.

    Attributes
    ----------
    reason
        A name of `leafcut.processes.program.plan.staying.PHRASES`, or several, joined by a plus sign.
    word, cause
        Text of the cause, "" if it is the task itself; why the cause stays, "" if it does not.
    """

    reason: str
    line: int
    word: str = ""
    cause: str = ""


@dataclass(frozen=True, slots=True)
class Staying:
    """Tasks that keep their position for the same reason (see `Stay`)."""

    reason: str
    count: int
    first_line: int
    word: str
    text: str


@dataclass(frozen=True, slots=True)
class PieceOfWork:
    """Consecutive blocks that do one task and move as a whole: a hole, or a cut.

    It starts with the rapid that brings the tool over its first position, and ends when the tool is retracted.

    Attributes
    ----------
    begin, end
        Half-open range of blocks.
    entry, exit
        (x, y) in mm where the tool arrives by rapid, and where it is retracted.
    arrive_z, leave_z
        Height at which the tool arrives, and to which it retracts, mm.
    reversible
        Whether it may be reversed: the tool then arrives at `exit` and is retracted at `entry`.
    may_free, frees
        Whether it may detach a part, and whether it certainly does.
    """

    begin: int
    end: int
    kind: str
    entry: tuple[float, float]
    exit: tuple[float, float]
    arrive_z: float
    leave_z: float
    bottom: float
    line: int
    reversible: bool = False
    may_free: bool = False
    frees: bool = False


@dataclass(frozen=True, eq=False)
class Section:
    """Tasks whose order is free except for precedence.

    Attributes
    ----------
    precedence
        int32[k, 2]: pairs (before, after) of tasks.
    start, end
        (x, y) in mm of the tool before the first task, and its destination after the last; None if unknown or
        irrelevant.
    clearance
        Height of travel moves between tasks, mm; not below the original heights there.
    ties
        By cause, int32[n, 2]: the first later task that must stay after each task, n for none; and the last earlier
        task that must stay before it, -1 for none.
    stays
        Why a task cannot be moved, None if it can; empty before this is determined.
    """

    pieces: tuple[PieceOfWork, ...]
    precedence: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int32))
    start: tuple[float, float] | None = None
    end: tuple[float, float] | None = None
    clearance: float = 0.0
    tool: int | None = None
    ties: Mapping[str, NDArray[np.int32]] = field(default_factory=dict)
    stays: tuple[Stay | None, ...] = ()


@dataclass(frozen=True, slots=True)
class Kept:
    """Blocks that stay unchanged (half-open range); `reasons` is empty for a header or a footer."""

    begin: int
    end: int
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Sequence:
    """A program divided into unchanged blocks and tasks that can be reordered.

    Attributes
    ----------
    items
        Unchanged blocks and sections, in the order of the new program.
    mergeable
        Number of tool changes that joining sections would save, if that was not requested.
    stays
        Why tasks outside of the sections keep their position, one entry for each.
    """

    items: tuple[Kept | Section, ...]
    process: str
    dropped: tuple[Kept, ...] = ()
    issues: tuple[Issue, ...] = ()
    mergeable: int = 0
    stays: tuple[Stay, ...] = ()

    @property
    def sections(self) -> tuple[Section, ...]:
        """The items that can be reordered."""
        return tuple(item for item in self.items if isinstance(item, Section))
