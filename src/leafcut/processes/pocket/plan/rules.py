"""What one run's options say of its pockets: rules in the plane, levels, the end mill and its feeds."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from leafcut.errors import OptionError, PlanError, count_of
from leafcut.geometry.regions import region
from leafcut.material.chip_feeds import plunge_feed, ramp_feed
from leafcut.model.feed_limits import FeedLimits
from leafcut.model.heights import SAME_HEIGHT
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.model.pocket import Pocket, PocketLevels, PocketRules
from leafcut.model.tool import Tool
from leafcut.options import JobOptions
from leafcut.processes.pocket.options import PocketOptions
from leafcut.processes.pocket.plan.tool import with_data
from leafcut.processes.spindle_moves import check_spindle_heights

#: How far a path may leave the exact one, mm, and as a share of the step-over: passes that are close are as true.
TOLERANCE, TRUE = 0.01, 0.05

#: Step-over where none is given, as a share of the diameter.
STEP_OVER = 0.6
#: Straight down an end mill cuts with its centre, where nothing turns: a third of the feed.
PLUNGE_PART = 1.0 / 3.0
#: A pocket of more levels is a mistake.
MOST_LEVELS = 2000
#: A finishing pass is at most so many diameters deep.
FINISHING_DEPTH = 2.0


@dataclass(frozen=True)
class MillingData:
    """The tool, its feed straight down (mm/s), and how it comes down to a level (rad for a ramp or a helix).

    `air_feed` is the feed at depth where nothing is cut, mm/s; no more than that of the tool: all is gone at that.
    `limits` are those of feeds that follow what the tool meets; None: a ramp goes as fast as the feed straight down
    allows.
    """

    tool: Tool
    plunge_feed: float
    entry: str = "ramp"
    entry_angle: float = math.radians(3.0)
    air_feed: float = 0.0
    limits: FeedLimits | None = None

    def ramp_feed(self, depth: float) -> float:
        """Return the feed of a ramp or a helix that ends so far below what is uncut, mm, along its slope, mm/s."""
        feed = min(self.tool.feed, self.plunge_feed / math.sin(self.entry_angle))
        return feed if self.limits is None else ramp_feed(self.limits, feed, self.entry_angle, depth)

    @property
    def straight_feed(self) -> float:
        """The feed straight down into the material, mm/s: that of the tool, or within the power of the spindle."""
        return self.plunge_feed if self.limits is None else plunge_feed(self.limits, self.plunge_feed)


def rules_of(
    options: PocketOptions, step_over: float | None, diameter: float | None, tolerance: float = TOLERANCE
) -> PocketRules:
    """Return how pockets are cleared in the plane; `step_over` is a share of the diameter.

    Raises
    ------
    OptionError
        The diameter of the tool is missing, or a strategy
        lacks what it needs.
    """
    if diameter is None:
        raise OptionError(
            "a pocket needs the diameter of its end mill; give --tool-diameter, or a tool library with --tools"
        )
    widest = (step_over or STEP_OVER) * diameter
    if options.stock > widest:
        raise OptionError(
            f"--stock {options.stock:g} mm is more than the step-over of {widest:.4g} mm: the finishing pass would "
            "cut wider than any other; give less stock or a larger --step-over"
        )
    if options.strategy == "adaptive" and options.max_engagement is None:
        raise OptionError("--strategy adaptive needs an engagement limit; give --max-engagement")
    return PocketRules(
        tool_diameter=diameter,
        step_over=widest,
        stock=options.stock,
        climb=options.milling == "climb",
        tolerance=min(tolerance, TRUE * widest),
        max_engagement=options.max_engagement,
    )


def levels_of(
    depth: float,
    step_down: float | None,
    diameter: float,
    begin: float = 0.0,
    thickness: float | None = None,
    beyond: float = 0.0,
) -> PocketLevels:
    """Return the levels of a pocket `depth` mm below the top: equal steps, none larger than the step-down.

    Parameters
    ----------
    begin
        Where its material begins, mm; negative in the floor of another pocket.
    thickness, beyond
        Of the plate, and how far below it the tool may come, mm.

    Raises
    ------
    OptionError
        The pocket goes farther through the plate than a break-through, or so many levels cannot be meant.
    """
    if thickness is not None and depth > thickness + beyond + 1e-9:
        raise OptionError(
            f"a pocket of {depth:g} mm is below the plate of --thickness {thickness:g} mm by more than "
            f"--break-through {beyond:g} mm: the tool would mill what the plate lies on"
        )
    step, high = step_down or 0.5 * diameter, depth + begin
    count = max(math.ceil(high / step - 1e-9), 1)
    if count > MOST_LEVELS:
        raise OptionError(f"--step-down {step:g} mm gives {count:,} levels; {MOST_LEVELS:,} are the most")
    return PocketLevels(begin, tuple(begin - high * level / count for level in range(1, count + 1)))


def milled_pockets(part: Part, depth: float | None, diameter: float | None) -> tuple[Part, list[Issue]]:
    """Return the pockets to mill, each with its depth, and what is left out.

    A drawing says no depth: all its pockets are `depth` deep. In a solid each has its own; `depth` chooses those that
    are so deep. What is round and no wider than the tool is a hole.

    Raises
    ------
    OptionError
        The pockets of a drawing have no depth.
    PlanError
        No pocket of a solid is wider than the tool, or as deep as asked for.
    """
    if not any(one.depth is not None for one in part.pockets):
        if depth is None:
            raise OptionError("a pocket needs its depth; give --depth")
        return replace(part, pockets=tuple(replace(one, depth=depth) for one in part.pockets)), []
    issues = _openings(part, diameter)
    wide = [one for one in part.pockets if not _is_hole(one, diameter)]
    if holes := len(part.pockets) - len(wide):
        words = f"{count_of(holes, 'round pocket')} no wider than the tool, not milled: drill them"
        issues.append(Issue("L219", words, severity=Severity.NOTE))
    if not wide:
        raise PlanError(f"{part.name}: no pocket is wider than the tool; choose a smaller --tool-diameter")
    chosen = wide if depth is None else [one for one in wide if abs((one.depth or 0.0) - depth) <= SAME_HEIGHT]
    there = _depths(wide)
    if not chosen:
        raise PlanError(
            f"{part.name}: no pocket is --depth {depth:g} mm deep; there are {there}; leave --depth out to mill "
            "each to its own floor"
        )
    if left := len(wide) - len(chosen):
        words = (
            f"{count_of(left, 'pocket')} of another depth left out, as --depth {depth:g} mm asks for: the solid has "
            f"{there}"
        )
        issues.append(Issue("L219", words, severity=Severity.NOTE))
    return replace(part, pockets=tuple(chosen)), issues


def _openings(part: Part, diameter: float | None) -> list[Issue]:
    """Return the round openings through a solid: a drill makes those no wider than the tool, the others are missing."""
    narrow = [one for one in part.openings if diameter is not None and one.diameter <= diameter + SAME_HEIGHT]
    wide = tuple(one.outline for one in part.openings if not any(one is other for other in narrow))
    issues = []
    if wide:
        places = tuple(
            (round(0.5 * (x0 + x1), 2), round(0.5 * (y0 + y1), 2)) for x0, y0, x1, y1 in (one.extents for one in wide)
        )
        words = f"{count_of(len(wide), 'round opening')} through the part, not milled: a pocket has a floor"
        at = ", ".join(f"({x:g}, {y:g})" for x, y in places[:3]) + (" …" if len(places) > 3 else "")
        issues.append(Issue("L219", words, f"at {at}", missing=MissingWork("opening", len(wide), places, wide)))
    if narrow:
        words = f"{count_of(len(narrow), 'round opening')} no wider than the tool, not milled: drill them"
        issues.append(Issue("L219", words, severity=Severity.NOTE))
    return issues


def _depths(pockets: Sequence[Pocket]) -> str:
    """Return ``6 mm (1 pocket), 8 mm (2 pockets)``."""
    counted = Counter(round(one.depth or 0.0, 3) for one in pockets)
    return ", ".join(f"{deep:g} mm ({count_of(counted[deep], 'pocket')})" for deep in sorted(counted))


def lying_in(pockets: Sequence[Pocket], tolerance: float) -> list[int | None]:
    """Return in the floor of which other pocket each lies, the deepest of several; None where in none.

    Whatever stands in a pocket is an island of it: so all that is above a pocket in its floor is cleared with it.
    """
    shapes = [region(one.outline, one.islands, tolerance, one.label) for one in pockets]
    around: list[int | None] = []
    for one, shape in zip(pockets, shapes, strict=True):
        deep = one.depth or 0.0
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
    """Return the heights at which the walls are finished, the last at full depth: each at most two diameters deeper."""
    depth = levels.depth
    count = max(math.ceil(depth / (FINISHING_DEPTH * diameter) - 1e-9), 1)
    return tuple(levels.begin - depth * level / count for level in range(1, count + 1))


def milling_data(
    options: PocketOptions,
    job: JobOptions,
    rules: PocketRules,
    machine: Machine,
    mill: Tool | None = None,
) -> tuple[MillingData, list[Issue]]:
    """Return the end mill, `mill` of a library or an assumed one, with its feeds, and what was assumed of it.

    Raises
    ------
    PlanError
        The machine has no spindle, its heights contradict each other, or it cannot turn or feed as asked.
    """
    check_spindle_heights(machine, job, "mill a pocket")
    tool, issues = with_data(mill, options, job, rules, machine)
    plunge = options.plunge_feed or tool.plunge_feed or PLUNGE_PART * tool.feed
    return MillingData(
        tool, min(plunge, machine.max_feed), options.entry, options.entry_angle, machine.max_feed
    ), issues


def corner_rounding(machine: Machine, feed: float) -> float:
    """Return how far the tool leaves a corner at most where the next move begins while this one brakes, mm.

    Both moves at the acceleration a take v / a; half way each has v² / 8a to the corner. A turn by θ is left by
    2 sin(θ / 2) v² / 8a, at most a quarter of v² / a.
    """
    return feed * feed / (4.0 * min(machine.acceleration[:2]))
