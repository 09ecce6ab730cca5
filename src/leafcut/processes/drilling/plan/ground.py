"""Drilling on an uneven surface: the top of each hole, the thickness of the part there, and low travel heights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError, count_of
from leafcut.material.surface import TILES, TILES_DOGLEG, Rims, rims_of, safe_tiles
from leafcut.model.cutter import cutter_of, discs_of
from leafcut.model.heights import SAME_HEIGHT
from leafcut.model.issue import Issue, Severity
from leafcut.model.machine import Machine
from leafcut.model.mesh import Mesh
from leafcut.model.part import Part
from leafcut.model.problem import Relief
from leafcut.model.shown_stock import FixtureBox
from leafcut.model.tool import Tool

#: Unevenness of a rim that is reported, mm.
UNEVEN = 0.2
#: Clearance of a shank or a holder from the surface, mm: twice the mesh tolerance.
BODY_ROOM = 0.1
#: Heights at which the flutes of a tool wider than its hole are compared with the material beside it.
FLUTE_LEVELS = 12
#: Largest ratio between the lengths of fixture and part.
MOST_TIMES = 50.0
#: Units confused with mm, and the scale of the mesh in them; minimum share of a part's length covered by holes.
OTHER_UNITS = {"inches": 25.4, "metres": 1000.0, "mm, not inches,": 1 / 25.4}
_NEARLY = 0.5
#: Largest plausible thickness of a part, in diameters of its holes.
DEEPEST = 30.0
#: Ratio of the lengths of fixture and part above which a wrong unit is suspected.
ODD_TIMES = 8.0
#: Largest distance of a fixture from the part, relative to the length of the part.
NEAR = 0.1


class Tops(NamedTuple):
    """Per hole, float64[n], mm: its top, the surface there, and the underside of the part; issues."""

    tops: NDArray[np.float64]
    surface: NDArray[np.float64]
    under: NDArray[np.float64]
    issues: list[Issue]


@dataclass(frozen=True, eq=False)
class Ground:
    """The part and the fixtures below the tool.

    Attributes
    ----------
    mesh
        The surface, placed like the drawing.
    fixtures
        float64[k, 6]: boxes on the surface: lower corner, upper corner, mm.
    clearance
        Distance of travel moves from all of it, vertical and horizontal, mm.
    fixture
        The fixture as a mesh, or None.
    issues
        Issues of the fixture.
    """

    mesh: Mesh
    fixtures: NDArray[np.float64]
    clearance: float
    fixture: Mesh | None = None
    issues: tuple[Issue, ...] = ()

    @property
    def triangles(self) -> NDArray[np.float64]:
        """The surface and the fixtures, float64[n, 3, 3]."""
        held = [] if self.fixture is None else [self.fixture.triangles]
        return np.concatenate([self.mesh.triangles, *(_box(box) for box in self.fixtures), *held])

    @property
    def boxes(self) -> tuple[FixtureBox, ...]:
        """The fixture boxes as plain numbers."""
        return tuple((x0, y0, z0, x1, y1, z1) for x0, y0, z0, x1, y1, z1 in self.fixtures.tolist())

    @property
    def highest(self) -> float:
        """The highest point of the surface and the fixtures, mm."""
        held = [] if self.fixture is None else [float(self.fixture.high[2])]
        return float(max([float(self.mesh.high[2]), *self.fixtures[:, 5].tolist(), *held]))

    def is_free(self, x: float, y: float, radius: float, z: float) -> bool:
        """Return whether the surface is nowhere above a height within a radius of a point."""
        import shapely  # imported here because most drawings have no surface

        corners = self.mesh.triangles
        near = corners[:, :, 2].max(axis=1) > z + SAME_HEIGHT
        for axis, at in enumerate((x, y)):
            near &= (corners[:, :, axis].min(axis=1) < at + radius) & (corners[:, :, axis].max(axis=1) > at - radius)
        pieces = (_part_above(triangle, z + SAME_HEIGHT) for triangle in corners[near])
        place = shapely.Point(x, y)
        return not any(
            len(piece) and shapely.dwithin(place, shapely.MultiPoint(piece).convex_hull, radius) for piece in pieces
        )

    def relief(
        self,
        machine: Machine,
        tool: Tool,
        places: NDArray[np.float64],
        heights: NDArray[np.float64],
        otherwise: float,
        zones: NDArray[np.float64],
    ) -> Relief:
        """Return the travel heights of a tool between points; keep-out zones are crossed at `otherwise`."""
        most = TILES_DOGLEG if machine.rapid_style == "dogleg" else TILES
        bars = [_box(np.array([*zone[:2], 0.0, *zone[2:], otherwise - self.clearance])) for zone in zones]
        lowest, room = float(heights.min(initial=np.inf)), self.clearance
        around = np.concatenate([self.triangles, *bars])
        highest = float(around[:, :, 2].max())
        bodies = [
            (disc.radius + room, room - disc.above) for disc in discs_of(tool) if lowest + disc.above < highest + room
        ]
        tiles = safe_tiles(around, 0.5 * tool.diameter + room, room, most, bodies)
        acceleration = machine.acceleration[2] * machine.acceleration_factor
        return Relief(
            places, heights, otherwise, np.minimum(tiles.heights, otherwise), tiles.x, tiles.y, tiles.side,
            machine.rapid_velocity[2], acceleration,
        )  # fmt: skip


def fixture_boxes(words: Sequence[str]) -> NDArray[np.float64]:
    """Parse boxes ``x0 y0 z0 x1 y1 z1`` to float64[k, 6], lower corner first.

    Raises
    ------
    OptionError
        A box has not six numbers, or no volume.
    """
    boxes = []
    for word in words:
        parts = word.replace(",", " ").split()
        try:
            numbers = [float(part) for part in parts]
        except ValueError:
            numbers = []
        if word.lower().endswith((".stl", ".step", ".stp")):
            raise OptionError(f'--fixture "{word}": takes boxes; give a file with --fixture-file')
        if len(numbers) != 6 or not np.isfinite(numbers).all():
            raise OptionError(f'--fixture "{word}": needs six numbers, x0 y0 z0 x1 y1 z1, in mm')
        low, high = np.minimum(numbers[:3], numbers[3:]), np.maximum(numbers[:3], numbers[3:])
        if not (high > low).all():
            raise OptionError(f'--fixture "{word}": has no volume; give two opposite corners')
        boxes.append([*low, *high])
    return np.array(boxes, dtype=np.float64).reshape(-1, 6)


def checked_fixture(fixture: Mesh, mesh: Mesh) -> tuple[Mesh, list[Issue]]:
    """Return the mesh of a fixture, replaced by its bounding box if it is not closed, and issues.

    Raises
    ------
    PlanError
        The fixture is far from the surface, or its size is implausible: its unit or its zero must differ.
    """
    size, place = fixture.high - fixture.low, fixture.low
    length = float(max((mesh.high - mesh.low)[:2]))
    beside = float(np.hypot(*np.maximum(np.maximum(fixture.low - mesh.high, mesh.low - fixture.high), 0.0)[:2]))
    own = float(size.max())
    odd = _odd_unit(fixture, mesh, own, length)
    if beside > length or not length / MOST_TIMES < own < MOST_TIMES * length:
        words = (
            f"the fixture {fixture.name} is {own:.4g} mm long, {beside:.4g} mm beside the surface, which is "
            f"{length:.4g} mm long"
        )
        if odd:
            raise PlanError(f"{words}; in {odd} it would stand at it: save it in the unit of the surface")
        raise PlanError(f"{words}: check its unit (--surface-unit) and its zero")
    issues = [
        Issue(
            "L444",
            f"{fixture.name}: {size[0]:.4g} × {size[1]:.4g} × {size[2]:.4g} mm, its lower corner at {place[0]:.4g}, "
            f"{place[1]:.4g}, Z{place[2]:.4g}",
            severity=Severity.NOTE,
        )
    ]
    if odd:
        words = (
            f"{fixture.name} is {own:.4g} mm long and the surface {length:.4g} mm; in {odd} it would stand at the "
            "surface, too: look whether it has the unit of the surface, in which both are read (--surface-unit)"
        )
        issues.append(Issue("L445", words))
    if not fixture.closed:
        issues.append(
            Issue(
                "L443",
                f"{fixture.name} is not closed, so its whole bounding box counts",
                severity=Severity.WARNING,
            )
        )
        fixture = Mesh(_box(np.concatenate([fixture.low, fixture.high])), fixture.name)
    return fixture, issues


def _odd_unit(fixture: Mesh, mesh: Mesh, own: float, length: float) -> str:
    """Return the unit in which a fixture of implausible size would fit the part, or ""."""
    for name, times in OTHER_UNITS.items():
        if not (own < length / ODD_TIMES if times > 1.0 else own > length * ODD_TIMES):
            continue
        gap = np.maximum(fixture.low * times - mesh.high, mesh.low - fixture.high * times)
        if float(gap.max()) < NEAR * length and length / ODD_TIMES <= own * times <= length * ODD_TIMES:
            return name
    return ""


def check_fixture(xy: NDArray[np.float64], tips: NDArray[np.float64], radius: float, ground: Ground) -> None:
    """Refuse a hole if the fixture's mesh is above the tip of the tool, within its radius.

    Parameters
    ----------
    xy, tips
        float64[n, 2], float64[n]: the holes, and the lowest point of the tool in each, mm.
    """
    if ground.fixture is None or not len(xy):
        return
    under = _meeting(ground.fixture.triangles, xy, tips, radius)
    if under:
        x, y = xy[min(under)]
        raise PlanError(
            f"the hole at {x:g}, {y:g} is under the fixture {ground.fixture.name}, or closer to it than the radius of "
            f"its tool ({count_of(len(under), 'hole')} in all); move the fixture, or leave the holes out"
        )


def check_bodies(
    tool: Tool, xy: NDArray[np.float64], tops: NDArray[np.float64], tips: NDArray[np.float64], ground: Ground
) -> None:
    """Refuse a hole in which the shank or holder of its tool would hit the surface, a fixture or the rim of the hole.

    These are wider than the tool; between holes, the travel heights keep them clear (`Ground.relief`).

    Parameters
    ----------
    xy, tops, tips
        float64[n, 2], float64[n], float64[n]: the holes, and the heights of top and tip in each, mm.
    """
    triangles = ground.triangles
    for disc in discs_of(tool):
        low = tips + disc.above - BODY_ROOM
        meets = set(np.flatnonzero(low < tops).tolist())
        if float(low.min(initial=np.inf)) < ground.highest:
            meets |= _meeting(triangles, xy, low, disc.radius + BODY_ROOM)
        if not meets:
            continue
        first = min(meets)
        x, y = xy[first]
        what = "the rim of the hole" if low[first] < tops[first] else "the wall beside the hole"
        raise PlanError(
            f"{tool.label}: at {x:g}, {y:g} its {disc.body}, \u00d8 {2.0 * disc.radius:g} mm, comes down to "
            f"Z{tips[first] + disc.above:.3f} and meets {what} ({count_of(len(meets), 'hole')} in all); use a longer "
            "tool, or leave the holes out"
        )


def check_beside(
    tool: Tool,
    xy: NDArray[np.float64],
    widths: NDArray[np.float64],
    tops: NDArray[np.float64],
    tips: NDArray[np.float64],
    ground: Ground,
) -> None:
    """Refuse a hole of a solid in which a tool wider than the hole would cut the material beside it.

    The surface of a solid is the finished part: nothing above the top of a hole may be cut. A centre drill makes its
    chamfer below the top, and needs clearance for its greater width above it.

    Parameters
    ----------
    xy, widths
        float64[n, 2], float64[n]: the holes, and their largest diameters, mm.
    tops, tips
        float64[n], float64[n]: the heights of top and tip in each hole, mm.
    """
    cutter = cutter_of(tool)
    wider = np.flatnonzero(cutter.radius > 0.5 * widths + BODY_ROOM)
    if not len(wider):
        return
    xy, tops, tips = xy[wider], tops[wider] + UNEVEN, tips[wider]
    full = np.maximum(tops, tips + cutter.height(cutter.radius))
    meets = set[int]()
    for share in np.linspace(0.0, 1.0, FLUTE_LEVELS):
        heights = tops + share * (full - tops)
        reach = np.array([cutter.radius_at(deep) for deep in (heights - tips).tolist()])
        for radius in np.unique(reach).tolist():
            at = np.flatnonzero(reach == radius)
            met = _meeting(ground.triangles, xy[at], heights[at], max(radius - BODY_ROOM, 0.0))
            meets |= {int(at[k]) for k in met}
    if meets:
        first = min(meets)
        x, y = xy[first]
        raise PlanError(
            f"{tool.label}: at {x:g}, {y:g} it is wider than the hole and cuts the wall beside it "
            f"({count_of(len(meets), 'hole')} in all); use a narrower tool, or leave the holes out"
        )


def _meeting(
    triangles: NDArray[np.float64], xy: NDArray[np.float64], heights: NDArray[np.float64], radius: float
) -> set[int]:
    """Return the indices of points, float64[n, 2], with a mesh above a height, float64[n], within a radius."""
    import shapely  # as above

    triangles = triangles[triangles[:, :, 2].max(axis=1) > heights.min()]
    if not len(triangles):
        return set()
    flat: Any = shapely.convex_hull(shapely.multipoints(triangles[:, :, :2]))
    places: Any = shapely.points(xy)
    place, which = shapely.STRtree(flat).query(places, predicate="dwithin", distance=radius)
    whole = triangles[which, :, 2].min(axis=1) > heights[place]
    meets = set(place[whole].tolist())
    for one, triangle in zip(place[~whole].tolist(), which[~whole].tolist(), strict=True):
        if one in meets:
            continue
        piece = _part_above(triangles[triangle], float(heights[one]))
        if len(piece) and shapely.dwithin(places[one], shapely.MultiPoint(piece).convex_hull, radius):
            meets.add(one)
    return meets


def _part_above(corners: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Clip a triangle to the part above a height; return its corners in top view, float64[k, 2]."""
    found = [corner[:2] for corner in corners if corner[2] > height]
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if (here[2] > height) != (there[2] > height):
            found.append((here + (there - here) * ((height - here[2]) / (there[2] - here[2])))[:2])
    return np.array(found).reshape(-1, 2)


