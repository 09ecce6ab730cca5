"""Play back a toolpath: the action, tool position, time and program line of each row, in the order of execution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from leafcut.model.cycles import expand_cycles
from leafcut.model.kinds import BEAMS
from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.outcome import Outcome, Which
from leafcut.model.toolpath import PLACES, Kind, Toolpath, arc_radius_start_sweep, plane_axes
from leafcut.model.turns import arc_turns
from leafcut.report.plan_view import spindle_speed_by_row, stop_rows
from leafcut.timing.grbl import SentLines
from leafcut.timing.toolpath import time_rows

#: Number of chords for an arc outside the XY plane, because such an arc is not a circle when seen from above.
_CHORDS = 24
_SMALLEST_MOVE = 1e-9

#: Tolerance of positions, mm. Each rounding error is at most half of 0.0001 inch, but the errors may add up.
_ROUNDING = 0.01
#: Number of program rows to search for the next row of the plan.
_AHEAD = 40
_RAPIDS = (Kind.RAPID, Kind.MACHINE)


class Activity(IntEnum):
    """The action of a row, as seen from above."""

    RAPID = 0
    CUT = 1
    ARC_CW = 2
    ARC_CCW = 3
    STAND = 4
    DARK = 5


@dataclass(frozen=True, eq=False)
class Playback:
    """Rows in the order of execution, with canned cycles expanded, in mm, s and mm/s.

    Attributes
    ----------
    activity
        Action of each row, uint8[n] of `Activity`. ``DARK`` is a feed move with the beam off.
    place
        Position of the tool after each row, float64[n, 3]; NaN for unknown coordinates.
    seconds
        Time of each row, float64[n]. The sum is the machine time of the toolpath.
    line
        Line of the program, int32[n], from 1; 0 if no program is known.
    source
        Row of the original toolpath, int32[n].
    of
        Row of the toolpath with expanded cycles, int64[n].
    feed, tool
        Feed, float64[n], 0 in rows without a feed, and tool number, int32[n], 0 before the first tool.
    arc_row
        Rows that are arcs, int64[k].
    arc
        Centre x and y, radius, mm, start angle and signed sweep, rad, of each arc, float64[k, 5]. A sweep may have
        several turns.
    stops
        Rows at which the tool starts to cut after a travel move, int64[m]. The tool is then at the end of the previous
        row.
    """

    activity: NDArray[np.uint8]
    place: NDArray[np.float64]
    seconds: NDArray[np.float64]
    line: NDArray[np.int32]
    source: NDArray[np.int32]
    of: NDArray[np.int64]
    feed: NDArray[np.float64]
    tool: NDArray[np.int32]
    arc_row: NDArray[np.int64]
    arc: NDArray[np.float64]
    stops: NDArray[np.int64]


def outcome_playback(outcome: Outcome, which: Which) -> Playback:
    """Play back the path ``before`` or ``after`` on the machine of the outcome.

    The playback of the path ``after`` has the line numbers of the written program.

    Raises
    ------
    PlanError
        The expanded cycles have too many moves.
    """
    beam = outcome.process in BEAMS
    if which == "before":
        return playback_of_path(outcome.path_before, outcome.machine, beam, measured=outcome.before)
    return playback_of_path(outcome.path_after, outcome.machine, beam, outcome.written, outcome.after)


def playback_of_path(
    path: Toolpath,
    machine: Machine,
    beam: bool = False,
    written: Toolpath | None = None,
    measured: Measure | None = None,
) -> Playback:
    """Play back a toolpath.

    Parameters
    ----------
    beam
        Whether the machine has a beam. Feed moves with the beam off are then ``DARK``.
    written
        The toolpath read back from the program, which supplies the line numbers of a planned path.
    measured
        Measure of the path. If it is given, the seconds add up to its time.

    Raises
    ------
    PlanError
        The expanded cycles have too many moves.
    """
    lines = None if measured is None or measured.lines is None else SentLines(*measured.lines)
    timed = time_rows(path, machine, lines, None if measured is None else measured.start)
    rows = timed.path
    before = rows.before
    place = np.concatenate([before[1:], _final_position(rows, before)])[: len(rows)]
    activity = _activities(rows, beam)
    moved = (np.abs(np.nan_to_num(place - before)[:, :2]) > _SMALLEST_MOVE).any(axis=1)
    known = np.isfinite(place[:, :2]).all(axis=1) & np.isfinite(before[:, :2]).all(axis=1)
    arcs = np.isin(activity, (Activity.ARC_CW, Activity.ARC_CCW))
    cuts = ((activity == Activity.CUT) | arcs) & known & (moved | arcs | (place[:, 2] < before[:, 2]))
    travels = np.isin(activity, (Activity.RAPID, Activity.DARK)) & moved
    changes = np.cumsum((rows.kind == Kind.TOOL) | ~known)
    arc_row, arc = _arcs_in_xy_plane(rows)
    arc_row, arc = arc_row[arcs[arc_row]], arc[arcs[arc_row]]
    feeds = np.isin(rows.kind, (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW))
    whole = Playback(
        activity=activity,
        place=place,
        seconds=timed.seconds,
        line=rows.line if written is None else line_numbers_by_row(rows, written),
        source=timed.source,
        of=np.arange(len(rows)),
        feed=np.where(feeds, rows.value, 0.0),
        tool=rows.tool.astype(np.int32),
        arc_row=arc_row,
        arc=arc,
        stops=stop_rows(np.zeros(len(rows), dtype=bool), cuts, np.cumsum(travels) + changes),
    )
    return _replace_other_arcs(whole, rows, before)


def _final_position(path: Toolpath, before: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the position of the tool after the last row, float64[1, 3]. For an empty path, return no rows."""
    if not len(path):
        return before
    end = path.end[-1:]
    if path.kind[-1] == Kind.MACHINE:
        return np.where(np.isfinite(end), np.nan, before[-1:])
    return end if path.kind[-1] in PLACES else before[-1:]


