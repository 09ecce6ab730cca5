"""Pack pieces by their bounding boxes. This is fast, and it is the best method for rectangles."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from leafcut.nesting.plan.pieces import Box, NestPiece
from leafcut.nesting.plan.strip import require_package

#: Packing algorithms and sort orders of `rectpack`. These are the pairs that filled sheets best.
RULES = (
    ("MaxRectsBssf", "SORT_AREA"),
    ("MaxRectsBssf", "SORT_LSIDE"),
    ("MaxRectsBssf", "SORT_SSIDE"),
    ("MaxRectsBaf", "SORT_AREA"),
    ("MaxRectsBl", "SORT_SSIDE"),
    ("MaxRectsBl", "SORT_LSIDE"),
    ("SkylineMwfl", "SORT_LSIDE"),
    ("GuillotineBssfSas", "SORT_LSIDE"),
)
#: Number of bisection steps that shorten the used length of the last sheet.
HALVINGS = 10
#: Micrometres per mm. The packer works with whole µm, so that sums have no rounding errors.
MICRON = 1000.0


@dataclass(frozen=True)
class PlacedPiece:
    """The position of a piece on a sheet.

    The piece, given by its index, is first rotated by `angle`, rad, about the origin of the drawing, and then moved by
    (x, y), mm.
    """

    piece: int
    angle: float
    x: float
    y: float


@dataclass(frozen=True)
class Cell:
    """The space that a piece requires.

    It contains the bounding box, the box after a rotation by 90° (None if not allowed), and the sides in µm.
    """

    box: Box
    turned: Box | None
    width: int
    height: int


class RectanglePacker:
    """Packs the bounding boxes of pieces, one sheet after another.

    Parameters
    ----------
    length, width
        Sides of the sheet without its margins, mm.
    rule
        Index of the packing algorithm in `RULES`.
    """

    #: Total area of the pieces that are offered for a sheet, relative to the area of the sheet.
    offered = 1.3
    repeatable = True

    def __init__(
        self, pieces: Sequence[NestPiece], length: float, width: float, margin: float, spacing: float, rule: int
    ) -> None:
        require_package("rectpack")
        self.pieces, self.inner = pieces, (length, width)
        self.slack = 2.0 * max(piece.chord_allowance for piece in pieces)
        self.cells = [_packing_cell(piece, spacing + self.slack) for piece in pieces]
        self.rotation = all(cell.turned is not None for cell in self.cells)
        self.length = _floor_to_microns(length + spacing + self.slack)
        self.width = _floor_to_microns(width + spacing + self.slack)
        self.corner = margin
        self.rule = RULES[rule]

    def fits_on_empty_sheet(self, piece: int) -> bool:
        """Return whether a piece fits on an empty sheet."""
        return self.pieces[piece].fits(*self.inner)

    def required_area(self, piece: int) -> float:
        """Return the area that a piece requires, mm²."""
        return self.cells[piece].width * self.cells[piece].height / MICRON**2

    @property
    def sheet_area(self) -> float:
        """Area of a sheet, mm²."""
        return self.length * self.width / MICRON**2

    def fill(self, offered: Counter[int], last: bool) -> list[PlacedPiece]:
        """Fill one sheet with some of the offered pieces. Return the pieces that fit, with their positions.

        If `last` is true, this is the last sheet, so the pieces are packed as far to the left as possible.
        """
        best = self._pack(offered, self.length)
        if last and len(best) == offered.total():
            low, high = 0, self.length
            for _ in range(HALVINGS):
                middle = (low + high) // 2
                packed = self._pack(offered, middle)
                low, high, best = (low, middle, packed) if len(packed) == len(best) else (middle, high, best)
        return best

    def _pack(self, offered: Counter[int], length: int) -> list[PlacedPiece]:
        import rectpack

        algorithm, sort = (getattr(rectpack, name) for name in self.rule)
        packer: Any = rectpack.newPacker(pack_algo=algorithm, sort_algo=sort, rotation=self.rotation)
        packer.add_bin(max(length, 1), self.width)
        for number in sorted(offered):
            cell = self.cells[number]
            for _ in range(offered[number]):
                packer.add_rect(cell.width, cell.height, number)
        packer.pack()
        return [self._placed_piece(*rectangle[1:]) for rectangle in packer.rect_list()]

    def _placed_piece(self, x: int, y: int, width: int, height: int, number: int) -> PlacedPiece:
        cell = self.cells[number]
        across = (width, height) != (cell.width, cell.height)
        box = cell.turned if across and cell.turned is not None else cell.box
        return PlacedPiece(number, box.angle, self.corner + x / MICRON - box.x, self.corner + y / MICRON - box.y)


def _packing_cell(piece: NestPiece, spacing: float) -> Cell:
    box = min(piece.boxes, key=lambda b: (b.width * b.height, b.angle))
    turned = next((b for b in piece.boxes if _fits_when_turned(box, b)), None)
    return Cell(box, turned, _ceil_to_microns(box.width + spacing), _ceil_to_microns(box.height + spacing))


def _fits_when_turned(a: Box, b: Box) -> bool:
    return b.width <= a.height + 1e-6 and b.height <= a.width + 1e-6


def _ceil_to_microns(mm: float) -> int:
    return math.ceil(mm * MICRON - 1e-3)


def _floor_to_microns(mm: float) -> int:
    return math.floor(mm * MICRON + 1e-3)
