"""`Certificate`: the proof that two programs do the same work, or in what they differ."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.difference import Difference


@dataclass(frozen=True, slots=True)
class Counts:
    """How much a program does: holes by cycle, cuts, dwells, stages with work in them, and tool changes."""

    holes: int
    cuts: int
    dwells: int
    stages: int
    tool_changes: int


@dataclass(frozen=True, slots=True)
class Certificate:
    """What was compared, and in what the programs differ.

    Attributes
    ----------
    same
        The new program does the work of the original, and nothing else, no less safely.
    differences
        What is not the same, at most some fifty; the last one says how many more there are.
    before, after
        How much the original and the new program do.
    compared
        In words, what is the same; nothing where something differs.
    sha256
        Of the original's text.
    allow_reverse
        Open cuts were the same in either direction.
    reversed_cuts
        How many of them are made from their other end.
    notes
        What has changed beside the work, in sentences: which parts a beam cuts free before which.
    defaults
        Which of the options that were used are of the person's own defaults, as one types them.
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
