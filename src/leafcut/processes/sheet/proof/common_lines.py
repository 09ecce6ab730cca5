"""Check common lines: each is cut once, before the cut that detaches its parts, and without crossing other kerfs."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.kinds import CutMethod, method_of
from leafcut.processes.sheet.proof.matched_runs import MatchedRuns, sheet_difference
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE
from leafcut.processes.sheet.proof.torch_runs import TorchRun
from leafcut.proof.difference import position_text

#: Methods whose arc or flame goes out when it crosses a kerf.
NEED_METAL = (CutMethod.PLASMA, CutMethod.OXYFUEL)
#: Minimum length over which kerfs coincide, in kerf widths and in mm. Over a shorter length, they only cross.
CROSSING_KERFS, CROSSING = 1.0, 0.2
#: Distance from the end of a line within which it may meet an earlier line, mm.
AT_END = 0.1


def check_common_lines(matched: MatchedRuns) -> list[Difference]:
    """Return the faults of runs that cut a common line of two parts.

    No other run may cut a section of a common line. Each line must lie inside the run around its group, and must come
    before that run. If the cutting method needs metal, a line may meet an earlier line only at its end. The run around
    the group must have the requested direction. Other checks ensure that each part is cut completely.
    """
    runs, lines, found = matched.runs, matched.kerf_lines, list[Difference]()
    cuts = dict(enumerate(matched.plan.cuts[: len(runs)]))
    common = [k for k, cut in cuts.items() if cut.common > 0.0]
    if not common:
        return []
    tree = shapely.STRtree(lines)
    for k in common:
        for other in tree.query(lines[k], predicate="dwithin", distance=TOLERANCE).tolist():
            both = lines[k].intersection(lines[other].buffer(TOLERANCE))
            if other != k and both.length > max(CROSSING_KERFS * matched.kerf, CROSSING) + 2.0 * TOLERANCE:
                x, y = shapely.get_coordinates(both)[0]
                text = Message("an edge of two parts is cut twice at {}", position_text(x, y))
                found.append(sheet_difference(Message("cut twice"), text, runs[max(k, other)].line))
    for group in sorted({cuts[k].group for k in common}):
        found += _group_faults(matched, group, [k for k in common if cuts[k].group == group])
    if method_of(matched.plan.data.process) in NEED_METAL:
        found += _crossing_faults(matched, common)
    return found


def _group_faults(matched: MatchedRuns, group: int, own: Sequence[int]) -> Iterator[Difference]:
    """Yield the faults of a group of common lines: order and position of the lines, and the run around the group."""
    runs, lines, cuts, kerf = matched.runs, matched.kerf_lines, matched.plan.cuts, matched.kerf
    around = [k for k, cut in enumerate(cuts[: len(runs)]) if cut.group == group and not cut.common]
    if len(around) != 1:
        text = Message("{} cuts, instead of a single one, go around parts with common lines", len(around))
        yield sheet_difference(Message("out of order"), text, runs[own[0]].line)
        return
    last = around[0]
    swept = shapely.get_parts(lines[last].buffer(0.5 * kerf, quad_segs=32))
    body = max((shapely.Polygon(p.exterior) for p in swept), key=lambda p: p.area).buffer(TOLERANCE - 0.5 * kerf)
    for k in own:
        if k > last:
            text = Message("a common line is cut after the cut around its parts, which detaches them")
            yield sheet_difference(Message("out of order"), text, runs[k].line)
        if lines[k].intersection(body).length < cuts[k].common - TOLERANCE:
            text = Message("the common line that starts at {} is not within its parts", position_text(*runs[k].start))
            yield sheet_difference(Message("out of order"), text, runs[k].line)
    asked = cuts[last].choice.direction
    if asked in ("clockwise", "counter-clockwise") and _clockwise(runs[last]) != (asked == "clockwise"):
        text = Message("the cut around parts with common lines is not {}", asked)
        yield sheet_difference(Message("direction"), text, runs[last].line)


def _clockwise(run: TorchRun) -> bool:
    x, y = (run.points - run.points[0]).T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) < 0.0


def _crossing_faults(matched: MatchedRuns, common: Sequence[int]) -> Iterator[Difference]:
    """Yield a fault for each common line that crosses the kerf of an earlier line, where the arc would go out."""
    for early, late in itertools.combinations(sorted(common), 2):
        met = matched.kerf_lines[late].intersection(matched.kerf_lines[early])
        end = shapely.Point(matched.runs[late].points[-1])
        if not met.is_empty and shapely.distance(met, end) > AT_END:
            x, y = shapely.get_coordinates(met)[0]
            text = Message("a common line crosses an earlier one at {}", position_text(x, y))
            yield sheet_difference(Message("crosses a kerf"), text, matched.runs[late].line)
