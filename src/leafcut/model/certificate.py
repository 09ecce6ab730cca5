"""`Certificate`: the proof that two programs do the same work, or the differences between them."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.difference import Difference


@dataclass(frozen=True, slots=True)
class Counts:
    """Amount of work of a program: holes by cycle, cuts, dwells, stages with work in them, and tool changes."""

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
    """Result of the comparison of two programs.

    Attributes
    ----------
    same
        The new program does the work of the original and nothing else, and is as safe.
    differences
        At most about fifty; the last states how many more exist.
    compared
        Compared properties in words, if all are equal; empty if something differs.
    sha256
        Of the original's text.
    notes
        Changes that do not affect the work, in sentences, such as the order in which parts are detached by a beam.
    defaults
        Options set by the user's own defaults, as flags.
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
