"""The path of a chain: contour after contour with one pierce, and between them bridges, burning, through the scrap."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from leafcut.geometry.polyline import Polyline, joined
from leafcut.model.cutting import Cut, CutChoice
from leafcut.processes.sheet.plan.cut_contours import CutContour
from leafcut.processes.sheet.plan.cut_path import body_of, choice_of, joints_of, loops_of, snapped
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.leads.cut_starts import CutStart, overcut_of, scrap_left, travel_at
from leafcut.processes.sheet.plan.leads.leads import lead_path

Span = tuple[float, float]


def make_chain(contours: list[CutContour], start: CutStart, rules: CutRules, fixed: dict[int, tuple[str, ...]]) -> Cut:
    """Return the run of the torch that cuts a start's contour and then the others of its chain.

    Only the last one is cut past its beginning: the others are left where they close, or short of that by a joint.
    """
    steps = [start, *start.then]
    pieces: list[Polyline] = []
    bridges: list[Span] = []
    joints: list[Span] = []
    loops: list[Span] = []
    lead_in = _lead(contours[start.contour], start)
    at = lead = 0.0
    if lead_in is not None:
        pieces.append(lead_in)
        at = lead = lead_in.length
    past = 0.0
    for number, step in enumerate(steps):
        contour = contours[step.contour]
        body, past = body_of(contour, step, rules, overcut=step is steps[-1])
        if number:
            bridge = Polyline.of_points([pieces[-1].end, body.start])
            pieces.append(bridge)
            bridges.append((at, at + bridge.length))
            at += bridge.length
        joints += joints_of(contour, step, rules, at)
        loops += loops_of(contour, step, at)
        pieces.append(body)
        at += body.length
    overcut = max(past, 0.0)
    out = _lead(contours[steps[-1].contour], steps[-1], past=past)
    whole = joined(*(snapped(p) for p in (*pieces, *([out] if out is not None else []))))
    return Cut(
        contours=tuple(contours[s.contour].index for s in steps),
        path=whole,
        lead_in=lead,
        lead_out=at - overcut,
        torch_off_at=at - overcut if rules.torch_off_in_overcut and overcut > 0.0 else whole.length,
        speeds=((0.0, rules.data.feed),),
        choice=choice_of(contours[start.contour], start, fixed.get(start.contour, ())),
        joints=tuple(joints),
        loops=tuple(loops),
        pierce=start.pierce,
        part=contours[start.contour].source.part,
        bridges=tuple(bridges),
        chained=tuple(_linked(contours[s.contour], s, fixed) for s in start.then),
    )


def _lead(contour: CutContour, step: CutStart, past: float | None = None) -> Polyline | None:
    """Return the lead-in of a step; with `past`, how far it goes past its beginning, its lead-out."""
    out = past is not None
    at = step.at if past is None else step.at + (-past if step.clockwise else past)
    return lead_path(
        step.lead_out if out else step.lead_in,
        contour.path.point_at(at),
        travel_at(contour.path, at, step.clockwise),
        scrap_left(contour, step.clockwise),
        out=out,
    )


def _linked(contour: CutContour, step: CutStart, fixed: dict[int, tuple[str, ...]]) -> CutChoice:
    choice = choice_of(contour, step, fixed.get(step.contour, ()))
    return replace(choice, lead_in=None, lead_out=None, bridge=True)


def chain_length(contours: list[CutContour], start: CutStart, rules: CutRules) -> float:
    """Return how long the path of a chain is, mm; joints are not taken off."""
    steps = [start, *start.then]
    places = [contours[s.contour].path.point_at(s.at) for s in steps]
    ways = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
    bodies = sum(contours[s.contour].path.length for s in steps)
    overcut = overcut_of(contours[steps[-1].contour], rules)
    return ways + bodies + start.lead_in.length + steps[-1].lead_out.length + overcut
