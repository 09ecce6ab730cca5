"""`Nest`: the placement of parts on sheets, and the results of nesting."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, missing_work


@dataclass(frozen=True)
class NestPart:
    """A part to nest, with its quantity.

    Attributes
    ----------
    contours
        The closed outline, then holes and marks, mm, in drawing coordinates.
    rotations
        Allowed angles, rad, counter-clockwise from the drawing; None if any angle is allowed.
    """

    name: str
    contours: tuple[Contour, ...]
    quantity: int = 1
    rotations: tuple[float, ...] | None = (0.0,)

    @property
    def label(self) -> str:
        """Name for drawings, with at most 40 characters. DXF allows 255, but some characters need six of them."""
        return "".join(c if c.isprintable() and c != "\\" and c <= "\uffff" else "?" for c in self.name).strip()[:40]

    @property
    def outline(self) -> Polyline:
        """The outer edge."""
        return self.contours[0].path

    @property
    def holes(self) -> tuple[Polyline, ...]:
        """The closed paths cut out of the part."""
        return tuple(c.path for c in self.contours[1:] if c.kind == "cut" and c.path.closed)

    @cached_property
    def area(self) -> float:
        """Area of the part without its holes, mm²."""
        return abs(self.outline.area) - sum(abs(hole.area) for hole in self.holes)


@dataclass(frozen=True, slots=True)
class Placement:
    """A part on a sheet. It is rotated about the drawing's origin by `angle` (rad), and then moved by (x, y) mm."""

    part: int
    angle: float
    x: float
    y: float

    def placed(self, path: Polyline) -> Polyline:
        """Convert a path of the part to sheet coordinates."""
        return (path.turned(self.angle) if self.angle else path).moved(self.x, self.y)


@dataclass(frozen=True)
class Stock:
    """A kind of sheet: a rectangle from (0, 0) to (length, width) in mm, or a remnant.

    Attributes
    ----------
    count, price
        Number of sheets, or None if the number is unlimited; price of a sheet, or None if unknown.
    edge
        Outline of a remnant, then the holes in it. Empty for a rectangle.
    name
        ``3000x1500``, or the name of the drawing of a remnant.
    """

    length: float
    width: float
    count: int | None = None
    price: float | None = None
    edge: tuple[Polyline, ...] = ()
    name: str = ""

    @property
    def paths(self) -> tuple[Polyline, ...]:
        """The outline, then the holes."""
        corners = [(0.0, 0.0), (self.length, 0.0), (self.length, self.width), (0.0, self.width)]
        return self.edge or (Polyline.of_points(corners, closed=True),)

    @cached_property
    def area(self) -> float:
        """Area of the sheet without its holes, mm²."""
        outline, *holes = self.paths
        return abs(outline.area) - sum(abs(hole.area) for hole in holes)

    @property
    def label(self) -> str:
        """Name with price, as used in drawings: ``3000x1500@180``."""
        return self.name + ("" if self.price is None else f"@{self.price:.12g}")


def costs_per_sheet(stocks: Sequence[Stock]) -> list[float]:
    """Return the cost of one sheet of each kind.

    If any kind has a price, the cost is the price, otherwise the area in mm². A remnant without a price costs nothing
    if any kind has a price, or if any kind is a new sheet.
    """
    if any(stock.price is not None for stock in stocks):
        return [stock.price or 0.0 for stock in stocks]
    buys_sheets = any(not stock.edge for stock in stocks)
    return [0.0 if buys_sheets and stock.edge else stock.area for stock in stocks]


@dataclass(frozen=True)
class Layout:
    """The placements on a sheet, the number of identical sheets, and the index of their stock in the nest."""

    placements: tuple[Placement, ...]
    count: int = 1
    stock: int = 0


