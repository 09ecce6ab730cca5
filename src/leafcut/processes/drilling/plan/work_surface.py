"""Drilling on an uneven surface.

This module measures the top of each hole and the thickness of the part there, and finds low travel heights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError, count_of
from leafcut.material.surface import TILES, TILES_DOGLEG, HoleRims, build_safe_tiles, heights_around_holes
from leafcut.message import Message
from leafcut.model.cutter import cutter_of_tool, wide_discs_above_flutes
from leafcut.model.heights import SAME_HEIGHT
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.mesh import Mesh
from leafcut.model.part import Part
from leafcut.model.problem import Relief
from leafcut.model.shown_stock import FixtureBox
from leafcut.model.tool import Tool

#: A warning is issued if the rim of a hole is uneven by more than this height, mm.
UNEVEN = 0.2
#: Minimum distance of a shank or holder from the surface, mm: twice the mesh tolerance.
BODY_CLEARANCE = 0.1
#: If a tool is wider than its hole, its flutes are compared with the surrounding material at this number of heights.
FLUTE_LEVELS = 12
#: Largest accepted ratio between the length of a fixture and the length of the part.
MAX_LENGTH_RATIO = 50.0
#: Units that are often confused with mm, and the factors by which they would scale the mesh.
OTHER_UNITS = {Message("inches"): 25.4, Message("metres"): 1000.0, Message("mm, not inches,"): 1 / 25.4}
#: Drawing and surface count as similar if the ratio of their lengths is at least this.
_NEARLY = 0.5
#: Largest plausible thickness of a part, in diameters of the holes in the part.
DEEPEST = 30.0
#: If a fixture is this many times as long as the part, a wrong unit is suspected.
ODD_TIMES = 8.0
#: Largest distance of a fixture from the part, as a share of the length of the part.
NEAR = 0.1


class HoleTops(NamedTuple):
    """Heights at each hole, float64[n] each, mm, and the issues that these heights cause.

    - `tops`: top of the hole
    - `surface`: surface of the part
    - `under`: underside of the part
    """

    tops: NDArray[np.float64]
    surface: NDArray[np.float64]
    under: NDArray[np.float64]
    issues: list[Issue]


@dataclass(frozen=True, eq=False)
class WorkSurface:
    """The surface of the part, together with its fixtures.

    Attributes
    ----------
    mesh
        The surface, placed like the drawing.
    boxes
        Lower and upper corner of each keep-out zone that has a height, float64[k, 6], mm.
    clearance
        Distance of travel moves from the surface, fixtures and zones, in both vertical and horizontal direction, mm.
    """

    mesh: Mesh
    boxes: NDArray[np.float64]
    clearance: float
    fixture: Mesh | None = None
    issues: tuple[Issue, ...] = ()

    @property
    def triangles(self) -> NDArray[np.float64]:
        """Triangles of the surface, the keep-out boxes and the fixture, float64[n, 3, 3], mm."""
        fixture_triangles = [] if self.fixture is None else [self.fixture.triangles]
        return np.concatenate([self.mesh.triangles, *(_box_triangles(box) for box in self.boxes), *fixture_triangles])

    @property
    def shown_boxes(self) -> tuple[FixtureBox, ...]:
        """The keep-out boxes for display, mm: x, y, z of the lower corner, then of the upper corner."""
        return tuple((x0, y0, z0, x1, y1, z1) for x0, y0, z0, x1, y1, z1 in self.boxes.tolist())

    @property
    def top_z(self) -> float:
        """Height of the highest point of the surface and the fixtures, mm."""
        fixture_top = [] if self.fixture is None else [float(self.fixture.high[2])]
        return float(max([float(self.mesh.high[2]), *self.boxes[:, 5].tolist(), *fixture_top]))

    def is_clear(self, x: float, y: float, radius: float, z: float) -> bool:
        """Return whether the surface within `radius` of a point is nowhere higher than `z`, mm."""
        import shapely  # imported here because most drawings have no surface

        corners = self.mesh.triangles
        near = corners[:, :, 2].max(axis=1) > z + SAME_HEIGHT
        for axis, coordinate in enumerate((x, y)):
            near &= (corners[:, :, axis].min(axis=1) < coordinate + radius) & (
                corners[:, :, axis].max(axis=1) > coordinate - radius
            )
        pieces = (_part_above(triangle, z + SAME_HEIGHT) for triangle in corners[near])
        point = shapely.Point(x, y)
        return not any(
            len(piece) and shapely.dwithin(point, shapely.MultiPoint(piece).convex_hull, radius) for piece in pieces
        )

    def safe_travel_heights(
        self,
        machine: Machine,
        tool: Tool,
        points: NDArray[np.float64],
        heights: NDArray[np.float64],
        crossing_height: float,
        zones: NDArray[np.float64],
    ) -> Relief:
        """Return the heights at which a tool can safely travel between points.

        Keep-out zones are crossed at `crossing_height`.
        """
        max_tiles = TILES_DOGLEG if machine.rapid_style == "dogleg" else TILES
        bars = [
            _box_triangles(np.array([*zone[:2], 0.0, *zone[2:], crossing_height - self.clearance])) for zone in zones
        ]
        lowest, clearance = float(heights.min(initial=np.inf)), self.clearance
        obstacles = np.concatenate([self.triangles, *bars])
        highest = float(obstacles[:, :, 2].max())
        bodies = [
            (disc.radius + clearance, clearance - disc.above)
            for disc in wide_discs_above_flutes(tool)
            if lowest + disc.above < highest + clearance
        ]
        tiles = build_safe_tiles(obstacles, 0.5 * tool.diameter + clearance, clearance, max_tiles, bodies)
        acceleration = machine.acceleration[2] * machine.acceleration_factor
        return Relief(
            points,
            heights,
            crossing_height,
            np.minimum(tiles.heights, crossing_height),
            tiles.x,
            tiles.y,
            tiles.side,
            machine.rapid_velocity[2],
            acceleration,
        )


def validate_fixture(fixture: Mesh, mesh: Mesh) -> tuple[Mesh, list[Issue]]:
    """Check the mesh of a fixture and return it with the issues.

    If the mesh is not closed, return its bounding box instead.

    Raises PlanError if the fixture is far from the surface or if its size is implausible. In both cases, the unit or
    the origin of the fixture is wrong.
    """
    size, corner = fixture.high - fixture.low, fixture.low
    length = float(max((mesh.high - mesh.low)[:2]))
    gap = float(np.hypot(*np.maximum(np.maximum(fixture.low - mesh.high, mesh.low - fixture.high), 0.0)[:2]))
    fixture_length = float(size.max())
    other_unit = _plausible_unit(fixture, mesh, fixture_length, length)
    if gap > length or not length / MAX_LENGTH_RATIO < fixture_length < MAX_LENGTH_RATIO * length:
        message = Message(
            "the fixture {} is {:.4g} mm long and lies {:.4g} mm beside the surface, which is {:.4g} mm long",
            fixture.name,
            fixture_length,
            gap,
            length,
        )
        if other_unit:
            raise PlanError(
                "{}; in {}, the fixture would lie next to the surface; save the fixture in the unit of the surface",
                message,
                other_unit,
            )
        raise PlanError("{}; check its unit (--surface-unit) and its origin", message)
    issues = [
        Issue(
            "L444",
            Message(
                "{} measures {:.4g} × {:.4g} × {:.4g} mm, and its lower corner is at ({:.4g}, {:.4g}), Z{:.4g}",
                fixture.name,
                size[0],
                size[1],
                size[2],
                corner[0],
                corner[1],
                corner[2],
            ),
            severity=Severity.NOTE,
        )
    ]
    if other_unit:
        message = Message(
            "{} is {:.4g} mm long and the surface {:.4g} mm; in {}, the fixture would also fit the surface; "
            "check whether both files have the same unit (--surface-unit)",
            fixture.name,
            fixture_length,
            length,
            other_unit,
        )
        issues.append(Issue("L445", message))
    if not fixture.closed:
        issues.append(
            Issue(
                "L443",
                Message("{} is not closed, so its whole bounding box is used", fixture.name),
                severity=Severity.WARNING,
            )
        )
        fixture = Mesh(_box_triangles(np.concatenate([fixture.low, fixture.high])), fixture.name)
    return fixture, issues


def _plausible_unit(fixture: Mesh, mesh: Mesh, fixture_length: float, length: float) -> str:
    """Return the unit in which a fixture of implausible size would fit the part. Return "" if no unit fits."""
    for name, factor in OTHER_UNITS.items():
        if not (fixture_length < length / ODD_TIMES if factor > 1.0 else fixture_length > length * ODD_TIMES):
            continue
        gap = np.maximum(fixture.low * factor - mesh.high, mesh.low - fixture.high * factor)
        if float(gap.max()) < NEAR * length and length / ODD_TIMES <= fixture_length * factor <= length * ODD_TIMES:
            return name
    return ""


def check_fixture_collisions(
    xy: NDArray[np.float64], tips: NDArray[np.float64], radius: float, surface: WorkSurface
) -> None:
    """Raise PlanError if, at any hole, the fixture rises above the tool tip within the radius of the tool."""
    if surface.fixture is None or not len(xy):
        return
    hits = _points_below_mesh(surface.fixture.triangles, xy, tips, radius)
    if hits:
        x, y = xy[min(hits)]
        raise PlanError(
            "the hole at ({:g}, {:g}) is under the fixture {}, or closer to it than the radius of its tool ({} "
            "in all); move the fixture, or leave the holes out",
            x,
            y,
            surface.fixture.name,
            count_of(len(hits), "hole"),
        )


def check_shank_and_holder(
    tool: Tool, xy: NDArray[np.float64], tops: NDArray[np.float64], tips: NDArray[np.float64], surface: WorkSurface
) -> None:
    """Raise PlanError if a shank or holder would hit the surface, a fixture or the rim of the hole during drilling.

    Collisions between holes are avoided by the travel heights (`WorkSurface.safe_travel_heights`).
    """
    triangles = surface.triangles
    for disc in wide_discs_above_flutes(tool):
        low = tips + disc.above - BODY_CLEARANCE
        hits = set(np.flatnonzero(low < tops).tolist())
        if float(low.min(initial=np.inf)) < surface.top_z:
            hits |= _points_below_mesh(triangles, xy, low, disc.radius + BODY_CLEARANCE)
        if not hits:
            continue
        index = min(hits)
        x, y = xy[index]
        obstacle = (
            Message("the rim of the hole") if low[index] < tops[index] else Message("the surface beside the hole")
        )
        raise PlanError(
            "{}: at ({:g}, {:g}), its {}, Ø {:g} mm, descends to Z{:.3f} and hits {} ({} in all); use a longer "
            "tool, or leave the holes out",
            tool.label,
            x,
            y,
            disc.body,
            2.0 * disc.radius,
            tips[index] + disc.above,
            obstacle,
            count_of(len(hits), "hole"),
        )


def check_tool_width(
    tool: Tool,
    xy: NDArray[np.float64],
    widths: NDArray[np.float64],
    tops: NDArray[np.float64],
    tips: NDArray[np.float64],
    surface: WorkSurface,
) -> None:
    """Raise PlanError if a tool is wider than a hole of a solid and would cut the surrounding material.

    The surface of a solid is the finished part, so nothing above the top of a hole may be cut. A centre drill cuts its
    chamfer below the top. If it is wider than the chamfer, it needs free space above the top. `widths` contains the
    largest diameter of each hole, mm.
    """
    cutter = cutter_of_tool(tool)
    wider = np.flatnonzero(cutter.radius > 0.5 * widths + BODY_CLEARANCE)
    if not len(wider):
        return
    xy, tops, tips = xy[wider], tops[wider] + UNEVEN, tips[wider]
    full = np.maximum(tops, tips + cutter.height(cutter.radius))
    hits = set[int]()
    for share in np.linspace(0.0, 1.0, FLUTE_LEVELS):
        heights = tops + share * (full - tops)
        reach = np.array([cutter.radius_at(depth) for depth in (heights - tips).tolist()])
        for radius in np.unique(reach).tolist():
            indices = np.flatnonzero(reach == radius)
            new_hits = _points_below_mesh(
                surface.triangles, xy[indices], heights[indices], max(radius - BODY_CLEARANCE, 0.0)
            )
            hits |= {int(indices[k]) for k in new_hits}
    if hits:
        index = min(hits)
        x, y = xy[index]
        raise PlanError(
            "{}: the tool is wider than the hole at ({:g}, {:g}) and would cut its wall ({} in all); use a "
            "narrower tool, or leave these holes out",
            tool.label,
            x,
            y,
            count_of(len(hits), "hole"),
        )


def _points_below_mesh(
    triangles: NDArray[np.float64], xy: NDArray[np.float64], heights: NDArray[np.float64], radius: float
) -> set[int]:
    """Return the indices of the points around which the mesh is too high.

    The mesh is too high if it rises above the given height anywhere within a horizontal radius, mm.
    """
    import shapely  # imported here because most drawings have no surface

    triangles = triangles[triangles[:, :, 2].max(axis=1) > heights.min()]
    if not len(triangles):
        return set()
    flat: Any = shapely.convex_hull(shapely.multipoints(triangles[:, :, :2]))
    points: Any = shapely.points(xy)
    point_indices, triangle_indices = shapely.STRtree(flat).query(points, predicate="dwithin", distance=radius)
    entirely_above = triangles[triangle_indices, :, 2].min(axis=1) > heights[point_indices]
    hits = set(point_indices[entirely_above].tolist())
    for index, triangle in zip(
        point_indices[~entirely_above].tolist(), triangle_indices[~entirely_above].tolist(), strict=True
    ):
        if index in hits:
            continue
        piece = _part_above(triangles[triangle], float(heights[index]))
        if len(piece) and shapely.dwithin(points[index], shapely.MultiPoint(piece).convex_hull, radius):
            hits.add(index)
    return hits


def _part_above(corners: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Clip a triangle to the part above a height. Return the corners of this part in top view, float64[k, 2]."""
    clipped = [corner[:2] for corner in corners if corner[2] > height]
    for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if (start[2] > height) != (stop[2] > height):
            clipped.append((start + (stop - start) * ((height - start[2]) / (stop[2] - start[2])))[:2])
    return np.array(clipped).reshape(-1, 2)


