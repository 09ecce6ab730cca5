"""Leads of different cuts kept apart: where two would cross, one of the cuts begins elsewhere.

The places where cuts may begin were found without knowing where the others begin. A pierce in the kerf of another
lead has no metal under it, and an arc that comes into a kerf goes out.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Point
from leafcut.processes.sheet.plan.chains.chain_starts import lead_lines
from leafcut.processes.sheet.plan.cut_contours import ROUNDING
from leafcut.processes.sheet.plan.cutting import Cutting
from leafcut.processes.sheet.plan.leads.cut_starts import CutStart
from leafcut.timing.travel import Travel

#: Passes over all cuts whose leads are too near.
PASSES = 4


def leads_apart(
    cutting: Cutting, order: Sequence[CutStart], travel: Travel, start: Point | None, end: Point | None
) -> list[CutStart]:
    """Return the same order, begun at other places where the leads of two cuts would come into each other's kerf.

    Of the places where that does not happen the one with the cheapest ways by `travel` is taken; where there is none,
    or a plan file fixes the place, the cut stays as it is.
    """
    order = list(order)
    for _ in range(PASSES):
        extras = [_extras(cutting, s) for s in order]
        near = _too_near(extras, cutting.rules.kerf)
        moved = False
        for k in sorted({max(pair) for pair in near}) + sorted({min(pair) for pair in near}):
            better = _elsewhere(cutting, order, extras, k, travel, start, end)
            if better is not None:
                order[k], extras[k], moved = better, _extras(cutting, better), True
        if not moved:
            break
    return order


def starts_apart(cutting: Cutting, order: Sequence[CutStart]) -> Cutting:
    """Return the cutting with the starts of an order, and of all others those whose leads keep away from its leads."""
    extras = [_extras(cutting, s) for s in order]
    lines = [line for own in extras for line in own]
    owner = np.array([k for k, own in enumerate(extras) for _ in own], dtype=np.int64)
    at = {k: place for place, s in enumerate(order) for k in s.contours}
    tree, reach = shapely.STRtree(lines), cutting.rules.kerf - ROUNDING

    def clear(s: CutStart) -> bool:
        near = (tree.query(line, predicate="dwithin", distance=reach) for line in _extras(cutting, s))
        return all(bool((owner[found] == at[s.contour]).all()) for found in near)

    return replace(cutting, starts=[*order, *(s for s in cutting.starts if clear(s))])


def _extras(cutting: Cutting, s: CutStart) -> list[Any]:
    """Return what a cut burns besides its contours: leads and bridges, as shapely lines."""
    if not s.then:
        return lead_lines(cutting.contours[s.contour], s, cutting.rules)
    steps = [s, *s.then]
    leads = lead_lines(cutting.contours[s.contour], s, cutting.rules)
    last = lead_lines(cutting.contours[steps[-1].contour], steps[-1], cutting.rules)
    between = [
        shapely.LineString([_left(cutting, a), cutting.contours[b.contour].path.point_at(b.at)])
        for a, b in itertools.pairwise(steps)
    ]
    return [*leads, *between, *last]


def _left(cutting: Cutting, s: CutStart) -> Point:
    return s.exit if not s.then else cutting.contours[s.contour].path.point_at(s.at)


def _too_near(extras: Sequence[list[Any]], kerf: float) -> set[tuple[int, int]]:
    """Return pairs of places in the order whose leads (`_extras` of each) come into each other's kerf."""
    lines = [line for own in extras for line in own]
    owner = [k for k, own in enumerate(extras) for _ in own]
    if not lines:
        return set()
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=kerf - ROUNDING)
    return {(owner[a], owner[b]) for a, b in pairs.T.tolist() if owner[a] < owner[b]}


def _elsewhere(
    cutting: Cutting, order: Sequence[CutStart], extras: Sequence[list[Any]], k: int, travel: Travel,
    start: Point | None, end: Point | None,
) -> CutStart | None:  # fmt: skip
    """Return the cheapest start of a cut whose leads keep away from all others; None where it must stay, or may."""
    own = order[k]
    if "start" in cutting.fixed.get(own.contour, ()):
        return None
    tree = shapely.STRtree([line for i, own_lines in enumerate(extras) if i != k for line in own_lines])
    reach = cutting.rules.kerf - ROUNDING

    def clear(s: CutStart) -> bool:
        return all(not len(tree.query(line, predicate="dwithin", distance=reach)) for line in _extras(cutting, s))

    if clear(own):
        return None  # the other one has moved already
    before = order[k - 1].exit if k else start
    after = order[k + 1].entry if k + 1 < len(order) else end

    def cost(s: CutStart) -> float:
        come = travel(before, s.entry) if before is not None else 0.0
        return come + cutting.seconds(s) + (travel(s.exit, after) if after is not None else 0.0)

    others = [cutting.starts[n] for n in cutting.by_contour[own.contour]]
    return next((s for s in sorted(others, key=cost) if s.pierce == own.pierce and clear(s)), None)
