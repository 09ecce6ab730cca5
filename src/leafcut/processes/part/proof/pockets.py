"""Check that each pocket is cleared to its depth as far as the mill reaches, and that no cut leaves it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.pocket import PocketRules
from leafcut.model.toolpath import Kind
from leafcut.processes.part.model import PartRequest, PocketArea
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts, FaceWork, Verdict
from leafcut.processes.pocket.proof.pocket import air_differences, depth_differences
from leafcut.proof.difference import position_text

#: Share of the reachable area that may stay uncut, and largest side of an uncut square in diameters of the mill.
_LEFT, _WIDEST_LEFT = 0.001, 0.25
#: Largest overlap of the mill with the walls of a slot as wide as the mill, mm; more would count parts of passages that
#: are too narrow.
_SLACK = 0.005
#: Chords per quarter of the circle of the tool.
_QUARTER = 64


def check_pockets(request: PartRequest, cuts: Cuts) -> Verdict:
    """Return the verdict on the cuts inside pockets and not below their floors.

    Areas that are not cleared, cuts deeper than the step-down, and cuts faster than the feed are differences.
    """
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences, works = [], []
    for pocket in request.pockets:
        inside = cuts.within(pocket.region.buffer(TOLERANCE - request.radius, quad_segs=_QUARTER))
        own = inside[(cuts.tools[inside] == request.tool) & (cuts.lowest[inside] >= -pocket.depth - HEIGHT)]
        explained[own] = True
        differences += _check_floor(request, pocket, cuts, own[cuts.highest[own] <= -pocket.depth + HEIGHT])
        works.append(FaceWork(pocket.name, own, pocket.region))
    if explained.any():
        differences += _check_load(request, cuts, np.unique(cuts.rows[explained]))
    return Verdict(explained, differences, works)


def _check_load(request: PartRequest, cuts: Cuts, rows: np.ndarray[tuple[int], np.dtype[np.int64]]) -> list[Difference]:
    """Check the step-down of the cuts in `rows`, and that their moves faster than the feed cut only air."""
    other = np.isin(cuts.path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    other[rows] = False
    path = replace(cuts.path, kind=np.where(other, Kind.RAPID, cuts.path.kind).astype(cuts.path.kind.dtype))
    rules = PocketRules(2.0 * request.radius, request.radius)
    return [*depth_differences(path, rules, request.step), *air_differences(path, rules, request.feed)]


def _check_floor(
    request: PartRequest, pocket: PocketArea, cuts: Cuts, floor: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> list[Difference]:
    radius, inner = request.radius, request.radius - _SLACK
    reachable = pocket.region.buffer(-inner, quad_segs=_QUARTER).buffer(inner, quad_segs=_QUARTER)
    cleared = shapely.union_all(shapely.buffer(cuts.lines[floor], radius, quad_segs=_QUARTER))
    # Films along the walls come from the tolerance of the path.
    left = reachable.difference(cleared).buffer(-TOLERANCE).buffer(TOLERANCE)
    if left.is_empty:
        return []
    largest = max(shapely.get_parts(left), key=lambda piece: piece.area)
    if left.area <= _LEFT * reachable.area and largest.area <= (2.0 * _WIDEST_LEFT * radius) ** 2:
        return []
    at = largest.representative_point()
    words = Message("{} is not cleared {:g} mm deep at {}", pocket.name, pocket.depth, position_text(at.x, at.y))
    return [Difference(Message("not cut"), 0, 0, words)]
