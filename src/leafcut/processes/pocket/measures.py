"""Measures of a path over one level of a pocket: lengths, areas, step-over, engagement, and time."""

from __future__ import annotations

import numpy as np
import shapely

from leafcut.material.engagement import Engaged
from leafcut.material.removal import Removal, engaged_way, entered, much_wider, removal
from leafcut.material.step_over import widest_gaps
from leafcut.material.tool_steps import ToolWay
from leafcut.model.machine import Machine
from leafcut.model.pocket import Pocket, PocketMeasures, PocketPath, PocketRules
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder
from leafcut.timing.toolpath import measure

#: Default height of the tool above the level between two pieces, mm.
LIFT = 5.0


def measure_path(
    pocket: Pocket,
    path: PocketPath,
    rules: PocketRules,
    machine: Machine | None = None,
    *,
    feed: float | None = None,
    lift: float = LIFT,
    found: Removal | None = None,
    looked: tuple[ToolWay, Engaged] | None = None,
) -> PocketMeasures:
    """Return the measures of a path over one level of a pocket.

    Areas come from `removal`, engagement and step-over from `material.engagement` and `material.step_over`. Air is feed
    without engagement. The first cut into full material counts as an engagement of half a turn. Pieces of the kind
    ``entry`` do not count for engagement, air and step-over, because the tool clears them during its descent.

    Parameters
    ----------
    machine
        Machine for the time; None: the time is 0.
    feed
        Feed in the plane, mm/s; None: the maximum feed of the machine.
    lift
        Height of the tool between pieces, mm: up by a rapid, down at feed.
    found
        Result of `removal`, if known.
    looked
        Result of `engaged_way`, if known.

    Raises
    ------
    PlanError
        The pocket's outline or islands cross themselves or touch.
    """
    found = removal(pocket, path, rules) if found is None else found
    samples, (engaged, width, _) = engaged_way(path, rules) if looked is None else looked
    entry = entered(path, samples)
    step = np.where(entry, 0.0, samples.step)
    length = float(step.sum())
    opened = [shapely.Polygon(piece.path.flattened()) for piece in path.pieces if piece.kind == "entry"]
    gaps = widest_gaps(samples, found.centres.difference(shapely.union_all(opened)), rules, ~entry)
    return PocketMeasures(
        feed_mm=path.feed_mm,
        rapid_mm=path.rapid_mm,
        retracts=path.retracts,
        finish_mm=path.finish_mm,
        gouge_mm2=float(found.gouges.area),
        reachable_mm2=float(found.reachable.area),
        uncovered_mm2=float(found.uncovered.area),
        max_step_over=gaps.step_over,
        max_core=gaps.core,
        max_engagement=float(engaged.max(initial=0.0)),
        mean_engagement=float(engaged @ step) / length if length > 0.0 else 0.0,
        max_width=float(width.max(initial=0.0)),
        wide_mm=float(step[width > much_wider(rules)].sum()),
        air_mm=float(step[engaged == 0.0].sum()),
        floor_mm=float(found.centres.area) / rules.step_over,
        time_s=0.0 if machine is None else measure(plane_toolpath(path, machine, feed, lift), machine).time_s,
    )


def plane_toolpath(path: PocketPath, machine: Machine, feed: float | None = None, lift: float = LIFT) -> Toolpath:
    """Return the motion of a path at one level, lifted by `lift` mm between pieces, without approach and departure."""
    speed = machine.max_feed if feed is None else feed
    builder = ToolpathBuilder()
    for gap, piece in zip((1.0, *path.gaps), path.pieces, strict=False):
        if gap:
            if len(builder):
                builder.rapid(z=lift)
            builder.rapid(*piece.path.start, z=lift if len(builder) else 0.0)
            builder.feed(z=0.0, feed=speed)
        for s in piece.path.segments():
            if s.is_arc:
                builder.arc(s.bulge < 0.0, (*s.end, 0.0), Arc((*s.center, 0.0)), feed=speed)
            else:
                builder.feed(*s.end, feed=speed)
    return builder.build()
