"""`Nest`: which part lies where on which sheet; what nesting comes to, and what sheets are drawn from."""

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
    """A part to be made, and how often.

    Attributes
    ----------
    contours
        Its closed outline first, then its holes and marks, mm, where the drawing has them.
    rotations
        The angles in which it may lie, rad counter-clockwise from the drawing; None for any.
    """

    name: str
    contours: tuple[Contour, ...]
    quantity: int = 1
    rotations: tuple[float, ...] | None = (0.0,)

    @property
    def label(self) -> str:
        """Its name as drawings hold it: what can be printed, at most 40 characters (DXF: 255, up to six for one)."""
        return "".join(c if c.isprintable() and c != "\\" and c <= "\uffff" else "?" for c in self.name).strip()[:40]

    @property
    def outline(self) -> Polyline:
        """Its outer edge."""
        return self.contours[0].path

    @property
    def holes(self) -> tuple[Polyline, ...]:
        """The closed paths that are cut out of it."""
        return tuple(c.path for c in self.contours[1:] if c.kind == "cut" and c.path.closed)

    @cached_property
    def area(self) -> float:
        """What it weighs in sheet: the area of its outline less its holes, mm²."""
        return abs(self.outline.area) - sum(abs(hole.area) for hole in self.holes)


@dataclass(frozen=True, slots=True)
class Placement:
    """One part on a sheet: turned by `angle` (rad) about the drawing's origin, then moved by (x, y) mm."""

    part: int
    angle: float
    x: float
    y: float

    def placed(self, path: Polyline) -> Polyline:
        """Return a path of the part where it lies on the sheet."""
        return (path.turned(self.angle) if self.angle else path).moved(self.x, self.y)


@dataclass(frozen=True)
class Stock:
    """A kind of sheet: a rectangle from (0, 0) to (length, width) in mm, or what of one remains.

    Attributes
    ----------
    count
        How many there are; None for as many as it takes.
    price
        Of one sheet; None where nobody has said.
    edge
        Of a remnant its outline and the holes in it; empty for a rectangle.
    name
        What it is called: ``3000x1500``, or the name of the remnant's drawing.
    """

    length: float
    width: float
    count: int | None = None
    price: float | None = None
    edge: tuple[Polyline, ...] = ()
    name: str = ""

    @property
    def paths(self) -> tuple[Polyline, ...]:
        """Its outline, then its holes."""
        corners = [(0.0, 0.0), (self.length, 0.0), (self.length, self.width), (0.0, self.width)]
        return self.edge or (Polyline.of_points(corners, closed=True),)

    @cached_property
    def area(self) -> float:
        """Of its outline less its holes, mm²."""
        outline, *holes = self.paths
        return abs(outline.area) - sum(abs(hole.area) for hole in holes)

    @property
    def label(self) -> str:
        """Its name with its price, as drawings hold it: ``3000x1500@180``."""
        return self.name + ("" if self.price is None else f"@{self.price:.12g}")


def sheet_costs(stocks: Sequence[Stock]) -> list[float]:
    """Return what a sheet of each kind costs: its price where sheets have any, else its area in mm².

    A remnant without a price costs nothing beside sheets that are to be bought: those with a price, or of a size.
    """
    if any(stock.price is not None for stock in stocks):
        return [stock.price or 0.0 for stock in stocks]
    bought = any(not stock.edge for stock in stocks)
    return [0.0 if bought and stock.edge else stock.area for stock in stocks]


@dataclass(frozen=True)
class Layout:
    """One sheet: what lies where, how many sheets are cut like this, and of which stock (its index in the nest)."""

    placements: tuple[Placement, ...]
    count: int = 1
    stock: int = 0


