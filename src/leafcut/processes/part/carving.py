"""Collect the shapes to carve, and check that the V-bit is long and wide enough for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from leafcut.errors import PlanError, count_of
from leafcut.geometry.arrays import Floats
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.model.tool import Tool
from leafcut.options import Settings
from leafcut.processes.part.clearing import drawn_areas, refuse_overlap
from leafcut.processes.part.model import Carving, PocketArea
from leafcut.processes.part.operations import LayeredPart, LayerRule, Operation
from leafcut.processes.part.plan.carving import carving_axis
from leafcut.processes.part.plan.chamfers import v_bit
from leafcut.processes.part.plan.outlines import missing_paths

#: Minimum thickness of the plate below a carved shape, mm.
_SKIN = 0.1
#: Minimum radius of a place that is reported because it is narrower than the tip, in radii of the tip. Remainders in
#: corners are smaller.
_NARROW = 0.5


def carvings_of(
    divided: LayeredPart, settings: Settings, tools: Mapping[int, Tool], pockets: Sequence[PocketArea], thickness: float
) -> tuple[list[Carving], list[list[Floats]], list[Issue]]:
    """Return the shapes to carve, the paths of the tip in each shape, and issues.

    Raises
    ------
    PlanError, ReadError
        An outline is open, or it crosses another outline. A shape overlaps another shape or a pocket. A shape is too
        wide or too narrow for its V-bit.
    """
    carvings: list[Carving] = []
    axes: list[list[Floats]] = []
    issues: list[Issue] = []
    narrow: list[PocketArea] = []
    for rule, contours in divided.faces_of(Operation.VCARVE):
        tool = tools[rule.tool or 0]
        bit = v_bit(tool)
        for drawn in drawn_areas(rule, contours, settings, issues):
            name = Message("the shape at ({:.4g}, {:.4g}) on layer {}", *drawn.outline.start, drawn.layer)
            area = replace(drawn, name=name)
            refuse_overlap(rule, area, [*pockets, *(carving.area for carving in carvings)])
            axis = carving_axis(area.region, bit)
            if not axis:
                raise PlanError("{}: {} is narrower than the tip of {}", rule.place, name, tool.label)
            wide = area.region.buffer(-bit.tip).buffer(bit.tip)
            if bit.tip and not (area.region - wide).buffer(-_NARROW * bit.tip).is_empty:
                narrow.append(area)
            deepest = -min(float(branch[:, 2].min()) for branch in axis)
            limit = _limit(rule, name, deepest, tool, thickness)
            carvings.append(Carving(replace(area, depth=round(deepest, 6)), bit, limit))
            axes.append(axis)
    if narrow:
        words = Message(
            "{} with places narrower than the tip of the V-bit, not carved there", count_of(len(narrow), "shape")
        )
        where = Message("the first at ({:.4g}, {:.4g}): use a sharper V-bit", *narrow[0].outline.start)
        missing = missing_paths("shape", [area.outline for area in narrow])
        issues.append(Issue("L707", words, where, missing=missing))
    return carvings, axes, issues


def _limit(rule: LayerRule, name: str, deepest: float, tool: Tool, thickness: float) -> float:
    """Return the maximum depth, mm. Raises PlanError if the shape is deeper."""
    bit = v_bit(tool)
    limits = [
        (thickness - _SKIN, Message("the plate")),
        (tool.reach, Message("the length of {}", tool.label)),
        ((bit.radius - bit.tip) / bit.spread, Message("the diameter of {}", tool.label)),
        *([(rule.depth, Message("the file"))] if rule.depth else []),
    ]
    limit, reason = min(limits, key=lambda pair: pair[0])
    if deepest > limit + 1e-6:
        raise PlanError(
            "{}: {} is {:.4g} mm wide, so its carving is {:.4g} mm deep, but {} allows at most {:.4g} mm; use a V-bit "
            "with a larger angle or diameter, give a larger depth, or use 'pocket'",
            rule.place,
            name,
            2.0 * (bit.tip + deepest * bit.spread),
            deepest,
            reason,
            limit,
        )
    return limit
