"""Fill one sheet after another until all pieces are placed or no sheets are left."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from leafcut.model.nest import Layout, Nest, NestPart, Stock
from leafcut.nesting.options import NestOptions
from leafcut.nesting.plan.pieces import SIDE_TOLERANCE, NestPiece, select_by_area
from leafcut.nesting.plan.rectangles import PlacedPiece

#: Minimum distance between two parts, mm.
TOUCHING = 0.1

#: The kinds of sheet in the order in which they are filled. Each entry has the index of the kind, and the maximum
#: number of sheets.
FillPlan = tuple[tuple[int, float], ...]


class Packer(Protocol):
    """Packs pieces on sheets of a single kind.

    Attributes
    ----------
    offered
        Total area of the pieces that are offered for a sheet, relative to the area of the sheet.
    repeatable
        Whether another run would give the same result. This is no longer true once a time limit has ended the packing
        of a sheet.
    """

    offered: float
    repeatable: bool

    def fits_on_empty_sheet(self, piece: int) -> bool:
        """Return whether a piece fits on an empty sheet."""

    def required_area(self, piece: int) -> float:
        """Return the area that a piece requires, mm²."""

    @property
    def sheet_area(self) -> float:
        """Area of a sheet, mm²."""

    def fill(self, offered: Counter[int], last: bool) -> list[PlacedPiece]:
        """Fill one sheet with some of the offered pieces. Return the pieces that fit, with their positions.

        If `last` is true, this is the last sheet, so the pieces are packed as far to the left as possible.
        """


@dataclass(frozen=True)
class NestTask:
    """A nesting task: the parts, the pieces that contain them, the quantity of each piece, and the kinds of sheet.

    `kerf` is in mm. `remnants` maps the index of each non-rectangular kind of sheet to its packer.
    """

    parts: tuple[NestPart, ...]
    pieces: tuple[NestPiece, ...]
    counts: tuple[int, ...]
    stocks: tuple[Stock, ...]
    options: NestOptions
    kerf: float
    remnants: Mapping[int, Packer] = field(default_factory=dict)

    def usable_size(self, stock: int) -> tuple[float, float]:
        """Return the length and width of a sheet without its margins, mm.

        If it is not a rectangle, its bounding box is used.
        """
        sheet = self.stocks[stock]
        return sheet.length - 2.0 * self.options.margin, sheet.width - 2.0 * self.options.margin

    @property
    def available_sheets(self) -> list[float]:
        """Number of available sheets of each kind."""
        return [math.inf if stock.count is None else float(stock.count) for stock in self.stocks]

    @property
    def max_sheets(self) -> float:
        """Total number of available sheets."""
        return sum(self.available_sheets)

    @property
    def spacing(self) -> float:
        """Distance between two parts, mm.

        It is at least `TOUCHING`. If two parts touched, their edges would be read as a single edge.
        """
        return max(self.kerf + self.options.gap, TOUCHING)


class Filling:
    """A nest in progress: the sheets filled so far, and the pieces that are left."""

    def __init__(self, task: NestTask, packers: Sequence[Packer]) -> None:
        self.task, self.packers = task, packers
        self.left = Counter(dict(enumerate(task.counts)))
        self.layouts: list[Layout] = []
        self.n_sheets = 0

    def fill_sheet(self, stock: int, later: Sequence[int]) -> list[PlacedPiece]:
        """Fill the next sheet and return the pieces on it.

        `stock` is the kind of this sheet, and `later` lists the kinds of the sheets that follow.
        """
        packer = self.packers[stock]
        offered = self._pieces_to_offer(packer, later)
        return packer.fill(offered, last=offered == self.left) or self._place_largest_piece(stock)

    def add_sheets(self, stock: int, placed: Sequence[PlacedPiece], limit: float) -> int:
        """Add copies of a sheet as long as enough pieces remain, but at most `limit` copies.

        Return the number of sheets that were added.
        """
        pieces = self.task.pieces
        used = Counter(piece.piece for piece in placed)
        count = int(min(limit, *(self.left[piece] // number for piece, number in used.items())))
        placements = [
            p
            for placed_piece in placed
            for p in pieces[placed_piece.piece].placements(placed_piece.angle, placed_piece.x, placed_piece.y)
        ]
        self.layouts.append(Layout(tuple(placements), count, stock))
        self.left -= Counter({piece: number * count for piece, number in used.items()})
        self.n_sheets += count
        return count

    def as_nest(self, method: str, seed: int) -> Nest:
        """Return the nest with all sheets filled so far."""
        missing = Counter[int]()
        for piece, count in self.left.items():
            for member in self.task.pieces[piece].members:
                missing[member.part] += count
        unplaced = tuple(missing[number] for number in range(len(self.task.parts)))
        repeatable = all(packer.repeatable for packer in self.packers)
        return Nest(self.task.parts, self.task.stocks, tuple(self.layouts), unplaced, method, seed, repeatable)

    def _pieces_to_offer(self, packer: Packer, later: Sequence[int]) -> Counter[int]:
        """Select slightly more pieces than a sheet can hold.

        Pieces that fit on no later kind of sheet are selected first.
        """
        remaining, area = self.left, packer.offered * packer.sheet_area
        only_here: Counter[int] = Counter()
        if later:
            for piece, count in remaining.items():
                if packer.fits_on_empty_sheet(piece) and not any(
                    self.packers[k].fits_on_empty_sheet(piece) for k in later
                ):
                    only_here[piece] = count
        if not only_here or only_here == remaining:
            return select_by_area(remaining, packer.required_area, area)
        offered = select_by_area(only_here, packer.required_area, area)
        area -= sum(packer.required_area(piece) * count for piece, count in offered.items())
        return offered + (
            select_by_area(remaining - only_here, packer.required_area, area) if area > 0.0 else Counter()
        )

    def _place_largest_piece(self, stock: int) -> list[PlacedPiece]:
        """Place the largest piece that fits into the corner of the sheet.

        This is needed if the packer placed no piece.
        """
        if self.task.stocks[stock].edge:
            return []
        length, width = self.task.usable_size(stock)
        pieces, margin = self.task.pieces, self.task.options.margin
        for piece in sorted(self.left, key=lambda p: (-pieces[p].area, p)):
            for box in pieces[piece].boxes:
                if box.width <= length + SIDE_TOLERANCE and box.height <= width + SIDE_TOLERANCE:
                    return [PlacedPiece(piece, box.angle, margin - box.x, margin - box.y)]
        return []


def fill_sheets(task: NestTask, packers: Sequence[Packer], plan: FillPlan, method: str, seed: int) -> Nest:
    """Fill the sheets of a plan in order, until all pieces are placed or no sheets are left. Return the nest."""
    filling = Filling(task, packers)
    for step, (stock, limit) in enumerate(plan):
        later, count = [k for k, _ in plan[step + 1 :]], 0
        while filling.left.total() and count < limit and (placed := filling.fill_sheet(stock, later)):
            count += filling.add_sheets(stock, placed, limit - count)
    return filling.as_nest(method, seed)
