"""`Sequence`: a foreign program as pieces of work that may change places, and what must stay.

Blocks are those of `gcode.program.Program`, by number.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from leafcut.model.issue import Issue


@dataclass(frozen=True, slots=True)
class Chain:
    """A run of blocks that does one piece of work, and can stand elsewhere as a whole.

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
    """Chains whose order is free, but for some that must come before others.

    Attributes
    ----------
    chains
        In the order of the program.
    precedence
        int32[k, 2]: pairs (before, after) of chains.
    start, end
        (x, y) in mm where the tool is before the first chain, and where it must go after the last; None where that is
        not known or does not matter.
    clearance
        The height at which the tool crosses from chain to chain, mm: nowhere lower than it did there.
    tool
        In the spindle, None where the program does not say.
    """

    chains: tuple[Chain, ...]
    precedence: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int32))
    start: tuple[float, float] | None = None
    end: tuple[float, float] | None = None
    clearance: float = 0.0
    tool: int | None = None


@dataclass(frozen=True, slots=True)
class Kept:
    """Blocks begin … end - 1, which stay as they are; `reason` says why, "" for what needs none (header, footer)."""

    begin: int
    end: int
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Sequence:
    """A program in pieces.

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
    """

    items: tuple[Kept | Section, ...]
    process: str
    dropped: tuple[Kept, ...] = ()
    issues: tuple[Issue, ...] = ()
    mergeable: int = 0

    @property
    def sections(self) -> tuple[Section, ...]:
        """The items that can be ordered."""
        return tuple(item for item in self.items if isinstance(item, Section))