def tops_of(
    part: Part,
    ground: Ground,
    radius: NDArray[np.float64],
    bite: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    drawn: bool,
) -> Tops:
    """Return the top of each hole, and the underside of the part there.

    Parameters
    ----------
    radius
        float64[n]: radius of the widest tool of each hole, mm. The highest point within it is the top.
    bite
        Function from the height of the surface above the top of each hole, float64[n], to the widest radius cut, mm.
        The part must cover this radius.
    drawn
        Each hole starts at its drawn height; the surface is only compared.

    Raises
    ------
    PlanError
        A hole is beside the surface or under a fixture, or the surface has another unit than the drawing.
    """
    xy = part.hole_xy
    heights = np.array([hole.z for hole in part.holes], dtype=np.float64)
    rims = rims_within(ground.mesh.triangles, xy, radius, bite, heights if drawn else None)
    beside = np.flatnonzero(~np.isfinite(rims.lowest))
    if len(beside):
        x, y = xy[beside[0]]
        (x0, y0, _), (x1, y1, _) = ground.mesh.low.tolist(), ground.mesh.high.tolist()
        if not ground.mesh.closed and x0 < x < x1 and y0 < y < y1:
            raise PlanError(
                f"{ground.mesh.name} is not closed, and nothing of it is at the hole at {x:g}, {y:g}, or beside it "
                f"({count_of(len(beside), 'hole')} in all); mend the mesh in CAD"
            )
        _refuse_other_unit(part, ground.mesh)
        raise PlanError(
            f"the hole at {x:g}, {y:g} is beside the surface {ground.mesh.name}, or on its edge "
            f"({count_of(len(beside), 'hole')} in all); it goes from {x0:g}, {y0:g} to {x1:g}, {y1:g}: "
            "both must have the same zero"
        )
    _check_fixtures(part, ground, radius)
    issues, tops = [*ground.issues, *_other_unit(part, ground.mesh, rims.top - rims.under, radius)], rims.top
    counts = "R planes count from the higher place, depths from the drawing" if drawn else "the higher place counts"
    uneven = np.flatnonzero(rims.top - rims.lowest > UNEVEN)
    if len(uneven):
        worst = int(uneven[np.argmax((rims.top - rims.lowest)[uneven])])
        x, y = xy[worst]
        issues.append(
            Issue(
                "L441",
                f"{count_of(len(uneven), 'hole')} on uneven ground: at {x:g}, {y:g} the rim is between Z"
                f"{rims.lowest[worst]:.3f} and Z{rims.top[worst]:.3f}; {counts}",
            )
        )
    # Holes drawn at equal heights contain no information about the surface.
    if drawn or np.ptp(heights) > SAME_HEIGHT:
        # The surface of a solid is the finished part: below a counterbore it is lower than the top of the hole.
        of_solid = np.array([hole.depth is not None for hole in part.holes])
        other = np.flatnonzero((np.abs(heights - rims.top) > max(UNEVEN, SAME_HEIGHT)) & ~of_solid)
        if len(other):
            worst = int(other[np.argmax(np.abs(heights - rims.top)[other])])
            x, y = xy[worst]
            issues.append(
                Issue(
                    "L442",
                    f"{count_of(len(other), 'hole')} drawn at another height than the surface has: at {x:g}, {y:g} the "
                    f"drawing says Z{heights[worst]:.3f} and the surface Z{rims.top[worst]:.3f}; "
                    + (
                        "depths count from the drawing, R planes from the higher one" if drawn else "the surface counts"
                    ),
                )
            )
    if drawn:
        tops = heights
    if not ground.mesh.closed:
        issues.append(
            Issue(
                "L443",
                f"{ground.mesh.name} is not closed; missing parts count as air",
                severity=Severity.WARNING,
            )
        )
    return Tops(tops, rims.top, rims.under, issues)


