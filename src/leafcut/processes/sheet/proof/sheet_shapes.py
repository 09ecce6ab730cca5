"""The shapes of a sheet that a cutting program must respect, made from the drawing alone.

For every contour: where the middle of the kerf must go. For every part: the metal that no kerf may touch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.polyline import Polyline
from leafcut.model.sheet import Sheet, SheetContour
from leafcut.processes.sheet.proof.torch_runs import FLATNESS

#: How far a kerf may be from where it should be, mm: the offset's tolerance and the program's rounding are within.
TOLERANCE = 0.025
#: Segments in a quarter of a round corner of a buffer: 0.001 mm on a kerf of 5 mm.
QUARTER = 32
#: A turn of the drawn line that is a corner, rad.
CORNER = math.radians(3.0)
#: Vertices nearer than this are one, mm.
SAME_PLACE = 1e-6


@dataclass(frozen=True, eq=False)
class Target:
    """A contour that must be cut or marked.

    Attributes
    ----------
    index
        In `Sheet.contours`.
    shape
        Shapely polygon of a closed contour to be cut, else None.
    edge
        The drawn line.
    way
        Where the middle of the kerf runs (a ring about a closed contour; the line itself for a mark or an open cut).
    corners
        Corners of the drawn line, float64[k, 2]: the kerf may go round them or in a loop.
    may_stay
        A hole two kerfs wide within the tolerance: whether there is room for its pierce is a matter of rounding.
    """

    index: int
    source: SheetContour
    shape: Any
    edge: Any
    way: Any
    corners: NDArray[np.float64]
    may_stay: bool = False

    @property
    def marks(self) -> bool:
        """Whether it is marked, not cut."""
        return self.source.contour.kind == "mark"

    @property
    def name(self) -> str:
        """What a person calls it, with its place."""
        x, y = self.source.contour.path.start
        closed = self.shape is not None
        what = "mark" if self.marks else "cut" if not closed else "hole" if self.source.is_hole else "outline"
        part = f" of part {self.source.part}" if self.source.part else ""
        return f"contour {self.index + 1} ({what}{part}, at X{x:.3f} Y{y:.3f})"


@dataclass(frozen=True, eq=False)
class SheetShapes:
    """All of a sheet: `targets` in its order, `left_out` contours with no room for kerf or pierce; `parts` by number.

    `parts` are the metal of the finished parts less `TOLERANCE`; `numbers` their numbers.
    """

    targets: tuple[Target, ...]
    left_out: tuple[int, ...]
    parts: NDArray[Any]
    numbers: tuple[int, ...]
    sheet: Any
    zones: tuple[Any, ...]


def shapes_of(sheet: Sheet, half: float) -> SheetShapes:
    """Return the shapes of a sheet for a kerf whose middle keeps `half` mm from the parts."""
    targets, narrow = list[Target](), set[int]()
    for index, source in enumerate(sheet.contours):
        if source.contour.kind == "sheet":
            continue
        target = _target(index, source, half)
        if target is not None:
            targets.append(target)
            continue
        narrow.add(index)
    parts, numbers = _metal(sheet)
    rings = [path.flattened(FLATNESS) for path in sheet.paths]
    outline = shapely.Polygon(rings[0], rings[1:]) if rings else None
    return SheetShapes(
        targets=tuple(targets),
        left_out=tuple(sorted(narrow)),
        parts=parts,
        numbers=numbers,
        sheet=outline,
        zones=tuple(shapely.box(*zone) for zone in sheet.zones),
    )


def _target(index: int, source: SheetContour, half: float) -> Target | None:
    """Return what is to be cut of a contour; None if the kerf fills or divides a hole, or no pierce has room in it."""
    points = source.contour.path.flattened(FLATNESS)
    edge = shapely.LineString(points if len(points) > 1 else np.repeat(points, 2, axis=0))
    if source.contour.kind == "mark" or not source.contour.path.closed:
        return Target(index, source, None, edge, edge, np.zeros((0, 2)))
    shape = shapely.Polygon(points)
    grown = shape.buffer(-half if source.is_hole else half, quad_segs=QUARTER)
    polygons = shapely.get_parts(grown)
    if grown.is_empty or len(polygons) != 1:
        return None
    # A pierce is as wide as the kerf, half a kerf away from the way at least, and that half a kerf from the part.
    pierces = [not source.is_hole or not shape.buffer(-2.0 * half + by).is_empty for by in (TOLERANCE, -TOLERANCE)]
    if not pierces[0]:
        return None
    # The kerf closes notches with a narrow mouth; it follows the outer ring.
    way = shapely.LineString(polygons[0].exterior.coords)
    return Target(index, source, shape, edge, way, _corners(source.contour.path), not pierces[1])


def _corners(path: Polyline) -> NDArray[np.float64]:
    """Return the vertices of a closed path at which it turns, float64[k, 2].

    An arc leaves its chord by half of its angle at both ends, 2 atan of the bulge.
    """
    steps = np.roll(path.vertices[:, :2], -1, axis=0) - path.vertices[:, :2]
    real = np.hypot(*steps.T) > SAME_PLACE
    chord, half = np.arctan2(steps[real, 1], steps[real, 0]), 2.0 * np.arctan(path.bulges[real])
    turn = (chord - half) - np.roll(chord + half, 1)
    corner = np.abs((turn + math.pi) % math.tau - math.pi) > CORNER
    found: NDArray[np.float64] = path.vertices[real][corner, :2]
    return found


def _metal(sheet: Sheet) -> tuple[NDArray[Any], tuple[int, ...]]:
    """Return the metal of every part: its outline less its holes, but not less chambers, smaller by the tolerance."""
    outlines: dict[int, list[Any]] = {}
    holes: dict[int, list[Any]] = {}
    for source in sheet.contours:
        contour = source.contour
        if contour.kind == "cut" and contour.path.closed and source.part and not source.chamber:
            polygon = shapely.Polygon(contour.path.flattened(FLATNESS))
            (holes if source.is_hole else outlines).setdefault(source.part, []).append(polygon)
    metal = []
    for number, polygons in outlines.items():
        whole = shapely.union_all(polygons).difference(shapely.union_all(holes.get(number, [])))
        metal.append(whole.buffer(-TOLERANCE, join_style="mitre"))
    return np.array(metal, dtype=object), tuple(outlines)
