"""Results that only a reordered program has: the proof, and the tasks that keep their position."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.message import Message
from leafcut.model.certificate import Certificate
from leafcut.model.pace_change import PaceChange
from leafcut.model.sequence import StayGroup
from leafcut.model.shown_stock import ShownStock


@dataclass(frozen=True)
class StockProof:
    """Compares the stock that the original program leaves with the stock that the new program leaves.

    Attributes
    ----------
    cells, cell
        Number of compared cells and their side length, mm; 0 if the stocks were not compared.
    given
        Whether the user described the stock. Otherwise, it is a block around the cuts.
    flat
        Numbers of the tools that were treated as flat end mills.
    unknown
        Numbers of the tools that were skipped because their shape is unknown.
    reason
        Why the stocks were not compared, or "".
    """

    cells: int = 0
    cell: float = 0.0
    given: bool = False
    flat: tuple[int, ...] = ()
    unknown: tuple[int, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class AvoidedAreas:
    """New moves across areas that the original program avoided at this height.

    Attributes
    ----------
    moves
        Number of these moves.
    line
        Line number of the first such move in the new program, or 0.
    below
        Greatest height of sideways rapids and cuts in the original program, mm. None unless all new moves are lower.
    lowest
        Lowest height of the new moves, mm. None if `below` is None.
    """

    moves: int = 0
    line: int = 0
    below: float | None = None
    lowest: float | None = None

    @property
    def crossings(self) -> Message:
        """The number of new moves as a message, or "" if there are none."""
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
        """A message that states the number of new moves, the line of the first move, and the remedy."""
        return Message("{}; name clamps with --keep-out (first: line {} of the new program)", self.crossings, self.line)


@dataclass(frozen=True)
class ProgramDetail:
    """Results that only a reordered program has.

    Attributes
    ----------
    certificate
        The proof that the new program does the same work.
    barriers
        Number of groups of fixed blocks. No cut or hole may move past them.
    pieces
        Number of tasks (holes, cuts …).
    staying
        Tasks that keep their position, grouped by reason.
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
