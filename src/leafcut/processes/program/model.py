"""Results specific to reordered programs: the proof, and the work that keeps its place."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.model.certificate import Certificate
from leafcut.model.pace_change import PaceChange
from leafcut.model.sequence import Staying
from leafcut.model.shown_stock import ShownStock


@dataclass(frozen=True)
class StockProof:
    """Comparison of the stock that both programs leave.

    `cells` and `cell` are the number of compared cells and their side, mm; 0 without a comparison. `given`: the user
    described the stock, which otherwise is a block around the cuts. `flat` and `unknown` are tools treated as flat end
    mills, and those left out because their shape is unknown. `reason`: why no stock was compared.
    """

    cells: int = 0
    cell: float = 0.0
    given: bool = False
    flat: tuple[int, ...] = ()
    unknown: tuple[int, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class AvoidedAreas:
    """New moves across areas that the original avoided at their height.

    `line` is that of the first in the new program, or 0. `below` is the greatest height at which the original crosses,
    mm, if all of these moves are lower; None otherwise.
    """

    moves: int = 0
    line: int = 0
    below: float | None = None

    @property
    def crossings(self) -> str:
        """Message with the number of these moves, or ""."""
        if not self.moves:
            return ""
        height = "" if self.below is None else f" below Z{self.below:g}"
        words = f"1 new move{height} crosses" if self.moves == 1 else f"{self.moves} new moves{height} cross"
        return f"{words} areas that the original avoided"

    @property
    def text(self) -> str:
        """Message with the number of moves, the line of the first, and the remedy."""
        return f"{self.crossings}; name clamps with --keep-out (first: line {self.line})"


@dataclass(frozen=True)
class ProgramDetail:
    """A program in a new order.

    `barriers` is the number of parts of the program that stay in place and that no work may pass; `pieces` is the
    number of pieces of work (holes, cuts …), and `staying` has the reasons why some keep their place. `pace` is None
    unless new speeds were requested; `stock` is None for a beam.
    """

    certificate: Certificate
    barriers: int = 0
    pieces: int = 0
    staying: tuple[Staying, ...] = field(default=())
    pace: PaceChange | None = None
    stock: StockProof | None = None
    shown: ShownStock = field(default_factory=ShownStock)
    avoided: AvoidedAreas = field(default_factory=AvoidedAreas)
