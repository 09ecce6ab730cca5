"""Convert a toolpath to straight moves of the tool tip: expand cycles, replace arcs with chords, and divide cuts."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.model.cutter import Cutter
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.model.turns import AXES, Turns, arc_turns

#: Maximum distance between chords and their arcs, as a share of a cell or of the smallest tool diameter.
_OF_CELL, _OF_TOOL = 0.05, 0.01
#: Maximum number of moves that fit into memory together with the material.
MOST_MOVES = 20_000_000


@dataclass(frozen=True, eq=False)
class StraightMoves:
    """Straight moves of the tool tip.

    Attributes
    ----------
    ends
        Start and end, float64[m, 6], mm.
    row
        Row in `path` for each move, int64[m].
    rapid
        Whether the move is a rapid, bool[m].
    tool
        Tool number, int64[m].
    path
        The toolpath with expanded cycles.
    unknown
        Rows of `path` whose start has an unknown coordinate. The coordinate of the end replaces it. Rows with an
        unknown end are left out.
    """

    ends: NDArray[np.float64]
    row: NDArray[np.int64]
    rapid: NDArray[np.bool_]
    tool: NDArray[np.int64]
    path: Toolpath
    unknown: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.row)

    def of_tools(self, numbers: Collection[int]) -> StraightMoves:
        """Return the moves of the given tools."""
        selected = np.isin(self.tool, list(numbers))
        return replace(
            self, ends=self.ends[selected], row=self.row[selected], rapid=self.rapid[selected], tool=self.tool[selected]
        )

    def swept_box(self, selected: NDArray[np.bool_], cutters: Mapping[int, Cutter]) -> tuple[Floats, Floats]:
        """Return the lowest and the highest corner of the box that the tools sweep in the selected moves, mm.

        The heights of the corners refer to the tool tip.
        """
        numbers, tool_index = np.unique(self.tool[selected], return_inverse=True)
        radius = np.array([[cutters[number].radius] * 2 + [0.0] for number in numbers.tolist()])[tool_index.ravel()]
        start, end = self.ends[selected, :3], self.ends[selected, 3:]
        low, high = np.minimum(start, end) - radius, np.maximum(start, end) + radius
        return low.min(axis=0), high.max(axis=0)


def convert_to_straight_moves(path: Toolpath, max_deviation: float, max_length: float) -> StraightMoves:
    """Convert a toolpath to straight moves.

    Parameters
    ----------
    max_deviation
        Maximum chord error of arcs, mm.
    max_length
        Maximum length of the segments of cuts in the plane, mm. Rapids are never divided.

    Raises
    ------
    PlanError
        There would be more than `MOST_MOVES` moves.
    """
    path = expand_cycles(path)
    is_motion = np.isin(path.kind, [int(k) for k in (Kind.RAPID, Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)])
    rows = np.flatnonzero(is_motion)
    rows = rows[np.isfinite(path.end[rows]).all(axis=1)]
    start, end = path.before[rows], path.end[rows]
    unknown_rows = rows[~np.isfinite(start).all(axis=1)]
    start = np.where(np.isfinite(start), start, end)
    kind = path.kind[rows]
    turns = arc_turns(path)
    # An arc with an unknown start becomes a straight move to its end.
    arc = np.full(len(path), -1)
    arc[turns.row[turns.length > 0.0]] = np.flatnonzero(turns.length > 0.0)
    arc = arc[rows]
    sweep, radius = (np.append(column, 0.0)[arc] for column in (turns.sweep, turns.turn.radius))
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.where(radius > 0, 2.0 * np.arccos(np.clip(1.0 - max_deviation / radius, -1.0, 1.0)), math.inf)
    length = np.where(sweep != 0.0, np.abs(sweep) * radius, np.hypot(*(end - start)[:, :2].T))
    pieces = np.where(kind == Kind.RAPID, 1.0, np.ceil(length / max_length - 1e-9))
    pieces = np.maximum(np.maximum(pieces, np.ceil(np.abs(sweep) / turn - 1e-9)), 1.0)
    if pieces.sum() > MOST_MOVES:
        advice = Message("; use larger cells") if math.isfinite(max_length) else ""
        raise PlanError(
            "the program has {:,.0f} segments, more than the limit of {:,}{}", pieces.sum(), MOST_MOVES, advice
        )
    count = pieces.astype(np.int64)
    source = np.repeat(np.arange(len(rows)), count)
    step = np.arange(len(source)) - np.repeat(np.cumsum(count) - count, count)
    ends = np.empty((len(source), 6))
    for half in (0, 1):
        share = (step + half) / count[source]
        position = start[source] + share[:, None] * (end - start)[source]
        _move_onto_arcs(position, turns, arc[source], share)
        ends[:, 3 * half : 3 * half + 3] = position
    return StraightMoves(ends, rows[source], kind[source] == Kind.RAPID, path.tool[rows][source], path, unknown_rows)


def smallest_tool_diameter(cutters: Mapping[int, Cutter]) -> float:
    """Return the smallest tool diameter, mm."""
    return 2.0 * min(cutter.radius for cutter in cutters.values())


def undivided_cutting_moves(path: Toolpath, cutters: Mapping[int, Cutter]) -> StraightMoves:
    """Return the moves of the cutting tools without dividing them.

    Moves of other tools, such as probes, are left out.
    """
    return convert_to_straight_moves(path, _OF_TOOL * smallest_tool_diameter(cutters), math.inf).of_tools(cutters)


def cutting_moves_for_cells(
    path: Toolpath, cutters: Mapping[int, Cutter], cell: float, max_length: float = math.inf
) -> StraightMoves:
    """Return the moves of the cutting tools, accurate enough for a height field with cells of side `cell`, mm."""
    return convert_to_straight_moves(path, _OF_CELL * cell, max_length).of_tools(cutters)


def _move_onto_arcs(position: Floats, turns: Turns, arc: NDArray[np.int64], share: Floats) -> None:
    """Move points onto their arcs. `share` is the position of each point as a share of the sweep.

    `position` contains the points, float64[n, 3]. `arc` contains the index of each arc, or -1 for a point on a line.
    Changes: position.
    """
    curved = np.flatnonzero(arc >= 0)
    arc, share, axes = arc[curved], share[curved], AXES[turns.plane[arc[curved]]]
    angle = turns.angle[arc] + share * turns.sweep[arc]
    # The radii at both ends may differ, which controllers allow within limits; interpolate between them.
    radius = turns.turn.radius[arc] + share * (turns.end_radius - turns.turn.radius)[arc]
    position[curved, axes[:, 0]] = turns.centre[arc, 0] + radius * np.cos(angle)
    position[curved, axes[:, 1]] = turns.centre[arc, 1] + radius * np.sin(angle)
