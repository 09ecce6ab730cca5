"""Paths of two parts that coincide and are cut with each of them: touching edges, or edges a kerf apart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np
import shapely

from leafcut.errors import PlanError
from leafcut.model.issue import Issue
from leafcut.processes.sheet.plan.common_cuts.edges import SAME_EDGE
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import CutStart

#: Less than this of two edges coincides where they only cross or touch, mm.
CROSSING = 0.2
#: A contour that another cut follows over this share of its length is cut a second time.
MOST = 0.5


def doubled_edges(contours: Sequence[CutContour], rules: CutRules) -> list[Issue]:
    """Return the warning of edges that coincide and are cut twice; a kerf apart, that is usual without common lines.

    Raises
    ------
    PlanError
        More than half of the path of a contour is that of another: it would be cut twice.
    """
    cut = [c for c in contours if c.has_leads]
    lines: Any = np.array([c.line for c in cut], dtype=object)
    lengths, places = [], []
    for a, b in shapely.STRtree(lines).query(lines, predicate="dwithin", distance=SAME_EDGE).T.tolist():
        if a >= b or (cut[a].group and cut[a].group == cut[b].group):
            continue
        shared = lines[a].intersection(lines[b].buffer(SAME_EDGE, cap_style="flat"))
        if shared.length <= CROSSING:
            continue
        x, y = shapely.get_coordinates(shared)[0].tolist()
        short = min((a, b), key=lambda k: lines[k].length)
        if not (cut[a].group or cut[b].group) and shared.length > MOST * lines[short].length:
            raise PlanError(_refusal(cut[short].name(), cut[a + b - short].name(), shared.length, rules))
        lengths.append(shared.length)
        places.append(f"({x:.5g}, {y:.5g})")
    if not lengths or rules.half > 0.0:
        return []
    words = (
        f"{math.fsum(lengths):.6g} mm of edges that coincide are cut twice: only edges whose line can start in the "
        "scrap are cut once, without options that rule out common lines"
    )
    return [Issue("L617", words, f"at {', '.join(places[:3])}" + (" …" if len(places) > 3 else ""))]


def pierced_first(
    contours: Sequence[CutContour], starts: Sequence[CutStart], pairs: Iterable[tuple[int, int]], rules: CutRules
) -> list[tuple[int, int]]:
    """Return pairs (before, after) that leave metal to pierce for contours whose every start lies on other contours.

    `pairs` are the pairs that must be kept.
    """
    burnt: Any = np.array([c.line if c.kind == "cut" else shapely.LineString() for c in contours], dtype=object)
    pierced = [s for s in starts if s.pierce and contours[s.contour].kind == "cut"]
    points: Any = shapely.points(np.array([s.entry for s in pierced]).reshape(-1, 2))
    covered: list[set[int]] = [set() for _ in pierced]
    for n, k in shapely.STRtree(burnt).query(points, predicate="dwithin", distance=0.5 * rules.kerf).T.tolist():
        if k != pierced[n].contour:
            covered[n].add(k)
    choices: dict[int, list[tuple[int, ...]]] = {}
    for start, others in zip(pierced, covered, strict=True):
        choices.setdefault(start.contour, []).append(tuple(sorted(others)))
    kept, found = set(pairs), list[tuple[int, int]]()
    for k, sets in choices.items():
        if () in sets:
            continue
        for first in sorted(set(sets), key=lambda ks: (len(ks), ks)):
            added = [(k, other) for other in first]
            if has_order({*kept, *added}):
                kept.update(added)
                found += added
                break
    return found


def has_order(pairs: Iterable[tuple[int, int]]) -> bool:
    """Return whether some order keeps all pairs (before, after)."""
    sorter: TopologicalSorter[int] = TopologicalSorter()
    for before, after in pairs:
        sorter.add(after, before)
    try:
        sorter.prepare()
    except CycleError:
        return False
    return True


def _refusal(one: str, other: str, length: float, rules: CutRules) -> str:
    if rules.half > 0.0:
        return (
            f"{one} is one kerf away from {other} over {length:.4g} mm, more than half of its length, and would be cut "
            "twice: move the parts apart; --common-lines cuts such edges once if their line can start in the scrap"
        )
    return (
        f"{one} coincides with {other} over {length:.4g} mm, more than half of its length, and would be cut twice: "
        "move the parts apart; only edges whose line can start in the scrap are cut once, without options that rule "
        "out common lines"
    )
