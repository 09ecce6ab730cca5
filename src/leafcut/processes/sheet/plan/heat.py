"""Keep starts of consecutive cuts apart: a cut that starts beside the last one starts in hot metal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from leafcut.geometry.arrays import Point
from leafcut.model.issue import Issue, Severity
from leafcut.processes.sheet.plan.cutting import Cutting
from leafcut.processes.sheet.plan.leads.cut_starts import CutStart
from leafcut.timing.travel import Travel

#: A cut moves by at most `REACH` places in the order; heat of the last `LOOK_BACK` cuts counts.
REACH, LOOK_BACK = 40, 12
#: Passes over all starts that are too near.
PASSES = 4
#: Cost of a start that is too near, in the unit of travel: more than any travel.
PENALTY = 1e6


@dataclass(frozen=True)
class _Limits:
    """Limits of a change of the order: contours that must be cut before each contour, and its band."""

    before: dict[int, set[int]]
    band: dict[int, int]

    def may_swap(self, first: int, second: int) -> bool:
        """Return whether a cut and its successor may be exchanged."""
        return first not in self.before.get(second, ()) and self.band.get(first) == self.band.get(second)


def too_near(cutting: Cutting, order: Sequence[CutStart], apart: float) -> list[tuple[int, int]]:
    """Return pairs of consecutive positions whose starts are nearer than `apart`, mm; the later position is second."""
    return [(i, j) for j in range(len(order)) for i in _hot_before(cutting, order, j, apart)]


def heat_issue(cutting: Cutting, order: Sequence[CutStart], apart: float) -> Issue:
    """Return the note or warning on the starts that stay nearer than `apart`, mm, to the start before."""
    left = too_near(cutting, order, apart)
    if not left:
        words = f"no cut starts within {apart:g} mm of a hot one; the nearest-neighbour order ignores heat"
        return Issue("L614", words, "", Severity.NOTE)
    x, y = order[left[0][1]].entry
    starts = "1 cut starts" if len(left) == 1 else f"{len(left)} cuts start"
    words = f"{starts} within {apart:g} mm of a hot one: no small change of the order avoids that"
    return Issue("L614", words, f"the first at ({x:.4g}, {y:.4g})")


def _hot_before(cutting: Cutting, order: Sequence[CutStart], j: int, apart: float) -> list[int]:
    """Return the cut before the cut at `j`, if their starts are too near."""
    return [j - 1] if j and math.dist(order[j - 1].entry, order[j].entry) < apart else []


def spread_starts(
    cutting: Cutting,
    order: Sequence[CutStart],
    apart: float,
    travel: Travel,
    start: Point | None,
    bands: Sequence[Sequence[int]] = (),
    late: Callable[[], bool] = lambda: False,
) -> list[CutStart]:
    """Return the cuts with fewer starts too near, by small changes of the order and of the starts.

    Precedence, choices of a plan file and bands (`cutting.bands`) are kept. Once it is `late`, nothing more changes.
    """
    order = list(order)
    band = {k: number for number, members in enumerate(bands) for k in members}
    before: dict[int, set[int]] = {}
    for a, b in cutting.pairs:
        before.setdefault(b, set()).add(a)
    limits = _Limits(before, band)
    for _ in range(PASSES):
        near = {j for _, j in too_near(cutting, order, apart)}
        if not near:
            break
        changed = False
        for contour in [order[j].contour for j in sorted(near)]:
            if late():
                return order
            j = next(k for k, s in enumerate(order) if s.contour == contour)
            better = _best_change(cutting, order, j, apart, travel, start, limits)
            if better is not None:
                order, changed = better, True
        if not changed:
            break
    return order


def _best_change(
    cutting: Cutting,
    order: list[CutStart],
    j: int,
    apart: float,
    travel: Travel,
    start: Point | None,
    limits: _Limits,
) -> list[CutStart] | None:
    """Return the order with the cut at `j` moved to another position or start, if that costs less."""
    own = order[j]
    starts = [cutting.starts[n] for n in cutting.by_contour[own.contour]] if own.pierce else []
    starts = [own] if "start" in cutting.fixed.get(own.contour, ()) else [own, *starts]
    rest = order[:j] + order[j + 1 :]
    low, high = _room(rest, j, own.contour, limits)
    first, last = max(0, low - 1), min(len(order), high + LOOK_BACK + 2)
    least, best = _cost(cutting, order, first, last, apart, travel, start) - 1e-9, None
    for place in range(low, high + 1):
        for s in starts:
            trial = [*rest[:place], s, *rest[place:]]
            cost = _cost(cutting, trial, first, last, apart, travel, start)
            if cost < least:
                least, best = cost, trial
    return best


def _room(rest: list[CutStart], j: int, contour: int, limits: _Limits) -> tuple[int, int]:
    """Return the range of positions for a cut among the other cuts, at most `REACH` from its own."""
    low, high = j, j
    while low > 0 and j - low < REACH and limits.may_swap(rest[low - 1].contour, contour):
        low -= 1
    while high < len(rest) and high - j < REACH and limits.may_swap(contour, rest[high].contour):
        high += 1
    return low, high


def _cost(
    cutting: Cutting,
    order: list[CutStart],
    first: int,
    last: int,
    apart: float,
    travel: Travel,
    start: Point | None,
) -> float:
    """Return the cost of the cuts from `first` to before `last`: travel and heat."""
    total = 0.0
    here = order[first - 1].exit if first else start
    for k in range(first, min(last, len(order))):
        total += travel(here, order[k].entry) if here is not None else 0.0
        total += PENALTY * len(_hot_before(cutting, order, k, apart))
        here = order[k].exit
    return total
