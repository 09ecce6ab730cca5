"""Show a toolpath from above: rapids, cuts, and the positions where the tool starts to cut."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.model.toolpath import Kind, Toolpath, arc_radius_start_sweep, plane_axes

_RAPIDS = (Kind.RAPID, Kind.DRILL)
_ARCS = (Kind.ARC_CW, Kind.ARC_CCW)
_STEPS_PER_TURN = 48
_SMALLEST_MOVE = 1e-9


@dataclass(frozen=True, eq=False)
class PlanView:
    """A toolpath seen from above, mm.

    Attributes
    ----------
    rapids, cuts
        Straight segments (from, to) in order, float64[n, 2, 2]. Arcs are divided into chords.
    stops
        Positions where the tool starts to cut after a travel move, float64[k, 2], in order.
    cut_tool
        Tool number of each segment in `cuts`, int64[n]; 0 before the first tool change.
    """

    rapids: NDArray[np.float64]
    cuts: NDArray[np.float64]
    stops: NDArray[np.float64]
    cut_tool: NDArray[np.int64]

    @property
    def work_points(self) -> NDArray[np.float64]:
        """All ends of cuts, and all stops, float64[m, 2], mm."""
        return np.concatenate([self.cuts.reshape(-1, 2), self.stops])

    @property
    def all_points(self) -> NDArray[np.float64]:
        """All ends of rapids and cuts, and all stops, float64[m, 2], mm."""
        return np.concatenate([self.rapids.reshape(-1, 2), self.cuts.reshape(-1, 2), self.stops])


def plan_view(path: Toolpath, beam: bool = False) -> PlanView:
    """Project a toolpath to the plan view. Moves from or to an unknown position are omitted.

    With `beam`, feed moves with the beam off count as rapids.
    """
    machine = (path.kind == Kind.MACHINE) & np.isfinite(path.end[:, :2]).any(axis=1)
    rows = np.flatnonzero(np.isin(path.kind, [*_RAPIDS, *_ARCS, Kind.FEED]) | machine)
    kind, end = path.kind[rows], path.end[rows].copy()
    end[machine[rows]] = np.nan  # the position on the part is unknown in machine coordinates
    start = np.concatenate([np.full((1, 3), np.nan), end])[: len(end)]
    known = np.isfinite(start[:, :2]).all(axis=1) & np.isfinite(end[:, :2]).all(axis=1)
    moved = known & (np.abs(end[:, :2] - start[:, :2]) > _SMALLEST_MOVE).any(axis=1)
    segments = np.stack([start[:, :2], end[:, :2]], axis=1)

    dark = (kind == Kind.FEED) & (spindle_speed_by_row(path)[rows] == 0.0) & beam
    rapid = (np.isin(kind, _RAPIDS) | dark) & moved
    cut = (kind == Kind.FEED) & moved & ~dark
    arc_rows = np.flatnonzero(np.isin(kind, _ARCS) & known)
    arcs = [_arc_segments(path, int(row)) for row in rows[arc_rows]]
    cuts = np.concatenate([segments[cut], *arcs])
    tool = path.tool[rows]
    of_arcs = np.repeat(tool[arc_rows], [len(arc) for arc in arcs])
    drills = (kind == Kind.DRILL) & np.isfinite(end[:, :2]).all(axis=1)
    feeds = np.isin(kind, [Kind.FEED, *_ARCS]) & known & ~dark & (moved | (end[:, 2] < start[:, 2]))
    changes = np.searchsorted(np.flatnonzero(path.kind == Kind.TOOL), rows)
    stops = np.where(drills[:, None], end, start)[stop_rows(drills, feeds, np.cumsum(rapid | ~known) + changes), :2]
    return PlanView(segments[rapid], cuts, stops, np.concatenate([tool[cut], of_arcs]))


def spindle_speed_by_row(path: Toolpath) -> NDArray[np.float64]:
    """Return the spindle speed, or the power of a beam, in each row.

    If the path never sets a speed, the result is 1 in all rows.
    """
    if not (path.value[path.kind == Kind.SPINDLE] != 0.0).any():
        return np.ones(len(path))
    return path.latest(Kind.SPINDLE, path.value)


def stop_rows(drills: NDArray[np.bool_], feeds: NDArray[np.bool_], travels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the rows of drill cycles, and the first cut after each travel move. All pecks of a hole count as one stop.

    `travels`, int64[n], is the number of travel moves up to each row.
    """
    down = np.flatnonzero(drills | feeds)
    travelled = np.concatenate([[True], np.diff(travels[down]) > 0])[: len(down)]
    rows: NDArray[np.int64] = down[drills[down] | travelled]
    return rows


def _arc_segments(path: Toolpath, row: int) -> NDArray[np.float64]:
    """Divide an arc into straight segments, float64[n, 2, 2], mm."""
    arc = path.arcs[int(path.ref[row])]
    first, second, normal = plane_axes(arc.plane)
    radius, start, sweep = arc_radius_start_sweep(path, row)
    if abs(sweep) > math.tau:  # the turns of a helix overlap: draw one full turn and the remainder
        sweep = math.fmod(sweep, math.tau) + math.copysign(math.tau, sweep)
    parts = np.linspace(0.0, 1.0, 1 + max(2, math.ceil(abs(sweep) / math.tau * _STEPS_PER_TURN)))
    points = np.empty((len(parts), 3))
    points[:, first] = arc.center[first] + radius * np.cos(start + sweep * parts)
    points[:, second] = arc.center[second] + radius * np.sin(start + sweep * parts)
    low, high = path.before[row, normal], path.end[row, normal]
    points[:, normal] = low + (high - low) * parts
    points = points[np.isfinite(points[:, :2]).all(axis=1)][:, :2]
    return np.stack([points[:-1], points[1:]], axis=1)
