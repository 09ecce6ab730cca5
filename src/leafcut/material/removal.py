"""What a path over a pocket removes, found by sweeping the tool along it: nothing of how it was planned is used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.geometry.regions import FINE, quarter, region, swept, tool_centres
from leafcut.material.engagement import Engaged, engagement
from leafcut.material.tool_steps import ToolWay, way_of
from leafcut.model.pocket import Pocket, PocketPath, PocketRules

#: Steps that are swept together: bounds the memory.
_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class Removal:
    """What a path over a pocket leaves and what it should not have taken.

    Attributes
    ----------
    pocket, reachable, centres
        shapely geometry: the pocket, what the tool can clear of it, where its centre may be.
    swept
        What the tool sweeps.
    gouges
        What it cuts beyond the walls where that is more than the tolerance deep.
    uncovered
        What it leaves of the reachable ground; films thinner than the tolerance left out.
    """

    pocket: Any
    reachable: Any
    centres: Any
    swept: Any
    gouges: Any
    uncovered: Any


def removal(pocket: Pocket, path: PocketPath, rules: PocketRules) -> Removal:
    """Sweep a disc of the tool's diameter along all feed of a path.

    Every chord (true within an eighth of the tolerance) is swept by itself and the capsules are united: a buffer of
    the whole line would round its hollows. Whether a wall is hurt is told by the distance of the path from the walls,
    which is exact, so that a path that keeps its distance gouges by 0, and not by a sliver.

    Raises
    ------
    PlanError
        The pocket's outline or islands cross themselves or touch.
    """
    shape = region(pocket.outline, pocket.islands, rules.tolerance, pocket.name or "the pocket")
    centres = tool_centres(shape, rules.radius, rules.tolerance)
    reachable = swept(centres, rules.radius, rules.tolerance).intersection(shape)
    steps = _steps(path, rules)
    ground = capsules(steps, rules.radius, rules)
    rest, film = reachable.difference(ground), 0.5 * rules.tolerance
    uncovered = rest.buffer(-film).buffer(film, join_style="mitre").intersection(rest)
    gouges = _gouges(shape, steps, rules) if len(steps) else shapely.Polygon()
    return Removal(shape, reachable, centres, ground, gouges, uncovered)


def engaged_way(path: PocketPath, rules: PocketRules) -> tuple[ToolWay, Engaged]:
    """Return the way of a path in steps, and what the tool engages along it; nothing where it comes down."""
    way = way_of(path, rules)
    return way, engagement(way, rules, entered(path, way))


def entered(path: PocketPath, way: ToolWay) -> NDArray[np.bool_]:
    """Return which places of a way lie on the loop along which the tool comes down."""
    entered: NDArray[np.bool_] = np.array([piece.kind == "entry" for piece in path.pieces], dtype=bool)[way.piece]
    return entered


def much_wider(rules: PocketRules) -> float:
    """Return the width of a cut, mm, from which on it is told as wider than the step-over.

    In a curve round what is left a pass takes off somewhat more than the step-over, in one round what is cleared
    somewhat less. Told is what takes off half a step-over more, or comes half way nearer to a cut into the full.
    """
    return rules.step_over + 0.5 * min(rules.step_over, rules.tool_diameter - rules.step_over)


def _steps(path: PocketPath, rules: PocketRules) -> Any:
    """Return the chords of all pieces, float64[n, 2, 2]; a piece that stands still is a chord without length."""
    fine, chords = FINE * rules.tolerance, [np.zeros((0, 2, 2))]
    for piece in path.pieces:
        points = piece.path.flattened(fine)
        points = np.repeat(points, 2, axis=0) if len(points) == 1 else points
        chords.append(np.stack([points[:-1], points[1:]], axis=1))
    every = np.concatenate(chords)
    return np.unique(every, axis=0) if len(every) else every


def capsules(steps: Any, radius: float, rules: PocketRules) -> Any:
    """Return the union of the discs along all steps."""
    chords = quarter(radius, FINE * rules.tolerance)
    # A line of no length has no buffer in GEOS: it is a point.
    moving = (steps[:, 0] != steps[:, 1]).any(axis=1)
    lines = np.concatenate([shapely.linestrings(steps[moving]), shapely.points(steps[~moving, 0])])
    unions = [
        shapely.union_all(shapely.buffer(lines[first : first + _AT_ONCE], radius, quad_segs=chords))
        for first in range(0, len(lines), _AT_ONCE)
    ]
    return shapely.union_all(unions) if unions else shapely.Polygon()


def _gouges(shape: Any, steps: Any, rules: PocketRules) -> Any:
    """Return what the steps cut beyond the walls where it is more than the tolerance deep."""
    lines, walls = shapely.linestrings(steps), shape.boundary
    shapely.prepare(shape)
    shapely.prepare(walls)
    # Room for the chords of the walls and of the path.
    near = shapely.dwithin(walls, lines, rules.radius - rules.tolerance) | ~shapely.intersects(shape, lines)
    if not near.any():
        return shapely.Polygon()
    outside = capsules(steps[near], rules.radius, rules).difference(shape)
    deep = outside.difference(shape.buffer(rules.tolerance))
    # The part of a gouge that is less than the tolerance deep belongs to it; films along sound walls do not.
    return outside.intersection(deep.buffer(2.0 * rules.tolerance))
