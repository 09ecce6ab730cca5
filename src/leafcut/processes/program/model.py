"""Results specific to reordered programs: the proof, and the work that keeps its position."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.message import Message
from leafcut.model.certificate import Certificate
from leafcut.model.pace_change import PaceChange
from leafcut.model.sequence import StayGroup
from leafcut.model.shown_stock import ShownStock


@dataclass(frozen=True)
class StockProof:
    """Result of comparing the stock after the original program with the stock after the new one.

    Attributes
    ----------
    cells, cell
        Number of compared cells, and side length of a cell, mm; 0 without a comparison.
    given
        Whether the user described the stock; otherwise it is a block around the cuts.
    flat
        Numbers of the tools that were treated as flat end mills.
    unknown
        Numbers of the tools that were left out because their shape is unknown.
    reason
        Reason why the stocks were not compared, or "".
    """

    cells: int = 0
    cell: float = 0.0
    given: bool = False
    flat: tuple[int, ...] = ()
    unknown: tuple[int, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class AvoidedAreas:
    """New moves across areas that the original program avoided at their height.

    Attributes
    ----------
    moves
        Number of these moves.
    line
        Line of the first of these moves in the new program, or 0.
    below
        Greatest height of sideways rapids and cuts in the original program, mm, if all new moves are lower; otherwise
        None.
    lowest
        Lowest height of these moves, mm, if `below` is known; otherwise None.
    """

    moves: int = 0
    line: int = 0
    below: float | None = None
    lowest: float | None = None

    @property
    def crossings(self) -> Message:
        """The number of these moves as a message; "" without such moves."""
        if not self.moves:
            return Message("")
        if self.moves == 1:
            where = Message("") if self.lowest is None else Message(" at Z{:g}", self.lowest)
            message = Message("1 new move crosses areas{} that the original avoided", where)
        else:
            where = Message("") if self.lowest is None else Message(" at Z{:g} or higher", self.lowest)
            message = Message("{} new moves cross areas{} that the original avoided", self.moves, where)
        return message if self.below is None else Message("{} below Z{:g}", message, self.below)

    @property
    def text(self) -> Message:
        """A message with the number of these moves, the line of the first move, and the remedy."""
        return Message("{}; name clamps with --keep-out (first: line {} of the new program)", self.crossings, self.line)


@dataclass(frozen=True)
class ProgramDetail:
    """Results specific to a reordered program.

    Attributes
    ----------
    certificate
        The proof that the work is unchanged.
    barriers
        Number of groups of fixed blocks, past which no cut or hole may move.
    pieces
        Number of pieces of work (holes, cuts …).
    staying
        Pieces of work that keep their position, grouped by reason.
    pace
        Changes of speeds and heights; None unless requested.
    stock
        Comparison of the stock after both programs; None for a laser or torch.
    """

    certificate: Certificate
    barriers: int = 0
    pieces: int = 0
    staying: tuple[StayGroup, ...] = field(default=())
    pace: PaceChange | None = None
    stock: StockProof | None = None
    shown: ShownStock = field(default_factory=ShownStock)
    avoided: AvoidedAreas = field(default_factory=AvoidedAreas)
