"""The proof of common lines: cut once for both parts, before the cut that lets the parts go, into no other kerf."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from leafcut.model.cutting import Cut, CutPlan
from leafcut.model.difference import Difference
from leafcut.model.kinds import CutMethod, method_of
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE
from leafcut.processes.sheet.proof.torch_runs import TorchRun
from leafcut.proof.difference import place

#: Processes whose arc or flame goes out where there is no metal.
NEED_METAL = (CutMethod.PLASMA, CutMethod.OXYFUEL)
#: Two kerfs lie on each other along less than this where they only cross, in kerfs and in mm.
CROSSING_KERFS, CROSSING = 1.0, 0.2
#: A line ends at another within this, mm.
AT_END = 0.1


def check_common_lines(runs: Sequence[TorchRun], plan: CutPlan, lines: NDArray[Any], kerf: float) -> list[Difference]:
    """Return what is wrong with the runs that cut edges for two parts.

    No stretch of them is cut by another run; each lies within what the run around its parts encloses and comes before
    that; one that needs metal to burn on comes into an earlier one only at its end, and the run around is cut as it was
    asked. That every part is cut all the way is seen from the parts themselves.

    Parameters
    ----------
    lines
        What every run burns, shapely lines; empty ones for what is only marked.
    """
    cuts = dict(enumerate(plan.cuts[: len(runs)]))
    common = [k for k, cut in cuts.items() if cut.common > 0.0]
    if not common:
        return []
    found: list[Difference] = []
    tree = shapely.STRtree(lines)
    for k in common:
        for other in tree.query(lines[k], predicate="dwithin", distance=TOLERANCE).tolist():
            both = lines[k].intersection(lines[other].buffer(TOLERANCE))
            if other != k and both.length > max(CROSSING_KERFS * kerf, CROSSING) + 2.0 * TOLERANCE:
                x, y = shapely.get_coordinates(both)[0]
                later = runs[max(k, other)]
                found.append(_wrong("cut twice", later, f"an edge of two parts is cut twice at {place(x, y)}"))
    for group in sorted({cuts[k].group for k in common}):
        found += _in_group(runs, cuts, lines, [k for k in common if cuts[k].group == group], kerf)
    if method_of(plan.data.process) in NEED_METAL:
        found += _crossed(runs, lines, common)
    return found


def _in_group(
    runs: Sequence[TorchRun], cuts: dict[int, Cut], lines: NDArray[Any], own: Sequence[int], kerf: float
) -> Iterator[Difference]:
    """Yield what is wrong with the order of a group, or with the way round it."""
    group = cuts[own[0]].group
    around = [k for k, cut in cuts.items() if cut.group == group and not cut.common]
    if len(around) != 1:
        yield _wrong("out of order", runs[own[0]], f"{len(around)} runs go around parts with common lines; one must")
        return
    last = around[0]
    swept = shapely.get_parts(lines[last].buffer(0.5 * kerf, quad_segs=32))
    body = max((shapely.Polygon(p.exterior) for p in swept), key=lambda p: p.area).buffer(TOLERANCE - 0.5 * kerf)
    for k in own:
        if k > last:
            text = "a common line comes after the cut around its parts, which lets them go"
            yield _wrong("out of order", runs[k], text)
        inside = lines[k].intersection(body)
        if inside.length < cuts[k].common - TOLERANCE:
            x, y = runs[k].start
            yield _wrong("out of order", runs[k], f"the common line begun at {place(x, y)} is not within its parts")
    asked = cuts[last].choice.direction
    clockwise = _clockwise(runs[last])
    if asked in ("clockwise", "counter-clockwise") and clockwise != (asked == "clockwise"):
        yield _wrong("direction", runs[last], f"the cut around parts with common lines is not {asked}")


def _clockwise(run: TorchRun) -> bool:
    x, y = (run.points - run.points[0]).T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) < 0.0


def _crossed(runs: Sequence[TorchRun], lines: NDArray[Any], common: Sequence[int]) -> Iterator[Difference]:
    """Yield the common lines that go across the kerf of an earlier one: the arc would go out."""
    for early, late in itertools.combinations(sorted(common), 2):
        met = lines[late].intersection(lines[early])
        end = shapely.Point(runs[late].points[-1])
        if not met.is_empty and shapely.distance(met, end) > AT_END:
            x, y = shapely.get_coordinates(met)[0]
            yield _wrong("crosses a kerf", runs[late], f"a common line crosses an earlier one at {place(x, y)}")


def _wrong(what: str, run: TorchRun, text: str) -> Difference:
    return Difference(what, 0, run.line, text)