def rims_within(
    triangles: NDArray[np.float64],
    xy: NDArray[np.float64],
    radius: NDArray[np.float64],
    bite: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    tops: NDArray[np.float64] | None,
) -> Rims:
    """Return the highest point within the full radius of tools, and the lowest point and underside of the material cut.

    `tops`, float64[n], are the heights of the holes' tops; None: on the surface.
    """
    whole = rims_of(triangles, xy, radius)
    above = np.zeros(len(xy)) if tops is None else np.maximum(whole.top - tops, 0.0)
    cut = bite(above)
    if (cut >= radius).all():
        return whole
    inner = rims_of(triangles, xy, cut)
    return Rims(np.maximum(whole.top, inner.top), inner.lowest, inner.under)


def _check_fixtures(part: Part, ground: Ground, radius: NDArray[np.float64]) -> None:
    for box in ground.fixtures:
        away = np.maximum(np.maximum(box[:2] - part.hole_xy, part.hole_xy - box[3:5]), 0.0)
        under = np.flatnonzero(np.hypot(*away.T) < radius)
        if len(under):
            x, y = part.hole_xy[under[0]]
            raise PlanError(
                f"the hole at {x:g}, {y:g} is under a fixture, or closer to it than the radius of its tool "
                f"({count_of(len(under), 'hole')} in all); move the fixture, or leave the holes out"
            )