@dataclass(frozen=True)
class Nest:
    """A variant of a nest, with all parts placed on sheets.

    Attributes
    ----------
    method, seed
        ``shapes`` or ``rectangles``, and the seed of the random numbers.
    unplaced
        Number of unplaced pieces of each part.
    repeatable
        False if the time limit ended the search. The same seed may then give a different nest.
    """

    parts: tuple[NestPart, ...]
    stocks: tuple[Stock, ...]
    layouts: tuple[Layout, ...]
    unplaced: tuple[int, ...]
    method: str = "shapes"
    seed: int = 0
    repeatable: bool = True

    @property
    def n_sheets(self) -> int:
        """Total number of sheets."""
        return sum(layout.count for layout in self.layouts)

    @property
    def n_placed(self) -> int:
        """Number of placed parts."""
        return sum(layout.count * len(layout.placements) for layout in self.layouts)

    @cached_property
    def area(self) -> float:
        """Area of the placed parts without their holes, mm²."""
        return sum(layout.count * self.parts[p.part].area for layout in self.layouts for p in layout.placements)

    def stock_of(self, layout: Layout) -> Stock:
        """Return the kind of sheet that a layout uses."""
        return self.stocks[layout.stock]

    @property
    def priced(self) -> bool:
        """Whether sheets have prices. If so, nesting minimizes the cost instead of the area."""
        return any(stock.price is not None for stock in self.stocks)

    @property
    def cost(self) -> float | None:
        """Total cost of the sheets, or None if sheets have no prices."""
        return self._cost if self.priced else None

    @property
    def _cost(self) -> float:
        costs = costs_per_sheet(self.stocks)
        return sum(layout.count * costs[layout.stock] for layout in self.layouts)

    @cached_property
    def sheet_area(self) -> float:
        """Area of all sheets, mm²."""
        return sum(layout.count * self.stock_of(layout).area for layout in self.layouts)

    @property
    def utilisation(self) -> float:
        """Share of the sheet area that the parts use, 0 to 1."""
        return self.area / self.sheet_area if self.layouts else 0.0

    @cached_property
    def used_length(self) -> float:
        """Extent of the parts along the last sheet, mm. The shop can cut off and keep the remaining length."""
        if not self.layouts:
            return 0.0
        edges = [p.placed(self.parts[p.part].outline).extents[2] for p in self.layouts[-1].placements]
        return max(edges, default=0.0)

    @property
    def utilisation_of_used(self) -> float:
        """Utilisation of the sheets, 0 to 1, if the shop keeps the rectangular remainder of the last sheet."""
        if not self.layouts:
            return 0.0
        last = self.stock_of(self.layouts[-1])
        kept = 0.0 if last.edge else last.width * (last.length - self.used_length)
        return self.area / (self.sheet_area - kept) if self.area > 0.0 else 0.0

    @property
    def rank(self) -> tuple[float, float, float]:
        """Sort key that puts the best nest first.

        It compares the area of the unplaced parts, then the cost or area of the sheets, and then the used length of the
        last sheet.
        """
        left = sum(part.area * count for part, count in zip(self.parts, self.unplaced, strict=True))
        return (left, self._cost, self.used_length) if self.layouts else (left, math.inf, 0.0)

    def contours(self, layout: Layout) -> Iterator[Contour]:
        """Yield every contour of a sheet in its position. All contours of a part share its number, from 1."""
        for number, placement in enumerate(layout.placements, 1):
            for contour in self.parts[placement.part].contours:
                yield Contour(placement.placed(contour.path), contour.kind, contour.layer, contour.handle, number)


@dataclass(frozen=True)
class Remnant:
    """A remnant that is worth keeping, and the file that contains its drawing."""

    file: str
    count: int
    stock: Stock


@dataclass(frozen=True)
class NestOutcome:
    """Result of nesting: the variants, starting with the best, and their drawings and files.

    Attributes
    ----------
    spacing, margin
        Distances that were checked: between two parts, and between a part and the edge of the sheet, mm.
    dropped
        A line for every variant that failed its check.
    drawings
        For every variant with drawings, starting with the best, the DXF text of each sheet. Each layout has a drawing.
    defaults
        Options that came from the user's own defaults, as typed.
    """

    nests: tuple[Nest, ...]
    spacing: float
    margin: float
    dropped: tuple[str, ...] = ()
    files: tuple[tuple[str, ...], ...] = ()
    remnants: tuple[Remnant, ...] = ()
    issues: tuple[Issue, ...] = ()
    seconds: float = 0.0
    defaults: tuple[str, ...] = ()
    drawings: tuple[tuple[str, ...], ...] = ()

    @property
    def missing(self) -> tuple[Issue, ...]:
        """Issues about parts and lines that did not fit on a sheet."""
        return missing_work(self.issues)

    def names(self, output: str | Path, variants: int = 1) -> tuple[tuple[str, ...], ...]:
        """Return the file names for the drawings of the best variants. `output` is the name of the first drawing.

        If a variant has several sheets, they are numbered: ``sheet_1.dxf``. The second variant is ``sheet_v2_1.dxf``.
        """
        output, names = Path(output), []
        for number, nest in enumerate(self.nests[:variants], 1):
            stem = output.stem + (f"_v{number}" if number > 1 else "")
            ends = [f"_{k}" for k in range(1, len(nest.layouts) + 1)] if len(nest.layouts) > 1 else [""]
            names.append(tuple(str(output.with_name(f"{stem}{end}.dxf")) for end in ends))
        return tuple(names)
