"""Measure the step-over of a path, which is the distance between neighbouring passes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, Indices
from leafcut.geometry.cells import Cells, number_points
from leafcut.kernels.step_over import Reaches, find_smallest_touching_discs
from leafcut.material.bands import sort_into_bands
from leafcut.material.tool_steps import STRAIGHT_ON, ToolSteps, steps_along_path
from leafcut.model.pocket import PocketPath, PocketRules

#: Maximum distance between neighbouring passes, in tool diameters. Passes farther apart leave uncut area, which is
#: reported elsewhere.
FARTHEST = 1.5
#: Maximum angle between two neighbouring passes, rad.
SIDE_BY_SIDE = math.radians(30.0)
#: Maximum relative difference between the radii of discs that touch the same passes.
_EQUAL = 1e-4
#: Maximum distance between the ends of steps that count as a single point, mm.
_SAME = 1e-5
#: Maximum distance between points that count as equal, mm.
_SAME_POINT = 1e-4
#: How far a change reaches, in maximum distances between neighbours. A change affects the neighbour of a point, and the
#: corner of this neighbour.
_REACHES = 2
#: Number of gaps that are compared with the region at the same time.
_BATCH = 512


class PassGaps(NamedTuple):
    """The maximum distances between neighbouring passes, mm.

    `core` applies where two fronts of passes meet. `step_over` applies everywhere else.
    """

    step_over: float
    core: float


def measure_widest_step_overs(
    path: ToolSteps, centres: Any, rules: PocketRules, passes: NDArray[np.bool_] | None = None
) -> PassGaps:
    """Return the largest distances between neighbouring passes, mm, or 0 if no pass has a neighbour.

    On both sides of each point of the path, a disc touches the pass and grows until it touches another point of the
    path. This second point belongs to the neighbouring pass. Its height above the tangent of the first pass is the gap,
    just as a machinist would measure it perpendicular to the pass. If the disc touches a corner of the neighbouring
    pass, the gap is measured from the sides of that corner.

    Each point has a gap on both sides, and only the smaller gap counts. The planner placed the pass next to the closer
    neighbour, or next to the wall, which has no gap. The step-over is the maximum of these smaller gaps. On the farther
    side, two fronts may meet, such as the two sides of a last ring or passes along the walls of a narrow channel. If
    the gap between two fronts is less than two step-overs, no full pass fits between them. Such a gap is reported as
    `core`. If everything is cleared, it is at most as wide as the tool. Wider gaps count as step-over. For rings, the
    result is therefore the distance between the rings, no matter how much remains in the middle. For parallel lines, it
    is the distance between the lines.

    Between straight lines, the gap is their distance. Between offset rings, it is their offset. Along a spiral, it is
    the pitch. The diagonal between the corners of two rings is longer (1.41 times at a right angle), as in all offset
    pockets. This diagonal does not count, because the corner of each ring is at the offset from both sides of the
    neighbouring ring. If a corner is rounded and the rings do not come closer, the gap is larger. The two sides of a
    corner of the same pass are not neighbours. If two sides diverge by more than `SIDE_BY_SIDE`, their mean distance is
    half of their maximum distance.

    The distance to a wall is not a gap. If it is too large, it shows up as uncovered area instead. A disc is ignored if
    its centre, or the line to its centre, is outside the allowed tool centres. Passes on both sides of an island are
    therefore not neighbours. If passes are more than `FARTHEST` diameters apart, uncovered area lies between them.

    The chords of arcs and the steps of the path limit the accuracy to some hundredths of a percent.

    Parameters
    ----------
    centres
        shapely geometry of the allowed tool centres.
    passes
        Mask of the points whose neighbours are searched, or None for all points.
    """
    sides = _build_sides(path, centres, rules, passes)
    if sides is None:
        return PassGaps(0.0, 0.0)
    core, is_lost = sides.discs.largest_fitting(sides.rows, sides.gap, both=False), sides.is_lost
    nearer = sides.discs.largest_fitting(sides.rows, sides.nearer, both=True)
    return PassGaps(max(nearer, sides.discs.largest_fitting(sides.rows[is_lost], sides.gap[is_lost], both=False)), core)


def points_beyond_step_over(
    path: ToolSteps, centres: Any, rules: PocketRules, passes: NDArray[np.bool_] | None = None
) -> Floats:
    """Return the points of a path, float64[n, 2], that are more than the step-over away from the nearest pass."""
    sides = _build_sides(path, centres, rules, passes)
    if sides is None:
        return np.zeros((0, 2))
    wide_rows = sides.rows[(sides.nearer > rules.step_over) | sides.is_lost]
    fitting = sides.discs.fits(wide_rows) & (
        sides.discs.fits(sides.discs.opposite(wide_rows)) | sides.is_lost[np.isin(sides.rows, wide_rows)]
    )
    points: Floats = sides.discs.corners[wide_rows[fitting], 0]
    return points


class _Sides(NamedTuple):
    """The sides of steps that have a neighbouring pass.

    Attributes
    ----------
    rows
        Row of each side in `discs`.
    gap
        Gap on this side, mm.
    nearer
        The smaller gap of both sides of the step, mm.
    is_lost
        Mask of the sides on which a full pass is missing.
    """

    discs: _Discs
    rows: Indices
    gap: Floats
    nearer: Floats
    is_lost: NDArray[np.bool_]


def _build_sides(path: ToolSteps, centres: Any, rules: PocketRules, passes: NDArray[np.bool_] | None) -> _Sides | None:
    moving = np.flatnonzero((path.step > 0.0) & (True if passes is None else passes))
    if not len(moving):
        return None
    # Measure in the middle of the steps, away from corners.
    xy = path.xy[moving] - 0.5 * path.step[moving, None] * path.chord[moving]
    normal = np.column_stack([-path.chord[moving, 1], path.chord[moving, 0]])
    start, normal = np.concatenate([xy, xy]), np.concatenate([normal, -normal])
    height, touch, radius = _find_neighbouring_passes(start, normal, path.xy, rules)
    # If the angle between two contacts is a, seen from the centre of the disc, each contact is r (1 − cos a) above the
    # tangent at the other.
    is_side_by_side = height >= radius * (1.0 + math.cos(SIDE_BY_SIDE))
    gap = _measured_from_sides(path, moving, np.where(is_side_by_side, height, 0.0), touch, start, normal)
    rows = np.flatnonzero(gap > 0.0)
    discs = _Discs(start, start + radius[:, None] * normal, path.xy[touch], centres, rules)
    # On the other side, a contact at any angle counts. A wall gives no contact.
    nearer = np.minimum(gap, np.roll(height, len(moving)))[rows]
    return _Sides(discs, rows, gap[rows], nearer, gap[rows] >= 2.0 * rules.step_over * (1.0 - _EQUAL))


class _Discs:
    """Discs between neighbouring passes.

    The discs on the left of each step come first, followed by the discs on the right.
    """

    def __init__(self, start: Floats, middle: Floats, touch: Floats, centres: Any, rules: PocketRules) -> None:
        self.corners = np.stack([start, middle, touch], axis=1)
        self.region = shapely.buffer(centres, 2.0 * rules.tolerance)
        shapely.prepare(self.region)

    def largest_fitting(self, rows: Indices, sizes: Floats, both: bool) -> float:
        """Return the largest of the `sizes` whose disc lies in the region, or 0 if no disc does.

        With `both`, the disc on the opposite side of the step must lie in the region, too.
        """
        order = np.argsort(-sizes)
        rows, sizes = rows[order], sizes[order]
        for first in range(0, len(rows), _BATCH):
            batch = rows[first : first + _BATCH]
            fits = self.fits(batch)
            if both:
                fits &= self.fits(self.opposite(batch))
            if fits.any():
                return float(sizes[first + int(np.argmax(fits))])
        return 0.0

    def opposite(self, rows: Indices) -> Indices:
        return (rows + len(self.corners) // 2) % len(self.corners)

    def fits(self, rows: Indices) -> NDArray[np.bool_]:
        """Return a mask of the discs that lie in the region.

        The line from the step to the centre of the disc must lie in the region, too.
        """
        fits: NDArray[np.bool_] = shapely.covers(self.region, shapely.linestrings(self.corners[rows]))
        return fits


def _measured_from_sides(
    path: ToolSteps, moving: Indices, height: Floats, touch: Indices, start: Floats, normal: Floats
) -> Floats:
    """Return the height of each neighbour. At a corner, measure the height from the sides of the corner.

    This never increases a height. `moving` contains the rows of the steps. The other arrays contain the left sides of
    all steps, followed by the right sides. A height of 0 means that the side has no parallel neighbour.
    """
    ends, starts = path.xy[moving], path.xy[moving] - path.step[moving, None] * path.chord[moving]
    steps, node = len(moving), number_points(np.concatenate([ends, starts, path.xy]), _SAME)
    step, corner = np.tile(np.arange(steps), 2), node[: 2 * steps]
    order = np.argsort(corner, kind="stable")
    step, corner = step[order], corner[order]
    is_corner = _changes_direction(path.chord[moving][step], corner)
    rows_to_check = np.flatnonzero(height > 0.0)
    corner_of_row = node[2 * steps :][touch[rows_to_check]]
    first, last = np.searchsorted(corner, corner_of_row), np.searchsorted(corner, corner_of_row, side="right")
    has_corner = (last > first) & is_corner[np.minimum(first, len(is_corner) - 1)]
    rows_to_check, first, last = rows_to_check[has_corner], first[has_corner], last[has_corner]
    gap = height.copy()
    for offset in range(int((last - first).max(initial=0))):
        selected = first + offset < last
        rows, neighbour = rows_to_check[selected], step[first[selected] + offset]
        side = np.where(
            ((start[rows] - start[neighbour]) * normal[neighbour]).sum(axis=1) > 0.0, neighbour, neighbour + steps
        )
        gap[rows] = np.where(height[side] > 0.0, np.minimum(gap[rows], height[side]), gap[rows])
    return gap


def _changes_direction(direction: Floats, corner: Indices) -> NDArray[np.bool_]:
    """Return a mask of the corners at which the direction of the steps changes.

    Steps that meet at the same corner are consecutive.
    """
    new = np.append(True, corner[1:] != corner[:-1])
    group = np.cumsum(new) - 1
    along = np.abs((direction * direction[np.flatnonzero(new)][group]).sum(axis=1))
    result: NDArray[np.bool_] = (np.minimum.reduceat(along, np.flatnonzero(new)) < math.cos(STRAIGHT_ON))[group]
    return result


def _find_neighbouring_passes(
    xy: Floats, normal: Floats, candidates: Floats, rules: PocketRules
) -> tuple[Floats, Indices, Floats]:
    """Find the neighbour of each point on the side of its normal.

    Returns
    -------
    height
        Height of the neighbour above the tangent, float64[n], mm, or 0 without a neighbour.
    row
        Row of the neighbour in `candidates`, int64[n].
    radius
        Radius of the disc between the passes, float64[n], mm.
    """
    height, row, radius = np.zeros(len(xy)), np.zeros(len(xy), np.int64), np.zeros(len(xy))
    reaches = Reaches(0.255 * rules.step_over, FARTHEST * rules.tool_diameter)
    x, y, nx, ny = np.concatenate([xy, normal], axis=1).T.copy()
    find_smallest_touching_discs(
        sort_into_bands(candidates, 2.0 * reaches.least), x, y, nx, ny, reaches, _EQUAL, height, row, radius
    )
    return height, row, radius


class WidePlaceFinder:
    """Finds the points of a path whose distance to the nearest neighbouring pass exceeds the step-over.

    If the path has changed since the last call, the finder only searches near the change.
    """

    def __init__(self, centres: Any, rules: PocketRules) -> None:
        self.centres, self.rules = centres, rules
        self.cells = Cells(centres.bounds, FARTHEST * rules.tool_diameter, 2 * _REACHES + 4)
        self.previous, self.wide = np.zeros((0, 2)), np.zeros((0, 2))

    def __call__(self, pocket_path: PocketPath) -> Floats:
        """Return the points of a path that are too far from the nearest neighbouring pass, float64[n, 2], mm."""
        path = steps_along_path(pocket_path, self.rules)
        moved_cells = self.cells.cells_of(
            np.vstack([_without_points(path.xy, self.previous), _without_points(self.previous, path.xy)])
        )
        changed = self.cells.cells_around(moved_cells, _REACHES)
        to_check = np.isin(self.cells.cells_of(path.xy), self.cells.cells_around(changed, 1))
        new = points_beyond_step_over(path, self.centres, self.rules, to_check)
        old = self.wide[~np.isin(self.cells.cells_of(self.wide), changed)]
        self.previous, self.wide = path.xy, np.vstack([old, new[np.isin(self.cells.cells_of(new), changed)]])
        return self.wide


def _without_points(points: Floats, excluded: Floats) -> Floats:
    key = number_points(np.vstack([points, excluded]), _SAME_POINT)
    return points[~np.isin(key[: len(points)], key[len(points) :])]