def measure_hole_tops(
    part: Part,
    surface: WorkSurface,
    radius: NDArray[np.float64],
    cut_radius: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    drawn: bool,
) -> HoleTops:
    """Measure the top of each hole, and the underside of the part below it.

    Parameters
    ----------
    radius
        Radius of the widest tool of each hole, float64[n], mm. The highest point of the surface within this radius is
        the top of the hole.
    cut_radius
        Function that computes the largest radius cut at each hole, mm. It takes the height of the surface above the top
        of the hole, float64[n], mm. The surface must exist everywhere within this radius.
    drawn
        Whether each hole starts at its drawn height. This height is then only compared with the surface.

    Raises
    ------
    PlanError
        If a hole is beside the surface or on its edge, for example because the units differ.
    """
    xy = part.hole_xy
    heights = np.array([hole.z for hole in part.holes], dtype=np.float64)
    rims = rim_heights(surface.mesh.triangles, xy, radius, cut_radius, heights if drawn else None)
    outside = np.flatnonzero(~np.isfinite(rims.lowest))
    if len(outside):
        x, y = xy[outside[0]]
        (x0, y0, _), (x1, y1, _) = surface.mesh.low.tolist(), surface.mesh.high.tolist()
        if not surface.mesh.closed and x0 < x < x1 and y0 < y < y1:
            raise PlanError(
                "{} is not closed, and has no surface at the hole at ({:g}, {:g}), or beside it ({} in all); "
                "repair the mesh in CAD",
                surface.mesh.name,
                x,
                y,
                count_of(len(outside), "hole"),
            )
        _refuse_other_unit(part, surface.mesh)
        raise PlanError(
            "the hole at ({:g}, {:g}) is beside the surface {}, or on its edge ({} in all); the surface "
            "extends from ({:g}, {:g}) to ({:g}, {:g}); both files must have the same origin",
            x,
            y,
            surface.mesh.name,
            count_of(len(outside), "hole"),
            x0,
            y0,
            x1,
            y1,
        )
    issues = [*surface.issues, *_unit_issues(part, surface.mesh, rims.top - rims.under, radius)]
    tops = rims.top
    counts = (
        Message("R planes are measured from the highest point of the rim, depths from the drawing")
        if drawn
        else Message("the highest point is used")
    )
    uneven = np.flatnonzero(rims.top - rims.lowest > UNEVEN)
    if len(uneven):
        worst = int(uneven[np.argmax((rims.top - rims.lowest)[uneven])])
        x, y = xy[worst]
        issues.append(
            Issue(
                "L441",
                Message(
                    "the surface is uneven at {}: at ({:g}, {:g}), the rim is between Z{:.3f} and Z{:.3f}; {}",
                    count_of(len(uneven), "hole"),
                    x,
                    y,
                    rims.lowest[worst],
                    rims.top[worst],
                    counts,
                ),
            )
        )
    # Holes drawn at equal heights contain no information about the surface.
    if drawn or np.ptp(heights) > SAME_HEIGHT:
        # The surface of a solid is the finished part: below a counterbore it is lower than the top of the hole.
        of_solid = np.array([hole.depth is not None for hole in part.holes])
        different = np.flatnonzero((np.abs(heights - rims.top) > max(UNEVEN, SAME_HEIGHT)) & ~of_solid)
        if len(different):
            worst = int(different[np.argmax(np.abs(heights - rims.top)[different])])
            x, y = xy[worst]
            issues.append(
                Issue(
                    "L442",
                    Message(
                        "the drawing and the surface have different heights at {}: at ({:g}, {:g}), the "
                        "drawing has Z{:.3f} and the surface Z{:.3f}; {}",
                        count_of(len(different), "hole"),
                        x,
                        y,
                        heights[worst],
                        rims.top[worst],
                        Message("depths are measured from the drawing, R planes from the higher of the two")
                        if drawn
                        else Message("the height of the surface is used"),
                    ),
                )
            )
    if drawn:
        tops = heights
    if not surface.mesh.closed:
        issues.append(
            Issue(
                "L443",
                Message("{} is not closed; missing parts are treated as air", surface.mesh.name),
                severity=Severity.WARNING,
            )
        )
    return HoleTops(tops, rims.top, rims.under, issues)


