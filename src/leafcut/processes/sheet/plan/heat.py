"""Keep the starts of consecutive cuts apart, because metal next to a fresh cut is hot."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.processes.sheet.plan.cutting import CutSequence, Cutting, HeadTravel
from leafcut.processes.sheet.plan.starts import CutStart

#: How far a cut may be moved in the order, in positions.
REACH = 40
#: How often the starts that are too close together are revisited.
PASSES = 4
#: Penalty for a start that is too close to the previous start, in seconds or mm. No travel costs this much.
PENALTY = 1e6


def hot_start_pairs(order: Sequence[CutStart], apart: float) -> list[tuple[int, int]]:
    """Return the pairs of consecutive positions in an order at which the starts are less than `apart` mm apart."""
    return [(j - 1, j) for j in range(len(order)) if _starts_in_hot_metal(order, j, apart)]


def heat_issue(order: Sequence[CutStart], apart: float) -> Issue:
    """Report whether starts follow each other at less than `apart` mm.

    The result is a warning if there are such starts. Otherwise, it is a note.
    """
    left = hot_start_pairs(order, apart)
    if not left:
        words = Message(
            "no cut starts within {:g} mm of the previous start. The nearest-neighbour order, which is only "
            "for comparison, ignores heat",
            apart,
        )
        return Issue("L614", words, "", Severity.NOTE)
    x, y = order[left[0][1]].entry
    words = Message(
        "1 cut starts within {:g} mm of the previous start, and no small change of the order avoids that", apart
    )
    if len(left) > 1:
        words = Message(
            "{} cuts start within {:g} mm of the previous start, and no small change of the order avoids that",
            len(left),
            apart,
        )
    return Issue("L614", words, Message("the first at ({:.4g}, {:.4g})", x, y))


def _starts_in_hot_metal(order: Sequence[CutStart], j: int, apart: float) -> bool:
    return j > 0 and math.dist(order[j - 1].entry, order[j].entry) < apart


def spread_starts(
    cuts: CutSequence,
    apart: float,
    head: HeadTravel,
    bands: Sequence[Sequence[int]] = (),
    late: Callable[[], bool] = lambda: False,
) -> CutSequence:
    """Reduce the number of starts that are less than `apart` mm from the previous start.

    The function makes small changes to the order and to the starts. It keeps precedence, fixed choices and bands
    (`cutting.sweep_bands`) intact, and stops when `late` returns True.
    """
    cutting, order = cuts.cutting, list(cuts.starts)
    band = {k: number for number, members in enumerate(bands) for k in members}
    before: dict[int, set[int]] = {}
    for a, b in cutting.contour_precedence:
        before.setdefault(b, set()).add(a)

    def may_swap(first: CutStart, second: CutStart) -> bool:
        a, b = first.contour, second.contour
        return a not in before.get(b, ()) and band.get(a) == band.get(b)

    for _ in range(PASSES):
        near = {j for _, j in hot_start_pairs(order, apart)}
        changed = False
        for contour in [order[j].contour for j in sorted(near)]:
            if late():
                return cuts.with_starts(order)
            j = next(k for k, s in enumerate(order) if s.contour == contour)
            better = _cheapest_change(cutting, order, j, _movable_range(order, j, may_swap), apart, head)
            if better is not None:
                order, changed = better, True
        if not changed:
            break
    return cuts.with_starts(order)


def _movable_range(order: list[CutStart], j: int, may_swap: Callable[[CutStart, CutStart], bool]) -> tuple[int, int]:
    """Return the first and last position to which the cut at position `j` may move.

    Both are at most `REACH` positions away from `j`.
    """
    low = high = j
    while low > 0 and j - low < REACH and may_swap(order[low - 1], order[j]):
        low -= 1
    while high + 1 < len(order) and high - j < REACH and may_swap(order[j], order[high + 1]):
        high += 1
    return low, high


def _cheapest_change(
    cutting: Cutting, order: list[CutStart], j: int, places: tuple[int, int], apart: float, head: HeadTravel
) -> list[CutStart] | None:
    """Find the cheapest order in which the cut at position `j` moves to another position or uses another start.

    Return None if the current order is at least as cheap. `places` contains the first and last position to try.
    """
    own, (low, high) = order[j], places
    starts = cutting.starts_on([own.contour]) if own.pierce else []
    starts = [own] if "start" in cutting.fixed.get(own.contour, ()) else [own, *starts]
    rest = order[:j] + order[j + 1 :]
    first, last = max(0, low - 1), min(len(order), high + 2)

    def cost(trial: list[CutStart]) -> float:
        """Return the cost of the cuts from `first` to `last`: travel, plus penalties for starts that are too close."""
        total, here = 0.0, trial[first - 1].exit if first else head.start
        for k in range(first, last):
            total += head.cost(here, trial[k].entry) if here is not None else 0.0
            total += PENALTY * _starts_in_hot_metal(trial, k, apart)
            here = trial[k].exit
        return total

    least, best = cost(order) - 1e-9, None
    for place in range(low, high + 1):
        for s in starts:
            trial = [*rest[:place], s, *rest[place:]]
            if (now := cost(trial)) < least:
                least, best = now, trial
    return best
