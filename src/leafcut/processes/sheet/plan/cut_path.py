"""The whole path of a cut from where it was chosen to start: lead-in, contour, overcut, lead-out, and its speeds."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.polyline import Polyline, joined
from leafcut.model.cutting import Cut, CutChoice
from leafcut.model.kinds import CutMethod
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.cutter_compensation import programmed_path
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    closing_joint,
    joints_wanted,
    overcut_of,
    scrap_left,
    travel_at,
)
from leafcut.processes.sheet.plan.leads.leads import lead_path

#: Ends this near to each other are one place, mm.
SAME_PLACE = 1e-6


def make_cut(contour: CutContour, start: CutStart, rules: CutRules, *, fixed: tuple[str, ...] = ()) -> Cut:
    """Return the run of the torch that begins at a start."""
    rules = contour.rules_of(rules)
    if rules.compensation == "controller" and contour.has_leads:
        return _programmed(contour, start, rules, fixed)
    body, past = body_of(contour, start, rules)
    left = scrap_left(contour, start.clockwise)
    path, end = contour.path, start.at - past if start.clockwise else start.at + past
    closed = contour.path.closed
    lead_in = (
        lead_path(start.lead_in, path.point_at(start.at), travel_at(path, start.at, start.clockwise), left)
        if closed or start.lead_in.length
        else None
    )
    out = (
        lead_path(start.lead_out, path.point_at(end), travel_at(path, end, start.clockwise), left, out=True)
        if closed
        else None
    )
    whole = joined(*(snapped(p) for p in (lead_in, body, out) if p is not None))
    begin = lead_in.length if lead_in is not None else 0.0
    leave = begin + body.length
    overcut = max(past, 0.0)
    off_at = leave - overcut if rules.torch_off_in_overcut and overcut > 0.0 else whole.length
    small = contour.is_small(rules)
    return Cut(
        contours=contour.indices,
        path=whole,
        lead_in=begin,
        lead_out=leave - overcut,
        torch_off_at=off_at,
        speeds=((0.0, rules.feed_of(contour.kind, small=small)),),
        choice=choice_of(contour, start, fixed),
        joints=joints_of(contour, start, rules, begin),
        loops=loops_of(contour, start, begin),
        pierce=start.pierce and contour.kind == "cut",
        kind=contour.kind,
        part=contour.source.part,
        small_hole=small,
        group=contour.group,
        common=contour.common,
    )


def _programmed(contour: CutContour, start: CutStart, rules: CutRules, fixed: tuple[str, ...]) -> Cut:
    """Return a cut whose kerf the controller compensates."""
    path, lead_in = programmed_path(contour, start, rules)
    small = contour.is_small(rules)
    return Cut(
        contours=(contour.index,),
        path=path,
        lead_in=lead_in,
        lead_out=path.length - overcut_of(contour, rules),
        torch_off_at=path.length,
        speeds=((0.0, rules.small_hole_feed if small else rules.data.feed),),
        choice=choice_of(contour, start, fixed),
        pierce=start.pierce,
        part=contour.source.part,
        compensation=41 if scrap_left(contour, start.clockwise) else 42,
        small_hole=small,
    )


def body_of(contour: CutContour, start: CutStart, rules: CutRules, *, overcut: bool = True) -> tuple[Polyline, float]:
    """Return the contour from its start on, in its direction, with what it is cut past its beginning (mm).

    `overcut`: with the overcut that the rules ask for.
    """
    path = contour.path
    if not path.closed:
        return (path.reversed() if start.clockwise else path), 0.0
    past = (overcut_of(contour, rules) if overcut else 0.0) - closing_joint(contour, rules)
    length = path.length + past
    if start.clockwise:
        return path.reversed().piece(path.length - start.at, path.length - start.at + length), past
    return path.piece(start.at, start.at + length), past


def snapped(piece: Polyline) -> Polyline:
    """Return an open path without pieces so short that only rounding made them."""
    rows = piece.vertices
    step = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    keep = np.append(step > SAME_PLACE, True)
    return piece if keep.all() or keep.sum() < 2 else Polyline(rows[keep])


def choice_of(contour: CutContour, start: CutStart, fixed: tuple[str, ...] = ()) -> CutChoice:
    """Return what was chosen, as a plan file says it."""
    x, y = contour.path.point_at(start.at)
    closed = contour.path.closed
    words = ("clockwise", "counter-clockwise") if closed else ("backward", "forward")
    return CutChoice(
        contours=contour.indices,
        start=(round(x, 4), round(y, 4)),
        direction=words[0] if start.clockwise else words[1],
        lead_in=start.lead_in,
        lead_out=start.lead_out,
        fixed=fixed,
    )


def _along(contour: CutContour, start: CutStart, at: float) -> float:
    """Return how far along the cut's contour a place of the path comes, mm."""
    return (start.at - at if start.clockwise else at - start.at) % contour.path.length


def loops_of(contour: CutContour, start: CutStart, begin: float) -> tuple[tuple[float, float], ...]:
    """Return where along a cut whose contour begins at `begin` the loops round corners are, mm."""
    spans = []
    for low, high in contour.loops:
        first = _along(contour, start, high if start.clockwise else low)
        spans.append((begin + first, begin + first + high - low))
    return tuple(sorted(spans))


def joints_of(contour: CutContour, start: CutStart, rules: CutRules, begin: float) -> tuple[tuple[float, float], ...]:
    """Return the micro-joints of a laser: evenly, as near as corners let them, the beam off for a joint and a kerf.

    A joint in a corner is hard to break and to grind off, and one where the cut begins and ends is no joint.
    """
    wanted = joints_wanted(contour, rules) if rules.kind == CutMethod.LASER else 0
    length, off = contour.path.length, rules.joint_width + rules.kerf
    count = min(wanted, int(length / (4.0 * off)))
    room = 0.5 * off + rules.kerf
    taken = [(at - room, at + room) for at in (0.0, length, *(_along(contour, start, c) for c in contour.corners))]
    taken += [(low - room, high + room) for low, high in loops_of(contour, start, 0.0)]
    spans = []
    for k in range(count):
        middle, reach = length * (k + 0.5) / count, 0.5 * (length / count - off)
        places = (middle, *(edge for span in taken for edge in span))
        free = [abs(at - middle) for at in places if not any(low < at < high for low, high in taken)]
        nearest = min(free, default=length)
        if nearest <= reach:
            at = next(at for at in places if abs(at - middle) == nearest) + begin
            spans.append((at - 0.5 * off, at + 0.5 * off))
    return tuple(spans)
