"""The proof of the order, pierces and directions of cuts."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from leafcut.errors import count_of
from leafcut.model.difference import Difference
from leafcut.processes.sheet.proof.laid_runs import LaidRuns, wrong
from leafcut.processes.sheet.proof.sheet_shapes import TOLERANCE, Target
from leafcut.proof.difference import place


def misplaced(laid: LaidRuns) -> list[Difference]:
    """Return differences between the cuts and the plan: their number, and missing contours."""
    cuts, found = laid.plan.cuts, []
    if len(cuts) != len(laid.runs):
        text = f"the torch goes on for {count_of(len(laid.runs), 'cut')}, the plan has {len(cuts)}"
        found.append(wrong("number of cuts", text, 0))
    planned = {i for cut in cuts for i in cut.contours}
    return found + [
        wrong("not planned", f"{target.name} is in no cut of the plan", 0)
        for target in laid.targets
        if target.index not in planned and not target.may_stay
    ]


def disordered(laid: LaidRuns) -> list[Difference]:
    """Return the contours that are cut after a contour around them has detached them."""
    closed = [t for t in laid.targets if t.shape is not None]
    everything = list(laid.targets)
    edges = np.array([t.edge for t in everything], dtype=object)
    tree, whole = shapely.STRtree(shapely.line_interpolate_point(edges, 0.0)), shapely.STRtree(edges)
    found = []
    for around in closed:
        shape = around.shape.buffer(-TOLERANCE)
        inside = set(tree.query(shape, predicate="contains").tolist())
        if not around.source.is_hole:
            inside |= _in_notches(laid, around, whole, inside)
        for number in sorted(inside):
            inner = everything[number]
            if inner.source.is_hole and around.source.is_hole and inner.source.part == around.source.part:
                continue  # holes of a part are never nested; pieces of a divided hole may overlap in a short neck
            late = _later(laid, inner, around) if inner.index != around.index else None
            if late is not None:
                text = f"{inner.name} comes after {around.name}, which cuts it loose"
                found.append(wrong("out of order", text, laid.runs[late].line))
    return found


def _in_notches(laid: LaidRuns, around: Target, edges: Any, known: set[int]) -> set[int]:
    """Return the contours in notches that the kerf of an outline closes, without those `known` to lie inside."""
    reach = 0.5 * laid.plan.data.kerf - TOLERANCE
    near = set(edges.query(shapely.box(*around.way.buffer(reach, quad_segs=1).bounds), predicate="contains").tolist())
    if all(laid.targets[number].index == around.index for number in near - known):
        return set()
    burnt = shapely.Polygon(around.way.coords).buffer(reach)
    found: set[int] = set(edges.query(shapely.Polygon(burnt.exterior), predicate="contains").tolist())
    return found


def _later(laid: LaidRuns, inner: Target, around: Target) -> int | None:
    """Return a run of `inner` that does not end before `around` starts, or None."""
    one, other = laid.of_target.get(inner.index), laid.of_target.get(around.index)
    if not one or not other:
        return None
    last = max(one, key=lambda c: (c.run, c.last))
    first = min((c for c in other if laid.frees(c)), key=lambda c: (c.run, c.first), default=other[0])
    return last.run if (last.run, last.last) > (first.run, first.first + TOLERANCE) else None


def in_the_air(laid: LaidRuns) -> list[Difference]:
    """Return the pierces without metal: in an earlier kerf, or in a detached part or slug."""
    found = []
    starts = shapely.points([run.start for run in laid.runs])
    tree = shapely.STRtree(starts)
    for number, line in enumerate(laid.lines):
        reach = max(0.5 * laid.plan.data.kerf - TOLERANCE, 0.0)
        for later in tree.query(line, predicate="dwithin", distance=reach).tolist():
            if later > number and laid.pierces(later) and not laid.marks[later] and not laid.marks[number]:
                text = f"the torch is lit at {place(*laid.runs[later].start)}, in the kerf of an earlier cut"
                found.append(wrong("pierces in the air", text, laid.runs[later].line))
    found += _unpierced(laid)
    for claim in laid.claims:
        if claim.target.shape is None or not laid.frees(claim):
            continue
        for later in tree.query(claim.target.shape, predicate="contains").tolist():
            if later > claim.run and all(c.run != later for c in laid.of_target[claim.target.index]):
                text = (
                    f"the torch is lit at {place(*laid.runs[later].start)}, inside of {claim.target.name}, "
                    "which was cut before"
                )
                found.append(wrong("pierces in the air", text, laid.runs[later].line))
    return found


def _unpierced(laid: LaidRuns) -> list[Difference]:
    """Return the cuts without a pierce that do not start off the sheet."""
    sheet, half = laid.sheet, 0.5 * laid.plan.data.kerf
    found = []
    for number, run in enumerate(laid.runs):
        if laid.pierces(number) or laid.marks[number]:
            continue
        if sheet is None or shapely.distance(sheet, shapely.Point(*run.start)) < half - TOLERANCE:
            text = f"the torch is lit at {place(*run.start)} without a pierce, and not beside the sheet"
            found.append(wrong("not pierced", text, run.line))
    return found


def turned(laid: LaidRuns) -> list[Difference]:
    """Return the contours that are cut in the wrong direction."""
    found = []
    for claim in laid.claims:
        if claim.run >= len(laid.plan.cuts) or claim.target.shape is None:
            continue
        cut = laid.plan.cuts[claim.run]
        asked = next((c.direction for c in cut.choices if c.contours == (claim.target.index,)), "")
        if asked not in ("clockwise", "counter-clockwise"):
            continue
        if (asked == "clockwise") != claim.clockwise:
            way = "clockwise" if claim.clockwise else "counter-clockwise"
            text = f"{claim.target.name} is cut {way}, not {asked}"
            found.append(wrong("direction", text, laid.runs[claim.run].line))
    return found