def _refuse_other_unit(part: Part, mesh: Mesh) -> None:
    """Refuse a surface that does not contain the holes, if it would in another unit."""
    if _holds(part, mesh, 1.0):
        return
    words = _lengths(part, mesh)
    for name, times in OTHER_UNITS.items():
        if times > 1.0 and (_holds(part, mesh, times) or _as_long(part, mesh, times)):
            raise PlanError(
                f"{words}: in {name} it would hold them; give --surface-unit, or the --units of the drawing"
            )
    if any(times < 1.0 and _as_long(part, mesh, times) for times in OTHER_UNITS.values()):
        raise PlanError(f"{words}: its unit differs; give --surface-unit, or the --units of the drawing")


def _other_unit(part: Part, mesh: Mesh, thickness: NDArray[np.float64], radius: NDArray[np.float64]) -> list[Issue]:
    """Return a warning if all holes fit in a corner of the surface, as if it were scaled to a smaller unit.

    The holes must also cover at least half of that corner, or be implausibly deep through the part.
    """
    deep = bool((thickness > DEEPEST * 2.0 * radius).any())
    for times in OTHER_UNITS.values():
        if times < 1.0 and _holds(part, mesh, times) and (deep or _as_long(part, mesh, times)):
            words = f"{_lengths(part, mesh)}, in a corner of it: look whether --surface-unit and --units are right"
            return [Issue("L445", words)]
    return []


