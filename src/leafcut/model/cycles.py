"""Expand canned cycles to motion, for timing, for controllers without cycles, and for verification.

The moves follow the order in RS274/NGC, section 3.5.16, as LinuxCNC's interpreter executes it (observed with `rs274
-g`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.model.toolpath import DrillCycle, Kind, Motion, Toolpath

#: Retract distance of G73, mm. G83 also ends its rapid re-entry at this height above the last depth. LinuxCNC 2.9 uses
#: 0.010 inch (measured with rs274). On Fanuc and Haas, a parameter sets the distance.
PECK_CLEARANCE = 0.254

#: Cycles with a dwell at the bottom. G86 also stops the spindle there.
DWELLING = ("G82", "G84", "G86", "G89")
#: Cycles that drill in pecks.
PECKING = ("G83", "G73")
#: Cycles that retract at feed.
FEED_OUT = ("G84", "G85", "G89")

_EPSILON = 1e-9

#: Maximum number of pecks in a hole, and maximum number of moves in a program. A larger number comes from a misplaced
#: decimal point, and would exhaust the memory.
_MAX_PECKS = 10_000
_MAX_ROWS = 6_000_000

#: Number of moves per peck: down, up, and back down to the end of the previous peck.
_MOVES_A_PECK = 3


def peck_heights(cycle: DrillCycle) -> list[float]:
    """Return the heights of the pecks, from the first peck to `cycle.bottom`, mm.

    Raises
    ------
    PlanError
        The peck is unreasonably small.
    """
    return [cycle.r_plane - cycle.peck * (i + 1) for i in range(_peck_count(cycle) - 1)] + [cycle.bottom]


def _peck_count(cycle: DrillCycle) -> int:
    if cycle.peck <= 0 or cycle.name not in PECKING:
        return 1
    strokes = (cycle.r_plane - cycle.bottom) / cycle.peck
    if not strokes <= _MAX_PECKS:
        raise PlanError("a peck of {:g} mm takes {:.0f} strokes per hole; use a larger peck", cycle.peck, strokes)
    return max(1, math.ceil(strokes - _EPSILON))


def expand_cycle(motion: Motion, cycle: DrillCycle, z_now: float) -> Iterator[Motion]:
    """Yield the rapids, feeds and dwells of a cycle.

    If the tool is below the R plane, it first rises to the R plane. It then moves over the hole
    (`DrillCycle.approach`), descends to the R plane, drills, and rises to the height of `motion.end`. `z_now` is the
    height before the cycle, mm. NaN means that the tool is at or above the R plane.
    """
    x, y, z_after = motion.end
    feed, line = motion.value, motion.line
    height = z_now

    def row(kind: Kind, z: float, value: float = 0.0) -> Motion:
        nonlocal height
        height = z
        return Motion(kind, (x, y, z), value, 0, line)

    if cycle.approach == "slant":
        height = z_after
    elif z_now < cycle.r_plane or cycle.approach == "sink":
        # Straight up at the current position. The x and y are marked as unknown, and the caller fills them in.
        yield Motion(Kind.RAPID, (math.nan, math.nan, cycle.r_plane), 0.0, 0, line)
        height = cycle.r_plane
    yield row(Kind.RAPID, height)
    if height != cycle.r_plane:
        yield row(Kind.RAPID, cycle.r_plane)
    yield from _peck_moves(cycle, row, feed, line)
    if cycle.name in FEED_OUT:
        yield row(Kind.FEED, cycle.r_plane, feed)
    if height != z_after:
        yield row(Kind.RAPID, z_after)


def _peck_moves(cycle: DrillCycle, move: Callable[..., Motion], feed: float, line: int) -> Iterator[Motion]:
    depths = peck_heights(cycle) if cycle.name in PECKING else [cycle.bottom]
    for number, depth in enumerate(depths):
        if number:
            if cycle.name == "G83":
                yield move(Kind.RAPID, cycle.r_plane)
                yield move(Kind.RAPID, depths[number - 1] + PECK_CLEARANCE)
            else:
                yield move(Kind.RAPID, depths[number - 1] + PECK_CLEARANCE)
        yield move(Kind.FEED, depth, feed)
    if cycle.dwell > 0 and cycle.name in DWELLING:
        yield Motion(Kind.DWELL, (math.nan,) * 3, cycle.dwell, 0, line)


class Approach(NamedTuple):
    """Approach moves to holes.

    `upright` states whether the tool first moves vertically to the R plane. `begin` and `end` are the heights at the
    two ends of the travel move, mm. They are NaN if unknown.
    """

    upright: NDArray[np.bool_]
    begin: NDArray[np.float64]
    end: NDArray[np.float64]


def hole_approaches(path: Toolpath, drills: NDArray[np.int64], height: NDArray[np.float64]) -> Approach:
    """Return the approach moves to the holes in the rows `drills`. They start at the heights `height`, mm."""
    ref = path.ref[drills]
    r_plane = np.array([c.r_plane for c in path.cycles], dtype=np.float64)[ref]
    slant, sink = (np.array([c.approach == name for c in path.cycles], dtype=bool)[ref] for name in ("slant", "sink"))
    upright = sink | ((height < r_plane) & ~slant)
    start = np.where(upright, r_plane, height)
    return Approach(upright, start, np.where(slant, path.end[drills, 2], start))


def expand_cycles(path: Toolpath, keep: Collection[str] = ()) -> Toolpath:
    """Expand the canned cycles of a toolpath to rapids, feeds and dwells, except the cycles in `keep`.

    The result does not include the spindle reversal of a tap. It equals the result of `expand_cycle` for each row, but
    the function expands all holes at once, because a board may have a hundred thousand holes.

    Raises
    ------
    PlanError
        The cycles have unreasonably many pecks.
    """
    expanded = np.array([c.name not in keep for c in path.cycles], dtype=bool)
    drills = np.flatnonzero(path.kind == Kind.DRILL)
    drills = drills[expanded[path.ref[drills]]]
    if not len(drills):
        return path
    ref = path.ref[drills]
    steps = _steps_of_cycles(path.cycles, np.bincount(ref, minlength=len(path.cycles)))
    r_plane = np.array([c.r_plane for c in path.cycles])[ref]
    n_steps = np.array([len(s) for s in steps])[ref]
    drilled = np.array([s[-1].z for s in steps])[ref]
    before = path.before[drills]
    lifts, _, level = hole_approaches(path, drills, before[:, 2])
    descends = level != r_plane
    rises = drilled != path.end[drills, 2]
    count = np.ones(len(path), dtype=np.int64)
    count[drills] = lifts + 1 + descends + n_steps + rises
    first = (np.cumsum(count) - count)[drills]

    source = np.repeat(np.arange(len(path)), count)
    kind, end, value = path.kind[source], path.end[source], path.value[source]
    from_cycle = np.isin(source, drills)
    kind[from_cycle], value[from_cycle] = Kind.RAPID, 0.0
    end[first[lifts], :2] = before[lifts, :2]
    end[first[lifts], 2] = r_plane[lifts]
    approach_row = first + lifts
    end[approach_row, 2] = level
    end[approach_row[descends] + 1, 2] = r_plane[descends]
    row = np.repeat(approach_row + 1 + descends, n_steps) + _concatenated_ranges(n_steps)
    flat = [step for s in steps for step in s]
    first_step = np.cumsum([0] + [len(s) for s in steps])[:-1]
    step_index = np.repeat(first_step[ref], n_steps) + _concatenated_ranges(n_steps)
    kind[row] = np.array([int(s.kind) for s in flat])[step_index]
    end[row, 2] = np.array([s.z for s in flat])[step_index]
    feeds, dwells = kind[row] == Kind.FEED, kind[row] == Kind.DWELL
    value[row[feeds]] = np.repeat(path.value[drills], n_steps)[feeds]
    value[row[dwells]] = np.array([s.dwell for s in flat])[step_index][dwells]
    end[row[dwells]] = math.nan
    return Toolpath(
        kind,
        end,
        value,
        np.where(from_cycle, 0, path.ref[source]).astype(np.int32),
        path.line[source],
        path.cycles if keep else (),
        path.arcs,
    )


def _steps_of_cycles(cycles: tuple[DrillCycle, ...], uses: NDArray[np.int64]) -> list[list[_Step]]:
    rows = sum(_MOVES_A_PECK * _peck_count(c) * max(n, 1) for c, n in zip(cycles, uses.tolist(), strict=True))
    if rows > _MAX_ROWS:
        raise PlanError(
            "the drilling cycles have {:,} moves, more than the limit of {:,}; use larger pecks", rows, _MAX_ROWS
        )
    return [_steps_in_hole(cycle) for cycle in cycles]


class _Step(NamedTuple):
    """A step of a cycle in the hole: a move to height `z`, mm, or a dwell, s."""

    kind: Kind
    z: float
    dwell: float = 0.0


def _steps_in_hole(cycle: DrillCycle) -> list[_Step]:
    motion = Motion(Kind.DRILL, (0.0, 0.0, math.nan), 1.0, 0, 0)
    height, steps = cycle.r_plane, []
    for move in list(expand_cycle(motion, cycle, cycle.r_plane))[1:-1]:
        height = height if move.kind is Kind.DWELL else move.end[2]
        steps.append(_Step(move.kind, height, move.value if move.kind is Kind.DWELL else 0.0))
    return steps


def _concatenated_ranges(lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return 0, 1, …, n - 1 for each length n, as a single array."""
    total = int(lengths.sum())
    return np.arange(total) - np.repeat(np.cumsum(lengths) - lengths, lengths)
