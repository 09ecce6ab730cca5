"""What putting a program in order alone finds out: the proof, and what keeps its place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from leafcut.model.certificate import Certificate
from leafcut.model.pace_change import PaceChange
from leafcut.model.sequence import Staying
from leafcut.model.shown_stock import ShownStock


@dataclass(frozen=True)
class ProgramDetail:
    """A program in a new order.

    Attributes
    ----------
    certificate
        The proof that the new program does the same work, and what was counted.
    barriers
        How many pieces of the program stay where they are, and nothing is carried past them.
    pieces, staying
        How many pieces of work it has (holes, cuts, strokes …), and why some of them keep their place.
    pace
        What new speeds did, where they were asked for.
    stock
        What of its stock and its tools is known.
    """

    report: ClassVar[str] = "leafcut.processes.program.report:ProgramReport"

    certificate: Certificate
    barriers: int = 0
    pieces: int = 0
    staying: tuple[Staying, ...] = field(default=())
    pace: PaceChange | None = None
    stock: ShownStock = field(default_factory=ShownStock)
