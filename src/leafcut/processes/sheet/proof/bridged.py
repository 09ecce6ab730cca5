"""The proof of chains: where a run of the torch cuts several contours, and what it burns on the way between them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.ops import substring

from leafcut.model.cutting import CutPlan
from leafcut.model.difference import Difference
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE
from leafcut.processes.sheet.proof.torch_runs import TorchRun
from leafcut.proof.difference import place

#: Bridges are looked at in steps of this part of a kerf.
STEP = 0.2
#: A bridge has left the kerfs that it begins at after so many kerfs.
LEAVES_WITHIN = 4.0
#: Two stretches of a run are one after the other though they overlap by this, mm.
OVERLAP = 0.2


@dataclass(frozen=True)
class Followed:
    """A contour that a run cuts: its index in `Sheet.contours`, from where to where along the run, its shape if closed.

    `shape` is shapely's.
    """

    contour: int
    first: float
    last: float
    shape: Any


def check_bridges(
    runs: Sequence[TorchRun], followed: Sequence[Sequence[Followed]], plan: CutPlan, lines: NDArray[Any], kerf: float
) -> list[Difference]:
    """Return what is wrong with runs that cut several contours.

    They are cut one after the other, each whole, as planned. A bridge leaves the kerf it begins at, and comes into no
    other: the arc would go out. No other run crosses it, and it is in no scrap that has been cut free.

    Parameters
    ----------
    followed
        Of every run, the contours that it cuts.
    lines
        What every run burns, shapely lines; empty ones for what is only marked.
    """
    found: list[Difference] = []
    tree = shapely.STRtree(lines)
    for number, own in enumerate(followed):
        planned = plan.cuts[number].contours if number < len(plan.cuts) and not plan.cuts[number].group else ()
        if len(own) < 2 and len(planned) < 2:
            continue
        steps = sorted(own, key=lambda f: f.first)
        found += _in_turn(runs[number], steps, planned)
        for before, after in itertools.pairwise(steps):
            bridge = _stretch(runs[number], before.last, after.first)
            if bridge is None:
                continue
            found += _leaves(runs[number], before.last, bridge, kerf)
            found += _loose(runs, followed, number, before.last, bridge)
            for other in tree.query(bridge, predicate="dwithin", distance=kerf - 2.0 * TOLERANCE).tolist():
                if other != number:
                    x, y = shapely.get_coordinates(shapely.shortest_line(lines[other], bridge))[0]
                    text = f"a bridge and another cut cross at {place(x, y)}: the arc would go out"
                    found.append(_wrong(runs[max(number, other)], text))
    return found


def _in_turn(run: TorchRun, steps: Sequence[Followed], planned: Sequence[int]) -> list[Difference]:
    got = tuple(f.contour for f in steps)
    if got != tuple(planned):
        words = [" and ".join(str(k + 1) for k in numbers) or "none" for numbers in (got, planned)]
        return [_wrong(run, f"a run cuts contours {words[0]}; planned are {words[1]}")]
    for before, after in itertools.pairwise(steps):
        if before.last > after.first + OVERLAP:
            return [_wrong(run, f"contour {after.contour + 1} is begun before contour {before.contour + 1} is done")]
    return []


def _stretch(run: TorchRun, begin: float, end: float) -> Any:
    """Return what a run burns between two distances along it, a shapely line; None for nothing."""
    if end - begin <= OVERLAP:
        return None
    whole = shapely.LineString(run.points)

    return substring(whole, begin, end)


def _leaves(run: TorchRun, at: float, bridge: Any, kerf: float) -> list[Difference]:
    """Return where a bridge comes into a kerf of its own run; `at` is where along the run it begins, mm."""
    done = _stretch(run, 0.0, at)
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
    return [_wrong(run, f"a bridge runs into a kerf of its own at {place(point.x, point.y)}: the arc would go out")]


def _loose(
    runs: Sequence[TorchRun], followed: Sequence[Sequence[Followed]], number: int, at: float, line: Any
) -> list[Difference]:
    """Return the contours that were cut before and have let go what a bridge crosses."""
    done = [f for k in range(number) for f in followed[k]]
    done += [f for f in followed[number] if f.last <= at + OVERLAP]
    for f in done:
        if f.shape is not None and f.shape.contains(line.interpolate(0.5, normalized=True)):
            return [_wrong(runs[number], f"a bridge crosses what contour {f.contour + 1} has cut free")]
    return []


def _wrong(run: TorchRun, text: str) -> Difference:
    return Difference("chain", 0, run.line, text)
