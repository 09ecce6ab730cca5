"""`Nest`: which part lies where on which sheet; what nesting comes to, and what sheets are drawn from."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue


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
class Layout:
    """One sheet: what lies where, and how many sheets are cut like this."""

    placements: tuple[Placement, ...]
    count: int = 1


@dataclass(frozen=True)
class Nest:
    """All parts on sheets, in one of several ways.

    Attributes
    ----------
    length, width
        Of one sheet, which lies from (0, 0) to (length, width), mm.
    unplaced
        How many of each part found no room; as many numbers as there are parts.
    method, seed
        How it was made: ``shapes`` or ``rectangles``, and the start of the random numbers.
    repeatable
        False where the clock ended the search: the same seed may give another nest.
    """

    parts: tuple[NestPart, ...]
    length: float
    width: float
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

    @property
    def utilisation(self) -> float:
        """Share of the sheets that ends in parts, 0 … 1."""
        return self.area / (self.n_sheets * self.length * self.width) if self.layouts else 0.0

    @cached_property
    def used_length(self) -> float:
        """How far the parts of the last sheet reach along it, mm; the rest can be cut off and kept."""
        if not self.layouts:
            return 0.0
        edges = [p.placed(self.parts[p.part].outline).extents[2] for p in self.layouts[-1].placements]
        return max(edges, default=0.0)

    @property
    def utilisation_of_used(self) -> float:
        """Share that ends in parts when the rest of the last sheet is kept, 0 … 1."""
        used = self.width * ((self.n_sheets - 1) * self.length + self.used_length)
        return self.area / used if used > 0.0 else 0.0

    @property
    def rank(self) -> tuple[float, float]:
        """What makes a nest better than another, the lower the better: area of the parts left over, sheet used (mm)."""
        left = sum(part.area * count for part, count in zip(self.parts, self.unplaced, strict=True))
        return (left, (self.n_sheets - 1) * self.length + self.used_length if self.layouts else math.inf)

    def contours(self, layout: Layout) -> Iterator[Contour]:
        """Yield every contour of a sheet where it lies; those of one part have one number, from 1."""
        for number, placement in enumerate(layout.placements, 1):
            for contour in self.parts[placement.part].contours:
                yield Contour(placement.placed(contour.path), contour.kind, contour.layer, contour.handle, number)


@dataclass(frozen=True)
class NestOutcome:
    """What nesting found: the variants, the best first, and where they were written.

    Attributes
    ----------
    spacing, margin
        What the nests were checked for: between two parts, and to the edge of the sheet, mm.
    dropped
        One line for every variant that failed its check.
    files
        For every variant the files written, one per layout; empty where nothing was.
    """

    nests: tuple[Nest, ...]
    spacing: float
    margin: float
    dropped: tuple[str, ...] = ()
    files: tuple[tuple[str, ...], ...] = ()
    issues: tuple[Issue, ...] = ()
    seconds: float = 0.0
