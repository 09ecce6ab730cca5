"""Find the possible tool centres in a pocket, and the areas that the tool cannot reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError, count_of
from leafcut.geometry.arrays import Points
from leafcut.geometry.regions import polygons, swept_region, tool_centres
from leafcut.message import Message
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.pocket import Pocket, PocketRules

#: Minimum size of an unreachable area that is reported, relative to the area of the tool. Corners of pixels are
#: smaller.
SMALL = 0.001
#: Number of unreachable areas that are reported individually.
NAMED_PLACES = 4
#: Maximum thickness of films along walls that are ignored, in path tolerances. The chords of arcs cause such films.
_THIN = 2.0
#: Maximum diameter of the largest inscribed circle of a corner, relative to its mouth. An unreachable area with a wider
#: circle is a passage.
_AS_WIDE = 0.75


@dataclass(frozen=True, eq=False)
class CentreRegion:
    """A region of possible tool centres (shapely polygon, mm).

    Every position in the region is at least the tool radius plus the stock away from all walls.
    """

    polygon: Any
    rules: PocketRules

    @property
    def slot_centre_line(self) -> Points | None:
        """Centre line if the region is a slot exactly as wide as the tool, float64[n, 2], mm, otherwise None."""
        if self.polygon.interiors or 2.0 * self.polygon.area > 1.5 * self.rules.tolerance * self.polygon.length:
            return None
        ring = self.boundary_rings[0]
        away = np.hypot(*(ring[:, None] - ring[None, :]).transpose(2, 0, 1))
        a, b = sorted(divmod(int(away.argmax()), len(ring)))
        side, opposite = ring[a : b + 1], shapely.LineString(np.concatenate([ring[b:], ring[: a + 1]]))
        nearest = opposite.interpolate(opposite.project(shapely.points(side)))
        middle: Points = 0.5 * (side + shapely.get_coordinates(nearest))
        wide = shapely.hausdorff_distance(shapely.LineString(middle), self.polygon.exterior) > self.rules.tolerance
        return None if wide else middle

    @property
    def boundary_rings(self) -> list[Points]:
        """The counter-clockwise outer boundary, followed by the clockwise boundaries of islands.

        Each ring is float64[n, 2], mm, without the closing point.
        """
        whole = shapely.geometry.polygon.orient(self.polygon)
        return [np.asarray(ring.coords)[:-1, :2] for ring in (whole.exterior, *whole.interiors)]


@dataclass(frozen=True, eq=False)
class UnreachableArea:
    """An area of a pocket that the tool cannot clear, with its geometry, its size, mm², and a point inside it.

    A `corner` has a single opening to the cleared area and narrows from there. All other areas are passages, or lie
    behind an entrance that is too narrow for the tool.
    """

    shape: Any
    area: float
    place: tuple[float, float]
    corner: bool = True


def centre_regions(pocket: Pocket, rules: PocketRules) -> tuple[list[CentreRegion], list[Issue]]:
    """Return the regions of possible tool centres, largest first, and issues about unreachable areas.

    Raises PlanError if the tool does not fit anywhere.
    """
    shape = pocket.region(rules.tolerance)
    allowed = tool_centres(shape, rules.radius + rules.stock, rules.tolerance)
    pieces = sorted((p for p in polygons(allowed) if p.area > 0.0), key=lambda p: -p.area)
    if not pieces:
        left = Message(" and {:g} mm of stock", rules.stock) if rules.stock else ""
        x0, y0, x1, y1 = shape.bounds
        raise PlanError(
            "{}, {:.4g} × {:.4g} mm at ({:.4g}, {:.4g}): a tool "
            "of {:g} mm{} does not fit anywhere in it; choose a smaller --tool-diameter, or "
            "name the layers of the pockets with --pocket-layers",
            pocket.label,
            x1 - x0,
            y1 - y0,
            (x0 + x1) / 2,
            (y0 + y1) / 2,
            rules.tool_diameter,
            left,
        )
    issues = _unreached_issues(pocket.label, unreachable_areas(shape, rules), rules)
    return [CentreRegion(piece, rules) for piece in pieces], issues


def unreachable_areas(shape: Any, rules: PocketRules) -> list[UnreachableArea]:
    """Return the areas of a pocket that the tool cannot clear, largest first. Tiny areas are ignored."""
    reached, thin = reachable_area(shape, rules), _THIN * rules.tolerance
    rest, near = shape.difference(reached), reached.buffer(thin)
    places = []
    for piece in polygons(rest.buffer(-thin).buffer(thin).intersection(rest)):
        if piece.area >= SMALL * math.pi * rules.radius**2:
            point = piece.point_on_surface()
            places.append(UnreachableArea(piece, piece.area, (point.x, point.y), _is_corner(piece, near, thin)))
    return sorted(places, key=lambda u: -u.area)


def _is_corner(piece: Any, near: Any, thin: float) -> bool:
    """Return whether an unreachable area is a corner, which has a single mouth and narrows behind this mouth.

    Between straight walls at an angle of 2α, the mouth is 2 r cos α wide. The largest circle behind the mouth has the
    radius r (1 − sin α) / (1 + sin α). The ratio of the circle to the mouth is 0.24 at 90° and 0.52 at 40°. Between
    parallel walls, the ratio is 1.
    """
    mouths = shapely.line_merge(shapely.multilinestrings(_line_strings(piece.boundary.intersection(near))))
    mouths = [mouth for mouth in _line_strings(mouths) if mouth.length > 2.0 * thin]
    if len(mouths) != 1 or mouths[0].is_ring:
        return False
    ends = mouths[0].coords
    half = 0.5 * math.dist(ends[0], ends[-1])
    return bool(shapely.maximum_inscribed_circle(piece, thin).length <= _AS_WIDE * half)


def _line_strings(shape: Any) -> list[Any]:
    return [part for part in shapely.get_parts(shape).tolist() if part.geom_type == "LineString"]


def _unreached_issues(name: str, places: list[UnreachableArea], rules: PocketRules) -> list[Issue]:
    tool = Message("a tool of {:g} mm", rules.tool_diameter)
    corners, off = ([u for u in places if u.corner is kind] for kind in (True, False))
    issues = [
        Issue(
            "L701",
            Message("{}: {} remains uncut, because {} cannot enter it", name, _area_and_place_text(place), tool),
            missing=MissingWork("place", 1, (place.place,)),
        )
        for place in off[:NAMED_PLACES]
    ]
    if rest := off[NAMED_PLACES:]:
        work = MissingWork("place", len(rest), tuple(place.place for place in rest))
        issues.append(
            Issue(
                "L701",
                Message(
                    "{}: {} remain uncut, because {} cannot enter them",
                    name,
                    _count_and_area_text(rest, "more place"),
                    tool,
                ),
                missing=work,
            )
        )
    if corners:
        largest = _area_and_place_text(corners[0])
        words = Message(
            "{}, cannot be reached by {}; the largest measures {}",
            _count_and_area_text(corners, "corner"),
            tool,
            largest,
        )
        if len(corners) == 1:
            words = Message("a corner, {}, cannot be reached by {}", largest, tool)
        issues.append(Issue("L701", Message("{}: {}", name, words), severity=Severity.NOTE))
    return issues


def _count_and_area_text(places: list[UnreachableArea], what: str) -> Message:
    return Message("{}, {:.3g} mm² in all", count_of(len(places), what), sum(u.area for u in places))


def _area_and_place_text(place: UnreachableArea) -> Message:
    return Message("{:.3g} mm² near ({:.2f}, {:.2f})", place.area, place.place[0], place.place[1])


def reachable_area(shape: Any, rules: PocketRules) -> Any:
    """Return the part of a pocket that the tool can clear (shapely geometry)."""
    inner = tool_centres(shape, rules.radius, rules.tolerance)
    return swept_region(inner, rules.radius, rules.tolerance).intersection(shape)
