"""`Sheet`: contours made ready for cutting, with what lies in what."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue


@dataclass(frozen=True)
class SheetContour:
    """A cleaned contour and where it lies.

    Attributes
    ----------
    contour
        Closed ones run counter-clockwise.
    depth
        0 for the outline of a part, 1 for a hole in it, 2 for a part inside a hole …; of a mark, the depth of the
        closed contour round it.
    parent
        Index of the closed contour directly around it, -1 for none.
    part
        From 1: an outline of even depth with its holes and marks.
    """

    contour: Contour
    depth: int = 0
    parent: int = -1
    part: int = 0


@dataclass(frozen=True)
class Sheet:
    """A nested sheet: its contours, its own outline where it is known, and rectangles that nothing may touch."""

    name: str
    contours: tuple[SheetContour, ...] = ()
    outline: Polyline | None = None
    zones: tuple[tuple[float, float, float, float], ...] = ()
    issues: tuple[Issue, ...] = ()
