"""Rate how well a drawing suits each type of work. The rating depends on the numbers of holes and outlines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.index import connected_components
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.part import Part
from leafcut.options.drawings import MARK_NAMES

#: Maximum diameter of a drilled hole, mm. Wider circles are cut or milled instead.
WIDEST_DRILLED = 40.0
#: This many holes weigh as much as one outline, because a plate has a single edge around all its holes.
HOLES_PER_OUTLINE = 8
#: Highest score that numbers can give. Layer names score higher, because they are more reliable.
COUNTED = 0.9
#: Lines are joined to one outline within this tolerance, mm.
_JOIN_TOLERANCE = 0.05


@dataclass(frozen=True)
class Suitability:
    """How well a drawing suits a process.

    Attributes
    ----------
    score
        Rating from 0 (possible) to 1 (clearly intended).
    reason, figures
        Key of the message that explains the rating, and the values for this message.
    contours, holes
        Masks of the geometry that the process would machine, bool[n], or None if there is none.
    """

    score: float
    reason: str
    figures: Mapping[str, int | str] = field(default_factory=dict)
    contours: NDArray[np.bool_] | None = None
    holes: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class WholeDrawing:
    """A complete drawing, divided into round holes, outlines and marks."""

    part: Part

    @property
    def layers(self) -> list[str]:
        """The names of the layers that contain geometry."""
        return sorted({item.layer for items in (self.part.contours, self.part.holes) for item in items} - {""})

    def layers_matching(self, patterns: Sequence[str]) -> list[str]:
        """Return the layers whose names match at least one of the patterns. Case is ignored."""
        return [layer for layer in self.layers if layer_matcher(patterns)(layer)]

    def hole_mask_on(self, layers: Sequence[str]) -> NDArray[np.bool_]:
        """Return a mask of the holes on the given layers."""
        return np.array([h.layer in layers for h in self.part.holes], dtype=np.bool_)

    def contour_mask_on(self, layers: Sequence[str]) -> NDArray[np.bool_]:
        """Return a mask of the contours on the given layers."""
        return np.array([c.layer in layers for c in self.part.contours], dtype=np.bool_)

    @property
    def closed_mask(self) -> NDArray[np.bool_]:
        """Mask of closed contours, bool[n]."""
        return np.array([c.path.closed for c in self.part.contours], dtype=np.bool_)

    @cached_property
    def machined_mask(self) -> NDArray[np.bool_]:
        """Mask of the contours to machine, bool[n].

        Texts, marks, and contours on layers that are named for marks are excluded.
        """
        kinds = np.array([c.kind not in ("text", "mark") for c in self.part.contours], dtype=np.bool_)
        plain = kinds & ~self.contour_mask_on(self.layers_matching(MARK_NAMES))
        return plain if plain.any() else kinds

    @cached_property
    def drilled_mask(self) -> NDArray[np.bool_]:
        """Mask of the contours that are circles and small enough to drill, bool[n]."""
        widths = np.array([_circle_diameter(c) for c in self.part.contours], dtype=np.float64)
        return self.machined_mask & (widths > 0.0) & (widths <= WIDEST_DRILLED)

    @cached_property
    def narrow_hole_mask(self) -> NDArray[np.bool_]:
        """Mask of the holes that are small enough to drill, bool[n]. Points are included."""
        return self.part.diameters <= WIDEST_DRILLED

    @cached_property
    def n_holes(self) -> int:
        """Number of round holes, points and slots."""
        return int(np.count_nonzero(self.drilled_mask) + np.count_nonzero(self.narrow_hole_mask)) + len(self.part.slots)

    @cached_property
    def _outlines(self) -> list[Contour]:
        """The contours that are not drilled."""
        return self._contours_of(self.machined_mask & ~self.drilled_mask)

    @cached_property
    def _open_lines(self) -> list[Contour]:
        return [c for c in self._outlines if not c.path.closed]

    @cached_property
    def n_outlines(self) -> int:
        """Number of outlines that are not drilled. Open lines that meet count as one outline."""
        wide = int(np.count_nonzero(~self.narrow_hole_mask))
        return wide + sum(c.path.closed for c in self._outlines) + _count_chains(self._open_lines)

    @cached_property
    def has_openings(self) -> bool:
        """Whether a closed outline surrounds a round hole or another contour.

        Open lines are joined first if they meet.
        """
        outlines: list[Any] = [_area(c) for c in self._outlines if c.path.closed]
        outlines += _enclosed_areas(self._open_lines)
        inside = [(hole.x, hole.y) for hole in self.part.holes if hole.diameter > 0.0]
        inside += [c.path.start for c in self._contours_of(self.machined_mask)]
        if not outlines or not inside:
            return False
        # Joining moves the points of an outline, so areas are shrunk: no outline may contain its own points.
        areas = shapely.buffer(outlines, -4.0 * _JOIN_TOLERANCE)
        return bool(shapely.STRtree(shapely.points(inside)).query(areas, predicate="contains").size)

    def _contours_of(self, mask: NDArray[np.bool_]) -> list[Contour]:
        return [c for c, chosen in zip(self.part.contours, mask, strict=True) if chosen]

    @property
    def outline_share(self) -> float:
        """Share of the outlines in the weight of outlines and holes together, from 0 to 1."""
        weight = HOLES_PER_OUTLINE * self.n_outlines
        return weight / max(weight + self.n_holes, 1)

    @property
    def counts(self) -> dict[str, int | str]:
        """The numbers of holes and outlines, for messages."""
        return {"holes": self.n_holes, "outlines": self.n_outlines}


def _circle_diameter(contour: Contour) -> float:
    """Return the diameter of a circle, or 0 for any other contour. Readers store a circle as two half circles."""
    vertices = contour.path.vertices
    if not contour.path.closed or len(vertices) != 2 or not np.all(np.abs(np.abs(vertices[:, 2]) - 1.0) < 1e-6):
        return 0.0
    return float(np.hypot(*(vertices[0, :2] - vertices[1, :2])))


def _area(outline: Contour) -> shapely.Polygon:
    corners = outline.path.flattened()
    return shapely.Polygon(corners) if len(corners) > 2 else shapely.Polygon()


def _enclosed_areas(lines: Sequence[Contour]) -> list[shapely.Geometry]:
    """Return the areas that open lines enclose. Ends that are closer than the tolerance are joined."""
    if not lines:
        return []
    paths = [line.path.flattened() for line in lines]
    ends = np.concatenate([path[[0, -1]] for path in paths])
    points: Any = shapely.points(ends)
    end, near = shapely.STRtree(points).query(points, predicate="dwithin", distance=2.0 * _JOIN_TOLERANCE)
    joined = np.full(len(ends), len(ends))
    np.minimum.at(joined, end, near)
    if len(np.unique(joined)) == len(ends):
        return []
    for path, pair in zip(paths, joined.reshape(-1, 2), strict=True):
        path[[0, -1]] = ends[pair]
    number = np.repeat(np.arange(len(paths)), [len(path) for path in paths])
    joined_lines: Any = shapely.linestrings(np.concatenate(paths), indices=number)
    areas: Any = shapely.polygonize(joined_lines)
    return [shapely.Polygon(area.exterior) for area in areas.geoms]  # without the areas of the openings


def _count_chains(lines: Sequence[Contour]) -> int:
    first_of_cell: dict[tuple[int, int, int], int] = {}
    pairs = []
    for k, line in enumerate(lines):
        for x, y in (line.path.start, line.path.end):
            # Two grids, half a cell apart: near points share a cell of one of them.
            for grid in (0, 1):
                cell = (
                    grid,
                    round(x / (2 * _JOIN_TOLERANCE) + 0.5 * grid),
                    round(y / (2 * _JOIN_TOLERANCE) + 0.5 * grid),
                )
                pairs.append((k, first_of_cell.setdefault(cell, k)))
    first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return len(np.unique(connected_components(len(lines), first, second)))
