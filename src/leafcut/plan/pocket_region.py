"""Where the centre of a tool may be in a pocket, and what the tool cannot reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.polyline import Points
from leafcut.geometry.regions import polygons, region, shrunk, swept
from leafcut.model.issue import Issue
from leafcut.model.pocket import Pocket, PocketRules

#: Unreachable places smaller than this share of the tool's area are not worth a word: corners of pixels.
SMALL = 0.001
#: So many unreachable places are told one by one.
NAMED_PLACES = 4


@dataclass(frozen=True, eq=False)
class CentreRegion:
    """One connected region of allowed tool centres.

    Attributes
    ----------
    polygon
        shapely Polygon of chords, mm: every point of it is at least the radius and the stock away from all walls.
    rules
        What it was made for.
    """

    polygon: Any
    rules: PocketRules

    @property
    def rings(self) -> list[Points]:
        """Outer boundary (counter-clockwise) and those round islands (clockwise), float64[n, 2], not repeated."""
        import shapely

        whole = shapely.geometry.polygon.orient(self.polygon)
        return [np.asarray(ring.coords)[:-1, :2] for ring in (whole.exterior, *whole.interiors)]


@dataclass(frozen=True, eq=False)
class Unreached:
    """A place of a pocket that no tool of the diameter can clear: shapely geometry, its area in mm², a point in it."""

    shape: Any
    area: float
    place: tuple[float, float]


def pocket_region(pocket: Pocket, tolerance: float = 0.01) -> Any:
    """Return the pocket as a valid shapely Polygon (`geometry.regions.region`).

    Raises
    ------
    PlanError
        The outline or an island crosses itself, or an island touches the wall or another island.
    """
    return region(pocket.outline, pocket.islands, tolerance, _named(pocket))


def centre_regions(pocket: Pocket, rules: PocketRules) -> tuple[list[CentreRegion], list[Issue]]:
    """Return the regions of allowed tool centres, the largest first, and what cannot be reached.

    Raises
    ------
    PlanError
        The tool fits nowhere.
    """
    shape = pocket_region(pocket, rules.tolerance)
    allowed = shrunk(shape, rules.radius + rules.stock, rules.tolerance)
    pieces = sorted((p for p in polygons(allowed) if p.area > 0.0), key=lambda p: -p.area)
    if not pieces:
        left = f" and {rules.stock:g} mm of stock" if rules.stock else ""
        raise PlanError(
            f"{_named(pocket)}: a tool of {rules.tool_diameter:g} mm{left} fits nowhere in it; choose a smaller "
            "--tool-diameter"
        )
    issues = _told(_named(pocket), unreached(shape, rules), rules)
    return [CentreRegion(piece, rules) for piece in pieces], issues


def unreached(shape: Any, rules: PocketRules) -> list[Unreached]:
    """Return the places of a pocket's polygon that the tool cannot clear, the largest first; tiny ones left out."""
    rest, thin = shape.difference(reachable(shape, rules)), 2.0 * rules.tolerance
    found = []
    # Slivers along walls are chords beside chords.
    for piece in polygons(rest.buffer(-thin).buffer(thin).intersection(rest)):
        if piece.area >= SMALL * math.pi * rules.radius**2:
            point = piece.point_on_surface()
            found.append(Unreached(piece, piece.area, (point.x, point.y)))
    return sorted(found, key=lambda u: -u.area)


def _told(name: str, places: list[Unreached], rules: PocketRules) -> list[Issue]:
    """Return an issue for each of the largest places, and one for all others."""
    words = [
        f"{place.area:.3g} mm² near ({place.place[0]:.2f}, {place.place[1]:.2f})" for place in places[:NAMED_PLACES]
    ]
    if rest := places[NAMED_PLACES:]:
        words.append(
            f"{len(rest)} more place{'s' * (len(rest) > 1)}, {sum(place.area for place in rest):.3g} mm² in all,"
        )
    return [
        Issue("L701", f"{name}: {text} cannot be reached by a tool of {rules.tool_diameter:g} mm") for text in words
    ]


def reachable(shape: Any, rules: PocketRules) -> Any:
    """Return what of a pocket's polygon a tool of the diameter can clear."""
    inner = shrunk(shape, rules.radius, rules.tolerance)
    return swept(inner, rules.radius, rules.tolerance).intersection(shape)


def _named(pocket: Pocket) -> str:
    return f"pocket {pocket.name}" if pocket.name else "the pocket"
