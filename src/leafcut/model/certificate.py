"""`Certificate`: the proof that two programs do the same work, or a list of their differences."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

from leafcut.model.difference import Difference


@dataclass(frozen=True, slots=True)
class Counts:
    """The amount of work in a program: holes drilled by cycles, cuts, dwells, stages with work, and tool changes."""

    holes: int
    cuts: int
    dwells: int
    stages: int
    tool_changes: int

    @property
    def has_cuts_or_holes(self) -> bool:
        """Whether the program cuts or drills anything."""
        return self.holes > 0 or self.cuts > 0


@dataclass(frozen=True, slots=True)
class Certificate:
    """Result of comparing two programs.

    Attributes
    ----------
    same
        Whether the new program does exactly the same work as the original, and is as safe.
    differences
        At most about fifty differences. If there are more, the last entry states the number of further differences.
    compared
        Names of the compared properties if all are equal; empty if any property differs.
    sha256
        SHA-256 of the text of the original.
    allow_reverse, reversed_cuts
        Whether open cuts were allowed to be reversed, and the number of reversed cuts.
    notes
        Sentences about changes that do not affect the work, such as a different order in which a beam detaches parts.
    defaults
        Options that come from the user's own defaults, as flags.
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

    def as_json(self) -> dict[str, Any]:
        """Return the proof as plain values, in the same form as in the answer of `optimize`."""
        differences = [{**asdict(item), "also": [list(pair) for pair in item.also]} for item in self.differences]
        answer = {field.name: getattr(self, field.name) for field in fields(Certificate) if field.name != "defaults"}
        return answer | {
            "differences": differences,
            "before": asdict(self.before),
            "after": asdict(self.after),
            "compared": list(self.compared),
            "notes": list(self.notes),
        }
