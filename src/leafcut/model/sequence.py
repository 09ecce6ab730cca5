"""`Sequence`: a program from another CAM system, split into tasks that can be reordered and fixed blocks.

Blocks are numbered as in `gcode.program.Program`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.issue import Issue


class StayReason(NamedTuple):
    """The reason why a task keeps its position.

    Attributes
    ----------
    reason
        A name from `leafcut.processes.program.plan.fixed_tasks.PHRASES`, or several names joined by a plus sign.
    line
        Line of the block that causes this.
    word
        Text of this block; "" if the task itself is the cause.
    cause
        Reason why this block keeps its position; "" if the block can move.
    """

    reason: str
    line: int
    word: str = ""
    cause: str = ""


@dataclass(frozen=True, slots=True)
class StayGroup:
    """The number of tasks that keep their position for the same reason (see `StayReason`), with an explanation."""

    reason: str
    count: int
    first_line: int
    word: str
    text: str


@dataclass(frozen=True, slots=True)
class ProgramTask:
    """A task in a given program: consecutive blocks that drill a hole or make a cut, and that move together.

    The task starts with the rapid to its first position, and ends with the retract.

    Attributes
    ----------
    begin, end
        Half-open range of blocks.
    entry, exit
        Positions where the tool arrives by rapid, and where it retracts, (x, y) in mm.
    arrive_z, leave_z
        Height at which the tool arrives, and height to which it retracts, mm.
    reversible
        Whether the task may run in reverse. The tool then arrives at `exit` and retracts at `entry`.
    may_detach, detaches
        Whether the task may detach a part, and whether it certainly detaches a part.
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
    may_detach: bool = False
    detaches: bool = False


@dataclass(frozen=True, eq=False)
class Section:
    """Tasks that may be reordered as long as their precedence is kept.

    Attributes
    ----------
    precedence
        Pairs (before, after) of tasks, int32[k, 2].
    start, end
        Position of the tool before the first task, and its destination after the last task, (x, y) in mm; None if
        unknown or irrelevant.
    clearance
        Height of travel moves between tasks, mm. It is at least the original height.
    ties
        Maps a cause to the constraints of each task, int32[n, 2]. The columns are the first later task that must stay
        after the task (n for none), and the last earlier task that must stay before the task (-1 for none).
    stays
        For each task, the reason why it cannot move, or None if it can. Empty until the reasons are determined.
    """

    pieces: tuple[ProgramTask, ...]
    precedence: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int32))
    start: tuple[float, float] | None = None
    end: tuple[float, float] | None = None
    clearance: float = 0.0
    tool: int | None = None
    ties: Mapping[str, NDArray[np.int32]] = field(default_factory=dict)
    stays: tuple[StayReason | None, ...] = ()


@dataclass(frozen=True, slots=True)
class FixedBlocks:
    """A half-open range of blocks that are not changed. `reasons` is empty for a header or a footer."""

    begin: int
    end: int
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Sequence:
    """A program, split into unchanged blocks and tasks that can be reordered.

    Attributes
    ----------
    items
        Unchanged blocks and sections, in the order of the new program.
    dropped
        Tool changes that the new program leaves out.
    mergeable
        Number of tool changes that the user could save by merging sections. It is counted only if the user did not
        request merging.
    stays
        For each task outside the sections, the reason why it keeps its position.
    """

    items: tuple[FixedBlocks | Section, ...]
    process: str
    dropped: tuple[FixedBlocks, ...] = ()
    issues: tuple[Issue, ...] = ()
    mergeable: int = 0
    stays: tuple[StayReason, ...] = ()

    @property
    def sections(self) -> tuple[Section, ...]:
        """The sections with tasks that can be reordered."""
        return tuple(item for item in self.items if isinstance(item, Section))
