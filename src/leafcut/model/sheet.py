"""`Sheet`: the cleaned and nested contours of a drawing, from which cuts are planned."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue


@dataclass(frozen=True)
class Sheet:
    """All contours to cut or mark on one sheet, in file order, mm.

    Attributes
    ----------
    outline
        Edge of the sheet, closed and counter-clockwise; None if unknown.
    zones
        Rectangles (x0, y0, x1, y1) that the torch must avoid, such as clamps.
    holes
        Closed outlines of openings from earlier cuts.
    """

    name: str
    contours: tuple[Contour, ...] = ()
    outline: Polyline | None = None
    zones: tuple[tuple[float, float, float, float], ...] = ()
    issues: tuple[Issue, ...] = ()
    holes: tuple[Polyline, ...] = ()
    price: float = 0.0

    @property
    def paths(self) -> tuple[Polyline, ...]:
        """The edge of the sheet, followed by its holes. Empty if the edge is unknown."""
        return () if self.outline is None else (self.outline, *self.holes)

    @property
    def area(self) -> float:
        """Area of the sheet without its openings, mm²; 0 if the edge is unknown."""
        return sum(abs(path.area) * (-1.0 if k else 1.0) for k, path in enumerate(self.paths))

    @property
    def n_parts(self) -> int:
        """Number of parts. A part is a closed outline of even depth."""
        return sum(c.depth % 2 == 0 and c.path.closed and c.kind == "cut" for c in self.contours)
