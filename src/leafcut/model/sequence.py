"""`Sequence`: a program of another CAM as pieces of work that can be reordered, and what must stay.

Blocks are those of `gcode.program.Program`, by number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.model.issue import Issue


class Stay(NamedTuple):
    """Why one piece of work keeps its place.

    Attributes
    ----------
    reason
        A name of `leafcut.processes.program.plan.precedence.staying.PHRASES`, or several, joined by a plus sign.
    line
        The line of what causes it, from 1.
    word
        What stands there, "" where it is the piece itself.
    cause
        Why what stands there stays, "" where nothing does.
    """

    reason: str
    line: int
    word: str = ""
    cause: str = ""


@dataclass(frozen=True, slots=True)
class Staying:
    """Pieces that keep their place for one reason.

    Attributes
    ----------
    reason
        As in `Stay`.
    count
        How many they are.
    first_line, word
        The first line of what causes it, and what stands there, "" where it is the piece itself.
    text
        In words: why, and where first.
    """

    reason: str
    count: int
    first_line: int
    word: str
    text: str


@dataclass(frozen=True, slots=True)
class PieceOfWork:
    """A run of blocks that does one piece of work and moves as a whole: a hole, or a cut.

    It begins with the rapid that brings the tool over its first place, and ends when the tool is up again.

    Attributes
    ----------
    begin, end
        Blocks begin … end - 1.
    kind
        ``hole`` or ``cut``.
    entry, exit
        (x, y) in mm where the tool arrives at rapid, and where it is up again.
    arrive_z, leave_z
        The height at which the tool arrived, and the one to which it rose, mm.
    bottom
        The lowest place, mm.
    line
        The line of its first block.
    reversible
        It may be made from the other end: the tool then arrives at `exit` and is up again at `entry`.
    may_free, frees
        It may cut a part free, which then hangs on to nothing; it surely does.
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
    """Pieces of work whose order is free, but for some that must come before others.

    Attributes
    ----------
    pieces
        In the order of the program.
    precedence
        int32[k, 2]: pairs (before, after) of pieces.
    start, end
        (x, y) in mm where the tool is before the first piece, and where it must go after the last; None where that is
        not known or does not matter.
    clearance
        The height at which the tool crosses from piece to piece, mm: nowhere lower than it did there.
    tool
        In the spindle, None where the program does not say.
    ties
        By cause, int32[n, 2]: the first piece behind each that must stay behind it, n where there is none; and the
        last one before each that must stay before it, -1 where there is none.
    stays
        Why a piece can stand nowhere else, None where it can; empty while that is not looked at.
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
    """Blocks begin … end - 1, which stay as they are; `reasons` say why, none for a header or a footer."""

    begin: int
    end: int
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Sequence:
    """A program as what stays and what can be ordered.

    Attributes
    ----------
    items
        What stays and what may be ordered, in the order of the new program.
    process
        ``drill``, ``mill``, ``laser`` or ``plasma``.
    dropped
        Blocks that the new program does not have: tool changes that merging saves.
    issues
        What was noticed.
    mergeable
        How many changes of tool joining sections would save, where that was not asked for.
    stays
        Why pieces of work outside of the sections keep their place, one for each.
    """

    items: tuple[Kept | Section, ...]
    process: str
    dropped: tuple[Kept, ...] = ()
    issues: tuple[Issue, ...] = ()
    mergeable: int = 0
    stays: tuple[Stay, ...] = ()

    @property
    def sections(self) -> tuple[Section, ...]:
        """The items that can be ordered."""
        return tuple(item for item in self.items if isinstance(item, Section))
