"""Straight edges of two parts that face each other, one kerf apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Point
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.quick_dataclass import dataclass

#: Edges are a kerf apart when their distance differs from it by no more, mm: half of it is what either part is off.
GAP = 0.02
#: Edges that face each other over less are not worth a cut of their own: so many kerfs, and so many mm.
LEAST_KERFS, LEAST = 4.0, 2.0


@dataclass(frozen=True)
class EdgeGap:
    """The room between two edges.

    Attributes
    ----------
    parts
        Positions of the two contours, the lesser first.
    begin, end
        Of its middle, mm: along as much as the edges face each other.
    width
        mm, and `normal` is the unit vector across.
    """

    parts: tuple[int, int]
    begin: Point
    end: Point
    width: float
    normal: Point

    @property
    def length(self) -> float:
        """mm."""
        return float(np.hypot(self.end[0] - self.begin[0], self.end[1] - self.begin[1]))


def facing_edges(contours: Sequence[CutContour], rules: CutRules) -> list[EdgeGap]:
    """Return the rooms between straight edges of outlines that are as far apart as the kerf is compensated.

    Only between outlines that border on the same scrap: on the sheet, or in the same hole.
    """
    owner, ends = [], []
    for k, c in enumerate(contours):
        if not c.has_leads or c.hole:
            continue
        path = c.source.contour.path
        path = path if path.area >= 0.0 else path.reversed()
        own = [s for s in path.segments() if not s.is_arc]
        ends += [(s.start, s.end) for s in own]
        owner += [k] * len(own)
    if not ends:
        return []
    table = np.array(ends, dtype=np.float64)
    lines: Any = shapely.linestrings(table)
    gap = 2.0 * rules.half
    first, second = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=gap + GAP)
    found = []
    for i, j in zip(first.tolist(), second.tolist(), strict=True):
        a, b = owner[i], owner[j]
        if a < b and contours[a].source.parent == contours[b].source.parent:
            slot = _slot((a, b), table[i], table[j], gap, least_length(rules))
            if slot is not None:
                found.append(slot)
    return sorted(found, key=lambda s: (s.parts, s.begin))


def least_length(rules: CutRules) -> float:
    """Return the least length over which edges of a common line face each other, mm."""
    return LEAST if rules.half <= 0.0 else max(LEAST_KERFS * rules.kerf, LEAST)


def _slot(parts: tuple[int, int], one: np.ndarray, other: np.ndarray, gap: float, least: float) -> EdgeGap | None:
    """Return the room between two edges, float64[2, 2] each; None where they do not face each other so far apart.

    Outlines run counter-clockwise, so that the scrap is to the right of an edge and a facing one runs against it.
    """
    length = float(np.hypot(*(one[1] - one[0])))
    along = (one[1] - one[0]) / length
    across = np.array([along[1], -along[0]])
    at, away = (other - one[0]) @ along, (other - one[0]) @ across
    if at[0] <= at[1] or np.abs(away - gap).max() > GAP:
        return None
    low, high = max(0.0, float(at[1])), min(length, float(at[0]))
    if high - low < least:
        return None
    width = float(away.mean())
    begin, end = (one[0] + t * along + 0.5 * width * across for t in (low, high))
    return EdgeGap(
        parts,
        (float(begin[0]), float(begin[1])),
        (float(end[0]), float(end[1])),
        width,
        (float(across[0]), float(across[1])),
    )
