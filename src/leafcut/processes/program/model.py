"""What putting a program in order alone finds out: the proof, and what keeps its place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from leafcut.model.outcome import Outcome
from leafcut.model.sequence import Staying

if TYPE_CHECKING:
    from leafcut.processes.program.report import ProgramReport


@dataclass(frozen=True)
class ProgramDetail:
    """A program in a new order.

    Attributes
    ----------
    certificate
        The proof that the new program does the same work (`proof.certificate`), as plain values, and what was counted.
    barriers
        How many pieces of the program stay where they are, and nothing is carried past them.
    pieces, staying
        How many pieces of work it has (holes, cuts, strokes …), and why some of them keep their place.
    """

    certificate: dict[str, Any]
    barriers: int = 0
    pieces: int = 0
    staying: tuple[Staying, ...] = field(default=())

    def report(self, outcome: Outcome[ProgramDetail]) -> ProgramReport:
        """Return what is told of a program in a new order."""
        from leafcut.processes.program.report import ProgramReport

        return ProgramReport(outcome)
