"""Compute the area that a pocket path removes by sweeping the tool along the path.

This does not depend on path planning.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.arrays import Floats, consecutive_segments
from leafcut.geometry.regions import FINE, chords_per_quarter, swept_region, tool_centres
from leafcut.material.tool_steps import ToolSteps, steps_along_path
from leafcut.model.pocket import Pocket, PocketPath, PocketRules

if TYPE_CHECKING:
    from leafcut.material.engagement import Engaged

#: Number of steps that are swept together, which limits the memory use.
_BATCH = 4096


@dataclass(frozen=True, eq=False)
class Removal:
    """The effect of a path on a pocket.

    Attributes
    ----------
    pocket, reachable, centres
        shapely geometry: the pocket, the area that the tool can clear, and the allowed tool centres.
    swept
        Area that the tool sweeps.
    gouges
        Cuts that go beyond the walls by more than the tolerance.
    uncovered
        Reachable area that remains, without films thinner than the tolerance.
    """

    pocket: Any
    reachable: Any
    centres: Any
    swept: Any
    gouges: Any
    uncovered: Any


def measure_removal(pocket: Pocket, path: PocketPath, rules: PocketRules) -> Removal:
    """Sweep a disc with the diameter of the tool along all feed moves of a path.

    Each chord is swept separately and is accurate to an eighth of the tolerance. The union of the resulting capsules is
    the swept area. A buffer of the whole line would round its concave corners. Gouges are computed from the exact
    distance between the path and the walls. A path at the correct distance therefore has no gouges, not even slivers.

    Raises
    ------
    PlanError
        The outline and the islands of the pocket cross themselves or touch.
    """
    shape = pocket.region(rules.tolerance)
    centres = tool_centres(shape, rules.radius, rules.tolerance)
    reachable = swept_region(centres, rules.radius, rules.tolerance).intersection(shape)
    steps = _path_chords(path, rules)
    cleared = cleared_area(steps, rules)
    uncleared, film = reachable.difference(cleared), 0.5 * rules.tolerance
    uncovered = uncleared.buffer(-film).buffer(film, join_style="mitre").intersection(uncleared)
    gouges = _gouged_area(shape, steps, rules) if len(steps) else shapely.Polygon()
    return Removal(shape, reachable, centres, cleared, gouges, uncovered)


def engaged_tool_path(path: PocketPath, rules: PocketRules) -> tuple[ToolSteps, Engaged]:
    """Sample the tool path in small steps, and return the engagement at each step.

    The engagement is 0 during the entry.
    """
    from leafcut.material.engagement import (
        engagement_along_path,
    )  # loads kernels, which are not needed if a file is refused

    tool_path = steps_along_path(path, rules)
    return tool_path, engagement_along_path(tool_path, rules, entry_mask(path, tool_path))


def entry_mask(path: PocketPath, tool_path: ToolSteps) -> NDArray[np.bool_]:
    """Return a mask of the points on entry loops, which the tool follows while it descends."""
    entered: NDArray[np.bool_] = np.array([piece.kind == "entry" for piece in path.pieces], dtype=bool)[tool_path.piece]
    return entered


def min_reported_width(rules: PocketRules) -> float:
    """Return the minimum width of cut, mm, that is reported as wider than the step-over.

    Curves change the width slightly, so this width exceeds the step-over by a margin. The margin is half the step-over
    or half the difference to a full-width cut, whichever is less.
    """
    return rules.step_over + 0.5 * min(rules.step_over, rules.tool_diameter - rules.step_over)


def _path_chords(path: PocketPath, rules: PocketRules) -> Floats:
    """Return the chords of a path, float64[n, 2, 2], mm. A section without motion becomes a chord of length 0."""
    fine, chords = FINE * rules.tolerance, [np.zeros((0, 2, 2))]
    for piece in path.pieces:
        points = piece.path.flattened(fine)
        points = np.repeat(points, 2, axis=0) if len(points) == 1 else points
        chords.append(consecutive_segments(points))
    result = np.concatenate(chords)
    return np.unique(result, axis=0) if len(result) else result


def cleared_area(steps: Floats, rules: PocketRules) -> Any:
    """Return the area that a tool clears along straight steps. The result is accurate to an eighth of the tolerance."""
    return swept_area(steps, rules.radius, chords_per_quarter(rules.radius, FINE * rules.tolerance))


def steps_near(steps: Floats, places: Floats, rules: PocketRules) -> Floats:
    """Return the steps whose bounding box is within a tool diameter of the bounding box of the given points."""
    corners = places.reshape(-1, 2)
    low, high = corners.min(axis=0) - rules.tool_diameter, corners.max(axis=0) + rules.tool_diameter
    near: Floats = steps[((steps.max(axis=1) >= low) & (steps.min(axis=1) <= high)).all(axis=1)]
    return near


def swept_area(steps: Floats, radius: float, quad_segs: int) -> Any:
    """Return the area that a disc sweeps along all steps.

    The result is the union of the areas of the steps (capsules), because a buffer of the whole line would round its
    concave corners.
    """
    # GEOS cannot buffer a line of length 0, so a point replaces it.
    moving = (steps[:, 0] != steps[:, 1]).any(axis=1)
    lines = np.concatenate([shapely.linestrings(steps[moving]), shapely.points(steps[~moving, 0])])
    unions = [
        shapely.union_all(shapely.buffer(lines[first : first + _BATCH], radius, quad_segs=quad_segs))
        for first in range(0, len(lines), _BATCH)
    ]
    return shapely.union_all(unions) if unions else shapely.Polygon()


def _gouged_area(shape: Any, steps: Floats, rules: PocketRules) -> Any:
    lines, walls = shapely.linestrings(steps), shape.boundary
    shapely.prepare(shape)
    shapely.prepare(walls)
    # The tolerance allows for the chords of the walls and of the path.
    near = shapely.dwithin(walls, lines, rules.radius - rules.tolerance) | ~shapely.intersects(shape, lines)
    if not near.any():
        return shapely.Polygon()
    outside = cleared_area(steps[near], rules).difference(shape)
    violating = outside.difference(shape.buffer(rules.tolerance))
    # The shallow parts of a gouge are included; films along intact walls are not.
    return outside.intersection(violating.buffer(2.0 * rules.tolerance))