def _activities(path: Toolpath, beam: bool) -> NDArray[np.uint8]:
    activity = np.full(len(path), int(Activity.STAND), dtype=np.uint8)
    activity[(path.kind == Kind.RAPID) | (path.kind == Kind.MACHINE)] = Activity.RAPID
    activity[path.kind == Kind.FEED] = Activity.CUT
    activity[path.kind == Kind.ARC_CW] = Activity.ARC_CW
    activity[path.kind == Kind.ARC_CCW] = Activity.ARC_CCW
    if beam:
        dark = (spindle_speed_by_row(path) == 0.0) | (path.latest(Kind.TORCH, 1.0 - path.value) == 1.0)
        activity[np.isin(path.kind, (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)) & dark] = Activity.DARK
    return activity


def _arcs_in_xy_plane(path: Toolpath) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the known arcs in the XY plane: their rows, and their centre, radius, start angle and sweep."""
    turns = arc_turns(path)
    flat = (turns.plane == 0) & (turns.length > 0.0)
    arcs = np.column_stack([turns.centre, turns.turn.radius, turns.angle, turns.sweep])
    return turns.row[flat], arcs[flat]


def _replace_other_arcs(whole: Playback, path: Toolpath, before: NDArray[np.float64]) -> Playback:
    """Replace arcs outside the XY plane or with the beam off with chords. The chords share the time of the arc."""
    unflat = (path.kind == Kind.ARC_CW) | (path.kind == Kind.ARC_CCW)
    unflat[whole.arc_row] = False
    upright = np.flatnonzero(unflat)
    if not len(upright):
        return whole
    count = np.ones(len(path), dtype=np.int64)
    count[upright] = _CHORDS
    first, source = np.cumsum(count) - count, np.repeat(np.arange(len(path)), count)
    activity, place = whole.activity[source], whole.place[source]
    share = np.arange(1, _CHORDS + 1) / _CHORDS
    for row in upright.tolist():
        chord_rows = slice(int(first[row]), int(first[row]) + _CHORDS)
        activity[chord_rows] = Activity.DARK if whole.activity[row] == Activity.DARK else Activity.CUT
        centre, (u, v, w) = path.arcs[int(path.ref[row])], plane_axes(path.arcs[int(path.ref[row])].plane)
        radius, angle, sweep = arc_radius_start_sweep(path, row)
        place[chord_rows, u] = centre.center[u] + radius * np.cos(angle + sweep * share)
        place[chord_rows, v] = centre.center[v] + radius * np.sin(angle + sweep * share)
        place[chord_rows, w] = before[row, w] + (path.end[row, w] - before[row, w]) * share
        place[chord_rows.stop - 1] = whole.place[row]
    return replace(
        whole,
        activity=activity,
        place=place,
        seconds=(whole.seconds / count)[source],
        line=whole.line[source],
        source=whole.source[source],
        of=source,
        feed=whole.feed[source],
        tool=whole.tool[source],
        arc_row=first[whole.arc_row],
        stops=first[whole.stops],
    )


def line_numbers_by_row(planned: Toolpath, written: Toolpath) -> NDArray[np.int32]:
    """Return the program line of every row in a planned toolpath without canned cycles, int32[n], from 1.

    `written` is the program after reading it back. The function matches moves in order, by kind and end position. A row
    that is not in the program, such as the descent of a torch, gets the line of the next row. If no row matches, all
    lines are 0.
    """
    written = expand_cycles(written)
    plan_rows, written_rows = _moving_rows(planned), _moving_rows(written)
    a, b = (_move_keys(path, rows) for path, rows in ((planned, plan_rows), (written, written_rows)))
    matches = _match_rows(a, b)
    line = np.zeros(len(planned), dtype=np.int32)
    known = matches >= 0
    line[plan_rows[known]] = written.line[written_rows[matches[known]]]
    return _fill_missing_lines(line)


def _moving_rows(path: Toolpath) -> NDArray[np.int64]:
    before = path.before
    moves = (path.kind <= Kind.ARC_CCW) | (path.kind == Kind.MACHINE)
    # A row that sets the first position of an axis counts as a move.
    unmoved = (np.abs(path.end - before) <= _SMALLEST_MOVE) | np.isnan(path.end)
    return np.flatnonzero(moves & ~unmoved.all(axis=1))


def _move_keys(path: Toolpath, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the data that identify a move, float64[k, 4]: a flag for rapids, and the end position."""
    return np.column_stack([np.isin(path.kind[rows], _RAPIDS), path.end[rows]])


def _moves_match(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether moves match. An unknown coordinate matches any value."""
    near = (np.abs(a - b) <= _ROUNDING) | np.isnan(a) | np.isnan(b)
    return np.asarray(near.all(axis=-1))


def _match_rows(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the matching row of `b` for every row of `a`, or -1. The matches are in ascending order."""
    if len(a) == len(b) and _moves_match(a, b).all():
        return np.arange(len(a))
    matches = np.full(len(a), -1, dtype=np.int64)
    start = 0
    for row in range(len(a)):
        equal = np.flatnonzero(_moves_match(a[row], b[start : start + _AHEAD]))
        if len(equal):
            matches[row] = start + equal[0]
            start += int(equal[0]) + 1
    return matches


def _fill_missing_lines(line: NDArray[np.int32]) -> NDArray[np.int32]:
    """Replace missing lines with the next known line. At the end, use the last known line."""
    rows = np.flatnonzero(line)
    if not len(rows):
        return line
    after = np.minimum(np.searchsorted(rows, np.arange(len(line))), len(rows) - 1)
    return line[rows[after]]
