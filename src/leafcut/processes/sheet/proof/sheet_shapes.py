"""The shapes that a cutting program must respect. They are built from the drawing alone.

There are two kinds of shapes: the centreline of the kerf for each contour, and the metal of each part, which no kerf
may touch. If a hole or notch was divided, its pieces must lie inside the drawn shape and cover the whole area that the
kerf reaches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.difference import Difference
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.proof.torch_runs import FLATNESS
from leafcut.proof.difference import position_text

#: Tolerance for the position of a kerf, mm. It covers the tolerance of offset paths and the rounding in the program.
TOLERANCE = 0.025
#: Number of segments per quarter circle in buffers. For a kerf of 5 mm, buffers are exact to 0.001 mm.
QUARTER = 32
#: Minimum turn at a corner of the drawing, rad.
CORNER = math.radians(3.0)
#: Maximum distance between coincident vertices, mm.
SAME_PLACE = 1e-6


@dataclass(frozen=True, eq=False)
class Target:
    """A contour that must be cut or marked.

    Attributes
    ----------
    index
        Index of the contour in `Sheet.contours`.
    shape
        Polygon of the contour if it is closed and must be cut; otherwise None.
    edge
        Line of the contour in the drawing.
    centreline
        Centreline of the kerf. It is a ring, or the drawn line for a mark or an open cut.
    corners
        Corners of the line, float64[k, 2], mm, at which the kerf may turn or loop.
    may_stay
        Whether a hole may remain uncut. This is allowed if it is about two kerfs wide, so that rounding decides whether
        a pierce fits.
    """

    index: int
    source: Contour
    shape: Any
    edge: Any
    centreline: Any
    corners: NDArray[np.float64]
    may_stay: bool = False

    @property
    def marks(self) -> bool:
        """Whether the contour is marked instead of cut."""
        return self.source.kind == "mark"

    @property
    def name(self) -> Message:
        """Name of the contour for messages, with its kind and position."""
        x, y = self.source.path.start
        closed = self.shape is not None
        if self.marks:
            kind = Message("mark")
        elif not closed:
            kind = Message("cut")
        else:
            kind = Message("hole") if self.source.is_hole else Message("outline")
        if self.source.part:
            kind = Message("{} of part {}", kind, self.source.part)
        return Message("contour {} ({}, at X{:.3f} Y{:.3f})", self.index + 1, kind, x, y)


def build_targets(sheet: Sheet, half: float) -> list[Target]:
    """Return the contours that must be cut or marked, in the order of the sheet.

    `half` is the distance from the centreline of the kerf to a part, mm.
    """
    found = (_build_target(k, source, half) for k, source in enumerate(sheet.contours) if source.kind != "sheet")
    return [target for target in found if target is not None]


def _polygon(one: Contour) -> Any:
    return shapely.Polygon(one.path.flattened(FLATNESS))


def _build_target(index: int, source: Contour, half: float) -> Target | None:
    """Return the target of a contour.

    Return None for a hole that the kerf fills or divides, or that has no room for a pierce.
    """
    points = source.path.flattened(FLATNESS)
    edge = shapely.LineString(points if len(points) > 1 else np.repeat(points, 2, axis=0))
    if source.kind == "mark" or not source.path.closed:
        return Target(index, source, None, edge, edge, np.zeros((0, 2)))
    shape = shapely.Polygon(points)
    grown = shape.buffer(-half if source.is_hole else half, quad_segs=QUARTER)
    polygons = shapely.get_parts(grown)
    if grown.is_empty or len(polygons) != 1:
        return None
    # A pierce is one kerf wide and at least half a kerf from the path, which is half a kerf from the part.
    pierces = [not source.is_hole or not shape.buffer(-2.0 * half + by).is_empty for by in (TOLERANCE, -TOLERANCE)]
    if not pierces[0]:
        return None
    # The kerf closes notches with a narrow mouth, and follows the outer ring.
    way = shapely.LineString(polygons[0].exterior.coords)
    return Target(index, source, shape, edge, way, _sharp_corners(source.path), not pierces[1])


def _sharp_corners(path: Polyline) -> NDArray[np.float64]:
    """Return the vertices at which a closed path turns sharply, float64[k, 2], mm.

    At each end of an arc, the angle between the arc and its chord is 2 atan(bulge), which is half the angle of the arc.
    """
    steps = np.roll(path.vertices[:, :2], -1, axis=0) - path.vertices[:, :2]
    real = np.hypot(*steps.T) > SAME_PLACE
    chord, half = np.arctan2(steps[real, 1], steps[real, 0]), 2.0 * np.arctan(path.bulges[real])
    turn = (chord - half) - np.roll(chord + half, 1)
    corner = np.abs((turn + math.pi) % math.tau - math.pi) > CORNER
    found: NDArray[np.float64] = path.vertices[real][corner, :2]
    return found


def part_areas(sheet: Sheet) -> tuple[NDArray[Any], tuple[int, ...]]:
    """Return the metal of each part as polygons that are shrunk by the tolerance, and the part numbers.

    The metal of a part is its outline without the holes. Chambers of closed notches are ignored.
    """
    outlines: dict[int, list[Any]] = {}
    holes: dict[int, list[Any]] = {}
    for source in sheet.contours:
        if source.kind == "cut" and source.path.closed and source.part and not source.chamber:
            polygon = _polygon(source)
            (holes if source.is_hole else outlines).setdefault(source.part, []).append(polygon)
    metal = []
    for number, polygons in outlines.items():
        whole = shapely.union_all(polygons).difference(shapely.union_all(holes.get(number, [])))
        metal.append(whole.buffer(-TOLERANCE, join_style="mitre"))
    return np.array(metal, dtype=object), tuple(outlines)


# -- divided holes and chambers --------------------------------------------------------------------------------------


def check_divided_shapes(drawn: Sheet, sheet: Sheet, half: float) -> list[Difference]:
    """Check the holes and notches that were divided, and return the faults.

    Parameters
    ----------
    drawn
        The sheet before the division.
    half
        Distance from the centreline of the kerf to a part, mm.
    """
    changed = [k for k, one in enumerate(drawn.contours) if sheet.contours[k].path is not one.path]
    if not changed and len(sheet.contours) == len(drawn.contours):
        return []
    holes = {k: _polygon(drawn.contours[k]) for k in changed}
    added = sheet.contours[len(drawn.contours) :]
    pieces = [_polygon(one) for one in (*(sheet.contours[k] for k in changed), *added) if not one.chamber]
    found = _check_chambers(drawn, [_polygon(one) for one in added if one.chamber], half)
    found += [
        _divided_fault(Message("the contour at {} is cut in sections, which only a hole may be", _place_text(shape)))
        for k, shape in holes.items()
        if not drawn.contours[k].is_hole
    ]
    found += [
        _divided_fault(Message("a divided hole is cut beyond its edge, at {}", _place_text(piece)))
        for piece in pieces
        if not any(hole.buffer(TOLERANCE).covers(piece) for hole in holes.values())
    ]
    whole = shapely.union_all([piece.buffer(TOLERANCE) for piece in pieces])
    for hole in holes.values():
        for reached in shapely.get_parts(hole.buffer(-half, quad_segs=QUARTER)):
            room = not reached.buffer(-half - 2.0 * TOLERANCE).is_empty
            if room and not whole.covers(reached):
                found.append(
                    _divided_fault(Message("a piece of a divided hole is not cut, at {}", _place_text(reached)))
                )
    return found


def _check_chambers(drawn: Sheet, chambers: list[Any], half: float) -> list[Difference]:
    """Return a fault for each chamber that extends beyond its notch, and for each chamber that was forgotten.

    A chamber was forgotten if it is not cut although another chamber of the same outline is cut. It may stay uncut if
    no pierce fits, or if its kerf would enter another kerf.
    """
    if not chambers:
        return []
    found, lost = list[Difference](), list(chambers)
    whole = shapely.union_all([chamber.buffer(TOLERANCE) for chamber in chambers])
    for one in drawn.contours:
        if one.is_hole or one.kind != "cut" or not one.path.closed:
            continue
        outline = _polygon(one)
        grown = outline.buffer(half, quad_segs=QUARTER)
        ways = [grown.exterior, *grown.interiors]
        reached = [shapely.Polygon(way) for way in ways[1:]]
        if not any(whole.covers(ring) for ring in reached):
            continue
        closed = shapely.Polygon(grown.exterior).buffer(-half, quad_segs=QUARTER).difference(outline)
        lost = [chamber for chamber in lost if not closed.buffer(TOLERANCE).covers(chamber)]
        for k, ring in enumerate(reached, 1):
            alone = shapely.distance(ways[k], ways[:k] + ways[k + 1 :]).min() > 2.0 * half + 4.0 * TOLERANCE
            room = alone and not ring.buffer(-half - 2.0 * TOLERANCE).is_empty
            if room and not whole.covers(ring):
                found.append(_divided_fault(Message("a chamber of a notch is not cut, at {}", _place_text(ring))))
    return found + [
        _divided_fault(Message("a chamber is cut beyond its notch, at {}", _place_text(chamber))) for chamber in lost
    ]


def _place_text(shape: Any) -> str:
    x, y = shape.representative_point().coords[0]
    return position_text(x, y)


def _divided_fault(text: Message) -> Difference:
    return Difference(Message("divided hole"), 0, 0, text)
