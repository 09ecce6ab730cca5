"""Pierces in whole metal: not in the kerf of a cut that was made before, where an arc finds nothing to burn into."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.processes.sheet.plan.cut_contours import FLATNESS
from leafcut.processes.sheet.plan.cutting import Cutting
from leafcut.processes.sheet.plan.leads.cut_starts import CutStart
from leafcut.timing.travel import Travel

#: Passes over all pierces: one that moves away may come near another.
PASSES = 8
#: Where more pierces than this are wrong, all move by what was there before the pass; else each by what is there then.
MOST_IN_TURN = 30
#: A pierce this much farther away than half a kerf is out of it, mm.
ROOM = 0.05


@dataclass(frozen=True)
class _LaidCuts:
    """The ways of the cuts in their order, and where they pierce; those that burn nothing through are far away."""

    lines: list[Any]
    tree: Any
    pierces: Any


def clear_pierces(
    cutting: Cutting, order: Sequence[CutStart], travel: Travel, start: Point | None, end: Point | None
) -> list[CutStart]:
    """Return the cuts in the same order; those that would pierce in or at an earlier kerf begin elsewhere.

    A pierce keeps a kerf from the middle of every earlier cut where one of its contour's starts does, half a kerf else,
    and at what costs least by `travel`. What a plan file fixes stays where it is.
    """
    order, drawn = list(order), _Drawn(cutting)
    for _ in range(PASSES):
        laid = _lay(drawn, order)
        wrong = [k for k in range(len(order)) if any(_bad(cutting, laid, k, order[k]))]
        moved = False
        for k in wrong:
            better = _elsewhere(drawn, laid, order, k, travel, start, end)
            if better is not None:
                order[k], moved = better, True
                laid = _lay(drawn, order) if len(wrong) <= MOST_IN_TURN else laid
        if not moved:
            break
    return order


class _Drawn:
    """The lines of cuts, each made once: of thousands of cuts few begin elsewhere from one look to the next."""

    def __init__(self, cutting: Cutting) -> None:
        self.cutting = cutting
        # With the start itself, so that no other one can have its id.
        self._lines: dict[int, tuple[CutStart, Any]] = {}

    def line(self, start: CutStart) -> Any:
        """Return the way of the torch from a start on, as a shapely line."""
        if id(start) not in self._lines:
            path: Polyline = self.cutting.cut(start).path
            self._lines[id(start)] = start, shapely.LineString(path.flattened(FLATNESS))
        return self._lines[id(start)][1]


def _lay(drawn: _Drawn, order: list[CutStart]) -> _LaidCuts:
    nothing = shapely.LineString()
    burns = [drawn.cutting.contours[s.contour].kind == "cut" for s in order]
    lines = [drawn.line(s) if b else nothing for s, b in zip(order, burns, strict=True)]
    places = [s.entry if b and s.pierce else (math.nan, math.nan) for s, b in zip(order, burns, strict=True)]
    points: Any = shapely.points(np.array(places, dtype=np.float64).reshape(-1, 2), handle_nan="skip")
    return _LaidCuts(lines, shapely.STRtree(lines), shapely.STRtree(points))


def _bad(cutting: Cutting, laid: _LaidCuts, k: int, start: CutStart, line: Any = None) -> tuple[int, int]:
    """Return how many pierces lie in a kerf, and how many at one, between the cut at `k` and all others.

    Given the `line` of a start that is tried, the pierces of later cuts in its kerf count, too.
    """
    if not start.pierce or cutting.contours[start.contour].kind != "cut":
        return 0, 0
    half = 0.5 * cutting.rules.kerf
    counts = []
    for reach in (half + ROOM, 2.0 * half):
        point = shapely.Point(*start.entry)
        earlier = laid.tree.query(point, predicate="dwithin", distance=reach)
        count = int((earlier < k).sum())
        if line is not None:
            count += int((laid.pierces.query(line, predicate="dwithin", distance=reach) > k).sum())
        counts.append(count)
    return counts[0], counts[1]


def _elsewhere(
    drawn: _Drawn,
    laid: _LaidCuts,
    order: list[CutStart],
    k: int,
    travel: Travel,
    start: Point | None,
    end: Point | None,
) -> CutStart | None:
    """Return the start of the same contour that is clear at the least cost; None where none is better than its own."""
    own, cutting = order[k], drawn.cutting
    before = order[k - 1].exit if k else start
    after = order[k + 1].entry if k + 1 < len(order) else end

    def cost(one: CutStart) -> float:
        ways = (travel(before, one.entry) if before else 0.0) + (travel(one.exit, after) if after else 0.0)
        return ways + cutting.seconds(one)

    best = None
    least = (*_bad(cutting, laid, k, own, laid.lines[k]), 0.0)
    for other in (cutting.starts[n] for n in cutting.by_contour[own.contour]):
        rank = (*_bad(cutting, laid, k, other, drawn.line(other)), cost(other))
        if rank[:2] < least[:2] or (best is not None and rank < least):
            least, best = rank, other
    return best
