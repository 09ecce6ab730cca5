"""At which height the tool crosses between pieces of work, and which of them may therefore change places.

Where a program rises higher than elsewhere there may be a clamp, so heights are never mixed: either the program is
divided at its highest crossings, or all that lies between two of them stays together as one piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

TOLERANCE = 1e-6
#: More different heights than this are no plan of a person or a CAM: then only the highest counts.
_MOST_HEIGHTS = 40


def group_by_height(
    heights: Sequence[float], places: Sequence[tuple[float, float]]
) -> list[tuple[list[int], int, float]]:
    """Return groups of two or more that may change places: (first pieces of what moves as one, end, clearance).

    `heights[i]` is that of the crossing from piece i to i + 1, `places` where the pieces begin. Each group lists the
    numbers of the pieces with which its members begin; what follows, up to the next member or to the piece `end`,
    belongs to that member.
    """
    groups: list[tuple[list[int], int, float]] = []
    waiting = [(0, len(places), 0)]
    while waiting:
        low, high, depth = waiting.pop()
        if high - low < 2:
            continue
        top = max(heights[low : high - 1])
        cuts = [i + 1 for i in range(low, high - 1) if heights[i] >= top - TOLERANCE]
        if len(cuts) < high - low - 1 and depth < _MOST_HEIGHTS:
            edges = [low, *cuts, high]
            parts = list(pairwise(edges))
            if sum(_freedom(places[a:b]) for a, b in parts) > len(cuts):
                waiting += [(a, b, depth + 1) for a, b in reversed(parts)]
                continue
        groups.append(([low, *cuts], high, top))
    return groups


def _freedom(places: Sequence[tuple[float, float]]) -> int:
    """Return how many pieces could go elsewhere: passes that begin at one place hardly can."""
    return len({(round(x, 1), round(y, 1)) for x, y in places}) - 1
