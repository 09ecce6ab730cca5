"""Pack pieces by their true shapes.

Each sheet is treated as a strip. The shape nester (sparrow) minimises the length of the strip that the pieces use.
"""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from leafcut.nesting.plan.pieces import NestPiece, select_by_area
from leafcut.nesting.plan.rectangles import PlacedPiece
from leafcut.nesting.plan.strip import Strip, StripBudget, StripItem, pack_strip, require_package

#: Allowance for the single precision of the nester, in mm, and relative to the size of the sheet.
ROUNDING, ROUNDING_SHARE = 0.01, 1e-6
#: Tolerance for simplifying an outline, relative to its size; and minimum and maximum tolerance, mm.
COARSE, FINEST, COARSEST = 0.001, 0.02, 0.5
#: An outline with at most this number of points is not simplified. Neither is an outline that would keep more than this
#: share of its points.
FEW_POINTS, KEPT = 16, 0.6
#: Mitre limit at corners of enlarged outlines, relative to the distance.
MITRE = 2.0
#: Maximum number of pieces per search. More pieces would take too long.
MAX_PIECES = 250
#: If a sheet must be packed again with fewer pieces, these shares of the expected capacity are tried.
SHARES = (1.02, 1.0, 0.98)
#: A strip is short enough to end the search if its length is at most this multiple of the lower bound.
PERFECT = 1.001


