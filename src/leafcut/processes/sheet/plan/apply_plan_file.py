"""A plan file kept: what it fixes becomes the only choice, the rest stays free."""

from __future__ import annotations

import itertools
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter

import shapely

from leafcut.errors import PlanError, count_of
from leafcut.model.cutting import ContourPrint, CutChoice, PlanFile
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.cut_contours import NO_LEAD, CutContour
from leafcut.processes.sheet.plan.cut_rules import CutRules
from leafcut.processes.sheet.plan.cutting import Cutting, process_pairs
from leafcut.processes.sheet.plan.leads.cut_starts import (
    CutStart,
    away_from_corners,
    directions_of,
    end_of,
    fitting_lead_out,
    ways_of,
    with_leads,
)
from leafcut.processes.sheet.plan.leads.edge_starts import edge_starts
from leafcut.processes.sheet.plan.leads.find_starts import starts_of

#: Lengths of a contour that is the same again differ by less than this, mm; areas by less than this times its length.
SAME = 0.01
#: A fixed start may lie so far from its contour's path, besides the kerf, mm: people type few digits.
NEAR = 2.0


def check_fit(sheet: Sheet, plan: PlanFile) -> None:
    """Refuse a plan that was made for another drawing.

    Raises
    ------
    PlanError
        The first difference.
    """

    def refuse(reason: str) -> PlanError:
        return PlanError(f"{plan.source}: the plan no longer fits the drawing: {reason}; make a new plan")

    for number, (there, was) in enumerate(zip(sheet.contours, plan.contours, strict=False), 1):
        now = ContourPrint.of(there)
        x, y = now.start
        place = f"contour {number} at ({x:.6g}, {y:.6g})"
        if now.kind != was.kind:
            raise refuse(f"{place} is of kind {now.kind}, in the plan {was.kind}")
        if abs(now.length - was.length) > SAME:
            raise refuse(f"{place} is {now.length:.3f} mm long, in the plan {was.length:.3f} mm")
        if abs(now.area - was.area) > SAME * max(now.length, 1.0):
            raise refuse(f"{place} encloses {now.area:.2f} mm², in the plan {was.area:.2f} mm²")
        if max(abs(a - b) for a, b in zip(now.start, was.start, strict=True)) > SAME:
            raise refuse(f"{place} began at ({was.start[0]:.6g}, {was.start[1]:.6g}) in the plan")
    if len(sheet.contours) != len(plan.contours):
        raise refuse(f"it has {count_of(len(sheet.contours), 'contour')}, the plan {len(plan.contours)}")


def follow_plan(cutting: Cutting, plan: PlanFile, *, everything: bool = False) -> Cutting:
    """Return the cutting with the plan's fixed choices as the only ones; `everything`: all of its choices.

    Raises
    ------
    PlanError
        The plan is for another drawing, or what it fixes cannot be cut: says which cut.
    """
    check_fit(cutting.sheet, plan)
    position = {c.index: k for k, c in enumerate(cutting.contours)}
    chosen: dict[int, CutChoice] = {}
    in_order: list[int] = []
    rows: list[int] = []
    for number, choice in enumerate(plan.cuts, 1):
        k = _position(plan, number, choice, position, chosen)
        words = ("order", *(w for w in ("start", "direction", "lead") if _says(choice, w))) if everything else ()
        chosen[k] = replace(choice, fixed=tuple(dict.fromkeys((*choice.fixed, *words))))
        rows.append(k)
        if "order" in chosen[k].fixed:
            in_order.append(k)
    starts: list[CutStart] = []
    for k, contour in enumerate(cutting.contours):
        wanted = chosen.get(k)
        own = [cutting.starts[n] for n in cutting.by_contour[k]]
        if wanted is not None and set(wanted.fixed) - {"order", "ahead"}:
            own = _fixed_starts(cutting, k, contour, wanted, plan)
        starts += own
    fixed = {k: c.fixed for k, c in chosen.items() if c.fixed}
    ahead = _ahead(rows, fixed)
    made = replace(cutting, starts=starts, order=(*itertools.pairwise(in_order), *ahead), fixed=fixed)
    _check_order(made, in_order, plan)
    return made


