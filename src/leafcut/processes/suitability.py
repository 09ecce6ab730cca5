"""How well a drawing suits a kind of work: what all of the drawing has, counted, and what each process says of that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from leafcut.model.contour import Contour
from leafcut.model.part import Part
from leafcut.processes.layers import MARK_NAMES, matcher

#: Circles wider than this are cut or milled, not drilled, mm.
WIDEST_DRILLED = 40.0
#: So many holes weigh as much as one outline: a plate has one edge around all its holes.
HOLES_PER_OUTLINE = 8
#: How sure counts make it at most: names of layers say more.
COUNTED = 0.9
#: Ends of lines this near to each other belong to one outline, mm.
_JOINED = 0.05


@dataclass(frozen=True)
class Suitability:
    """What a process says of a drawing.

    Attributes
    ----------
    score
        0 (it could be tried) to 1 (it is plainly meant).
    reason
        Key of the words that say why; a page has them by ``guess.<reason>``.
    figures
        What stands in these words.
    contours, holes
        bool[n]: which of the contours and of the holes of the whole drawing would be worked; None for none.
    """

    score: float
    reason: str
    figures: Mapping[str, int | str] = field(default_factory=dict)
    contours: NDArray[np.bool_] | None = None
    holes: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class WholeDrawing:
    """All that a drawing shows, and what of it is a round hole, an outline, a mark."""

    part: Part

    @property
    def layers(self) -> list[str]:
        """The names of the layers that something is on."""
        return sorted({one.layer for nouns in (self.part.contours, self.part.holes) for one in nouns} - {""})

    def named(self, patterns: Sequence[str]) -> list[str]:
        """Return the layers whose names fit one of the patterns, upper and lower case alike."""
        return [layer for layer in self.layers if matcher(patterns)(layer)]

    def holes_on(self, layers: Sequence[str]) -> NDArray[np.bool_]:
        """Return which holes are on some layers."""
        return np.array([h.layer in layers for h in self.part.holes], dtype=np.bool_)

    def on(self, layers: Sequence[str]) -> NDArray[np.bool_]:
        """Return which contours are on some layers."""
        return np.array([c.layer in layers for c in self.part.contours], dtype=np.bool_)

    @property
    def closed(self) -> NDArray[np.bool_]:
        """bool[n]: which contours are closed as they are drawn."""
        return np.array([c.path.closed for c in self.part.contours], dtype=np.bool_)

    @cached_property
    def worked(self) -> NDArray[np.bool_]:
        """bool[n]: which contours are no texts, dimensions or marks."""
        kinds = np.array([c.kind not in ("text", "mark") for c in self.part.contours], dtype=np.bool_)
        plain = kinds & ~self.on(self.named(MARK_NAMES))
        return plain if plain.any() else kinds

    @cached_property
    def drilled(self) -> NDArray[np.bool_]:
        """bool[n]: which contours are circles that a drill could make."""
        widths = np.array([_diameter(c) for c in self.part.contours], dtype=np.float64)
        return self.worked & (widths > 0.0) & (widths <= WIDEST_DRILLED)

    @cached_property
    def narrow(self) -> NDArray[np.bool_]:
        """bool[n]: which holes a drill could make; points are among them."""
        return self.part.diameters <= WIDEST_DRILLED

    @cached_property
    def n_holes(self) -> int:
        """Number of round holes and of points."""
        return int(np.count_nonzero(self.drilled) + np.count_nonzero(self.narrow)) + len(self.part.slots)

    @cached_property
    def n_outlines(self) -> int:
        """Number of other outlines; lines that meet are one."""
        others = [c for c, yes in zip(self.part.contours, self.worked & ~self.drilled, strict=True) if yes]
        wide = int(np.count_nonzero(~self.narrow))
        return wide + sum(c.path.closed for c in others) + _chains([c for c in others if not c.path.closed])

    @property
    def share_of_outlines(self) -> float:
        """How much of the drawing is outlines and not holes, 0 to 1."""
        weight = HOLES_PER_OUTLINE * self.n_outlines
        return weight / max(weight + self.n_holes, 1)

    @property
    def figures(self) -> dict[str, int | str]:
        """What a reason may name."""
        return {"holes": self.n_holes, "outlines": self.n_outlines}


def _diameter(contour: Contour) -> float:
    """Return the diameter of a contour that is a circle, of two half circles as readers make them; else 0."""
    vertices = contour.path.vertices
    if not contour.path.closed or len(vertices) != 2 or not np.all(np.abs(np.abs(vertices[:, 2]) - 1.0) < 1e-6):
        return 0.0
    return float(np.hypot(*(vertices[0, :2] - vertices[1, :2])))


def _chains(lines: Sequence[Contour]) -> int:
    """Return how many outlines lines make that meet at their ends."""
    leader = list(range(len(lines)))

    def lead(k: int) -> int:
        while leader[k] != k:
            leader[k] = leader[leader[k]]
            k = leader[k]
        return k

    at: dict[tuple[int, int, int], int] = {}
    for k, line in enumerate(lines):
        for x, y in (line.path.start, line.path.end):
            # Two grids, half a cell apart: what is near is in one cell of either.
            for grid in (0, 1):
                cell = (grid, round(x / (2 * _JOINED) + 0.5 * grid), round(y / (2 * _JOINED) + 0.5 * grid))
                leader[lead(k)] = lead(at.setdefault(cell, k))
    return len({lead(k) for k in range(len(lines))})