def _lengths(part: Part, mesh: Mesh) -> str:
    x0, y0, x1, y1 = part.extents
    length = float(max((mesh.high - mesh.low)[:2]))
    return f"{mesh.name} is {length:.4g} mm long and the holes lie over {max(x1 - x0, y1 - y0):.4g} mm"


def _as_long(part: Part, mesh: Mesh, times: float) -> bool:
    """Return whether the holes cover between half and all of the length of the surface, scaled by `times`."""
    x0, y0, x1, y1 = part.extents
    drawing, surface = max(x1 - x0, y1 - y0), float(max((mesh.high - mesh.low)[:2]))
    return drawing > 0.0 < surface and _NEARLY <= drawing / (surface * times) <= 1.1


def _holds(part: Part, mesh: Mesh, times: float) -> bool:
    """Return whether all holes are inside the bounding box of the surface, scaled by `times`."""
    xy = part.hole_xy
    return bool(((xy >= mesh.low[:2] * times) & (xy <= mesh.high[:2] * times)).all())


def _box(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the twelve triangles of a box, float64[12, 3, 3]."""
    corners = np.array([(x, y, z) for x in box[[0, 3]] for y in box[[1, 4]] for z in box[[2, 5]]])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles: NDArray[np.float64] = corners[np.array([(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)])]
    return triangles