def _ahead(rows: list[int], fixed: dict[int, tuple[str, ...]]) -> list[tuple[int, int]]:
    """Return pairs (before, after) of contours: what is fixed as ahead comes before all rows below it.

    Down to the next such row is enough, which is before the rest itself: the pairs grow with the rows.
    """
    pairs: list[tuple[int, int]] = []
    first = None
    for k in rows:
        if first is not None:
            pairs.append((first, k))
        if "ahead" in fixed.get(k, ()):
            first = k
    return pairs


def _check_order(cutting: Cutting, in_order: list[int], plan: PlanFile) -> None:
    """Refuse a fixed order that cuts something loose before what is inside it."""
    before: dict[int, set[int]] = {}
    for a, b in cutting.pairs:
        before.setdefault(b, set()).add(a)
    try:
        tuple(TopologicalSorter(before).static_order())
        return
    except CycleError as ring:
        inside: list[int] = ring.args[1]
    rank = {k: place for place, k in enumerate(in_order)}
    late, early = next(
        ((a, b) for a, b in process_pairs(cutting.sheet, cutting.contours) if rank.get(a, -1) > rank.get(b, len(rank))),
        (inside[0], inside[1]),
    )
    names = cutting.contours[early].name(), cutting.contours[late].name()
    raise PlanError(
        f"{plan.source}: the fixed order has {names[0]} before {names[1]}, which must be cut first; move it there, "
        "or remove 'order' or 'ahead' from 'fixed'"
    )


def _says(choice: CutChoice, word: str) -> bool:
    return bool({"start": choice.start, "direction": choice.direction, "lead": choice.lead_in}[word])


def _position(
    plan: PlanFile, number: int, choice: CutChoice, position: dict[int, int], chosen: dict[int, CutChoice]
) -> int:
    if len(choice.contours) != 1:
        raise PlanError(f"{plan.source}: cut {number} joins {len(choice.contours)} contours; a cut has one")
    index = choice.contours[0]
    if index not in position:
        raise PlanError(f"{plan.source}: cut {number}: contour {index + 1} is not cut on this sheet")
    if position[index] in chosen:
        raise PlanError(f"{plan.source}: cut {number}: contour {index + 1} is cut twice")
    return position[index]


def plan_order(cutting: Cutting, plan: PlanFile) -> list[CutStart]:
    """Return the first start of every contour in the order of the plan; what it does not name comes where it must."""
    rank = {c.contours[0]: number for number, c in enumerate(plan.cuts)}
    last = len(plan.cuts)
    by_rank = sorted(cutting.heads, key=lambda k: (rank.get(cutting.contours[k].index, last), k))
    placed: set[int] = set()
    order: list[int] = []
    before: dict[int, list[int]] = {}
    for a, b in cutting.head_pairs:
        before.setdefault(b, []).append(a)
    waiting = list(reversed(by_rank))
    while waiting:
        k = waiting[-1]
        missing = [a for a in before.get(k, ()) if a not in placed]
        if k in placed or not missing:
            waiting.pop()
            if k not in placed:
                placed.add(k)
                order.append(k)
        else:
            waiting += missing
    return [cutting.starts[cutting.by_contour[k][0]] for k in order]


def _fixed_starts(cutting: Cutting, k: int, contour: CutContour, choice: CutChoice, plan: PlanFile) -> list[CutStart]:
    """Return the starts that a fixed choice leaves.

    Raises
    ------
    PlanError
        None: what is fixed does not fit.
    """
    scrap, rules = cutting.scrap, contour.rules_of(cutting.rules)
    ways = directions_of(contour, rules) if contour.path.closed else (False, True)
    if "direction" in choice.fixed:
        if contour.path.closed != choice.direction.endswith("clockwise"):
            words = "clockwise or counter-clockwise" if contour.path.closed else "forward or backward"
            raise PlanError(f"{plan.source}: {contour.name()} can run {words}, not {choice.direction}")
        ways = (choice.direction in ("clockwise", "backward"),)
    if "lead" in choice.fixed and choice.lead_in is not None:
        rules = replace(rules, lead_in=choice.lead_in)
    if "start" in choice.fixed and choice.start is not None:
        point = shapely.Point(*choice.start)
        away = shapely.distance(point, contour.line)
        if away > NEAR + rules.kerf:
            raise PlanError(
                f"{plan.source}: the fixed start ({choice.start[0]:g}, {choice.start[1]:g}) is {away:.3g} mm away from "
                f"{contour.name()}"
            )
        places = [float(shapely.line_locate_point(contour.line, point, normalized=True)) * contour.path.length]
    else:
        places = sorted({cutting.starts[n].at for n in cutting.by_contour[k]})
    if not contour.path.closed:
        own = [s for s in starts_of(k, contour, scrap, rules, 4) if s.clockwise in ways]
        return own if "start" not in choice.fixed else [min(own, key=lambda s: _away(s, choice))]
    if contour.has_leads and rules.edge_start:
        found = _from_the_edge(cutting, k, contour, places, ways, choice)
    else:
        if contour.has_leads and rules.compensation == "controller":
            places = _for_the_controller(contour, rules, places, plan)
        found = _at_places(cutting, k, contour, rules, [(at, way) for way in ways for at in places], choice)
    if not found:
        raise PlanError(f"{plan.source}: no lead fits at the fixed start or direction of {contour.name()}")
    return found


