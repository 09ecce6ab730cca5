"""Pack pieces on a sheet that is not a rectangle, such as a remnant."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Sequence
from functools import cache

import shapely
from shapely.geometry.base import BaseGeometry

from leafcut.model.nest import Stock
from leafcut.nesting.plan.pieces import CHORD, NestPiece
from leafcut.nesting.plan.positions import FREE_ANGLES, SLACK, buffer_distance, find_position
from leafcut.nesting.plan.rectangles import PlacedPiece

#: Mitre limit at corners of enlarged or shrunk regions, relative to the distance by which they change.
_MITRE = 2.0
#: Free regions smaller than this are not used, mm².
_MIN_AREA = 1.0


class RemnantPacker:
    """Packs the largest pieces first, each as far to the left as possible.

    Parameters
    ----------
    margin, spacing
        Distance from every edge, and distance between two pieces, mm.
    seconds, end
        Time limit per sheet, s, and time at which all packing ends (`time.monotonic`). The pieces that were placed
        before remain on the sheet.
    """

    #: Total area of the pieces that are offered for a sheet, relative to the area of the sheet.
    offered = 1.3

    def __init__(
        self,
        pieces: Sequence[NestPiece],
        stock: Stock,
        margin: float,
        spacing: float,
        *,
        seconds: float = math.inf,
        end: float = math.inf,
    ) -> None:

        self.pieces, self.seconds, self.end = pieces, seconds, end
        self.repeatable = True
        self._filled: dict[tuple[tuple[int, int], ...], list[PlacedPiece]] = {}
        self.clear = buffer_distance(spacing)
        outline, *holes = (path.flattened(CHORD) for path in stock.paths)
        round_edge = any(path.bulges.any() for path in stock.paths)
        sheet = shapely.Polygon(outline, holes)
        inset = margin + (SLACK if round_edge or any(piece.chord_allowance for piece in pieces) else 0.0)
        self.inner: BaseGeometry = sheet.buffer(-inset, join_style="mitre", mitre_limit=_MITRE)
        self._cached_has_room = cache(self._has_room)

    def fits_on_empty_sheet(self, piece: int) -> bool:
        """Return whether a piece fits on an empty sheet."""
        return self._cached_has_room(piece)

    def required_area(self, piece: int) -> float:
        """Return the area that a piece requires, mm²."""
        return self.pieces[piece].area

    @property
    def sheet_area(self) -> float:
        """Area of a sheet without its margin, mm²."""
        return float(self.inner.area)

    def fill(self, offered: Counter[int], last: bool) -> list[PlacedPiece]:
        """Fill the sheet with some of the offered pieces.

        Return the pieces that fit, with their positions. Results are cached.
        """
        key = tuple(sorted((+offered).items()))
        if key not in self._filled:
            self._filled[key] = self._fill_uncached(offered)
        return self._filled[key]

    def _fill_uncached(self, offered: Counter[int]) -> list[PlacedPiece]:
        end = min(self.end, time.monotonic() + self.seconds)
        placed: list[PlacedPiece] = []
        free_area = self.inner
        for number in sorted(+offered, key=lambda p: (-self.pieces[p].area, p)):
            piece = self.pieces[number]
            for _ in range(offered[number]):
                if time.monotonic() >= end:
                    self.repeatable = False
                    return placed
                position = (
                    find_position(piece, free_area, self._allowed_angles(number))
                    if piece.area <= free_area.area
                    else None
                )
                if position is None:
                    break
                angle, x, y, polygon = position
                placed.append(PlacedPiece(number, angle, x, y))
                free_area = free_area.difference(polygon.buffer(self.clear, join_style="mitre", mitre_limit=_MITRE))
                regions = [region for region in shapely.get_parts(free_area) if region.area > _MIN_AREA]
                free_area = shapely.union_all(regions) if regions else shapely.Polygon()
        return placed

    def _has_room(self, number: int) -> bool:
        return find_position(self.pieces[number], self.inner, self._allowed_angles(number)) is not None

    def _allowed_angles(self, number: int) -> Sequence[float]:
        angles = self.pieces[number].angles
        return FREE_ANGLES if angles is None else angles
