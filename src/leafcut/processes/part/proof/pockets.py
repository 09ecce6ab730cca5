"""Check that each pocket is cleared to its depth wherever the mill fits, and that no cut leaves the pocket."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.model.pocket import PocketRules
from leafcut.model.toolpath import Kind
from leafcut.processes.part.model import PartRequest, PocketArea, PocketMill
from leafcut.processes.part.proof.cuts import HEIGHT, TOLERANCE, Cuts, FaceWork, Verdict, strip_along
from leafcut.processes.pocket.proof.pocket import depth_differences, fast_cut_differences
from leafcut.proof.difference import position_text

#: Maximum share of the reachable area that may remain uncut, and maximum side of an uncut square, in mill diameters.
_LEFT, _WIDEST_LEFT = 0.001, 0.25
#: Maximum overlap of the mill with the walls of a slot as wide as the mill, mm. A larger value would accept passages
#: that are too narrow.
_SLACK = 0.005
#: Number of chords per quarter of the tool circle.
_QUARTER = 64
#: Maximum width of the material under a mill that goes straight down, in radii of the mill.
_FILM = 0.02
#: Minimum slope of a plunge. A ramp has a slope of at most 1.03 (0.8 rad, the maximum of --entry-angle).
_STEEP = 2.0


def check_pockets(request: PartRequest, cuts: Cuts) -> Verdict:
    """Check the cuts that lie inside a pocket and above its floor.

    The check reports uncleared areas, cuts that exceed the step-down, and cuts that exceed the feed. In a pocket of two
    mills, the second mill must clear what the first mill cannot reach.
    """
    explained = np.zeros(len(cuts), dtype=np.bool_)
    differences, works = [], []
    rows_of: dict[PocketMill, np.ndarray[tuple[int], np.dtype[np.int64]]] = {}
    for pocket in request.pockets:
        mill = request.mill_of(pocket)
        own = _own_cuts(mill, pocket, cuts)
        rows_of[mill] = np.union1d(rows_of.get(mill, cuts.rows[:0]), cuts.rows[own])
        floor = own[cuts.highest[own] <= -pocket.depth + HEIGHT]
        differences += _check_floor(_reachable(mill, pocket), mill, pocket, cuts, floor)
        if request.finish:
            differences += _check_walls(mill.radius, request.finish, pocket, cuts, own, floor)
        if pocket.rest is not None:
            rest = _own_cuts(pocket.rest, pocket, cuts)
            rows_of[pocket.rest] = np.union1d(rows_of.get(pocket.rest, cuts.rows[:0]), cuts.rows[rest])
            differences += _check_rest(mill, pocket.rest, pocket, cuts, own, rest)
            own = np.union1d(own, rest)
        explained[own] = True
        works.append(FaceWork(pocket.name, own, pocket.region))
    for mill, rows in rows_of.items():
        differences += check_load(mill, cuts, rows) if len(rows) else []
    return Verdict(explained, differences, works)


def _own_cuts(mill: PocketMill, pocket: PocketArea, cuts: Cuts) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    inside = cuts.within(pocket.region.buffer(TOLERANCE - mill.radius, quad_segs=_QUARTER))
    above = cuts.lowest >= -pocket.depth - HEIGHT
    return np.intersect1d(inside, np.flatnonzero((cuts.tools == mill.tool) & above))


def _check_rest(
    first: PocketMill,
    mill: PocketMill,
    pocket: PocketArea,
    cuts: Cuts,
    before: np.ndarray[tuple[int], np.dtype[np.int64]],
    own: np.ndarray[tuple[int], np.dtype[np.int64]],
) -> list[Difference]:
    """Check that a mill clears what the first mill cannot reach, after its cuts, and never plunges into material.

    `before` are the cuts of the first mill in this pocket, and `own` are those of the second mill.
    """
    floor = -pocket.depth + HEIGHT
    left = _reachable(mill, pocket).difference(_reachable(first, pocket))
    differences = _check_floor(left, mill, pocket, cuts, own[cuts.highest[own] <= floor])
    if len(before) and len(own) and cuts.rows[own[0]] < cuts.rows[before[-1]]:
        words = Message("T{} works in {} before T{} has cleared it", mill.tool, pocket.name, first.tool)
        differences.append(cuts.difference(Message("order"), int(own[0]), words))
    move = cuts.ends[own, 3:] - cuts.ends[own, :3]
    for k in own[-move[:, 2] > np.maximum(_STEEP * np.hypot(*move[:, :2].T), HEIGHT)].tolist():
        disc = shapely.Point(cuts.ends[k, 3:5]).buffer((1.0 - _FILM) * mill.radius - TOLERANCE)
        near = np.intersect1d(cuts.near(disc, first.radius), np.concatenate([before, own]))
        near = near[(near < k) & (cuts.highest[near] <= cuts.lowest[k] + HEIGHT)]
        radii = np.where(cuts.tools[near] == first.tool, first.radius, mill.radius)
        if not shapely.union_all(shapely.buffer(cuts.lines[near], radii, quad_segs=_QUARTER)).covers(disc):
            words = Message("T{} plunges into material, at {}", mill.tool, cuts.place(k))
            differences.append(cuts.difference(Message("plunge"), k, words))
    return differences


def check_load(mill: PocketMill, cuts: Cuts, rows: np.ndarray[tuple[int], np.dtype[np.int64]]) -> list[Difference]:
    """Check the step-down of cuts, and check that moves faster than the feed do not touch material."""
    other = np.isin(cuts.path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    other[rows] = False
    path = replace(cuts.path, kind=np.where(other, Kind.RAPID, cuts.path.kind).astype(cuts.path.kind.dtype))
    rules = PocketRules(2.0 * mill.radius, mill.radius)
    return [*depth_differences(path, rules, mill.step), *fast_cut_differences(path, rules, mill.feed)]


def _reachable(mill: PocketMill, pocket: PocketArea) -> Any:
    inner = mill.radius - _SLACK
    return pocket.region.buffer(-inner, quad_segs=_QUARTER).buffer(inner, quad_segs=_QUARTER)


def _check_floor(
    reachable: Any,
    mill: PocketMill,
    pocket: PocketArea,
    cuts: Cuts,
    floor: np.ndarray[tuple[int], np.dtype[np.int64]],
) -> list[Difference]:
    at = uncleared_place(mill.radius, reachable, cuts, floor)
    if at is None:
        return []
    words = Message("{} is not cleared {:g} mm deep at {}", pocket.name, pocket.depth, at)
    return [Difference(Message("not cut"), 0, 0, words)]


def _check_walls(
    radius: float,
    finish: float,
    pocket: PocketArea,
    cuts: Cuts,
    own: np.ndarray[tuple[int], np.dtype[np.int64]],
    floor: np.ndarray[tuple[int], np.dtype[np.int64]],
) -> list[Difference]:
    """Check roughing and finishing along the walls of a pocket.

    Roughing must clear the whole pocket except for the allowance before any cut gets closer to the walls. A pass along
    each wall must follow.
    """
    wide, differences = radius + finish, []
    for centres in shapely.get_parts(pocket.region.buffer(-radius, quad_segs=_QUARTER)):
        roughed = pocket.region.buffer(-wide, quad_segs=_QUARTER).intersection(centres)
        here, allowed = cuts.within(centres.buffer(TOLERANCE)), cuts.within(roughed.buffer(TOLERANCE))
        nearer = np.setdiff1d(np.intersect1d(own, here), allowed)
        first = cuts.rows[nearer].min(initial=len(cuts.path))
        before = np.intersect1d(floor[cuts.rows[floor] < first], allowed)
        at = uncleared_place(radius, roughed.buffer(radius, quad_segs=_QUARTER), cuts, before)
        if at is not None:
            words = Message("{} is not roughed with an allowance of {:g} mm at {}", pocket.name, finish, at)
            differences.append(Difference(Message("roughing"), 0, 0, words))
        left = centres.boundary.difference(strip_along(cuts.lines[np.intersect1d(nearer, floor)]))
        if left.length > TOLERANCE:
            x, y = shapely.get_coordinates(left)[0].tolist()
            words = Message("a wall of {} is not finished at {}", pocket.name, position_text(x, y))
            differences.append(Difference(Message("not cut"), 0, 0, words))
    return differences


def uncleared_place(
    radius: float, reachable: Any, cuts: Cuts, floor: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> str | None:
    """Return a point that the cuts do not clear, as text, or None if only small remainders are left."""
    cleared = shapely.union_all(shapely.buffer(cuts.lines[floor], radius, quad_segs=_QUARTER))
    # Films along the walls come from the tolerance of the path.
    left = reachable.difference(cleared).buffer(-TOLERANCE).buffer(TOLERANCE)
    if left.is_empty:
        return None
    largest = max(shapely.get_parts(left), key=lambda piece: piece.area)
    if left.area <= _LEFT * reachable.area and largest.area <= (2.0 * _WIDEST_LEFT * radius) ** 2:
        return None
    at = largest.representative_point()
    return position_text(at.x, at.y)