def _from_the_edge(
    cutting: Cutting, k: int, contour: CutContour, places: list[float], ways: tuple[bool, ...], choice: CutChoice
) -> list[CutStart]:
    """Return the starts beyond the sheet's edge at these places: a plan pierces no more than the rules let."""
    if contour.hole:
        return []
    starts = [s for s in edge_starts(k, contour, cutting.scrap, cutting.rules, places) if s.clockwise in ways]
    lead = choice.lead_in if "lead" in choice.fixed else None
    if lead is None:
        return starts
    same = [
        s
        for s in starts
        if lead.style == s.lead_in.style
        and abs(lead.length - s.lead_in.length) < SAME
        and abs(lead.angle - s.lead_in.angle) < SAME
    ]
    return _left_as_fixed(cutting, contour, same, choice)


def _for_the_controller(contour: CutContour, rules: CutRules, places: list[float], plan: PlanFile) -> list[float]:
    """Return those places at which a controller that compensates the kerf can begin.

    Raises
    ------
    PlanError
        None is, or the lead is none on which the compensation can be taken up.
    """
    if rules.lead_in.style != "arc" or rules.lead_in.run_in <= 0.0:
        raise PlanError(
            f"{plan.source}: the controller compensates the kerf on a straight run-in and an arc; {contour.name()} has "
            "another lead fixed; give it \"run_in\", or remove 'lead' from 'fixed'"
        )
    smooth = [at for at in places if away_from_corners(contour, at, rules)]
    if not smooth:
        raise PlanError(
            f"{plan.source}: a controller that compensates the kerf cannot start {contour.name()} at a corner; move "
            "its start, or remove 'start' from 'fixed'"
        )
    return smooth


def _away(start: CutStart, choice: CutChoice) -> float:
    x, y = choice.start or (0.0, 0.0)
    return abs(start.entry[0] - x) + abs(start.entry[1] - y)


def _at_places(
    cutting: Cutting, k: int, contour: CutContour, rules: CutRules, places: list[tuple[float, bool]], choice: CutChoice
) -> list[CutStart]:
    """Return the starts of a closed contour at these places, with the fixed leads or those that fit."""
    scrap, lead = cutting.scrap, choice.lead_in if "lead" in choice.fixed else None
    if not contour.has_leads or rules.lead_in.style == "none":
        path = contour.path
        return [
            CutStart(k, at, way, path.point_at(at), path.point_at(end_of(contour, at, way, rules)))
            for at, way in places
        ]
    ways = [lead] if lead is not None else ways_of(contour, rules)
    found: list[CutStart] = []
    for splash in (True, False):
        found = found or with_leads(k, contour, scrap, rules, places, list(ways), splash)
    return found if lead is None else _left_as_fixed(cutting, contour, found, choice)


def _left_as_fixed(cutting: Cutting, contour: CutContour, starts: list[CutStart], choice: CutChoice) -> list[CutStart]:
    """Return those starts for whose fixed lead-out there is room, with it."""
    if choice.lead_out is None:
        return starts
    kept = []
    for s in starts:
        out, leave = fitting_lead_out(contour, cutting.scrap, cutting.rules, s.at, s.clockwise, choice.lead_out)
        if choice.lead_out in (out, NO_LEAD):
            kept.append(replace(s, lead_out=choice.lead_out, exit=leave))
    return kept