def rim_heights(
    triangles: NDArray[np.float64],
    xy: NDArray[np.float64],
    radius: NDArray[np.float64],
    cut_radius: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    tops: NDArray[np.float64] | None,
) -> HoleRims:
    """Return the highest and the lowest point of the surface at each hole, and the underside of the part.

    The highest point is searched within the full radius of the tools. The other heights only consider the radius that
    is cut. `tops` contains the heights of the tops of the holes, float64[n], mm, or is None if the holes start on the
    surface.
    """
    whole = heights_around_holes(triangles, xy, radius)
    above = np.zeros(len(xy)) if tops is None else np.maximum(whole.top - tops, 0.0)
    cut = cut_radius(above)
    if (cut >= radius).all():
        return whole
    inner = heights_around_holes(triangles, xy, cut)
    return HoleRims(np.maximum(whole.top, inner.top), inner.lowest, inner.under)


def _refuse_other_unit(part: Part, mesh: Mesh) -> None:
    if _contains_holes(part, mesh, 1.0):
        return
    message = _describe_lengths(part, mesh)
    for name, factor in OTHER_UNITS.items():
        if factor > 1.0 and (_contains_holes(part, mesh, factor) or _similar_length(part, mesh, factor)):
            raise PlanError(
                "{}; in {}, the surface would contain the holes; give --surface-unit, or the --units of the drawing",
                message,
                name,
            )
    if any(factor < 1.0 and _similar_length(part, mesh, factor) for factor in OTHER_UNITS.values()):
        raise PlanError("{}; its unit differs; give --surface-unit, or the --units of the drawing", message)


