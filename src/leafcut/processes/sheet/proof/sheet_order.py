"""Check the order, the pierces and the directions of cuts."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.errors import count_of
from leafcut.message import Message
from leafcut.model.difference import Difference
from leafcut.processes.sheet.proof.matched_runs import MatchedRuns, sheet_difference
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE, Target
from leafcut.proof.difference import position_text


def plan_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault if the number of cuts differs from the plan, and a fault for each contour missing in the plan."""
    cuts, found = matched.plan.cuts, []
    if len(cuts) != len(matched.runs):
        text = Message(
            "the torch is switched on for {}, but the plan has {}", count_of(len(matched.runs), "cut"), len(cuts)
        )
        found.append(sheet_difference(Message("number of cuts"), text, 0))
    planned = {i for cut in cuts for i in cut.contours}
    return found + [
        sheet_difference(Message("not planned"), Message("{} is in no cut of the plan", target.name), 0)
        for target in matched.targets
        if target.index not in planned and not target.may_stay
    ]


def order_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is cut after a contour around it has detached it."""
    closed = [t for t in matched.targets if t.shape is not None]
    everything = list(matched.targets)
    edges = np.array([t.edge for t in everything], dtype=object)
    tree, whole = shapely.STRtree(shapely.line_interpolate_point(edges, 0.0)), shapely.STRtree(edges)
    found = []
    for around in closed:
        shape = around.shape.buffer(-TOLERANCE)
        inside = set(tree.query(shape, predicate="contains").tolist())
        if not around.source.is_hole:
            inside |= _in_notches(matched, around, whole, inside)
        for number in sorted(inside):
            inner = everything[number]
            if inner.source.is_hole and around.source.is_hole and inner.source.part == around.source.part:
                continue  # holes of a part are not nested, but parts of a divided hole may overlap in a short neck
            late = _run_after(matched, inner, around) if inner.index != around.index else None
            if late is not None:
                text = Message("{} comes after {}, which detaches it", inner.name, around.name)
                found.append(sheet_difference(Message("out of order"), text, matched.runs[late].line))
    return found


def _in_notches(matched: MatchedRuns, around: Target, edges: Any, known: set[int]) -> set[int]:
    """Return the contours inside an outline and in its closed notches, as indices of targets.

    `edges` is the spatial index of the lines of all targets in the drawing. `known` contains the contours inside the
    outline. Return an empty set if there is no other contour nearby.
    """
    reach = 0.5 * matched.plan.data.kerf - TOLERANCE
    near = set(
        edges.query(shapely.box(*around.centreline.buffer(reach, quad_segs=1).bounds), predicate="contains").tolist()
    )
    if all(matched.targets[number].index == around.index for number in near - known):
        return set()
    burnt = shapely.Polygon(around.centreline.coords).buffer(reach)
    found: set[int] = set(edges.query(shapely.Polygon(burnt.exterior), predicate="contains").tolist())
    return found


def _run_after(matched: MatchedRuns, inner: Target, around: Target) -> int | None:
    """Return the last run of the contour `inner` if it ends after the cut of the contour `around` starts, otherwise
    None.
    """
    one, other = matched.of_target.get(inner.index), matched.of_target.get(around.index)
    if not one or not other:
        return None
    last = max(one, key=lambda c: (c.run, c.last))
    first = min((c for c in other if matched.detaches(c)), key=lambda c: (c.run, c.first), default=other[0])
    return last.run if (last.run, last.last) > (first.run, first.first + TOLERANCE) else None


def pierce_faults(matched: MatchedRuns) -> list[Difference]:
    """Return the faults of pierces: in an earlier kerf, in a detached part or slug, or missing."""
    found = []
    starts = shapely.points([run.start for run in matched.runs])
    tree = shapely.STRtree(starts)
    for number, line in enumerate(matched.lines):
        reach = max(0.5 * matched.plan.data.kerf - TOLERANCE, 0.0)
        for later in tree.query(line, predicate="dwithin", distance=reach).tolist():
            if later > number and matched.pierces(later) and not matched.marks[later] and not matched.marks[number]:
                text = Message(
                    "the torch is switched on at {}, in the kerf of an earlier cut",
                    position_text(*matched.runs[later].start),
                )
                found.append(sheet_difference(Message("pierces in the air"), text, matched.runs[later].line))
    found += _unpierced_cuts(matched)
    for claim in matched.claims:
        if claim.target.shape is None or not matched.detaches(claim):
            continue
        for later in tree.query(claim.target.shape, predicate="contains").tolist():
            if later > claim.run and all(c.run != later for c in matched.of_target[claim.target.index]):
                text = Message(
                    "the torch is switched on at {}, inside {}, which has already been cut",
                    position_text(*matched.runs[later].start),
                    claim.target.name,
                )
                found.append(sheet_difference(Message("pierces in the air"), text, matched.runs[later].line))
    return found


def _unpierced_cuts(matched: MatchedRuns) -> list[Difference]:
    sheet, half = matched.sheet, 0.5 * matched.plan.data.kerf
    found = []
    for number, run in enumerate(matched.runs):
        if matched.pierces(number) or matched.marks[number]:
            continue
        if sheet is None or shapely.distance(sheet, shapely.Point(*run.start)) < half - TOLERANCE:
            text = Message(
                "the torch is switched on at {} without a pierce, although that is not beside the sheet",
                position_text(*run.start),
            )
            found.append(sheet_difference(Message("not pierced"), text, run.line))
    return found


def direction_faults(matched: MatchedRuns) -> list[Difference]:
    """Return a fault for each contour that is cut in the wrong direction."""
    found = []
    for claim in matched.claims:
        if claim.run >= len(matched.plan.cuts) or claim.target.shape is None:
            continue
        cut = matched.plan.cuts[claim.run]
        asked = next((c.direction for c in cut.choices if c.contours == (claim.target.index,)), "")
        if asked not in ("clockwise", "counter-clockwise"):
            continue
        if (asked == "clockwise") != claim.clockwise:
            text = Message(
                "{} is cut clockwise, not counter-clockwise"
                if claim.clockwise
                else "{} is cut counter-clockwise, not clockwise",
                claim.target.name,
            )
            found.append(sheet_difference(Message("direction"), text, matched.runs[claim.run].line))
    return found
