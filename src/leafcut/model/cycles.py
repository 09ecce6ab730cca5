"""What a canned cycle does, move by move: the one place that timing, posts without cycles and verification share.

The order of moves is that of RS274/NGC section 3.5.16 as LinuxCNC's interpreter runs it (seen with `rs274 -g`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from leafcut.model.toolpath import DrillCycle, Kind, Motion, Toolpath

#: How far G73 backs off, and how far above the last depth G83 ends its rapid re-entry: 0.010 inch in LinuxCNC 2.9
#: (measured with rs274); Fanuc and Haas read it from a parameter.
PECK_CLEARANCE = 0.254

_EPSILON = 1e-9


def peck_depths(cycle: DrillCycle) -> list[float]:
    """Return the heights that the pecks reach, from the first to `cycle.bottom`, mm."""
    if cycle.peck <= 0:
        return [cycle.bottom]
    count = max(1, math.ceil((cycle.r_plane - cycle.bottom) / cycle.peck - _EPSILON))
    return [cycle.r_plane - cycle.peck * (i + 1) for i in range(count - 1)] + [cycle.bottom]


def expand_drill(motion: Motion, cycle: DrillCycle, z_now: float) -> Iterator[Motion]:
    """Yield the rapids, feeds and dwells of one cycle, from the height `z_now` (NaN: at or above the R plane).

    First up to the R plane if the tool is below it, then over the hole, down to the R plane, drill, and up to the
    height that `motion.end` states.
    """
    x, y, z_after = motion.end
    feed, line = motion.value, motion.line
    height = z_now

    def row(kind: Kind, z: float, value: float = 0.0) -> Motion:
        nonlocal height
        height = z
        return Motion(kind, (x, y, z), value, 0, line)

    if z_now < cycle.r_plane:
        # Straight up where it stands: x and y are the caller's, marked as unknown here.
        yield Motion(Kind.RAPID, (math.nan, math.nan, cycle.r_plane), 0.0, 0, line)
        height = cycle.r_plane
    yield row(Kind.RAPID, height)
    if height != cycle.r_plane:
        yield row(Kind.RAPID, cycle.r_plane)
    yield from _drilling(cycle, row, feed)
    if cycle.name in ("G84", "G85"):
        yield row(Kind.FEED, cycle.r_plane, feed)
    if height != z_after:
        yield row(Kind.RAPID, z_after)


def _drilling(cycle: DrillCycle, move: Callable[..., Motion], feed: float) -> Iterator[Motion]:
    depths = peck_depths(cycle) if cycle.name in ("G83", "G73") else [cycle.bottom]
    for number, depth in enumerate(depths):
        if number:
            if cycle.name == "G83":
                yield move(Kind.RAPID, cycle.r_plane)
                yield move(Kind.RAPID, depths[number - 1] + PECK_CLEARANCE)
            else:
                yield move(Kind.RAPID, depths[number - 1] + PECK_CLEARANCE)
        yield move(Kind.FEED, depth, feed)
    if cycle.dwell > 0 and cycle.name in ("G82", "G84"):
        yield Motion(Kind.DWELL, (math.nan,) * 3, cycle.dwell, 0, 0)


def expand(path: Toolpath) -> Toolpath:
    """Return the same toolpath with every canned cycle written out in rapids, feeds and dwells.

    A tap's reversal of the spindle stays implied by the cycle and is not written out.
    """
    if not path.cycles:
        return path
    x = y = z = math.nan
    rows: list[Motion] = []
    for motion in path:
        if motion.kind is Kind.DRILL:
            for step in expand_drill(motion, path.cycles[motion.ref], z):
                if step.kind is Kind.DWELL:
                    rows.append(step)
                    continue
                x, y = (x, y) if math.isnan(step.end[0]) else step.end[:2]
                z = step.end[2]
                rows.append(step._replace(end=(x, y, z)))
            continue
        if motion.kind <= Kind.ARC_CCW:
            x, y, z = motion.end
        elif motion.kind is Kind.MACHINE:
            x, y, z = (p if math.isnan(m) else math.nan for p, m in zip((x, y, z), motion.end, strict=True))
        rows.append(motion)
    return replace(Toolpath.of_motions(rows), arcs=path.arcs)