class ShapePacker:
    """Packs true shapes with the shape nester, one sheet after another.

    Parameters
    ----------
    length, width
        Sides of the sheet without its margins, mm.
    budget
        Function that returns the budget of the next strip.
    shorten
        Whether to shorten the used length of the last sheet. If not, the search ends as soon as all parts are on the
        sheet.
    """

    #: Total area of the pieces that are offered for a sheet, relative to the area of the sheet. Pieces that do not fit
    #: are offered again for the next sheet.
    offered = 1.1

    def __init__(
        self,
        pieces: Sequence[NestPiece],
        length: float,
        width: float,
        margin: float,
        spacing: float,
        seed: int,
        budget: Callable[[], StripBudget],
        cancelled: threading.Event,
        *,
        shorten: bool = True,
    ) -> None:
        require_package("spyrrow")
        self.pieces, self.inner = pieces, (length, width)
        self.length, self.width = length + spacing, width + spacing
        self.corner = margin - 0.5 * spacing
        self.spacing, self.seed = spacing, seed
        self.budget, self.cancelled, self.shorten = budget, cancelled, shorten
        self.repeatable = True
        self.enlarged_outline = cache(self._enlarged_outline)
        self.enlarged_extent = cache(self._enlarged_extent)

    def fits_on_empty_sheet(self, piece: int) -> bool:
        """Return whether a piece fits on an empty sheet."""
        return self.pieces[piece].fits(*self.inner)

    def required_area(self, piece: int) -> float:
        """Return the area that a piece requires, mm². Its outline is enlarged by at least half the spacing."""
        return self.enlarged_outline(piece)[2]

    @property
    def sheet_area(self) -> float:
        """Area of a sheet, mm²."""
        return self.length * self.width

    def fill(self, offered: Counter[int], last: bool) -> list[PlacedPiece]:
        """Fill one sheet with some of the offered pieces. Return the pieces that fit, with their positions.

        If `last` is true, this is the last sheet, so the pieces are packed as far to the left as possible. If there are
        too many pieces for one search, the sheet is divided into equal bands, which are packed separately.
        """
        offered = Counter({p: n for p, n in offered.items() if self._fits(p)})
        bands = math.ceil(offered.total() / MAX_PIECES)
        if bands == 0:
            return []
        band = +Counter({piece: count // bands for piece, count in offered.items()})
        if not band:  # many kinds of piece, but few pieces of each
            band, bands = _limit_total(offered, MAX_PIECES), 1
        band_pieces, width = self._fill_strip(band, self.length / bands, last)
        pitch = width if last else self.length / bands
        result = [_shift_piece(placed, k * pitch) for k in range(bands) for placed in band_pieces]
        if last and (remaining := offered - Counter(placed.piece for placed in result)) and bands > 1:
            extra, _ = self._fill_strip(_limit_total(remaining, MAX_PIECES), self.length - bands * pitch, last)
            result += [_shift_piece(placed, bands * pitch) for placed in extra]
        return result

    def _fill_strip(self, offered: Counter[int], length: float, last: bool) -> tuple[list[PlacedPiece], float]:
        strip = self._pack_strip(offered, 0.0 if last and self.shorten else length)
        if strip.width <= length:
            return self._placed_pieces(strip), strip.width
        best = self._placed_pieces(strip, length)
        density = self._total_area(offered) / (strip.width * self.width)
        for share in SHARES:
            fewer = select_by_area(offered, self.required_area, share * density * length * self.width)
            if self._total_area(fewer) <= sum(self.required_area(placed.piece) for placed in best):
                break
            retry = self._pack_strip(fewer, length)
            if retry.width <= length:
                return self._placed_pieces(retry), retry.width
        return best, length

    def _total_area(self, counts: Counter[int]) -> float:
        return sum(self.required_area(piece) * count for piece, count in counts.items())

    def _pack_strip(self, counts: Counter[int], enough: float) -> Strip:
        order = sorted(piece for piece, count in counts.items() if count > 0)
        items = [StripItem(self.enlarged_outline(p)[0], counts[p], self._allowed_degrees(p)) for p in order]
        shortest = PERFECT * max(self._total_area(counts) / self.width, *(self.enlarged_extent(p)[0] for p in order))
        strip = pack_strip(
            items, self.width, self.seed, self.budget(), enough=max(enough, shortest), cancelled=self.cancelled
        )
        self.repeatable &= strip.ended != "clock"
        placed = tuple((order[i], degrees, x, y) for i, degrees, x, y in strip.items)
        return Strip(strip.width, placed, strip.steps, strip.ended)

    def _fits(self, piece: int) -> bool:
        """Return whether the enlarged outline fits the strip.

        A piece as large as the sheet is placed by `Filling` instead.
        """
        return self.enlarged_extent(piece)[0] < self.length

    def _enlarged_extent(self, piece: int) -> tuple[float, float]:
        """Return the length and width of an enlarged outline at the rotation that needs the shortest strip, mm.

        Both are infinite if the outline is too wide at every allowed rotation.
        """
        points = np.array(self.enlarged_outline(piece)[0])
        angles = np.array([box.angle for box in self.pieces[piece].boxes])
        x = np.outer(np.cos(angles), points[:, 0]) - np.outer(np.sin(angles), points[:, 1])
        y = np.outer(np.sin(angles), points[:, 0]) + np.outer(np.cos(angles), points[:, 1])
        sides = zip(np.ptp(x, axis=1).tolist(), np.ptp(y, axis=1).tolist(), strict=True)
        return min((side for side in sides if side[1] < self.width), default=(math.inf, math.inf))

    def _allowed_degrees(self, piece: int) -> list[float] | None:
        angles = self.pieces[piece].angles
        return None if angles is None else [math.degrees(a) for a in angles]

    def _placed_pieces(self, strip: Strip, length: float = math.inf) -> list[PlacedPiece]:
        """Return the positions on the sheet of all pieces whose enlarged outlines end before `length`, mm."""
        placed = []
        for piece, degrees, x, y in strip.items:
            shape, middle, _ = self.enlarged_outline(piece)
            angle = _nearest_allowed_angle(math.radians(degrees), self.pieces[piece].angles)
            cos, sin = math.cos(angle), math.sin(angle)
            if x + max(cos * px - sin * py for px, py in shape) > length:
                continue
            # The nester rotates each shape about its centre.
            dx, dy = x - cos * middle[0] + sin * middle[1], y - sin * middle[0] - cos * middle[1]
            placed.append(PlacedPiece(piece, angle, self.corner + dx, self.corner + dy))
        return placed

    def _enlarged_outline(self, number: int) -> tuple[list[tuple[float, float]], tuple[float, float], float]:
        """Enlarge the outline of a piece by at least half the spacing. If the outline is simplified, add the tolerance.

        The outline stays exact if simplification would save little. This lets parts lie next to each other if their
        sides add up to the width of the sheet exactly.

        Returns
        -------
        tuple
            The points relative to the centre of the piece, this centre, and the area.
        """
        piece = self.pieces[number]
        x0, y0, x1, y1 = piece.path.extents
        coarse = min(max(COARSE * math.hypot(x1 - x0, y1 - y0), FINEST), COARSEST)
        rounding = max(ROUNDING, ROUNDING_SHARE * max(self.length, self.width))
        points = len(piece.polygon.exterior.coords)
        kept = shapely.count_coordinates(shapely.simplify(piece.polygon, coarse))
        exact = points <= FEW_POINTS or kept > KEPT * points
        grow = 0.5 * self.spacing + piece.chord_allowance + rounding + (0.0 if exact else coarse)
        grown = piece.polygon.buffer(grow, join_style="mitre", mitre_limit=MITRE)
        rough: Any = Polygon(grown.exterior)
        if not exact:
            rough = Polygon(rough.simplify(coarse).exterior)
        middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        corners = [(x - middle[0], y - middle[1]) for x, y in rough.exterior.coords[:-1]]
        return corners, middle, float(rough.area)


def _shift_piece(placed: PlacedPiece, x: float) -> PlacedPiece:
    return PlacedPiece(placed.piece, placed.angle, placed.x + x, placed.y)


def _limit_total(counts: Counter[int], limit: int) -> Counter[int]:
    """Reduce the quantities so that they add up to about `limit`, with the same share of each kind.

    If there are more kinds than the limit, only the first `limit` kinds remain.
    """
    if counts.total() <= limit:
        return counts
    share = limit / counts.total()
    kept = {piece: max(int(share * count), 1) for piece, count in sorted(counts.items())[:limit]}
    return Counter(kept)


def _nearest_allowed_angle(angle: float, angles: tuple[float, ...] | None) -> float:
    if angles is None:
        return angle % math.tau
    return min(angles, key=lambda a: abs((a - angle + math.pi) % math.tau - math.pi))
