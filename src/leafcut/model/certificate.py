"""`Certificate`: the proof that two programs do the same work, or the differences between them."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.difference import Difference


@dataclass(frozen=True, slots=True)
class Counts:
    """How much work a program does: holes by cycle, cuts, dwells, stages with work in them, and tool changes."""

    holes: int
    cuts: int
    dwells: int
    stages: int
    tool_changes: int

    @property
    def works(self) -> bool:
        """Whether the program cuts or drills anything."""
        return self.holes > 0 or self.cuts > 0


@dataclass(frozen=True, slots=True)
class Certificate:
    """What was compared, and the differences that were found.

    Attributes
    ----------
    same
        The new program does the work of the original and nothing else, and is as safe.
    differences
        What differs: at most about fifty, the last of which says how many more there are.
    before, after
        How much work the original and the new program do.
    compared
        What is the same, in words; empty where something differs.
    sha256
        SHA-256 of the original's text.
    allow_reverse
        Open cuts could be reversed.
    reversed_cuts
        How many of them are reversed.
    notes
        What has changed besides the work, in sentences: which parts a beam now cuts free before which.
    defaults
        Which options came from the user's own defaults, as flags.
    """

    same: bool
    differences: tuple[Difference, ...]
    before: Counts
    after: Counts
    compared: tuple[str, ...]
    sha256: str
    allow_reverse: bool = False
    reversed_cuts: int = 0
    notes: tuple[str, ...] = ()
    defaults: tuple[str, ...] = ()
