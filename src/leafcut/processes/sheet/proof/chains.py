"""Check chains: runs of the torch that cut several contours, and the bridges between these contours."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.sheet.proof.matched_runs import MOST, MatchedRuns, RunMatch, sheet_difference
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE
from leafcut.processes.sheet.proof.torch_runs import TorchRun
from leafcut.proof.difference import position_text

#: Spacing of the points checked along bridges, in kerf widths.
STEP = 0.2
#: Distance from the start of a bridge within which it must leave the kerfs there, in kerf widths.
LEAVES_WITHIN = 4.0
#: Maximum overlap of consecutive sections of a run, mm.
OVERLAP = 0.2


def check_chains(matched: MatchedRuns) -> list[Difference]:
    """Return the faults of runs that cut several contours.

    The contours must be cut completely, one after the other, as planned. A bridge must leave the kerf at its start and
    enter no other kerf, where the arc would go out. No other run may cross the bridge, and the scrap around the bridge
    must still be attached.
    """
    cuts, kerf, lines, found = matched.plan.cuts, matched.kerf, matched.kerf_lines, list[Difference]()
    followed: list[list[RunMatch]] = [[] for _ in matched.runs]
    for claim in matched.claims:
        in_group = claim.run < len(cuts) and cuts[claim.run].group
        if claim.followed > MOST * claim.target.centreline.length and not in_group:
            followed[claim.run].append(claim)
    tree = shapely.STRtree(lines)
    for number, own in enumerate(followed):
        planned = cuts[number].contours if number < len(cuts) and not cuts[number].group else ()
        if len(own) < 2 and len(planned) < 2:
            continue
        run, steps = matched.runs[number], sorted(own, key=lambda f: f.first)
        found += _order_faults(run, steps, planned)
        for before, after in itertools.pairwise(steps):
            bridge = _stretch_of_run(run, before.last, after.first)
            if bridge is None:
                continue
            found += _own_kerf_faults(run, before.last, bridge, kerf)
            earlier = [f for k in range(number) for f in followed[k]]
            found += _detached_scrap_faults(
                run, [*earlier, *(f for f in own if f.last <= before.last + OVERLAP)], bridge
            )
            for other in tree.query(bridge, predicate="dwithin", distance=kerf - 2.0 * TOLERANCE).tolist():
                if other != number:
                    x, y = shapely.get_coordinates(shapely.shortest_line(lines[other], bridge))[0]
                    text = Message("a bridge and another cut cross at {}: the arc would go out", position_text(x, y))
                    found.append(sheet_difference(Message("chain"), text, matched.runs[max(number, other)].line))
    return found


def _order_faults(run: TorchRun, steps: Sequence[RunMatch], planned: Sequence[int]) -> list[Difference]:
    """Return a fault if a run does not cut the planned contours in their order, each after the previous one."""
    got = tuple(f.target.index for f in steps)
    if got != tuple(planned):
        words = [" and ".join(str(k + 1) for k in numbers) or "none" for numbers in (got, planned)]
        return [
            sheet_difference(
                Message("chain"), Message("a run cuts contours {} instead of {}", words[0], words[1]), run.line
            )
        ]
    for before, after in itertools.pairwise(steps):
        if before.last > after.first + OVERLAP:
            one, other = before.target.index + 1, after.target.index + 1
            return [
                sheet_difference(
                    Message("chain"), Message("contour {} starts before contour {} is finished", other, one), run.line
                )
            ]
    return []


def _stretch_of_run(run: TorchRun, begin: float, end: float) -> Any:
    """Return the path of a run between two distances along the run, mm, as a shapely line, or None if it is empty."""
    return None if end - begin <= OVERLAP else substring(shapely.LineString(run.points), begin, end)


def _own_kerf_faults(run: TorchRun, at: float, bridge: Any, kerf: float) -> list[Difference]:
    """Return a fault if a bridge enters a kerf of its own run. The bridge starts `at` mm along the run."""
    done = _stretch_of_run(run, 0.0, at)
    if done is None:
        return []
    count = max(math.ceil(bridge.length / (STEP * kerf)), 4)
    along = np.linspace(0.0, bridge.length, count + 1)
    points = shapely.line_interpolate_point(bridge, along)
    apart = shapely.distance(points, done) >= kerf - 2.0 * TOLERANCE
    left = np.maximum.accumulate(apart) | (along > LEAVES_WITHIN * kerf)
    clear = apart | ~left
    clear[-1] = apart[-1]
    if clear.all():
        return []
    point = points[int(np.argmin(clear))]
    text = Message("a bridge runs into its own kerf at {}: the arc would go out", position_text(point.x, point.y))
    return [sheet_difference(Message("chain"), text, run.line)]


def _detached_scrap_faults(run: TorchRun, done: Sequence[RunMatch], bridge: Any) -> list[Difference]:
    """Return a fault if a bridge crosses scrap or parts that earlier contours, `done`, have detached."""
    middle = bridge.interpolate(0.5, normalized=True)
    for f in done:
        if f.target.shape is not None and f.target.shape.contains(middle):
            text = Message("a bridge crosses scrap or a part that contour {} has detached", f.target.index + 1)
            return [sheet_difference(Message("chain"), text, run.line)]
    return []
