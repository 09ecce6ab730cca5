"""The cuts of a program, and the verification result of an operation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.material.straight_moves import StraightMoves
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.proof.difference import position_text

#: Maximum distance between the actual and the ideal tool path, mm. It covers the tolerance of the plan, chords, and
#: rounded decimals.
TOLERANCE = 0.03
#: Tolerance for heights, mm.
HEIGHT = 0.002
#: Half width of the strip around each cut, mm. The ideal path must lie inside the strips.
STRIP = 2.0 * TOLERANCE


class Cuts:
    """The straight moves of the mills below the top of the plate.

    Attributes
    ----------
    ends
        Start and end of each move, float64[n, 6], mm.
    lines
        The moves in the plane, as shapely lines.
    rows
        Row of each move in the toolpath `path`.
    tools
        Tool number of each move.
    lowest, highest
        Minimum and maximum height of each move, mm.
    """

    def __init__(self, moves: StraightMoves, chosen: NDArray[np.bool_]) -> None:
        self.ends, self.rows, self.tools = moves.ends[chosen], moves.row[chosen], moves.tool[chosen]
        self.lines: NDArray[np.object_] = np.asarray(shapely.linestrings(self.ends.reshape(-1, 2, 3)[:, :, :2]))
        self.lowest, self.highest = self.ends[:, [2, 5]].min(axis=1), self.ends[:, [2, 5]].max(axis=1)
        self.path = moves.path

    def __len__(self) -> int:
        return len(self.rows)

    def difference(self, what: Message, k: int, text: Message) -> Difference:
        """Create a difference located at the cut with index `k`."""
        return Difference(what, 0, int(self.path.line[self.rows[k]]), text)

    @cached_property
    def tree(self) -> shapely.STRtree:
        """The lines as a spatial index."""
        return shapely.STRtree(self.lines)

    def along(self, path: Any) -> NDArray[np.int64]:
        """Return the indices of all cuts that stay within `TOLERANCE` of a path, in program order."""
        return self.within(path.buffer(TOLERANCE))

    def within(self, area: Any) -> NDArray[np.int64]:
        """Return the indices of all cuts inside an area, in program order."""
        return np.sort(self.tree.query(area, predicate="covers"))

    def near(self, area: Any, distance: float) -> NDArray[np.int64]:
        """Return the indices of all cuts that are at most `distance` mm from an area, in program order."""
        return np.sort(self.tree.query(area, predicate="dwithin", distance=distance))

    def place(self, k: int) -> str:
        """Format the end point of the cut with index `k` as text."""
        return position_text(*self.ends[k, 3:].tolist())


class FaceWork(NamedTuple):
    """An engraved path or a pocket: its name, the indices of its cuts, and its line or area."""

    name: str
    cuts: NDArray[np.int64]
    area: Any


@dataclass(frozen=True, eq=False)
class Verdict:
    """The verification result of an operation.

    Attributes
    ----------
    explained
        Mask of the cuts that belong to the operation, bool[n].
    differences
        Differences between these cuts and the request.
    works
        Engraved paths and pockets that must be finished before the edges that enclose or cross them.
    """

    explained: NDArray[np.bool_]
    differences: Sequence[Difference]
    works: Sequence[FaceWork] = ()


def strip_along(lines: NDArray[np.object_]) -> Any:
    """Return a strip around some cuts. Its rounded ends extend `STRIP` mm past the cuts."""
    return shapely.union_all(shapely.buffer(lines, STRIP))


def points_on(ends: NDArray[np.float64], spacing: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return points along straight moves, at most `spacing` mm apart.

    They are the index of the move, int64[k], and the position, float64[k, 3], mm.
    """
    start, step = ends[:, :3], ends[:, 3:] - ends[:, :3]
    count = np.ceil(np.linalg.norm(step, axis=1) / spacing).astype(np.int64) + 1
    move = np.repeat(np.arange(len(ends)), count)
    share = (np.arange(len(move)) - np.repeat(np.cumsum(count) - count, count)) / np.maximum(count[move] - 1, 1)
    return move, start[move] + share[:, None] * step[move]
