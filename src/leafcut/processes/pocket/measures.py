"""Measures of a path on one level of a pocket: lengths, areas, step-over, and engagement."""

from __future__ import annotations

import numpy as np
import shapely

from leafcut.material.engagement import Engaged
from leafcut.material.removal import engaged_tool_path, entry_mask, removal, reported_width
from leafcut.material.step_over import widest_gaps
from leafcut.material.tool_steps import ToolSteps
from leafcut.model.pocket import Pocket, PocketMeasures, PocketPath, PocketRules


def measure_path(
    pocket: Pocket, path: PocketPath, rules: PocketRules, engaged: tuple[ToolSteps, Engaged] | None = None
) -> PocketMeasures:
    """Return the measures of a path on one level of a pocket.

    Feed moves without engagement count as air. The first cut into full material has an engagement of 180°. Entry loops
    are not part of engagement, air and step-over, because the tool clears them while it descends. `engaged` is the
    result of `engaged_tool_path`, if known. Raises PlanError if the outline or the islands of the pocket cross
    themselves or touch.
    """
    removed = removal(pocket, path, rules)
    samples, (angle, width, _) = engaged_tool_path(path, rules) if engaged is None else engaged
    entry = entry_mask(path, samples)
    step = np.where(entry, 0.0, samples.step)
    length = float(step.sum())
    opened = [shapely.Polygon(piece.path.flattened()) for piece in path.pieces if piece.kind == "entry"]
    gaps = widest_gaps(samples, removed.centres.difference(shapely.union_all(opened)), rules, ~entry)
    return PocketMeasures(
        feed_mm=path.feed_mm,
        rapid_mm=path.rapid_mm,
        retracts=path.retracts,
        finish_mm=path.finish_mm,
        gouge_mm2=float(removed.gouges.area),
        reachable_mm2=float(removed.reachable.area),
        uncovered_mm2=float(removed.uncovered.area),
        max_step_over=gaps.step_over,
        max_core=gaps.core,
        max_engagement=float(angle.max(initial=0.0)),
        mean_engagement=float(angle @ step) / length if length > 0.0 else 0.0,
        max_width=float(width.max(initial=0.0)),
        wide_mm=float(step[width > reported_width(rules)].sum()),
        air_mm=float(step[angle == 0.0].sum()),
        floor_mm=float(removed.centres.area) / rules.step_over,
    )