def _unit_issues(part: Part, mesh: Mesh, thickness: NDArray[np.float64], radius: NDArray[np.float64]) -> list[Issue]:
    """Warn if the unit of the surface seems to be larger than the unit of the drawing.

    If so, all holes lie in one corner of the surface. They also span at least half of this corner or are implausibly
    deep.
    """
    deep = bool((thickness > DEEPEST * 2.0 * radius).any())
    for factor in OTHER_UNITS.values():
        if factor < 1.0 and _contains_holes(part, mesh, factor) and (deep or _similar_length(part, mesh, factor)):
            message = Message(
                "{}, in a corner of the surface; check whether --surface-unit and --units are right",
                _describe_lengths(part, mesh),
            )
            return [Issue("L445", message)]
    return []


def _describe_lengths(part: Part, mesh: Mesh) -> Message:
    x0, y0, x1, y1 = part.extents
    length = float(max((mesh.high - mesh.low)[:2]))
    return Message("{} is {:.4g} mm long and the holes span {:.4g} mm", mesh.name, length, max(x1 - x0, y1 - y0))


def _similar_length(part: Part, mesh: Mesh, factor: float) -> bool:
    """Return whether the holes span half to all of the length of the surface, which is scaled by `factor`."""
    x0, y0, x1, y1 = part.extents
    drawing, surface = max(x1 - x0, y1 - y0), float(max((mesh.high - mesh.low)[:2]))
    return drawing > 0.0 < surface and _NEARLY <= drawing / (surface * factor) <= 1.1


def _contains_holes(part: Part, mesh: Mesh, factor: float) -> bool:
    xy = part.hole_xy
    return bool(((xy >= mesh.low[:2] * factor) & (xy <= mesh.high[:2] * factor)).all())


def _box_triangles(box: NDArray[np.float64]) -> NDArray[np.float64]:
    corners = np.array([(x, y, z) for x in box[[0, 3]] for y in box[[1, 4]] for z in box[[2, 5]]])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles: NDArray[np.float64] = corners[np.array([(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)])]
    return triangles
