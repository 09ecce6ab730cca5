"""`ProgramWork`: the features, travel moves and barriers of a program, for verification."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.program.proof.barriers import (
    Barrier,
    BarrierGroup,
    barriers_of,
    group_barriers,
    with_barrier_dwells,
)
from leafcut.processes.program.proof.features import (
    Features,
    ProgramPath,
    compensated_moves,
    features_of,
    same_state_mask,
)

#: Moves up to this length count as no move, mm.
STILL = 1e-6


@dataclass(frozen=True, eq=False)
class ProgramWork(ProgramPath):
    """The work of one of the two compared programs. If the other program has no cycles, the cycles are expanded.

    Attributes
    ----------
    features
        Holes, cuts and dwells, except the dwells that belong to barriers.
    travel
        Rows of moves without cutting, int64[k]: rapids, and feed moves with the beam off.
    travel_from, drill_from
        Positions before the rows of travel moves, and before the drilling cycles, mm.
    marks, walls
        The barriers, one by one and in groups.
    dark_rapids
        See `Program`.
    """

    features: Features
    travel: Indices
    travel_from: Floats
    drill_from: Floats
    marks: list[Barrier]
    walls: list[BarrierGroup]
    dark_rapids: bool


def read_work(program: Program, *, written_out: bool, beam: bool, straight: float | None = None) -> ProgramWork:
    """Extract the work of a program.

    Parameters
    ----------
    written_out
        Whether to expand drilling cycles into single moves.
    beam
        Whether feed moves with the beam off count as travel moves.
    straight
        Tolerance for merging the feed moves of a straight cut into a single feature, mm; None for no merging.

    Raises
    ------
    PlanError
        A cycle has more pecks than any machine would drill.
    """
    program = _add_end_row(program)
    path = replace(program.path, line=np.arange(len(program.path), dtype=np.int32))
    if written_out:
        path = expand_cycles(path)
    source = path.line.astype(np.int64)
    rows = ProgramPath(program, replace(path, line=program.path.line[source]), source)
    if straight is not None:
        rows = _select_rows(rows, merged_rows(rows, still=STILL, tolerance=straight))
    path, before = rows.path, rows.path.before
    cuts = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)
    dark = cuts & (rows.modal("spindle") == 0) & np.full(len(path), beam)
    compensated = (path.kind == Kind.RAPID) & compensated_moves(rows)
    making = (cuts & ~dark) | compensated | (path.kind == Kind.DRILL) | (path.kind == Kind.DWELL)
    features = features_of(rows, making)
    travel = np.flatnonzero(dark | ((path.kind == Kind.RAPID) & ~compensated))
    across = travel[goes_across(before[travel], path.end[travel])]
    marks = barriers_of(rows)
    marks, part_of_barrier = with_barrier_dwells(marks, features, travel, across, rows)
    features = features.pick(~part_of_barrier) if part_of_barrier.any() else features
    return ProgramWork(
        program,
        path,
        rows.source,
        features,
        travel,
        before[travel],
        before[path.kind == Kind.DRILL],
        marks,
        group_barriers(marks, features.row),
        program.dark_rapids,
    )


def works_without_cycles(path: Toolpath) -> bool:
    """Return whether a program works without drilling cycles. The result is False if the program does no work."""
    working = (path.kind >= Kind.FEED) & (path.kind <= Kind.DRILL)
    return bool(working.any()) and not bool((path.kind == Kind.DRILL).any())


def goes_across(begin: Floats, end: Floats) -> Mask:
    """Return a mask of the moves that change x or y. The first move to a position on an axis counts as a change."""
    moved: Mask = np.isfinite(end[:, :2]) & ~(np.abs(end[:, :2] - begin[:, :2]) <= STILL)
    return moved[:, 0] | moved[:, 1]


def cuts_with_beam(program: Program) -> bool:
    """Return whether a program cuts with a beam.

    In such a program, the spindle is off between two cuts without a barrier.
    """
    path, direction = program.path, program.modal_at_rows("spindle")
    stage = np.cumsum(np.isin(path.kind, (Kind.PAUSE, Kind.TOOL, Kind.FRAME, Kind.SHIFT, Kind.MACHINE)))
    moving = path.kind <= Kind.ARC_CCW
    lit = np.flatnonzero(moving & (path.kind != Kind.RAPID) & (direction != 0))
    dark = np.cumsum(moving & (direction == 0) & goes_across(path.before, path.end))
    return bool(((np.diff(dark[lit]) > 0) & (np.diff(stage[lit]) == 0)).any())


def has_no_mill(program: Program) -> bool:
    """Return whether a program cuts with a beam, or never moves its tool in Z, as a plotter does."""
    path = program.path
    z = path.end[path.kind <= Kind.DRILL, 2]
    rises = (np.abs(np.diff(z[np.isfinite(z)])) > STILL).any() or (path.kind == Kind.DRILL).any()
    return not rises or cuts_with_beam(program)


def _add_end_row(program: Program) -> Program:
    """Add a row for the end of a program that has neither M2 nor M30, so that its end position is checked too."""
    path = program.path
    if len(path) and path.kind[-1] == Kind.END:
        return program
    closed = replace(
        path,
        kind=np.append(path.kind, np.int8(Kind.END)),
        end=np.concatenate([path.end, np.full((1, 3), np.nan)]),
        value=np.append(path.value, 0.0),
        # The end of the text must not match M2 or M30.
        ref=np.append(path.ref, np.int32(-1)),
        line=np.append(path.line, np.int32(program.last_line)),
    )
    return replace(program, path=closed)


#: Maximum number of rows that are merged into a line. The effort grows with the square of this number.
_MOST_ROWS = 1000
#: G61 and G61.1, in tenths. In these modes, the tool may stop at the end of every move.
_STOPPING = (610, 611)


def merged_rows(program_path: ProgramPath, *, still: float, tolerance: float) -> Indices:
    """Return the rows of a toolpath that remain when every straight cut becomes a single row.

    Feed moves up to the length `still`, mm, are dropped. Consecutive feed moves with the same feed and state are merged
    if all points between them are in order and within `tolerance`, mm. The last row of the merged moves remains.

    Feed moves stay unchanged with cutter compensation, directly after it, in inverse time mode, and with exact stops.
    """
    path = program_path.path
    before, end = path.before, path.end
    feeds = (path.kind == Kind.FEED) & np.isfinite(before).all(axis=1) & np.isfinite(end).all(axis=1)
    # Under radius compensation the tool position also depends on adjacent moves, and the first move after it removes
    # the compensation along its length. In inverse time (G93) each move has its own time. In exact stop (G61) the tool
    # stops at the end of each move.
    feeds &= ~compensated_moves(program_path) & (program_path.modal("feed_mode") != 93)
    feeds &= ~np.isin(program_path.modal("blending"), _STOPPING)
    moves = np.flatnonzero(~(feeds & (np.abs(end - before) <= still).all(axis=1)))
    goes_on = np.zeros(len(moves), dtype=bool)
    goes_on[1:] = _continues_feed(_select_rows(program_path, moves), feeds[moves])
    needed = np.ones(len(moves), dtype=bool)
    bounds = np.flatnonzero(np.diff(goes_on, prepend=False, append=False))
    for first, last in bounds.reshape(-1, 2).tolist():
        # Rows first - 1 to last - 1 are consecutive feed moves.
        begin = first - 1
        while begin < last:
            stop = _end_of_line(path, moves[begin:last], tolerance)
            needed[begin : begin + stop - 1] = False
            begin += stop
    return moves[needed]


def _select_rows(program_path: ProgramPath, rows: Indices) -> ProgramPath:
    return ProgramPath(program_path.program, program_path.path.take(rows), program_path.source[rows])


def _continues_feed(moves: ProgramPath, feeds: Mask) -> Mask:
    """Return whether each row but the first is a feed move in the same state as the row before it."""
    value = moves.path.value
    alike: Mask = feeds[1:] & feeds[:-1] & same_state_mask(moves) & (value[1:] == value[:-1])
    return alike


def _end_of_line(path: Toolpath, rows: Indices, tolerance: float) -> int:
    """Count the consecutive feed moves that form a straight line with the first move. The result is at least 1."""
    start = path.before[rows[0]]
    count = 1
    while count < min(len(rows), _MOST_ROWS):
        places = path.end[rows[: count + 1]]
        line = places[-1] - start
        length = float(np.linalg.norm(line))
        if length <= tolerance:
            break
        along = (places - start) @ line / length
        aside = np.linalg.norm(places - start - along[:, None] * line / length, axis=1)
        if aside.max() > tolerance or (np.diff(along, prepend=0.0) < 0.0).any():
            break
        count += 1
    return count
