"""`Sheet`: cleaned contours of a drawing and their nesting, the input for planning cuts."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue


@dataclass(frozen=True)
class SheetContour:
    """One contour and its nesting.

    Attributes
    ----------
    contour
        Cleaned: no zero-length segments, a closed one counter-clockwise. Kind ``cut`` or ``mark``.
    depth
        Number of closed cut contours around it: 0 is the outline of a part, 1 a hole in it, 2 a part inside that hole,
        and so on. For a mark or an open cut: the depth of the closed contour directly around it, 0 for none. For a
        chamber: one more than for its outline.
    parent
        Index in `Sheet.contours` of the closed cut contour directly around it, -1 for none.
    part
        Number of its part, from 1, shared by an outline of even depth with its holes, its marks and its open cuts; 0
        outside of parts.
    chamber
        True: inside of a notch whose mouth the kerf closes. It is cut like a hole, but lies outside of its outline.
    """

    contour: Contour
    depth: int = 0
    parent: int = -1
    part: int = 0
    chamber: bool = False

    @property
    def is_hole(self) -> bool:
        """Whether it is a closed cut with the part on its outside."""
        return self.depth % 2 == 1 and self.contour.path.closed and self.contour.kind == "cut"


@dataclass(frozen=True)
class Sheet:
    """All contours to cut or mark on one sheet, in file order, mm.

    Attributes
    ----------
    outline
        Edge of the sheet itself, closed, counter-clockwise; None if unknown.
    zones
        Rectangles (x0, y0, x1, y1) that the torch must avoid: clamps.
    holes
        Closed openings from earlier cuts, without metal.
    price
        Price of the sheet, if its drawing states it.
    """

    name: str
    contours: tuple[SheetContour, ...] = ()
    outline: Polyline | None = None
    zones: tuple[tuple[float, float, float, float], ...] = ()
    issues: tuple[Issue, ...] = ()
    holes: tuple[Polyline, ...] = ()
    price: float = 0.0

    @property
    def paths(self) -> tuple[Polyline, ...]:
        """The edge of the sheet and its holes; empty if unknown."""
        return () if self.outline is None else (self.outline, *self.holes)

    @property
    def n_parts(self) -> int:
        """Number of parts: closed outlines of even depth."""
        return sum(c.depth % 2 == 0 and c.contour.path.closed and c.contour.kind == "cut" for c in self.contours)
