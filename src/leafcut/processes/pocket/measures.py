"""What a path over one level of a pocket does, in figures: lengths, what it takes and leaves, and its time."""

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

#: Height of the tool over the work between two pieces, mm, where it is not told.
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
    """Return what a path over one level of a pocket does.

    Areas are those of `removal`, engagement and step-over those of `material.engagement` and `material.step_over`.
    Air is feed on which nothing is engaged. The first stroke of the tool into full material counts as half a turn. A
    piece of the kind ``entry`` is left out of engagement, air and step-over: it is cut on the way down, and with it
    what it goes round.

    Parameters
    ----------
    machine
        Whose accelerations the time is for; None: no time is told.
    feed
        Feed in the plane, mm/s; None: the machine's highest.
    lift
        How high the tool is lifted between pieces, mm: by a rapid, and down again at feed.
    found
        What `removal` found, where it is known already.
    looked
        What `engaged_way` returned, where it is known already.

    Raises
    ------
    PlanError
        The pocket's outline or islands cross themselves or touch.
    """
    found = removal(pocket, path, rules) if found is None else found
    way, (engaged, width, _) = engaged_way(path, rules) if looked is None else looked
    entry = entered(path, way)
    step = np.where(entry, 0.0, way.step)
    length = float(step.sum())
    opened = [shapely.Polygon(piece.path.flattened()) for piece in path.pieces if piece.kind == "entry"]
    gaps = widest_gaps(way, found.centres.difference(shapely.union_all(opened)), rules, ~entry)
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
    """Return a path as motions at one level, lifted by `lift` mm between pieces, without approach and departure."""
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