@dataclass(frozen=True)
class Nest:
    """All parts on sheets, in one of several ways.

    Attributes
    ----------
    stocks
        The kinds of sheet that were at hand.
    unplaced
        How many of each part found no room; as many numbers as there are parts.
    method, seed
        How it was made: ``shapes`` or ``rectangles``, and the start of the random numbers.
    repeatable
        False where the clock ended the search: the same seed may give another nest.
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
        """Number of sheets, like ones counted each."""
        return sum(layout.count for layout in self.layouts)

    @property
    def n_placed(self) -> int:
        """Number of parts that are placed."""
        return sum(layout.count * len(layout.placements) for layout in self.layouts)

    @cached_property
    def area(self) -> float:
        """Area of the placed parts without their holes, mm²."""
        return sum(layout.count * self.parts[p.part].area for layout in self.layouts for p in layout.placements)

    def stock_of(self, layout: Layout) -> Stock:
        """Return the kind of sheet that a layout lies on."""
        return self.stocks[layout.stock]

    @property
    def priced(self) -> bool:
        """True: sheets have prices, and the least cost is sought; else the least area."""
        return any(stock.price is not None for stock in self.stocks)

    @property
    def cost(self) -> float | None:
        """What the sheets cost together; None where they have no prices."""
        return self._cost if self.priced else None

    @property
    def _cost(self) -> float:
        costs = sheet_costs(self.stocks)
        return sum(layout.count * costs[layout.stock] for layout in self.layouts)

    @cached_property
    def sheet_area(self) -> float:
        """Area of all sheets, mm²."""
        return sum(layout.count * self.stock_of(layout).area for layout in self.layouts)

    @property
    def utilisation(self) -> float:
        """Share of the sheets that ends in parts, 0 … 1."""
        return self.area / self.sheet_area if self.layouts else 0.0

    @cached_property
    def used_length(self) -> float:
        """How far the parts of the last sheet reach along it, mm; the rest can be cut off and kept."""
        if not self.layouts:
            return 0.0
        edges = [p.placed(self.parts[p.part].outline).extents[2] for p in self.layouts[-1].placements]
        return max(edges, default=0.0)

    @property
    def utilisation_of_used(self) -> float:
        """Share that ends in parts when the rest of the last sheet, where that is a rectangle, is kept, 0 … 1."""
        if not self.layouts:
            return 0.0
        last = self.stock_of(self.layouts[-1])
        kept = 0.0 if last.edge else last.width * (last.length - self.used_length)
        return self.area / (self.sheet_area - kept) if self.area > 0.0 else 0.0

    @property
    def rank(self) -> tuple[float, float, float]:
        """What makes a nest better than another, the lower the better.

        Area of the parts left over; what the sheets cost, or their area; how much of the last is used (mm).
        """
        left = sum(part.area * count for part, count in zip(self.parts, self.unplaced, strict=True))
        return (left, self._cost, self.used_length) if self.layouts else (left, math.inf, 0.0)

    def contours(self, layout: Layout) -> Iterator[Contour]:
        """Yield every contour of a sheet where it lies; those of one part have one number, from 1."""
        for number, placement in enumerate(layout.placements, 1):
            for contour in self.parts[placement.part].contours:
                yield Contour(placement.placed(contour.path), contour.kind, contour.layer, contour.handle, number)


@dataclass(frozen=True)
class Remnant:
    """What remains of sheets and is worth keeping: its drawing, how many there are, and itself."""

    file: str
    count: int
    stock: Stock


@dataclass(frozen=True)
class NestOutcome:
    """What nesting found: the variants, the best first, their drawings, and where these were written.

    Attributes
    ----------
    spacing, margin
        What the nests were checked for: between two parts, and to the edge of the sheet, mm.
    dropped
        One line for every variant that failed its check.
    drawings
        For every variant that is drawn, the best one or all, the text of each of its sheets, DXF, one per layout.
    files
        The files that they were written to; empty where nothing was.
    remnants
        What remains of the sheets of the best one, where that was asked for.
    defaults
        Which of the options that were used are of the person's own defaults, as one types them.
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
        """The issues of parts and lines that lie on no sheet."""
        return missing_work(self.issues)

    def names(self, output: str | Path, *, all_variants: bool) -> tuple[tuple[str, ...], ...]:
        """Return the names of the files of the drawings of the best variant, or of all, where `output` is asked for.

        Several sheets are numbered, ``sheet_1.dxf``, and so are variants where all are drawn: ``sheet_v1_1.dxf``.
        """
        output, found = Path(output), []
        for number, one in enumerate(self.nests if all_variants else self.nests[:1], 1):
            stem = output.stem + (f"_v{number}" if all_variants else "")
            ends = [f"_{k}" for k in range(1, len(one.layouts) + 1)] if len(one.layouts) > 1 else [""]
            found.append(tuple(str(output.with_name(f"{stem}{end}.dxf")) for end in ends))
        return tuple(found)
