"""Move starts along their contours while the order of the cuts stays the same.

Moving the starts shortens travel, puts pierces into solid metal, and keeps leads apart. The search for the order does
not consider the kerfs and leads of other cuts, so this is done afterwards.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.processes.sheet.plan.contours import ROUNDING
from leafcut.processes.sheet.plan.cutting import CutSequence, Cutting, HeadTravel, total_travel
from leafcut.processes.sheet.plan.leads import FLATNESS
from leafcut.processes.sheet.plan.starts import CutStart, start_with_same_leads

#: Minimum step along a contour, mm, and first step relative to the length of the contour.
FINEST, FIRST_SHARE = 0.25, 1.0 / 16.0
#: Maximum number of rounds over all cuts. A round must also shorten the total travel by this share; otherwise it is the
#: last.
ROUNDS, LEAST_GAIN = 12, 1e-5
#: Minimum gain that is not a rounding error, s or mm.
NO_GAIN = 1e-9
#: Maximum number of passes over conflicting leads, and over pierces. One pass is not enough, because a moved start may
#: cause a new conflict.
LEAD_PASSES, PIERCE_PASSES = 4, 8
#: Up to this number of conflicting pierces, the index of kerfs is rebuilt after each moved start. Otherwise, it is only
#: rebuilt once per pass, which is faster.
MOST_IN_TURN = 30
#: Minimum distance between a pierce and the edge of another kerf, mm.
ROOM = 0.05


# -- travel ----------------------------------------------------------------------------------------------------------


def slide_starts(cuts: CutSequence, head: HeadTravel, late: Callable[[], bool] = lambda: False) -> CutSequence:
    """Move the starts along their contours until travel gets no shorter, or until `late` returns True.

    Only one start moves at a time, while the cuts before and after it stay fixed. Starts that a plan file fixes do not
    move. Source: A. A. Petunin, E. G. Polishchuk and S. S. Ukolov, on the continuous cutting problem (routes of a fixed
    order).
    """
    order = list(cuts.starts)
    settled: dict[int, tuple[Point | None, Point | None]] = {}
    for _ in range(ROUNDS):
        gained = 0.0
        for k, here in enumerate(order):
            if late():
                return cuts.with_starts(order)
            around = head.adjacent_positions(order, k)
            if settled.get(k) == around:
                continue  # neither neighbour has changed since the last trial of this start
            order[k], gain = _slide_start(cuts.cutting, here, head, around)
            settled[k] = around
            gained += gain
        if gained <= LEAST_GAIN * total_travel(head.start, order, head.cost):
            break
    return cuts.with_starts(order)


def _slide_start(
    cutting: Cutting, start: CutStart, head: HeadTravel, around: tuple[Point | None, Point | None]
) -> tuple[CutStart, float]:
    """Move a start to the position with the shortest travel.

    `around` contains the positions of the head before and after the cut. The function returns the moved start and the
    travel that it saves.
    """
    contour = cutting.contours[start.contour]
    if start.then or not contour.path.closed or not start.pierce or "start" in cutting.fixed.get(start.contour, ()):
        return start, 0.0
    first = now = head.cost_to_and_from(around, start)
    step = FIRST_SHARE * contour.path.length

    def cheaper(moved: CutStart) -> bool:
        return head.cost_to_and_from(around, moved) < now - NO_GAIN

    while step >= FINEST:
        for shift in (step, -step):
            moved = start_with_same_leads(
                contour, cutting.scrap, start, (start.at + shift) % contour.path.length, cheaper
            )
            if moved is not None:
                start, now = moved, head.cost_to_and_from(around, moved)
                break
        else:
            step *= 0.5
    return start, first - now


# -- pierces ---------------------------------------------------------------------------------------------------------


def clear_pierces_of_kerfs(cuts: CutSequence, head: HeadTravel) -> CutSequence:
    """Choose a new start where a pierce would be in the kerf of an earlier cut or right next to it.

    If possible, each pierce is a full kerf away from the centreline of every earlier cut. If not, half a kerf is
    enough. Among equally good starts, the cheapest is chosen. Starts that a plan file fixes do not change.
    """
    burnt = _CutPaths(cuts)
    for _ in range(PIERCE_PASSES):
        burnt.rebuild_index()
        wrong = burnt.near_earlier_kerfs()
        moved = False
        for k in wrong:
            better = _start_with_fewest_conflicts(burnt, k, head)
            if better is not None:
                burnt.order[k], moved = better, True
                if len(wrong) <= MOST_IN_TURN:
                    burnt.rebuild_index()
        if not moved:
            break
    return cuts.with_starts(burnt.order)


class _CutPaths:
    """The torch paths and pierces of all cuts, in order.

    Marks are not included, because they do not cut through the sheet.
    """

    def __init__(self, cuts: CutSequence) -> None:
        self.cutting, self.order = cuts.cutting, list(cuts.starts)
        # The cache also stores the start, so that its id is not reused.
        self._lines: dict[int, tuple[CutStart, Any]] = {}

    def torch_line(self, start: CutStart) -> Any:
        """Return the torch path for a start as a shapely line. The lines are cached."""
        if id(start) not in self._lines:
            path: Polyline = self.cutting.cut(start).path
            self._lines[id(start)] = start, shapely.LineString(path.flattened(FLATNESS))
        return self._lines[id(start)][1]

    def rebuild_index(self) -> None:
        nothing = shapely.LineString()
        burns = [self._cuts_through(s) for s in self.order]
        self.lines = [self.torch_line(s) if b else nothing for s, b in zip(self.order, burns, strict=True)]
        places = [s.entry if b and s.pierce else (math.nan, math.nan) for s, b in zip(self.order, burns, strict=True)]
        points: Any = shapely.points(np.array(places, dtype=np.float64).reshape(-1, 2), handle_nan="skip")
        self._tree, self._pierces = shapely.STRtree(self.lines), shapely.STRtree(points)
        self._points = points

    def _cuts_through(self, start: CutStart) -> bool:
        return self.cutting.contours[start.contour].kind == "cut"

    @property
    def _clearances(self) -> tuple[float, float]:
        """Two distances from a centreline, mm.

        A pierce within the first distance is in the kerf. A pierce within the second distance is too close to it.
        """
        kerf = self.cutting.rules.kerf
        return 0.5 * kerf + ROOM, kerf

    def near_earlier_kerfs(self) -> list[int]:
        pierce, kerf = self._tree.query(self._points, predicate="dwithin", distance=max(self._clearances))
        wrong: list[int] = np.unique(pierce[kerf < pierce]).tolist()
        return wrong

    def count_conflicts(self, k: int, start: CutStart, line: Any = None) -> tuple[int, int]:
        """Count the conflicts that cut `k` would have if it used the given start.

        The pierce of the start is checked against the kerfs of earlier cuts. If `line` is given, it is the torch path
        of the start, and the pierces of later cuts are checked against the kerf along this path.

        Returns
        -------
        tuple of int
            The number of pierces in a kerf, and the number of pierces too close to a kerf.
        """
        if not start.pierce or not self._cuts_through(start):
            return 0, 0
        counts = []
        for reach in self._clearances:
            earlier = self._tree.query(shapely.Point(*start.entry), predicate="dwithin", distance=reach)
            count = int((earlier < k).sum())
            if line is not None:
                count += int((self._pierces.query(line, predicate="dwithin", distance=reach) > k).sum())
            counts.append(count)
        return counts[0], counts[1]


def _start_with_fewest_conflicts(burnt: _CutPaths, k: int, head: HeadTravel) -> CutStart | None:
    """Return the start of cut `k` with the fewest conflicts. If several starts are equal, return the cheapest.

    Return None if no start has fewer conflicts than the current start.
    """
    cutting, own = burnt.cutting, burnt.order[k]
    around, best = head.adjacent_positions(burnt.order, k), None
    least = (*burnt.count_conflicts(k, own, burnt.lines[k]), 0.0)
    for other in cutting.starts_on([own.contour]):
        cost = head.cost_to_and_from(around, other) + cutting.cutting_time(other)
        rank = (*burnt.count_conflicts(k, other, burnt.torch_line(other)), cost)
        if rank[:2] < least[:2] or (best is not None and rank < least):
            least, best = rank, other
    return best


# -- leads -----------------------------------------------------------------------------------------------------------


def with_leads_apart(cuts: CutSequence, head: HeadTravel) -> CutSequence:
    """Change each start whose leads run into other leads or bridges to the cheapest start without such a conflict."""
    cutting, order = cuts.cutting, list(cuts.starts)
    for _ in range(LEAD_PASSES):
        extras = [_leads_and_bridges(cutting, s) for s in order]
        near = _conflicting_pairs(extras, cutting.rules.kerf)
        moved = False
        for k in sorted({max(pair) for pair in near}) + sorted({min(pair) for pair in near}):
            better = _start_with_clear_leads(cutting, order, extras, k, head)
            if better is not None:
                order[k], extras[k], moved = better, _leads_and_bridges(cutting, better), True
        if not moved:
            break
    return cuts.with_starts(order)


def without_conflicting_starts(cutting: Cutting, order: Sequence[CutStart]) -> Cutting:
    """Remove all starts whose leads would run into the leads or bridges of the given order.

    The starts that the order uses are kept.
    """
    extras = [_leads_and_bridges(cutting, s) for s in order]
    lines = [line for own in extras for line in own]
    owner = np.array([k for k, own in enumerate(extras) for _ in own], dtype=np.int64)
    at = {k: place for place, s in enumerate(order) for k in s.contours}
    tree, reach = shapely.STRtree(lines), cutting.rules.kerf - ROUNDING

    def clear(s: CutStart) -> bool:
        near = (tree.query(line, predicate="dwithin", distance=reach) for line in _leads_and_bridges(cutting, s))
        return all(bool((owner[found] == at[s.contour]).all()) for found in near)

    return replace(cutting, starts=[*order, *(s for s in cutting.starts if clear(s))])


def _leads_and_bridges(cutting: Cutting, s: CutStart) -> list[Any]:
    leads = cutting.lead_lines(s)
    if not s.then:
        return leads
    steps = [s, *s.then]
    # A chain ends at the exit of its last contour.
    left = [cutting.contours[s.contour].path.point_at(s.at), *(step.exit for step in s.then)]
    between = [
        shapely.LineString([leave, cutting.contours[b.contour].path.point_at(b.at)])
        for leave, (_, b) in zip(left, itertools.pairwise(steps), strict=False)
    ]
    return [*leads, *between, *cutting.lead_lines(steps[-1])]


def _conflicting_pairs(extras: Sequence[list[Any]], kerf: float) -> set[tuple[int, int]]:
    """Return the pairs of cuts whose leads or bridges run into each other's kerf, as positions in the order.

    `extras` contains the leads and bridges of each cut as shapely lines.
    """
    lines = [line for own in extras for line in own]
    owner = [k for k, own in enumerate(extras) for _ in own]
    if not lines:
        return set()
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=kerf - ROUNDING)
    return {(owner[a], owner[b]) for a, b in pairs.T.tolist() if owner[a] < owner[b]}


def _start_with_clear_leads(
    cutting: Cutting, order: Sequence[CutStart], extras: Sequence[list[Any]], k: int, head: HeadTravel
) -> CutStart | None:
    """Return the cheapest start of cut `k` whose leads keep clear of all other leads and bridges.

    Return None if the current start is fixed or already clear, or if no start is clear.
    """
    own = order[k]
    if "start" in cutting.fixed.get(own.contour, ()):
        return None
    tree = shapely.STRtree([line for i, own_lines in enumerate(extras) if i != k for line in own_lines])
    reach = cutting.rules.kerf - ROUNDING

    def clear(s: CutStart) -> bool:
        return all(
            not len(tree.query(line, predicate="dwithin", distance=reach)) for line in _leads_and_bridges(cutting, s)
        )

    if clear(own):
        return None  # the other cut has already moved
    around = head.adjacent_positions(order, k)
    others = sorted(
        cutting.starts_on([own.contour]), key=lambda s: head.cost_to_and_from(around, s) + cutting.cutting_time(s)
    )
    return next((s for s in others if s.pierce == own.pierce and clear(s)), None)
