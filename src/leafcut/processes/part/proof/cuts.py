"""The cuts of a program, and the verdict on the cuts of an operation."""

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

#: Largest distance between the tool's path and the ideal path, mm: tolerance of the plan, chords, and written decimals.
TOLERANCE = 0.03
#: Tolerance of heights, mm.
HEIGHT = 0.002
#: Half the width of a strip along each cut, mm; the ideal path must lie in this strip.
STRIP = 2.0 * TOLERANCE


class Cuts:
    """Straight moves of the mills below the top of the plate.

    - `ends`: start and end of each move, float64[n, 6], mm
    - `lines`: the moves in the plane, as shapely lines
    - `rows`: row of each move in the toolpath `path`
    - `tools`: number of the tool of each move
    - `lowest`, `highest`: lowest and highest height of each move, mm
    """

    def __init__(self, moves: StraightMoves, chosen: NDArray[np.bool_]) -> None:
        self.ends, self.rows, self.tools = moves.ends[chosen], moves.row[chosen], moves.tool[chosen]
        self.lines: NDArray[np.object_] = np.asarray(shapely.linestrings(self.ends.reshape(-1, 2, 3)[:, :, :2]))
        self.lowest, self.highest = self.ends[:, [2, 5]].min(axis=1), self.ends[:, [2, 5]].max(axis=1)
        self.path = moves.path

    def __len__(self) -> int:
        return len(self.rows)

    def difference(self, what: Message, k: int, text: Message) -> Difference:
        """Return a difference at the cut with index `k`."""
        return Difference(what, 0, int(self.path.line[self.rows[k]]), text)

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(self.lines)

    def along(self, path: Any) -> NDArray[np.int64]:
        """Return the indices of the cuts within `TOLERANCE` of a path, in program order."""
        return self.within(path.buffer(TOLERANCE))

    def within(self, area: Any) -> NDArray[np.int64]:
        """Return the indices of the cuts inside an area, in program order."""
        return np.sort(self._tree.query(area, predicate="covers"))

    def near(self, area: Any, distance: float) -> NDArray[np.int64]:
        """Return the indices of the cuts within a distance of an area, mm, in program order."""
        return np.sort(self._tree.query(area, predicate="dwithin", distance=distance))

    def place(self, k: int) -> str:
        """Return the end of the cut with index `k` as text."""
        return position_text(*self.ends[k, 3:].tolist())


class FaceWork(NamedTuple):
    """A piece of work: its name, the indices of its cuts, and its line or area."""

    name: str
    cuts: NDArray[np.int64]
    area: Any


@dataclass(frozen=True, eq=False)
class Verdict:
    """The verdict on one operation.

    - `explained`: mask of the cuts that belong to the operation, bool[n]
    - `differences`: differences of these cuts from the request
    - `works`: pieces of work that must be finished before the edges that enclose or cross them
    """

    explained: NDArray[np.bool_]
    differences: Sequence[Difference]
    works: Sequence[FaceWork] = ()


def strip_along(lines: NDArray[np.object_]) -> Any:
    """Return the strip along some cuts; its round ends reach `STRIP` mm beyond them."""
    return shapely.union_all(shapely.buffer(lines, STRIP))
