"""What putting a program in order alone finds out: the proof, and what keeps its place."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.certificate import Certificate
from leafcut.model.pace_change import PaceChange
from leafcut.model.sequence import Staying
from leafcut.model.shown_stock import ShownStock


@dataclass(frozen=True)
class StockProof:
    """How a program in a new order was judged by what it leaves of the stock.

    Attributes
    ----------
    cells, cell
        How many cells were compared, and their side, mm; 0 where none were.
    given
        Whether the stock was described; else it is a block around the cuts.
    flat, unknown
        Tools that count as flat mills, and those that were left out, as nothing is known of their shape.
    reason
        Why nothing was compared, in words.
    """

    cells: int = 0
    cell: float = 0.0
    given: bool = False
    flat: tuple[int, ...] = ()
    unknown: tuple[int, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class AvoidedAreas:
    """The new moves across areas that the original avoided at their height.

    Attributes
    ----------
    moves
        How many there are.
    line
        The line of the first, in the new program; 0 without any.
    below
        The greatest height at which the original crosses, mm, if all of these moves are lower; None otherwise.
    """

    moves: int = 0
    line: int = 0
    below: float | None = None

    @property
    def crossings(self) -> str:
        """How many moves cross such areas, for people; "" without any."""
        if not self.moves:
            return ""
        height = "" if self.below is None else f" below Z{self.below:g}"
        words = f"1 new move{height} crosses" if self.moves == 1 else f"{self.moves} new moves{height} cross"
        return f"{words} areas that the original avoided"

    @property
    def text(self) -> str:
        """One line for people, with the first line and what to do."""
        return f"{self.crossings}; name clamps with --keep-out (first: line {self.line})"


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
        How it was judged by what it leaves of the stock; None of what a beam does.
    shown
        What of its stock and its tools is known.
    avoided
        The new moves across areas that the original avoided.
    """

    certificate: Certificate
    barriers: int = 0
    pieces: int = 0
    staying: tuple[Staying, ...] = field(default=())
    pace: PaceChange | None = None
    stock: StockProof | None = None
    shown: ShownStock = field(default_factory=ShownStock)
    avoided: AvoidedAreas = field(default_factory=AvoidedAreas)
