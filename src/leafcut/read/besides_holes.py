"""Classify the closed contours in a drilling drawing that are not holes.

Such a contour is the outline of the plate, a slot, or a shape that cannot be drilled.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.errors import LeafcutError, count_of
from leafcut.geometry.curves import Spend
from leafcut.geometry.polyline import STRAIGHT, Polyline
from leafcut.geometry.tidying import chord_polygons, tidy_outlines
from leafcut.message import Message
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.part import Hole
from leafcut.options import SheetOptions
from leafcut.read.dxf_blocks import BlockWalk, LayerFilter
from leafcut.read.dxf_strokes import DxfStroke, Strokes, entity_to_stroke
from leafcut.read.format import ReadBudget, first_positions_text

#: Entities handled by the hole reader.
_HOLES = ("CIRCLE", "POINT")
#: Maximum number of strokes to examine. A larger drawing is not a plate, so its contours are not reported.
MOST_STROKES = 20_000
#: Tolerance for the width of a slot, relative to the diameter of its largest inscribed disc.
_WIDTH_TOLERANCE = 0.01
#: Minimum straight length of a slot, relative to its width.
_MIN_SLOT_LENGTH = 0.05
#: Minimum roundness 4 π A / P²: a circle drawn as sixteen or more chords.
_MIN_ROUNDNESS = 0.98
#: Minimum number of corners of a circle: hexagons for nuts are not circles.
_MIN_CORNERS = 12
#: Maximum distance between polygon corners and the circle, relative to the radius and in mm. Drawings round to 0.001
#: mm.
_OFF_CIRCLE, _MIN_OFF_CIRCLE = 0.002, 0.002
#: Maximum distance by which holes may extend beyond their outline, mm.
_EDGE_TOLERANCE = 0.01


class ContoursBesidesHoles(NamedTuple):
    """The closed contours of a drawing, mm, and the number of entities of each type in these contours."""

    paths: tuple[Polyline, ...] = ()
    entities: Mapping[str, int] = MappingProxyType({})


@dataclass
class _ContourCollector(Strokes):
    kinds: tuple[str, ...] = ()

    def collect(self, stroke: DxfStroke, matrix: Any, layer: str) -> None:
        before = len(self.contours)
        self.add(stroke, matrix, layer)
        self.kinds += (stroke.dxftype,) * (len(self.contours) - before)


def collect_contours_besides_holes(
    document: Any, layers: LayerFilter, copies: ReadBudget, factor: float, path: str, points: Spend, holes: set[str]
) -> ContoursBesidesHoles:
    """Collect the closed contours of a DXF drawing that are not holes, in mm.

    The caller passes the handles of the holes in `holes`. If the drawing is too large, the function returns no
    contours.
    """

    def other_stroke(entity: Any) -> DxfStroke | None:
        if entity.dxftype() in _HOLES or (entity.dxf.get("handle") or "") in holes:
            return None
        return entity_to_stroke(entity)

    walk = BlockWalk(document, copies, layers, other_stroke, "lines")
    collector = _ContourCollector(factor, path, points)
    try:
        for stroke, matrix, layer in walk.shapes():
            if len(collector.contours) >= MOST_STROKES:
                return ContoursBesidesHoles()
            collector.collect(stroke, matrix, layer)
        joined = tidy_outlines([contour.path for contour in collector.contours], SheetOptions().join_tolerance).paths
    except LeafcutError:  # the drawing exceeds its line budget, which is no reason to refuse its holes
        return ContoursBesidesHoles()
    closed = [joined_path for joined_path in joined if joined_path.path.closed and abs(joined_path.path.area) > 0.0]
    return ContoursBesidesHoles(
        tuple(joined_path.path for joined_path in closed),
        Counter(collector.kinds[k] for joined_path in closed for k in joined_path.members),
    )


def hole_from_polygon(path: Polyline) -> Hole | None:
    """Convert a polygon to a round hole if its corners lie on a circle; otherwise return None.

    OpenSCAD and many SVG exporters draw holes as polygons.
    """
    corners, bulges = path.vertices[:, :2], path.vertices[:, 2]
    if len(corners) < _MIN_CORNERS or (np.abs(bulges) > STRAIGHT).any():
        return None
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    # The middle of the extents is near the centre; the least-squares circle through the corners is exact.
    offset = corners - centre
    equations = np.column_stack([2.0 * offset, np.ones(len(offset))])
    (x, y, constant), _, rank, _ = np.linalg.lstsq(equations, (offset**2).sum(axis=1), rcond=None)
    if rank < 3 or constant + x * x + y * y <= 0.0:
        return None
    radius = math.sqrt(constant + x * x + y * y)
    distances = np.hypot(*(offset - (x, y)).T)
    steps = np.hypot(*np.diff(corners, axis=0, append=corners[:1]).T)
    close = steps.max() <= 2.0 * radius * math.sin(math.pi / _MIN_CORNERS) * 1.01
    if not close or np.abs(distances - radius).max() > max(_OFF_CIRCLE * radius, _MIN_OFF_CIRCLE):
        return None
    angles = np.unwrap(np.arctan2(offset[:, 1] - y, offset[:, 0] - x))
    turns = np.diff(angles)
    # One turn around the centre in one direction excludes stars and spirals.
    if not ((turns > 0.0).all() or (turns < 0.0).all()) or abs(angles[-1] - angles[0]) >= math.tau:
        return None
    return Hole(float(centre[0] + x), float(centre[1] + y), round(2.0 * radius, 3))


def report_contours_besides_holes(
    contours: Sequence[Polyline], holes: Sequence[Hole], circles: Sequence[Hole] = ()
) -> tuple[list[Issue], list[Issue]]:
    """Report the closed contours that the program does not drill (L201).

    A contour around all holes is either the outline of the plate or a frame, so it only gets a note. Contours outside
    the outline also only get a note. Inside the outline, slots, circles drawn as other curves, and all other contours
    are missing work.

    `circles` lists the circles around holes or contours. They are missing work unless they enclose all holes.

    Returns
    -------
    list of Issue
        Issues about outlines, slots, circles, and contours outside the outline.
    list of Issue
        Issues about the other contours inside the outline. They only matter to callers that do more than drill holes.
    """
    paths = [*contours, *(Polyline.circle(circle.x, circle.y, 0.5 * circle.diameter) for circle in circles)]
    if not paths:
        return [], []
    shapes = chord_polygons(paths)
    kinds = _classify_contours(paths, shapes, holes)
    kinds[len(contours) :] = ["outline" if kind == "outline" else "circle" for kind in kinds[len(contours) :]]
    issues: list[Issue] = []
    other_issues: list[Issue] = []
    for kind, noun, explanation in _KINDS:
        members = [k for k, name in enumerate(kinds) if name == kind]
        if not members:
            continue
        positions = [_rounded_centroid(shapes[k]) for k in members]
        detail = _INSIDE_MESSAGE if kind == "contour" and "outline" in kinds else explanation
        message = Message("{} {}", count_of(len(members), noun), detail)
        if kind == "outline":
            x0, y0, x1, y1 = paths[min(members, key=lambda k: abs(paths[k].area))].extents
            size = f"{x1 - x0:.4g} × {y1 - y0:.4g} mm"
            message = Message("the outline around all holes, {}, is not cut", size)
            if len(members) > 1:
                message = Message(
                    "{} around all holes, the innermost {}, are not cut", count_of(len(members), "outline"), size
                )
        missing_work = MissingWork(noun, len(members), tuple(positions), tuple(paths[k] for k in members))
        missing = missing_work if kind in ("hole", "slot", "circle", "contour") else None
        issue = Issue("L201", message, first_positions_text(positions), Severity.NOTE, missing)
        (other_issues if kind == "contour" else issues).append(issue)
    return issues, other_issues


#: Message for contours if the outline of the part is known.
_INSIDE_MESSAGE = Message(
    "inside the part will not be machined, because only round holes are drilled; mill them with leafcut part or "
    "leafcut pocket"
)
#: A circle around holes or contours.
_ENCLOSES_MESSAGE = Message(
    "will not be drilled, because a circle that encloses other holes or contours is an outline; cut it with "
    "leafcut cut, or to drill it select its layer alone with --layers"
)
#: Kind, noun, message.
_KINDS = (
    ("slot", "slot", Message("will not be milled, because only round holes are drilled")),
    ("hole", "hole", Message("drawn as lines or a spline will not be drilled; draw circles instead")),
    ("circle", "circle", _ENCLOSES_MESSAGE),
    (
        "contour",
        "contour",
        Message(
            "will not be machined, because only round holes are drilled; mill them with leafcut part or leafcut pocket"
        ),
    ),
    ("outline", "outline", Message("")),
    ("beside", "contour", Message("beside the outline will not be cut")),
)


def _classify_contours(paths: Sequence[Polyline], shapes: NDArray[Any], holes: Sequence[Hole]) -> list[str]:
    """Classify each contour as ``outline``, ``slot``, ``hole``, ``contour`` or ``beside``."""
    centres = shapely.points(np.array([(hole.x, hole.y) for hole in holes]).reshape(-1, 2))
    grown = shapely.buffer(shapes, _EDGE_TOLERANCE)
    # A contour drawn inside a single hole also contains the centre of that hole.
    smallest = min((0.25 * math.pi * hole.diameter**2 for hole in holes), default=math.inf)
    surrounds = [
        abs(path.area) > smallest and bool(shapely.covers(shape, centres).all())
        for path, shape in zip(paths, grown, strict=True)
    ]
    plates = [k for k, surrounding in enumerate(surrounds) if surrounding]
    plate = min(plates, key=lambda k: abs(paths[k].area), default=None)
    kinds = []
    for k, (path, shape) in enumerate(zip(paths, shapes, strict=True)):
        if surrounds[k]:
            kinds.append("outline")
        elif plate is not None and not shapely.covers(grown[plate], shape):
            kinds.append("beside")
        else:
            kinds.append("hole" if _is_round(path) else "slot" if _is_slot(path, shape) else "contour")
    return kinds


def _is_round(path: Polyline) -> bool:
    return 4.0 * math.pi * abs(path.area) > _MIN_ROUNDNESS * path.length**2


def _is_slot(path: Polyline, shape: Any) -> bool:
    """Return whether a contour has the shape of a slot.

    A slot is the area that a disc sweeps along a line. For the width w and a line of length l, a slot has the area w l
    + π w² / 4 and the perimeter 2 l + π w.
    """
    area, perimeter = abs(path.area), path.length
    discriminant = 0.25 * perimeter * perimeter - math.pi * area
    if discriminant <= 0.0:
        return False
    width = (0.5 * perimeter - math.sqrt(discriminant)) / (0.5 * math.pi)
    straight_length = 0.5 * (perimeter - math.pi * width)
    disc = 2.0 * float(shapely.maximum_inscribed_circle(shape, 0.001 * width).length)
    return straight_length > _MIN_SLOT_LENGTH * width and abs(disc - width) < _WIDTH_TOLERANCE * width


def _rounded_centroid(shape: Any) -> tuple[float, float]:
    x, y = np.round(shapely.get_coordinates(shapely.centroid(shape))[0], 2).tolist()
    return x, y
