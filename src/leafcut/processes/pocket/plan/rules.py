"""Derive the rules and levels for the pockets of a job from its options."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from leafcut.errors import OptionError, PlanError, count_of
from leafcut.message import Message
from leafcut.model.heights import SAME_HEIGHT
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.model.pocket import Pocket, PocketLevels, PocketRules
from leafcut.processes.pocket.options import PocketOptions

#: Maximum path tolerance, in mm and relative to the step-over. Close passes need a finer tolerance.
TOLERANCE, TOLERANCE_SHARE = 0.01, 0.05

#: Default step-over, in tool diameters.
STEP_OVER = 0.6
#: Maximum number of levels. A larger number is probably a mistake.
MOST_LEVELS = 2000
#: Maximum depth of a finishing pass, in tool diameters.
FINISHING_DEPTH = 2.0


def clearing_rules(
    options: PocketOptions, milling: str, step_over: float | None, diameter: float | None, tolerance: float = TOLERANCE
) -> PocketRules:
    """Return the rules for clearing a level.

    Parameters
    ----------
    milling
        ``climb`` or ``conventional``.
    step_over
        Step-over as a share of the tool diameter.
    diameter, tolerance
        Tool diameter and path tolerance, mm.

    Raises
    ------
    OptionError
        The tool diameter is missing, the stock is wider than the step-over, or the strategy `adaptive` has no
        engagement limit.
    """
    if diameter is None:
        raise OptionError(
            "a pocket needs the diameter of its end mill; give --tool-diameter, such as --tool-diameter 6mm, or a tool "
            "library with --tools"
        )
    widest = (step_over or STEP_OVER) * diameter
    if options.stock > widest:
        raise OptionError(
            "--stock {:g} mm is more than the step-over of {:.4g} mm: the finishing pass would "
            "cut wider than any other; use less stock or a larger --step-over",
            options.stock,
            widest,
        )
    if options.strategy == "adaptive" and options.max_engagement is None:
        raise OptionError("--strategy adaptive needs an engagement limit; give --max-engagement")
    return PocketRules(
        tool_diameter=diameter,
        step_over=widest,
        stock=options.stock,
        climb=milling == "climb",
        tolerance=min(tolerance, TOLERANCE_SHARE * widest),
        max_engagement=options.max_engagement,
    )


def divide_into_levels(
    depth: float,
    step_down: float | None,
    diameter: float,
    begin: float = 0.0,
    thickness: float | None = None,
    beyond: float = 0.0,
) -> PocketLevels:
    """Divide a pocket into equal levels that do not exceed the step-down.

    Parameters
    ----------
    depth
        Depth of the floor below Z0, mm.
    begin
        Height of the top of the material, mm. It is negative if the pocket starts lower than Z0, for example in the
        floor of another pocket.
    thickness, beyond
        Thickness of the plate, and break-through below the plate, mm.

    Raises
    ------
    OptionError
        The pocket is deeper than the plate and the break-through together, or it has too many levels.
    """
    if thickness is not None and depth > thickness + beyond + 1e-9:
        raise OptionError(
            "a pocket {:g} mm deep goes through the plate of --thickness {:g} mm by more than --break-through "
            "{:g} mm, so the tool would mill the table; make the pocket less deep",
            depth,
            thickness,
            beyond,
        )
    step, high = step_down or 0.5 * diameter, depth + begin
    count = max(math.ceil(high / step - 1e-9), 1)
    if count > MOST_LEVELS:
        raise OptionError(
            "--step-down {:g} mm gives {:,} levels, but the maximum is {:,}; give a larger --step-down",
            step,
            count,
            MOST_LEVELS,
        )
    return PocketLevels(begin, tuple(begin - high * level / count for level in range(1, count + 1)))


def select_pockets(part: Part, depth: float | None, diameter: float | None) -> tuple[Part, list[Issue]]:
    """Select the pockets to mill, and determine their depths.

    All pockets of a drawing are `depth` mm deep. The pockets of a solid have their own depths, so `depth` only selects
    among them. A round pocket that is not wider than the tool counts as a hole.

    Returns
    -------
    part
        The part with only the pockets to mill.
    issues
        Issues about all other pockets.

    Raises
    ------
    OptionError
        The pockets of a drawing need a depth.
    PlanError
        No pocket of a solid is wider than the tool and has the requested depth.
    """
    if not any(pocket.depth is not None for pocket in part.pockets):
        if depth is None:
            raise OptionError("a pocket needs its depth; give --depth, such as --depth 5mm")
        return replace(part, pockets=tuple(replace(pocket, depth=depth) for pocket in part.pockets)), []
    issues = _opening_issues(part, diameter)
    wide = [pocket for pocket in part.pockets if not _is_hole(pocket, diameter)]
    if holes := len(part.pockets) - len(wide):
        words = Message(
            "the program does not mill {} no wider than the tool; drill such holes instead",
            count_of(holes, "round pocket"),
        )
        issues.append(Issue("L219", words, severity=Severity.NOTE))
    if not wide:
        raise PlanError("{}: no pocket is wider than the tool; choose a smaller --tool-diameter", part.name)
    chosen = wide if depth is None else [pocket for pocket in wide if abs((pocket.depth or 0.0) - depth) <= SAME_HEIGHT]
    there = _depth_summary(wide)
    if not chosen:
        raise PlanError(
            "{}: no pocket is --depth {:g} mm deep; the solid has pockets of {}; leave --depth out to mill "
            "each to its own floor",
            part.name,
            depth,
            there,
        )
    if left := len(wide) - len(chosen):
        words = Message(
            "the program leaves out {} of other depths than --depth {:g} mm; the solid has pockets of {}",
            count_of(left, "pocket"),
            depth,
            there,
        )
        issues.append(Issue("L219", words, severity=Severity.NOTE))
    return replace(part, pockets=tuple(chosen)), issues


def _opening_issues(part: Part, diameter: float | None) -> list[Issue]:
    narrow = [
        opening for opening in part.openings if diameter is not None and opening.diameter <= diameter + SAME_HEIGHT
    ]
    wide = tuple(opening.outline for opening in part.openings if not any(opening is other for other in narrow))
    issues = []
    if wide:
        places = tuple(
            (round(0.5 * (x0 + x1), 2), round(0.5 * (y0 + y1), 2))
            for x0, y0, x1, y1 in (opening.extents for opening in wide)
        )
        words = Message(
            "the program does not mill {} through the part, because a pocket has a floor",
            count_of(len(wide), "round opening"),
        )
        at = ", ".join(f"({x:g}, {y:g})" for x, y in places[:3]) + (" …" if len(places) > 3 else "")
        issues.append(
            Issue("L219", words, Message("at {}", at), missing=MissingWork("opening", len(wide), places, wide))
        )
    if narrow:
        words = Message(
            "the program does not mill {} no wider than the tool; drill such holes instead",
            count_of(len(narrow), "round opening"),
        )
        issues.append(Issue("L219", words, severity=Severity.NOTE))
    return issues


def _depth_summary(pockets: Sequence[Pocket]) -> str:
    """Describe the depths of the pockets as text, for example ``6 mm (1 pocket), 8 mm (2 pockets)``."""
    counted = Counter(round(pocket.depth or 0.0, 3) for pocket in pockets)
    return ", ".join(f"{deep:g} mm ({count_of(counted[deep], 'pocket')})" for deep in sorted(counted))


def enclosing_pockets(pockets: Sequence[Pocket], tolerance: float) -> list[int | None]:
    """Find the pocket whose floor contains each pocket. Return the index of this enclosing pocket, or None."""
    shapes = [pocket.region(tolerance) for pocket in pockets]
    around: list[int | None] = []
    for pocket, shape in zip(pockets, shapes, strict=True):
        deep = pocket.depth or 0.0
        over = [
            k
            for k, other in enumerate(pockets)
            if (other.depth or 0.0) < deep - SAME_HEIGHT and shape.difference(shapes[k].buffer(tolerance)).is_empty
        ]
        around.append(max(over, key=lambda k: pockets[k].depth or 0.0, default=None))
    return around


def _is_hole(pocket: Pocket, diameter: float | None) -> bool:
    x0, y0, x1, y1 = pocket.outline.extents
    round_ = bool((pocket.outline.bulges != 0.0).all()) and abs((x1 - x0) - (y1 - y0)) < SAME_HEIGHT
    return round_ and not pocket.islands and diameter is not None and x1 - x0 <= diameter + SAME_HEIGHT


def finishing_levels(levels: PocketLevels, diameter: float) -> tuple[float, ...]:
    """Return the heights of the finishing passes, mm. Each pass is at most two diameters deep."""
    depth = levels.depth
    count = max(math.ceil(depth / (FINISHING_DEPTH * diameter) - 1e-9), 1)
    return tuple(levels.begin - depth * level / count for level in range(1, count + 1))


def corner_rounding(machine: Machine, feed: float) -> float:
    """Return the maximum distance between the tool and a corner, mm, if the next move starts before the tool stops.

    With acceleration a and velocity v, slowing down and speeding up each take the time v / a. After half this time,
    each of the two moves is v² / 8a away from the corner. If the path turns by θ, the tool is then 2 sin(θ / 2) v² / 8a
    away from the corner. This distance is at most v² / 4a.
    """
    return feed * feed / (4.0 * min(machine.acceleration[:2]))
