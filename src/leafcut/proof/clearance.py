"""Check that no rapid hits material, and that the spindle turns in every cut."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.geometry.arrays import Mask
from leafcut.message import Message
from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath, latest_marked_rows
from leafcut.proof.difference import limit_differences, start_and_end_texts

#: A tool at least this far above the surface counts as clear, mm. This is the smallest R plane that a user can request.
LEAST_CLEARANCE = 0.05

#: Tolerance for rounded heights, mm (0.0001 inch is 0.00254 mm).
_TOLERANCE = 0.002
#: A tool counts as above a hole if it is within this distance of the centre, mm.
_SAME_POSITION = 0.01


def check_clearance(
    path: Toolpath,
    *,
    surface_z: float = 0.0,
    safe_z: float = 0.0,
    torch: bool = False,
    milled: bool = False,
    tops: NDArray[np.float64] | None = None,
    level: bool = True,
) -> list[Difference]:
    """Return every move that could crash, with its line and position.

    The list is empty if the program obeys these rules:

    1. A rapid in x or y has a known z and stays at least `LEAST_CLEARANCE` above `surface_z`. After a move to machine z
       (G53, G28) at or above `safe_z`, z counts as high. A move to machine x or y must not start below the clearance
       height, whether or not it rises.
    2. A rapid does not descend below `surface_z`, except back into a hole. In that case, a feed at this position must
       have gone at least as deep since the tool arrived. This rule does not apply to `milled` areas, because
       `processes.pocket.proof.pocket` compares them with earlier cuts.
    3. The spindle turns during every cut. A tool change stops it. A `torch` must instead be off in every rapid in x or
       y. A feed move above the sheet with the torch off is harmless.

    Drilling cycles are expanded into moves before the check.

    Parameters
    ----------
    tops
        Positions and heights of the holes if they start at different heights, float64[n, 3]. The first rule uses the
        highest hole as the surface. The second rule does the same, except above a hole.
    level
        Whether the surface is flat. Otherwise, `proof.surface` checks the height of rapids in x or y, and the first
        rule only requires that the height is known.
    """
    path = expand_cycles(path)
    turning = _spindle_speed(path) != 0
    surface: float | NDArray[np.float64] = surface_z
    if tops is not None and len(tops):
        surface_z = float(tops[:, 2].max())
        surface = _surface_height_below(path, tops, surface_z)
    if not level:
        surface_z = -np.inf
    heights = rapid_height_checks(path, surface_z, safe_z, milled, surface)
    checks = [*heights, torch_off_check(path, turning) if torch else spindle_turns_check(path, turning)]
    dangers = [(int(row), kind, text) for kind, mask, text in checks for row in np.flatnonzero(mask)[:100]]
    total = sum(int(mask.sum()) for _, mask, _ in checks)
    return limit_differences([_clearance_difference(path, *danger) for danger in sorted(dangers)], total)


DangerCheck = tuple[Message, Mask, Message]


def _surface_height_below(path: Toolpath, tops: NDArray[np.float64], highest: float) -> NDArray[np.float64]:
    """Return the surface height below the end of each move, mm. This is the top of a hole, or else `highest`."""
    import shapely  # slow to import, and needed only for holes with heights in the drawing

    result = np.full(len(path), highest)
    with_position = np.flatnonzero(np.isfinite(path.end[:, :2]).all(axis=1))
    holes: Any = shapely.points(tops[:, :2])
    ends: Any = shapely.points(path.end[with_position, :2])
    end, hole = shapely.STRtree(holes).query_nearest(ends, max_distance=_SAME_POSITION, all_matches=False)
    result[with_position[end]] = tops[hole, 2]
    return result


def rapid_height_checks(
    path: Toolpath,
    surface_z: float,
    safe_z: float,
    milled: bool,
    surface: float | NDArray[np.float64] | None = None,
) -> list[DangerCheck]:
    """Return the first two rules of `check_clearance` as checks.

    A check consists of a name, a mask of the rows that violate the rule (bool[n]), and the text of the rule.

    Parameters
    ----------
    path
        Toolpath with expanded cycles.
    surface
        Surface height below each row if it differs from `surface_z`.
    """
    surface = surface_z if surface is None else surface
    rapid = path.kind == Kind.RAPID
    across = _moves_in_xy(path)
    lowest = np.fmin(path.before[:, 2], path.end[:, 2])
    low = rapid & across & (lowest < surface_z + LEAST_CLEARANCE - _TOLERANCE)
    home = (path.kind == Kind.MACHINE) & np.isfinite(path.end[:, :2]).any(axis=1)
    low |= home & (path.before[:, 2] < surface_z + LEAST_CLEARANCE - _TOLERANCE)
    descending = rapid & _descending_rows(path) & (path.end[:, 2] < surface - _TOLERANCE) & ~_returns_to_cut_depth(path)
    unknown_height = across & np.isnan(path.end[:, 2]) & ~rows_at_machine_height(path, safe_z)
    return [
        (Message("height not known"), unknown_height, Message("X or Y moves before Z is known")),
        (
            Message("rapid below clearance"),
            low,
            Message("a rapid in x or y must be at Z{:.3f} or above", surface_z + LEAST_CLEARANCE),
        ),
        (
            Message("rapid into the part"),
            descending & (not milled),
            Message("a rapid descends below the surface, Z{:.3f}, at a position where nothing has been cut", surface)
            if isinstance(surface, float)
            else Message("a rapid descends below the surface at a position where nothing has been cut"),
        ),
    ]


def spindle_turns_check(path: Toolpath, turning: Mask) -> DangerCheck:
    """Return the third rule of `check_clearance` as a check. `turning` marks the rows in which the spindle turns."""
    return Message("spindle off"), _cutting_rows(path) & ~turning, Message("the spindle must turn before a cut")


def torch_off_check(path: Toolpath, burning: Mask) -> DangerCheck:
    """Return the third rule of `check_clearance` for a torch. `burning` marks the rows in which the torch is on."""
    return (
        Message("torch on in a rapid"),
        (path.kind == Kind.RAPID) & _moves_in_xy(path) & burning,
        Message("the torch must be off in a rapid"),
    )


def _clearance_difference(path: Toolpath, row: int, kind: Message, text: Message) -> Difference:
    start, end = start_and_end_texts(path, row)
    return Difference(kind, 0, int(path.line[row]), Message("{}; this move goes from {} to {}", text, start, end))


def _moves_in_xy(path: Toolpath) -> Mask:
    """Return a mask of the moves in x or y. The first move to a position on an axis counts as a move."""
    moved = np.isfinite(path.end[:, :2]) & ~(path.end[:, :2] == path.before[:, :2])
    across: Mask = (path.kind <= Kind.ARC_CCW) & moved.any(axis=1)
    return across


def _descending_rows(path: Toolpath) -> Mask:
    """Return a mask of the moves that go down, including moves from an unknown height."""
    down: Mask = np.isfinite(path.end[:, 2]) & ~(path.end[:, 2] >= path.before[:, 2])
    return down


def _cutting_rows(path: Toolpath) -> Mask:
    cutting: Mask = (path.kind >= Kind.FEED) & (path.kind <= Kind.ARC_CCW)
    return cutting


def _spindle_speed(path: Toolpath) -> NDArray[np.float64]:
    """Return the spindle speed in each row. M6 stops the spindle, as on LinuxCNC and Haas."""
    row = latest_marked_rows((path.kind == Kind.SPINDLE) | (path.kind == Kind.TOOL))
    turning = (row >= 0) & (path.kind[row] == Kind.SPINDLE)
    return np.where(turning, path.value[row], 0.0)


def rows_at_machine_height(path: Toolpath, safe_z: float) -> Mask:
    """Return a mask of the rows whose z was last set by a move to a safe height in machine coordinates."""
    in_machine = (path.kind == Kind.MACHINE) & np.isfinite(path.end[:, 2])
    in_program = (path.kind <= Kind.ARC_CCW) & np.isfinite(path.end[:, 2])
    row = latest_marked_rows(in_machine | in_program)
    high: Mask = (row >= 0) & in_machine[row] & (path.end[row, 2] >= safe_z - _TOLERANCE)
    return high


def _returns_to_cut_depth(path: Toolpath) -> Mask:
    """Return a mask of the motions that end no deeper than an earlier feed at the same x and y since the tool arrived.

    A new visit starts at each stop, at each change of tool or length offset, and at each block that is not understood.
    The running minimum is computed for all visits at once. To keep the visits apart, each visit is shifted down by more
    than the whole range of heights. A minimum from an earlier visit is then too high to be valid.
    """
    arrives = _moves_in_xy(path) | (path.kind == Kind.MACHINE)
    interruption = np.isin(path.kind, [int(k) for k in (Kind.TOOL, Kind.PAUSE, Kind.FOREIGN)])
    visit = np.cumsum(arrives | interruption | (np.diff(path.length_offset, prepend=0) != 0))
    heights = path.end[:, 2]
    finite_heights = heights[np.isfinite(heights)]
    shift = 2.0 * float(np.ptp(finite_heights)) + 1.0 if len(finite_heights) else 1.0
    feed_heights = np.where(_cutting_rows(path) & np.isfinite(heights), heights, np.inf)
    deepest = np.minimum.accumulate(feed_heights - shift * visit) + shift * visit if len(path) else feed_heights
    cut_in_visit = deepest <= (finite_heights.max() if len(finite_heights) else 0.0)
    result: Mask = ~arrives & cut_in_visit & (heights >= deepest - _TOLERANCE)
    return result
