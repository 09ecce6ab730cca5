"""Apply the choices that a plan file fixes. All other choices are left to the search."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter

import shapely

from leafcut.errors import PlanError, count_of
from leafcut.message import Message
from leafcut.model.cutting import ContourPrint, CutChoice, Lead, PlanFile
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.contours import CutContour
from leafcut.processes.sheet.plan.cutting import Cutting, precedence_pairs
from leafcut.processes.sheet.plan.leads import NO_LEAD
from leafcut.processes.sheet.plan.scrap import Scrap
from leafcut.processes.sheet.plan.starts import (
    CutStart,
    edge_starts,
    find_contour_starts,
    fitting_lead_out,
    leads_to_try,
    starts_with_leads,
    starts_without_lead,
)

#: A contour counts as unchanged if its length and its start differ by no more than this, mm. Its area may differ by
#: this value times its length.
SAME = 0.01
#: Maximum distance between a fixed start and its contour, mm, in addition to the kerf. It allows for coordinates that
#: users have rounded.
NEAR = 2.0


def check_plan_fits_drawing(sheet: Sheet, plan: PlanFile) -> None:
    """Raise PlanError if a plan file does not fit the drawing. The error names the first difference."""

    def refuse(reason: str) -> PlanError:
        return PlanError("{}: the plan no longer fits the drawing: {}; make a new plan", plan.source, reason)

    for number, (there, was) in enumerate(zip(sheet.contours, plan.contours, strict=False), 1):
        now = ContourPrint.of(there)
        x, y = now.start
        place = Message("contour {} at ({:.6g}, {:.6g})", number, x, y)
        if now.kind != was.kind:
            raise refuse(Message("{} is of kind {}, but the plan has {}", place, now.kind, was.kind))
        if abs(now.length - was.length) > SAME:
            raise refuse(Message("{} is {:.3f} mm long, but {:.3f} mm in the plan", place, now.length, was.length))
        if abs(now.area - was.area) > SAME * max(now.length, 1.0):
            raise refuse(Message("{} encloses {:.2f} mm², but {:.2f} mm² in the plan", place, now.area, was.area))
        if max(abs(a - b) for a, b in zip(now.start, was.start, strict=True)) > SAME:
            raise refuse(Message("{} started at ({:.6g}, {:.6g}) in the plan", place, was.start[0], was.start[1]))
    if len(sheet.contours) != len(plan.contours):
        raise refuse(
            Message(
                "the drawing has {}, but the plan has {}", count_of(len(sheet.contours), "contour"), len(plan.contours)
            )
        )


def restrict_starts_to_plan(cutting: Cutting, plan: PlanFile, *, everything: bool = False) -> Cutting:
    """Remove all starts that contradict the fixed choices of a plan file, or all its choices if `everything` is set.

    Raises PlanError if the drawing has changed, or if a fixed choice cannot be cut.
    """
    check_plan_fits_drawing(cutting.sheet, plan)
    position = {c.index: k for k, c in enumerate(cutting.contours)}
    chosen: dict[int, CutChoice] = {}
    for number, choice in enumerate(plan.cuts, 1):
        k = _contour_position(plan, number, choice, position, chosen)
        known = {"start": choice.start, "direction": choice.direction, "lead": choice.lead_in}
        words = ("order", *(word for word, value in known.items() if value)) if everything else ()
        chosen[k] = replace(choice, fixed=tuple(dict.fromkeys((*choice.fixed, *words))))
    starts: list[CutStart] = []
    for k in range(len(cutting.contours)):
        wanted = chosen.get(k)
        if wanted is None or not set(wanted.fixed) - {"order", "ahead"}:
            starts += cutting.starts_on([k])
        else:
            starts += _starts_matching_choice(cutting, k, wanted, plan)
    fixed = {k: c.fixed for k, c in chosen.items() if c.fixed}
    in_order = [k for k, c in chosen.items() if "order" in c.fixed]
    pairs = (*itertools.pairwise(in_order), *_ahead_pairs([*chosen], fixed))
    made = replace(cutting, starts=starts, order=pairs, fixed=fixed)
    _check_fixed_order(made, in_order, plan)
    return made


def _ahead_pairs(rows: list[int], fixed: dict[int, tuple[str, ...]]) -> list[tuple[int, int]]:
    """Return the precedence pairs (before, after) for contours that the plan file fixes as ``ahead``.

    Such a contour comes before all rows that follow it, up to and including the next contour that is fixed as
    ``ahead``. `rows` lists the contours in the order of the plan file.
    """
    pairs: list[tuple[int, int]] = []
    first = None
    for k in rows:
        if first is not None:
            pairs.append((first, k))
        if "ahead" in fixed.get(k, ()):
            first = k
    return pairs


def _check_fixed_order(cutting: Cutting, in_order: list[int], plan: PlanFile) -> None:
    """Raise PlanError if a fixed order detaches a part before a contour inside it is cut."""
    before: dict[int, set[int]] = {}
    for a, b in cutting.contour_precedence:
        before.setdefault(b, set()).add(a)
    try:
        tuple(TopologicalSorter(before).static_order())
        return
    except CycleError as ring:
        inside: list[int] = ring.args[1]
    rank = {k: place for place, k in enumerate(in_order)}
    late, early = next(
        (
            (a, b)
            for a, b in precedence_pairs(cutting.sheet, cutting.contours)
            if rank.get(a, -1) > rank.get(b, len(rank))
        ),
        (inside[0], inside[1]),
    )
    names = cutting.contours[early].name(), cutting.contours[late].name()
    raise PlanError(
        "{}: the fixed order has {} before {}, which must be cut first; move it there, "
        "or remove 'order' or 'ahead' from 'fixed'",
        plan.source,
        names[0],
        names[1],
    )


def _contour_position(
    plan: PlanFile, number: int, choice: CutChoice, position: dict[int, int], chosen: dict[int, CutChoice]
) -> int:
    if len(choice.contours) != 1:
        raise PlanError("{}: cut {} has {} contours; only one is allowed", plan.source, number, len(choice.contours))
    index = choice.contours[0]
    if index not in position:
        raise PlanError("{}: cut {}: contour {} is not cut on this sheet", plan.source, number, index + 1)
    if position[index] in chosen:
        raise PlanError("{}: cut {}: contour {} is cut twice", plan.source, number, index + 1)
    return position[index]


def order_as_planned(cutting: Cutting, plan: PlanFile) -> list[CutStart]:
    """Sort the cuts as in the plan file, unless the precedence requires another order.

    Return one start for each cut.
    """
    rank = {c.contours[0]: number for number, c in enumerate(plan.cuts)}
    last = len(plan.cuts)
    by_rank = sorted(cutting.first_contours, key=lambda k: (rank.get(cutting.contours[k].index, last), k))
    placed: set[int] = set()
    order: list[int] = []
    before: dict[int, list[int]] = {}
    for a, b in cutting.cut_precedence:
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
    return [cutting.starts[cutting.starts_by_contour[k][0]] for k in order]


def _starts_matching_choice(cutting: Cutting, k: int, choice: CutChoice, plan: PlanFile) -> list[CutStart]:
    """Return the starts of a contour that match its entry in the plan file. Raises PlanError if there is none."""
    contour, scrap = cutting.contours[k], cutting.scrap
    lead = choice.lead_in if "lead" in choice.fixed else None
    if lead is not None:
        contour = replace(contour, rules=replace(contour.rules, lead_in=lead))
    rules, directions = contour.rules, contour.allowed_directions if contour.path.closed else (False, True)
    if "direction" in choice.fixed:
        if contour.path.closed != choice.direction.endswith("clockwise"):
            words = Message("clockwise or counter-clockwise") if contour.path.closed else Message("forward or backward")
            raise PlanError("{}: {} can run {}, not {}", plan.source, contour.name(), words, choice.direction)
        directions = (choice.direction in ("clockwise", "backward"),)
    if "start" in choice.fixed and choice.start is not None:
        point = shapely.Point(*choice.start)
        away = shapely.distance(point, contour.line)
        if away > NEAR + rules.kerf:
            raise PlanError(
                "{}: the fixed start ({:g}, {:g}) is {:.3g} mm away from {}",
                plan.source,
                choice.start[0],
                choice.start[1],
                away,
                contour.name(),
            )
        places = [float(shapely.line_locate_point(contour.line, point, normalized=True)) * contour.path.length]
    else:
        places = sorted({s.at for s in cutting.starts_on([k])})
    if not contour.path.closed:
        own = [s for s in find_contour_starts(k, contour, scrap, 4) if s.clockwise in directions]
        return own if "start" not in choice.fixed else [min(own, key=lambda s: _distance_from_choice(s, choice))]
    if contour.has_leads and rules.edge_start:
        found = [] if contour.hole else edge_starts(k, contour, scrap, places)
        found = [s for s in found if s.clockwise in directions and (lead is None or _has_lead(s, lead))]
    else:
        if contour.has_leads and rules.compensation == "controller":
            places = _compensable_positions(contour, places, plan)
        found = _starts_at(k, contour, scrap, [(at, way) for way in directions for at in places], lead)
    if lead is not None and contour.has_leads and (rules.edge_start or rules.lead_in.style != "none"):
        found = _with_lead_out(contour, scrap, found, choice)
    if not found:
        raise PlanError("{}: no lead fits at the fixed start or direction of {}", plan.source, contour.name())
    return found


def _has_lead(start: CutStart, lead: Lead) -> bool:
    own = start.lead_in
    return own.style == lead.style and max(abs(own.length - lead.length), abs(own.angle - lead.angle)) < SAME


def _compensable_positions(contour: CutContour, places: list[float], plan: PlanFile) -> list[float]:
    """Return the positions at which a controller with kerf compensation can start.

    Raises PlanError if it cannot start at any of the given positions.
    """
    rules = contour.rules
    if rules.lead_in.style != "arc" or rules.lead_in.run_in <= 0.0:
        raise PlanError(
            "{}: the controller can compensate the kerf only on a straight run-in and an arc, but the fixed lead of {} "
            "is different; give it \"run_in\", or remove 'lead' from 'fixed'",
            plan.source,
            contour.name(),
        )
    smooth = [at for at in places if contour.is_smooth(at)]
    if not smooth:
        raise PlanError(
            "{}: a controller that compensates the kerf cannot start {} at a corner; move "
            "its start, or remove 'start' from 'fixed'",
            plan.source,
            contour.name(),
        )
    return smooth


def _distance_from_choice(start: CutStart, choice: CutChoice) -> float:
    x, y = choice.start or (0.0, 0.0)
    return abs(start.entry[0] - x) + abs(start.entry[1] - y)


def _starts_at(
    k: int, contour: CutContour, scrap: Scrap, places: list[tuple[float, bool]], lead: Lead | None
) -> list[CutStart]:
    """Return the starts of a closed contour at `places`. If `lead` is None, every lead-in that fits is used."""
    if not contour.has_leads or contour.rules.lead_in.style == "none":
        return starts_without_lead(k, contour, places)
    leads: Sequence[Lead | None] = [lead] if lead is not None else leads_to_try(contour)
    found: list[CutStart] = []
    for splash in (True, False):
        found = found or starts_with_leads(k, contour, scrap, places, leads, splash)
    return found


def _with_lead_out(contour: CutContour, scrap: Scrap, starts: list[CutStart], choice: CutChoice) -> list[CutStart]:
    """Add the lead-out of the plan file to the starts. Starts without room for this lead-out are dropped."""
    if choice.lead_out is None:
        return starts
    kept = []
    for s in starts:
        out, leave = fitting_lead_out(contour, scrap, (s.at, s.clockwise), choice.lead_out)
        if choice.lead_out in (out, NO_LEAD):
            kept.append(replace(s, lead_out=choice.lead_out, exit=leave))
    return kept
